// part: arithmetic
/// \file Nets among other matter on the grid: they carry momentum both ways, stretch as they should, and bound the
/// step.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include <firn/data/sampling.hpp>
#include <firn/field/damped.hpp>
#include <firn/io/restart.hpp>
#include <firn/lagrangian/cloth.hpp>
#include <firn/lagrangian/net_forces.hpp>
#include <firn/lagrangian/rope.hpp>
#include <firn/material/no_stress.hpp>
#include <firn/simulation.hpp>

#include <cstring>

using namespace firn;

namespace coupling_tests {

namespace {

using Cloth = NoStress<double>;
using Jelly = FixedCorotated<double>;
using Both = Simulation<3, Materials<Cloth, Jelly>>;
using V = Vec<double, 3>;

/// A square of cloth, across y.
Net<3> square(const V& corner, double side, std::size_t cells) {
    return cloth(corner, {{0, 0, side}}, {{side, 0, 0}}, {cells, cells});
}
std::vector<double> masses(const Net<3>& net, double total) {
    return std::vector<double>(net.positions.size(), total / double(net.positions.size()));
}

Totals<3> of_both(const Both& simulation) {
    auto sum = simulation.set<Cloth>().totals();
    return sum += simulation.set<Jelly>().totals();
}

/// A block of jelly that flies into a cloth, far from any wall.
Both falling_into_cloth(int threads) {
    Both simulation({{{0, 0, 0}}, {{1, 1, 1}}, 1.0 / 16}, {}, {threads});
    simulation.gravity = V::zero();
    const Net<3> net = square({{0.25, 0.5, 0.25}}, 0.5, 16);
    const Body sheet = simulation.set<Cloth>().add(net, masses(net, 0.05));
    simulation.set<Cloth>().add_force(sheet, membranes_of(net, Jelly::from_young_poisson(1e4, 0.3), 1e-3));
    simulation.set<Jelly>().add(sample_box<3>({{0.4, 0.6, 0.4}}, {{0.6, 0.7, 0.6}}, {.spacing = 1.0 / 32}), 20,
                                {{0.3, -2, 0}});
    return simulation;
}

}  // namespace

TEST_CASE("cloth that catches a block takes its momentum, and both have as much as before", "[lagrangian]") {
    Both simulation = falling_into_cloth(0);
    const auto before = of_both(simulation);
    simulation.advance(0.1);
    const auto after = of_both(simulation);
    CHECK(norm(after.momentum - before.momentum) < 1e-12 * norm(before.momentum));
    CHECK(norm(after.angular_momentum - before.angular_momentum) < 1e-12 * norm(before.momentum));
    // Both ways: the cloth is carried along, the block is slower.
    const auto cloth = simulation.set<Cloth>().totals(), block = simulation.set<Jelly>().totals();
    CHECK(cloth.momentum[1] / cloth.mass < -0.5);
    CHECK(block.momentum[1] / block.mass > -1.9);
    // And nothing went through: the block's lowest particle is above the cloth's lowest.
    const auto lowest = [](const auto& particles) {
        double y = 1;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) y = std::min(y, particles.exact_position(slot)[1]);
        return y;
    };
    CHECK(lowest(simulation.set<Jelly>().particles()) > lowest(simulation.set<Cloth>().particles()));
}

TEST_CASE("cloth and a block give the same bits for 1, 2, 3, 4 and 7 threads", "[lagrangian]") {
    const auto run = [](int threads) {
        Both simulation = falling_into_cloth(threads);
        for (int i = 0; i < 40; ++i) simulation.step();
        std::vector<V> all;
        const auto& particles = simulation.set<Cloth>().particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) all.push_back(particles.exact_position(slot));
        return all;
    };
    const auto one = run(1);
    CHECK(one.size() == 17 * 17);
    for (const int threads : test_support::other_threads) {
        const auto other = run(threads);
        CHECK(std::memcmp(one.data(), other.data(), one.size() * sizeof(V)) == 0);
    }
}

TEST_CASE("a strip of cloth that hangs is longer by rho g L^2 / 2E", "[lagrangian][slow]") {
    // Without Poisson's effect, in a field of gravity along x, held at x = 0 by the wall that it begins in.
    const double young = 2e4, thickness = 1e-3, density = 100, length = 0.5, g = 9.81;
    auto walls = Walls<double, 3>::all({{0, 0, 0}}, {{1, 0.5, 0.5}}, {});
    walls.at_lower[0].contact = Contact::stick;
    Both simulation({{{0, 0, 0}}, {{1, 0.5, 0.5}}, 1.0 / 32}, {}, {}, walls);
    const Net<3> net = cloth({{0, 0.25, 0.2}}, {{length, 0, 0}}, {{0, 0, 0.1}}, {32, 8});
    const Body sheet = simulation.set<Cloth>().add(net, facet_masses(net, density * thickness));
    simulation.set<Cloth>().add_force(sheet, membranes_of(net, Jelly::from_young_poisson(young, 0), thickness));
    const Damped<double, 3> damped{{{{g, 0, 0}}}, 20};
    simulation.advance(0.7, damped);
    double end = 0, count = 0;
    const auto& particles = simulation.set<Cloth>().particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot) && net.positions[particles.id(slot)][0] == length) {
            end += particles.exact_position(slot)[0];
            ++count;
        }
    CHECK(count == 9);
    // Held within the kernel's reach of the wall: a cell less to stretch, of 16.
    CHECK(end / count - length == Approx(density * g * length * length / (2 * young)).epsilon(0.05));
}

TEST_CASE("the step is bounded by what joins the particles of a net", "[lagrangian]") {
    Both simulation({{{0, 0, 0}}, {{1, 1, 1}}, 1.0 / 16});
    simulation.gravity = V::zero();
    const Net<3> net = square({{0.25, 0.5, 0.25}}, 0.5, 8);
    const Body sheet = simulation.set<Cloth>().add(net, masses(net, 0.01));
    // Nothing moves and nothing pulls: there is no bound before there is a force.
    CHECK_THROWS_AS(simulation.stable_time_step(), particle_error);
    simulation.set<Cloth>().add_force(sheet,
                                      aerodynamic_surface_of(net, AerodynamicDrag<double, 3>{}));  // nor after this
    CHECK_THROWS_AS(simulation.stable_time_step(), particle_error);
    Springs<double, 3> one;
    one.add({0, 1}, {1.0 / 16, 100, 0});
    simulation.set<Cloth>().add_force(sheet, std::move(one));
    // Half of 2/ω, ω² = 2k/m of two free masses
    CHECK(simulation.stable_time_step() == Approx(1 / std::sqrt(200 / (0.01 / 81))));
    // Slightly pulled apart it swings for as long as we look, and does not grow.
    simulation.set<Cloth>().add_force(sheet, membranes_of(net, Jelly::from_young_poisson(1e5, 0.3), 1e-3));
    auto& particles = simulation.set<Cloth>().edit_particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot))
            particles.set_velocity(slot, (particles.exact_position(slot) - V::filled(0.5)) * 0.1);
    const double energy = simulation.set<Cloth>().totals().kinetic_energy;
    double largest = 0;
    for (int i = 0; i < 500; ++i) {
        simulation.step();
        largest = std::max(largest, simulation.set<Cloth>().totals().kinetic_energy);
    }
    CHECK(largest < 1.05 * energy);
    CHECK(largest > 0.1 * energy);
}

TEST_CASE("where a sink takes points of a net, what joined them is gone, and the rest goes on", "[lagrangian]") {
    Both simulation = falling_into_cloth(0);
    auto& springs = simulation.set<Cloth>().add_force(
        simulation.set<Cloth>().bodies()[0],
        springs_of<double>(square({{0.25, 0.5, 0.25}}, 0.5, 16), SpringOptions{1, 0}));
    const std::size_t before = springs.size();
    simulation.set<Cloth>().add_sink({{{0, 0, 0}}, {{0.3, 1, 1}}});
    for (int i = 0; i < 20; ++i) simulation.step();
    CHECK(simulation.set<Cloth>().particles().size() == 17 * 15);
    // Two rows of points left: of each kind of link, those that began in them.
    CHECK(springs.size() < before);
    CHECK(std::isfinite(simulation.set<Cloth>().totals().kinetic_energy));
}

TEST_CASE("a state keeps the facets of nets, and a run with forces goes on from it to the same bits", "[lagrangian]") {
    Both whole = falling_into_cloth(2);
    for (int i = 0; i < 25; ++i) whole.step();
    const auto of_cloth = state_of(whole.set<0>());
    const auto of_jelly = state_of(whole.set<1>());
    CHECK(of_cloth.facets.size() == 3 * 2 * 16 * 16);
    for (int i = 0; i < 25; ++i) whole.step();

    Both restored = falling_into_cloth(1);
    restore(restored.set<0>(), of_cloth);
    restore(restored.set<1>(), of_jelly);
    for (int i = 0; i < 25; ++i) restored.step();
    CHECK(state_of(restored.set<0>()).fields == state_of(whole.set<0>()).fields);
    CHECK(state_of(restored.set<1>()).fields == state_of(whole.set<1>()).fields);
    CHECK(state_of(restored.set<0>()).facets == of_cloth.facets);

    // A row of points is taken out: the facets on it are gone, the others name the rows of their points.
    whole.set<Cloth>().remove_if([](const V&, std::uint32_t id) { return id < 17; });
    const auto less = state_of(whole.set<0>());
    CHECK(less.facets.size() == 3 * 2 * 16 * 15);
    for (std::size_t k = 0; k < less.facets.size(); ++k)
        CHECK(less.id[std::size_t(less.facets[k])] == of_cloth.id[std::size_t(of_cloth.facets[k + 3 * 2 * 16])]);
}

TEST_CASE("in the plane a rope carries a block that falls on it, in float", "[lagrangian]") {
    Simulation<2, Materials<NoStress<float>, FixedCorotated<float>>> simulation({{{0, 0}}, {{1, 1}}, 1.0 / 32});
    const Net<2> net = rope<2>({{0.2, 0.5}}, {{0.8, 0.5}}, 64);
    const Body body = simulation.set<NoStress<float>>().add(net, std::vector<double>(65, 0.05));
    simulation.set<NoStress<float>>().add_force(body, springs_of<float>(net, SpringOptions{2e4, 0.5}));
    Anchors<float, 2> ends;
    ends.add({0}, {{{0.2F, 0.5F}}, 2e4F, 1});
    ends.add({64}, {{{0.8F, 0.5F}}, 2e4F, 1});
    simulation.set<NoStress<float>>().add_force(body, std::move(ends));
    simulation.set<FixedCorotated<float>>().add(sample_box<2>({{0.4, 0.55}}, {{0.6, 0.65}}, {.spacing = 1.0 / 64}),
                                                200);
    simulation.advance(0.5);
    const auto block = simulation.set<FixedCorotated<float>>().totals(),
               below = simulation.set<NoStress<float>>().totals();
    // Without it the block would lie on the floor since 0.33 s.
    CHECK(block.first_moment[1] / block.mass > 0.3);
    CHECK(block.first_moment[1] / block.mass > below.first_moment[1] / below.mass);
}

TEST_CASE("nets that do not fit are refused", "[lagrangian]") {
    Both simulation({{{0, 0, 0}}, {{1, 1, 1}}, 1.0 / 16});
    Net<3> net = square({{0.25, 0.5, 0.25}}, 0.5, 2);
    CHECK_THROWS_WITH(simulation.set<Cloth>().add(net, std::vector<double>(3, 1.0)), Catch::Contains("9 points"));
    CHECK_THROWS_AS(simulation.set<Cloth>().add(net, std::vector<double>(9, 0.0)), parameter_error);
    net.positions[4][1] = 2;
    CHECK_THROWS_AS(simulation.set<Cloth>().add(net, masses(net, 1)), particle_error);
    CHECK(simulation.set<Cloth>().particles().size() == 0);
    net.positions[4][1] = 0.5;
    const Body sheet = simulation.set<Cloth>().add(net, masses(net, 1), {{0, 1, 0}});
    CHECK_THROWS_WITH(simulation.set<Cloth>().add_force(
                          sheet, springs_of<double>(net, SpringOptions{.stiffness = 1, .tear_factor = 2})),
                      Catch::Contains("do not tear"));
    Springs<double, 3> beyond;
    beyond.add({0, 9}, {1, 1, 0});
    simulation.set<Cloth>().add_force(sheet, std::move(beyond));
    CHECK_THROWS_WITH(simulation.step(), Catch::Contains("point 9"));
}

}  // namespace coupling_tests
