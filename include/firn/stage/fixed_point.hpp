/// \file The scale (quanta per unit) of fixed-point sums, from an upper bound of the sums of any node.
///
/// Let m, p, A and G be the mass, momentum, affine matrix and gradient matrix of a particle's P2GRecord, N_i the weight
/// of node i, and o the node's offset from the particle's centre node. The particle adds at most N_i q + |∇N_i| g to
/// component a of the momentum of node i, with q = |p_a| + (max |o|) Σ_b |A_ab| and g = Σ_b |G_ab|. Let n be the
/// largest number of particles with the same base node, D the dimension, K the kernel's support (nodes along an axis),
/// γ the kernel's largest gradient, and W the sum of the largest weights that the K nodes can have. Then the mass of a
/// node is at most Wᴰ n max m, and each component of its momentum at most
///     Wᴰ n max q  +  D K γ Wᴰ⁻¹ n max g
/// At most Kᴰ n particles contribute to a node. If B is one of these two bounds and I the largest integer, every sum of
/// rounded contributions fits into the integers with the scale 2^⌊log2((I − Kᴰ n)/B)⌋.
#pragma once

#include <firn/core/bits.hpp>
#include <firn/data/fixed_point_scale.hpp>
#include <firn/kernel/concept.hpp>
#include <firn/stage/p2g.hpp>

#include <cmath>

namespace firn::inline FIRN_BUILD {

/// Maxima over all particles, for the computation of the upper bounds of the sums. These maxima do not depend on the
/// order of the particles. q and g are defined as follows: a particle adds at most N q + |∇N| g to a momentum component
/// of a node with weight N. \see firn/stage/fixed_point.hpp
template <class S>
struct FixedPointLoad {
    S momentum = S(0);   ///< largest q of a particle [kg m/s], for the contributions proportional to N
    S gradient = S(0);   ///< largest g of a particle [kg m/s], for the contributions proportional to ∇N
    S mass = S(0);       ///< largest mass of a particle [kg]
    S particles = S(0);  ///< largest number of particles with the same base node
};

/// Returns the maximum of the loads `a` and `b`, member by member.
template <class S>
FIRN_INLINE FixedPointLoad<S> larger(const FixedPointLoad<S>& a, const FixedPointLoad<S>& b) {
    return {max(a.momentum, b.momentum), max(a.gradient, b.gradient), max(a.mass, b.mass),
            max(a.particles, b.particles)};
}

/// Upper bounds of the sums of one node.
template <class S>
struct FixedPointBound {
    S momentum;       ///< largest absolute value of a momentum component [kg m/s]
    S mass;           ///< largest mass [kg]
    S contributions;  ///< largest number of contributions to a node, each of which is rounded
};

/// A node with less mass than this number of quanta counts as empty, because rounding errors would dominate the node's
/// velocity.
inline constexpr int fewest_mass_quanta = 64;

/// The distance along an axis from the centre node to the farthest node of the kernel's support [cells].
template <class Kernel>
inline constexpr int largest_offset = Kernel::support - 1 - centre_node<Kernel>;

/// Returns the load of one particle: its mass m and the factors q and g, where N q + |∇N| g is the most that the
/// particle adds to any momentum component of a node with weight N. For a particle without mass, q and g are zero. A
/// value that is NaN is returned as infinity. `particles` is not set.
template <class Kernel, class Force, scalar S, int D>
FIRN_INLINE FixedPointLoad<S> load_of(const P2GRecord<S, D>& record) {
    const auto real = !(record.mass <= S(0));
    const S infinite = S(std::numeric_limits<value_type_t<S>>::infinity());
    const auto largest = [&](const auto& of_axis) FIRN_LAMBDA {
        S most = of_axis(std::integral_constant<int, 0>{}), sum = most;
        unroll<D - 1>([&](auto a) FIRN_LAMBDA {
            const S other = of_axis(std::integral_constant<int, a + 1>{});
            most = max(most, other);
            sum = sum + other;  // NaN if one of the terms is NaN
        });
        return select(real, select(sum <= infinite, most, infinite), S(0));
    };
    FixedPointLoad<S> load;
    load.mass = select(record.mass <= infinite, record.mass, infinite);
    load.momentum = largest([&](auto a) FIRN_LAMBDA {
        S affine = abs(record.affine(a, 0));
        unroll<D - 1>([&](auto b) FIRN_LAMBDA { affine = affine + abs(record.affine(a, b + 1)); });
        return abs(record.momentum.v[a]) + affine * S(largest_offset<Kernel>);
    });
    if constexpr (Force::weight_gradients)
        load.gradient = largest([&](auto a) FIRN_LAMBDA {
            S gradient = abs(record.gradient(a, 0));
            unroll<D - 1>([&](auto b) FIRN_LAMBDA { gradient = gradient + abs(record.gradient(a, b + 1)); });
            return gradient;
        });
    return load;
}

/// Returns a particle's P2G record in quanta (integer steps) instead of kg and kg m/s. Scales are powers of two, so
/// scaling the record gives the same bits as scaling the contributions of the record to nodes.
template <scalar S, int D>
FIRN_INLINE P2GRecord<S, D> in_quanta(const P2GRecord<S, D>& record, const FixedPointScale<S>& scale) {
    return {record.mass * scale.mass, record.momentum * scale.momentum, record.affine * scale.momentum,
            record.gradient * scale.momentum};
}

namespace detail {
constexpr double power(double x, int n) { return n == 0 ? 1 : x * power(x, n - 1); }
}  // namespace detail

/// Returns the upper bounds of the sums of a node, by the formulas in the description of this file.
template <class Kernel, int D, scalar S>
FIRN_INLINE FixedPointBound<S> fixed_point_bound(const FixedPointLoad<S>& load) {
    constexpr double W = [] {
        double sum = 0;
        for (const double w : Kernel::largest_weight) sum += w;
        return sum;
    }();
    constexpr double gradients = D * Kernel::support * Kernel::largest_gradient * detail::power(W, D - 1);
    const S& n = load.particles;
    const S weights = S(detail::power(W, D)) * n;
    return {weights * load.momentum + S(gradients) * n * load.gradient, weights * load.mass,
            S(detail::power(Kernel::support, D)) * n};
}

/// Returns the largest powers of two (quanta per unit of momentum and of mass) with which no sum exceeds `integer_max`.
/// The scale is 1 for a bound that is zero. Both bounds must be finite.
/// \param integer_max  largest allowed sum [quanta]
template <scalar S>
FIRN_INLINE FixedPointScale<S> largest_scale(const FixedPointBound<S>& bound, double integer_max) {
    const S room = S(integer_max) - bound.contributions;
    const auto largest = [&](const S& most) FIRN_LAMBDA {
        const auto is_none = most == S(0);
        const S rounded_up = most * S(1 + 0x1p-16);  // covers rounding errors of the bound and of the contributions
        const S quanta = room / select(is_none, S(1), rounded_up);
        constexpr int highest = sizeof(value_type_t<S>) == 4 ? 120 : 1000;
        return select(is_none, S(1), power_of_two(min(exponent_of(quanta), S(highest))));
    };
    return {largest(bound.momentum), largest(bound.mass)};
}

}  // namespace firn::inline FIRN_BUILD
