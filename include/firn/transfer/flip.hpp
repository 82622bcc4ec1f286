/// \file FLIP, the fluid-implicit-particle method, blended with PIC.
#pragma once

#include <firn/transfer/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// FLIP blended with PIC: in each step, the change of the grid's velocity is added to the particle's velocity.
///
///     v ← α (v + Σ N (v_i' − v_i)) + (1 − α) Σ N v_i'
///
/// v is the particle's velocity, N the particle's weight at node i. v_i are the nodes' velocities before forces acted,
/// v_i' the nodes' velocities after the step. The particle moves with Σ N v_i'.
///
/// α = 0 is PIC. α = 1 does not damp motion; but the particles' velocities then contain noise that the grid cannot
/// represent and that never decays. Use FLIP for comparison with other programs; Aflip is less noisy.
///
/// Brackbill and Ruppel 1986, "FLIP: A method for adaptively zoned, particle-in-cell calculations of fluid flows in two
/// dimensions"; Zhu and Bridson 2005, "Animating sand as a fluid"; for MPM Stomakhin et al. 2013, "A material point
/// method for snow simulation", §4.1, step 8.
template <scalar S = float>
struct Flip {
    static constexpr const char* name = "flip";
    static constexpr bool affine = false;  ///< Particles carry no C.

    S ratio = S(0.95);  ///< α: share of FLIP, from 0 (PIC) to 1 (FLIP) [1]

    /// Checks the parameters.
    /// \throws parameter_error unless 0 ≤ α ≤ 1
    void check() const { check_share(ratio, name, "ratio"); }
    static constexpr auto parameters() { return std::tuple{parameter{"ratio", "1", &Flip::ratio}}; }

    /// Returns zero: a particle keeps no affine field C.
    template <class T, int D>
    FIRN_INLINE static Mat<T, D> affine_field(const Mat<T, D>&) {
        return Mat<T, D>::zero();
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

static_assert(transfer<Flip<>> && blends_velocities<Flip<>>);

}  // namespace firn::inline FIRN_BUILD
