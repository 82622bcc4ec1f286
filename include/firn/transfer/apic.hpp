/// \file APIC, the affine particle-in-cell method: keeps angular momentum. Jiang et al. 2015.
#pragma once

#include <firn/transfer/concept.hpp>

namespace firn {

struct Apic {
    static constexpr const char* name = "apic";
    static constexpr bool affine = true;

    /// C = B D⁻¹ [1/s], from B = Σ N v_i (x_i − x_p)ᵀ [m²/s] and D⁻¹ [1/m²]. Jiang et al. 2015, eq. (8).
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> affine_field(const Mat<S, D>& B, const S& D_inverse) {
        return B * D_inverse;
    }
};

static_assert(transfer<Apic>);

}  // namespace firn
