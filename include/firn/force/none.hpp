/// \file No forces: P2G of momentum and mass alone.
#pragma once

#include <firn/force/concept.hpp>

namespace firn {

struct NoForce {
    static constexpr const char* name = "none";
    static constexpr bool weight_gradients = false;
    static constexpr bool needs_inertia = false;

    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> affine_part(const Mat<S, D>&, const S&, const S&) {
        return Mat<S, D>::zero();
    }
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> gradient_part(const Mat<S, D>&, const S&) {
        return Mat<S, D>::zero();
    }
};

static_assert(force<NoForce>);

}  // namespace firn
