/// \file Compiler-dependent words: forced inlining, and how many lanes the target's registers hold.
#pragma once

#include <firn/core/requirements.hpp>

#include <cstddef>
#include <utility>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define FIRN_SANITIZED
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define FIRN_SANITIZED
#endif
#endif

#if defined(__OPTIMIZE__) && !defined(FIRN_SANITIZED)
/// A function that must dissolve into its caller: the physics is small and lives in registers. (Not where every access
/// is instrumented, nor without optimisation: there it would only make the code large.)
#define FIRN_INLINE [[gnu::always_inline]] inline
/// The same for a lambda, written after its parameter list.
#define FIRN_LAMBDA __attribute__((always_inline))
#else
#define FIRN_INLINE inline
#define FIRN_LAMBDA
#endif

/// For a lambda of which there shall be one copy, written after its parameter list.
#ifdef __clang__
#define FIRN_NEVER_INLINE __attribute__((noinline))
#else
#define FIRN_NEVER_INLINE __attribute__((noipa))
#endif

namespace firn {

/// Width of a SIMD register of the target in bytes.
inline constexpr std::size_t register_bytes =
#if defined(__AVX512F__) && defined(__AVX512DQ__)
    64;
#elif defined(__AVX__)
    32;
#else
    16;
#endif

/// How many such registers it has.
inline constexpr int vector_registers =
#if defined(__AVX512F__) || defined(__aarch64__)
    32;
#else
    16;
#endif

/// Calls f(0), f(1), …, f(N−1), each index a compile-time constant.
template <int N, class F>
FIRN_INLINE constexpr void unroll(F&& f) {
    [&]<int... I>(std::integer_sequence<int, I...>)
        FIRN_LAMBDA { (f(std::integral_constant<int, I>{}), ...); }(std::make_integer_sequence<int, N>{});
}

}  // namespace firn
