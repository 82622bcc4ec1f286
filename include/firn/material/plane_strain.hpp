/// \file The material PlaneStrain: any material in three dimensions, for simulations in two.
#pragma once

#include <firn/core/names.hpp>
#include <firn/material/surroundings.hpp>

namespace firn::inline FIRN_BUILD {

namespace detail {
struct named_plane_strain {
    static constexpr const char* name = "plane_strain";
};
template <class Model, int D>
struct plane_strain_state {
    static_assert(D == 2,
                  "firn: PlaneStrain is a material of simulations in two dimensions; in three, give the model itself.");
    using type = material_state_t<Model, 3>;
};
}  // namespace detail

/// A material in plane strain: `Simulation<2, PlaneStrain<Sand<float>>>`. The simulation has two dimensions, the
/// material three.
///
/// The state is that of the model in 3D, its deformation gradient F has 3 × 3 numbers. Particles do not move out of the
/// plane, so the strain across it is zero. The elastic and the plastic part of this strain need not be: the stress
/// across the plane carries load, and yields. It is the field `kirchhoff_stress_zz` [Pa] of states.
///
/// Without PlaneStrain, firn's plastic materials take the deviator in two dimensions and keep no stress across the
/// plane. They are then models of two-dimensional matter, with another strength.
///
/// Use PlaneStrain for cuts through long bodies: slopes, footings, tunnels, rolled metal. One metre of depth has the
/// mass and the volume of a particle.
///
/// The force on a node follows from the stress in the plane alone (de Souza Neto, Perić and Owen 2008, "Computational
/// Methods for Plasticity", §4.3).
/// \tparam Model  a material in 3D
template <class Model>
struct PlaneStrain : Model {
    using scalar_type = material_scalar_t<Model>;
    using S = scalar_type;  ///< The scalar type of the model.
    /// The type of this material with scalar type T.
    template <class T>
    using with_scalar = PlaneStrain<with_scalar_t<Model, T>>;
    using State = material_state_t<Model, 3>;  ///< The state of a particle: that of the model in 3D.
    /// The state of a particle in D = 2 dimensions of space.
    template <int D>
    using state = typename detail::plane_strain_state<Model, D>::type;

    static constexpr const char* name = detail::joined_names<detail::named_plane_strain, Model>::text;

    /// The model in 3D.
    FIRN_INLINE const Model& model() const { return *this; }

    /// Returns the state of a new particle: the model's initial state in 3D.
    template <int D>
    state<D> initial_state() const {
        return firn::initial_state<3>(model());
    }
    /// What states have besides the fields: the Kirchhoff stress across the plane.
    static constexpr std::array outputs{StateOutput{"kirchhoff_stress_zz", "Pa"}};
    /// Returns the Kirchhoff stress across the plane, τ_zz [Pa], without a viscous part.
    std::array<S, 1> output(const State& particle) const { return {firn::kirchhoff_stress(model(), particle)(2, 2)}; }

    // The functions below call the function of the model in 3D.

    /// The material for one particle. \param here  what is around it
    template <int D>
        requires asks_surroundings<Model, 3>
    FIRN_INLINE PlaneStrain at(const Surroundings<S, D>& here) const {
        return detail::around_model(*this, Model(Model::at(in_space(here))));
    }
    /// The state after a time step dt [s] with velocity gradient ∇v [1/s].
    FIRN_INLINE State updated(const State& before, const Mat<S, 2>& velocity_gradient, const S& dt) const
        requires has_updated<Model, 3>
    {
        return firn::updated(model(), before, detail::in_space(velocity_gradient), dt);
    }
    /// The state after a time step dt [s] with velocity gradient ∇v [1/s], and the Kirchhoff stress [Pa] in it.
    template <int D>
    FIRN_INLINE StateAndStress<State, S, 2> updated_with_stress(const State& before, const Mat<S, 2>& velocity_gradient,
                                                                const S& dt) const
        requires has_updated_with_stress<Model, 3>
    {
        const auto after = firn::updated_with_stress(model(), before, detail::in_space(velocity_gradient), dt);
        return {after.state, detail::in_plane(after.stress)};
    }
    /// The state after the model's return mapping.
    FIRN_INLINE State returned(const State& trial) const
        requires has_returned<Model, 3>
    {
        return returned_by(model(), trial);
    }
    /// The state after the model's return mapping, and the Kirchhoff stress [Pa] in this state.
    template <int D>
        requires(D == 2 && has_returned_with_stress<Model, 3>)
    FIRN_INLINE StateAndStress<State, S, D> returned_with_stress(const State& trial) const {
        const auto after = model().template returned_with_stress<3>(trial);
        return {after.state, detail::in_plane(after.stress)};
    }
    /// Kirchhoff stress τ in the plane [Pa].
    FIRN_INLINE Mat<S, 2> kirchhoff_stress(const State& particle) const {
        return detail::in_plane(firn::kirchhoff_stress(model(), particle));
    }
    /// Kirchhoff stress τ in the plane [Pa] in the given state, at the velocity gradient ∇v [1/s].
    FIRN_INLINE Mat<S, 2> kirchhoff_stress(const State& particle, const Mat<S, 2>& velocity_gradient) const
        requires has_rate_dependent_stress<Model, 3>
    {
        return detail::in_plane(firn::stress_of(model(), particle, detail::in_space(velocity_gradient)));
    }
    /// Upper bound of the wave speed [m/s]; `density` is the density of the undeformed material [kg/m³].
    FIRN_INLINE S wave_speed(const S& density, const State& particle) const {
        return firn::wave_speed(model(), density, particle);
    }
    /// Elastic energy ψ [J/m³ of undeformed volume].
    FIRN_INLINE S energy_density(const State& particle) const
        requires has_energy_density<Model, 3>
    {
        return firn::energy_density(model(), particle);
    }
    /// Diffusivity of momentum by viscosity [m²/s]; `density` is the density of the undeformed material [kg/m³].
    FIRN_INLINE S diffusivity(const S& density, const State& particle) const
        requires has_diffusivity<Model, 3>
    {
        return model().diffusivity(density, particle);
    }
    /// An upper bound of the stretch of a particle since it was made [1].
    FIRN_INLINE S stretch_bound(const State& particle) const
        requires has_stretch_bound<Model, 3>
    {
        return model().stretch_bound(particle);
    }
};

}  // namespace firn::inline FIRN_BUILD
