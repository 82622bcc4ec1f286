/// \file The name of the build: the instruction set, the options and the compiler that a file is compiled with.
///
/// All of firn lies in an inline namespace of this name. Programs write `firn::Simulation` as if the namespace were not
/// there; messages of compilers and debuggers show it, e.g. as `firn::v3_omp_g12::Simulation`.
///
/// The files of a program may be compiled with different options, e.g. one of them for old processors and one for those
/// with AVX2. If two files have a template or an inline function of the same name, the linker keeps one of the two and
/// uses it in both files. Without the name of the build, the file for old processors would run instructions that such
/// processors lack, and the bits of the results would depend on the order of linking. With it, each file has the code
/// and the bits that it has in a program of its own. Where one file calls a function of another with firn's types, both
/// need the same build; if they differ, the linker reports an undefined reference that shows the caller's build.
///
/// The name holds what the preprocessor knows. That is not all: -mtune, -ffp-contract and the difference between -O1
/// and -O2 also change which products and sums a compiler fuses if the processor has FMA. Give these options to all
/// files alike.
#pragma once

/// \cond the parts of the name
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define FIRN_SANITIZED
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define FIRN_SANITIZED
#endif
#endif

// The processor. Of x86-64: the level, v1 to v4, and registers beyond it.
#if defined(__AVX2__) && defined(__FMA__) && defined(__F16C__) && defined(__BMI2__) && defined(__LZCNT__)
#if defined(__AVX512BW__) && defined(__AVX512CD__) && defined(__AVX512DQ__) && defined(__AVX512VL__)
#define FIRN_BUILD_PROCESSOR v4
#elif defined(__AVX512DQ__)
#define FIRN_BUILD_PROCESSOR v3_avx512dq
#elif defined(__AVX512F__)
#define FIRN_BUILD_PROCESSOR v3_avx512
#else
#define FIRN_BUILD_PROCESSOR v3
#endif
#elif defined(__AVX512DQ__)
#define FIRN_BUILD_PROCESSOR v2_avx512dq
#elif defined(__AVX512F__)
#define FIRN_BUILD_PROCESSOR v2_avx512
#elif defined(__AVX2__)
#define FIRN_BUILD_PROCESSOR v2_avx2
#elif defined(__AVX__)
#define FIRN_BUILD_PROCESSOR v2_avx
#elif defined(__SSE4_2__)
#define FIRN_BUILD_PROCESSOR v2
#elif defined(__SSE4_1__)
#define FIRN_BUILD_PROCESSOR v1_sse4
#elif defined(__SSE3__)
#define FIRN_BUILD_PROCESSOR v1_sse3
#elif defined(__SSE2__)
#define FIRN_BUILD_PROCESSOR v1
#elif defined(__ARM_FEATURE_SVE)
#define FIRN_BUILD_PROCESSOR arm64_sve
#elif defined(__aarch64__)
#define FIRN_BUILD_PROCESSOR arm64
#elif defined(__wasm_simd128__)
#define FIRN_BUILD_PROCESSOR wasm_simd
#else
#define FIRN_BUILD_PROCESSOR plain
#endif

// What some processors of a level have: fused multiply-add below v3; n for VNNI, b for VBMI, h for FP16.
#if defined(__FMA4__)
#define FIRN_BUILD_FMA _fma4
#elif defined(__FMA__) && !(defined(__AVX2__) && defined(__F16C__) && defined(__BMI2__) && defined(__LZCNT__))
#define FIRN_BUILD_FMA _fma
#else
#define FIRN_BUILD_FMA
#endif
#if defined(__AVX512VNNI__) || defined(__AVXVNNI__) || defined(__ARM_FEATURE_DOTPROD)
#define FIRN_BUILD_N n
#else
#define FIRN_BUILD_N
#endif
#if defined(__AVX512VBMI__)
#define FIRN_BUILD_B b
#else
#define FIRN_BUILD_B
#endif
#if defined(__AVX512FP16__) || defined(__ARM_FEATURE_FP16_VECTOR_ARITHMETIC)
#define FIRN_BUILD_H h
#else
#define FIRN_BUILD_H
#endif
#if defined(__ARM_FEATURE_ATOMICS) || defined(__wasm_atomics__)
#define FIRN_BUILD_ATOMICS _atomics
#else
#define FIRN_BUILD_ATOMICS
#endif

// Options. Containers of _GLIBCXX_DEBUG have other sizes, and so have firn's classes that contain them.
#if defined(_OPENMP)
#define FIRN_BUILD_OPENMP _omp
#else
#define FIRN_BUILD_OPENMP
#endif
#if defined(__OPTIMIZE__)
#define FIRN_BUILD_OPTIMISED
#else
#define FIRN_BUILD_OPTIMISED _O0
#endif
#if defined(FIRN_SANITIZED)
#define FIRN_BUILD_SANITIZED _sanitized
#else
#define FIRN_BUILD_SANITIZED
#endif
#if defined(_GLIBCXX_DEBUG)
#define FIRN_BUILD_CONTAINERS _debug
#else
#define FIRN_BUILD_CONTAINERS
#endif
#if defined(FIRN_PORTABLE_ROWS)
#define FIRN_BUILD_ROWS _rows
#else
#define FIRN_BUILD_ROWS
#endif

#if defined(__apple_build_version__)
#define FIRN_BUILD_COMPILER _a
#define FIRN_BUILD_VERSION __clang_major__
#elif defined(__clang__)
#define FIRN_BUILD_COMPILER _c
#define FIRN_BUILD_VERSION __clang_major__
#else
#define FIRN_BUILD_COMPILER _g
#define FIRN_BUILD_VERSION __GNUC__
#endif

#define FIRN_JOIN(a, b, c, d, e, f, g, h, i, j, k, l, m) a##b##c##d##e##f##g##h##i##j##k##l##m
#define FIRN_JOIN_VALUES(...) FIRN_JOIN(__VA_ARGS__)
/// \endcond

/// The name of the build: processor, options, and compiler with its major version. \see core/build.hpp
#define FIRN_BUILD                                                                                      \
    FIRN_JOIN_VALUES(FIRN_BUILD_PROCESSOR, FIRN_BUILD_N, FIRN_BUILD_B, FIRN_BUILD_H, FIRN_BUILD_FMA,    \
                     FIRN_BUILD_ATOMICS, FIRN_BUILD_OPENMP, FIRN_BUILD_OPTIMISED, FIRN_BUILD_SANITIZED, \
                     FIRN_BUILD_CONTAINERS, FIRN_BUILD_ROWS, FIRN_BUILD_COMPILER, FIRN_BUILD_VERSION)

/// \def FIRN_HAS_BODIES
/// Whether headers include the bodies (-inl.hpp) of what the library firn::compiled compiles: in the library, and in
/// programs that do not link it.
/// \def FIRN_HAS_BODIES_OF_STATES
/// The same for firn::compiled_hdf5.
#if !defined(FIRN_COMPILED) || defined(FIRN_COMPILES)
#define FIRN_HAS_BODIES 1
#else
#define FIRN_HAS_BODIES 0
#endif
#if !defined(FIRN_COMPILED_HDF5) || defined(FIRN_COMPILES)
#define FIRN_HAS_BODIES_OF_STATES 1
#else
#define FIRN_HAS_BODIES_OF_STATES 0
#endif
/// In front of the body of a function that is no template. The libraries compile it in several files; the
/// linker takes one of them.
#if defined(FIRN_COMPILES)
#define FIRN_BODY [[gnu::weak]]
#else
#define FIRN_BODY inline
#endif
/// In front of a function template that the library compiles for the default policies. Elsewhere it is inlined: a call
/// costs about 1 % of a step.
#if FIRN_HAS_BODIES
#define FIRN_INLINE_OR_COMPILED FIRN_INLINE
#else
#define FIRN_INLINE_OR_COMPILED [[gnu::noinline]]
#endif
