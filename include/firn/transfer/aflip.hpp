/// \file AFLIP and ASFLIP: APIC blended with FLIP.
#pragma once

#include <firn/transfer/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// AFLIP: FLIP whose particles also carry APIC's affine field C.
///
///     v ← Σ N v_i' + α (v − Σ N v_i)
///
/// v is the particle's velocity, N the particle's weight at node i. v_i are the nodes' velocities before forces acted,
/// v_i' the nodes' velocities after the step. The particle moves with Σ N v_i'.
///
/// Use AFLIP for lively motion: it is less noisy than FLIP and damps less than APIC. AFLIP conserves momentum except
/// for rounding; it conserves angular momentum only if the particles' velocities and C describe one common velocity
/// field.
///
/// Fei et al. 2021, "Revisiting Integration in the Material Point Method: A Scheme for Easier Separation and Less
/// Dissipation".
template <scalar S = float>
struct Aflip {
    static constexpr const char* name = "aflip";
    static constexpr bool affine = true;  ///< Particles carry C.

    S ratio = S(0.95);  ///< α: share of the difference v − Σ N v_i that is kept, 0 (APIC) to 1 [1]

    /// Checks the parameters.
    /// \throws parameter_error unless 0 ≤ α ≤ 1
    void check() const { check_share(ratio, name, "ratio"); }
    static constexpr auto parameters() { return std::tuple{parameter{"ratio", "1", &Aflip::ratio}}; }

    /// Returns the affine field that a particle keeps after a step: C, unchanged [1/s].
    template <class T, int D>
    FIRN_INLINE static Mat<T, D> affine_field(const Mat<T, D>& C) {
        return C;
    }
    /// Returns the particle's velocity after the step, and the velocity with which the particle moves in this step.
    /// \param taken   Σ N v_i': the grid's velocity at the particle after the step [m/s]
    /// \param before  Σ N v_i: the grid's velocity at the particle before forces acted [m/s]
    /// \param own     the particle's velocity before the step [m/s]
    template <class T, int D>
    FIRN_INLINE ParticleVelocity<T, D> blended(const Vec<T, D>& taken, const Vec<T, D>& before, const Vec<T, D>& own,
                                               const Mat<T, D>&) const {
        return {taken + (own - before) * ratio, taken};
    }
};

/// ASFLIP: like AFLIP, but a particle also moves with a share β of the velocity that AFLIP adds to the grid's velocity.
/// With this motion, bodies separate more easily.
///
///     v ← Σ N v_i' + α (v − Σ N v_i)
///     dx/dt = Σ N v_i' + β α (v − Σ N v_i)
///
/// v and x are the particle's velocity and position, N is the particle's weight at node i. v_i are the nodes'
/// velocities before forces acted, v_i' the nodes' velocities after the step. β is `separation` where the flow around
/// the particle expands (tr ∇v ≥ 0), else `approach`. By default `approach` is 0: particles that are pressed together
/// move with the grid, so matter does not pass through matter. The sign of tr ∇v chooses β, because ∇v exists for every
/// material.
///
/// Use ASFLIP where bodies in contact must separate without sticking, for example sand and splashing water.
///
/// Fei et al. 2021, "Revisiting Integration in the Material Point Method: A Scheme for Easier Separation and Less
/// Dissipation".
template <scalar S = float>
struct Asflip {
    static constexpr const char* name = "asflip";
    static constexpr bool affine = true;  ///< Particles carry C.

    S ratio = S(0.95);    ///< α: share of the difference v − Σ N v_i that is kept, 0 to 1 [1]
    S separation = S(1);  ///< β where the flow expands matter, 0 to 1 [1]
    S approach = S(0);    ///< β where the flow compresses matter, 0 to 1 [1]

    /// Checks the parameters.
    /// \throws parameter_error unless `ratio`, `separation` and `approach` are from 0 to 1
    void check() const {
        check_share(ratio, name, "ratio");
        check_share(separation, name, "separation");
        check_share(approach, name, "approach");
    }
    static constexpr auto parameters() {
        return std::tuple{parameter{"ratio", "1", &Asflip::ratio}, parameter{"separation", "1", &Asflip::separation},
                          parameter{"approach", "1", &Asflip::approach}};
    }

    /// Returns the affine field that a particle keeps after a step: C, unchanged [1/s].
    template <class T, int D>
    FIRN_INLINE static Mat<T, D> affine_field(const Mat<T, D>& C) {
        return C;
    }
    /// Returns the particle's velocity after the step, and the velocity with which the particle moves in this step.
    /// \param taken   Σ N v_i': the grid's velocity at the particle after the step [m/s]
    /// \param before  Σ N v_i: the grid's velocity at the particle before forces acted [m/s]
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

}  // namespace firn::inline FIRN_BUILD
