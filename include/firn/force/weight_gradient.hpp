/// \file Forces from the gradients of the weights, the classical form of MPM.
#pragma once

#include <firn/force/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// Forces from the gradients of the weights, the classical form of MPM.
///
///     f_i = −V0 τ ∇N_i       [N]
///
/// V0 is the undeformed volume of the particle, τ its Kirchhoff stress, N_i its weight at node i. The velocity gradient
/// that updates F is Σ v_i ⊗ ∇N_i.
///
/// Use WeightGradientForce with the Linear kernel and for comparison with classical MPM; with CompactQuartic for solids
/// that bend far. WeightGradientForce works with every kernel.
///
/// Sulsky, Zhou and Schreyer 1995, "Application of a particle-in-cell method to solid mechanics"; Stomakhin et al.
/// 2013, "A material point method for snow simulation", eq. (6).
struct WeightGradientForce {
    static constexpr const char* name = "weight_gradient";
    static constexpr bool weight_gradients = true;  ///< WeightGradientForce needs the gradients of the weights.
    static constexpr bool needs_inertia = false;    ///< WeightGradientForce works with every kernel.

    /// Returns the matrix A = 0: the impulse has no part N_i A (x_i − x_p)/h.
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> affine_part(const Mat<S, D>&, const S&, const S&) {
        return Mat<S, D>::zero();
    }
    /// Returns the matrix G = −dt V0 τ / h [kg m/s]: the impulse on node i is G ∇N_i, with ∇N_i in [1/cell].
    /// \param impulse  −dt V0 τ [J s], with the undeformed volume V0 and the Kirchhoff stress τ
    /// \param h        cell size [m]
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> gradient_part(const Mat<S, D>& impulse, const S& h) {
        return impulse * (S(1) / h);
    }
};

static_assert(force<WeightGradientForce>);

}  // namespace firn::inline FIRN_BUILD
