/// \file No forces: P2G of momentum and mass only.
#pragma once

#include <firn/force/concept.hpp>

namespace firn {

/// No forces: stress is ignored. For passes that only move momentum and mass, such as those of Fmpm.
struct NoForce {
    static constexpr const char* name = "none";
    static constexpr bool weight_gradients = false;  ///< It needs no ∇N.
    static constexpr bool needs_inertia = false;     ///< Any kernel will do.

    /// A = 0.
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> affine_part(const Mat<S, D>&, const S&, const S&) {
        return Mat<S, D>::zero();
    }
    /// G = 0.
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> gradient_part(const Mat<S, D>&, const S&) {
        return Mat<S, D>::zero();
    }
};

static_assert(force<NoForce>);

}  // namespace firn
