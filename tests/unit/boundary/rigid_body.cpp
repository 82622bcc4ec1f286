/// \file Rigid bodies alone: mass and inertia of shapes, a body that tumbles, rotation vectors, and what is refused.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/boundary/rigid_body.hpp>
#include <firn/data/sampling.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace rigid_body_tests {
namespace {
using namespace firn;

/// Mass and inertia of a shape by the points of a lattice inside of it.
template <int D, class Shape>
MassOfBody<D> by_points(const Shape& shape, double density, double spacing) {
    MassOfBody<D> sum{};
    const auto box = sample_box<D>(Vec<double, D>::filled(-0.5), Vec<double, D>::filled(0.5), {.spacing = spacing});
    for (const Vec<double, D>& x : box.positions) {
        if (shape.signed_distance(x) > 0) continue;
        const double mass = density * box.volume;
        sum.mass += mass;
        if constexpr (D == 2)
            sum.inertia += mass * dot(x, x);
        else
            sum.inertia += (Mat<double, 3>::identity() * dot(x, x) - outer(x, x)) * mass;
    }
    return sum;
}
template <int D, class Shape>
void check_mass(const Shape& shape) {
    const auto exact = mass_of(shape, 700);
    const auto points = by_points<D>(shape, 700, D == 2 ? 0.002 : 0.00625);
    CHECK(exact.mass == Approx(points.mass).epsilon(4e-3));
    if constexpr (D == 2) {
        CHECK(exact.inertia == Approx(points.inertia).epsilon(6e-3));
    } else {
        for (int i = 0; i < 3; ++i) CHECK(exact.inertia(i, i) == Approx(points.inertia(i, i)).epsilon(6e-3));
    }
}
}  // namespace

TEST_CASE("Mass and inertia of shapes are those of their points") {
    check_mass<2>(Sphere<double, 2>{0.3});
    check_mass<3>(Sphere<double, 3>{0.3});
    check_mass<2>(Box<double, 2>{{0.1, 0.3}});
    check_mass<3>(Box<double, 3>{{0.1, 0.3, 0.2}});
    check_mass<2>(Capsule<double, 2>{.half_length = 0.25, .radius = 0.2});
    check_mass<3>(Capsule<double, 3>{.half_length = 0.25, .radius = 0.2});
}

TEST_CASE("A rigid body without forces keeps momentum, angular momentum, and energy to second order") {
    double drift[2];
    for (int i = 0; i < 2; ++i) {
        RigidBody<Collider<Sphere<double, 3>>> body({}, {2.0, Mat<double, 3>::rows(1, 0.1, 0, 0.1, 2, 0, 0, 0, 3)});
        body.momentum = {1.0, 2.0, 3.0};
        body.angular_momentum = {1.0, 4.0, 0.2};
        body.place_velocities();
        const auto L = body.angular_momentum;
        const double energy = body.kinetic_energy();
        const int steps = 2000 << i;
        drift[i] = 0;
        for (int n = 0; n < steps; ++n) {
            body = advanced(body, 20.0 / steps);
            drift[i] = std::max(drift[i], std::abs(body.kinetic_energy() / energy - 1));
        }
        CHECK(norm(body.angular_momentum - L) == 0);
        CHECK(norm(body.collider.position - Vec<double, 3>{10.0, 20.0, 30.0}) <= 1e-11);
        CHECK(std::abs(norm(body.collider.rotation) - 1) <= 1e-15);
    }
    CAPTURE(drift[0], drift[1]);
    CHECK(drift[0] <= 1e-3);
    CHECK(drift[0] / drift[1] > 3.5);
}

TEST_CASE("A rotation vector turns one rotation into another") {
    const auto from = rotor({1.0, 2.0, -0.5}, degrees(70)), to = rotor({-0.3, 1.0, 0.2}, degrees(-110));
    const auto reached = turned(from, turn_between(from, to));
    CHECK(squared_norm(matrix_of(reached) - matrix_of(to)) <= 1e-28);
    CHECK(norm(turn_between(from, from)) == 0);
    const Vec<double, 3> small{1e-9, -2e-9, 0.5e-9};
    CHECK(norm(turn_between(from, turned(from, small)) - small) <= 1e-15);
    const auto flat = rotor(degrees(170)), beyond = rotor(degrees(-170));
    CHECK(turn_between(flat, beyond) == Approx(degrees(20).in_radians()));
}

TEST_CASE("A rigid body that cannot move is refused") {
    using Body = RigidBody<Collider<Sphere<double, 3>>>;
    const Collider<Sphere<double, 3>> ball{.shape = {0.1}};
    test_support::check_refused<parameter_error>([&] { Body(ball, 0.0).check(); }, "must be positive and finite");
    test_support::check_refused<parameter_error>([&] { Body(ball, {1.0, Mat<double, 3>::diagonal(-1.0)}).check(); },
                                                 "must be positive and finite");
    test_support::check_refused<parameter_error>(
        [&] {
            Body body(ball, 1000.0);
            body.force[1] = std::numeric_limits<double>::quiet_NaN();
            body.check();
        },
        "is not finite");
    test_support::check_refused<parameter_error>(
        [&] {
            Body body(ball, 1000.0);
            body.drive.hold(0, -1, 0);
            body.check();
        },
        "The stiffness of a drive is -1");
    CHECK_NOTHROW(Body(ball, 1000.0).check());
}
}  // namespace rigid_body_tests
