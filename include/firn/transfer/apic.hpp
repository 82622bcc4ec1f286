/// \file APIC, the affine particle-in-cell method.
#pragma once

#include <firn/transfer/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// APIC, the default transfer: a particle carries a velocity and an affine velocity field around the particle.
///
///     v ← Σ N v_i
///     C ← B D⁻¹,        B = Σ N v_i (x_i − x_p)ᵀ
///
/// Here v and x_p are the particle's velocity and position, N is the particle's weight at node i, v_i and x_i are the
/// node's velocity and position, and D = Σ N (x_i − x_p)(x_i − x_p)ᵀ.
///
/// APIC conserves momentum and angular momentum, and is stable and free of noise. Use APIC unless it damps motion too
/// much; Aflip and Fmpm damp less.
///
/// Jiang, Schroeder, Selle, Teran and Stomakhin 2015, "The Affine Particle-In-Cell Method".
struct Apic {
    static constexpr const char* name = "apic";
    static constexpr bool affine = true;  ///< Particles carry C.

    /// Returns the affine field that a particle keeps after a step: C = B D⁻¹, unchanged [1/s]. Jiang et al. 2015, eq.
    /// (8).
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> affine_field(const Mat<S, D>& C) {
        return C;
    }
};

static_assert(transfer<Apic>);

}  // namespace firn::inline FIRN_BUILD
