/// \file A row of nodes in integers, for sums in fixed point.
#pragma once

#include <firn/exec/row.hpp>

#include <cmath>
#include <cstdint>

#if !defined(FIRN_PORTABLE_ROWS) && defined(__SSE2__)
#include <immintrin.h>
#elif !defined(FIRN_PORTABLE_ROWS) && defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace firn {

namespace detail {

template <class Integer, int N>
struct integer_register {
    using vector [[gnu::vector_size(N * sizeof(Integer))]] = Integer;
    vector v;

    FIRN_INLINE static integer_register load(const Integer* from) {
        integer_register r;
        std::memcpy(&r.v, from, sizeof r.v);
        return r;
    }
    FIRN_INLINE void store(Integer* to) const { std::memcpy(to, &v, sizeof v); }
    FIRN_INLINE friend integer_register operator+(integer_register a, integer_register b) { return {a.v + b.v}; }
};

/// To the nearest integer, ties to even, for |x| < 2^31. From 2^23 on a float is an integer; below, the sum with 2^23
/// is rounded to one. (Were the compiler to contract a multiplication into that sum: products with a power of two are
/// exact, and make no difference.)
template <int N>
FIRN_INLINE integer_register<std::int32_t, N> portable_nearest(const node_register<float, N>& x) {
    using Float = typename node_register<float, N>::vector;
    using Int = typename integer_register<std::int32_t, N>::vector;
    const Int sign = Int(x.v) & INT32_MIN, magnitude = Int(x.v) & INT32_MAX;
    const Float large = Float(sign | 0x4b000000);  // ± 2^23
    const Int is_integer = magnitude >= 0x4b000000;
    const Int rounded = (Int(x.v) & is_integer) | (Int((x.v + large) - large) & ~is_integer);
    return {__builtin_convertvector(Float(rounded), Int)};
}

/// As std::llrint rounds: to nearest, ties to even. \param x  in the range of Integer
template <class Integer, std::floating_point S, int N>
FIRN_INLINE integer_register<Integer, N> nearest(const node_register<S, N>& x) {
    if constexpr (sizeof(S) == 4 && sizeof(Integer) == 4) {
#if !defined(FIRN_PORTABLE_ROWS) && defined(__SSE2__)
        using Int = typename integer_register<Integer, N>::vector;
        if constexpr (N == 4) return {Int(_mm_cvtps_epi32(x.v))};
#ifdef __AVX__
        if constexpr (N == 8) return {Int(_mm256_cvtps_epi32(x.v))};
#endif
#ifdef __AVX512F__
        if constexpr (N == 16) return {Int(_mm512_maskz_cvtps_epi32(0xffff, x.v))};
#endif
#elif !defined(FIRN_PORTABLE_ROWS) && defined(__aarch64__)
        return {typename integer_register<Integer, N>::vector(vcvtnq_s32_f32(x.v))};
#else
        return portable_nearest(x);
#endif
    } else {
        integer_register<Integer, N> r;
        for (int i = 0; i < N; ++i) r.v[i] = Integer(std::llrint(x.v[i]));
        return r;
    }
}

}  // namespace detail

/// The integers of a row. \tparam Row  a row_of
template <class Integer, class Row>
struct integer_row {
    detail::integer_register<Integer, Row::width> first;
    [[no_unique_address]] integer_row<Integer, typename Row::Rest> rest;

    FIRN_INLINE static integer_row load(const Integer* from) {
        return {decltype(first)::load(from), decltype(rest)::load(from + Row::width)};
    }
    FIRN_INLINE void store(Integer* to) const {
        first.store(to);
        rest.store(to + Row::width);
    }
    /// To the nearest integers, ties to even, as std::llrint. \param row  in the range of Integer
    FIRN_INLINE static integer_row nearest(const Row& row) {
        return {detail::nearest<Integer>(row.first), decltype(rest)::nearest(row.rest)};
    }
    /// Of a node a register: node k is f(k).
    template <int k = 0, class F>
        requires(Row::width == 4)
    FIRN_INLINE static integer_row of_nodes(const F& f) {
        return {f(std::integral_constant<int, k>{}), decltype(rest)::template of_nodes<k + 1>(f)};
    }
    template <int k>
        requires(Row::width == 4)
    FIRN_INLINE detail::integer_register<Integer, 4> node() const {
        if constexpr (k == 0)
            return first;
        else
            return rest.template node<k - 1>();
    }
    FIRN_INLINE friend integer_row operator+(const integer_row& a, const integer_row& b) {
        return {a.first + b.first, a.rest + b.rest};
    }
};

template <class Integer, class S, int W>
struct integer_row<Integer, row_of<S, 0, W>> {
    FIRN_INLINE static integer_row load(const Integer*) { return {}; }
    FIRN_INLINE void store(Integer*) const {}
    FIRN_INLINE static integer_row nearest(const row_of<S, 0, W>&) { return {}; }
    template <int, class F>
    FIRN_INLINE static integer_row of_nodes(const F&) {
        return {};
    }
    FIRN_INLINE friend integer_row operator+(integer_row, integer_row) { return {}; }
};

}  // namespace firn
