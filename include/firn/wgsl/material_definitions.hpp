/// \file Records the C++ functions of a material, and of what acts on its state, and adds them to a WGSL module.
#pragma once

#include <firn/material/surroundings.hpp>
#include <firn/stage/surroundings.hpp>
#include <firn/stage/time_step.hpp>
#include <firn/stage/volume_filter.hpp>
#include <firn/wgsl/definitions.hpp>

#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::wgsl {

/// Whether the program of a material tells it the surroundings of particles. \see asks_surroundings
template <class Material, int D>
inline constexpr bool program_asks = asks_surroundings<with_scalar_t<Material, recorded>, D>;

namespace detail {

/// Adds a function of the material to the module. If the material asks, the function has one parameter more: `here`,
/// the surroundings of the particle. The other parameters are those of Module::function().
/// \param definition  definition(material, arguments...), with the recorded material of one particle
template <int D, class... Arguments, class Material, class Definition>
void add_function_of(Module& module, const Material& material, const std::string& name, const std::string& comment,
                     std::vector<std::string> names, const Definition& definition) {
    const auto model = [&] { return with_uniforms(material, "material"); };
    if constexpr (program_asks<Material, D>) {
        using Here = Surroundings<recorded, D>;
        names.push_back("here");
        module.function<Arguments..., Here>(name, comment, names, [&](const Arguments&... all, const Here& here) {
            const auto own = model();
            return definition(placed<D>(own, [&] { return here; }), all...);
        });
    } else {
        module.function<Arguments...>(name, comment, names,
                                      [&](const Arguments&... all) { return definition(model(), all...); });
    }
}

}  // namespace detail

/// Adds the functions of the material to the module. These functions return a particle's state after a step, its
/// Kirchhoff stress [Pa] and its signal speed [m/s]. If the material asks for the surroundings of particles, there is
/// also surroundings_of, which returns them.
template <int D, class Material>
void add_material(Module& module, const Material& material) {
    using R = recorded;
    using V = Vec<R, D>;
    using M = Mat<R, D>;
    using State = material_state_t<with_scalar_t<Material, R>, D>;
    const std::string of_material = std::string(Material::name) + ", ";
    if constexpr (program_asks<Material, D>)
        module.function<V, V, V, R, R, R>(
            "surroundings_of", of_material + "firn/stage/surroundings.hpp: where and when a particle is",
            {"place", "corner", "velocity", "mass", "volume", "time"},
            [](const V& place, const V& corner, const V& velocity, const R& mass, const R& volume, const R& time) {
                const V lower = detail::uniform_of<V>(detail::corner_uniform);
                return surroundings_of(position_of(lower, corner, place, detail::cell_size()), velocity, mass, volume,
                                       detail::cell_size(), time);
            });
    if constexpr (has_stress_with_state<with_scalar_t<Material, R>, D>)
        detail::add_function_of<D, State, M>(
            module, material, "updated_with_stress",
            of_material + "its state after a step and the Kirchhoff stress [Pa] in it", {"state", "velocity_gradient"},
            [](const auto& model, const State& state, const M& velocity_gradient) {
                return updated_with_stress(model, state, velocity_gradient, detail::time_step());
            });
    else
        detail::add_function_of<D, State, M>(module, material, "updated", of_material + "its state after a step",
                                             {"state", "velocity_gradient"},
                                             [](const auto& model, const State& state, const M& velocity_gradient) {
                                                 return updated(model, state, velocity_gradient, detail::time_step());
                                             });
    if constexpr (has_rate_dependent_stress<with_scalar_t<Material, R>, D>)
        detail::add_function_of<D, State, M>(module, material, "kirchhoff_stress",
                                             of_material + "Kirchhoff stress [Pa]", {"state", "velocity_gradient"},
                                             [](const auto& model, const State& state, const M& velocity_gradient) {
                                                 return stress_of(model, state, velocity_gradient);
                                             });
    else
        detail::add_function_of<D, State>(
            module, material, "kirchhoff_stress", of_material + "Kirchhoff stress [Pa]", {"state"},
            [](const auto& model, const State& state) { return kirchhoff_stress(model, state); });
    detail::add_function_of<D, V, R, R, State>(
        module, material, "signal_speed", of_material + "the particle's speed and its wave speed [m/s]",
        {"velocity", "mass", "volume", "state"},
        [](const auto& model, const V& velocity, const R& mass, const R& volume, const State& state) {
            return signal_speed(model, velocity, mass, volume, state, detail::cell_size());
        });
}

/// Adds the functions of a volumetric policy that filters volume ratios: share_of, and those of stage/volume_filter.hpp
/// for one particle.
template <int D, class Material, class Volume>
void add_filtered_volume(Module& module, const Material& material, const Volume& volume) {
    using R = recorded;
    using M = Mat<R, D>;
    using State = material_state_t<with_scalar_t<Material, R>, D>;
    module.function<R>("share_of", std::string(Volume::name) + ", the share that one pass removes", {"crossed"},
                       [&](const R& crossed) { return volume.share(crossed); });
    module.function<State>("volume_change_of", "firn/stage/volume_filter.hpp: J - 1", {"state"},
                           [](const State& state) { return volume_change(state); });
    detail::add_function_of<D, State, R>(
        module, material, "filtered_volume_of",
        "firn/stage/volume_filter.hpp: V0 of a particle that takes part, else 0", {"state", "volume"},
        [](const auto& model, const State& state, const R& initial) { return filtered_volume(model, state, initial); });
    detail::add_function_of<D, State, M, R, R, R, R>(
        module, material, "filtered", "firn/stage/volume_filter.hpp: state and stress after a pass",
        {"state", "stress", "once", "twice", "volume", "share"},
        [](const auto& model, const State& state, const M& stress, const R& once, const R& twice, const R& taking_part,
           const R& share) { return filtered_state<D>(model, state, stress, once, twice, taking_part, share); });
}

}  // namespace firn::inline FIRN_BUILD::wgsl
