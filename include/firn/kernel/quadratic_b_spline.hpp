/// \file The quadratic B-spline kernel.
#pragma once

#include <firn/kernel/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// The quadratic B-spline, the default kernel. A particle touches 3^D nodes.
///
///     N(u) = ¾ − u²                for |u| < ½
///     N(u) = ½ (3/2 − |u|)²        for ½ ≤ |u| < 3/2, else 0
///
/// u is the distance from the particle to the node in cells. N is continuously differentiable, so forces do not jump
/// when a particle crosses into another cell. Use this kernel unless you have a reason for another one.
///
/// Steffen, Kirby and Berzins 2008, "Analysis and reduction of quadrature errors in the material point method (MPM)";
/// Jiang et al. 2016, "The Material Point Method for Simulating Continuum Materials", §4.
struct QuadraticBSpline {
    static constexpr const char* name = "quadratic_b_spline";
    static constexpr int support = 3;             ///< Number of nodes that a particle touches along an axis.
    static constexpr double base_shift = 0.5;     ///< First node for a particle at x [cells]: floor(x − base_shift).
    static constexpr double inverse_inertia = 4;  ///< APIC's inertia is D = h² / inverse_inertia I (h: cell size).
    /// Largest weights that the nodes base, base + 1 and base + 2 can have: N(½), N(0), N(½). The outer nodes are at
    /// least half a cell from the particle.
    static constexpr std::array<double, 3> largest_weight{0.5, 0.75, 0.5};
    static constexpr double largest_gradient = 1;  ///< Largest value of |N'| [1/cell].
    /// Largest stable c dt/h (c: wave speed, h: cell size). It follows from the largest stable dt = 2/ω with ω² = (2 −
    /// 2z)(2 + z)/3 c²/h², where z = cos θ and θ is the phase difference between neighbouring nodes. ω² is largest at z
    /// = −½, where it is 1.5 c²/h². \see has_courant_limit
    static constexpr double courant_limit = 1.6329931618554521;

    /// Returns the weights of the nodes base, base + 1 and base + 2 for a particle at the distance f from base,
    /// ½ ≤ f < 3/2 [cells].
    template <scalar S>
    FIRN_INLINE static std::array<S, 3> weights(const S& f) {
        const S left = S(1.5) - f, middle = f - S(1), right = f - S(0.5);
        return {S(0.5) * left * left, S(0.75) - middle * middle, S(0.5) * right * right};
    }

    /// Returns the derivatives of the weights of the nodes base, base + 1 and base + 2 with respect to the particle's
    /// coordinate x in cells, at the distance f = x − base. (Divide them by the cell size to get [1/m].)
    template <scalar S>
    FIRN_INLINE static std::array<S, 3> gradients(const S& f) {
        return {f - S(1.5), S(2) - (f + f), f - S(0.5)};
    }
};

static_assert(kernel<QuadraticBSpline>);

}  // namespace firn::inline FIRN_BUILD
