/// \file PIC, the particle-in-cell method.
#pragma once

#include <firn/transfer/concept.hpp>

namespace firn {

/// PIC: a particle carries a velocity only, and takes it anew from the grid in every step.
///
///     v ← Σ N v_i
///
/// It is stable, and damps rotation and shear strongly. Take it for comparison, or to bring matter to rest quickly.
///
/// Harlow 1964, "The particle-in-cell computing method for fluid dynamics".
struct Pic {
    static constexpr const char* name = "pic";
    static constexpr bool affine = false;  ///< Particles carry no C.

    /// The affine field that a particle keeps: none, C = 0.
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> affine_field(const Mat<S, D>&) {
        return Mat<S, D>::zero();
    }
};

static_assert(transfer<Pic>);

}  // namespace firn
