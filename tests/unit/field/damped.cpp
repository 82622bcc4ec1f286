/// \file Viscous damping: the motion of ẋ = v, v̇ = g − c v, from one node to a body in a simulation.
#include "support/catch.hpp"
#include "support/each_scalar.hpp"
#include <firn/boundary/walls.hpp>
#include <firn/field/attraction.hpp>
#include <firn/field/damped.hpp>
#include <firn/loops/g2p.hpp>
#include <firn/simulation.hpp>

using namespace firn;

TEMPLATE_TEST_CASE_SIG("a node's velocity falls by 1 / (1 + c dt) a step, whatever c, and to g / c", "[field]",
                       ((int D), D), 2, 3) {
    using V = Vec<double, D>;
    const V x = V::filled(0.5), v = V::filled(2);
    for (const double rate : {0.0, 0.1, 10.0, 1e6}) {
        const Damped<double, D> damping{{}, rate};
        const V after = node_velocity(v * 3.0, 3.0, x, damping, 0.1, NoBoundary{});
        CHECK(norm(after - v * (1 / (1 + 0.1 * rate))) <= 1e-15 * norm(v));
    }
    const V g = V::filled(-9.81);
    const Damped<double, D> falling{{g}, 5};
    V now = V::zero();
    for (int i = 0; i < 400; ++i) now = node_velocity(now * 3.0, 3.0, x, falling, 0.1, NoBoundary{});
    CHECK(norm(now - g * (1 / 5.0)) <= 1e-12);
    // Without a rate it is the field alone.
    const Attraction<double, D> pull{.centre = V::filled(0.45), .strength = 7};
    const Damped<double, D, Attraction> undamped{pull, 0};
    CHECK(node_velocity(v, 1.0, x, undamped, 0.1, NoBoundary{}) == node_velocity(v, 1.0, x, pull, 0.1, NoBoundary{}));
}

TEMPLATE_TEST_CASE("damping is the same for every scalar", "[field]", FIRN_EVERY_SCALAR) {
    test_support::Random random(70);
    std::vector<std::vector<double>> cases;
    for (int i = 0; i < 40; ++i) {
        cases.push_back({});
        for (int k = 0; k < 8; ++k) cases.back().push_back(random.uniform(-1, 1));
    }
    const auto definition = []<class S>(const S* in) {
        test_support::Reader<S> read{in};
        const Damped<S, 3> damping{{read.template vector<3>()}, S(0.7)};
        const auto v = read.template vector<3>();
        return test_support::Numbers<S>{}.add(damping(Vec<S, 3>::zero(), v, S(0.3)));
    };
    test_support::same_as_double<TestType>(definition, cases, [](const double*) { return 2.0; }, 8);
}

TEST_CASE("a body in free flight slows down as exp(−c t), and comes v/c far", "[field]") {
    Simulation<2, FixedCorotated<double>> simulation({{0.0, 0.0}, {2.0, 1.0}, 1.0 / 20},
                                                     FixedCorotated<double>::from_young_poisson(1e4, 0.3));
    simulation.gravity = {};
    simulation.add(sample_box<2>({0.2, 0.4}, {0.4, 0.6}, {.spacing = 1.0 / 40}), 1000, {2.0, 0.0});
    simulation.fixed_time_step = 1e-3;
    const auto centre = [&] {
        Vec<double, 2> sum{};
        std::size_t count = 0;
        for (std::size_t slot = 0; slot < simulation.particles().slots(); ++slot)
            if (simulation.particles().is_particle(slot)) {
                sum += simulation.particles().exact_position(slot);
                ++count;
            }
        return sum * (1.0 / double(count));
    };
    const auto start = centre();
    const double rate = 4;
    for (int i = 0; i < 500; ++i) simulation.step(Damped<double, 2>{{}, rate});
    const auto way = centre() - start;
    // Exactly: of the scheme Σ dt v₀ (1 + c dt)⁻ⁿ, of the equation v₀/c (1 − exp(−c t)).
    CHECK(way[0] == Approx(2 / rate * (1 - std::pow(1 + rate * 1e-3, -500))).epsilon(1e-10));
    CHECK(way[0] == Approx(2 / rate * (1 - std::exp(-rate * 0.5))).epsilon(2e-3));
    CHECK(std::abs(way[1]) <= 1e-12);
}

TEST_CASE("a rate of damping that cannot be is refused", "[field][error]") {
    for (const double rate : {-1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
        CHECK_THROWS_AS(lift<float>(Damped<double, 2>{{}, rate}), parameter_error);
    Attraction<double, 2> wrong{};
    wrong.radius = -1;
    CHECK_THROWS_AS(lift<float>(Damped<double, 2, Attraction>{wrong, 1}), parameter_error);
}

TEST_CASE("a field that takes the place of gravity and has none is warned of, once", "[field]") {
    const auto warnings = [](auto field, const Vec<double, 2>& gravity) {
        Simulation<2> simulation({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 16}, {});
        std::vector<std::string> said;
        simulation.warn = [&](const std::string& text) { said.push_back(text); };
        simulation.gravity = gravity;
        simulation.add(sample_box<2>({0.3, 0.3}, {0.5, 0.5}, {.spacing = 1.0 / 32}), 1000);
        for (int i = 0; i < 2; ++i) simulation.step(field);
        return said;
    };
    const Vec<double, 2> down{0, -9.81}, none{0, 0};
    const auto damped = warnings(Damped<float, 2>{.rate = 10}, down);
    REQUIRE(damped.size() == 1);
    CHECK(damped[0].find("replaces the simulation's gravity of (0, -9.81) m/s^2, and has none") != std::string::npos);
    CHECK(warnings(Attraction<float, 2>{.strength = 1}, down).size() == 1);
    CHECK(warnings(Damped<float, 2, Attraction>{.rate = 10}, down).size() == 1);
    CHECK(warnings(Damped<float, 2>{.rate = 10}, none).empty());
    CHECK(warnings(Damped<float, 2>{.field = {{0, -9.81F}}, .rate = 10}, down).empty());
    CHECK(warnings(Gravity<float, 2>{}, down).empty());  // it says what it is
    CHECK(warnings(none, down).empty());
}
