/// \file What a force form is: how a particle's stress becomes nodal forces, and which velocity gradient moves F.
#pragma once

#include <firn/core/tensor.hpp>

namespace firn {

// The force on node i is f_i = −V0 τ ∇N_i. A form writes the impulse dt f_i as
//     N_i A (x_i − x_p)/h  +  G ∇N_i,     ∇N_i per cell,
// and says which velocity gradient it goes with.

template <class F>
concept has_gradient_flag = requires {
    { F::weight_gradients } -> std::convertible_to<bool>;  ///< does it need ∇N (then G, and Σ v_i ⊗ ∇N_i) ?
};
template <class F>
concept has_inertia_flag = requires {
    { F::needs_inertia } -> std::convertible_to<bool>;  ///< does it need a kernel with an inverse_inertia ?
};
template <class F, class S, int D>
concept has_impulse_parts = requires(const Mat<S, D> impulse, const S s) {
    { F::affine_part(impulse, s, s) } -> std::same_as<Mat<S, D>>;
    { F::gradient_part(impulse, s) } -> std::same_as<Mat<S, D>>;
};

template <class F>
concept force =
    has_gradient_flag<F> && has_inertia_flag<F> && has_impulse_parts<F, float, 3> && has_impulse_parts<F, double, 2>;

}  // namespace firn
