/// \file The scale of fixed-point sums, from a bound of what any node can receive.
///
/// A particle gives node i at most N_i q + |∇N_i| g in any component a, with q = |p_a| + (max |o|) Σ_b |A_ab| and
/// g = Σ_b |G_ab|. Let M be the largest mass in a cell, w_c the kernel's largest weight for a particle in the c-th cell
/// around a node, W = Σ w_c. Then a node's mass is at most Wᴰ M, and its momentum at most
///     Wᴰ M max(q/m)  +  D (K + 1) γ Wᴰ⁻¹ M max(g/m)
/// (γ the kernel's largest gradient, K its support). With n the most particles around a node and B the bound, a scale
/// of 2^⌊log2((max − n)/B)⌋ makes every sum of rounded numbers fit.
#pragma once

#include <firn/core/bits.hpp>
#include <firn/kernel/concept.hpp>
#include <firn/stage/p2g.hpp>

#include <cmath>

namespace firn {

/// Quanta per unit; powers of two, so that scaling is exact.
template <class S>
struct FixedPointScale {
    S momentum;  ///< quanta per kg m/s
    S mass;      ///< quanta per kg
};

/// What the particles are, as far as the bound needs it. Maxima and integer sums: the same for any order.
template <class S>
struct FixedPointLoad {
    S momentum_per_mass = S(0);  ///< max q/m [m/s]
    S gradient_per_mass = S(0);  ///< max g/m [m/s]
    S cell_mass = S(0);          ///< M, rounded up [kg]
    S cell_particles = S(0);     ///< most particles in a cell
};

/// What a node may receive.
template <class S>
struct FixedPointBound {
    S momentum;       ///< [kg m/s]
    S mass;           ///< [kg]
    S contributions;  ///< n, each of them rounded
};

/// A node with less mass than this counts as empty: its velocity would be made of rounding errors.
inline constexpr int fewest_mass_quanta = 64;

/// The particle of the largest mass is that many quanta or up to twice as many where the masses in a cell are added up.
inline constexpr int largest_mass_exponent = 20;

/// Quanta per kg there; a power of two, so that scaling is exact.
inline double mass_quanta(double largest_mass) { return std::exp2(largest_mass_exponent - std::ilogb(largest_mass)); }

/// The largest |o|: how far a node of the support lies from the centre node, in cells.
template <class Kernel>
inline constexpr int largest_offset = Kernel::support - 1 - centre_node<Kernel>;

/// max q/m and max g/m of one particle; 0 without mass. What is not a number becomes infinite.
template <class Kernel, class Force, scalar S, int D>
FIRN_INLINE FixedPointLoad<S> load_of(const P2GRecord<S, D>& record) {
    const auto real = record.mass > S(0);
    const S per_mass = S(1) / select(real, record.mass, S(1));
    const S infinite = S(std::numeric_limits<value_type_t<S>>::infinity());
    FixedPointLoad<S> load;
    unroll<D>([&](auto a) FIRN_LAMBDA {
        S momentum = abs(record.momentum.v[a]), gradient = S(0);
        unroll<D>([&](auto b) FIRN_LAMBDA {
            momentum = momentum + abs(record.affine(a, b)) * S(largest_offset<Kernel>);
            if constexpr (Force::weight_gradients) gradient = gradient + abs(record.gradient(a, b));
        });
        const S q = momentum * per_mass, g = gradient * per_mass;
        load.momentum_per_mass = max(load.momentum_per_mass, select(real, select(q <= infinite, q, infinite), S(0)));
        load.gradient_per_mass = max(load.gradient_per_mass, select(real, select(g <= infinite, g, infinite), S(0)));
    });
    return load;
}

/// The record in quanta. Scales are powers of two: what a node receives is the same whether its record was scaled or
/// itself.
template <scalar S, int D>
FIRN_INLINE P2GRecord<S, D> in_quanta(const P2GRecord<S, D>& record, const FixedPointScale<S>& scale) {
    return {record.mass * scale.mass, record.momentum * scale.momentum, record.affine * scale.momentum,
            record.gradient * scale.momentum};
}

namespace detail {
constexpr double power(double x, int n) { return n == 0 ? 1 : x * power(x, n - 1); }
}  // namespace detail

template <class Kernel, int D, scalar S>
FIRN_INLINE FixedPointBound<S> fixed_point_bound(const FixedPointLoad<S>& load) {
    constexpr double W = [] {
        double sum = 0;
        for (const double w : Kernel::largest_weight) sum += w;
        return sum;
    }();
    constexpr double gradients = D * (Kernel::support + 1) * Kernel::largest_gradient * detail::power(W, D - 1);
    const S mass = S(detail::power(W, D)) * load.cell_mass;
    return {mass * load.momentum_per_mass + S(gradients) * load.cell_mass * load.gradient_per_mass, mass,
            S(detail::power(Kernel::support + 1, D)) * load.cell_particles};
}

/// The largest scales for which every sum stays below `integer_max`, for a finite bound; 1 where there is nothing.
template <scalar S>
FIRN_INLINE FixedPointScale<S> largest_scale(const FixedPointBound<S>& bound, double integer_max) {
    const S room = S(integer_max) - bound.contributions;
    const auto largest = [&](const S& most) FIRN_LAMBDA {
        const auto is_none = most == S(0);
        const S rounded_up = most * S(1 + 0x1p-16);  // the contributions are rounded, and so is this
        const S quanta = room / select(is_none, S(1), rounded_up);
        constexpr int highest = sizeof(value_type_t<S>) == 4 ? 120 : 1000;
        return select(is_none, S(1), power_of_two(min(exponent_of(quanta), S(highest))));
    };
    return {largest(bound.momentum), largest(bound.mass)};
}

}  // namespace firn
