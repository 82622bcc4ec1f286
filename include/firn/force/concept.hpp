/// \file What a force form is: how a particle's stress becomes forces on nodes, and which velocity gradient moves F.
///
/// The force on node i is f_i = −V0 τ ∇N_i [N], with V0 the undeformed volume of the particle and τ its Kirchhoff
/// stress. A form writes the impulse dt f_i [kg m/s] as
///
///     N_i A (x_i − x_p)/h  +  G ∇N_i,        ∇N_i per cell
///
/// and says which velocity gradient goes with it: Σ v_i ⊗ ∇N_i if `weight_gradients` is true, else the affine field C
/// if the transfer has one.
#pragma once

#include <firn/core/tensor.hpp>

namespace firn {

/// Has F `weight_gradients`, which says whether it needs ∇N (for G, and for Σ v_i ⊗ ∇N_i)?
template <class F>
concept has_gradient_flag = requires {
    { F::weight_gradients } -> std::convertible_to<bool>;
};
/// Has F `needs_inertia`, which says whether it needs a kernel with an `inverse_inertia`?
template <class F>
concept has_inertia_flag = requires {
    { F::needs_inertia } -> std::convertible_to<bool>;
};
/// Has F `affine_part(impulse, D_inverse, h)`, which returns A, and `gradient_part(impulse, h)`, which returns G? The
/// impulse is −dt V0 τ [J s], D⁻¹ in [1/m²], the cell size h in [m].
template <class F, class S, int D>
concept has_impulse_parts = requires(const Mat<S, D> impulse, const S s) {
    { F::affine_part(impulse, s, s) } -> std::same_as<Mat<S, D>>;
    { F::gradient_part(impulse, s) } -> std::same_as<Mat<S, D>>;
};

/// A force form.
template <class F>
concept force =
    has_gradient_flag<F> && has_inertia_flag<F> && has_impulse_parts<F, float, 3> && has_impulse_parts<F, double, 2>;

}  // namespace firn
