/// \file A scene with contact groups, for any execution.
#pragma once

#include <firn/contact/coulomb.hpp>
#include <firn/rigid_body.hpp>

#include "mpi/bits.hpp"

namespace scenes {

/// For balls(): the walls alone.
inline constexpr auto only_walls = [](const auto& walls) { return walls; };
/// For balls(): the walls and a sphere that moves, which act by the gap of particles.
inline constexpr auto by_gap = []<class S, int D>(const Walls<S, D>& walls) {
    Collider<Sphere<S, D>> sphere{.shape = {S(0.1)}, .position = Vec<double, D>::filled(0.3)};
    sphere.position[0] = 0.85;
    sphere.linear_velocity[0] = -1;
    return GapContact{Together(walls, sphere)};
};

/// For balls(): the walls and a rigid ball that the others push.
inline constexpr auto with_rigid_ball = []<class S, int D>(const Walls<S, D>& walls) {
    Collider<Sphere<S, D>> sphere{.shape = {S(0.1)}, .friction = 0.3, .position = Vec<double, D>::filled(0.3)};
    sphere.position[0] = 0.85;
    sphere.linear_velocity[0] = -1;
    return GapContact{Together(walls, RigidBody(sphere, 200.0))};
};

/// Balls of two materials, each in a contact group of its own, that fly into a corner and at each other, with walls
/// that have friction. A source adds further ones.
template <int D, class Execution, class... Policies>
auto balls(const Execution& execution, NodesBehind nodes_behind, bool periodic, const auto& boundary_of,
           const Policies&... policies) {
    Domain<D> domain{Vec<double, D>::zero(), Vec<double, D>::filled(1), 1.0 / 32};
    domain.periodic[0] = periodic;
    auto walls = Walls<float, D>::all(Vec<float, D>::zero(), Vec<float, D>::filled(1), {Contact::separate, 0.3});
    walls.nodes_behind = nodes_behind;
    if (periodic) walls.at_lower[0].contact = walls.at_upper[0].contact = Contact::none;
    Simulation simulation(
        domain,
        Materials{FixedCorotated<float>::from_young_poisson(1e5, 0.3), NeoHookean<float>::from_young_poisson(1e4, 0.3)},
        execution, boundary_of(walls), CoulombContact{.friction = 0.3}, policies...);
    int group = 0;
    const auto add = [&](auto set, double radius) {
        Vec<double, D> centre = Vec<double, D>::filled(radius), velocity = Vec<double, D>::filled(-1);
        for (int a = 0, rest = group; a < 2; ++a, rest /= 3) centre[a] += 2.02 * radius * (rest % 3);
        velocity[0] += 0.5 * (group % 2);
        set.set_contact_group(set.add(sample_sphere<D>(centre, radius, {.spacing = 1.0 / 64}), 1000, velocity), group);
        ++group;
    };
    for (int k = 0; k < 8; ++k) {
        if (k % 2 == 0)
            add(simulation.template set<0>(), 0.12);
        else
            add(simulation.template set<1>(), 0.12);
    }
    simulation.template set<1>().add_source(
        {.samples = sample_sphere<D>(Vec<double, D>::filled(0.75), 0.08, {.spacing = 1.0 / 64}),
         .density = 1000,
         .velocity = Vec<double, D>::filled(-3),
         .rate = 20,
         .end = 0.03,
         .contact_group = 11});
    simulation.reactions.emplace();
    simulation.contact_impulses.emplace();
    return simulation;
}

/// Runs balls on all ranks, and on one without MPI.
template <class Inner, class Make>
void check_contact(const Make& make, int steps) {
    const Seen many = check_same_bits<Inner>(make, steps);
    if (mpi::Communicator(MPI_COMM_WORLD).rank() > 0) return;
    const Seen plain = look_at(make(Inner{}), steps);
    CHECK(many == plain);
    const auto at_start = look_at(make(Inner{}), 1).totals.size();
    CHECK(plain.totals.size() > (1 + std::size_t(steps) / 20) * at_start);  // more pairs of groups have touched
}

}  // namespace scenes
