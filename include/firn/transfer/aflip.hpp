/// \file AFLIP and ASFLIP: APIC blended with FLIP.
#pragma once

#include <firn/transfer/concept.hpp>

namespace firn {

/// AFLIP: Flip that also carries APIC's affine field C from particles to nodes and back.
///
///     v ← Σ N v_i' + α (v − Σ N v_i)
///
/// v_i are the nodes' velocities before forces acted, v_i' those after the step. The particle moves with Σ N v_i'.
///
/// Take it for lively motion: it is less noisy than Flip and loses less than APIC. It conserves momentum to rounding,
/// but angular momentum only if the particles' own velocities and C belong to one field.
///
/// Fei et al. 2021, "Revisiting Integration in the Material Point Method: A Scheme for Easier Separation and Less
/// Dissipation".
template <scalar S = float>
struct Aflip {
    static constexpr const char* name = "aflip";
    static constexpr bool affine = true;  ///< Particles carry C.

    S ratio = S(0.95);  ///< α: 0 (APIC) to 1 [1]

    /// Checks the parameters.
    /// \throws parameter_error unless 0 ≤ α ≤ 1
    void check() const { check_share(ratio, name, "ratio"); }
    static constexpr auto parameters() { return std::tuple{parameter{"ratio", "1", &Aflip::ratio}}; }

    /// The affine field that a particle keeps: all of C [1/s].
    template <class T, int D>
    FIRN_INLINE static Mat<T, D> affine_field(const Mat<T, D>& C) {
        return C;
    }
    /// The particle's velocities after the step.
    /// \param taken   Σ N v_i', after the step [m/s]
    /// \param before  Σ N v_i, before forces acted [m/s]
    /// \param own     the particle's velocity before the step [m/s]
    template <class T, int D>
    FIRN_INLINE ParticleVelocity<T, D> blended(const Vec<T, D>& taken, const Vec<T, D>& before, const Vec<T, D>& own,
                                               const Mat<T, D>&) const {
        return {taken + (own - before) * ratio, taken};
    }
};

/// ASFLIP: Aflip whose particles also move by a share β of their own velocity, so that bodies come apart more easily.
///
///     v ← Σ N v_i' + α (v − Σ N v_i)
///     dx/dt = Σ N v_i' + β α (v − Σ N v_i)
///
/// v_i are the nodes' velocities before forces acted, v_i' those after the step. β is `separation` where the flow
/// around the particle expands (tr ∇v ≥ 0), else `approach`: particles that are pressed together stay with the grid,
/// and matter does not pass through matter. Expansion is told from ∇v, which exists for every material.
///
/// Take it where bodies that touch must part without sticking, such as sand and splashing water.
///
/// Fei et al. 2021, "Revisiting Integration in the Material Point Method: A Scheme for Easier Separation and Less
/// Dissipation".
template <scalar S = float>
struct Asflip {
    static constexpr const char* name = "asflip";
    static constexpr bool affine = true;  ///< Particles carry C.

    S ratio = S(0.95);    ///< α: 0 to 1 [1]
    S separation = S(1);  ///< β where matter expands: 0 to 1 [1]
    S approach = S(0);    ///< β where matter is compressed: 0 to 1 [1]

    /// Checks the parameters.
    /// \throws parameter_error unless all three are from 0 to 1
    void check() const {
        check_share(ratio, name, "ratio");
        check_share(separation, name, "separation");
        check_share(approach, name, "approach");
    }
    static constexpr auto parameters() {
        return std::tuple{parameter{"ratio", "1", &Asflip::ratio}, parameter{"separation", "1", &Asflip::separation},
                          parameter{"approach", "1", &Asflip::approach}};
    }

    /// The affine field that a particle keeps: all of C [1/s].
    template <class T, int D>
    FIRN_INLINE static Mat<T, D> affine_field(const Mat<T, D>& C) {
        return C;
    }
    /// The particle's velocities after the step.
    /// \param taken   Σ N v_i', after the step [m/s]
    /// \param before  Σ N v_i, before forces acted [m/s]
    /// \param own     the particle's velocity before the step [m/s]
    /// \param velocity_gradient  ∇v around the particle [1/s]
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
