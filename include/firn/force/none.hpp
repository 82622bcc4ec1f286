/// \file No forces: P2G of momentum and mass only.
#pragma once

#include <firn/force/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// A force form (a policy for the forces of stress) without forces: stress is ignored. NoForce is for passes that
/// transfer only momentum and mass, such as the passes of Fmpm.
struct NoForce {
    static constexpr const char* name = "none";
    static constexpr bool weight_gradients = false;  ///< NoForce needs no gradients of weights.
    static constexpr bool needs_inertia = false;     ///< NoForce works with every kernel.

    /// Returns the matrix A = 0: the impulse has no part N_i A (x_i − x_p)/h.
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> affine_part(const Mat<S, D>&, const S&, const S&) {
        return Mat<S, D>::zero();
    }
    /// Returns the matrix G = 0: the impulse has no part G ∇N_i.
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> gradient_part(const Mat<S, D>&, const S&) {
        return Mat<S, D>::zero();
    }
};

static_assert(force<NoForce>);

namespace detail {

/// NoForce for particles without an affine field: a node receives the same at every offset, apart from its weight. So
/// records have neither a matrix A nor a matrix G.
struct NoForceNoField : NoForce {
    static constexpr bool constant_records = true;
};

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
