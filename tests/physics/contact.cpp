/// \file Contact between groups: bars that exchange their velocities, free parting, friction, and a net on jelly. The
/// figures of the verification suite are finer; these tests hold what a program relies on.
#include "support/catch.hpp"
#include <firn/contact/coulomb.hpp>
#include <firn/firn.hpp>
#include <firn/lagrangian.hpp>

#include <algorithm>

namespace contact_tests {

using namespace firn;

namespace {

using Elastic = FixedCorotated<double>;

/// Momentum of a body [kg m/s].
template <class Simulation>
auto momentum_of(const Simulation& simulation, const Body& body) {
    auto sum = Vec<double, Simulation::dimension>::zero();
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot) && body.holds(particles.id(slot)))
            sum += cast<double>(particles.velocity(slot)) * double(particles.mass(slot));
    return sum;
}

/// Two equal bars of 20 cells meet at ±0.01 c, ν = 0.
template <class... Policies>
struct Bars {
    static constexpr double h = 1.0 / 20, speed = 0.01, gap = 0.5 * h;
    SimulationWith<2, Elastic, CoulombContact, Policies...> simulation;
    Body left, right;
    double mass = 4 * h;

    Bars(int group_of_right, const Policies&... policies)
        : simulation({{0, 0}, {4, 4 * h}, h}, Elastic::from_young_poisson(1, 0), CoulombContact{}, mirrored(),
                     policies...) {
        left = simulation.add(sample_box<2>({1 - gap / 2, 0}, {2 - gap / 2, 4 * h}, {.spacing = h / 2}), 1, {speed, 0});
        right =
            simulation.add(sample_box<2>({2 + gap / 2, 0}, {3 + gap / 2, 4 * h}, {.spacing = h / 2}), 1, {-speed, 0});
        if (group_of_right != 0) simulation.set_contact_group(right, group_of_right);
        simulation.contact_impulses.emplace();
        simulation.gravity = {};
        simulation.fixed_time_step = 0.3 * h;
    }
    static Walls<double, 2> mirrored() {
        auto walls = Walls<double, 2>::all({0, 0}, {4, 4 * h}, {Contact::slip, 0});
        walls.nodes_behind = NodesBehind::mirrored;
        return walls;
    }
    /// Returns the speed at which the left bar leaves, over the speed at which it came.
    double restitution(double& tension, double& first, double& impulse) {
        tension = impulse = 0;
        first = -1;
        while (simulation.time() < gap / (2 * speed) + 4) {
            simulation.step();
            const double push = simulation.contact_impulses->on(0, 3)[0];  // on the left bar; negative in compression
            tension = std::max(tension, push);
            impulse += push;
            if (push != 0 && first < 0) first = simulation.time();
        }
        return -momentum_of(simulation, left)[0] / (mass * speed);
    }
};

TEST_CASE("Two bars exchange their velocities, touch when their surfaces meet, and part without traction") {
    double tension = 0, first = 0, impulse = 0;
    Bars<> apic(3);
    const double e = apic.restitution(tension, first, impulse);
    CHECK(e > 0.93);  // a 1D run of an independent program: 0.941
    CHECK(e < 1);
    CHECK(tension == 0);
    CHECK(first == Approx(Bars<>::gap / (2 * Bars<>::speed)).epsilon(0.05));
    CHECK(impulse == Approx(momentum_of(apic.simulation, apic.left)[0] - apic.mass * 0.01).epsilon(1e-9));
    const auto both = momentum_of(apic.simulation, apic.left) + momentum_of(apic.simulation, apic.right);
    CHECK(std::abs(both[0]) < 1e-12 * apic.mass);

#ifndef FIRN_TEST_QUICK
    Bars<Flip<double>> flip(3, Flip<double>{.ratio = 0.99});
    CHECK(flip.restitution(tension, first, impulse) > 0.9);
    CHECK(tension == 0);

    Bars<> one_group(0);  // one field: bodies stick to each other and lose more
    CHECK(one_group.restitution(tension, first, impulse) < e - 0.03);
    CHECK(impulse == 0);
#endif
}

TEST_CASE("A block on a block: friction holds it or lets it slide, and it is lifted off freely", "[slow]") {
    const double h = 1.0 / 40;
    for (const double friction : {0.2, 0.6}) {
        const Domain<2> domain{{0, 0}, {1, 1}, h};
        auto floor = Walls<double, 2>::all({0, 0}, {1, 1}, {Contact::stick, 0});
        Simulation simulation(
            domain, Elastic::from_young_poisson(1e6, 0.3), CoulombContact{.friction = friction}, floor,
            Pic{});  // PIC damps: blocks that swing are held only while their weight rests on each other
        const Body lower = simulation.add(sample_box<2>({0.2, 0}, {0.8, 0.2}, {.spacing = h / 2}), 1000);
        const Body upper = simulation.add(sample_box<2>({0.4, 0.2}, {0.6, 0.4}, {.spacing = h / 2}), 1000);
        simulation.set_contact_group(upper, 1);
        simulation.gravity = {0, -9.81};
        simulation.advance(0.1);  // settles
        simulation.gravity = {0.4 * 9.81, -9.81};
        simulation.advance(0.05);
        simulation.contact_impulses.emplace();
        Vec<double, 2> sum{0, 0};
        for (const double end = simulation.time() + 0.05; simulation.time() < end;) {
            simulation.step();
            sum += simulation.contact_impulses->on(1, 0);
        }
        if (friction < 0.4)  // it slides: Coulomb's law holds in sum
            CHECK(sum[0] == Approx(-friction * sum[1]).epsilon(0.03));
        else  // it is held: friction need not be as large as it can be
            CHECK(std::abs(sum[0]) < 0.9 * friction * sum[1]);
        CHECK(sum[1] > 0);
        // Gravity turned upwards lifts the upper block; the lower one sticks to the floor.
        simulation.gravity = {0, 9.81};
        simulation.advance(0.02);
        const double before = momentum_of(simulation, upper)[1];
        double impulse = 0;
        for (int step = 0; step < 200; ++step) {
            simulation.step();
            impulse = std::max(impulse, norm(simulation.contact_impulses->on(0, 1)));
        }
        CHECK(impulse == 0);
        CHECK(momentum_of(simulation, upper)[1] > before);
        CHECK(lower.count > 0);
    }
}

TEST_CASE("A net falls on jelly as a group of its own, and is lifted off without sticking", "[slow]") {
    const double h = 1.0 / 32;
    using Jelly = NeoHookean<float>;
    const Domain<3> domain{{0, 0, 0}, {1, 1, 1}, h};
    const auto rise = [&](int group_of_net) {
        Simulation simulation(domain, Materials{Jelly::from_young_poisson(2e4, 0.3), NoStress<float>{}},
                              CoulombContact{.friction = 0.1});
        simulation.warn = {};
        auto jelly = simulation.set<0>();
        auto net = simulation.set<1>();
        jelly.add(sample_box<3>({0.3, 0, 0.3}, {0.7, 0.2, 0.7}, {.spacing = h / 2}), 1000);
        const Net<3> sheet = cloth({0.35, 0.21, 0.35}, {0.3, 0, 0}, {0, 0, 0.3}, {20, 20});
        const std::vector<double> masses(sheet.positions.size(), 1e-3);
        const Body points = net.add(sheet, masses);
        if (group_of_net != 0) net.set_contact_group(points, group_of_net);
        simulation.advance(0.1);  // the net comes to rest on the jelly
        const auto height = [&] {
            double sum = 0;
            const auto& particles = simulation.set<1>().particles();
            for (std::size_t slot = 0; slot < particles.slots(); ++slot)
                if (particles.is_particle(slot)) sum += particles.exact_position(slot)[1];
            return sum / double(points.count);
        };
        const double rested = height();
        double top = 0;
        for (std::size_t slot = 0; slot < jelly.particles().slots(); ++slot)
            if (jelly.particles().is_particle(slot))
                top = std::max(top, jelly.particles().exact_position(slot)[1] + h / 4);
        CHECK(std::abs(rested - top) < h);  // it lies on the jelly
        net.add_load(points, [](const Vec<double, 3>&, double) { return Vec<double, 3>{0, 0.02, 0}; });  // 2 m g
        simulation.advance(0.1);
        return height() - rested;
    };
    const double free = 0.5 * (0.02 / 1e-3 - 9.81) * 0.1 * 0.1;  // ½ a t²
    CHECK(rise(1) == Approx(free).epsilon(0.1));
    CHECK(rise(0) < 0.5 * free);  // one field holds the net
}

TEST_CASE("Groups and bodies that do not exist are refused") {
    Simulation simulation(Domain<2>{{0, 0}, {1, 1}, 1.0 / 16}, Elastic::from_young_poisson(1e5, 0.3), CoulombContact{});
    const Body body = simulation.add(sample_box<2>({0.4, 0.4}, {0.6, 0.6}, {.spacing = 1.0 / 32}), 1000);
    CHECK_THROWS_AS(simulation.set_contact_group(body, -1), parameter_error);
    CHECK_THROWS_AS(simulation.set_contact_group(body, most_contact_groups(simulation.domain())), parameter_error);
    CHECK_THROWS_AS(simulation.set_contact_group(Body{}, 1), parameter_error);
    CHECK_THROWS_AS(simulation.set_contact_group(Body{body.count, 4}, 1), parameter_error);
    simulation.contact.friction = -1;
    CHECK_THROWS_AS(simulation.step(), parameter_error);
    simulation.contact.friction = 0;
    simulation.set_contact_group(body, most_contact_groups(simulation.domain()) - 1);
    CHECK(simulation.bodies()[0].contact_group == most_contact_groups(simulation.domain()) - 1);
    auto& particles = simulation.edit_particles();
    particles.set_position(0, {0.5, 0.5});
    CHECK(particles.contact_group(0) == simulation.bodies()[0].contact_group);
    CHECK(particles.exact_position(0)[0] == Approx(0.5));
    simulation.set_contact_group(4);
    for (int step = 0; step < 5; ++step) simulation.step();
    CHECK(simulation.particles().contact_group(0) == 4);
}

}  // namespace

}  // namespace contact_tests
