/// \file The compact quartic kernel.
#pragma once

#include <firn/kernel/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// The compact quartic spline, which is as smooth as the cubic B-spline but no wider than the quadratic one. A particle
/// touches 3^D nodes.
///
///     M(u) = 13/16 − 3/2 u² + u⁴      for |u| < ½
///     M(u) = e³ (1 − e/2)             for ½ ≤ |u| < 3/2, with e = 3/2 − |u|, else 0
///
/// u is the distance from the particle to the node in cells. M is twice continuously differentiable. The weights sum to
/// one and reproduce linear fields. M is the antiderivative of the weights of MLS forces: M'(u) = −u N(u)/D, where N is
/// the quadratic B-spline and D = ¼ is its inertia. So in one dimension, MLS forces of the quadratic B-spline and
/// weight gradients of this kernel are the same. In two and three dimensions, each component of an MLS force is the
/// gradient of another function: M N along x, N M along y. At a surface that is inclined to the grid, these functions
/// differ, and a stress that leaves the surface free of forces still moves the outer nodes. The outermost particles
/// then yield: see MlsForce. With this kernel, all components are gradients of one function, M M.
///
/// Use CompactQuartic with WeightGradientForce where solids bend far and return: beams, plates, jelly. A step costs
/// about as much as with QuadraticBSpline and WeightGradientForce, 1.3 times as much as with MlsForce. The largest
/// stable time step is 12 % smaller.
///
/// The inertia of affine transfers depends on the particle's position, D = h² (¼ − (¼ − d²)²) along each axis, where d
/// is the distance to the nearest node in cells. Apic uses this D: transfers to the grid and back conserve angular
/// momentum. Between two steps, the angular momentum of C changes a little, up and down, because D changes as the
/// particle moves. The angular momentum of a disk that turns ten times stays within 1.4e-4. MlsForce needs a constant D
/// and does not work with this kernel.
///
/// The kernel follows from the force of Hu et al. 2018, "A moving least squares material point method with displacement
/// discontinuity and two-way rigid body coupling", eq. (18), by integration along one axis.
struct CompactQuartic {
    static constexpr const char* name = "compact_quartic";
    static constexpr int support = 3;          ///< Number of nodes that a particle touches along an axis.
    static constexpr double base_shift = 0.5;  ///< First node for a particle at x [cells]: floor(x − base_shift).
    /// Largest weights that the nodes base, base + 1 and base + 2 can have: M(½), M(0), M(½). The outer nodes are at
    /// least half a cell from the particle.
    static constexpr std::array<double, 3> largest_weight{0.5, 13.0 / 16, 0.5};
    static constexpr double largest_gradient = 1;  ///< Largest value of |M'| [1/cell], at |u| = ½.
    /// Largest stable c dt/h (c: wave speed, h: cell size). It follows from the largest stable dt = 2/ω with ω² = (52 −
    /// 34 z − 18 z²)/35 c²/h², where z = cos θ and θ is the phase difference between neighbouring nodes. ω² is largest
    /// at z = −17/18, where it is 35/18 c²/h². \see has_courant_limit
    static constexpr double courant_limit = 1.4342743312012722;

    /// Returns APIC's inertia D/h² along one axis for a particle at the distance d from the middle one of its three
    /// nodes, −½ ≤ d ≤ ½ [cells]: ¼ − (¼ − d²)².
    template <scalar S>
    FIRN_INLINE static S inertia(const S& d) {
        const S rest = S(0.25) - d * d;
        return S(0.25) - rest * rest;
    }

    /// Returns the weights of the nodes base, base + 1 and base + 2 for a particle at the distance f from base,
    /// ½ ≤ f < 3/2 [cells].
    template <scalar S>
    FIRN_INLINE static std::array<S, 3> weights(const S& f) {
        const S left = S(1.5) - f, middle = f - S(1), right = f - S(0.5);
        const S left_squared = left * left, squared = middle * middle, right_squared = right * right;
        return {left_squared * (left - S(0.5) * left_squared), S(0.8125) - squared * (S(1.5) - squared),
                right_squared * (right - S(0.5) * right_squared)};
    }

    /// Returns the derivatives of the weights of the nodes base, base + 1 and base + 2 with respect to the particle's
    /// coordinate x in cells, at the distance f = x − base. (Divide them by the cell size to get [1/m].)
    template <scalar S>
    FIRN_INLINE static std::array<S, 3> gradients(const S& f) {
        const S left = S(1.5) - f, middle = f - S(1), right = f - S(0.5);
        return {left * left * (left + left - S(3)), middle * (S(4) * middle * middle - S(3)),
                right * right * (S(3) - (right + right))};
    }
};

static_assert(kernel<CompactQuartic> && has_local_inertia<CompactQuartic>);

}  // namespace firn::inline FIRN_BUILD
