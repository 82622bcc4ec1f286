/// \file The linear ("hat") kernel.
#pragma once

#include <firn/kernel/concept.hpp>

namespace firn {

/// The linear ("hat") kernel, the narrowest one. A particle touches 2^D nodes.
///
///     N(u) = 1 − |u|       for |u| < 1, else 0
///
/// u is the distance from the particle to the node in cells. The gradient jumps when a particle crosses into another
/// cell, and so do the forces (Steffen, Kirby and Berzins 2008). If a node has only a very small weight of one
/// particle, that particle's stress accelerates the node too much, at any time step. Use this kernel for comparisons
/// and for dense matter; splines are the better choice.
///
/// APIC's inertia along an axis, D = Σ N_i (x_i − x)² = h² f (1 − f), depends on the particle's distance f from node
/// base (h: cell size, x_i: position of node i). So this kernel has no `inverse_inertia` and needs WeightGradientForce.
/// APIC's affine field C is computed as Σ v_i ⊗ ∇N_i with the velocities v_i of the nodes, which is right for every f
/// (Jiang et al. 2015, §5.3). The angular momentum of the affine field, which is part of m C D for a particle of mass
/// m, changes as the particle moves within its cell: APIC conserves angular momentum from the particles to the grid and
/// back, but not from step to step.
///
/// Sulsky, Chen and Schreyer 1994, "A particle method for history-dependent materials", §3.
struct Linear {
    static constexpr const char* name = "linear";
    static constexpr int support = 2;        ///< Number of nodes that a particle touches along an axis.
    static constexpr double base_shift = 0;  ///< The first node is base = floor(x − base_shift) [cells].
    /// Largest weight that the nodes base and base + 1 can have: N(0).
    static constexpr std::array<double, 2> largest_weight{1, 1};
    static constexpr double largest_gradient = 1;  ///< Largest |N'| per cell.
    /// Largest c dt/h that firn takes: half of the largest stable one in matter without gaps. There ω² = (2 − 2 cos θ)
    /// c²/h² is largest at θ = π, ω = 2 c/h, so the largest stable c dt/h is 1. \see has_courant_limit
    ///
    /// The factor ½ is for nodes at the border of matter: a node that only one particle touches, with the weight f, has
    /// ω² = c²/h² / (f (1 − f)). No time step is stable for every f.
    static constexpr double courant_limit = 0.5;

    /// Returns the weights of the nodes base and base + 1 for a particle at the distance f from base, 0 ≤ f < 1
    /// [cells].
    template <scalar S>
    FIRN_INLINE static std::array<S, 2> weights(const S& f) {
        return {S(1) - f, f};
    }

    /// Returns the derivatives of the weights of the nodes base and base + 1 with respect to x, where x is in cells.
    /// (Divide them by the cell size to get [1/m].)
    template <scalar S>
    FIRN_INLINE static std::array<S, 2> gradients(const S&) {
        return {S(-1), S(1)};
    }
};

static_assert(kernel<Linear> && !has_inertia<Linear>);

}  // namespace firn
