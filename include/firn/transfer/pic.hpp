/// \file PIC, the particle-in-cell method.
#pragma once

#include <firn/transfer/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// PIC: a particle carries only a velocity v, which is replaced by the grid's velocity in every step.
///
///     v ← Σ N v_i
///
/// N is the particle's weight at node i, v_i the node's velocity.
///
/// PIC is stable, and damps rotation and shear strongly. Use PIC for comparison, or to bring matter to rest quickly.
///
/// Harlow 1964, "The particle-in-cell computing method for fluid dynamics".
struct Pic {
    static constexpr const char* name = "pic";
    static constexpr bool affine = false;  ///< Particles carry no C.

    /// Returns zero: a particle keeps no affine field C.
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> affine_field(const Mat<S, D>&) {
        return Mat<S, D>::zero();
    }
};

static_assert(transfer<Pic>);

}  // namespace firn::inline FIRN_BUILD
