/// \file APIC, the affine particle-in-cell method: keeps angular momentum. Jiang et al. 2015.
#pragma once

#include <firn/transfer/concept.hpp>

namespace firn {

struct Apic {
    static constexpr const char* name = "apic";
    static constexpr bool affine = true;

    /// All of C = B D⁻¹ [1/s]. Jiang et al. 2015, eq. (8).
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> affine_field(const Mat<S, D>& C) {
        return C;
    }
};

static_assert(transfer<Apic>);

}  // namespace firn
