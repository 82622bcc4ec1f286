/// \file What every example does with a simulation: steps, a progress bar, HDF5 states, OBJ points, a picture.
#pragma once

#include "support/errors.hpp"
#include "support/options.hpp"
#include "support/png.hpp"
#include "support/progress.hpp"
#include "support/renderer.hpp"
#include <firn/firn.hpp>
#include <firn/io/obj.hpp>
#include <firn/io/states.hpp>

#include <chrono>
#include <cstdio>
#include <iostream>

namespace example {

/// Positions of all particles in the order of ids.
template <class Simulation>
std::vector<firn::Vec<double, Simulation::dimension>> positions(const Simulation& simulation) {
    const auto& particles = simulation.particles();
    std::vector<firn::Vec<double, Simulation::dimension>> points(particles.size());
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) points[particles.id(slot)] = firn::cast<double>(particles.position(slot));
    return points;
}

/// A picture of the particles, a colour for each body.
template <class Simulation>
Image picture(const Simulation& simulation, double spacing, View view = {}) {
    constexpr int D = Simulation::dimension;
    Cloud cloud;
    cloud.radius = float((D == 3 ? 0.6 : 0.75) * spacing);
    for (const auto& x : positions(simulation))
        cloud.positions.push_back({float(x[0]), float(x[1]), D == 3 ? float(x[D - 1]) : 0.0F});
    cloud.colour.resize(cloud.positions.size());
    for (std::size_t b = 0; b < simulation.bodies().size(); ++b)
        std::fill_n(cloud.colour.begin() + simulation.bodies()[b].first, simulation.bodies()[b].count, std::uint8_t(b));
    const auto& domain = simulation.domain();
    Box box;
    for (int a = 0; a < 3; ++a) {
        box.lower[a] = a < D ? float(domain.lower[a]) : 0.0F;
        box.upper[a] = a < D ? float(domain.upper[a]) : 0.0F;
    }
    view.domain = box;
    return render(cloud, view);
}

/// Runs the schedule. States: OUTPUT/NAME_0000.hdf …, the first before the first step, the last after the last.
/// \param after_step  called after every step
/// \param points      also write OUTPUT/NAME_0000.obj …, for Houdini and Blender
template <class Simulation, class AfterStep>
void run(Simulation& simulation, const Options& options, double spacing, const View& view, bool points,
         const AfterStep& after_step) {
    std::cout << options.name << ": " << simulation.particles().size() << " particles, " << options.schedule.steps
              << " steps, " << options.threads << (options.threads == 1 ? " thread" : " threads") << std::endl;
    firn::StateSeries states(options.output, options.name);
    int frame = 0;
    const auto write = [&] {
        states.write(firn::state_of(simulation));
        char number[16];
        std::snprintf(number, sizeof number, "_%04d.obj", frame++);
        if (points) firn::write_obj_points(options.file(number), positions(simulation));
    };
    write();
    Progress progress(options.schedule.steps, std::int64_t(simulation.particles().size()));
    for (std::int64_t step = 1; step <= options.schedule.steps; ++step) {
        simulation.step();
        after_step();
        if (options.schedule.writes_after(step)) write();
        progress.advance();
    }
    write_png(options.file(".png"), picture(simulation, spacing, view));
    std::cout << frame << " states: " << options.file(".hdf.series").string()
              << "\npicture: " << options.file(".png").string() << std::endl;
}

}  // namespace example
