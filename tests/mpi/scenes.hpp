/// \file Small scenes that run on ranks: with different materials, transfers, kernels, boundaries and precisions.
#pragma once

#include <firn/firn.hpp>
#include <firn/mpi.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

namespace scenes {

using namespace firn;

/// Returns a number that depends on every bit of every particle of a simulation, on all ranks, and on no order.
template <class Simulation>
std::uint64_t fingerprint(const Simulation& simulation) {
    std::uint64_t sum = 0;
    const auto add = [&](const auto& set, std::uint64_t seed) {
        const auto& particles = set.particles();
        std::vector<std::byte> record(particles.record_bytes());
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            particles.write_record(slot, record.data());
            std::uint64_t hash = seed;
            for (const std::byte byte : record) hash = (hash ^ std::uint64_t(byte)) * 1099511628211ull;
            sum += hash ^ hash >> 29;
        }
    };
    [&]<std::size_t... I>(std::index_sequence<I...>) {
        (add(simulation.template set<I>(), 14695981039346656037ull + I), ...);
    }(std::make_index_sequence<Simulation::material_count>{});
    if constexpr (requires { simulation.execution.communicator(); })
        return simulation.execution.communicator().sum(sum);
    else
        return sum;
}

/// Two elastic cubes that fly against each other.
template <class Execution>
auto two_cubes(const Execution& execution) {
    Simulation simulation(Domain<3>{{0, 0, 0}, {1, 1, 1}, 1. / 24}, FixedCorotated<float>::from_young_poisson(2e4, 0.3),
                          execution);
    simulation.add(sample_box<3>({0.1, 0.1, 0.1}, {0.5, 0.5, 0.5}, {.spacing = 0.4 / 16}), 1000, {2., 0., 0.5});
    simulation.add(sample_box<3>({0.55, 0.2, 0.15}, {0.9, 0.5, 0.5}, {.spacing = 0.35 / 14}), 1000, {-2., 0., 0.});
    return simulation;
}

/// A mist: few particles in each block, that fly in all directions.
template <class Execution>
auto spray(const Execution& execution) {
    Simulation simulation(Domain<3>{{0, 0, 0}, {1, 1, 1}, 1. / 32}, FixedCorotated<float>::from_young_poisson(1e4, 0.3),
                          execution);
    Samples<3> samples;
    samples.volume = 1e-6;
    std::uint64_t random = 1;
    const auto next = [&] {
        random = random * 6364136223846793005ull + 1442695040888963407ull;
        return double(random >> 11) * 0x1p-53;
    };
    for (int k = 0; k < 5000; ++k)
        samples.positions.push_back({0.1 + 0.8 * next(), 0.1 + 0.8 * next(), 0.1 + 0.8 * next()});
    simulation.add(samples, 1000);
    auto& particles = simulation.edit_particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) {
            const double angle = double(particles.id(slot)), up = std::sin(0.7 * angle);
            particles.set_velocity(slot, {float(2 * std::cos(angle)), float(2 * up), float(2 * std::sin(angle))});
        }
    return simulation;
}

/// Snow, sand, water and jelly, through which a sphere moves.
template <class Execution>
auto four_materials(const Execution& execution, NodesBehind nodes_behind = NodesBehind::held) {
    const Collider<Sphere<float, 3>> sphere{
        .shape = {0.12F}, .position = {0.1, 0.15, 0.25}, .linear_velocity = {1.5, 0, 0}};
    auto walls = Walls<float, 3>::all({0, 0, 0}, {1, 0.5F, 0.5F}, {Contact::separate, 0.3});
    walls.nodes_behind = nodes_behind;
    Simulation simulation(
        Domain<3>{{0, 0, 0}, {1, 0.5, 0.5}, 1. / 32},
        Materials(Snow<float>{}, Sand<float>::from_properties({}), Fluid<float>::from_properties({.bulk = 1e5}),
                  FixedCorotated<float>::from_young_poisson(2e4, 0.3)),
        Together(walls, sphere), execution);
    const SamplingOptions fine{.spacing = 1. / 56};
    simulation.template set<0>().add(sample_box<3>({0.05, 0.28, 0.1}, {0.25, 0.45, 0.4}, fine), 400);
    simulation.template set<1>().add(sample_box<3>({0.3, 0.0, 0.05}, {0.5, 0.2, 0.45}, fine), 1600);
    simulation.template set<2>().add(sample_box<3>({0.5, 0.0, 0.0}, {0.7, 0.3, 0.5}, fine), 1000);
    simulation.template set<3>().add(sample_box<3>({0.72, 0.1, 0.1}, {0.92, 0.3, 0.3}, fine), 1000, {-3., 0., 0.});
    simulation.reactions.emplace();
    return simulation;
}

/// Water from a source that falls into a sink, through sand and past a disc that moves; each burst lives for a while.
template <class Execution, class Volume = OwnVolume>
auto fountain(const Execution& execution, NodesBehind nodes_behind = NodesBehind::held, Volume volume = {}) {
    const Collider<Sphere<float, 2>> disc{.shape = {0.06F}, .position = {0.2, 0.55}, .linear_velocity = {0.6, -0.3}};
    auto walls = Walls<float, 2>::all({0, 0}, {1, 1}, {Contact::separate, 0.3});
    walls.nodes_behind = nodes_behind;
    Simulation simulation(Domain<2>{{0, 0}, {1, 1}, 1. / 96},
                          Materials(Fluid<float>::from_properties({.bulk = 2e4}), Sand<float>::from_properties({})),
                          execution, Together(walls, disc), Flip<float>{}, volume);
    simulation.template set<0>().add(sample_box<2>({0.0, 0.0}, {0.3, 0.1}, {.spacing = 1. / 192}), 1000);
    simulation.template set<1>().add(sample_box<2>({0.35, 0.0}, {0.7, 0.2}, {.spacing = 1. / 192}), 1600);
    Source<2> source{.samples = sample_box<2>({0.1, 0.3}, {0.16, 0.34}, {.spacing = 1. / 192}),
                     .density = 1000,
                     .velocity = {2., 2.},
                     .rate = 40,
                     .lifespan = 0.12};
    simulation.template set<0>().add_source(source);
    simulation.template set<0>().add_sink({{0.8, 0.0}, {1.0, 0.3}});
    simulation.reactions.emplace();
    return simulation;
}

/// A wave through an elastic sheet without ends, in double, with the cubic kernel.
template <class Execution>
auto waves(const Execution& execution) {
    Domain<2> domain{{0, 0}, {1.5, 1.5}, 1. / 32};
    domain.periodic = {true, true};
    Simulation simulation(domain, NeoHookean<double>::from_young_poisson(1e4, 0.3), execution, CubicBSpline{},
                          WeightGradientForce{});
    simulation.gravity = Vec<double, 2>::zero();
    simulation.add(sample_box<2>({0, 0}, {1.5, 1.5}, {.spacing = 1. / 64}), 1000, {4., 1.});
    auto& particles = simulation.edit_particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) {
            const auto x = particles.exact_position(slot);
            particles.set_velocity(slot, {4 + std::sin(4.1887902 * x[0]), 1 + 0.5 * std::cos(4.1887902 * x[1])});
        }
    return simulation;
}

/// Two discs that collide, with a series of passes between particles and grid. With mirrored walls, they fly into
/// corners.
template <class Execution>
auto two_discs(const Execution& execution, NodesBehind nodes_behind = NodesBehind::held) {
    Simulation simulation(Domain<2>{{0, 0}, {1, 1}, 1. / 48}, FixedCorotated<double>::from_young_poisson(2e4, 0.3),
                          execution, Fmpm{.order = 3});
    simulation.boundary.nodes_behind = nodes_behind;
    const double way = nodes_behind == NodesBehind::mirrored ? -1 : 1;
    simulation.add(sample_sphere<2>({0.3, 0.4}, 0.18, {.spacing = 1. / 110}), 1000, {2. * way, way - 1.});
    simulation.add(sample_sphere<2>({0.7, 0.5}, 0.18, {.spacing = 1. / 110}), 1000, {-2. * way, 1. - way});
    return simulation;
}

}  // namespace scenes
