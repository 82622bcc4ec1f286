/// \file The concept of a force form: the policy that decides how a particle's stress becomes forces on nodes, and
/// which velocity gradient updates F.
///
/// The force on node i is f_i = −V0 τ ∇N_i [N], with V0 the undeformed volume of the particle, τ its Kirchhoff stress
/// and N_i its weight at node i. A force form writes the impulse dt f_i [kg m/s] as
///
///     N_i A (x_i − x_p)/h  +  G ∇N_i,        ∇N_i in [1/cell]
///
/// with two matrices A and G. x_i is the position of the node, x_p the position of the particle, and h the cell size. A
/// force form also decides which velocity gradient updates F. If `weight_gradients` is true, it is Σ v_i ⊗ ∇N_i. Else
/// it is B D⁻¹ with B = Σ N_i v_i (x_i − x_p)ᵀ, whether the transfer keeps this field or not, if G2P sums B (see
/// g2p_needs_moment); a kernel without a constant D may leave Σ v_i ⊗ ∇N_i in its place.
#pragma once

#include <firn/core/tensor.hpp>

namespace firn::inline FIRN_BUILD {

/// Whether F has a constant `weight_gradients`. This constant is true if the force form F needs the gradients ∇N_i of
/// the weights: for the forces, and for the velocity gradient Σ v_i ⊗ ∇N_i.
template <class F>
concept has_gradient_flag = requires {
    { F::weight_gradients } -> std::convertible_to<bool>;
};
/// Whether F has a constant `needs_inertia`. This constant is true if the force form F needs a kernel that has the
/// constant `inverse_inertia`.
template <class F>
concept has_inertia_flag = requires {
    { F::needs_inertia } -> std::convertible_to<bool>;
};
/// Whether F has the functions `affine_part(impulse, D_inverse, h)`, which returns the matrix A, and
/// `gradient_part(impulse, h)`, which returns the matrix G. The impulse on node i is N_i A (x_i − x_p)/h + G ∇N_i,
/// where N_i is the weight, ∇N_i its gradient [1/cell], and x_i − x_p the vector from the particle to the node.
/// `impulse` is −dt V0 τ [J s], with the undeformed volume V0 and the Kirchhoff stress τ; `D_inverse` is the kernel's
/// D⁻¹ [1/m²], h the cell size [m].
template <class F, class S, int D>
concept has_impulse_parts = requires(const Mat<S, D> impulse, const S s) {
    { F::affine_part(impulse, s, s) } -> std::same_as<Mat<S, D>>;
    { F::gradient_part(impulse, s) } -> std::same_as<Mat<S, D>>;
};

/// Whether F is a force form: F has the constants `weight_gradients` and `needs_inertia`, and the functions
/// affine_part() and gradient_part().
template <class F>
concept force =
    has_gradient_flag<F> && has_inertia_flag<F> && has_impulse_parts<F, float, 3> && has_impulse_parts<F, double, 2>;

/// Returns true if F is a force form. If F is not, the compilation stops with a message.
template <class F>
consteval bool require_force() {
    static_assert(has_gradient_flag<F> && has_inertia_flag<F>,
                  "firn: a force form says what it needs: static constexpr bool weight_gradients and needs_inertia.");
    static_assert(!has_gradient_flag<F> || !has_inertia_flag<F> || force<F>,
                  "firn: a force form offers static functions affine_part(impulse, D_inverse, h) and "
                  "gradient_part(impulse, h), which return a Mat for every scalar; see firn/force/concept.hpp.");
    return force<F>;
}

}  // namespace firn::inline FIRN_BUILD
