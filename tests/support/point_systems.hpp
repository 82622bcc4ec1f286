/// \file Systems of point masses in which all happens that steps can change: for tests that stop them and go on.
#pragma once

#include "support/catch.hpp"
#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/io/particle_system_state.hpp>
#include <firn/lagrangian/cloth.hpp>
#include <firn/lagrangian/rope.hpp>

#include <cstring>

namespace point_systems {

using namespace firn;

/// Steps differ in length: Verlet goes by the one before.
template <class System>
void go(System& system, int steps) {
    for (int i = 0; i < steps; ++i) system.step(1e-3 * (1 + 0.25 * double(system.steps() * 7 % 5)));
}

template <class Items>
auto& named(Items& items, const std::string& name) {
    const auto found = std::ranges::find_if(items, [&](const auto& item) { return item.name == name; });
    REQUIRE(found != items.end());
    return found->values;
}
inline auto& table_of(auto& state, const char* name) { return named(state.tables, name); }
inline auto& field_of(auto& state, const char* name) { return named(state.fields, name); }
inline auto& parameter_of(auto& state, const char* name) { return named(state.parameters, name); }

/// To the last bit.
template <class S>
bool same(const State<S>& a, const State<S>& b) {
    const auto same_values = [](const StateField<S>& one, const StateField<S>& other) {
        return one.name == other.name && one.unit == other.unit && one.components == other.components &&
               one.values.size() == other.values.size() &&
               (one.values.empty() ||
                std::memcmp(one.values.data(), other.values.data(), one.values.size() * sizeof(S)) == 0);
    };
    return std::ranges::equal(a.fields, b.fields, same_values) && a.dimension == b.dimension && a.step == b.step &&
           a.time == b.time && a.last_time_step == b.last_time_step && a.id == b.id && a.body == b.body &&
           a.facets == b.facets && a.parameters == b.parameters && a.attributes == b.attributes && a.tables == b.tables;
}

/// Cloth in the wind, pulled apart between pins until it tears: constraints, springs, air on facets and points.
struct Banner {
    using System = ParticleSystem<3, float, Verlet>;
    ConstraintUpdate update = ConstraintUpdate::coloured;

    System made(int threads) const {
        System system;
        system.threads = threads;
        system.damping = 0.1;
        system.iterations = 4;
        system.warn = [](const std::string&) {};
        const auto net = cloth({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {12, 12});
        const std::size_t first = system.add(net, {.mass = 0.002, .radius = 0.02, .group = 1}, {0.1, 0, 0.2});
        for (std::uint32_t i = 0; i <= 12; ++i) {  // it tears from one side to the other
            system.points.pin(i, {0, 0, -0.1 - 0.1 * i});
            system.points.pin(156 + i, {0, 0, 0.1 + 0.1 * i});
        }
        for (const std::size_t k : {30, 52, 77}) system.points.end[k] = 0.01 * double(k) - 0.26;  // 0.04, 0.26, 0.51 s
        ConstraintsOfKinds kinds;
        kinds[std::size_t(LinkKind::shear)] = {.compliance = 1e-4};
        kinds[std::size_t(LinkKind::bend)] = {.relaxation = 0.3};
        system.constraints.update = update;
        system.constraints.tear_factor = 1.3;
        system.constraints.add(net, kinds, first);
        system.add_force(springs_of<float>(net, {.stiffness = 10, .damping = 0.01}, first));
        system.add_force(aerodynamic_surface_of(net, AerodynamicDrag<float, 3>{.wind = {1.0f, 4.0f, 0.5f}}, first));
        system.add_force(DragOnPoints<float, 3>{{.wind = {1.0f, 4.0f, 0.5f}}});
        return system;
    }
};

/// Balls from two nozzles in a box, a ball that moves and turns through them, and a rope that they fall on.
template <class Integrator>
struct Fountain {
    using Boundary = Together<Walls<double, 2>, Collider<Sphere<double, 2>>>;
    using System = ParticleSystem<2, double, Integrator, Boundary>;

    System made(int threads) const {
        System system(Boundary(Walls<double, 2>::all({0, 0}, {1, 1}, {Contact::separate, 0.3}),
                               Collider<Sphere<double, 2>>{.shape = {0.08},
                                                           .friction = 0.5,
                                                           .position = {0.2, 0.12},
                                                           .linear_velocity = {0.7, 0.1},
                                                           .angular_velocity = 9}));
        system.threads = threads;
        system.warn = {};
        system.restitution = 0.2;
        system.gravity = {0.5, -9.81};
        const auto net = rope<2>({0.5, 0.3}, {0.95, 0.3}, 12);
        system.add(net, {.mass = 0.01, .radius = 0.02});
        system.points.pin(0);
        system.points.pin(12);
        for (const std::size_t k : {4, 5, 9}) system.points.end[k] = 0.1 * double(k) - 0.37;  // 0.03, 0.13, 0.53 s
        system.constraints.update = ConstraintUpdate::averaged;
        system.constraints.add(net);
        system.collisions.emplace();
        system.collisions->restitution = 0.3;
        system.collisions->friction = 0.4;
        system.collisions->exclude(net.links);
        system.add_emitter({.position = {0.3, 0.8},
                            .direction = {1.0, -1.5},
                            .nozzle = 0.1,
                            .speed = 1.5,
                            .speed_spread = 0.5,
                            .cone = 0.4,
                            .rate = 400,
                            .lifespan = 0.4,
                            .lifespan_spread = 0.25,
                            .mass = 0.01,
                            .radius = 0.025,
                            .maximum = 60});
        system.add_emitter({.position = {0.8, 0.9},
                            .direction = {0, -1},
                            .nozzle = 0.1,
                            .speed = 2,
                            .rate = 150,
                            .start = 0.02,
                            .lifespan = 0.4,
                            .mass = 0.02,
                            .radius = 0.03,
                            .group = 4,
                            .seed = 5});
        return system;
    }
};

/// The state after some steps.
template <class Scene>
auto state_after(const Scene& scene, int steps, int threads = 2) {
    auto system = scene.made(threads);
    go(system, steps);
    return state_of(system);
}

}  // namespace point_systems
