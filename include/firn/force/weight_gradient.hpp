/// \file Forces by the gradient of the weights: f_i = −V0 τ ∇N_i. Sulsky et al. 1995; Stomakhin et al. 2013, eq. (6).
#pragma once

#include <firn/force/concept.hpp>

namespace firn {

struct WeightGradientForce {
    static constexpr const char* name = "weight_gradient";
    static constexpr bool weight_gradients = true;
    static constexpr bool needs_inertia = false;

    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> affine_part(const Mat<S, D>&, const S&, const S&) {
        return Mat<S, D>::zero();
    }
    /// G = −dt V0 τ / h [kg m/s], with ∇N per cell.
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> gradient_part(const Mat<S, D>& impulse, const S& h) {
        return impulse * (S(1) / h);
    }
};

static_assert(force<WeightGradientForce>);

}  // namespace firn
