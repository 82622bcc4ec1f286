/// \file What programs that compare runs on a device with runs on the CPU share: simulations that both can do, and
/// comparisons of their particles.
#pragma once

#include <firn/io/simulation_state.hpp>
#include <firn/webgpu/on_gpu.hpp>

#include "checks.hpp"
#include "scene.hpp"

#include <cmath>
#include <limits>

namespace checks {

using namespace firn;

/// Compares all that two states have.
template <class State>
void check_same_state(const std::string& name, const State& expected, const State& got) {
    check(got.time == expected.time && got.step == expected.step && got.last_time_step == expected.last_time_step,
          firn::sentence(name, "step ", expected.step), firn::sentence("step ", got.step, ", ", got.time, " s"));
    check(got.id == expected.id && got.body == expected.body, name + "ids and bodies");
    check(got.parameters == expected.parameters, name + "parameters, also those of a boundary that moves");
    for (std::size_t f = 0; f < expected.fields.size(); ++f) {
        // Devices leave out additions of 0, which make 0 of −0 on the CPU, and make 0 of subnormal numbers.
        const auto with_plain_zeros = [](auto values) {
            for (auto& x : values) x = std::abs(x) < std::numeric_limits<float>::min() ? 0 : x;
            return values;
        };
        check_same_bits(name + got.fields[f].name, with_plain_zeros(got.fields[f].values),
                        with_plain_zeros(expected.fields[f].values));
    }
}

/// Compares all that two simulations have of their particles, and how far they are.
template <class A, class B>
void check_same_run(const std::string& name, A& a, B& b) {
    check_same_state(name, firn::state_of(a), firn::state_of(b));
}

/// Compares the totals of two sets of particles.
template <int D>
void check_same_totals(const std::string& name, const firn::Totals<D>& expected, const firn::Totals<D>& got) {
    check(got.particles == expected.particles && got.mass == expected.mass && got.momentum == expected.momentum &&
              got.angular_momentum == expected.angular_momentum && got.kinetic_energy == expected.kinetic_energy &&
              (got.elastic_energy == expected.elastic_energy || std::isnan(expected.elastic_energy)),
          name + "totals");
}

/// A simulation in the unit box that says no warnings.
template <int D, class Material, class... Policies>
auto made(const Material& material, double cell_size, double time_step, const Policies&... policies) {
    firn::Domain<D> domain;
    domain.cell_size = cell_size;
    firn::Simulation simulation(domain, material, scenes::Integers{}, policies...);
    simulation.fixed_time_step = time_step;
    simulation.warn = {};
    return simulation;
}

/// The same in steps at their bound.
template <class Simulation>
Simulation bounded(Simulation simulation) {
    simulation.fixed_time_step = 0;
    simulation.execution.float_steps = true;
    return simulation;
}

/// Compares the totals, the report and the bound of the time step.
template <class Simulation>
void check_same_sums(const std::string& name, Simulation& cpu, webgpu::OnGpu<Simulation>& gpu) {
    check_same_totals(name, cpu.totals(), gpu.totals());
    check(gpu.report().signal_speed == cpu.report().signal_speed && gpu.stable_time_step() == cpu.stable_time_step() &&
              gpu.moment() == cpu.moment(),
          name + "report and bound of the time step");
}

/// A run in several parts, each of which ends in a shortened step.
template <class Simulation>
void compare(const std::string& name, Simulation cpu, int steps, int parts = 2,
             const webgpu::Device& device = webgpu::Device()) {
    auto gpu = firn::webgpu::on_gpu(cpu, device);
    if (!firn::state_of(cpu).id.empty()) check_same_run(name + ", before: ", cpu, gpu);
    for (int k = 0; k < parts; ++k) {
        const double step = cpu.fixed_time_step > 0 ? cpu.fixed_time_step : cpu.stable_time_step();
        const double duration = (steps / parts - 0.5) * step;
        cpu.advance(duration);
        gpu.advance(duration);
    }
    check(cpu.steps() >= std::uint64_t(steps / 2), name + ": steps are taken");
    check_same_run(name + ": ", cpu, gpu);
    check_same_sums(name + ": ", cpu, gpu);
}

/// A block that flies to a ball, which moves and turns, and drifts through several blocks of the grid.
template <class... Policies>
auto thrown(const Vec<double, 2>& velocity = {1, -2}, double spacing = 1.0 / 90, const Policies&... policies) {
    Collider<Sphere<float, 2>> ball{.shape = {0.1F}, .contact = Contact::separate, .friction = 0.2};
    ball.position = {0.5, 0.12};
    ball.linear_velocity = {0.3, 0.1};
    ball.angular_velocity = 2;
    auto simulation = made<2>(FixedCorotated<float>::from_young_poisson(2e4, 0.3), 1.0 / 50, 4e-4,
                              Together(scenes::rough_walls<2>(), ball), policies...);
    simulation.add(sample_box<2>({0.3, 0.25}, {0.7, 0.5}, {.spacing = spacing}), 1000, velocity);
    return simulation;
}

/// A block in a unit box whose lower corner is elsewhere, over a sink.
/// \param boundary  returns the boundary from the walls of this box
/// \param height    of the upper end of the sink above the corner [m]
template <class Boundary>
auto block_from(const Vec<double, 2>& corner, double height, const Boundary& boundary) {
    auto walls = scenes::rough_walls<2>();
    walls.lower = walls.lower + corner;
    walls.upper = walls.upper + corner;
    Simulation there(Domain<2>{corner, corner + Vec<double, 2>{1, 1}, 1.0 / 50},
                     FixedCorotated<float>::from_young_poisson(2e4, 0.3), scenes::Integers{}, boundary(walls));
    there.warn = {};
    there.fixed_time_step = 4e-4;
    there.add(sample_box<2>(corner + Vec<double, 2>{0.3, 0.25}, corner + Vec<double, 2>{0.7, 0.5}, {.spacing = 0.01}),
              1000, {1, -2});
    there.add_sink({.lower = corner + Vec<double, 2>{0.6, 0.2}, .upper = corner + Vec<double, 2>{0.65, height}});
    return there;
}

/// Adds a block of particles at random places.
template <int D>
void add_block(auto& simulation, double spacing, const Vec<double, D>& velocity) {
    simulation.add(sample_box<D>(Vec<double, D>::filled(0.2), Vec<double, D>::filled(0.5),
                                 {.spacing = spacing, .pattern = Pattern::jittered, .jitter = 0.1}),
                   1000, velocity);
}

/// What loads exerted, without their names.
template <int D>
std::vector<Reaction<D>> impulses_of_loads(const Reactions<D>& reactions) {
    std::vector<Reaction<D>> all;
    for (const LoadReaction<D>& load : reactions.loads) all.push_back(load.reaction);
    return all;
}

/// Steps that give reactions: the same from run to run, and but for rounding the CPU's.
/// \param idle  number of parts of the boundary that touch no matter
template <class Simulation>
void compare_reactions(const std::string& name, Simulation cpu, int steps, int idle = 0,
                       const webgpu::Device& device = webgpu::Device()) {
    constexpr int D = Simulation::dimension;
    if (!cpu.reactions) cpu.reactions.emplace();
    auto gpu = webgpu::on_gpu(cpu, device), again = webgpu::on_gpu(cpu, device);
    const auto moment_of = [](const Reaction<D>& part) {
        double square = 0;
        firn::detail::for_impulses(part, [&](double x) { square += x * x; });
        return std::sqrt(square - dot(part.impulse, part.impulse));
    };
    double worst = 0;
    std::vector<double> given, by_loads;  // by each, in all steps
    bool equal = true, complete = true;
    const auto compare_some = [&](const std::vector<Reaction<D>>& expected, const std::vector<Reaction<D>>& got,
                                  const std::vector<Reaction<D>>& other, std::vector<double>& sizes) {
        sizes.resize(expected.size());
        complete = complete && got.size() == expected.size() && other.size() == expected.size();
        if (!complete) return;
        double largest = 0, largest_moment = 0;
        for (const Reaction<D>& part : expected) {
            largest = std::max(largest, norm(part.impulse));
            largest_moment = std::max(largest_moment, moment_of(part));
        }
        for (std::size_t k = 0; k < expected.size(); ++k) {
            sizes[k] += norm(expected[k].impulse);
            equal = equal && got[k].impulse == other[k].impulse && got[k].angular_impulse == other[k].angular_impulse &&
                    got[k].about == expected[k].about;
            Reaction<D> wrong = got[k];
            wrong.impulse -= expected[k].impulse;
            wrong.angular_impulse -= expected[k].angular_impulse;
            // Of what acts through the point, the moments cancel.
            const double moment = std::max(largest_moment, 0.1 * largest);
            for (const auto& [error, scale] :
                 {std::pair(norm(wrong.impulse), largest), std::pair(moment_of(wrong), moment)})
                if (error != 0) worst = std::max(worst, error / scale);
        }
    };
    const auto compare = [&] {
        const Reactions<D>&expected = *cpu.reactions, &got = gpu.reactions(), &other = again.reactions();
        compare_some(expected.parts, got.parts, other.parts, given);
        compare_some(impulses_of_loads(expected), impulses_of_loads(got), impulses_of_loads(other), by_loads);
        for (std::size_t k = 0; k < std::min(expected.loads.size(), got.loads.size()); ++k)
            equal = equal && got.loads[k].load == expected.loads[k].load;
    };
    for (int k = 0; k < steps; ++k) cpu.step(), gpu.step(), again.step(), compare();
    for (int k = 0; k < 3; ++k) {
        const double duration = 2.6 * cpu.last_time_step();
        cpu.advance(duration), gpu.advance(duration), again.advance(duration), compare();
    }
    check(complete && equal, name + ": reactions are the same from run to run");
    check(std::ranges::count(given, 0.0) == idle && std::ranges::count(by_loads, 0.0) == 0 && worst < 1e-6,
          name + ": reactions are the CPU's",
          sentence(given.size(), " parts, of which ", std::ranges::count(given, 0.0), " do nothing; ", by_loads.size(),
                   " loads; to ", worst));
    const auto kept = gpu.simulation().reactions->parts;
    check(kept.size() == given.size() && (kept.empty() || kept[0].impulse == again.reactions().parts[0].impulse),
          name + ": the simulation has them, too");
    if constexpr (Simulation::material_count == 1) check_same_run(name + ": ", cpu, gpu);
}

/// Steps that give reactions. \see on_gpu_reactions.cpp
void reactions();
/// Runs with acceleration fields. \see on_gpu_fields.cpp
void acceleration_fields();
/// Runs with materials in plane strain, and that ask. \see on_gpu_materials.cpp
void materials();

}  // namespace checks
