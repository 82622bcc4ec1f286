/// \file The material With: any material, whose particles carry further numbers.
#pragma once

#include <firn/material/per_particle.hpp>

#include <tuple>

namespace firn::inline FIRN_BUILD {

/// A number that particles carry: `Carried<"temperature", "K">`.
/// \tparam Name  its name, in states and for of<Name>()
/// \tparam Unit  its unit
template <ParameterName Name, ParameterName Unit = "1">
struct Carried {
    static constexpr auto name = Name;  ///< The name of the number.
    static constexpr auto unit = Unit;  ///< The unit of the number.
};

namespace detail {
/// The number of a Carried as a parameter of a model.
template <class S, class Carries>
struct CarriedValue {
    S value = S(0);
};

/// A model with one more parameter for each number that particles are to carry; the model does not use them.
template <class Model, class... Carries>
struct Extended : Model, CarriedValue<material_scalar_t<Model>, Carries>... {
    using scalar_type = material_scalar_t<Model>;
    template <class T>
    using with_scalar = Extended<with_scalar_t<Model, T>, Carries...>;

    static constexpr auto parameters() {
        return std::tuple_cat(Model::parameters(),
                              std::tuple{parameter{Carries::name.text, Carries::unit.text,
                                                   &CarriedValue<scalar_type, Carries>::value}...});
    }
    template <int D>
        requires asks_surroundings<Model, D>
    FIRN_INLINE Extended at(const Surroundings<scalar_type, D>& here) const {
        return around_model(*this, Model(Model::at(here)));
    }
};
}  // namespace detail

/// A material whose particles carry further numbers: `With<FixedCorotated<float>, Carried<"temperature", "K">>`.
///
/// Each number is a field of the particles: it moves, is sorted and removed with them, and is written to states, from
/// which a run goes on. It is 0 at first, or what the model is given. Read and set it with `of<"temperature">(state)`:
/// in set_states(), or of the state that particles().state(slot) returns. The material does not depend on it; for one
/// that does, give the model a parameter of this name, and use PerParticle.
///
///     const With<Hencky<float>, Carried<"temperature", "K">> steel{{Hencky<float>::from_young_poisson(2e11, 0.3),
///     {293}}};
/// \tparam Model    a material
/// \tparam Carries  the numbers, each a Carried
template <class Model, class... Carries>
using With = PerParticle<detail::Extended<Model, Carries...>, Carries::name...>;

}  // namespace firn::inline FIRN_BUILD
