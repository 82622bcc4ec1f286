/// \file Particle shifting: how far one particle is moved off overfull nodes. \see VolumeFilter
#pragma once

#include <firn/core/tensor.hpp>
#include <firn/kernel/concept.hpp>

#include <limits>

namespace firn::inline FIRN_BUILD {

/// Returns the integral of a node's weight over all points up to t: ∫ N(u) du for u < t, from 0 to 1.
/// \param t  where the integral ends, counted from the node [cells]
template <class Kernel, scalar S>
FIRN_INLINE S weight_below(const S& t) {
    // Between two nodes N is a polynomial of degree 5 at most, for which three points of Gauss's rule are exact.
    constexpr double apart = 0.3872983346207417, places[3] = {0.5 - apart, 0.5, 0.5 + apart},  // ½ √(3/5)
        parts[3] = {5.0 / 18, 4.0 / 9, 5.0 / 18};
    S sum = S(0);
    unroll<Kernel::support>([&](auto k) FIRN_LAMBDA {
        const S length = min(max(t - S(Kernel::base_shift - k), S(0)), S(1));
        S mean = S(0);
        unroll<3>([&](auto q) FIRN_LAMBDA {
            mean = mean + S(parts[q]) * Kernel::weights(S(Kernel::base_shift) + length * S(places[q]))[k];
        });
        sum = sum + length * mean;
    });
    return sum;
}

/// Returns the part of a node's weight along an axis that lies between two ends.
/// \param node, lower, upper  positions of the node and of the ends [cells]
template <class Kernel, scalar S>
FIRN_INLINE S room_along(const S& node, const S& lower, const S& upper) {
    const S reach = S(0.5 * Kernel::support), above = upper - node, below = lower - node;
    const auto whole = (above >= reach) & (below <= -reach);
    return select(whole, S(1), weight_below<Kernel>(above) - weight_below<Kernel>(below));
}
/// Returns the part of a node's weight that lies outside of a solid with a plane surface along an axis.
/// \param distance  of the node from the surface [cells], negative in the solid
template <class Kernel, scalar S>
FIRN_INLINE S room_outside(const S& distance) {
    return select(distance >= S(0.5 * Kernel::support), S(1), weight_below<Kernel>(distance));
}

/// Returns the volume of matter at a node beyond the node's room, over h^D [1]; 0 if there is none.
/// \param volume  Σ N V0 J over the particles, over h^D [1]
/// \param room    r: the part of the node's volume h^D that is free for matter [1]
template <scalar S>
FIRN_INLINE S excess_volume(const S& volume, const S& room) {
    return max(volume - room, S(0));
}

/// Sums over the nodes i around a particle, with the weights N_i and their gradients per cell, of the nodes' room r_i
/// and of r_i e_i, the volume beyond it. \see excess_volume
template <class S, int D>
struct ShiftSums {
    S excess;                   ///< Σ N_i r_i e_i [1]
    S room;                     ///< Σ N_i r_i [1]
    Vec<S, D> excess_gradient;  ///< Σ ∇N_i r_i e_i [1/cell]
    Vec<S, D> room_gradient;    ///< Σ ∇N_i r_i [1/cell]
};

/// The farthest that a particle is moved along an axis in one pass [cells].
inline constexpr double farthest_shift = 0.25;

/// Returns how far a particle is moved off overfull nodes [cells]:
///
///     δ = −½ s Σ r_i (e_i − e) ∇N_i,      e = Σ N_i r_i e_i / Σ N_i r_i
///
/// at most farthest_shift along each axis. Without e, the missing room of nodes in a solid would push.
/// \param share  s, from 0 to 1
template <scalar S, int D>
FIRN_INLINE Vec<S, D> shift_of(const ShiftSums<S, D>& sums, const S& share) {
    const auto has_room = sums.room > S(1e-6);
    const S mean = select(has_room, sums.excess / select(has_room, sums.room, S(1)), S(0));
    Vec<S, D> shift;
    unroll<D>([&](auto a) FIRN_LAMBDA {
        const S along = (sums.room_gradient.v[a] * mean - sums.excess_gradient.v[a]) * (S(0.5) * share);
        shift.v[a] = min(max(along, S(-farthest_shift)), S(farthest_shift));
    });
    return shift;
}

/// Returns a shift that goes at most half of the way to a surface; without its part into the solid if the particle is
/// in the solid.
/// \param distance  of the particle from the surface [cells], negative in the solid
/// \param normal    unit normal of the surface, into free space
template <scalar S, int D>
FIRN_INLINE Vec<S, D> kept_out(const Vec<S, D>& shift, const S& distance, const Vec<S, D>& normal) {
    const S beyond = -dot(shift, normal) - S(0.5) * max(distance, S(0));
    return shift + normal * max(beyond, S(0));
}
/// Returns a shift that goes at most half of the way to each face of a box.
/// \param x             the particle's position [cells]
/// \param lower, upper  corners of the box [cells]
template <scalar S, int D>
FIRN_INLINE Vec<S, D> kept_in_box(const Vec<S, D>& shift, const Vec<S, D>& x, const Vec<S, D>& lower,
                                  const Vec<S, D>& upper) {
    Vec<S, D> kept;
    unroll<D>([&](auto a) FIRN_LAMBDA {
        const S down = S(-0.5) * max(x.v[a] - lower.v[a], S(0)), up = S(0.5) * max(upper.v[a] - x.v[a], S(0));
        kept.v[a] = min(max(shift.v[a], down), up);
    });
    return kept;
}

/// Returns a shift [cells] that leads no particle into a solid, and none deeper into one. \see kept_out
/// \param solids  solids.around(x, seen) calls seen(distance [cells], normal) for each solid
/// \param x       the particle's position [cells]
template <class Solids, scalar S, int D>
FIRN_INLINE Vec<S, D> kept_out_of(const Solids& solids, const Vec<S, D>& x, Vec<S, D> shift) {
    S before = S(1e30), after = before;
    solids.around(x, [&](const S& distance, const Vec<S, D>& normal) FIRN_LAMBDA {
        shift = kept_out(shift, distance, normal);
        before = min(before, distance);
    });
    solids.around(x + shift, [&](const S& distance, const Vec<S, D>&) FIRN_LAMBDA { after = min(after, distance); });
    return select((after < S(0)) & (after < before), Vec<S, D>::zero(), shift);
}

}  // namespace firn::inline FIRN_BUILD
