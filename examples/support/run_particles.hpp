/// \file Runs a particle system in an example, with states and pictures of surfaces and points.
#pragma once

#include "support/run_schedule.hpp"
#include "support/solids.hpp"
#include <firn/io/background_series.hpp>
#include <firn/io/obj.hpp>
#include <firn/io/particle_system_state.hpp>
#include <firn/io/ply.hpp>
#include <firn/io/state_reader.hpp>

#include <vector>

namespace example {

/// Returns a system's facets, in the colour of their first point, and its other points as spheres.
/// \param radius     of the spheres; shadows are about as soft
/// \param colour_of  colour_of(index) of a point
template <int D, class System, class ColourOf>
Cloud cloud_of(const System& system, double radius, const ColourOf& colour_of) {
    Cloud cloud;
    cloud.radius = float(radius);
    std::vector<bool> is_drawn(system.points.size());
    if constexpr (D == 3) {
        for (const auto& x : system.points.position) cloud.surface.vertices.push_back(drawn(x));
        for (const auto& facet : system.facets) {
            add_triangle(cloud.surface, facet, std::uint8_t(colour_of(facet[0])));
            for (const auto corner : facet) is_drawn[corner] = true;
        }
    }
    for (std::size_t i = 0; i < system.points.size(); ++i) {
        if (is_drawn[i]) continue;
        cloud.positions.push_back(drawn(system.points.position[i]));
        cloud.colour.push_back(std::uint8_t(colour_of(i)));
    }
    return cloud;
}

/// Runs a particle system with run_schedule().
/// \param step     makes a step
/// \param picture  draws a picture; its view must not depend on the state
template <class System, class Step, class Picture>
Outcome run(System& system, const Options& options, const Step& step, const Picture& picture) {
    using S = typename System::scalar_type;
    firn::BackgroundSeries<S> series(options.output, options.name);
    Begun begun;
    if (options.go_on) {
        const auto list = states_to_go_on_from(series.path());
        restore_as(options, [&](firn::Restart how) {
            firn::restore(system, firn::read_state<S>(options.output / list.back().file), how);
        });
        series.go_on_from(list.back().time);
        begun = {std::int64_t(system.steps()), int(list.size())};
    }
    int states = begun.states;
    const auto write = [&] {
        auto state = firn::state_of(system);
        if (options.obj) firn::write_obj(options.file(numbered(states, ".obj")), state);
        if (options.ply) firn::write_ply(options.file(numbered(states, ".ply")), state, {"velocity", "mass"});
        series.write(std::move(state));
        ++states;
    };
    return run_schedule(
        options, [&] { return std::int64_t(system.points.size()); }, begun, write, [&] { series.finish(); }, step,
        picture, {options.file(".hdf.series")});
}

}  // namespace example
