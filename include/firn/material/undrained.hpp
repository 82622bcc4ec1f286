/// \file The material Undrained: any soil whose pores are full of water that cannot leave them.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/names.hpp>
#include <firn/material/surroundings.hpp>
#include <firn/math/exp_log.hpp>
#include <firn/math/matrix_functions.hpp>

#include <cmath>

namespace firn::inline FIRN_BUILD {

namespace detail {
struct named_undrained {
    static constexpr const char* name = "undrained";
};
}  // namespace detail

/// A soil with water in its pores that does not flow: `Undrained<MohrCoulomb<float>>{soil, 2e9}`. The model bears the
/// effective stress, the water a pressure that grows as the soil is compressed:
///
///     τ = τ′ − p_w I         dp_w = −K_w d(ln J)
///
/// τ′ is the Kirchhoff stress of the model, J the volume ratio. The pore pressure p_w is the field `pore_pressure` [Pa]
/// of the particles; it is J times the pressure of the water. It starts at 0: set it with set_states(), or let
/// set_at_rest() compute it from a water table.
///
/// Use Undrained for fast loading of clay and silt, and for sand in earthquakes. K_w bounds the time step; for real
/// water it is 2.2e9 Pa over the porosity, but some 100 times the bulk modulus of the soil keeps its volume well
/// enough. With FBar, or another policy against locking, matter that keeps its volume stays soft in shear.
///
/// Naylor 1974, "Stresses in nearly incompressible materials by finite elements with application to the calculation of
/// excess pore pressures".
/// \tparam Model  a material; in two dimensions `PlaneStrain<Undrained<Model>>` has the stress across the plane, too
template <class Model>
struct Undrained : Model {
    using scalar_type = material_scalar_t<Model>;
    using S = scalar_type;  ///< The scalar type of the model.
    S water_bulk = S(0);    ///< K_w: bulk modulus of the pore water, over the porosity [Pa]
    /// The type of this material with scalar type T.
    template <class T>
    using with_scalar = Undrained<with_scalar_t<Model, T>>;

    static constexpr const char* name = detail::joined_names<detail::named_undrained, Model>::text;
    static constexpr auto parameters() {
        return std::tuple_cat(Model::parameters(), std::tuple{parameter{"water_bulk", "Pa", &Undrained::water_bulk}});
    }

    /// The state of a particle: that of the model, and the pore pressure.
    template <int D>
    struct state : material_state_t<Model, D> {
        S pore_pressure = S(0);  ///< p_w: J times the pressure of the pore water [Pa]

        static constexpr auto fields() {
            return std::tuple_cat(material_state_t<Model, D>::fields(),
                                  std::tuple{parameter{"pore_pressure", "Pa", &state::pore_pressure}});
        }
    };

    /// Checks the parameters.
    /// \throws parameter_error  if the model's check() does, and unless water_bulk is finite and not negative
    void check() const
        requires std::floating_point<S>
    {
        if constexpr (requires { Model::check(); }) Model::check();
        if (!(water_bulk >= 0) || !std::isfinite(water_bulk))
            throw parameter_error(sentence("The bulk modulus of the pore water is ", water_bulk,
                                           " Pa; it must be finite and not negative. Water has 2.2e9 Pa."));
    }

    /// The model, which bears the effective stress.
    FIRN_INLINE const Model& model() const { return *this; }
    /// Returns the state of a new particle: the model's initial state, without pore pressure.
    template <int D>
    state<D> initial_state() const {
        return {firn::initial_state<D>(model()), S(0)};
    }
    /// The material for one particle. \see asks_surroundings
    template <int D>
        requires asks_surroundings<Model, D>
    FIRN_INLINE Undrained at(const Surroundings<S, D>& here) const {
        return detail::around_model(*this, Model(Model::at(here)));
    }

    /// The state after a time step dt [s] with velocity gradient ∇v [1/s].
    template <int D>
    FIRN_INLINE state<D> updated(const state<D>& before, const Mat<S, D>& velocity_gradient, const S& dt) const {
        return {firn::updated(model(), base(before), velocity_gradient, dt),
                pressed(before.pore_pressure, velocity_gradient, dt)};
    }
    /// The state after a time step dt [s] with velocity gradient ∇v [1/s], and the Kirchhoff stress τ [Pa] in it.
    template <int D>
        requires has_stress_with_state<Model, D>
    FIRN_INLINE StateAndStress<state<D>, S, D> updated_with_stress(const state<D>& before,
                                                                   const Mat<S, D>& velocity_gradient,
                                                                   const S& dt) const {
        const auto after = firn::updated_with_stress(model(), base(before), velocity_gradient, dt);
        const S pressure = pressed(before.pore_pressure, velocity_gradient, dt);
        return {{after.state, pressure}, after.stress - Mat<S, D>::diagonal(pressure)};
    }
    /// Kirchhoff stress τ [Pa], that of the water included.
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& soil) const {
        return firn::kirchhoff_stress(model(), base(soil)) - Mat<S, D>::diagonal(soil.pore_pressure);
    }
    /// Kirchhoff stress τ [Pa] in the given state, at the velocity gradient ∇v [1/s].
    template <int D>
        requires has_rate_dependent_stress<Model, D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& soil, const Mat<S, D>& velocity_gradient) const {
        return firn::stress_of(model(), base(soil), velocity_gradient) - Mat<S, D>::diagonal(soil.pore_pressure);
    }
    /// Elastic energy ψ [J/m³ of undeformed volume]: that of the model, and p_w²/(2 K_w) of the water.
    template <int D>
        requires has_energy_density<Model, D>
    FIRN_INLINE S energy_density(const state<D>& soil) const {
        const S stiff = select(S(0) < water_bulk, water_bulk, S(1));
        return firn::energy_density(model(), base(soil)) +
               S(0.5) * soil.pore_pressure * soil.pore_pressure * (water_bulk / (stiff * stiff));
    }
    /// Upper bound of the wave speed c [m/s]: c² = c′² + K_w/ρ, with c′ of the model. `density` is the density ρ of the
    /// undeformed material [kg/m³].
    template <int D>
    FIRN_INLINE S wave_speed(const S& density, const state<D>& soil) const {
        const S own = firn::wave_speed(model(), density, base(soil));
        return sqrt(own * own + water_bulk / density);
    }

private:
    template <int D>
    FIRN_INLINE static const material_state_t<Model, D>& base(const state<D>& soil) {
        return soil;
    }
    /// Returns the pore pressure after a step: the volume grows by the factor det(I + dt ∇v).
    template <int D>
    FIRN_INLINE S pressed(const S& before, const Mat<S, D>& velocity_gradient, const S& dt) const {
        const S growth = volume_change(DeformationGradient<S, D>::from_displacement(velocity_gradient * dt));
        return before - water_bulk * log(max(S(1) + growth, S(detail::least_volume_ratio)), max(growth, S(-1)));
    }
};

}  // namespace firn::inline FIRN_BUILD
