/// \file Runs whose hash is stored: of 200 steps of two colliding blocks, and of balls that fall on a cloth, built
/// without contraction and FMA, where every compiler and processor gives the same bits.
#pragma once

#include "support/scenes.hpp"
#include <firn/lagrangian.hpp>

namespace golden {

template <int D, class S, class Transfer, class Force, class Execution>
auto simulation(const Execution& execution) {
    const firn::Domain<D> domain{firn::Vec<double, D>::zero(), firn::Vec<double, D>::filled(1.0), 1.0 / 32};
    return firn::Simulation<D, firn::FixedCorotated<S>, Transfer, Force, firn::QuadraticBSpline, Execution>(
        domain, firn::FixedCorotated<S>::from_young_poisson(1e5, 0.3), execution);
}

template <int D, class S, class Transfer, class Force, class Execution>
std::uint64_t hash_of_run(const Execution& execution) {
    auto simulation = golden::simulation<D, S, Transfer, Force>(execution);
    scenes::add_two_blocks<D>(simulation, D == 2 ? 0.3 : 0.2);
    for (int step = 0; step < 200; ++step) simulation.step();  // automatic time steps: they, too, must agree
    return scenes::hash(simulation);
}

inline std::uint64_t coloured_3d(int threads) {
    return hash_of_run<3, float, firn::Apic, firn::MlsForce>(firn::Coloured{threads});
}
inline std::uint64_t coloured_2d(int threads) {
    return hash_of_run<2, double, firn::Pic, firn::WeightGradientForce>(firn::Coloured{threads});
}
inline std::uint64_t fixed_point_3d(int threads) {
    return hash_of_run<3, float, firn::Apic, firn::MlsForce>(firn::FixedPoint<std::int32_t>{threads});
}

/// Balls fall on a cloth that hangs by two corners, and on the floor; all of them collide.
inline std::uint64_t points_3d(int threads) {
    using Room = firn::Walls<float, 3>;
    firn::ParticleSystem<3, float, firn::Verlet, Room> system(
        Room::all({0, 0, 0}, {1, 1, 1}, {firn::Contact::separate, 0.3}));
    system.threads = threads;
    system.warn = {};
    system.restitution = 0.2;
    const auto net = firn::cloth({0.2, 0.4, 0.2}, {0.6, 0, 0}, {0, 0, 0.6}, {12, 12});
    system.add(net, {.mass = 0.01, .radius = 0.02});
    system.points.pin(0);
    system.points.pin(12);
    system.constraints.add(net, firn::ConstraintOptions{.compliance = 1e-4});
    system.collisions.emplace();
    system.collisions->restitution = 0.3;
    system.collisions->friction = 0.4;
    system.collisions->exclude(net.links);
    for (std::uint64_t i = 0; i < 300; ++i) {
        const auto random = [i](int k) { return scenes::noise(7 * i + std::uint64_t(k)); };
        system.points.add({.position = {0.1 + 0.8 * random(0), 0.1 + 0.8 * random(1), 0.1 + 0.8 * random(2)},
                           .velocity = {random(3) - 0.5, -random(4), random(5) - 0.5},
                           .mass = 0.01 + 0.02 * random(6),
                           .radius = 0.02 + 0.01 * random(6)});
    }
    for (int step = 0; step < 200; ++step) system.step(1e-3 * (1 + 0.25 * (step * 7 % 5)));
    scenes::Hash all;
    for (std::size_t i = 0; i < system.points.size(); ++i) {
        all.add(system.points.position[i].v, 3);
        all.add(system.points.velocity[i].v, 3);
    }
    return all.value;
}

// g++ 12 and clang 19 agree on them, on x86-64, AArch64 and WebAssembly.
inline constexpr std::uint64_t of_coloured_3d = 0x13bc69d8138a1335, of_coloured_2d = 0x1f44dc3a4dd5e129,
                               of_fixed_point_3d = 0x653c5359cec80a52, of_points_3d = 0xe7ef68b922e14594;

}  // namespace golden
