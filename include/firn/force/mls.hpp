/// \file Forces by moving least squares: ∇N_i ≈ N_i D⁻¹ (x_i − x_p). Hu et al. 2018 (MLS-MPM), eq. (18).
#pragma once

#include <firn/force/concept.hpp>

namespace firn {

struct MlsForce {
    static constexpr const char* name = "mls";
    static constexpr bool weight_gradients = false;
    static constexpr bool needs_inertia = true;

    /// A = (−dt V0 τ) D⁻¹ h [kg m/s a cell].
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> affine_part(const Mat<S, D>& impulse, const S& D_inverse, const S& h) {
        return impulse * (D_inverse * h);
    }
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> gradient_part(const Mat<S, D>&, const S&) {
        return Mat<S, D>::zero();
    }
};

static_assert(force<MlsForce>);

}  // namespace firn
