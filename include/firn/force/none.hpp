/// \file No forces: P2G of momentum and mass only.
#pragma once

#include <firn/force/concept.hpp>

namespace firn {

/// A force form without forces: stress is ignored. It is for passes that transfer only momentum and mass, such as the
/// passes of Fmpm.
struct NoForce {
    static constexpr const char* name = "none";
    static constexpr bool weight_gradients = false;  ///< This form needs no ∇N.
    static constexpr bool needs_inertia = false;     ///< This form works with every kernel.

    /// Returns A = 0: the impulse has no affine part.
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> affine_part(const Mat<S, D>&, const S&, const S&) {
        return Mat<S, D>::zero();
    }
    /// Returns G = 0: the impulse has no part with ∇N.
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> gradient_part(const Mat<S, D>&, const S&) {
        return Mat<S, D>::zero();
    }
};

static_assert(force<NoForce>);

}  // namespace firn
