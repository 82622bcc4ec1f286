// part: arithmetic
/// \file What collisions of point masses promise. Expected velocities are the closed forms of impacts of two bodies.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/random_numbers.hpp"
#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/lagrangian/collisions.hpp>

#include <cmath>
#include <set>

using namespace firn;
using test_support::Random;

namespace collisions_tests {

namespace {

using Pair = std::pair<std::uint32_t, std::uint32_t>;

template <class S, int D>
PointMasses<S, D> cloud(std::size_t n, double size, double least_radius, double largest_radius, std::uint64_t seed) {
    Random random(seed);
    PointMasses<S, D> points;
    for (std::size_t i = 0; i < n; ++i) {
        const auto x = random.vector<D>(0, size), v = random.vector<D>(-1, 1);
        points.add({.position = x,
                    .velocity = v,
                    .mass = random.uniform(0.5, 3),
                    .radius = random.uniform(least_radius, largest_radius)});
    }
    return points;
}

template <class S, int D>
std::multiset<Pair> pairs_of(const Collisions<S, D>& collisions) {
    std::multiset<Pair> pairs;
    collisions.for_contacts([&](std::uint32_t i, std::uint32_t j) { pairs.insert({i, j}); });
    return pairs;
}

template <class S, int D>
double energy(const PointMasses<S, D>& points) {
    double sum = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const auto v = cast<double>(points.velocity[i]);
        sum += double(points.mass[i]) * dot(v, v) / 2;
    }
    return sum;
}

/// Σ m f, of velocities or positions, with a rounding far below that of S.
template <class S, int D>
Vec<long double, D> moment(const PointMasses<S, D>& points, const auto& field) {
    auto sum = Vec<long double, D>::zero();
    for (std::size_t i = 0; i < points.size(); ++i)
        for (int a = 0; a < D; ++a) sum[a] += (long double)(points.mass[i]) * (long double)(field[i][a]);
    return sum;
}

template <class S>
Vec<double, 3> angular_momentum(const PointMasses<S, 3>& points) {
    auto sum = Vec<double, 3>::zero();
    for (std::size_t i = 0; i < points.size(); ++i)
        sum += cross(cast<double>(points.position[i]), cast<double>(points.velocity[i])) * double(points.mass[i]);
    return sum;
}

/// Two balls that overlap by 0.1 along (0.6, 0.8), in the plane.
PointMasses<double, 2> two_balls(double mass_a, double mass_b, const Vec<double, 2>& va, const Vec<double, 2>& vb) {
    PointMasses<double, 2> points;
    points.add({.position = {{1, 2}}, .velocity = va, .mass = mass_a, .radius = 0.5});
    points.add({.position = {{1 + 0.6 * 0.9, 2 + 0.8 * 0.9}}, .velocity = vb, .mass = mass_b, .radius = 0.5});
    return points;
}
const Vec<double, 2> n{{0.6, 0.8}}, t{{-0.8, 0.6}};  // along the line of centres and across

}  // namespace

TEMPLATE_TEST_CASE_SIG("collisions: contacts are those of a search of all pairs, from both sides", "[lagrangian]",
                       ((class S, int D), S, D), (float, 2), (float, 3), (double, 2), (double, 3)) {
    auto points = cloud<S, D>(1500, D == 2 ? 1.0 : 0.5, 0.0, 0.03, 1);
    for (std::size_t i = 0; i < points.size(); i += 9) points.radius[i] = 0;
    Collisions<S, D> collisions;
    collisions.find(points, 2);
    std::multiset<Pair> expected;
    for (std::uint32_t i = 0; i < points.size(); ++i)
        for (std::uint32_t j = 0; j < points.size(); ++j) {
            const auto apart = points.position[i] - points.position[j];
            const double reach = double(points.radius[i]) + double(points.radius[j]);
            if (i != j && points.radius[i] > 0 && points.radius[j] > 0 && norm(apart) < reach) expected.insert({i, j});
        }
    REQUIRE(expected.size() > 1000);
    CHECK(pairs_of(collisions) == expected);
    CHECK(2 * collisions.contacts() == expected.size());
}

TEST_CASE("collisions: two balls leave with e times the speed of their approach, as unequal masses share it",
          "[lagrangian]") {
    for (const double e : {0.0, 0.3, 1.0})
        for (const double mass : {1.0, 7.5}) {
            const double ua = 2, ub = -1, across = 0.4;  // a is behind b along n
            auto points = two_balls(1, mass, n * ua + t * across, n * ub);
            Collisions<double, 2> collisions;
            collisions.restitution = e;
            collisions.apply(points);
            const double common = (ua + mass * ub) / (1 + mass);
            CHECK(dot(points.velocity[0], n) == Approx(common - mass * e * (ua - ub) / (1 + mass)).margin(1e-14));
            CHECK(dot(points.velocity[1], n) == Approx(common + e * (ua - ub) / (1 + mass)).margin(1e-14));
            CHECK(dot(points.velocity[0], t) == Approx(across).margin(1e-14));
            CHECK(dot(points.velocity[1], t) == Approx(0).margin(1e-14));
            // They are moved until they touch by the slack, about their centre of mass.
            const auto apart = points.position[1] - points.position[0];
            CHECK(norm(apart) == Approx(1 - contact_slack).margin(1e-14));
            CHECK(dot(points.position[0], n) ==
                  Approx(dot(n, {{1, 2}}) - (0.1 - contact_slack) * mass / (1 + mass)).margin(1e-14));
        }
}

TEST_CASE("collisions: balls that separate are let go, and shifts change no velocity", "[lagrangian]") {
    auto points = two_balls(1, 2, n * -1e-4, n * 0.5e-4);
    const auto before = points.velocity.copy();
    Collisions<double, 2> collisions;
    collisions.restitution = 1;
    collisions.friction = 1;
    collisions.apply(points);
    CHECK(points.velocity[0] == before[0]);
    CHECK(points.velocity[1] == before[1]);
    CHECK(norm(points.position[1] - points.position[0]) == Approx(1 - contact_slack).margin(1e-14));
}

TEST_CASE("collisions: friction is Coulomb's: at most mu times the normal impulse, and no more than stops sliding",
          "[lagrangian]") {
    const double approach = 2, e = 0.5;
    for (const double sliding : {0.5, 4.0}) {
        auto points = two_balls(1, 1, n * approach + t * sliding, Vec<double, 2>::zero());
        Collisions<double, 2> collisions;
        collisions.restitution = e;
        collisions.friction = 0.25;
        collisions.velocity_passes = 1;
        collisions.apply(points);
        const auto after = points.velocity[0] - points.velocity[1];
        CHECK(dot(after, n) == Approx(-e * approach).margin(1e-14));
        CHECK(dot(after, t) == Approx(std::max(sliding - 0.25 * (1 + e) * approach, 0.0)).margin(1e-14));
    }
}

TEST_CASE("collisions: surfaces have their own friction, and impulses are kept by the number of the surface",
          "[lagrangian]") {
    // On the floor of a box, at 4 m/s along it: Coulomb's 0.3 of the impulse that stops 2 m/s. Its faces are counted
    // lower and upper, axis by axis: the floor is the third.
    PointMasses<double, 2> points;
    points.add({.position = {{0.5, 0.09}}, .velocity = {{4, -2}}, .radius = 0.1});
    const auto walls = Walls<double, 2>::all({{0, 0}}, {{1, 1}}, {Contact::separate, 0.3});
    Collisions<double, 2> collisions;
    collisions.friction = 0.9;
    collisions.find(points, walls, 0);
    collisions.change_velocities(points);
    CHECK(norm(points.velocity[0] - Vec<double, 2>{{4 - 0.3 * 2, 0}}) < 1e-14);
    REQUIRE(collisions.kept()->size() == 1);
    CHECK(collisions.kept()->front().ids == std::array{0u, firn::detail::ContactTable<double, 2>::first_surface - 2});
}

TEST_CASE("collisions: a pinned ball is a wall that moves by its velocity", "[lagrangian]") {
    auto points = two_balls(1, 1, n * 2, Vec<double, 2>::zero());
    points.pin(1, n * -1);
    const auto where = points.position[1];
    Collisions<double, 2> collisions;
    collisions.restitution = 0.5;
    collisions.apply(points);
    CHECK(dot(points.velocity[0], n) == Approx(-1 - 0.5 * 3).margin(1e-14));
    CHECK(points.velocity[1] == n * -1);
    CHECK(points.position[1] == where);
    CHECK(norm(points.position[1] - points.position[0]) == Approx(1 - contact_slack).margin(1e-14));
    points.pin(0);
    points.position[0] = where;  // both pinned, in one place
    collisions.apply(points);
    CHECK(points.position[0] == where);
    CHECK(points.velocity[0] == Vec<double, 2>::zero());
}

TEMPLATE_TEST_CASE("collisions: momentum of a dense cloud is kept to rounding, with friction and restitution",
                   "[lagrangian]", float, double) {
    using S = TestType;
    auto points = cloud<S, 3>(4000, 1, 0.02, 0.08, 2);
    double scale = 0;
    for (std::size_t i = 0; i < points.size(); ++i) scale += double(points.mass[i]);
    Collisions<S, 3> collisions;
    collisions.restitution = 0.7;
    collisions.friction = 0.3;
    const auto momentum = moment(points, points.velocity), centre = moment(points, points.position);
    collisions.apply(points, 2);
    REQUIRE(collisions.contacts() > 20000);
    // Rounding moves each of n points by a few ε, in random directions: √n ε, not n ε.
    const double allowed = 4 * double(std::numeric_limits<S>::epsilon()) * scale / std::sqrt(double(points.size()));
    const auto size = [](const Vec<long double, 3>& v) { return norm(cast<double>(v)); };
    CHECK(size(moment(points, points.velocity) - momentum) < allowed);
    CHECK(size(moment(points, points.position) - centre) < allowed);
}

TEST_CASE("collisions: without friction angular momentum is kept to rounding", "[lagrangian]") {
    auto points = cloud<double, 3>(4000, 1, 0.02, 0.08, 3);
    Collisions<double, 3> collisions;
    collisions.restitution = 1;
    collisions.velocity_passes = 6;
    const auto before = angular_momentum(points);
    collisions.find(points);
    collisions.change_velocities(points);
    CHECK(norm(angular_momentum(points) - before) < 1e-11);
}

TEST_CASE("collisions: no pass adds energy without restitution, however many contacts a ball has", "[lagrangian]") {
    for (const double friction : {0.0, 0.5}) {
        auto points = cloud<double, 3>(3000, 1, 0.05, 0.1, 4);
        Collisions<double, 3> collisions;
        collisions.friction = friction;
        collisions.velocity_passes = 1;
        double last = energy(points);
        collisions.find(points);
        REQUIRE(collisions.contacts() > 15 * points.size());
        for (int pass = 0; pass < 10; ++pass) {
            collisions.change_velocities(points);
            CHECK(energy(points) < last);
            last = energy(points);
        }
    }
}

TEST_CASE("collisions: momentum is kept over steps that begin with the impulses of the last, points taken out between",
          "[lagrangian]") {
    auto points = cloud<double, 3>(3000, 1, 0.03, 0.06, 6);
    Collisions<double, 3> collisions;
    collisions.friction = 0.5;
    for (int step = 0; step < 12; ++step) {
        const auto before = moment(points, points.velocity);
        collisions.apply(points, 2);
        REQUIRE(norm(cast<double>(moment(points, points.velocity) - before)) < 1e-12);
        for (std::size_t i = 0; i < points.size(); ++i) points.position[i] += points.velocity[i] * 1e-3;
        if (step % 4 == 1)
            collisions.renumber(points.remove_if([&](std::size_t i) { return i % 17 == std::size_t(step); }));
        if (step % 4 == 2) points.add({.position = {{0.5, 0.5, 0.5}}, .radius = 0.1});
    }
}

TEST_CASE("collisions: shifts add no overlap and end what they can", "[lagrangian]") {
    // A row of five, each over its neighbours by 0.02: it has room at its ends.
    PointMasses<double, 3> points;
    for (int i = 0; i < 5; ++i) points.add({.position = {{0.18 * i, 0, 0}}, .radius = 0.1});
    Collisions<double, 3> collisions;
    collisions.shift_passes = 1;
    double last = 0.02;
    collisions.find(points);
    for (int pass = 0; pass < 60; ++pass) {
        collisions.shift(points);
        double worst = 0;
        for (int i = 0; i < 4; ++i) worst = std::max(worst, 0.2 - (points.position[i + 1][0] - points.position[i][0]));
        CHECK(worst <= last + 1e-15);
        last = worst;
    }
    CHECK(last < 0.2 * contact_slack + 1e-4);
}

TEMPLATE_TEST_CASE_SIG("collisions: points in one place are parted along a direction that their ids give",
                       "[lagrangian]", ((class S, int D), S, D), (float, 2), (float, 3), (double, 2), (double, 3)) {
    const auto apart = [](double gap, bool with_another_before) {
        PointMasses<S, D> points;
        auto beside = Vec<double, D>::filled(0.5);
        beside[0] += gap;
        for (int i = 0; i < 3; ++i) points.add({.position = Vec<double, D>::filled(0.5), .mass = 2, .radius = 0.1});
        points.add({.position = beside, .radius = 0.1});
        points.remove_if([&](std::size_t i) { return i == (with_another_before ? 2 : 0); });
        if (with_another_before) points.position[0] = Vec<double, D>::filled(9);
        Collisions<S, D> collisions;
        collisions.restitution = 1;
        collisions.apply(points);
        const auto way = points.position[points.size() - 1] - points.position[points.size() - 2];
        for (const auto& x : points.position)
            for (int a = 0; a < D; ++a) REQUIRE(std::isfinite(x[a]));
        return with_another_before ? norm(way) : norm(points.position[1] - points.position[0]);
    };
    CHECK(apart(0, true) == Approx(0.2 * (1 - contact_slack)));
    CHECK(apart(1e-40, true) == Approx(0.2 * (1 - contact_slack)));
    CHECK(apart(double(std::numeric_limits<S>::denorm_min()), true) == Approx(0.2 * (1 - contact_slack)));
    CHECK(apart(0, false) > 0.1);  // three in one place
    for (std::uint32_t i = 0; i < 50; ++i)
        for (std::uint32_t j = 0; j < i; ++j) {
            const auto way = detail::direction_of_ids<S, D>(i, j);
            CHECK(way == -detail::direction_of_ids<S, D>(j, i));
            CHECK(norm(way) == Approx(1));
        }
}

TEST_CASE("collisions: points of one group ignore each other, those of group 0 nobody", "[lagrangian]") {
    PointMasses<double, 2> points;
    for (const std::uint32_t group : {0u, 0u, 1u, 1u, 2u})
        points.add({.position = {{0.01 * double(points.size()), 0}}, .radius = 1, .group = group});
    Collisions<double, 2> collisions;
    collisions.find(points);
    auto pairs = pairs_of(collisions);
    CHECK(pairs.size() == 5 * 4 - 2);
    CHECK(pairs.count({2, 3}) == 0);
    CHECK(pairs.count({0, 1}) == 1);
}

TEST_CASE("collisions: excluded pairs do not collide, and follow their points when others are taken out",
          "[lagrangian]") {
    PointMasses<double, 2> points;
    for (int i = 0; i < 6; ++i) points.add({.position = {{0.01 * i, 0}}, .radius = 1});
    Collisions<double, 2> collisions;
    const Link links[] = {{1, 4}, {4, 2}};
    collisions.exclude(links, 1);  // places 2 and 5, 5 and 3
    const std::array<std::uint32_t, 2> more[] = {{0, 1}};
    collisions.exclude(more);
    collisions.find(points);
    auto pairs = pairs_of(collisions);
    CHECK(pairs.size() == 6 * 5 - 6);
    for (const Pair& pair : {Pair{2, 5}, {5, 2}, {3, 5}, {5, 3}, {0, 1}, {1, 0}}) CHECK(pairs.count(pair) == 0);

    const auto removed = [](std::size_t i) { return i == 1 || i == 3; };
    SECTION("renumbered") {
        collisions.renumber(points.remove_if(removed));
        collisions.find(points);
        pairs = pairs_of(collisions);
        CHECK(pairs.size() == 4 * 3 - 2);
        CHECK(pairs.count({1, 3}) == 0);  // once 2 and 5
        CHECK(collisions.excluded().size() == 1);
        collisions.renumber(points.remove_if([](std::size_t) { return false; }));
        CHECK(collisions.excluded().size() == 1);
    }
    SECTION("forgotten: said, not misread") {
        points.remove_if(removed);
        CHECK_THROWS_AS(collisions.find(points), parameter_error);
    }
    SECTION("new places of fewer points than the pairs name") {
        const std::uint32_t places[] = {0, 1, 2};
        CHECK_THROWS_AS(collisions.renumber(places), parameter_error);
    }
}

TEST_CASE("collisions: the same bits for any number of threads", "[lagrangian]") {
    std::vector<PointMasses<float, 3>> ends;
    for (const int threads : test_support::fewer_if_quick(std::vector{1, 2, 3, 4, 7}, std::vector{1, 3})) {
        auto points = cloud<float, 3>(12000, 1, 0.01, 0.04, 5);
        Collisions<float, 3> collisions;
        collisions.restitution = 0.5;
        collisions.friction = 0.4;
        for (int step = 0; step < 3; ++step) {
            collisions.apply(points, threads);
            for (std::size_t i = 0; i < points.size(); ++i)
                points.position[i] += cast<double>(points.velocity[i]) * 0.01;
        }
        ends.push_back(points);
    }
    for (const auto& end : ends) {
        CHECK(end.position == ends[0].position);
        CHECK(end.velocity == ends[0].velocity);
    }
}

TEST_CASE("collisions: a high pile comes to rest on few passes, under its weight not pressed together",
          "[lagrangian][slow]") {
    const double r = 0.05, dt = 1e-3, g = 9.81;
    const int wide = 8, high = 25;
    for (const bool between : {false, true}) {  // impulses after points have moved, or before
        PointMasses<double, 2> points;          // in closest packing, loosened
        for (int j = 0; j < high; ++j)
            for (int i = 0; i < wide; ++i)
                points.add({.position = {{r * (1 + 2 * i + j % 2 + 0.01 * std::sin(7.0 * i + j)), r * (1 + 1.75 * j)}},
                            .radius = r});
        const auto walls = Walls<double, 2>::all({{0, 0}}, {{r * (2 * wide + 1.01), 9}}, {Contact::separate, 0.2});
        Collisions<double, 2> collisions;
        collisions.friction = 0.3;
        for (int step = 0; step < 1500; ++step) {
            for (auto& v : points.velocity) v[1] -= g * dt;
            if (between) {
                collisions.find(points, walls, 0);
                collisions.change_velocities(points);
            }
            for (std::size_t i = 0; i < points.size(); ++i) points.position[i] += points.velocity[i] * dt;
            if (between) {
                collisions.shift(points);
                meet_surfaces(points, walls);
            } else {
                collisions.apply(points, walls, 0);
            }
        }
        double height = 0, speed = 0, deepest = 0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            height += points.position[i][1] / double(points.size());
            speed += norm(points.velocity[i]) / double(points.size());
        }
        collisions.for_contacts([&](std::uint32_t i, std::uint32_t j) {
            deepest = std::max(deepest, 2 * r - norm(points.position[i] - points.position[j]));
        });
        CHECK(height == Approx(r * (1 + std::sqrt(3.0) * (high - 1) / 2)).epsilon(0.02));
        CHECK(speed < 0.05 * g * dt);  // of a single step of falling
        CHECK(deepest < 0.05 * r);
    }
}

TEST_CASE("collisions: a column that rests on the floor weighs on it, contact by contact", "[lagrangian]") {
    // Impulses of many steps add up to the weights, of heavy balls on light ones at that: nothing moves but by
    // rounding.
    PointMasses<double, 2> points;
    for (int i = 0; i < 6; ++i) points.add({.position = {{0, 0.0999 + 0.19985 * i}}, .mass = 1.0 + i, .radius = 0.1});
    Collider<HalfSpace<double, 2>> floor;
    Collisions<double, 2> collisions;
    double fastest = 0;
    for (int step = 0; step < 3000; ++step) {
        for (auto& v : points.velocity) v[1] -= 0.01;
        collisions.find(points, floor, 0);
        collisions.change_velocities(points);
        fastest = 0;
        for (const auto& v : points.velocity) fastest = std::max(fastest, norm(v));
    }
    CHECK(fastest < 1e-12);
    collisions.remember = false;  // six passes know nothing of six balls
    for (auto& v : points.velocity) v[1] -= 0.01;
    collisions.find(points, floor, 0);
    collisions.change_velocities(points);
    fastest = 0;
    for (const auto& v : points.velocity) fastest = std::max(fastest, norm(v));
    CHECK(fastest > 0.001);
}

TEST_CASE("collisions: a blow is not repeated in the step after it", "[lagrangian]") {
    for (const double e : {0.0, 0.6}) {
        auto points = two_balls(1, 2, n * 2, n * -1);
        Collisions<double, 2> collisions;
        collisions.restitution = e;
        collisions.shift_passes = 0;  // they still overlap
        collisions.apply(points);
        const auto after = points.velocity.copy();
        for (int step = 0; step < 3; ++step) collisions.apply(points);
        CHECK(norm(points.velocity[0] - after[0]) < 1e-14);
        CHECK(norm(points.velocity[1] - after[1]) < 1e-14);
    }
}

TEST_CASE("collisions: a blow to many is not repeated either: the step after it adds no energy", "[lagrangian]") {
    auto points = cloud<double, 3>(2000, 1, 0.04, 0.08, 7);
    Collisions<double, 3> collisions;
    collisions.shift_passes = 0;
    collisions.velocity_passes = 60;
    collisions.apply(points);
    const double after = energy(points);
    collisions.velocity_passes = 1;  // which could not take back a second blow
    collisions.apply(points);
    CHECK(energy(points) < after);
}

TEST_CASE("collisions: numbers that cannot be are refused", "[lagrangian]") {
    auto points = two_balls(1, 1, n, t);
    for (const double wrong : {-0.1, 1.1, std::nan("")}) {
        Collisions<double, 2> collisions;
        collisions.restitution = wrong;
        CHECK_THROWS_AS(collisions.apply(points), parameter_error);
    }
    for (const double wrong : {-0.1, std::numeric_limits<double>::infinity(), std::nan("")}) {
        Collisions<double, 2> collisions;
        collisions.friction = wrong;
        CHECK_THROWS_AS(collisions.apply(points), parameter_error);
    }
    Collisions<double, 2> collisions;
    collisions.shift_passes = -1;
    CHECK_THROWS_AS(collisions.apply(points), parameter_error);
    collisions.shift_passes = 1;
    points.position[1][0] = std::nan("");
    CHECK_THROWS_AS(collisions.apply(points), particle_error);
}

}  // namespace collisions_tests
