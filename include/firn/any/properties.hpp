/// \file Measurable properties of materials by name: what from_properties() and from_young_poisson() take.
#pragma once

#include <firn/core/angle.hpp>
#include <firn/core/error.hpp>
#include <firn/core/names.hpp>
#include <firn/core/parameters.hpp>
#include <firn/material/fluid.hpp>
#include <firn/material/modified_cam_clay.hpp>
#include <firn/material/mohr_coulomb.hpp>
#include <firn/material/nacc.hpp>
#include <firn/material/sand.hpp>
#include <firn/material/snow.hpp>
#include <firn/material/von_mises.hpp>

#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// A number and its name.
struct NamedNumber {
    std::string name;  ///< such as "young"
    double value = 0;  ///< in the unit of what has this name

    bool operator==(const NamedNumber&) const = default;
};

namespace detail {

/// The properties of elastic solids.
struct YoungPoisson {
    double young = 1e5, poisson = 0.3;
};

/// The properties of each kind, with names and units. Angles are in degrees.
/// @{
constexpr auto property_list(const YoungPoisson&) {
    return std::tuple{parameter{"young", "Pa", &YoungPoisson::young},
                      parameter{"poisson", "1", &YoungPoisson::poisson}};
}
constexpr auto property_list(const SandProperties&) {
    using P = SandProperties;
    return std::tuple{parameter{"young", "Pa", &P::young},
                      parameter{"poisson", "1", &P::poisson},
                      parameter{"friction_angle", "deg", &P::friction_angle},
                      parameter{"hardening", "deg", &P::hardening},
                      parameter{"hardening_decay", "1", &P::hardening_decay},
                      parameter{"initial_loss", "deg", &P::initial_loss}};
}
constexpr auto property_list(const SnowProperties&) {
    using P = SnowProperties;
    return std::tuple{parameter{"young", "Pa", &P::young}, parameter{"poisson", "1", &P::poisson},
                      parameter{"critical_compression", "1", &P::critical_compression},
                      parameter{"critical_stretch", "1", &P::critical_stretch},
                      parameter{"hardening", "1", &P::hardening}};
}
constexpr auto property_list(const FluidProperties&) {
    using P = FluidProperties;
    return std::tuple{parameter{"bulk", "Pa", &P::bulk}, parameter{"gamma", "1", &P::gamma},
                      parameter{"viscosity", "Pa s", &P::viscosity}, parameter{"tension", "Pa", &P::tension}};
}
constexpr auto property_list(const VonMisesProperties&) {
    using P = VonMisesProperties;
    return std::tuple{parameter{"young", "Pa", &P::young}, parameter{"poisson", "1", &P::poisson},
                      parameter{"yield_stress", "Pa", &P::yield_stress}, parameter{"hardening", "Pa", &P::hardening}};
}
constexpr auto property_list(const NaccProperties&) {
    using P = NaccProperties;
    return std::tuple{parameter{"young", "Pa", &P::young},
                      parameter{"poisson", "1", &P::poisson},
                      parameter{"friction_angle", "deg", &P::friction_angle},
                      parameter{"cohesion", "1", &P::cohesion},
                      parameter{"consolidation", "Pa", &P::consolidation},
                      parameter{"hardening", "1", &P::hardening}};
}
constexpr auto property_list(const MohrCoulombProperties&) {
    using P = MohrCoulombProperties;
    return std::tuple{parameter{"young", "Pa", &P::young},
                      parameter{"poisson", "1", &P::poisson},
                      parameter{"cohesion", "Pa", &P::cohesion},
                      parameter{"friction_angle", "deg", &P::friction_angle},
                      parameter{"dilatancy_angle", "deg", &P::dilatancy_angle},
                      parameter{"tension", "Pa", &P::tension},
                      parameter{"residual_cohesion", "Pa", &P::residual_cohesion},
                      parameter{"residual_friction_angle", "deg", &P::residual_friction_angle},
                      parameter{"residual_dilatancy_angle", "deg", &P::residual_dilatancy_angle},
                      parameter{"softening_strain", "1", &P::softening_strain}};
}
constexpr auto property_list(const ModifiedCamClayProperties&) {
    using P = ModifiedCamClayProperties;
    return std::tuple{parameter{"critical_slope", "1", &P::critical_slope},
                      parameter{"compression", "1", &P::compression},
                      parameter{"swelling", "1", &P::swelling},
                      parameter{"void_ratio", "1", &P::void_ratio},
                      parameter{"specific_volume", "1", &P::specific_volume},
                      parameter{"shear_modulus", "Pa", &P::shear_modulus},
                      parameter{"shear_ratio", "1", &P::shear_ratio},
                      parameter{"poisson", "1", &P::poisson},
                      parameter{"initial_pressure", "Pa", &P::initial_pressure},
                      parameter{"consolidation", "Pa", &P::consolidation}};
}
/// @}

template <class P>
concept has_listed_properties = requires(const P of) { property_list(of); };

/// The type of the properties of a material; void if it has none that are listed.
template <class Model>
auto properties_type() {
    if constexpr (requires { Model::from_young_poisson(1., 0.); })
        return std::type_identity<YoungPoisson>{};
    else if constexpr (requires { &Model::from_properties; })
        return []<class Made, class Given>(Made (*)(const Given&)) {
            if constexpr (has_listed_properties<Given>)
                return std::type_identity<Given>{};
            else
                return std::type_identity<void>{};
        }(&Model::from_properties);
    else
        return std::type_identity<void>{};
}
template <class Model>
using properties_t = typename decltype(properties_type<Model>())::type;

/// Returns the names, separated by commas; "none" if there are none.
inline std::string listed_names(const std::vector<std::string>& names) {
    std::string all;
    for (const std::string& name : names) (all += all.empty() ? "" : ", ") += name;
    return all.empty() ? "none" : all;
}
[[noreturn]] inline void throw_unnamed(std::string_view kind, std::string_view of, std::string_view name,
                                       const std::vector<std::string>& names) {
    throw parameter_error(sentence("'", name, "' is no ", kind, " of ", of, "; there are: ", listed_names(names), "."));
}
[[noreturn]] inline void throw_not_offered(const char* kind, const std::string& wanted,
                                           const std::vector<std::string>& names) {
    throw parameter_error(sentence("This program has no ", kind, " '", wanted, "'; it has: ", listed_names(names),
                                   ". Others are compiled in with firn::Offer."));
}

/// Sets properties by name; angles are in degrees.
/// \throws parameter_error  if there is no property of a name
template <class Properties>
void set_properties(Properties& to, const std::vector<NamedNumber>& numbers, std::string_view of) {
    std::apply(
        [&](const auto&... each) {
            for (const NamedNumber& number : numbers) {
                bool found = false;
                const auto set = [&](const auto& one) {
                    if (number.name != one.name) return;
                    auto& value = one.of(to);
                    if constexpr (std::same_as<std::remove_cvref_t<decltype(value)>, Angle>)
                        value = degrees(number.value);
                    else
                        value = number.value;
                    found = true;
                };
                (set(each), ...);
                if (!found) throw_unnamed("property", of, number.name, {each.name...});
            }
        },
        property_list(to));
}

/// Sets parameters of a policy by name, those of its inner policies included. \see for_parameters
/// \throws parameter_error  if there is no parameter of a name, or if it is a vector
template <class Policy>
void set_parameters(Policy& policy, const std::vector<NamedNumber>& numbers, std::string_view of) {
    for (const NamedNumber& number : numbers) {
        bool found = false;
        std::vector<std::string> names;
        for_parameters(policy, [&](const std::string& name, const char*, auto& value) {
            using Value = std::remove_cvref_t<decltype(value)>;
            if constexpr (std::is_arithmetic_v<Value>) {
                names.push_back(name);
                if (name != number.name) return;
                value = Value(number.value);
                found = true;
            }
        });
        if (!found) throw_unnamed("parameter", of, number.name, names);
    }
}

/// Makes a material of its type's default values, then from properties, then with parameters.
/// \throws parameter_error  if there is no property or parameter of a name, or if a value is out of range
template <class Model>
Model material_of(const std::vector<NamedNumber>& properties, const std::vector<NamedNumber>& parameters) {
    Model model{};
    using Properties = properties_t<Model>;
    if constexpr (std::is_void_v<Properties>) {
        if (!properties.empty()) throw_unnamed("property", name_of<Model>(), properties[0].name, {});
    } else if (!properties.empty()) {
        Properties of;
        set_properties(of, properties, name_of<Model>());
        // A wrapper inherits these functions from its model, so it is made of what they return.
        if constexpr (std::same_as<Properties, YoungPoisson>)
            model = Model{Model::from_young_poisson(of.young, of.poisson)};
        else
            model = Model{Model::from_properties(of)};
    }
    set_parameters(model, parameters, name_of<Model>());
    return model;
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
