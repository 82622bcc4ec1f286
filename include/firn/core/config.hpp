/// \file Definitions that depend on the compiler and the processor: forced inlining, and the size of SIMD registers.
#pragma once

#include <firn/core/requirements.hpp>

#include <cstddef>
#include <utility>

/// \def FIRN_INLINE
/// Forces the compiler to inline a function, so that the function's values stay in registers. Without optimisation, and
/// with sanitizers, FIRN_INLINE is only `inline`.

/// \def FIRN_LAMBDA
/// Forces the compiler to inline a lambda. Write it after the lambda's parameter list. Without optimisation, and with
/// sanitizers, FIRN_LAMBDA is empty.

#if defined(__OPTIMIZE__) && !defined(FIRN_SANITIZED)
#define FIRN_INLINE [[gnu::always_inline]] inline
#define FIRN_LAMBDA __attribute__((always_inline))
#else
#define FIRN_INLINE inline
#define FIRN_LAMBDA
#endif

/// Prevents the compiler from inlining a lambda or making further copies of its code. Write it after the lambda's
/// parameter list.
#ifdef __clang__
#define FIRN_NEVER_INLINE __attribute__((noinline))
#else
#define FIRN_NEVER_INLINE __attribute__((noipa))
#endif

namespace firn::inline FIRN_BUILD {

/// Size of a SIMD register of the processor for which firn is compiled [bytes].
inline constexpr std::size_t register_bytes =
#if defined(__AVX512F__) && defined(__AVX512DQ__)
    64;
#elif defined(__AVX__)
    32;
#else
    16;
#endif

/// Number of SIMD registers of the processor for which firn is compiled.
inline constexpr int vector_registers =
#if defined(__AVX512F__) || defined(__aarch64__)
    32;
#else
    16;
#endif

/// Calls f(0), f(1), …, f(N−1). Each argument is a compile-time constant of type std::integral_constant.
template <int N, class F>
FIRN_INLINE constexpr void unroll(F&& f) {
    [&]<int... I>(std::integer_sequence<int, I...>)
        FIRN_LAMBDA { (f(std::integral_constant<int, I>{}), ...); }(std::make_integer_sequence<int, N>{});
}

}  // namespace firn::inline FIRN_BUILD
