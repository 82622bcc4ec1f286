// part: arithmetic
/// \file Constraints of distance: the catenary, compliance, tearing, and the same bits for any number of threads.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/random_numbers.hpp"
#include <firn/lagrangian/cloth.hpp>
#include <firn/lagrangian/particle_system.hpp>

#include <cmath>
#include <cstring>
#include <set>

using namespace firn;

namespace constraints_tests {

namespace {

constexpr ConstraintUpdate updates[] = {ConstraintUpdate::immediate, ConstraintUpdate::coloured,
                                        ConstraintUpdate::averaged};

/// n × n squares of side a.
Net<3> square(std::size_t n, double a) {
    const double side = a * double(n);
    return cloth({0.0, 0.0, 0.0}, {side, 0.0, 0.0}, {0.0, 0.0, side}, {n, n}, Diagonals::parallel);
}

/// a of the catenary y = a cosh(x/a) that hangs `length` long between two nails `width` apart: 2 a sinh(width/2a).
double catenary(double width, double length) {
    double low = 1e-3 * width, high = 1e3 * width;
    for (int i = 0; i < 200; ++i) {
        const double a = std::sqrt(low * high);
        (2 * a * std::sinh(width / (2 * a)) > length ? low : high) = a;
    }
    return low;
}

}  // namespace

TEST_CASE("a hanging chain is a catenary", "[lagrangian][slow]") {
    const int links = 40;
    const double width = 1, length = 1.5, a = catenary(width, length);
    for (const ConstraintUpdate update : {ConstraintUpdate::immediate, ConstraintUpdate::coloured}) {
        ParticleSystem<2, double> system;
        system.damping = 2;
        system.iterations = 20;
        system.constraints.update = update;
        // It begins as a triangle of the same length.
        const double deep = std::sqrt(length * length - width * width) / 2;
        for (int i = 0; i <= links; ++i) {
            const double s = double(i) / links;
            system.points.add({.position = {{width * s, -deep * (1 - std::abs(2 * s - 1))}}});
        }
        system.points.pin(0);
        system.points.pin(links);
        for (std::uint32_t i = 0; i < links; ++i) system.constraints.add({i, i + 1}, length / links);
        system.advance(12, 1e-3);
        const double lowest = a * std::cosh(width / (2 * a));
        for (const auto& x : system.points.position) {
            const double y = a * std::cosh((x[0] - width / 2) / a) - lowest;
            CHECK(std::abs(x[1] - y) < 0.002 * length);  // links are chords: (Δs)²/8a = 4e-4, and 1e-3 of stretch
        }
        double total = 0;
        for (std::size_t i = 0; i < links; ++i)
            total += norm(system.points.position[i + 1] - system.points.position[i]);
        CHECK(total == Approx(length).epsilon(1e-3));
    }
}

TEST_CASE("a weight on a compliant constraint sinks by m g alpha, whatever the iterations and the step",
          "[lagrangian]") {
    const double m = 2, alpha = 0.01;
    for (const ConstraintUpdate update : updates)
        for (const int iterations : {1, 8, 50})
            for (const double dt : {0.01, 0.002}) {
                ParticleSystem<2, double> system;
                system.damping = 5;
                system.iterations = iterations;
                system.constraints.update = update;
                system.points.add({});
                system.points.add({.position = {{0, -1}}, .mass = m});
                system.points.pin(0);
                system.constraints.add({0, 1}, 1, {.compliance = alpha});
                system.advance(8, dt);
                CHECK(-system.points.position[1][1] - 1 == Approx(m * 9.81 * alpha).epsilon(1e-6));
            }
}

TEST_CASE("constraints among free points keep their momentum, in any order of correction", "[lagrangian]") {
    for (const ConstraintUpdate update : updates) {
        test_support::Random random(3);
        ParticleSystem<3, double> system;
        system.gravity = Vec<double, 3>::zero();
        system.constraints.update = update;
        const Net<3> net = square(12, 0.1);
        system.add(net, {});
        for (std::size_t i = 0; i < system.points.size(); ++i) {
            for (int a = 0; a < 3; ++a) system.points.velocity[i][a] = random.uniform(-1, 1);
            system.points.mass[i] = random.uniform(0.5, 2);
            system.points.inverse_mass[i] = 1 / system.points.mass[i];
        }
        system.constraints.add(net, {.compliance = 1e-6});
        const auto momentum = [&] {
            auto sum = Vec<double, 3>::zero();
            for (std::size_t i = 0; i < system.points.size(); ++i)
                sum += system.points.velocity[i] * system.points.mass[i];
            return sum;
        };
        const auto before = momentum();
        system.advance(0.5, 0.01);
        CHECK(norm(momentum() - before) < 1e-10);
        double stretch = 0;
        for (const auto& each : system.constraints.all())
            stretch = std::max(
                stretch,
                std::abs(norm(system.points.position[each.ends[1]] - system.points.position[each.ends[0]]) / each.rest -
                         1));
        CHECK(stretch < 0.25);
    }
}

TEST_CASE("links of one colour share no point, and a hub of many links is still solved", "[lagrangian]") {
    Net<3> net = square(9, 1);
    std::vector<std::array<std::uint32_t, 2>> links;
    for (const Link& link : net.links) links.push_back({link.a, link.b});
    const std::uint32_t hub = 0;
    for (std::uint32_t i = 1; i < 100; ++i) links.push_back({hub, i});
    const firn::detail::LinkColours colours(links, net.positions.size());
    std::set<std::pair<int, std::uint32_t>> seen;
    int without = 0;
    for (std::size_t k = 0; k < links.size(); ++k) {
        if (colours.colour[k] == firn::detail::LinkColours::most) {
            ++without;
            continue;
        }
        for (const std::uint32_t point : links[k]) CHECK(seen.insert({colours.colour[k], point}).second);
    }
    CHECK(colours.count == firn::detail::LinkColours::most);
    CHECK(without > 30);
    auto changed = colours.colour;
    CHECK(are_colours(changed, links, net.positions.size()));
    changed[0] = firn::detail::LinkColours::most + 1;  // there is none
    CHECK_FALSE(are_colours(changed, links, net.positions.size()));

    // A wheel: spokes of one length, all pulled in.
    ParticleSystem<2, double> system;
    system.gravity = Vec<double, 2>::zero();
    system.points.add({});
    for (int i = 0; i < 100; ++i) {
        const double angle = 0.06 * i;
        system.points.add({.position = {{1.3 * std::cos(angle), 1.3 * std::sin(angle)}}});
        system.constraints.add({0, std::uint32_t(i + 1)}, 1);
    }
    system.points.pin(0);
    system.step(0.01);
    for (std::size_t i = 1; i <= 100; ++i) CHECK(norm(system.points.position[i]) == Approx(1).epsilon(1e-12));
}

TEMPLATE_TEST_CASE("the same bits for 1, 2, 3, 4 and 7 threads, in any order of correction", "[lagrangian]",
                   FIRN_TEST_PRECISIONS) {
    using S = TestType;
    for (const ConstraintUpdate update : updates) {
        const auto run = [&](int threads) {
            ParticleSystem<3, S> system;
            system.threads = threads;
            system.constraints.update = update;
            const Net<3> net = square(50, 0.02);
            system.add(net, {.mass = 0.001});
            system.points.pin(0);
            system.points.pin(50);
            system.constraints.add(net, {.compliance = 1e-5});
            system.add_force(springs_of<S>(net, SpringOptions{0.1, 1e-4}));
            system.add_force(aerodynamic_surface_of(net, AerodynamicDrag<S, 3>{S(1.2), 1, {{1, 0, 2}}}));
            for (int i = 0; i < test_support::fewer_if_quick(15, 6); ++i) system.step(0.005);
            return std::pair(system.points.position.copy(), system.points.velocity.copy());
        };
        const auto one = run(1);
        CHECK(one.first[2000][1] < 0);
        for (const int threads : test_support::other_threads) {
            const auto other = run(threads);
            CHECK(std::memcmp(one.first.data(), other.first.data(), one.first.size() * sizeof(Vec<S, 3>)) == 0);
            CHECK(std::memcmp(one.second.data(), other.second.data(), one.second.size() * sizeof(Vec<S, 3>)) == 0);
        }
    }
}

TEST_CASE("cloth that is pulled apart tears along a line, and what is left holds together", "[lagrangian][slow]") {
    const int n = 20;
    ParticleSystem<3, double> system;
    system.gravity = Vec<double, 3>::zero();
    const Net<3> net = square(n, 0.05);
    const auto edge = [](int i, int j) { return std::uint32_t(j * 21 + i); };
    system.add(net, {.mass = 0.01});
    system.damping = 5;
    system.constraints.add(net, {.compliance = 1e-3});
    auto& wind = system.add_force(aerodynamic_surface_of(net, AerodynamicDrag<double, 3>{}));
    system.constraints.tear_factor = 1.5;
    for (int j = 0; j <= n; ++j) {
        system.points.pin(edge(0, j), {{-0.2, 0, 0}});
        system.points.pin(edge(n, j), {{0.2, 0, 0}});
    }
    const std::size_t at_first = system.constraints.size();
    system.advance(0.5, 0.005);  // to 1.2 times its length
    CHECK(system.constraints.size() == at_first);
    system.advance(3, 0.005);
    CHECK(system.constraints.size() < at_first);
    CHECK(system.constraints.size() > at_first / 2);
    CHECK(system.facets.size() < net.facets.size());
    CHECK(wind.size() == system.facets.size());

    std::set<std::pair<std::uint32_t, std::uint32_t>> links;
    for (const auto& each : system.constraints.all()) {
        links.insert(std::minmax(each.ends[0], each.ends[1]));
        CHECK(norm(system.points.position[each.ends[1]] - system.points.position[each.ends[0]]) <= 1.5 * each.rest);
    }
    // No facet hangs on a link that is gone: of its three sides all are links still.
    for (const auto& f : system.facets)
        for (std::size_t k = 0; k < 3; ++k) CHECK(links.count(std::minmax(f[k], f[(k + 1) % 3])) == 1);
    // It is in two parts: no way leads from one row of pins to the other.
    std::vector<std::uint32_t> part(system.points.size());
    for (std::uint32_t i = 0; i < part.size(); ++i) part[i] = i;
    for (std::size_t pass = 0; pass < part.size(); ++pass)
        for (const auto& [a, b] : links) part[a] = part[b] = std::min(part[a], part[b]);
    CHECK(part[edge(0, 0)] != part[edge(n, 0)]);
}

TEST_CASE("a link across a torn one goes with it, a support link stays", "[lagrangian]") {
    for (const LinkKind kind : {LinkKind::shear, LinkKind::bend, LinkKind::support}) {
        DistanceConstraints<double, 2> constraints;
        constraints.tear_factor = 1.5;
        constraints.add(Net<2>{{{0, 0}, {1, 0}, {2, 0}}, {{0, 1}, {1, 2}, {0, 2, kind}}, {}});
        const std::vector<Vec<double, 2>> x{{0, 0}, {1.6, 0}, {2.2, 0}};  // only the first is too long
        const auto torn = constraints.torn(x);
        CAPTURE(int(kind));
        CHECK(torn.size() == (kind == LinkKind::support ? 1 : 2));
        CHECK(torn.size() + constraints.size() == 3);
    }
}

TEST_CASE("averaged corrections do not overshoot at a point of many constraints, whichever of their ends it is",
          "[lagrangian]") {
    // Four constraints ask of point 0 for the same metre.
    using Ends = DistanceConstraints<double, 2>::Ends;
    for (const bool is_first : {true, false}) {
        DistanceConstraints<double, 2> constraints;
        constraints.update = ConstraintUpdate::averaged;
        std::vector<Vec<double, 2>> x(5, {2, 0});
        x[0] = {0, 0};
        const std::vector<double> inverse_mass{1, 0, 0, 0, 0};
        for (std::uint32_t i = 1; i <= 4; ++i) constraints.add(is_first ? Ends{0, i} : Ends{i, 0}, 1);
        constraints.solve(x, inverse_mass, 0.1, 1, 1);
        CHECK(norm(x[0] - Vec<double, 2>{1, 0}) <= 1e-15);
    }
}

TEST_CASE("constraints that cannot be are refused", "[lagrangian]") {
    DistanceConstraints<float, 3> constraints;
    CHECK_THROWS_AS(constraints.add({0, 1}, 0), parameter_error);
    CHECK_THROWS_AS(constraints.add({0, 1}, std::nan("")), parameter_error);
    CHECK_THROWS_AS(constraints.add({1, 1}, 1), parameter_error);
    CHECK_THROWS_AS(constraints.add({0, 1}, 1, {.compliance = -1}), parameter_error);
    CHECK_THROWS_AS(constraints.add({0, 1}, 1, {.relaxation = 0}), parameter_error);
    const Net<3> folded{{{{1, 1, 1}}, {{1, 1, 1}}}, {{0, 1}}, {}};
    CHECK_THROWS_WITH(constraints.add(folded), Catch::Contains("points 0 and 1"));
    CHECK(constraints.size() == 0);
    ParticleSystem<3> system;
    system.points.add({});
    system.constraints.add({0, 4}, 1);
    CHECK_THROWS_WITH(system.step(0.1), Catch::Contains("point 4"));
    system.constraints.tear_factor = 0.5;
    CHECK_THROWS_WITH(system.step(0.1), Catch::Contains("above 1"));
}

TEST_CASE("two ends at one place are pushed apart", "[lagrangian]") {
    ParticleSystem<2, double> system;
    system.gravity = Vec<double, 2>::zero();
    system.points.add({});
    system.points.add({});
    system.constraints.add({0, 1}, 1);
    system.step(0.01);
    CHECK(norm(system.points.position[1] - system.points.position[0]) == Approx(1));
}

}  // namespace constraints_tests
