/// \file Linked with examples that take no arguments, whose sources are to stay as short as they can be: says so in one
/// line and ends the program with 2 if there is one, before main() begins.
#include <cstdio>
#include <cstdlib>
#include <cstring>

// Other C libraries give such a function no arguments.
#if defined(__GLIBC__) || defined(__APPLE__)
namespace {

[[gnu::constructor]] void refuse_arguments(int count, char** arguments) {
    if (count < 2) return;
    const char* slash = std::strrchr(arguments[0], '/');
    const char* name = slash ? slash + 1 : arguments[0];
    std::fprintf(stderr, "%s takes no arguments; examples/%s.cpp says what it does.\n", name, name);
    std::_Exit(2);
}

}  // namespace
#endif
