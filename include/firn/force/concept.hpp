/// \file What a force form is: how a particle's stress becomes forces on nodes, and which velocity gradient updates F.
///
/// The force on node i is f_i = −V0 τ ∇N_i [N], with V0 the undeformed volume of the particle, τ its Kirchhoff stress
/// and N_i its weight at node i. A force form writes the impulse dt f_i [kg m/s] as
///
///     N_i A (x_i − x_p)/h  +  G ∇N_i,        ∇N_i in [1/cell]
///
/// with two matrices A and G, the positions x_i of the node and x_p of the particle, and the cell size h. A force form
/// also decides which velocity gradient updates F. If `weight_gradients` is true, or if the transfer or the kernel
/// gives no affine field C, the gradient is Σ v_i ⊗ ∇N_i; else it is C.
#pragma once

#include <firn/core/tensor.hpp>

namespace firn {

/// Has F a constant `weight_gradients`? It is true if the force form needs ∇N (for G, and for Σ v_i ⊗ ∇N_i).
template <class F>
concept has_gradient_flag = requires {
    { F::weight_gradients } -> std::convertible_to<bool>;
};
/// Has F a constant `needs_inertia`? It is true if the force form needs a kernel with an `inverse_inertia`.
template <class F>
concept has_inertia_flag = requires {
    { F::needs_inertia } -> std::convertible_to<bool>;
};
/// Has F `affine_part(impulse, D_inverse, h)`, which returns A, and `gradient_part(impulse, h)`, which returns G? The
/// impulse on node i is N_i A (x_i − x_p)/h + G ∇N_i, with ∇N_i in [1/cell]. `impulse` is −dt V0 τ [J s], `D_inverse`
/// is D⁻¹ [1/m²], h the cell size [m].
template <class F, class S, int D>
concept has_impulse_parts = requires(const Mat<S, D> impulse, const S s) {
    { F::affine_part(impulse, s, s) } -> std::same_as<Mat<S, D>>;
    { F::gradient_part(impulse, s) } -> std::same_as<Mat<S, D>>;
};

/// A force form: it has `weight_gradients`, `needs_inertia`, affine_part() and gradient_part().
template <class F>
concept force =
    has_gradient_flag<F> && has_inertia_flag<F> && has_impulse_parts<F, float, 3> && has_impulse_parts<F, double, 2>;

}  // namespace firn
