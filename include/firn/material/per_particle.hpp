/// \file Any model, with some of its parameters given for each particle: fields in place of constants.
#pragma once

#include <firn/core/names.hpp>
#include <firn/material/concept.hpp>

#include <algorithm>
#include <cstddef>
#include <string_view>

namespace firn {

/// The name of a parameter as a template argument.
template <std::size_t N>
struct ParameterName {
    char text[N];
    consteval ParameterName(const char (&name)[N]) { std::copy_n(name, N, text); }
    constexpr bool operator==(const ParameterName&) const = default;
    constexpr std::string_view view() const { return {text, N - 1}; }
};

namespace detail {
struct named_per_particle {
    static constexpr const char* name = "per_particle";
};
/// A parameter of one particle.
template <class S, ParameterName Name>
struct OfParticle {
    S value = S(1);
};
}  // namespace detail

/// Snow whose stiffness varies: PerParticle<Snow<float>, "mu", "lambda">. The named parameters are fields of the state,
/// as long as those of the model itself unless they are set (Simulation::set_states, by `of<"mu">(state)`), are written
/// with it, and cost their memory. Those that are not named stay constants.
template <class Model, ParameterName... Names>
struct PerParticle : Model {
    using scalar_type = material_scalar_t<Model>;
    using S = scalar_type;
    template <class T>
    using with_scalar = PerParticle<with_scalar_t<Model, T>, Names...>;

    static constexpr const char* name = detail::joined_names<detail::named_per_particle, Model>::text;

private:
    static constexpr auto of_model = Model::parameters();

    /// Where a parameter stands in the model's list; after its end, where it has none of that name.
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
                  "firn: PerParticle names parameters of the model, as in its parameters()");

    template <ParameterName Name>
    FIRN_INLINE static S& named_parameter(Model& model) {
        return std::get<place<Name>()>(of_model).of(model);
    }

public:
    template <int D>
    struct state : material_state_t<Model, D>, detail::OfParticle<S, Names>... {
        static constexpr auto fields() {
            return std::tuple_cat(material_state_t<Model, D>::fields(),
                                  std::tuple{parameter{Names.text, std::get<place<Names>()>(of_model).unit,
                                                       &detail::OfParticle<S, Names>::value}...});
        }
    };

    template <int D>
    state<D> initial_state() const {
        Model model = *this;
        return {firn::initial_state<D>(model), {named_parameter<Names>(model)}...};
    }

    /// The model that a particle obeys.
    template <int D>
    FIRN_INLINE Model of(const state<D>& particle) const {
        Model model = *this;
        ((named_parameter<Names>(model) = particle.detail::template OfParticle<S, Names>::value), ...);
        return model;
    }

    template <int D>
        requires has_updated<Model, D>
    FIRN_INLINE state<D> updated(const state<D>& before, const Mat<S, D>& velocity_gradient, const S& dt) const {
        state<D> after = before;
        static_cast<Base<D>&>(after) = firn::updated(of(before), base(before), velocity_gradient, dt);
        return after;
    }
    template <int D>
        requires has_returned<Model, D>
    FIRN_INLINE state<D> returned(const state<D>& trial) const {
        state<D> after = trial;
        static_cast<Base<D>&>(after) = of(trial).returned(base(trial));
        return after;
    }
    template <int D>
        requires has_returned_with_stress<Model, D>
    FIRN_INLINE StateAndStress<state<D>, S, D> returned_with_stress(const state<D>& trial) const {
        const auto mapped = of(trial).returned_with_stress(base(trial));
        StateAndStress<state<D>, S, D> after{trial, mapped.stress};
        static_cast<Base<D>&>(after.state) = mapped.state;
        return after;
    }
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& particle) const {
        return firn::kirchhoff_stress(of(particle), base(particle));
    }
    template <int D>
        requires has_rate_dependent_stress<Model, D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& particle, const Mat<S, D>& velocity_gradient) const {
        return firn::stress_of(of(particle), base(particle), velocity_gradient);
    }
    template <int D>
    FIRN_INLINE S wave_speed(const S& density, const state<D>& particle) const {
        return firn::wave_speed(of(particle), density, base(particle));
    }
    template <int D>
        requires has_energy_density<Model, D>
    FIRN_INLINE S energy_density(const state<D>& particle) const {
        return firn::energy_density(of(particle), base(particle));
    }
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

/// A particle's parameter of that name: of<"mu">(state) = 1e5.
template <ParameterName Name, class S>
S& of(detail::OfParticle<S, Name>& state) {
    return state.value;
}
template <ParameterName Name, class S>
const S& of(const detail::OfParticle<S, Name>& state) {
    return state.value;
}

}  // namespace firn
