/// \file The cubic B-spline kernel.
#pragma once

#include <firn/kernel/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// The cubic B-spline, the widest and smoothest kernel. A particle touches 4^D nodes.
///
///     N(u) = ⅔ − u² + ½ |u|³       for |u| < 1
///     N(u) = ⅙ (2 − |u|)³          for 1 ≤ |u| < 2, else 0
///
/// u is the distance from the particle to the node in cells. N is twice continuously differentiable. Use this kernel
/// where smooth stresses are more important than computing time: in 3D a particle touches 64 nodes, but only 27 with
/// the quadratic spline.
///
/// Steffen, Kirby and Berzins 2008, "Analysis and reduction of quadrature errors in the material point method (MPM)";
/// Jiang et al. 2016, "The Material Point Method for Simulating Continuum Materials", §4.
struct CubicBSpline {
    static constexpr const char* name = "cubic_b_spline";
    static constexpr int support = 4;             ///< Number of nodes that a particle touches along an axis.
    static constexpr double base_shift = 1;       ///< First node for a particle at x [cells]: floor(x − base_shift).
    static constexpr double inverse_inertia = 3;  ///< APIC's inertia is D = h² / inverse_inertia I (h: cell size).
    /// Largest weights that the nodes base, …, base + 3 can have: N(1), N(0), N(0), N(1). The outer nodes are at least
    /// one cell from the particle.
    static constexpr std::array<double, 4> largest_weight{1.0 / 6, 2.0 / 3, 2.0 / 3, 1.0 / 6};
    static constexpr double largest_gradient = 2.0 / 3;  ///< Largest value of |N'| [1/cell], at |u| = ⅔.
    /// Largest stable c dt/h (c: wave speed, h: cell size). It follows from the largest stable dt = 2/ω with ω² = (1 −
    /// z)(16 + 13 z + z²)/15 c²/h², where z = cos θ and θ is the phase difference between neighbouring nodes. ω² is
    /// largest at z = √15 − 4. \see has_courant_limit
    static constexpr double courant_limit = 1.9251248585239016;
    /// The largest stretch of n particles a cell and axis. Bars broke at 1.1, 1.9, 2.5 and 3.1 for n = 1 to 4.
    static constexpr double joined_stretch(double n) { return 1.05 + 0.67 * std::max(n - 1, 0.0); }

    /// Returns the weights of the nodes base, …, base + 3 for a particle at the distance f from base, 1 ≤ f < 2
    /// [cells].
    template <scalar S>
    FIRN_INLINE static std::array<S, 4> weights(const S& f) {
        const S left = S(2) - f, right = f - S(1);  // distances to the two nodes beside the particle
        const S left_squared = left * left, right_squared = right * right;
        return {S(1.0 / 6) * left_squared * left, S(2.0 / 3) - right_squared * (S(1) - S(0.5) * right),
                S(2.0 / 3) - left_squared * (S(1) - S(0.5) * left), S(1.0 / 6) * right_squared * right};
    }

    /// Returns the derivatives of the weights of the nodes base, …, base + 3 with respect to the particle's coordinate
    /// x in cells, at the distance f = x − base. (Divide them by the cell size to get [1/m].)
    template <scalar S>
    FIRN_INLINE static std::array<S, 4> gradients(const S& f) {
        const S left = S(2) - f, right = f - S(1);
        return {S(-0.5) * left * left, right * (S(1.5) * right - S(2)), left * (S(2) - S(1.5) * left),
                S(0.5) * right * right};
    }
};

static_assert(kernel<CubicBSpline>);

}  // namespace firn::inline FIRN_BUILD
