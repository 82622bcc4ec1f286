/// \file From point masses to a state, with the surfaces they carry: to be looked at.
#pragma once

#include <firn/io/state.hpp>
#include <firn/lagrangian/particle_system.hpp>
#include <firn/version.hpp>

#include <algorithm>
#include <span>
#include <type_traits>
#include <vector>

namespace firn {

/// The state of point masses: positions [m], velocities [m/s], masses [kg], radii [m], and which are pinned (1, else
/// 0), in the order of ids. The group of a point stands as its `material`.
/// \param facets  that name points by their places
/// \param time    [s]
/// \throws parameter_error  if a facet names a point that is not there
template <std::floating_point S, int D>
State<S> state_of(const PointMasses<S, D>& points, std::type_identity_t<std::span<const Facet<D>>> facets, double time,
                  std::uint64_t step) {
    const std::size_t n = points.size();
    State<S> state;
    state.dimension = D;
    state.step = step;
    state.time = time;
    const auto add_vectors = [&](const char* name, const char* unit, const auto& values) {
        StateField<S> field{name, unit, D, std::vector<S>(n * D)};
        for (std::size_t i = 0; i < n; ++i) std::copy_n(values[i].v, D, field.values.data() + i * D);
        state.fields.push_back(std::move(field));
    };
    add_vectors("position", "m", points.position);
    add_vectors("velocity", "m/s", points.velocity);
    state.fields.push_back({"mass", "kg", 1, {points.mass.begin(), points.mass.end()}});
    state.fields.push_back({"radius", "m", 1, {points.radius.begin(), points.radius.end()}});
    StateField<S> pinned{"pinned", "1", 1, std::vector<S>(n)};
    for (std::size_t i = 0; i < n; ++i) pinned.values[i] = points.is_pinned(i) ? S(1) : S(0);
    state.fields.push_back(std::move(pinned));
    state.id.assign(points.id.begin(), points.id.end());
    state.material.reserve(n);
    for (const auto group : points.group) state.material.push_back(std::int32_t(group));
    state.facets.reserve(facets.size() * D);
    for (const auto& facet : facets) state.facets.insert(state.facets.end(), facet.begin(), facet.end());
    state.attributes = {{"precision", sizeof(S) == 4 ? "float" : "double"}, {"library_version", version()}};
    check_state(state);
    return state;
}

/// The state of a system: its points and facets, gravity [m/s²] and damping [1/s].
template <int D, std::floating_point S, class... Policies>
State<S> state_of(const ParticleSystem<D, S, Policies...>& system) {
    State<S> state = state_of(system.points, system.facets, system.time(), system.steps());
    state.parameters = {{"system", "gravity", "m/s^2", {system.gravity.v, system.gravity.v + D}},
                        {"system", "damping", "1/s", {system.damping}}};
    return state;
}

}  // namespace firn
