/// \file F-bar for steps of any size.
#pragma once

#include <firn/math/deformation.hpp>
#include <firn/math/exp_log.hpp>
#include <firn/volumetric/f_bar.hpp>

namespace firn::inline FIRN_BUILD {

/// What FBar becomes in implicit and quasi-static steps: the volume ratio of a particle's step is replaced by the
/// average J̄ of those around it.
///
///     J_p = det(I + ∇u_p),      J̄_p − 1 = Σ_i N_ip e_i,      e_i = Σ_p N_ip V0_p (J_p − 1) / Σ_p N_ip V0_p
///     F ← (J̄/J)^(1/D) (I + ∇u) F
///
/// In short steps this is FBar. In long ones the trace of ∇u, which FBar averages, is no change of volume: with it,
/// every particle would resist its own change of volume of second order, by its bulk modulus.
///
/// de Souza Neto et al. 1996, "Design of simple low order finite elements for large strain analysis of nearly
/// incompressible solids", eq. 4.
struct FBarOfStep {
    static constexpr const char* name = FBar::name;
    static constexpr bool averages_volume = true;  ///< Volume changes are averaged.

    /// Returns the rate that is averaged: (det(I + dt ∇v) − 1)/dt [1/s].
    /// \param own  the particle's ∇v [1/s];  \param dt  time of the step [s]
    template <scalar S, int D>
    FIRN_INLINE static S rate(const Mat<S, D>& own, const S& dt) {
        return volume_change(DeformationGradient<S, D>::from_displacement(own * dt)) * (S(1) / dt);
    }
    /// Returns the velocity gradient that updates a particle's material state [1/s]: the one whose step has the volume
    /// ratio 1 + dt `average`, and the shape of the particle's own.
    /// \param own      the particle's ∇v [1/s], with det(I + dt ∇v) > 0
    /// \param average  the average rate around the particle [1/s], above −1/dt
    /// \param dt       time of the step [s]
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> velocity_gradient(const Mat<S, D>& own, const S& average, const S& dt) {
        const S change = rate(own, dt), ratio = (average - change) / (S(1) + dt * change);  // (J̄/J − 1)/dt
        // s = ((J̄/J)^(1/D) − 1)/dt, without a difference of nearly equal numbers.
        S stretch;
        if constexpr (D == 2) {
            stretch = ratio / (S(1) + sqrt(S(1) + dt * ratio));
        } else {
            const S root = exp(log(S(1) + dt * ratio, dt * ratio) * S(1.0 / 3));
            stretch = ratio / (S(1) + root * (S(1) + root));
        }
        Mat<S, D> gradient = own * (S(1) + dt * stretch);
        unroll<D>([&](auto a) FIRN_LAMBDA { gradient(a, a) = gradient(a, a) + stretch; });
        return gradient;
    }
};

static_assert(volumetric<FBarOfStep>);

}  // namespace firn::inline FIRN_BUILD
