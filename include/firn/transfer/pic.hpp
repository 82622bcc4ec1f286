/// \file PIC, the particle-in-cell method: stable, damps rotation and shear strongly. Harlow 1964.
#pragma once

#include <firn/transfer/concept.hpp>

namespace firn {

struct Pic {
    static constexpr const char* name = "pic";
    static constexpr bool affine = false;

    /// A particle carries no velocity field of its own: C = 0.
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> affine_field(const Mat<S, D>&) {
        return Mat<S, D>::zero();
    }
};

static_assert(transfer<Pic>);

}  // namespace firn
