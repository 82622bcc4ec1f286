/// \file The bound of the time step by accelerations: matter without stiffness flies as a stone does, whatever
/// accelerates it; a run that is bounded by its waves keeps its bits; and a restart goes on to the same bits.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/message.hpp"
#include "support/scenes.hpp"
#include <firn/io/restart.hpp>
#include <firn/lagrangian/point_forces.hpp>

using namespace firn;
using test_support::holds;
using test_support::message;

namespace acceleration_tests {

namespace {

constexpr double h = 1.0 / 32;
template <int D>
Domain<D> tall_box() {
    Domain<D> box{Vec<double, D>::zero(), Vec<double, D>::filled(0.5), h};
    box.upper[1] = 2;
    return box;
}
template <int D>
Samples<D> block(double bottom = 1.5) {
    Vec<double, D> lower = Vec<double, D>::filled(0.2), upper = Vec<double, D>::filled(0.325);
    lower[1] = bottom;
    upper[1] = bottom + 0.125;
    return sample_box<D>(lower, upper, {.spacing = h / 2});
}
template <class Simulation>
double height(const Simulation& simulation) {
    const auto totals = simulation.totals();
    return totals.first_moment[1] / totals.mass;
}

/// Drops a block for 0.3 s by `fall(simulation, duration)`, and compares with −a t²/2. Symplectic Euler gives each step
/// the velocity of its end: at most a t dt/2 too low, and the bound is dt = ¼ √(h/a).
template <int D, class Material, class Prepare, class Fall>
void check_fall(const Material& material, double a, const Prepare& prepare, const Fall& fall) {
    Simulation<D, Material> simulation(tall_box<D>(), material);
    simulation.gravity = {};
    const Body body = simulation.add(block<D>(), 1000);
    prepare(simulation, body);
    const double from = height(simulation), t = 0.3;
    fall(simulation, t);
    const double right = -0.5 * a * t * t;
    CAPTURE(D, Material::name, simulation.steps(), height(simulation) - from, right);
    CHECK(height(simulation) - from == Approx(right).margin(t * std::sqrt(a * h) / 8 * 1.001));
    CHECK(double(simulation.steps()) <= t / (0.25 * std::sqrt(h / a)) * 1.35 + 2);  // and no more steps than needed
}

constexpr double g = 9.81;
const auto nothing = [](auto&, const Body&) {};

/// Falls by each way to accelerate matter.
template <int D, class Material>
void check_all_falls(const Material& material) {
    const auto advance = [](auto& simulation, double t) { simulation.advance(t); };
    check_fall<D>(material, g, [](auto& simulation, const Body&) { simulation.gravity[1] = -g; }, advance);
    Vec<double, D> down{};
    down[1] = -g;
    check_fall<D>(material, g, nothing, [&](auto& simulation, double t) { simulation.advance(t, down); });
    const auto field = [](const auto& x) {
        auto a = x * 0.0F;
        a.v[1] = a.v[1] - float(g);
        return a;
    };
    check_fall<D>(material, g, nothing, [&](auto& simulation, double t) { simulation.advance(t, field); });
    const Damped<float, D> damped{{cast<float>(down)}, 0};
    check_fall<D>(material, g, nothing, [&](auto& simulation, double t) { simulation.advance(t, damped); });
    const auto load = [&](auto& simulation, const Body& body) {
        const double mass = 1000 * std::pow(h / 2, D);
        simulation.add_load(body, [=](const Vec<double, D>&, double) { return down * mass; });
    };
    check_fall<D>(material, g, load, advance);
    const auto two_loads = [&](auto& simulation, const Body& body) {
        const double mass = 1000 * std::pow(h / 2, D);
        for (int i = 0; i < 2; ++i)
            simulation.add_load(body, [=](const Vec<double, D>&, double) { return down * (mass / 2); });
    };
    check_fall<D>(material, g, two_loads, advance);
    const auto force = [&](auto& simulation, const Body& body) {
        simulation.add_force(
            body, ForceOnEach{[=](const auto& points, std::size_t i) { return cast<float>(down) * points.mass[i]; }});
    };
    check_fall<D>(material, g, force, advance);
}

}  // namespace

TEST_CASE("the bound of an acceleration is a quarter of √(h/a): matter at rest moves by h/16") {
    CHECK(acceleration_time_step(0.04, 1.0) == 0.05);
    CHECK(acceleration_time_step(0.04F, 4.0F) == 0.025F);
    CHECK(stable_time_step<QuadraticBSpline>(0.04, 1000.0, 1.0) == stable_time_step<QuadraticBSpline>(0.04, 1000.0));
    CHECK(stable_time_step<QuadraticBSpline>(0.04, 0.01, 1.0) == 0.05);
    CHECK(stable_time_step<QuadraticBSpline>(0.04, 0.0, 1.0) == 0.05);
    CHECK(std::isinf(stable_time_step<QuadraticBSpline>(0.04, 0.0, 0.0)));
}

TEST_CASE("matter without stiffness, or nearly so, falls as a stone does, whatever accelerates it") {
    check_all_falls<2>(NoStress<float>{});
    check_all_falls<3>(NoStress<float>{});
    check_all_falls<2>(FixedCorotated<float>::from_young_poisson(1, 0.3));
    check_all_falls<2>(Fluid<float>::from_properties({.bulk = 1}));
}

TEST_CASE("dust that is thrown up comes to rest for a moment, and falls") {
    Simulation simulation(tall_box<2>(), NoStress<float>{});
    simulation.add(block<2>(1.2), 1000, {0, 1});
    const double from = height(simulation), t = 0.2;
    simulation.advance(t);
    CHECK(height(simulation) - from == Approx(t - 0.5 * g * t * t).margin(t * std::sqrt(g * h) / 8 * 1.001));
}

TEST_CASE("the bound of a stiff run is that of its waves, to the bit, with gravity or a field") {
    Simulation simulation(tall_box<2>(), FixedCorotated<float>::from_young_poisson(1e5, 0.3));
    simulation.add(block<2>(), 1000);
    const Gravity<float, 2> field{{0, -9.81F}};
    for (int i = 0; i < 20; ++i) {
        const double of_waves = stable_time_step<QuadraticBSpline>(h, simulation.report().signal_speed);
        CHECK(simulation.stable_time_step() == of_waves);
        CHECK(simulation.stable_time_step(field) == of_waves);
        i % 2 ? simulation.step() : simulation.step(field);
        CHECK(simulation.last_time_step() == of_waves);
    }
}

TEST_CASE("a field counts as at the particles at first, then as at the nodes; a vector as it is") {
    Simulation simulation(tall_box<2>(), NoStress<float>{});
    simulation.add(block<2>(1.5), 1000);
    const auto steep = [](const auto& x) {  // a = 100 y²: the nodes reach 1.5 cells beyond the particles
        auto a = x * 0.0F;
        a.v[1] = a.v[1] - x.v[1] * x.v[1] * 100.0F;
        return a;
    };
    const double highest = 1.5 + 0.125 - h / 4;
    CHECK(simulation.largest_acceleration() == -1);
    CHECK(simulation.stable_time_step(steep) == Approx(acceleration_time_step(h, 100 * highest * highest)));
    CHECK(simulation.stable_time_step(Vec<double, 2>{3, 4}) == acceleration_time_step(h, 5.0));
    simulation.step(steep);
    CHECK(simulation.last_time_step() == Approx(acceleration_time_step(h, 100 * highest * highest)));
    const double top = std::ceil((highest - h / 2) / h) * h + h;  // the highest node of the highest particle
    CHECK(simulation.largest_acceleration() == Approx(100 * top * top).epsilon(1e-5));
    CHECK(simulation.stable_time_step(steep) == Approx(acceleration_time_step(h, 100 * top * top)).epsilon(1e-5));
    simulation.step();
    CHECK(simulation.largest_acceleration() == -1);
}

TEST_CASE("damping does not count as an acceleration, and a field that is not finite is named as before") {
    Simulation simulation(tall_box<2>(), FixedCorotated<float>::from_young_poisson(1e4, 0.3));
    simulation.add(block<2>(), 1000, {0.5, 0});
    const Damped<float, 2> brake{{}, 1e6F};
    for (int i = 0; i < 3; ++i) {
        const double of_waves = stable_time_step<QuadraticBSpline>(h, simulation.report().signal_speed);
        simulation.step(brake);
        CHECK(simulation.last_time_step() == of_waves);
        CHECK(simulation.largest_acceleration() == 0);
    }
    // Nor does a drive that gives matter a velocity, once it has it.
    const auto drive = [](const auto& x, const auto& v, const auto& dt) {
        auto wanted = x * 0.0F;
        wanted.v[0] = wanted.v[0] + 0.5F;
        return (wanted - v) * (decltype(v.v[0] + v.v[0])(1) / dt);
    };
    Simulation driven(tall_box<2>(), FixedCorotated<float>::from_young_poisson(1e4, 0.3));
    driven.add(block<2>(), 1000, {0.5, 0});
    for (int i = 0; i < 3; ++i) {
        const double of_waves = stable_time_step<QuadraticBSpline>(h, driven.report().signal_speed);
        driven.step(drive);
        CHECK(driven.last_time_step() == of_waves);
        CHECK(driven.largest_acceleration() < 0.1);  // rounding of 0.5 m/s, over the step
    }
    Simulation wrong(tall_box<2>(), NoStress<float>{});
    wrong.warn = {};
    wrong.add(block<2>(), 1000, {0.5, 0});
    const std::string text = message<particle_error>(
        [&] { wrong.step([](const auto& x) { return x * std::numeric_limits<float>::infinity(); }); });
    CHECK(holds(text, "which is not finite: look at the field that was given"));
}

TEST_CASE("a load that comes at once is met by the step that it comes in") {
    // A blow of 200 m/s² from 0.1 s on, for 0.05 s, on dust at rest.
    Simulation simulation(tall_box<2>(), NoStress<float>{});
    simulation.gravity = {0, -1e-3};
    const Body body = simulation.add(block<2>(0.5), 1000);
    const double mass = 1000 * h * h / 4;
    simulation.add_load(body, [=](const Vec<double, 2>&, double time) {
        return Vec<double, 2>{0, time >= 0.1 && time < 0.15 ? 200 * mass : 0};
    });
    simulation.advance(0.1);
    simulation.advance(0.05);
    const double from = height(simulation);
    const auto steps = simulation.steps();
    CHECK(simulation.totals().momentum[1] / simulation.totals().mass == Approx(10).epsilon(0.01));
    CHECK(from - 0.5625 == Approx(0.25).margin(0.05 * std::sqrt(200 * h) / 8));
    CHECK(steps >= 16);  // 0.05 s of ¼ √(h/200) s
}

TEST_CASE("dust at rest without gravity: a fixed step is taken, an automatic one needs a reason") {
    Simulation simulation(tall_box<2>(), NoStress<float>{});
    std::vector<std::string> said;
    simulation.warn = [&](const std::string& text) { said.push_back(text); };
    simulation.add(block<2>(), 1000);
    simulation.gravity = {};
    CHECK(holds(message<particle_error>([&] { simulation.step(); }), "Set fixed_time_step, or give"));
    CHECK(holds(message<particle_error>([&] { simulation.stable_time_step(); }), "Nothing limits the time step"));
    simulation.fixed_time_step = 0.125;
    simulation.step();
    simulation.advance(0.25);
    CHECK(simulation.time() == 0.375);
    CHECK(simulation.steps() == 3);
    CHECK(said.empty());
    simulation.fixed_time_step = 0;
    simulation.gravity = {0, -g};
    CHECK(simulation.stable_time_step() == acceleration_time_step(h, g));
}

TEST_CASE("a moving collider bounds the steps of dust at rest") {
    Simulation simulation(
        tall_box<2>(), NoStress<float>{}, Coloured{},
        Collider<Sphere<float, 2>>{.shape = {0.05F}, .position = {0.26, 1.8}, .linear_velocity = {0, -2}});
    simulation.gravity = {};
    simulation.add(block<2>(), 1000);
    CHECK(simulation.stable_time_step() == Approx(0.6 * h / 2));
}

TEST_CASE("a fixed step above the bound of gravity is warned of as such") {
    Simulation simulation(tall_box<2>(), NoStress<float>{});
    std::vector<std::string> said;
    simulation.warn = [&](const std::string& text) { said.push_back(text); };
    simulation.add(block<2>(), 1000);
    simulation.fixed_time_step = 0.9 * acceleration_time_step(h, g);
    simulation.step();
    CHECK(said.empty());
    simulation.fixed_time_step = 2 * acceleration_time_step(h, g);
    simulation.step();
    REQUIRE(said.size() == 1);
    CHECK(holds(said[0], "s is 2 times the bound of "));
    CHECK(holds(said[0], "which is set by gravity or another acceleration"));
}

TEST_CASE("a bound that is set by gravity says so when it is small") {
    Simulation simulation(tall_box<2>(), NoStress<float>{});
    std::vector<std::string> said;
    simulation.warn = [&](const std::string& text) { said.push_back(text); };
    simulation.add(block<2>(), 1000, {0, 1e-3});
    simulation.gravity = {0, -1e12};
    simulation.step();
    REQUIRE(said.size() >= 1);
    CHECK(holds(said[0], "It is set by an acceleration of 1e+12 m/s^2"));
}

TEST_CASE("a fast burst of a source is not shot far into slow matter") {
    // Jelly whose own steps take 0.1 s; a jet of 4 m/s begins after 0.05 s.
    Simulation simulation(tall_box<2>(), FixedCorotated<float>::from_young_poisson(10, 0.3));
    simulation.gravity = {};
    simulation.add(block<2>(0.2), 1000);
    const double own = simulation.stable_time_step();
    REQUIRE(own > 0.1);
    auto source =
        Source<2>::jet(sample_box<2>({0.2, 1.5}, {0.3, 1.5 + h / 2}, {.spacing = h / 2}), h / 2, 1000, {0, -4});
    source.start = 0.05;
    source.end = 0.06;
    simulation.add_source(source);
    CHECK(simulation.stable_time_step() == Approx(0.05 + 0.6 * h / 4));
    simulation.step();
    CHECK(simulation.bodies().size() <= 3);
    CHECK(simulation.last_time_step() == Approx(0.05 + 0.6 * h / 4));
}

namespace {

const FixedCorotated<float> soft = FixedCorotated<float>::from_young_poisson(1, 0.3);
const Attraction<float, 2> pull{.centre = {0.25F, 1.0F}, .radius = 2, .strength = 30};

}  // namespace

TEMPLATE_TEST_CASE("runs that accelerations bound have the same bits on all threads", "",
                   FIRN_TEST_FIRST_1(Coloured, FixedPoint<>)) {
    const auto hash_of = [](int threads) {
        Simulation simulation(tall_box<2>(), soft, TestType{threads});
        simulation.add(block<2>(), 1000, {0.1, 0});
        for (int i = 0; i < 8; ++i) simulation.step(pull);
        return scenes::hash(simulation);
    };
    const auto one = hash_of(1);
    CHECK(hash_of(2) == one);
    CHECK(hash_of(5) == one);
}

TEST_CASE("a restart goes on with the step that the field of the last step allows, to the same bits") {
    Simulation whole(tall_box<2>(), soft), continued(tall_box<2>(), soft);
    whole.add(block<2>(), 1000, {0.1, 0});
    for (int i = 0; i < 4; ++i) whole.step(pull);
    const auto state = state_of(whole);
    restore(continued, state);
    CHECK(continued.largest_acceleration() == whole.largest_acceleration());
    CHECK(continued.largest_acceleration() > 0);
    for (int i = 0; i < 4; ++i) {
        const double of_field = acceleration_time_step(h, whole.largest_acceleration());
        whole.step(pull);
        continued.step(pull);
        REQUIRE(whole.last_time_step() == of_field);
        REQUIRE(continued.last_time_step() == of_field);
    }
    CHECK(scenes::hash(continued) == scenes::hash(whole));
    // After a step under gravity, a state says nothing of a field.
    whole.step();
    restore(continued, state_of(whole));
    CHECK(continued.largest_acceleration() == -1);
    auto damaged = state;
    for (auto& p : damaged.parameters)
        if (p.name == "largest_acceleration") p.values = {-2};
    CHECK_THROWS_AS(restore(continued, damaged), io_error);
}

}  // namespace acceleration_tests
