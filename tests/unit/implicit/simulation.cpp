// quick: no
// sanitized: -O1
/// \file Simulations whose steps are quasi-static or implicit: equilibrium, reactions, loads, steps that are halved,
/// errors, threads.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/firn.hpp>
#include <firn/implicit.hpp>

#include "../../../benchmarks/implicit/slope.hpp"

namespace implicit_simulation_tests {
using namespace firn;

/// A domain that is open around a floor at y = 0 and, if there are any, walls at x = 0 and x = width.
Walls<double, 2> floor_and_sides(const Domain<2>& domain, double width, Contact below = Contact::stick) {
    auto walls = Walls<double, 2>::all({0, 0}, {width, domain.upper[1]}, {Contact::slip, 0});
    walls.at_lower[1].contact = below;
    walls.at_upper[1].contact = Contact::none;
    return walls;
}

template <class Simulation, class F>
void for_particles(const Simulation& simulation, const F& f) {
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) f(slot);
}
/// A column of 4 × 20 cells between smooth walls, 1 m high.
template <class Material, class... Policies>
auto column(const Material& material, const Policies&... policies) {
    const double h = 0.05;
    const Domain<2> domain({-4 * h, -4 * h}, {8 * h, 1 + 8 * h}, h);
    Simulation simulation(domain, material, floor_and_sides(domain, 4 * h), policies...);
    simulation.warn = {};
    simulation.add(sample_box<2>({0, 0}, {4 * h, 1}, {.spacing = h / 2}), 1000);
    return simulation;
}
constexpr double young = 1e7, poisson = 0.3;
const double oedometric = young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson));

/// Checks the vertical stress against the weight above, −ρ g (1 − y), four cells from the floor and the surface.
template <class Simulation>
void check_geostatic(const Simulation& simulation, double tolerance) {
    double worst = 0;
    for_particles(simulation, [&](std::size_t slot) {
        const double y = simulation.particles().exact_position(slot)[1];
        if (y < 0.2 || y > 0.8) return;
        const double stress = double(simulation.particles().stress(slot)(1, 1));
        worst = std::max(worst, std::abs(stress + 1000 * 9.81 * (1 - y)) / (1000 * 9.81));
    });
    CHECK(worst < tolerance);
}

TEMPLATE_TEST_CASE("A column under its weight: stress, settlement and reaction are those of equilibrium", "[implicit]",
                   MlsForce, WeightGradientForce) {
    auto simulation = column(Hencky<double>::from_young_poisson(young, poisson), QuasiStatic{}, TestType{});
    simulation.integration.newton.tolerance = 1e-8;
    simulation.reactions.emplace();
    std::vector<double> before(simulation.particles().size());
    for_particles(simulation, [&](std::size_t slot) {
        before[simulation.particles().id(slot)] = simulation.particles().exact_position(slot)[1];
    });
    simulation.advance(1);
    CHECK(simulation.time() == 1);
    CHECK(simulation.steps() == 1);
    CHECK(simulation.solution.has_converged);
    CHECK(simulation.solution.halvings == 0);
    check_geostatic(simulation, 2e-2);
    // Settlements ρ g (y − y²/2)/M by the theory of small strains. The surface is known to a cell, a 20th of the
    // height.
    double worst = 0;
    for_particles(simulation, [&](std::size_t slot) {
        const double y = before[simulation.particles().id(slot)],
                     u = simulation.particles().exact_position(slot)[1] - y;
        worst = std::max(worst, std::abs(u + 1000 * 9.81 * (y - y * y / 2) / oedometric));
        CHECK(simulation.particles().velocity(slot) == Vec<double, 2>::zero());
    });
    CHECK(worst < 0.05 * 1000 * 9.81 / 2 / oedometric);
    // The floor bears the weight of the column for 1 s, and the smooth walls push with ν/(1 − ν) of the stress.
    const auto& parts = simulation.reactions->parts;
    Vec<double, 2> sum{};
    for (const auto& part : parts) sum += part.impulse;
    CHECK(sum[1] == Approx(0.2 * 1000 * 9.81).epsilon(1e-6));
    CHECK(std::abs(sum[0]) < 1e-6 * 0.2 * 1000 * 9.81);
}

TEST_CASE("Loads act as weights do, and bring their reactions along", "[implicit]") {
    auto simulation = column(Hencky<double>::from_young_poisson(young, poisson), QuasiStatic{});
    simulation.integration.newton.tolerance = 1e-8;
    simulation.gravity = Vec<double, 2>::zero();
    const double force = 1000 * 9.81 * 0.025 * 0.025;
    const LoadId load = simulation.add_load(
        simulation.bodies()[0], [&](const Vec<double, 2>&, double time) { return Vec<double, 2>{0, -force * time}; });
    simulation.reactions.emplace();
    simulation.fixed_time_step = 0.5;
    simulation.advance(1);
    CHECK(simulation.steps() == 2);
    check_geostatic(simulation, 2e-2);
    const auto& of_load = simulation.reactions->of(load).impulse;
    CHECK(of_load[1] == Approx(-0.5 * 0.2 * 1000 * 9.81).epsilon(1e-12));
    Vec<double, 2> sum = of_load;
    for (const auto& part : simulation.reactions->parts) sum += part.impulse;
    CHECK(std::abs(sum[1]) < 1e-6 * std::abs(of_load[1]));
    for_particles(simulation,
                  [&](std::size_t slot) { CHECK(simulation.particles().velocity(slot) == Vec<double, 2>::zero()); });
}

TEST_CASE("A moving wall presses a block, and the stress is that of its strain", "[implicit]") {
    const double h = 0.05;
    const Domain<2> domain({-4 * h, -4 * h}, {8 * h, 1 + 8 * h}, h);
    auto walls = floor_and_sides(domain, 4 * h);
    Simulation simulation(
        domain, NeoHookean<double>::from_young_poisson(young, poisson),
        Together(walls,
                 Collider<Box<double, 2>>{.shape = {{0.5, 0.1}}, .contact = Contact::stick, .position = {0.1, 1.1}}),
        QuasiStatic{}, WeightGradientForce{});
    simulation.warn = {};
    simulation.add(sample_box<2>({0, 0}, {4 * h, 1}, {.spacing = h / 2}), 1000);
    simulation.gravity = Vec<double, 2>::zero();
    std::get<1>(simulation.boundary.parts).linear_velocity = {0, -0.1};
    simulation.integration.newton.tolerance = 1e-10;
    simulation.advance(0.5);
    double lowest = 1, highest = -1;
    for_particles(simulation, [&](std::size_t slot) {
        const double y = simulation.particles().exact_position(slot)[1];
        if (y < 0.4 || y > 0.6) return;
        const double F = simulation.particles().state(slot).F(1, 1);
        lowest = std::min(lowest, F), highest = std::max(highest, F);
    });
    // The matter is held somewhere between the surfaces, 1 m apart, and the outermost held nodes, 0.95 m apart.
    CHECK(highest - lowest < 1e-4);
    CHECK(lowest > 1 - 0.05 / 0.95);
    CHECK(highest < 1 - 0.05);
}

/// A block of 8 × 8 cells that flies, 0.4 m wide.
template <class S, class... Policies>
auto flying(const Policies&... policies) {
    const double h = 0.05;
    const Domain<2> domain({0, 0}, {3, 3}, h);
    Simulation simulation(domain, FixedCorotated<S>::from_young_poisson(S(1e6), S(0.3)),
                          Walls<S, 2>::all({0, 0}, {3, 3}, {Contact::stick}), Implicit{}, policies...);
    simulation.add(sample_box<2>({1, 1}, {1.4, 1.4}, {.spacing = h / 2}), 1000, {0.5, 2});
    return simulation;
}

template <class Simulation>
Vec<double, 2> centre(const Simulation& simulation) {
    Vec<double, 2> sum{};
    for_particles(simulation, [&](std::size_t slot) { sum += simulation.particles().exact_position(slot); });
    return sum * (1 / double(simulation.particles().size()));
}

TEMPLATE_TEST_CASE("A flying block falls as backward Euler says, by steps of many bounds", "[implicit]", float,
                   double) {
    auto simulation = flying<TestType>(Flip<TestType>{1});
    const double bound = simulation.stable_time_step();
    simulation.fixed_time_step = 0.01;
    CHECK(simulation.fixed_time_step > 5 * bound);
    const Vec<double, 2> before = centre(simulation);
    simulation.advance(0.2);
    CHECK(simulation.steps() == 20);
    const double t = 0.2, rounding = sizeof(TestType) == 4 ? 2e-5 : 1e-10;
    CHECK(std::abs(centre(simulation)[0] - before[0] - 0.5 * t) < rounding);
    CHECK(std::abs(centre(simulation)[1] - before[1] - 2 * t + 0.5 * 9.81 * t * (t + 0.01)) < rounding);
    for_particles(simulation, [&](std::size_t slot) {
        const auto v = simulation.particles().velocity(slot);
        CHECK(std::abs(double(v[0]) - 0.5) < 10 * rounding);
        CHECK(std::abs(double(v[1]) - 2 + 9.81 * t) < 10 * rounding);
    });
}

TEST_CASE("A step that would move matter too far is halved; steps by motion end where they should", "[implicit]") {
    auto simulation = flying<double>();
    simulation.fixed_time_step = 0.05;  // 2 cells
    simulation.step();
    CHECK(simulation.time() == Approx(0.05).epsilon(1e-14));
    CHECK(simulation.steps() >= 4);
    CHECK(simulation.solution.largest_motion <= 0.5);
    simulation.fixed_time_step = 0;
    simulation.advance(0.1);
    CHECK(simulation.time() == Approx(0.15).epsilon(1e-14));
    CHECK(simulation.solution.largest_motion <= 0.5);
}

TEST_CASE("A load drives a flying block, also where its step is halved", "[implicit]") {
    auto simulation = flying<double>();
    simulation.gravity = {};
    const double force = 0.5, mass = 0.4 * 0.4 * 1000, count = double(simulation.particles().size());
    const LoadId load = simulation.add_load(simulation.bodies()[0],
                                            [&](const Vec<double, 2>&, double) { return Vec<double, 2>{force, 0}; });
    simulation.reactions.emplace();
    simulation.fixed_time_step = 0.02;  // 0.8 cells
    simulation.step();
    CHECK(simulation.steps() == 2);
    CHECK(simulation.last_time_step() == Approx(0.01).epsilon(1e-12));
    const Vec<double, 2> impulse = simulation.reactions->of(load).impulse;
    CHECK(impulse[0] == Approx(count * force * 0.01).epsilon(1e-12));
    Vec<double, 2> momentum{};
    for_particles(simulation, [&](std::size_t slot) {
        momentum += simulation.particles().velocity(slot) * simulation.particles().mass(slot);
    });
    CHECK(momentum[0] == Approx(0.5 * mass + count * force * 0.02).epsilon(1e-9));
    CHECK(momentum[1] == Approx(2 * mass).epsilon(1e-9));
}

TEST_CASE("The same bits for any number of threads", "[implicit]") {
    std::vector<Vec<double, 2>> expected;
    for (const int threads : {1, 2, 3, 4, 7}) {
        auto simulation = column(Hencky<double>::from_young_poisson(1e5, poisson), QuasiStatic{}, Coloured{threads});
        simulation.advance(1);
        std::vector<Vec<double, 2>> found;
        for_particles(simulation,
                      [&](std::size_t slot) { found.push_back(simulation.particles().exact_position(slot)); });
        if (threads == 1) expected = found;
        CHECK(found == expected);
    }
}

TEST_CASE("A load step that is too large is halved, and ends at the same equilibrium", "[implicit]") {
    const auto top = [](int iterations) {
        auto simulation = column(NeoHookean<double>::from_young_poisson(5e4, poisson), QuasiStatic{});
        simulation.integration.newton = {.tolerance = 1e-8, .iterations = iterations};
        simulation.advance(1);
        simulation.advance(1);  // on the grid's nodes around the settled matter
        double highest = 0;
        for_particles(simulation, [&](std::size_t slot) {
            highest = std::max(highest, simulation.particles().exact_position(slot)[1]);
        });
        return std::pair(simulation.steps(), highest);
    };
    const auto [steps, highest] = top(30);
    const auto [more_steps, same] = top(3);
    CHECK(steps == 2);
    CHECK(more_steps > 3);
    CHECK(highest < 0.95);
    CHECK(std::abs(highest - same) < 2e-3 * (1 - highest));
}

/// A block of 8 × 4 cells that lies on a rough floor, from which it may lift off.
template <class Time, class Force = WeightGradientForce>
auto on_rough_floor(double friction, double angle, double g = 9.81) {
    const double h = 0.05;
    const Domain<2> domain({-8 * h, -4 * h}, {24 * h, 12 * h}, h);
    auto walls = Walls<double, 2>::all({-8 * h, 0}, {24 * h, 12 * h}, {Contact::separate, 0});
    walls.at_lower[1].friction = friction;
    Simulation simulation(domain, NeoHookean<double>::from_young_poisson(1e6, 0.3), walls, Force{}, Time{},
                          Flip<double>{1});
    simulation.warn = {};
    simulation.add(sample_box<2>({0, 0}, {8 * h, 4 * h}, {.spacing = h / 2}), 1000);
    simulation.gravity = {g * std::sin(angle), -g * std::cos(angle)};
    simulation.integration.newton.tolerance = 1e-6;
    simulation.reactions.emplace();
    return simulation;
}
/// What the floor and the walls exert, in parts of the weight.
template <class Simulation>
Vec<double, 2> reaction(const Simulation& simulation) {
    Vec<double, 2> sum{};
    for (const auto& part : simulation.reactions->parts) sum += part.impulse;
    return sum * (1 / (simulation.last_time_step() * 0.4 * 0.2 * 1000 * 9.81));
}

TEMPLATE_TEST_CASE("A rough floor holds a block up to the angle of friction, tan α = μ", "[implicit]", MlsForce,
                   WeightGradientForce) {
    for (const double angle : {0.2, 0.42}) {  // the angle of friction is 0.464
        auto simulation = on_rough_floor<QuasiStatic, TestType>(0.5, angle);
        for (int step = 0; step < 2; ++step) {
            simulation.advance(1);
            CHECK(simulation.solution.has_settled);
            CHECK(simulation.solution.halvings == 0);
            CHECK(std::abs(reaction(simulation)[0] + std::sin(angle)) < 1e-5);
            CHECK(std::abs(reaction(simulation)[1] - std::cos(angle)) < 1e-5);
        }
    }
    auto simulation = on_rough_floor<QuasiStatic, TestType>(0.5, 0.5);
    simulation.integration.most_halvings = 0;
    simulation.integration.newton.iterations = 5;
    CHECK_THROWS_AS(simulation.advance(1), convergence_error);
}

TEST_CASE("A block slides down a rough floor as Coulomb says, and flies off where gravity points up", "[implicit]") {
    const double mu = 0.3, angle = 0.6;
    auto simulation = on_rough_floor<Implicit>(mu, angle);
    simulation.fixed_time_step = 0.01;
    simulation.advance(0.2);  // the block has come to rest on the floor, and slides
    const auto speed = [&] {
        double sum = 0;
        for_particles(simulation, [&](std::size_t slot) { sum += simulation.particles().velocity(slot)[0]; });
        return sum / double(simulation.particles().size());
    };
    const double before = speed();
    Vec<double, 2> mean{};
    for (int step = 0; step < 10; ++step) {
        simulation.step();
        const Vec<double, 2> now = reaction(simulation);
        CHECK(std::abs(now[0] + mu * now[1]) < 1e-3);
        mean += now * 0.1;
    }
    CHECK(std::abs(mean[1] - std::cos(angle)) < 0.02);
    CHECK(speed() - before == Approx(0.1 * 9.81 * (std::sin(angle) - mu * std::cos(angle))).epsilon(0.03));

    auto up = on_rough_floor<Implicit>(mu, 0, -9.81);
    up.fixed_time_step = 0.01;
    up.advance(0.1);
    CHECK(norm(reaction(up)) == 0);
    CHECK(centre(up)[1] - 0.1 == Approx(0.5 * 9.81 * 0.1 * 0.11).epsilon(1e-6));
}

TEST_CASE("A slope of sand takes few products with the Hessian, as its smoothers do not diverge", "[implicit]") {
    // 35° steep, of sand with an angle of friction of 40°. Where it begins to flow, the largest eigenvalues of coarse
    // matrices are hard to find; smoothers that take them for too small made 772 products of 12.
    for (const int cells : {32, 64}) {
        const double h = 1.0 / cells;
        const Domain<2> domain({-8 * h, -8 * h}, {1 + 8 * h, 0.5 + 8 * h}, h);
        auto walls = Walls<double, 2>::all({0.01 * h, 0.01 * h}, {1 - 0.01 * h, 0.5 + 7 * h}, {Contact::slip, 0});
        walls.at_lower[1].contact = Contact::stick;
        Simulation simulation(domain, Sand<double>::from_properties({.young = 1e7, .friction_angle = degrees(40)}),
                              walls, WeightGradientForce{}, QuasiStatic{});
        simulation.warn = {};
        Samples<2> sand;
        for (const auto& x :
             sample_box<2>({0.0, 0.0}, {1.0, 0.5}, {.spacing = h / 2, .pattern = Pattern::jittered, .jitter = 0.25})
                 .positions)
            if (x[1] < surface(x[0])) sand.positions.push_back(x);
        sand.volume = h * h / 4;
        simulation.add(sand, 1000);
        simulation.advance(1);
        CHECK(simulation.solution.halvings == 0);
        CHECK(simulation.solution.products <= 40);
    }
}

TEST_CASE("What cannot be solved is told, and nothing is lost", "[implicit]") {
    SECTION("no equilibrium") {
        auto simulation = column(NeoHookean<double>::from_young_poisson(10, poisson), QuasiStatic{});
        simulation.integration.most_halvings = 1;
        simulation.integration.newton.iterations = 3;
        const Vec<double, 2> before = centre(simulation);
        test_support::check_refused<convergence_error>([&] { simulation.advance(1); },
                                                       "does not converge, not even in a part of 0.5 s");
        CHECK(simulation.time() == 0);
        CHECK(norm(centre(simulation) - before) < 1e-15);
        simulation.gravity = {0, -1e-4};  // the simulation goes on
        simulation.advance(1);
        CHECK(simulation.time() == 1);
    }
    SECTION("too far") {
        auto simulation = flying<double>();
        simulation.integration.most_halvings = 1;
        simulation.fixed_time_step = 0.1;
        test_support::check_refused<convergence_error>([&] { simulation.step(); }, "moves a node by");
    }
    SECTION("no length of a step") {
        auto simulation = column(Hencky<double>::from_young_poisson(young, poisson), QuasiStatic{});
        test_support::check_refused<parameter_error>([&] { simulation.step(); }, "Nothing says how long");
        simulation.fixed_time_step = -1;
        CHECK_THROWS_AS(simulation.step(), parameter_error);
    }
    SECTION("a tolerance below rounding") {
        for (const double tolerance : {1e-4, 1e-7}) {
            Simulation simulation(Domain<2>({-1, -0.25}, {2, 2}, 1. / 32),
                                  NeoHookean<float>::from_young_poisson(1e6F, 0.3F),
                                  Walls<float, 2>::all({-1, 0}, {2, 2}, {Contact::stick}), QuasiStatic{});
            simulation.warn = {};
            simulation.add(sample_box<2>({0, 0}, {1, 1}, {.spacing = 1. / 64}), 1000);
            simulation.integration.newton.tolerance = tolerance;
            if (tolerance == 1e-4) {
                simulation.advance(1);
                continue;
            }
            test_support::check_refused<convergence_error>([&] { simulation.advance(1); },
                                                           "rounding hides what steps change");
            const NewtonReport& newton = simulation.solution.newton;
            CHECK(newton.end == NewtonEnd::rounded);
            CHECK(newton.steps() < 8);
            CHECK(simulation.solution.halvings == 0);
            // Rounding is found to a small factor, and so is the tolerance that the error asks for.
            CHECK(newton.residuals.back() > 0.05 * newton.rounding);
            simulation.integration.newton.tolerance = newton.rounding;
            simulation.advance(1);
        }
    }
    SECTION("parameters") {
        auto simulation = column(Hencky<double>::from_young_poisson(young, poisson), QuasiStatic{});
        simulation.integration.newton.tolerance = -1;
        test_support::check_refused<parameter_error>([&] { simulation.advance(1); }, "tolerance");
    }
}

}  // namespace implicit_simulation_tests
