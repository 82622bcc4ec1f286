/// \file A row of nodes in registers: `K` neighbouring nodes along the last axis, four numbers each.
/// The unit in which P2G writes and G2P reads; policies never see it.
#pragma once

#include <firn/core/config.hpp>

#include <concepts>
#include <cstring>

#if defined(__AVX512F__) && defined(__AVX512DQ__)
#include <immintrin.h>
#endif

namespace firn {

/// The four numbers of one node: D components of momentum or velocity, and the mass.
template <class S>
struct quad {
    using vector [[gnu::vector_size(4 * sizeof(S))]] = S;
    vector v;

    FIRN_INLINE static quad load(const S* from) {
        quad q;
        std::memcpy(&q.v, from, sizeof q.v);
        return q;
    }
    FIRN_INLINE void store(S* to) const { std::memcpy(to, &v, sizeof v); }
    FIRN_INLINE friend quad operator+(quad a, quad b) { return {a.v + b.v}; }
};

/// Portable: a register a node.
template <std::floating_point S, int K>
struct row {
    quad<S> node[K];

    FIRN_INLINE static row load(const S* from) {
        row r;
        unroll<K>([&](auto k) FIRN_LAMBDA { r.node[k] = quad<S>::load(from + 4 * k); });
        return r;
    }
    FIRN_INLINE void store(S* to) const {
        unroll<K>([&](auto k) FIRN_LAMBDA { node[k].store(to + 4 * k); });
    }
    /// The same four numbers in every node.
    FIRN_INLINE static row repeat(const S* from) {
        row r;
        const quad<S> q = quad<S>::load(from);
        unroll<K>([&](auto k) FIRN_LAMBDA { r.node[k] = q; });
        return r;
    }
    /// Node k holds from[k] four times; from[k] = 0 beyond the kernel's support.
    FIRN_INLINE static row spread(const S* from) {
        row r;
        unroll<K>([&](auto k) FIRN_LAMBDA { r.node[k].v = from[k] - typename quad<S>::vector{}; });
        return r;
    }
    /// In the order of a register split in halves, so that every target gives the same bits.
    FIRN_INLINE quad<S> sum() const {
        if constexpr (K == 2)
            return node[0] + node[1];
        else if constexpr (K == 3)
            return (node[0] + node[2]) + node[1];
        else
            return (node[0] + node[2]) + (node[1] + node[3]);
    }

    FIRN_INLINE friend row operator+(const row& a, const row& b) {
        row r;
        unroll<K>([&](auto k) FIRN_LAMBDA { r.node[k].v = a.node[k].v + b.node[k].v; });
        return r;
    }
    FIRN_INLINE friend row operator-(const row& a, const row& b) {
        row r;
        unroll<K>([&](auto k) FIRN_LAMBDA { r.node[k].v = a.node[k].v - b.node[k].v; });
        return r;
    }
    FIRN_INLINE friend row operator*(const row& a, const row& b) {
        row r;
        unroll<K>([&](auto k) FIRN_LAMBDA { r.node[k].v = a.node[k].v * b.node[k].v; });
        return r;
    }
    FIRN_INLINE friend row operator*(const row& a, S s) {
        row r;
        unroll<K>([&](auto k) FIRN_LAMBDA { r.node[k].v = a.node[k].v * s; });
        return r;
    }
};

#if defined(__AVX512F__) && defined(__AVX512DQ__)
/// AVX-512: up to four nodes of float in one register. The register reaches over nodes beyond the support, whose
/// weights are zero: they are read and written back unchanged.
template <int K>
struct row<float, K> {
    static constexpr __mmask16 all = 0xffff;  // the unmasked intrinsics of g++ 12 warn of uninitialised values
    __m512 v;

    FIRN_INLINE static row load(const float* from) { return {_mm512_loadu_ps(from)}; }
    FIRN_INLINE void store(float* to) const { _mm512_storeu_ps(to, v); }
    FIRN_INLINE static row repeat(const float* from) { return {_mm512_maskz_broadcast_f32x4(all, _mm_loadu_ps(from))}; }
    FIRN_INLINE static row spread(const float* from) {
        const __m512i index = _mm512_set_epi32(3, 3, 3, 3, 2, 2, 2, 2, 1, 1, 1, 1, 0, 0, 0, 0);
        return {_mm512_maskz_permutexvar_ps(all, index, _mm512_maskz_broadcast_f32x4(all, _mm_loadu_ps(from)))};
    }
    FIRN_INLINE quad<float> sum() const {
        const __m256 half =
            _mm256_add_ps(_mm512_maskz_extractf32x8_ps(0xff, v, 0), _mm512_maskz_extractf32x8_ps(0xff, v, 1));
        return {_mm_add_ps(_mm256_castps256_ps128(half), _mm256_extractf128_ps(half, 1))};
    }
    FIRN_INLINE friend row operator+(row a, row b) { return {a.v + b.v}; }
    FIRN_INLINE friend row operator-(row a, row b) { return {a.v - b.v}; }
    FIRN_INLINE friend row operator*(row a, row b) { return {a.v * b.v}; }
    FIRN_INLINE friend row operator*(row a, float s) { return {a.v * _mm512_set1_ps(s)}; }
};
#endif

}  // namespace firn
