/// \file AFLIP and ASFLIP: APIC blended with FLIP. Fei et al. 2021.
#pragma once

#include <firn/transfer/concept.hpp>

namespace firn {

/// As Flip, from nodes and to nodes with the affine field C of APIC. Less noisy than Flip, less is lost than with APIC.
/// Momentum is kept to rounding; angular momentum only where own velocities and C are of one field.
template <scalar S = float>
struct Aflip {
    static constexpr const char* name = "aflip";
    static constexpr bool affine = true;

    S ratio = S(0.95);  ///< α, 0 (APIC) to 1

    void check() const { check_share(ratio, name, "ratio"); }
    static constexpr auto parameters() { return std::tuple{parameter{"ratio", "1", &Aflip::ratio}}; }

    template <class T, int D>
    FIRN_INLINE static Mat<T, D> affine_field(const Mat<T, D>& C) {
        return C;
    }
    template <class T, int D>
    FIRN_INLINE ParticleVelocity<T, D> blended(const Vec<T, D>& taken, const Vec<T, D>& before, const Vec<T, D>& own,
                                               const Mat<T, D>&) const {
        return {taken + (own - before) * ratio, taken};
    }
};

/// Aflip whose particles also move with a share β of what their velocity differs from the grid's, so that bodies that
/// share nodes come apart. β is `separation` where the flow around the particle expands (tr ∇v ≥ 0), else `approach`:
/// particles that are pressed together stay with the grid, and matter does not pass through matter. (Expansion is told
/// by ∇v, which every material has.)
template <scalar S = float>
struct Asflip {
    static constexpr const char* name = "asflip";
    static constexpr bool affine = true;

    S ratio = S(0.95);    ///< α, 0 to 1
    S separation = S(1);  ///< β where matter expands, 0 to 1
    S approach = S(0);    ///< β where it is compressed, 0 to 1

    void check() const {
        check_share(ratio, name, "ratio");
        check_share(separation, name, "separation");
        check_share(approach, name, "approach");
    }
    static constexpr auto parameters() {
        return std::tuple{parameter{"ratio", "1", &Asflip::ratio}, parameter{"separation", "1", &Asflip::separation},
                          parameter{"approach", "1", &Asflip::approach}};
    }

    template <class T, int D>
    FIRN_INLINE static Mat<T, D> affine_field(const Mat<T, D>& C) {
        return C;
    }
    template <class T, int D>
    FIRN_INLINE ParticleVelocity<T, D> blended(const Vec<T, D>& taken, const Vec<T, D>& before, const Vec<T, D>& own,
                                               const Mat<T, D>& velocity_gradient) const {
        const Vec<T, D> difference = (own - before) * ratio;
        const T share = select(trace(velocity_gradient) >= T(0), separation, approach);
        return {taken + difference, taken + difference * share};
    }
};

static_assert(transfer<Aflip<>> && blends_velocities<Aflip<>>);
static_assert(transfer<Asflip<>> && blends_velocities<Asflip<>>);

}  // namespace firn
