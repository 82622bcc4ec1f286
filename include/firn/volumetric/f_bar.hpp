/// \file F-bar: the volume change of a particle is the average of those around it.
#pragma once

#include <firn/volumetric/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// F-bar: the rate of volume change of a particle is replaced by the average of those around it. Use FBar for nearly
/// incompressible solids (Poisson's ratio from 0.4 on) and for plastic flow without volume change, which otherwise
/// lock.
///
///     θ_p = tr ∇v_p,        θ_i = Σ_p N_ip V0_p θ_p / Σ_p N_ip V0_p,        θ̄_p = Σ_i N_ip θ_i
///     F ← (I + dt (∇v + (θ̄ − θ)/D I)) F
///
/// N_ip is the weight of particle p at node i, V0_p the initial volume of the particle, D the dimension. The average is
/// taken in every step, over the particles of the same set (of one material): two materials may have different volume
/// changes on both sides of their interface. Neither the increments of earlier steps nor F are averaged, so nothing
/// diffuses from step to step, and a particle stores nothing more. A rate that is the same for all particles remains
/// itself.
///
/// Forces on nodes are those without FBar. The average is symmetric, with the weights V0_p, and has eigenvalues from 0
/// to
/// 1. So linear elastic matter keeps an energy, no mode is stiffer than without FBar, and the bound of the time step
/// holds.
///
/// FBar averages away what no node can represent. So particles of one cell may differ in volume change without
/// resistance; in solids the shear stiffness resists. det F is then not the volume change of a single particle, but of
/// the matter around it.
///
/// In plastic flow that changes the volume, such as soil's that dilates, particles of one cell that shear at different
/// rates ask for different volume changes, and FBar does not give them: their pressures drift apart, and matter locks
/// far worse than without FBar. Wrap such a model in PlasticVolume: FBar then averages the elastic part only.
///
/// A step costs one further gather and one further scatter, about 1.6 times as much as without FBar.
///
/// Zhao, Jiang and Choo 2023, "Circumventing volumetric locking in explicit material point methods: A simple,
/// efficient, and general approach", average by the standard transfers; de Souza Neto et al. 1996, "Design of simple
/// low order finite elements for large strain analysis of nearly incompressible solids", is the origin of F-bar.
struct FBar {
    static constexpr const char* name = "f_bar";
    static constexpr bool averages_volume = true;  ///< The rate of volume change is averaged.

    /// Returns the velocity gradient that updates a particle's material state [1/s]: `own` with the trace `average`.
    /// \param own      the particle's velocity gradient ∇v [1/s]
    /// \param average  the average θ̄ of the rates of volume change around the particle [1/s]
    template <scalar S, int D>
    FIRN_INLINE static Mat<S, D> velocity_gradient(const Mat<S, D>& own, const S& average) {
        Mat<S, D> gradient = own;
        const S change = (average - trace(own)) * S(1.0 / D);
        unroll<D>([&](auto a) FIRN_LAMBDA { gradient(a, a) = own(a, a) + change; });
        return gradient;
    }
};

static_assert(volumetric<FBar>);

}  // namespace firn::inline FIRN_BUILD
