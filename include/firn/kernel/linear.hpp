/// \file The linear ("hat") kernel.
#pragma once

#include <firn/kernel/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// The linear ("hat") kernel, the narrowest one. A particle touches 2^D nodes.
///
///     N(u) = 1 − |u|       for |u| < 1, else 0
///
/// u is the distance from the particle to the node in cells. The gradient of N jumps when a particle crosses into
/// another cell, and the forces jump with it (Steffen, Kirby and Berzins 2008). If a node is touched by only one
/// particle, and the weight is very small, the stress of this particle accelerates the node too much, however small the
/// time step is. Splines are the better choice; use this kernel for comparisons and for dense matter.
///
/// APIC's inertia along an axis, D = Σ N_i (x_i − x)² = h² f (1 − f), depends on the particle's distance f from node
/// base (h: cell size, x_i: position of node i). So this kernel has no `inverse_inertia` and needs WeightGradientForce.
/// APIC's affine field C is computed as Σ v_i ⊗ ∇N_i with the velocities v_i of the nodes, which is right for every f
/// (Jiang et al. 2015, §5.3). For a particle of mass m, the angular momentum of the affine field is part of m C D. This
/// angular momentum changes as the particle moves within its cell, since D changes. Therefore APIC conserves angular
/// momentum from the particles to the grid and back, but not from step to step.
///
/// Sulsky, Chen and Schreyer 1994, "A particle method for history-dependent materials", §3.
struct Linear {
    static constexpr const char* name = "linear";
    static constexpr int support = 2;        ///< Number of nodes that a particle touches along an axis.
    static constexpr double base_shift = 0;  ///< First node for a particle at x [cells]: floor(x − base_shift).
    /// Largest weights that the nodes base and base + 1 can have: N(0) for both.
    static constexpr std::array<double, 2> largest_weight{1, 1};
    static constexpr double largest_gradient = 1;  ///< Largest value of |N'| [1/cell].
    /// Largest c dt/h that firn uses (c: wave speed, h: cell size). It is half of the largest stable value in matter
    /// without gaps. That stable value is 1: it follows from dt = 2/ω with ω² = (2 − 2 cos θ) c²/h², where θ is the
    /// phase difference between neighbouring nodes. ω² is largest at θ = π, where ω = 2 c/h. \see has_courant_limit
    ///
    /// The factor ½ is a margin for nodes at the border of matter. A node that only one particle touches, with the
    /// weight f, has the squared angular frequency ω² = c²/h² / (f (1 − f)), so no time step is stable for every f.
    static constexpr double courant_limit = 0.5;
    /// The largest stretch, for any number of particles a cell. Bars broke at 1.1 to 1.2, with up to four a cell and
    /// axis: the jumps of the gradients tear them.
    static constexpr double joined_stretch(double) { return 1.1; }

    /// Returns the weights of the nodes base and base + 1 for a particle at the distance f from base, 0 ≤ f < 1
    /// [cells].
    template <scalar S>
    FIRN_INLINE static std::array<S, 2> weights(const S& f) {
        return {S(1) - f, f};
    }

    /// Returns the derivatives of the weights of the nodes base and base + 1 with respect to the particle's coordinate
    /// x in cells. (Divide them by the cell size to get [1/m].)
    template <scalar S>
    FIRN_INLINE static std::array<S, 2> gradients(const S&) {
        return {S(-1), S(1)};
    }
};

static_assert(kernel<Linear> && !has_inertia<Linear>);

}  // namespace firn::inline FIRN_BUILD
