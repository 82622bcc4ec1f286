/// \file Point masses at the surfaces of boundaries: bouncing, sliding, sticking, and coming back.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/random_numbers.hpp"
#include <firn/boundary/boundary_list.hpp>
#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/data/mesh_distance.hpp>
#include <firn/lagrangian/surface_contact.hpp>
#include <firn/stage/grid_update.hpp>

#include "../data/meshes.hpp"

#include <cmath>
#include <numbers>

using namespace firn;
using test_support::Random;

namespace surface_contact_tests {

namespace {

template <int D>
using Points = PointMasses<double, D>;

/// A body of which velocity() knows only what happens at a node.
struct WithoutSurfaces {
    Vec<double, 2> velocity(const Vec<double, 2>&, const Vec<double, 2>& v) const { return v; }
    bool reaches(const Vec<double, 2>&, const Vec<double, 2>&) const { return true; }
};

Walls<double, 2> box(Contact contact, double friction = 0) {
    return Walls<double, 2>::all({{0, 0}}, {{1, 1}}, {contact, friction});
}

Points<2> one(const Vec<double, 2>& x, const Vec<double, 2>& v, double radius = 0.1) {
    Points<2> points;
    points.add({.position = x, .velocity = v, .radius = radius});
    return points;
}

/// Calls boundary.surfaces and returns what it says.
template <int D>
struct Surface {
    double distance;
    Vec<double, D> normal, velocity;
    Contact contact;
    double friction;
};
template <int D, class B>
std::vector<Surface<D>> surfaces_of(const B& boundary, const Vec<double, D>& x) {
    std::vector<Surface<D>> all;
    boundary.surfaces(
        x, [&](double distance, const Vec<double, D>& normal, const Vec<double, D>& velocity, Contact contact,
               double friction) { all.push_back({distance, normal, velocity, contact, friction}); });
    return all;
}

}  // namespace

static_assert(has_surfaces<Walls<float, 3>, float, 3>);
static_assert(has_surfaces<Collider<Sphere<float, 2>>, float, 2>);
static_assert(has_surfaces<Together<Walls<float, 3>, Collider<Box<float, 3>>>, float, 3>);
static_assert(has_surfaces<BoundaryList<Collider<Capsule<double, 3>>>, double, 3>);
static_assert(has_surfaces<NoBoundary, double, 3>);
static_assert(boundary<WithoutSurfaces, double, 2> && !has_surfaces<WithoutSurfaces, double, 2>);
static_assert(!has_surfaces<BoundaryList<WithoutSurfaces>, double, 2>);
static_assert(!has_surfaces<Together<Walls<double, 2>, WithoutSurfaces>, double, 2>);

TEST_CASE("surfaces: a boundary changes the velocity of nodes exactly where it says that its surfaces are",
          "[lagrangian]") {
    Collider<Box<double, 3>> moving{.shape = {{{0.3, 0.2, 0.1}}},
                                    .friction = 0.3,
                                    .thickness = 0.05,
                                    .position = {{0.5, 0.4, 0.6}},
                                    .rotation = rotor({{0.3, -0.5, 0.8}}, radians(0.9)),
                                    .linear_velocity = {{1, 2, 3}},
                                    .angular_velocity = {{-3, 1, 2}}};
    const Together<Walls<double, 3>, Collider<Box<double, 3>>> boundary(
        Walls<double, 3>::all({{0, 0, 0}}, {{1, 1, 1}}, {Contact::separate, 0.1}), moving);
    Random random(1);
    int touched_one = 0, touched_more = 0;
    for (int k = 0; k < 2000; ++k) {
        const auto x = random.vector<3>(-0.2, 1.2), v = random.vector<3>(-5, 5);
        auto expected = v;
        int touched = 0;
        for (const auto& s : surfaces_of(boundary, x)) {
            if (!(s.distance <= 0)) continue;
            expected = s.velocity + velocity_after_contact(v - s.velocity, s.normal, s.contact, s.friction);
            ++touched;
        }
        const auto after = boundary.velocity(x, v);
        touched_one += touched == 1;
        touched_more += touched > 1;
        if (touched <= 1) REQUIRE(norm(after - expected) < 1e-13);
        if (touched > 1)
            for (const auto& s : surfaces_of(boundary, x))
                if (s.distance <= 0) REQUIRE(dot(after - s.velocity, s.normal) > -1e-12);
    }
    CHECK(touched_one > 500);
    CHECK(touched_more > 300);
}

TEST_CASE("surfaces: the rate of the distance at rest is that of the surface along its normal", "[lagrangian]") {
    const Collider<Capsule<double, 3>> now{.shape = {0.2, 0.1},
                                           .position = {{0.1, 0.2, 0.3}},
                                           .rotation = rotor({{0.4, 0.2, -0.7}}, radians(0.9)),
                                           .linear_velocity = {{0.5, -1, 0.2}},
                                           .angular_velocity = {{2, -1, 0.5}}};
    const double dt = 1e-6;
    Random random(2);
    for (int k = 0; k < 100; ++k) {
        const auto x = random.vector<3>(-1, 1);
        const auto at = surfaces_of(now, x).front();
        const double rate =
            (surfaces_of(now.advanced(dt), x).front().distance - surfaces_of(now.advanced(-dt), x).front().distance) /
            (2 * dt);
        CHECK(rate == Approx(-dot(at.velocity, at.normal)).margin(1e-7));
    }
}

TEST_CASE("surface contact: a ball bounces to e squared of its height, again and again", "[lagrangian]") {
    const double e = 0.8, dt = 1e-5, g = 10, r = 0.1;
    auto points = one({{0.5, 0.6}}, {{0, 0}}, r);
    const auto walls = box(Contact::separate);
    double height = 0.5, highest = 0, last = 0;
    int bounces = 0;
    for (int step = 0; step < 200000 && bounces < 3; ++step) {
        points.velocity[0][1] -= g * dt;
        points.position[0] += points.velocity[0] * dt;
        const double before = points.velocity[0][1];
        meet_surfaces(points, walls, e);
        const double after = points.velocity[0][1];
        highest = std::max(highest, points.position[0][1] - r);
        if (before < 0 && after > 0) {
            CHECK(after == Approx(-e * before).epsilon(1e-15));
            highest = 0;
        }
        if (last > 0 && after <= 0) {
            // A step's way before the impact is given back (dt v each bounce), and so is a step of falling.
            CHECK(highest / height == Approx(e * e).margin(4 * dt * std::sqrt(2 * g * height) / height));
            height = highest;
            ++bounces;
        }
        last = after;
    }
    CHECK(bounces == 3);
    CHECK(points.position[0][0] == 0.5);
}

TEST_CASE("surface contact: on an incline a point slides if tan θ > μ, by g (sin θ - μ cos θ)", "[lagrangian]") {
    const double theta = 0.5, g = 10, dt = 1e-3;
    for (const double mu : {0.0, 0.3, 0.5, std::tan(theta) * 1.01, 2.0}) {
        const Vec<double, 2> up{{-std::sin(theta), std::cos(theta)}}, down{{-std::cos(theta), -std::sin(theta)}};
        Collider<HalfSpace<double, 2>> slope{.shape = {up}, .friction = mu};
        auto points = one(up * 0.1, {{0, 0}});
        for (int step = 0; step < 1000; ++step) {
            points.velocity[0][1] -= g * dt;
            points.position[0] += points.velocity[0] * dt;
            meet_surfaces(points, slope);
        }
        const double expected = std::max(g * (std::sin(theta) - mu * std::cos(theta)), 0.0);
        CHECK(dot(points.velocity[0], down) == Approx(expected).margin(1e-9));
        CHECK(dot(points.velocity[0], up) == Approx(0).margin(1e-9));
        CHECK(dot(points.position[0], up) == Approx(0.1 * (1 - contact_slack)).margin(1e-9));
    }
}

TEST_CASE("surface contact: stick holds, slip keeps on the surface, separate lets go, none is not there",
          "[lagrangian]") {
    for (const double outward : {-1.0, 1.0}) {
        const Vec<double, 2> x{{0.5, 0.05}}, v{{2, outward}};
        auto points = one(x, v);
        meet_surfaces(points, box(Contact::stick), 1);
        CHECK(points.velocity[0] == Vec<double, 2>::zero());
        CHECK(norm(points.position[0] - Vec<double, 2>{{0.5, 0.1 * (1 - contact_slack)}}) < 1e-15);
        points = one(x, v);
        meet_surfaces(points, box(Contact::slip), 1);
        CHECK(norm(points.velocity[0] - Vec<double, 2>{{2, 0}}) < 1e-15);
        points = one(x, v);
        meet_surfaces(points, box(Contact::separate), 0.5);
        CHECK(norm(points.velocity[0] - Vec<double, 2>{{2, outward < 0 ? 0.5 : 1}}) < 1e-15);
        points = one(x, v);
        meet_surfaces(points, box(Contact::none), 1);
        CHECK(points.velocity[0] == v);
        CHECK(points.position[0] == x);
    }
}

TEST_CASE("surface contact: a point deep in a solid or far outside the walls comes back, without speed from it",
          "[lagrangian]") {
    for (const double far : {-0.3, 1.7, 1e6}) {
        auto points = one({{far, 1 - far}}, {{0, 0}});
        meet_surfaces(points, box(Contact::separate), 1);
        const double at = 0.1 * (1 - contact_slack), x = far < 0 ? at : 1 - at;
        CHECK(norm(points.position[0] - Vec<double, 2>{{x, 1 - x}}) < 1e-9);
        CHECK(points.velocity[0] == Vec<double, 2>::zero());
    }
    Points<3> points;
    points.add({.position = {{0.5, 0.5, 0.5}}, .radius = 0.1});  // at the very centre
    Collider<Sphere<double, 3>> ball{.shape = {0.3}, .thickness = 0.05, .position = {{0.5, 0.5, 0.5}}};
    meet_surfaces(points, ball);
    CHECK(norm(points.position[0] - ball.position) == Approx(0.35 + 0.1 * (1 - contact_slack)));
    CHECK(points.velocity[0] == Vec<double, 3>::zero());
}

TEST_CASE("surface contact: radius, and a collider's thickness, say from where on a point touches", "[lagrangian]") {
    Collider<Sphere<double, 2>> ball{.shape = {0.3}, .thickness = 0.05};
    for (const double radius : {0.0, 0.1}) {
        for (const double distance : {-1e-6, 1e-6}) {
            auto points = one({{0.35 + radius + distance, 0}}, {{-1, 0}}, radius);
            meet_surfaces(points, ball);
            CHECK(points.velocity[0][0] == Approx(distance < 0 ? 0 : -1).margin(1e-15));
        }
    }
}

TEST_CASE("surface contact: moving and turning colliders carry points along", "[lagrangian]") {
    Collider<Sphere<double, 2>> ball{.shape = {0.3},
                                     .contact = Contact::stick,
                                     .position = {{1, 0}},
                                     .linear_velocity = {{2, 0}},
                                     .angular_velocity = 4};
    auto points = one({{1, 0.39}}, {{-7, 5}});
    meet_surfaces(points, ball, 1);
    CHECK(norm(points.velocity[0] - Vec<double, 2>{{2 - 4 * 0.39, 0}}) < 1e-14);
    // A wall that comes on at speed u throws back what rests before it at (1 + e) u.
    Collider<HalfSpace<double, 2>> piston{.shape = {{{1, 0}}}, .linear_velocity = {{3, 0}}};
    points = one({{0.05, 0}}, {{0, 0}});
    meet_surfaces(points, piston, 0.5);
    CHECK(norm(points.velocity[0] - Vec<double, 2>{{4.5, 0}}) < 1e-14);
}

TEST_CASE("surface contact: a corner between two solids holds a point at both", "[lagrangian]") {
    for (const double half : {45.0, 70.0}) {  // a right angle, and a wide one
        const double angle = half * std::numbers::pi / 180;
        BoundaryList<Collider<HalfSpace<double, 2>>> valley;
        for (const double side : {-1.0, 1.0})
            valley.all.push_back({.shape = {{{side * std::cos(angle), std::sin(angle)}}}});
        auto points = one({{0.02, 0.03}}, {{0, -2}});
        const double at = 0.1 * (1 - contact_slack);
        meet_surfaces(points, valley);
        for (int again = 0; again < 3; ++again) meet_surfaces(points, valley);
        for (const auto& s : surfaces_of(valley, points.position[0])) CHECK(s.distance >= at - 1e-15);
        CHECK(surfaces_of(valley, points.position[0]).back().distance == Approx(at));
        CHECK(points.velocity[0][1] > -1e-15);
    }
}

TEST_CASE("surface contact: pinned points pass through, and what cannot be is refused", "[lagrangian]") {
    auto points = one({{-1, -1}}, {{0, 0}});
    points.pin(0, {{1, 1}});
    meet_surfaces(points, box(Contact::stick));
    CHECK(points.position[0] == Vec<double, 2>{{-1, -1}});
    CHECK(points.velocity[0] == Vec<double, 2>{{1, 1}});
    for (const double wrong : {-0.01, 1.01, std::nan("")})
        CHECK_THROWS_AS(meet_surfaces(points, box(Contact::stick), wrong), parameter_error);
    CHECK_THROWS_AS(meet_surfaces(points, Collider<Sphere<double, 2>>{.friction = -1}), parameter_error);
}

TEST_CASE("surface contact: points in float follow a boundary in double, the same for any number of threads",
          "[lagrangian]") {
    Random random(3);
    PointMasses<float, 3> start;
    for (int i = 0; i < 5000; ++i)
        start.add({.position = random.vector<3>(-0.1, 1.1), .velocity = random.vector<3>(-1, 1), .radius = 0.02});
    const Together<Walls<double, 3>, Collider<Sphere<double, 3>>> boundary(
        Walls<double, 3>::all({{0, 0, 0}}, {{1, 1, 1}}, {Contact::separate, 0.1}),
        Collider<Sphere<double, 3>>{.shape = {0.2}, .position = {{0.5, 0.5, 0.5}}});
    auto serial = start;
    meet_surfaces(serial, boundary, 0.5, 1);
    for (const int threads : test_support::other_threads) {
        auto points = start;
        meet_surfaces(points, boundary, 0.5, threads);
        CHECK(points.position == serial.position);
        CHECK(points.velocity == serial.velocity);
    }
    for (const auto& x : serial.position) {
        REQUIRE(norm(x - Vec<double, 3>{{0.5, 0.5, 0.5}}) > 0.2 + 0.0199);
        for (int a = 0; a < 3; ++a) REQUIRE(std::abs(x[a] - 0.5) < 0.4801);
    }
}

TEST_CASE("surface contact: balls larger than the band of a mesh's grid meet the mesh, and not the grid's box",
          "[lagrangian][slow]") {
    // Nodes outside of the band stored its width, 0.06 m: every ball of 0.1 m in the grid's box touched something.
    const double radius = 0.1;
    const auto mesh = test_meshes::sphere({0, 0, 0}, 0.6, 3);
    const Collider<DistanceGrid<double, 3>> solid{.shape = {mesh_distance(mesh, {.spacing = 0.03})}};
    Random random(4);
    int touched = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        const Vec<double, 3> outwards = random.direction<3>();
        const double gap = random.uniform(-0.08, 0.5);  // to the ball of radius 0.6, 3 mm around the mesh
        if (std::abs(gap) < 0.006) continue;
        auto points = PointMasses<double, 3>();
        points.add({.position = outwards * (0.6 + radius + gap), .velocity = -outwards, .radius = radius});
        meet_surfaces(points, solid);
        CAPTURE(trial, gap);
        if (gap > 0) {
            REQUIRE(points.velocity[0] == -outwards);
        } else {
            REQUIRE(norm(points.velocity[0]) < 0.1);  // what slides along the surface
            REQUIRE(norm(points.position[0]) == Approx(0.6 + radius).epsilon(0.01));
            ++touched;
        }
    }
    CHECK(touched > 200);
    // On a flat face, to the digit.
    const Collider<DistanceGrid<double, 3>> table{
        .shape = {mesh_distance<float>(test_meshes::box({-0.5, -0.25, -0.5}, {0.5, 0, 0.5}), {.spacing = 0.02})}};
    auto points = PointMasses<double, 3>();
    points.add({.position = {0.1, 0.05, 0.2}, .velocity = {0, -1, 0}, .radius = radius});
    meet_surfaces(points, table);
    CHECK(points.position[0][1] == Approx(radius * (1 - contact_slack)).epsilon(1e-6));
    CHECK(points.velocity[0][1] == Approx(0).margin(1e-6));
}

}  // namespace surface_contact_tests
