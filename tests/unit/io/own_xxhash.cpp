/// \file A program that uses xxHash itself, in each of its modes, is not disturbed by firn's copy, nor firn's by it.
// "xxhash.h": xxHash under its own names, made by tests/unit/CMakeLists.txt.
// clang-format off: the order matters
#define XXH_NAMESPACE program_
#include "xxhash.h"

#include "support/catch.hpp"
#include <firn/io/states.hpp>
// clang-format on

#if defined(FIRN_XXH_INLINE_ALL) || defined(FIRN_XXH_VECTOR) || defined(FIRN_XXH3_64bits)
#error "firn's copy leaves macros behind"
#endif
#undef XXH_NAMESPACE
#define XXH_INLINE_ALL
#include "xxhash.h"

#include <string>

TEST_CASE("firn's xxHash and the program's own in one translation unit give the same", "[io]") {
    for (const std::size_t length : {0, 1, 100, 1000, 100'000}) {  // each has a way of its own
        const std::string text(length, 'x');
        CHECK(firn::detail::hash_bytes(std::as_bytes(std::span(text))) == XXH3_64bits(text.data(), text.size()));
    }
}
