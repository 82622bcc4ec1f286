/// \file The function check_material(), which checks a constitutive model once, before the first step.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/lanes.hpp>
#include <firn/core/names.hpp>
#include <firn/core/pack.hpp>
#include <firn/material/concept.hpp>

#include <cmath>
#include <string>

namespace firn::inline FIRN_BUILD {

/// Checks that a simulation can use a constitutive model: no parameter is NaN, model.check() (if it exists) accepts the
/// parameters, and the speed of waves in a new particle is finite.
/// \tparam D  the number of dimensions
/// \throws parameter_error  if a parameter is NaN (the message names the parameter), or if the wave speed in a
/// particle's initial state at density 1 kg/m³ is negative, infinite or NaN. If model.check() throws an exception,
/// check_material() passes this exception on.
template <int D, class M>
void check_material(const M& model) {
    using S = material_scalar_t<M>;
    for_parameters(model, [](const std::string& name, const char* unit, const auto& value) {
        const auto one = [&](double number) {
            if (std::isnan(number))
                throw parameter_error(sentence("The parameter ", name, " [", unit, "] of the material ", name_of<M>(),
                                               " is not a number. Give one."));
        };
        if constexpr (requires { value.v[0]; })
            for (const auto& number : value.v) one(double(number));
        else
            one(double(value));
    });
    if constexpr (requires { model.check(); }) model.check();
    using P = native_pack<S>;  // the scalar type with which a simulation computes every model
    const auto lifted = lift<P>(model);
    const S speed = lane_value(wave_speed(lifted, P(1), initial_state<D>(lifted)), 0);
    if (!(speed >= S(0)) || !std::isfinite(speed))
        throw parameter_error(sentence("In the material ", name_of<M>(), ", with a density of 1, waves have the speed ",
                                       speed,
                                       " m/s before any strain; it must be finite. Moduli must be positive, and small "
                                       "enough for the precision."));
}

}  // namespace firn::inline FIRN_BUILD
