/// \file The compilers that firn needs. Other compilers stop here with a clear message.
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
