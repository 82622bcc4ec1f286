/// \file The material PerParticle: any material, with some of its parameters stored per particle.
#pragma once

#include <firn/core/names.hpp>
#include <firn/material/surroundings.hpp>

#include <algorithm>
#include <cstddef>
#include <string_view>

namespace firn::inline FIRN_BUILD {

/// The name of a parameter, as a template argument. A string literal converts to this type.
template <std::size_t N>
struct ParameterName {
    char text[N];  ///< The characters of the name, including the final zero.
    /// Makes the name from a string literal.
    consteval ParameterName(const char (&name)[N]) { std::copy_n(name, N, text); }
    constexpr bool operator==(const ParameterName&) const = default;
    /// The name without the final zero.
    constexpr std::string_view view() const { return {text, N - 1}; }
};

namespace detail {
struct named_per_particle {
    static constexpr const char* name = "per_particle";
};
/// The part of a particle's state that stores the value of the parameter `Name`.
template <class S, ParameterName Name>
struct OfParticle {
    S value = S(1);
};
}  // namespace detail

/// A model in which the parameters listed in Names vary from particle to particle:
/// `PerParticle<Snow<float>, "mu", "lambda">`.
///
/// Each named parameter becomes a field of the particle's state, with the parameter's unit. The field costs memory and
/// is written to files with the state. The field starts with the value that the model has for the parameter. To change
/// the field, call set_states() with a function that sets `of<"mu">(state) = 1e5`. A parameter that is not named has
/// the same value for all particles.
///
/// Use PerParticle for matter whose stiffness, strength or friction is not the same everywhere.
/// \tparam Model  a material
/// \tparam Names  names of parameters of Model, as listed in Model::parameters()
template <class Model, ParameterName... Names>
struct PerParticle : Model {
    using scalar_type = material_scalar_t<Model>;
    using S = scalar_type;  ///< The scalar type of the model.
    /// The type of this material with scalar type T.
    template <class T>
    using with_scalar = PerParticle<with_scalar_t<Model, T>, Names...>;

    static constexpr const char* name = detail::joined_names<detail::named_per_particle, Model>::text;

private:
    static constexpr auto of_model = Model::parameters();

    /// Returns the index of the parameter `Name` in the tuple Model::parameters(), or the size of the tuple if no
    /// parameter has this name.
    template <ParameterName Name>
    static consteval std::size_t place() {
        return std::apply(
            [](const auto&... p) {
                std::size_t i = 0;
                static_cast<void>(((Name.view() == p.name || (++i, false)) || ...));
                return i;
            },
            of_model);
    }
    static_assert(((place<Names>() < std::tuple_size_v<decltype(of_model)>) && ...),
                  "firn: a name given to PerParticle is not the name of a parameter in the model's parameters()");

    template <ParameterName Name>
    FIRN_INLINE static S& named_parameter(Model& model) {
        return std::get<place<Name>()>(of_model).of(model);
    }

public:
    /// The state of a particle: the model's state, with one more field for each parameter listed in Names.
    template <int D>
    struct state : material_state_t<Model, D>, detail::OfParticle<S, Names>... {
        static constexpr auto fields() {
            return std::tuple_cat(material_state_t<Model, D>::fields(),
                                  std::tuple{parameter{Names.text, std::get<place<Names>()>(of_model).unit,
                                                       &detail::OfParticle<S, Names>::value}...});
        }
    };

    /// Returns the state of a new particle: the model's initial state, and the model's values of the parameters listed
    /// in Names.
    template <int D>
    state<D> initial_state() const {
        Model model = *this;
        return {firn::initial_state<D>(model), {named_parameter<Names>(model)}...};
    }

    /// Returns the model with the parameter values of one particle.
    template <int D>
    FIRN_INLINE Model of(const state<D>& particle) const {
        Model model = *this;
        ((named_parameter<Names>(model) = particle.detail::template OfParticle<S, Names>::value), ...);
        return model;
    }

    // The functions below call the function of the model with the parameter values of the particle.

    /// What states have besides the fields. \see has_outputs
    template <int D>
        requires has_outputs<Model, D>
    auto output(const state<D>& particle) const {
        return of(particle).output(base(particle));
    }
    /// The material for particles in these surroundings. \see asks_surroundings
    template <int D>
        requires asks_surroundings<Model, D>
    FIRN_INLINE PerParticle at(const Surroundings<S, D>& here) const {
        return detail::around_model(*this, Model(Model::at(here)));
    }
    /// The state after a time step dt [s] with velocity gradient ∇v [1/s].
    template <int D>
        requires has_updated<Model, D>
    FIRN_INLINE state<D> updated(const state<D>& before, const Mat<S, D>& velocity_gradient, const S& dt) const {
        state<D> after = before;
        static_cast<Base<D>&>(after) = firn::updated(of(before), base(before), velocity_gradient, dt);
        return after;
    }
    /// The state after a time step dt [s] with velocity gradient ∇v [1/s], and the Kirchhoff stress [Pa] in it.
    template <int D>
        requires has_updated_with_stress<Model, D>
    FIRN_INLINE StateAndStress<state<D>, S, D> updated_with_stress(const state<D>& before,
                                                                   const Mat<S, D>& velocity_gradient,
                                                                   const S& dt) const {
        const auto own = of(before).template updated_with_stress<D>(base(before), velocity_gradient, dt);
        StateAndStress<state<D>, S, D> after{before, own.stress};
        static_cast<Base<D>&>(after.state) = own.state;
        return after;
    }
    /// The state after the model's return mapping.
    template <int D>
        requires has_returned<Model, D>
    FIRN_INLINE state<D> returned(const state<D>& trial) const {
        state<D> after = trial;
        static_cast<Base<D>&>(after) = of(trial).returned(base(trial));
        return after;
    }
    /// The state after the model's return mapping, and the Kirchhoff stress [Pa] in this state.
    template <int D>
        requires has_returned_with_stress<Model, D>
    FIRN_INLINE StateAndStress<state<D>, S, D> returned_with_stress(const state<D>& trial) const {
        const auto mapped = of(trial).template returned_with_stress<D>(base(trial));
        StateAndStress<state<D>, S, D> after{trial, mapped.stress};
        static_cast<Base<D>&>(after.state) = mapped.state;
        return after;
    }
    /// Kirchhoff stress τ [Pa].
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& particle) const {
        return firn::kirchhoff_stress(of(particle), base(particle));
    }
    /// Kirchhoff stress τ [Pa] in the given state, at the velocity gradient ∇v [1/s].
    template <int D>
        requires has_rate_dependent_stress<Model, D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& particle, const Mat<S, D>& velocity_gradient) const {
        return firn::stress_of(of(particle), base(particle), velocity_gradient);
    }
    /// Upper bound of the wave speed [m/s]; `density` is the density of the undeformed material [kg/m³].
    template <int D>
    FIRN_INLINE S wave_speed(const S& density, const state<D>& particle) const {
        return firn::wave_speed(of(particle), density, base(particle));
    }
    /// Elastic energy ψ [J/m³ of undeformed volume].
    template <int D>
        requires has_energy_density<Model, D>
    FIRN_INLINE S energy_density(const state<D>& particle) const {
        return firn::energy_density(of(particle), base(particle));
    }
    /// Diffusivity of momentum by viscosity [m²/s]; `density` is the density of the undeformed material [kg/m³].
    template <int D>
        requires has_diffusivity<Model, D>
    FIRN_INLINE S diffusivity(const S& density, const state<D>& particle) const {
        return of(particle).diffusivity(density, base(particle));
    }

private:
    template <int D>
    using Base = material_state_t<Model, D>;
    template <int D>
    FIRN_INLINE static const Base<D>& base(const state<D>& particle) {
        return particle;
    }
};

/// Returns a reference to the value of the parameter `Name` in the state of a particle of a PerParticle material:
/// `of<"mu">(state) = 1e5`.
template <ParameterName Name, class S>
S& of(detail::OfParticle<S, Name>& state) {
    return state.value;
}
/// Returns a reference to the value of the parameter `Name` in the state of a particle of a PerParticle material.
template <ParameterName Name, class S>
const S& of(const detail::OfParticle<S, Name>& state) {
    return state.value;
}

}  // namespace firn::inline FIRN_BUILD
