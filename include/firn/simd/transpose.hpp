/// \file Rearranges numbers of particles: from four registers with one particle per lane to one quad (four numbers) per
/// particle, and back.
#pragma once

#include <firn/core/pack.hpp>
#include <firn/core/x86.hpp>

namespace firn::inline FIRN_BUILD {

namespace detail {
template <class P, bool High, int... I>
FIRN_INLINE P interleave(const P& a, const P& b, std::integer_sequence<int, I...>) {
    constexpr int N = scalar_traits<P>::lanes;
    // within each group of four lanes: a0 b0 a1 b1 (low) or a2 b2 a3 b3 (high)
    return P(__builtin_shufflevector(a.lanes, b.lanes, ((I & ~3) + (High ? 2 : 0) + (I & 3) / 2 + (I & 1) * N)...));
}
template <class P>
FIRN_INLINE P low(const P& a, const P& b) {
    return interleave<P, false>(a, b, std::make_integer_sequence<int, scalar_traits<P>::lanes>{});
}
template <class P>
FIRN_INLINE P high(const P& a, const P& b) {
    return interleave<P, true>(a, b, std::make_integer_sequence<int, scalar_traits<P>::lanes>{});
}

/// Transposes the numbers of four registers: in each group of four lanes, lane i of register j is exchanged with lane j
/// of register i. The function is its own inverse.
template <class P>
FIRN_INLINE void transpose_groups(P (&r)[4]) {
    const P even_low = low(r[0], r[2]), even_high = high(r[0], r[2]);
    const P odd_low = low(r[1], r[3]), odd_high = high(r[1], r[3]);
    r[0] = low(even_low, odd_low);
    r[1] = high(even_low, odd_low);
    r[2] = low(even_high, odd_high);
    r[3] = high(even_high, odd_high);
}
}  // namespace detail

/// Returns the index of the quad that store_quads() writes for the particle of a lane. Because store_quads() stores
/// whole registers, the order of quads differs from the order of lanes.
template <class P>
FIRN_INLINE constexpr int quad_of_lane(int lane) {
    const unsigned l = unsigned(lane);  // unsigned: fast division by powers of two
    return int(l % 4 * (scalar_traits<P>::lanes / 4) + l / 4);
}

/// Writes, for the particle of each lane, four numbers as a quad. The quad of lane l has the index quad_of_lane(l).
/// \param r   r[k] has the k-th of the four numbers of each particle; afterwards, `r` is transposed
/// \param to  memory for four numbers per lane
template <class P>
FIRN_INLINE void store_quads(P (&r)[4], value_type_t<P>* to) {
    detail::transpose_groups(r);
    unroll<4>([&](auto k) FIRN_LAMBDA { r[k].store(to + k * scalar_traits<P>::lanes); });
}

/// Reads quads in the order in which store_quads() writes them. Lane l of r[k] gets the k-th number of the quad of lane
/// l.
template <class P>
FIRN_INLINE void load_quads(const value_type_t<P>* from, P (&r)[4]) {
    unroll<4>([&](auto k) FIRN_LAMBDA { r[k] = P::load(from + k * scalar_traits<P>::lanes); });
    detail::transpose_groups(r);
}

namespace detail {
/// Returns a register with the numbers of several quads, one after another: quad(0), quad(1), …
/// \param quad  quad(j) returns a pack of four numbers
template <class P, int First = 0, class Quad>
FIRN_INLINE auto joined(const Quad& quad) {
    constexpr int N = scalar_traits<P>::lanes;
    if constexpr (N == 4) {
        return quad(std::integral_constant<int, First>{});
    } else if constexpr (First == 0 && requires(const P r) {
                             x86::with_group<1>(r.lanes, quad(std::integral_constant<int, 0>{}).lanes);
                         }) {
        // A masked load each, where shuffles would wait for one port.
        P r(x86::repeat(quad(std::integral_constant<int, 0>{}).lanes));
        unroll<N / 4 - 1>([&](auto j) FIRN_LAMBDA {
            r.lanes = x86::with_group<j + 1>(r.lanes, quad(std::integral_constant<int, j + 1>{}).lanes);
        });
        return r;
    } else {
        using Half = pack<value_type_t<P>, N / 2>;
        const Half low = joined<Half, First>(quad), high = joined<Half, First + N / 8>(quad);
        return [&]<int... I>(std::integer_sequence<int, I...>) FIRN_LAMBDA {
            return P(__builtin_shufflevector(low.lanes, high.lanes, I...));
        }(std::make_integer_sequence<int, N>{});
    }
}
}  // namespace detail

/// Reads one quad for each lane, from anywhere. r[k] gets the k-th numbers.
/// \param of_lane  of_lane(l) returns the address of the quad of lane l
template <class P, class OfLane>
FIRN_INLINE void load_quads_at(const OfLane& of_lane, P (&r)[4]) {
    using Row = pack<value_type_t<P>, 4>;
    unroll<4>([&](auto k) FIRN_LAMBDA {
        r[k] = detail::joined<P>([&](auto j) FIRN_LAMBDA { return Row::load(of_lane(4 * j + k)); });
    });
    detail::transpose_groups(r);
}
/// Reads one quad for each lane, from anywhere in an array of quads. r[k] gets the k-th numbers.
/// \param of_lane  of_lane(l) returns the index of the quad of lane l
template <class P, class OfLane>
FIRN_INLINE void load_quads_of(const value_type_t<P>* quads, const OfLane& of_lane, P (&r)[4]) {
    load_quads_at<P>([&](int l) FIRN_LAMBDA { return quads + 4 * std::size_t(of_lane(l)); }, r);
}

/// Writes one quad for each lane, to anywhere in an array of quads. No two lanes must have the same quad.
/// \param r        r[k] has the k-th numbers; afterwards, `r` is transposed
/// \param of_lane  of_lane(l) returns the index of the quad of lane l
template <class P, class OfLane>
FIRN_INLINE void store_quads_of(P (&r)[4], value_type_t<P>* quads, const OfLane& of_lane) {
    using Row = pack<value_type_t<P>, 4>;
    detail::transpose_groups(r);
    unroll<4>([&](auto k) FIRN_LAMBDA {
        unroll<scalar_traits<P>::lanes / 4>([&](auto j) FIRN_LAMBDA {
            Row(__builtin_shufflevector(r[k].lanes, r[k].lanes, 4 * j, 4 * j + 1, 4 * j + 2, 4 * j + 3))
                .store(quads + 4 * std::size_t(of_lane(4 * j + k)));
        });
    });
}

}  // namespace firn::inline FIRN_BUILD
