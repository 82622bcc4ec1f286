/// \file The material PlasticVolume: a model whose plastic flow changes its volume, for FBar.
#pragma once

#include <firn/core/names.hpp>
#include <firn/material/surroundings.hpp>
#include <firn/math/deformation.hpp>

namespace firn::inline FIRN_BUILD {

namespace detail {
struct named_plastic_volume {
    static constexpr const char* name = "plastic_volume";
};
}  // namespace detail

/// A model whose plastic flow changes its volume, such as soil that dilates as it shears, made fit for FBar:
/// `Simulation<3, PlasticVolume<MohrCoulomb<float>>, FBar>`, in plane strain
/// `Simulation<2, PlaneStrain<PlasticVolume<MohrCoulomb<float>>>, FBar>`.
///
/// FBar gives the particles of a cell one rate of volume change, and each shears at a rate of its own. Where plastic
/// flow ties the two, the pressure of those that shear more than the others grows without end, and that of the others
/// falls: matter locks far worse than without FBar. A footing on soil with ψ = φ = 20° bears 25 times its
/// limit load.
///
/// With PlasticVolume, a particle remembers at which rate its plastic flow changed its volume in the last step, θ_pl.
/// FBar then averages the elastic rest only:
///
///     θ̄_p = Σ_i N_ip θ_i + θ_pl,p,       θ_i = Σ_p N_ip V0_p (θ_p − θ_pl,p) / Σ_p N_ip V0_p
///
/// So the elastic volume change of a particle is, over a run, the sum of averages, less the plastic change of its last
/// step. In steady flow nothing is left that could add up. θ_pl lags by a step, which is stable: a change of θ_pl by 1
/// changes the next one by at most K sin φ sin ψ/(G + K sin φ sin ψ) in soil of moduli K and G.
///
/// Where plastic flow keeps volumes, θ_pl is zero up to rounding, and the model alone serves. The model must not bear
/// water (Undrained): water resists the whole change of volume. Without FBar, PlasticVolume changes nothing.
/// Explicit steps on the CPU only; an Adjoint, implicit steps and WGSL refuse it together with FBar.
///
/// The idea is ours. It is for explicit steps what averaging the pressure is in mixed finite elements.
/// \tparam Model  a material with a plastic return mapping and an elastic deformation gradient F
/// \see FBar, MohrCoulomb
template <class Model>
struct PlasticVolume : Model {
    using scalar_type = material_scalar_t<Model>;
    using S = scalar_type;  ///< The scalar type of the model.
    /// The type of this material with scalar type T.
    template <class T>
    using with_scalar = PlasticVolume<with_scalar_t<Model, T>>;

    static constexpr const char* name = detail::joined_names<detail::named_plastic_volume, Model>::text;

    /// The state of a particle: that of the model, and the rate of its plastic volume change.
    template <int D>
    struct state : material_state_t<Model, D> {
        S plastic_volume_rate = S(0);  ///< θ_pl: rate at which plastic flow changed the volume in the last step [1/s]

        static constexpr auto fields() {
            return std::tuple_cat(material_state_t<Model, D>::fields(),
                                  std::tuple{parameter{"plastic_volume_rate", "1/s", &state::plastic_volume_rate}});
        }
    };

    /// The model.
    FIRN_INLINE const Model& model() const { return *this; }
    /// Returns the state of a new particle: the model's initial state, without plastic flow.
    template <int D>
    state<D> initial_state() const {
        return {firn::initial_state<D>(model()), S(0)};
    }
    /// The material for one particle. \see asks_surroundings
    template <int D>
        requires asks_surroundings<Model, D>
    FIRN_INLINE PlasticVolume at(const Surroundings<S, D>& here) const {
        return detail::around_model(*this, Model(Model::at(here)));
    }

    /// The state after a time step dt [s] with velocity gradient ∇v [1/s].
    template <int D>
    FIRN_INLINE state<D> updated(const state<D>& before, const Mat<S, D>& velocity_gradient, const S& dt) const {
        const auto after = firn::updated(model(), base(before), velocity_gradient, dt);
        return {after, plastic_rate(base(before), after, velocity_gradient, dt)};
    }
    /// The state after a time step dt [s] with velocity gradient ∇v [1/s], and the Kirchhoff stress τ [Pa] in it.
    template <int D>
        requires has_stress_with_state<Model, D>
    FIRN_INLINE StateAndStress<state<D>, S, D> updated_with_stress(const state<D>& before,
                                                                   const Mat<S, D>& velocity_gradient,
                                                                   const S& dt) const {
        const auto after = firn::updated_with_stress(model(), base(before), velocity_gradient, dt);
        return {{after.state, plastic_rate(base(before), after.state, velocity_gradient, dt)}, after.stress};
    }

private:
    template <int D>
    FIRN_INLINE static const material_state_t<Model, D>& base(const state<D>& particle) {
        return particle;
    }
    /// Returns θ_pl of a step: the part of the volume change that left the elastic F, at most a half of the volume.
    template <int D>
    FIRN_INLINE static S plastic_rate(const material_state_t<Model, D>& before, const material_state_t<Model, D>& after,
                                      const Mat<S, D>& velocity_gradient, const S& dt) {
        const S growth = volume_change(DeformationGradient<S, D>::from_displacement(velocity_gradient * dt)),
                elastic = volume_change(before.F), trial = elastic + growth + elastic * growth;
        const auto regular = (S(0) < dt) & (S(-1) < trial);
        const S kept = (trial - volume_change(after.F)) / select(regular, S(1) + trial, S(1));
        return select(regular, max(S(-0.5), min(kept, S(0.5))) / select(regular, dt, S(1)), S(0));
    }
};

}  // namespace firn::inline FIRN_BUILD
