// quick: no
// sanitized: -O1
/// \file Implicit and quasi-static steps of several materials, and of particles that come and go.
#include "support/catch.hpp"
#include <firn/firn.hpp>
#include <firn/implicit.hpp>

namespace implicit_sets_tests {
using namespace firn;

TEMPLATE_TEST_CASE("Two materials on each other settle as their moduli say, and the floor bears both", "[implicit]",
                   OwnVolume, FBar) {
    // A column of 1 m between smooth walls: Hencky below 0.5 m, neo-Hookean of half the stiffness above.
    const double h = 0.05, weight = 1000 * 9.81, below = 1e7, above = 5e6, poisson = 0.3;
    const Domain<2> domain({-4 * h, -4 * h}, {8 * h, 1 + 8 * h}, h);
    auto walls = Walls<double, 2>::all({0, 0}, {4 * h, domain.upper[1]}, {Contact::slip, 0});
    walls.at_lower[1].contact = Contact::stick;
    walls.at_upper[1].contact = Contact::none;
    walls.nodes_behind = NodesBehind::mirrored;
    const Materials materials(Hencky<double>::from_young_poisson(below, poisson),
                              NeoHookean<double>::from_young_poisson(above, poisson));
    Simulation column(domain, materials, walls, TestType{}, WeightGradientForce{}, QuasiStatic{});
    column.warn = {};
    column.template set<Hencky<double>>().add(sample_box<2>({0, 0}, {4 * h, 0.5}, {.spacing = h / 2}), 1000);
    column.template set<NeoHookean<double>>().add(sample_box<2>({0, 0.5}, {4 * h, 1}, {.spacing = h / 2}), 1000);
    column.integration.newton.tolerance = 1e-8;
    column.reactions.emplace();
    column.advance(1);
    CHECK(column.solution.halvings == 0);
    // The mean height of each half, less that before: −∫ ρ g (1 − y)/M dy up to the height, averaged over the half.
    const double per_young = (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson));  // oedometric over Young's modulus
    const auto settled = [&](double y, double young) { return weight / (young * per_young) * (y - y * y / 2); };
    const auto mean = [](const auto& f) { return (f(0.0) + 4 * f(0.25) + f(0.5)) / 6; };  // exact: f is quadratic
    const double of_lower = mean([&](double y) { return settled(y, below); }),
                 of_upper = settled(0.5, below) +
                            mean([&](double y) { return settled(0.5 + y, above) - settled(0.5, above); });
    const auto mean_height = [](const auto& set) {
        double sum = 0;
        for (std::size_t slot = 0; slot < set.particles().slots(); ++slot)
            if (set.particles().is_particle(slot)) sum += set.particles().exact_position(slot)[1];
        return sum / double(set.particles().size());
    };
    CHECK(0.25 - mean_height(column.template set<Hencky<double>>()) == Approx(of_lower).epsilon(5e-3));
    CHECK(0.75 - mean_height(column.template set<NeoHookean<double>>()) == Approx(of_upper).epsilon(5e-3));
    Vec<double, 2> sum{};
    for (const auto& part : column.reactions->parts) sum += part.impulse;
    CHECK(sum[1] == Approx(4 * h * weight).epsilon(1e-6));
}

TEST_CASE("What a source gives falls by implicit steps, and goes in a sink", "[implicit]") {
    const double h = 0.1, dt = 0.02;
    const Domain<2> domain({0, 0}, {2, 3}, h);
    Simulation simulation(domain, NeoHookean<double>::from_young_poisson(1e6, 0.3), WeightGradientForce{}, Implicit{});
    simulation.warn = {};
    const Samples<2> drop = sample_box<2>({0.85, 2.3}, {1.15, 2.6}, {.spacing = h / 2});
    simulation.add_source({.samples = drop, .density = 1000, .velocity = {0.0, -1.0}, .rate = 2});
    simulation.fixed_time_step = dt;
    simulation.advance(0.4);
    REQUIRE(simulation.particles().size() == drop.positions.size());
    // Backward Euler: after n steps the speed is that of free fall.
    const auto totals = simulation.totals();
    CHECK(totals.mass == Approx(1000 * 0.3 * 0.3));
    const double speed = totals.momentum[1] / totals.mass;
    CHECK(speed == Approx(-1 - 9.81 * 0.4).epsilon(1e-3));
    simulation.add_sink({{0.0, 0.0}, {2.0, 2.1}});
    simulation.advance(0.02);
    CHECK(simulation.particles().size() == 0);
    simulation.advance(0.18);  // the next burst, at 0.5 s, has fallen for 0.1 s
    CHECK(simulation.particles().size() == drop.positions.size());
}

}  // namespace implicit_sets_tests
