/// \file The few instructions of x86 for which the compilers' vector extension has no operator.
///
/// Including `immintrin.h` takes g++ a quarter of a second, a sixth of the time to compile a small program. Therefore
/// the compiler's builtin functions are used if the compiler is g++ and has all of these functions. Otherwise the
/// intrinsics of `immintrin.h` are used.
#pragma once

#include <firn/core/config.hpp>

namespace firn::inline FIRN_BUILD::detail::x86 {
// The function names are declared for every processor, so that callers can test whether a call compiles.
template <class>
void sign_bits();
template <class>
void sqrt();
template <class>
void floor();
template <class>
void nearest();
template <class>
void repeat();
template <int>
void with_group();
}  // namespace firn::inline FIRN_BUILD::detail::x86

#ifdef __SSE2__

#if defined(__GNUC__) && !defined(__clang__) && !defined(__INTEL_COMPILER) &&                                     \
    __has_builtin(__builtin_ia32_movmskps) && __has_builtin(__builtin_ia32_movmskpd) &&                           \
    __has_builtin(__builtin_ia32_sqrtps) && __has_builtin(__builtin_ia32_sqrtpd) &&                               \
    __has_builtin(__builtin_ia32_cvtps2dq) &&                                                                     \
    (!defined(__SSE4_1__) || (__has_builtin(__builtin_ia32_roundps) && __has_builtin(__builtin_ia32_roundpd))) && \
    (!defined(__AVX__) ||                                                                                         \
     (__has_builtin(__builtin_ia32_movmskps256) && __has_builtin(__builtin_ia32_movmskpd256) &&                   \
      __has_builtin(__builtin_ia32_sqrtps256) && __has_builtin(__builtin_ia32_sqrtpd256) &&                       \
      __has_builtin(__builtin_ia32_roundps256) && __has_builtin(__builtin_ia32_roundpd256) &&                     \
      __has_builtin(__builtin_ia32_cvtps2dq256) && __has_builtin(__builtin_ia32_vbroadcastf128_ps256) &&          \
      __has_builtin(__builtin_ia32_blendps256) && __has_builtin(__builtin_ia32_vbroadcastss256))) &&              \
    (!defined(__AVX512F__) ||                                                                                     \
     (__has_builtin(__builtin_ia32_sqrtps512_mask) && __has_builtin(__builtin_ia32_sqrtpd512_mask) &&             \
      __has_builtin(__builtin_ia32_rndscaleps_mask) && __has_builtin(__builtin_ia32_rndscalepd_mask) &&           \
      __has_builtin(__builtin_ia32_permvarsf512_mask) && __has_builtin(__builtin_ia32_extractf64x4_mask) &&       \
      __has_builtin(__builtin_ia32_cvtps2dq512_mask) && __has_builtin(__builtin_ia32_broadcastf32x4_512) &&       \
      __has_builtin(__builtin_ia32_broadcastf64x4_512) && __has_builtin(__builtin_ia32_broadcastsd512) &&         \
      __has_builtin(__builtin_ia32_loadups512_mask))) &&                                                          \
    (!defined(__AVX512DQ__) ||                                                                                    \
     (__has_builtin(__builtin_ia32_cvtd2mask512) && __has_builtin(__builtin_ia32_cvtq2mask512)))
#define FIRN_HAS_BUILTINS 1
#endif

#ifdef FIRN_HAS_BUILTINS
#define FIRN_X86(builtin, intrinsic) builtin
#else
#include <immintrin.h>
#define FIRN_X86(builtin, intrinsic) intrinsic
#endif

// For AVX-512 the intrinsics with a mask are used, since g++ 12 warns of an uninitialised value in the intrinsics
// without a mask.
namespace firn::inline FIRN_BUILD::detail::x86 {

using float4 [[gnu::vector_size(16)]] = float;
using double2 [[gnu::vector_size(16)]] = double;
using int4 [[gnu::vector_size(16)]] = int;

FIRN_INLINE int sign_bits(float4 a) { return FIRN_X86(__builtin_ia32_movmskps(a), _mm_movemask_ps(a)); }
FIRN_INLINE int sign_bits(double2 a) { return FIRN_X86(__builtin_ia32_movmskpd(a), _mm_movemask_pd(a)); }
FIRN_INLINE float4 sqrt(float4 a) { return FIRN_X86(__builtin_ia32_sqrtps(a), _mm_sqrt_ps(a)); }
FIRN_INLINE double2 sqrt(double2 a) { return FIRN_X86(__builtin_ia32_sqrtpd(a), _mm_sqrt_pd(a)); }
FIRN_INLINE int4 nearest(float4 a) { return int4(FIRN_X86(__builtin_ia32_cvtps2dq(a), _mm_cvtps_epi32(a))); }
#ifdef __SSE4_1__
FIRN_INLINE float4 floor(float4 a) { return FIRN_X86(__builtin_ia32_roundps(a, 1), _mm_floor_ps(a)); }
FIRN_INLINE double2 floor(double2 a) { return FIRN_X86(__builtin_ia32_roundpd(a, 1), _mm_floor_pd(a)); }
#endif

#ifdef __AVX__
using float8 [[gnu::vector_size(32)]] = float;
using double4 [[gnu::vector_size(32)]] = double;
using int8 [[gnu::vector_size(32)]] = int;

FIRN_INLINE int sign_bits(float8 a) { return FIRN_X86(__builtin_ia32_movmskps256(a), _mm256_movemask_ps(a)); }
FIRN_INLINE int sign_bits(double4 a) { return FIRN_X86(__builtin_ia32_movmskpd256(a), _mm256_movemask_pd(a)); }
FIRN_INLINE float8 sqrt(float8 a) { return FIRN_X86(__builtin_ia32_sqrtps256(a), _mm256_sqrt_ps(a)); }
FIRN_INLINE double4 sqrt(double4 a) { return FIRN_X86(__builtin_ia32_sqrtpd256(a), _mm256_sqrt_pd(a)); }
FIRN_INLINE float8 floor(float8 a) { return FIRN_X86(__builtin_ia32_roundps256(a, 1), _mm256_floor_ps(a)); }
FIRN_INLINE double4 floor(double4 a) { return FIRN_X86(__builtin_ia32_roundpd256(a, 1), _mm256_floor_pd(a)); }
FIRN_INLINE int8 nearest(float8 a) { return int8(FIRN_X86(__builtin_ia32_cvtps2dq256(a), _mm256_cvtps_epi32(a))); }
/// Reads four numbers a, b, c, d from memory and returns (a, b, c, d, a, b, c, d).
FIRN_INLINE float8 repeat(const float* from) {
    const auto* four = reinterpret_cast<const float4*>(from);
    return FIRN_X86(__builtin_ia32_vbroadcastf128_ps256(four), _mm256_broadcast_ps(four));
}
/// Reads two numbers a, b from memory and returns (a, a, a, a, b, b, b, b).
FIRN_INLINE float8 spread(const float* from) {
    return FIRN_X86(
        __builtin_ia32_blendps256(__builtin_ia32_vbroadcastss256(from), __builtin_ia32_vbroadcastss256(from + 1), 0xf0),
        _mm256_blend_ps(_mm256_broadcast_ss(from), _mm256_broadcast_ss(from + 1), 0xf0));
}
#endif

#ifdef __AVX512F__
using float16 [[gnu::vector_size(64)]] = float;
using double8 [[gnu::vector_size(64)]] = double;
using int16 [[gnu::vector_size(64)]] = int;
using long8 [[gnu::vector_size(64)]] = long long;

#ifdef __AVX512DQ__
FIRN_INLINE int sign_bits(float16 a) {
    return FIRN_X86(__builtin_ia32_cvtd2mask512(int16(a)), _mm512_movepi32_mask(__m512i(a)));
}
FIRN_INLINE int sign_bits(double8 a) {
    return FIRN_X86(__builtin_ia32_cvtq2mask512(long8(a)), _mm512_movepi64_mask(__m512i(a)));
}
#endif
FIRN_INLINE float16 sqrt(float16 a) {
    return FIRN_X86(__builtin_ia32_sqrtps512_mask(a, float16{}, short(0xffff), 4), _mm512_maskz_sqrt_ps(0xffff, a));
}
FIRN_INLINE double8 sqrt(double8 a) {
    return FIRN_X86(__builtin_ia32_sqrtpd512_mask(a, double8{}, char(0xff), 4), _mm512_maskz_sqrt_pd(0xff, a));
}
FIRN_INLINE float16 floor(float16 a) {
    return FIRN_X86(__builtin_ia32_rndscaleps_mask(a, 1, float16{}, short(0xffff), 4),
                    _mm512_maskz_roundscale_ps(0xffff, a, _MM_FROUND_FLOOR));
}
FIRN_INLINE double8 floor(double8 a) {
    return FIRN_X86(__builtin_ia32_rndscalepd_mask(a, 1, double8{}, char(0xff), 4),
                    _mm512_maskz_roundscale_pd(0xff, a, _MM_FROUND_FLOOR));
}
FIRN_INLINE int16 nearest(float16 a) {
    return int16(
        FIRN_X86(__builtin_ia32_cvtps2dq512_mask(a, int16{}, short(0xffff), 4), _mm512_maskz_cvtps_epi32(0xffff, a)));
}
/// Returns a vector of two (double8) or four (float16) copies of the four numbers: (a, b, c, d, a, b, c, d, …).
/// @{
FIRN_INLINE double8 repeat(double4 four) {
    return FIRN_X86(__builtin_ia32_broadcastf64x4_512(four, double8{}, char(0xff)),
                    _mm512_maskz_broadcast_f64x4(0xff, four));
}
FIRN_INLINE float16 repeat(float4 four) {
    return FIRN_X86(__builtin_ia32_broadcastf32x4_512(four, float16{}, short(0xffff)),
                    _mm512_maskz_broadcast_f32x4(0xffff, four));
}
/// @}
/// Returns `a` with group j of four lanes replaced by four numbers.
/// @{
template <int j>
FIRN_INLINE double8 with_group(double8 a, double4 four) {
    return FIRN_X86(__builtin_ia32_broadcastf64x4_512(four, a, char(0xf << 4 * j)),
                    _mm512_mask_broadcast_f64x4(a, __mmask8(0xf << 4 * j), four));
}
template <int j>
FIRN_INLINE float16 with_group(float16 a, float4 four) {
    return FIRN_X86(__builtin_ia32_broadcastf32x4_512(four, a, short(0xf << 4 * j)),
                    _mm512_mask_broadcast_f32x4(a, __mmask16(0xf << 4 * j), four));
}
/// @}

/// Returns `a` with lanes 4 to 7 set to `number`; lanes 0 to 3 are unchanged.
FIRN_INLINE double8 with_upper(double8 a, double number) {
    const double2 two{number, 0};
    return FIRN_X86(__builtin_ia32_broadcastsd512(two, a, char(0xf0)), _mm512_mask_broadcastsd_pd(a, 0xf0, two));
}
/// Returns lanes 4 to 7 of `a`.
FIRN_INLINE double4 upper(double8 a) {
    return FIRN_X86(__builtin_ia32_extractf64x4_mask(a, 1, double4{}, char(0xff)),
                    _mm512_maskz_extractf64x4_pd(0xff, a, 1));
}
/// Returns the lanes of `a` in the order given by `order`: a[order[0]], a[order[1]], …
FIRN_INLINE float16 permuted(float16 a, int16 order) {
    return FIRN_X86(__builtin_ia32_permvarsf512_mask(a, order, float16{}, short(0xffff)),
                    _mm512_maskz_permutexvar_ps(0xffff, __m512i(order), a));
}
/// Returns `a` with those lanes l whose bit in `lanes` is set read from from[l]. No other memory is read.
FIRN_INLINE float16 with_loaded(float16 a, unsigned lanes, const float* from) {
    return FIRN_X86(__builtin_ia32_loadups512_mask(from, a, short(lanes)),
                    _mm512_mask_loadu_ps(a, __mmask16(lanes), from));
}
#endif

}  // namespace firn::inline FIRN_BUILD::detail::x86

#undef FIRN_X86
#undef FIRN_HAS_BUILTINS
#endif
