/// \file A system of points that blows up stops in the step in which a number first is not finite, and says which
/// point, which step, and the likely cause.
#include "support/catch.hpp"
#include "support/message.hpp"
#include "support/not_finite.hpp"
#include <firn/lagrangian.hpp>

using namespace firn;
using test_support::holds;
using test_support::infinity;
using test_support::message;
using test_support::not_a_number;

namespace blow_up_tests {

namespace {

using System = ParticleSystem<3, float>;

/// 41 points in a row, 0.1 m apart; springs of 100 N/m of which the first is pulled.
System row(int threads, bool rigid = false) {
    System system;
    system.threads = threads;
    system.warn = [](const std::string&) {};
    const Net<3> net = rope<3>({{0, 0, 0}}, {{4, 0, 0}}, 40);
    system.add(net, {.mass = 0.1});
    system.points.position[0][0] -= 0.01F;
    if (rigid)
        system.constraints.add(net);
    else
        system.add_force(springs_of<float>(net, SpringOptions{.stiffness = 100}));
    return system;
}

/// What is said, which is the same for one thread and three, and how many steps there were.
template <class Prepare>
std::string said_of(double dt, const Prepare& prepare, std::uint64_t steps, bool rigid = false) {
    std::string said[2];
    for (const int threads : {1, 3}) {
        System system = row(threads, rigid);
        prepare(system);
        said[threads / 2] = message<particle_error>([&] {
            for (int i = 0; i < 1000; ++i) {
                system.step(dt);
                for (const auto& x : system.points.position) REQUIRE(detail::is_finite(x));
                for (const auto& v : system.points.velocity) REQUIRE(detail::is_finite(v));
            }
        });
        if (steps < 1000) CHECK(system.steps() == steps);
        CHECK(holds(said[threads / 2], sentence("At step ", system.steps(), ", at ")));
    }
    CHECK(said[0] == said[1]);
    return said[0];
}

}  // namespace

TEST_CASE("springs under steps of 50 times their bound: the step, the point, the ratio", "[lagrangian]") {
    const double bound = row(1).stable_time_step();
    const std::string said = said_of(50 * bound, [](System&) {}, 1000);
    CAPTURE(said);
    CHECK(holds(said, " of 41 points"));
    CHECK(holds(said, "The first is point "));
    CHECK(holds(said, " times the bound of "));
}

TEST_CASE("what is set by hand is named before anything has moved", "[lagrangian]") {
    const auto plant = [](double number) {
        return [number](System& system) {
            system.points.velocity[7][1] = float(number);
            system.points.position[31][2] = float(number);
        };
    };
    for (const double number : {not_a_number, infinity}) {
        const std::string said = said_of(1e-3, plant(number), 0);
        CAPTURE(said);
        // With the neighbours that springs of theirs pull at: 5 to 9 and 29 to 33.
        CHECK(holds(said, "10 of 41 points"));
        CHECK(holds(said, "The first is point 5 "));
        CHECK(holds(said, "Nothing has moved."));
        CHECK(holds(said, "set by hand"));
    }
}

TEST_CASE("what a step itself makes of finite numbers is found in that step", "[lagrangian]") {
    // Faster than a float is large, a second later.
    const std::string said = said_of(1e3, [](System& system) { system.points.velocity[3][0] = 3e38F; }, 0, true);
    CAPTURE(said);
    CHECK(holds(said, "point 3 "));
    CHECK(holds(said, "go on from the last state"));
}

TEST_CASE("gravity, damping, restitution and numbers of iterations that are of no use are refused", "[lagrangian]") {
    const auto refused = [](const auto& change, const char* part) {
        System system = row(1);
        change(system);
        const std::string said = message<parameter_error>([&] { system.step(1e-3); });
        CAPTURE(said);
        CHECK(holds(said, part));
        CHECK(system.steps() == 0);
    };
    refused([](System& system) { system.gravity[2] = not_a_number; }, "Gravity is (0, -9.81, nan)");
    refused([](System& system) { system.gravity[0] = 1e39; }, "Gravity is (1e+39,");
    refused([](System& system) { system.damping = -1; }, "damping");
    refused([](System& system) { system.damping = not_a_number; }, "damping");
    refused([](System& system) { system.restitution = 1.5; }, "restitution");
    refused([](System& system) { system.iterations = -1; }, "iterations");
    refused([](System& system) { system.threads = -2; }, "-2 threads");
    System system = row(1);
    for (const double dt : {0.0, -1.0, not_a_number, infinity}) CHECK_THROWS_AS(system.step(dt), parameter_error);
    for (const double duration : {-1.0, not_a_number, infinity}) {
        CHECK_THROWS_AS(system.advance(duration, 1e-3), parameter_error);
        CHECK_THROWS_WITH(system.advance(duration, 1e-3), Catch::Contains("time to advance"));
    }
}

TEST_CASE("where no step is small enough the run warns once, and does not hang", "[lagrangian]") {
    ParticleSystem<3, float> system;
    system.points.add({.velocity = {1, 1, 1}, .radius = 1e30});  // whose drag no number of S holds
    system.add_force(DragOnPoints<float, 3>{});
    CHECK(system.stable_time_step() == 0);
    int warnings = 0;
    system.warn = [&](const std::string&) { ++warnings; };
    CHECK_THROWS_AS(system.step(1e-3), particle_error);
    CHECK_THROWS_AS(system.step(1e-3), particle_error);
    CHECK(warnings == 1);
}

}  // namespace blow_up_tests
