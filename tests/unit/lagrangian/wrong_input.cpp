/// \file What points, springs, constraints and emitters are told that is of no use, beside what their own tests show.
#include "support/catch.hpp"
#include "support/message.hpp"
#include "support/not_finite.hpp"
#include <firn/lagrangian.hpp>

using namespace firn;
using test_support::check_refused;
using test_support::infinity;
using test_support::not_a_number;

namespace wrong_input_tests {

namespace {

using System = ParticleSystem<2, double>;

System four_points() {
    System system;
    for (int i = 0; i < 4; ++i) system.points.add({.position = {double(i), 0.0}});
    return system;
}

}  // namespace

TEST_CASE("springs and anchors of numbers that no force comes from", "[lagrangian]") {
    Springs<double, 2> springs;
    Anchors<double, 2> anchors;
    for (const double wrong : {-1.0, not_a_number, infinity}) {
        check_refused<parameter_error>([&] { springs.add({0, 1}, {wrong, 1, 0}); }, "m long at rest");
        check_refused<parameter_error>([&] { springs.add({0, 1}, {1, wrong, 0}); }, "A spring of stiffness");
        check_refused<parameter_error>([&] { springs.add({0, 1}, {1, 1, wrong}); }, "and damping");
        check_refused<parameter_error>([&] { anchors.add({0}, {{0, 0}, wrong, 0}); }, "A spring of stiffness");
        check_refused<parameter_error>([&] { anchors.add({0}, {{0, 0}, 1, wrong}); }, "and damping");
    }
    for (const double wrong : {not_a_number, infinity})
        check_refused<parameter_error>([&] { anchors.add({0}, {{0, wrong}, 1, 0}); },
                                       "Coordinate 1 of an anchor's place");
    CHECK(springs.size() + anchors.size() == 0);
}

TEST_CASE("points that are taken out past the system are missed, not read", "[lagrangian]") {
    System system = four_points();
    system.constraints.add({0, 1}, 1);
    system.constraints.add({2, 3}, 1);
    Springs<double, 2> springs;
    springs.add({2, 3}, {1, 1, 0});
    System with_springs = system;
    with_springs.constraints = {};
    with_springs.add_force(springs);
    system.step(1e-3);
    with_springs.step(1e-3);
    system.points.remove_if([](std::size_t i) { return i > 1; });
    with_springs.points.remove_if([](std::size_t i) { return i > 1; });
    check_refused<parameter_error>([&] { system.step(1e-3); }, "Constraint 1 keeps a distance to point 2; there are 2");
    check_refused<parameter_error>([&] { with_springs.step(1e-3); }, "Element 0 of a force joins point 2; there are 2");

    // Through the system, but of a force to a point that never was.
    System other = four_points();
    springs.add({1, 90}, {1, 1, 0});
    other.add_force(springs);
    check_refused<parameter_error>([&] { other.remove_if([](std::size_t i) { return i == 0; }); },
                                   "Point 90 is joined to others");
}

TEST_CASE("constraints that are solved by themselves", "[lagrangian]") {
    DistanceConstraints<double, 2> constraints;
    constraints.add({0, 1}, 1);
    std::vector<Vec<double, 2>> x{{0, 0}, {2, 0}};
    const std::vector<double> w{1, 1}, short_of_one{1};
    for (const double dt : {0.0, -1.0, not_a_number, infinity})
        check_refused<parameter_error>([&] { constraints.solve(x, w, dt, 1, 1); }, "a positive step");
    check_refused<parameter_error>([&] { constraints.solve(x, w, 0.1, -1, 1); }, "in -1 iterations");
    check_refused<parameter_error>([&] { constraints.solve(x, short_of_one, 0.1, 1, 1); },
                                   "2 points with 1 inverse masses");
    CHECK(x[1][0] == 2);
    constraints.solve(x, w, 0.1, 1, 1);
    CHECK(x[1][0] == 1.5);
    for (const double compliance : {-1.0, not_a_number, infinity})
        check_refused<parameter_error>([&] { constraints.add({0, 1}, 1, {.compliance = compliance}); }, "compliance");
    for (const double relaxation : {0.0, 1.1, not_a_number})
        check_refused<parameter_error>([&] { constraints.add({0, 1}, 1, {.relaxation = relaxation}); }, "relaxation");
}

TEST_CASE("emitters that owe more than can be counted, or than there are ids", "[lagrangian]") {
    System system = four_points();
    system.step(1e-3);
    check_refused<parameter_error>([&] { system.add_emitter({.rate = 1e300}); }, "more than can be counted");
    check_refused<parameter_error>([&] { system.add_emitter({.rate = 1, .start = -1e300}); },
                                   "more than can be counted");
    CHECK(system.emitters().empty());
    system.add_emitter({.rate = 1e15});  // skips what was due until now, at once
    check_refused<parameter_error>([&] { system.step(1e-3); }, "there are ids for 4294967291 more");
}

}  // namespace wrong_input_tests
