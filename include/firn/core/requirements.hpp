/// \file The compilers, the exceptions and the arithmetic that firn needs. Other compilers, and options that change
/// these, stop here with a clear message.
///
/// An error directive alone does not stop a compiler. Including a header that does not exist stops it, and the header's
/// name tells the reason.
#pragma once

// AppleClang's version numbers are not those of clang: AppleClang 17 is made from LLVM 19.
#if __cplusplus < 202002L || (!defined(__clang__) && !defined(__GNUC__)) ||              \
    (defined(__apple_build_version__) && __clang_major__ < 17) ||                        \
    (defined(__clang__) && !defined(__apple_build_version__) && __clang_major__ < 16) || \
    (defined(__GNUC__) && !defined(__clang__) && __GNUC__ < 12)
#if defined(_MSC_VER) && !defined(__clang__)
#error \
    "firn does not compile with MSVC, which has no vector types (vector_size, ext_vector_type) for SIMD lanes. Use clang or g++."
#include <firn needs another compiler>
#elif __cplusplus < 202002L && (defined(__clang__) || defined(__GNUC__))
#error "firn needs C++20: compile with -std=c++20, or in CMake target_compile_features(NAME PRIVATE cxx_std_20)."
#include <firn needs C++20>
#else
#error "firn needs g++ 12, clang 16 or AppleClang 17, or later: it uses their vector types for SIMD lanes."
#include <firn needs a later compiler>
#endif
#endif

#if !defined(__EXCEPTIONS) && !defined(__cpp_exceptions)
#error \
    "firn does not compile with -fno-exceptions: its errors are exceptions (firn/core/error.hpp). Compile the files that include firn without it; clang's -fignore-exceptions is allowed: there an error ends the program."
#include <firn does not compile with -fno-exceptions>
#endif

// firn rounds numbers by adding and subtracting a large one, and adds up rounding errors: with -ffast-math the compiler
// leaves this out, and pow(1.7, 2.3) is 4. Some of the checks of input are comparisons with NaN and infinity.
#if defined(__FAST_MATH__)
#error \
    "firn does not work with -ffast-math (also part of -Ofast): sums, sines and powers would be wrong. Compile the files that include firn without it, or write -fno-fast-math after it."
#include <firn does not work with -ffast-math>
#elif defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) || defined(__NO_SIGNED_ZEROS__)
#error \
    "firn does not work with -funsafe-math-optimizations and its parts -fassociative-math, -freciprocal-math and -fno-signed-zeros: sums, sines and powers would be wrong. Compile the files that include firn without it."
#include <firn does not work with -funsafe-math-optimizations>
#elif defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__
#error \
    "firn does not work with -ffinite-math-only: its checks for NaN and infinity would be left out. Compile the files that include firn without it."
#include <firn does not work with -ffinite-math-only>
#elif defined(__FLT_EVAL_METHOD__) && (__FLT_EVAL_METHOD__ == 1 || __FLT_EVAL_METHOD__ == 2)
#error \
    "firn needs sums and products that are rounded to their type, which this processor's x87 registers do not do. Compile with -msse2 -mfpmath=sse."
#include <firn needs -mfpmath=sse>
#endif

#if defined(__clang__)
// clang has no macro for -funsafe-math-optimizations and its parts. It refuses this pragma if one of them is given.
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wignored-pragmas"
// clang-format off
#pragma float_control(except, on, push)  // firn does not work with -funsafe-math-optimizations and its parts (-fassociative-math, …): compile the files that include firn without them
// clang-format on
#pragma float_control(pop)
#pragma clang diagnostic pop
// Some targets, such as WebAssembly, ignore that pragma. There this one holds, from here on to the end of the file.
#pragma clang fp reassociate(off)
#if __clang_major__ >= 18 || defined(__apple_build_version__)
#pragma clang fp reciprocal(off)
#endif
#else
static_assert(0.1 != 0.1F, "firn needs constants of double: compile without -fsingle-precision-constant.");
#endif

#include <firn/core/build.hpp>
