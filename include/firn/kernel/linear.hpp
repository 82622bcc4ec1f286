/// \file The linear ("hat") kernel.
#pragma once

#include <firn/kernel/concept.hpp>

namespace firn {

/// Linear ("hat") kernel: the narrowest. A particle touches 2^D nodes.
///
///     N(u) = 1 − |u|       for |u| < 1, else 0
///
/// u is the distance from the particle to the node in cells. The gradient jumps when a particle crosses into another
/// cell, and so do the forces (Steffen, Kirby and Berzins 2008). A node with a tiny share of a particle is thrown about
/// by that particle's stress, at any time step. Take it for comparisons and for dense matter; splines are the better
/// choice.
///
/// Its inertia along an axis, Σ N (x_i − x)² = h² f (1 − f), depends on the position, so it has no `inverse_inertia`
/// and needs WeightGradientForce. The affine field C = B D⁻¹ is computed as Σ v_i ⊗ ∇N_i, which is equal for every f
/// (Jiang et al. 2015, §5.3). The angular momentum of that field, in m C D, changes as the particle moves in its cell:
/// APIC keeps angular momentum from particles to grid and back, but not from step to step.
///
/// Sulsky, Chen and Schreyer 1994, "A particle method for history-dependent materials", §3.
struct Linear {
    static constexpr const char* name = "linear";
    static constexpr int support = 2;        ///< Nodes that a particle touches along an axis.
    static constexpr double base_shift = 0;  ///< The first node is base = floor(x − base_shift) [cells].
    /// Largest weight of each node: N(0).
    static constexpr std::array<double, 2> largest_weight{1, 1};
    static constexpr double largest_gradient = 1;  ///< largest |N'| per cell
    /// Largest c dt/h, half of the stable one in matter without gaps: ω² = (2 − 2 cos θ) c²/h² is 4 c²/h² at θ = π, so
    /// the limit there is 1.
    ///
    /// The half is for nodes at the border of matter: a node that has only the weight f of one particle moves with
    /// ω² = c²/h² / (f (1 − f)). No step is stable for every f.
    static constexpr double courant_limit = 0.5;

    /// Weights of the nodes base and base + 1 for a particle at f in [0, 1).
    template <scalar S>
    FIRN_INLINE static std::array<S, 2> weights(const S& f) {
        return {S(1) - f, f};
    }

    /// Derivatives of the weights by x, per cell (divide by h for [1/m]).
    template <scalar S>
    FIRN_INLINE static std::array<S, 2> gradients(const S&) {
        return {S(-1), S(1)};
    }
};

static_assert(kernel<Linear> && !has_inertia<Linear>);

}  // namespace firn
