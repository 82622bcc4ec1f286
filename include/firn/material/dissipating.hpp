/// \file The material Dissipating: any plastic model, with a record of the energy that plastic flow dissipates.
#pragma once

#include <firn/core/names.hpp>
#include <firn/material/surroundings.hpp>

namespace firn::inline FIRN_BUILD {

namespace detail {
struct named_dissipating {
    static constexpr const char* name = "dissipating";
};
}  // namespace detail

/// A plastic model with one more field per particle: the elastic energy that the model's return mapping has removed so
/// far.
///
/// This field, `dissipated_energy` [J/m³ of undeformed volume], grows in each step by
///
///     ψ(trial) − ψ(returned)
///
/// ψ is the model's energy_density(), `trial` the state before the return mapping, `returned` the state after the
/// return mapping. Of a model with a function updated(), `trial` is the state after a step without flow, and `returned`
/// what updated() returns. If hardening increases ψ during plastic flow, this increase is subtracted. Apart from this
/// field, the material behaves like the model. Use Dissipating to see where plastic flow happens, or to check the
/// energy balance. Example: Dissipating<Sand<float>>.
/// \tparam Model  a material with energy_density(), and with a return mapping or updated()
template <class Model>
struct Dissipating : Model {
    using scalar_type = material_scalar_t<Model>;
    using S = scalar_type;  ///< The scalar type of the model.
    /// The type of this material with scalar type T.
    template <class T>
    using with_scalar = Dissipating<with_scalar_t<Model, T>>;

    static constexpr const char* name = detail::joined_names<detail::named_dissipating, Model>::text;

    /// The model's state, with the dissipated energy as one more field.
    template <int D>
    struct state : material_state_t<Model, D> {
        static_assert(
            !has_updated<Model, D> || requires(material_state_t<Model, D> of) { of.F; },
            "firn: Dissipating takes models with a deformation gradient F, which tells what flow has changed.");

        S dissipated = S(0);  ///< energy dissipated by plastic flow so far [J/m³ of undeformed volume]

        static constexpr auto fields() {
            return std::tuple_cat(material_state_t<Model, D>::fields(),
                                  std::tuple{parameter{"dissipated_energy", "J/m^3", &state::dissipated}});
        }
    };

    /// Returns the state of a new particle: the model's initial state, with a dissipated energy of zero.
    template <int D>
    state<D> initial_state() const {
        return {firn::initial_state<D>(model()), S(0)};
    }
    /// The material for one particle. \see asks_surroundings
    template <int D>
        requires asks_surroundings<Model, D>
    FIRN_INLINE Dissipating at(const Surroundings<S, D>& here) const {
        return detail::around_model(*this, Model(Model::at(here)));
    }
    /// Returns the state after a time step dt [s] with velocity gradient ∇v [1/s]. The elastic energy that plastic flow
    /// removes is added to `dissipated`.
    template <int D>
        requires has_updated<Model, D>
    FIRN_INLINE state<D> updated(const state<D>& before, const Mat<S, D>& velocity_gradient, const S& dt) const {
        return loss(followed(before, velocity_gradient, dt),
                    firn::updated(model(), base(before), velocity_gradient, dt));
    }
    /// Returns the state updated(before, velocity_gradient, dt) and the Kirchhoff stress [Pa] in this state.
    template <int D>
        requires has_updated_with_stress<Model, D>
    FIRN_INLINE StateAndStress<state<D>, S, D> updated_with_stress(const state<D>& before,
                                                                   const Mat<S, D>& velocity_gradient,
                                                                   const S& dt) const {
        const auto own = Model::template updated_with_stress<D>(base(before), velocity_gradient, dt);
        return {loss(followed(before, velocity_gradient, dt), own.state), own.stress};
    }
    /// Returns the state after the model's return mapping. The elastic energy that the mapping removes is added to
    /// `dissipated`.
    template <int D>
        requires(!has_updated<Model, D>)
    FIRN_INLINE state<D> returned(const state<D>& trial) const {
        return loss(trial, returned_by(model(), base(trial)));
    }
    /// Returns the state returned(trial) and the Kirchhoff stress [Pa] in this state. This function exists only if the
    /// model has returned_with_stress().
    template <int D>
        requires has_returned_with_stress<Model, D>
    FIRN_INLINE StateAndStress<state<D>, S, D> returned_with_stress(const state<D>& trial) const {
        const auto mapped = Model::template returned_with_stress<D>(base(trial));
        return {loss(trial, mapped.state), mapped.stress};
    }

private:
    FIRN_INLINE const Model& model() const { return *this; }
    template <int D>
    using Base = material_state_t<Model, D>;
    template <int D>
    FIRN_INLINE static const Base<D>& base(const state<D>& particle) {
        return particle;
    }
    /// Returns the state `after` (the model's state after the return mapping), to which the field `dissipated` is
    /// added. Its value is trial.dissipated + ψ(trial) − ψ(after), where ψ is the model's energy_density().
    template <int D>
    FIRN_INLINE state<D> loss(const state<D>& trial, const Base<D>& after) const {
        const S lost = firn::energy_density(model(), base(trial)) - firn::energy_density(model(), after);
        return {after, trial.dissipated + select(detail::differ(after, base(trial)), lost, S(0))};
    }
};

}  // namespace firn::inline FIRN_BUILD
