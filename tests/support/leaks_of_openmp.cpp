// What LeakSanitizer is not to report: clang's OpenMP library keeps memory of its threads until the program has ended.

extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libomp\n"; }
