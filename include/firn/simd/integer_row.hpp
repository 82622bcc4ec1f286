/// \file Rounds rows of floating-point numbers to rows of integers, for fixed-point sums.
#pragma once

#include <firn/simd/row.hpp>

#include <cmath>
#include <cstdint>

#if !defined(FIRN_PORTABLE_ROWS) && defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Returns the integer nearest to each number of the register `x`, ties to even. The numbers must be below 2^31 in
/// magnitude. A float of magnitude 2^23 or more is an integer already. A smaller float is rounded when 2^23, with the
/// float's sign, is added and subtracted again. If the compiler fuses this addition with a multiplication before it,
/// the result is the same, because products with a power of two are exact.
template <int N>
FIRN_INLINE node_register<std::int32_t, N> portable_nearest(const node_register<float, N>& x) {
    using Float = typename node_register<float, N>::vector;
    using Int = typename node_register<std::int32_t, N>::vector;
    const Int sign = Int(x.v) & INT32_MIN, magnitude = Int(x.v) & INT32_MAX;
    const Float large = Float(sign | 0x4b000000);  // ± 2^23
    const Int is_integer = magnitude >= 0x4b000000;
    const Int rounded = (Int(x.v) & is_integer) | (Int((x.v + large) - large) & ~is_integer);
    return {__builtin_convertvector(Float(rounded), Int)};
}

/// Returns the integer nearest to each number of a register, ties to even, as std::llrint does.
/// \param x  numbers in the range of type Integer
template <class Integer, std::floating_point S, int N>
FIRN_INLINE node_register<Integer, N> nearest(const node_register<S, N>& x) {
    if constexpr (sizeof(S) == 4 && sizeof(Integer) == 4) {
#if !defined(FIRN_PORTABLE_ROWS) && defined(__SSE2__)
        return {typename node_register<Integer, N>::vector(x86::nearest(x.v))};
#elif !defined(FIRN_PORTABLE_ROWS) && defined(__aarch64__)
        return {typename node_register<Integer, N>::vector(vcvtnq_s32_f32(x.v))};
#else
        return portable_nearest(x);
#endif
    } else {
        node_register<Integer, N> r;
        for (int i = 0; i < N; ++i) r.v[i] = Integer(std::llrint(x.v[i]));
        return r;
    }
}

}  // namespace detail

/// Returns the integer nearest to each number of a row, ties to even, as std::llrint does.
/// \param row  numbers in the range of type Integer
template <class Integer, std::floating_point S, int K, int W>
FIRN_INLINE row_of<Integer, K, W> nearest(const row_of<S, K, W>& row) {
    if constexpr (K == 0)
        return {};
    else
        return {detail::nearest<Integer>(row.first), nearest<Integer>(row.rest)};
}

}  // namespace firn::inline FIRN_BUILD
