/// \file Linear ("hat") kernel: N(u) = 1 − |u| for |u| < 1, else 0. Sulsky, Chen and Schreyer 1994, §3.
#pragma once

#include <firn/kernel/concept.hpp>

namespace firn {

/// The narrowest kernel: a particle touches 2^D nodes. Its gradient jumps where a particle crosses from cell to cell,
/// and so do the forces (Steffen, Kirby and Berzins 2008); a node with a vanishing share of a particle is thrown about
/// by that particle's stress, at any time step. For comparisons and for dense matter; splines are the better choice.
///
/// Its inertia, Σ N (x_i − x)² = h² f (1 − f) along an axis, depends on the position: there is no `inverse_inertia`. An
/// affine field C = B D⁻¹ is then Σ v_i ⊗ ∇N_i, which equals it for every f (Jiang et al. 2015, §5.3), and forces come
/// from the gradients of the weights. What a particle's field turns, m C D, changes where it moves within its cell:
/// APIC keeps angular momentum from particles to grid and back, but not from step to step.
struct Linear {
    static constexpr const char* name = "linear";
    static constexpr int support = 2;
    static constexpr double base_shift = 0;
    /// Both nodes: N(0).
    static constexpr std::array<double, 2> largest_weight{1, 1};
    static constexpr double largest_gradient = 1;
    /// In matter without gaps ω² = (2 − 2 cos θ) c²/h², 4 at θ = π: 1. Half of it, because a node at the border of
    /// matter that only has the weight f of one particle moves with ω² = c²/h² / (f (1 − f)): none is stable for every
    /// f.
    static constexpr double courant_limit = 0.5;

    /// Weights of the nodes base, base + 1; f in [0, 1).
    template <scalar S>
    FIRN_INLINE static std::array<S, 2> weights(const S& f) {
        return {S(1) - f, f};
    }

    /// Derivatives of the weights by x, per cell (divide by h for 1/m).
    template <scalar S>
    FIRN_INLINE static std::array<S, 2> gradients(const S&) {
        return {S(-1), S(1)};
    }
};

static_assert(kernel<Linear> && !has_inertia<Linear>);

}  // namespace firn
