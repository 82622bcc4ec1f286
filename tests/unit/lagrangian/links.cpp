// part: arithmetic
/// \file What the correction of links promises: angular momentum and energy of what turns, steps of any size under any
/// tension, the same numbers in SIMD lanes as one by one, and a warning where iterations do not solve the constraints.
#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/lagrangian/cloth.hpp>
#include <firn/lagrangian/particle_system.hpp>
#include <firn/lagrangian/rope.hpp>

#include <cmath>
#include <string>
#include <vector>

using namespace firn;

namespace links_tests {

namespace {

using V = Vec<double, 2>;
constexpr double g = 9.81;

template <class System>
double spin(const System& system) {
    double sum = 0;
    for (std::size_t i = 0; i < system.points.size(); ++i) {
        const auto &x = system.points.position[i], &v = system.points.velocity[i];
        sum += system.points.mass[i] * (x[0] * v[1] - x[1] * v[0]);
    }
    return sum;
}

/// A rope of light points that hangs tilted from a pin, with a weight at its end.
template <class S>
ParticleSystem<2, S> loaded_rope(double weight, double compliance, double angle) {
    ParticleSystem<2, S> system;
    system.warn = {};
    constexpr std::uint32_t n = 20;
    const double link = 0.05;
    for (std::uint32_t i = 0; i <= n; ++i)
        system.points.add(
            {.position = {i * link * std::sin(angle), -(i * link * std::cos(angle))}, .mass = i == n ? weight : 0.01});
    system.points.pin(0);
    for (std::uint32_t i = 0; i < n; ++i) system.constraints.add({i, i + 1}, link, {.compliance = compliance});
    return system;
}

/// What link_solver.hpp says, one link after another.
template <int D>
void correct_by_definition(const DistanceConstraints<double, D>& constraints, const std::vector<double>& compliances,
                           const std::vector<Vec<double, D>>& start, std::vector<Vec<double, D>>& moved,
                           const std::vector<double>& inverse_mass, double dt, int iterations) {
    std::vector<double> lambda(constraints.size(), 0), count(start.size(), 0);
    for (const auto& each : constraints.all())
        for (const std::uint32_t end : each.ends) ++count[end];
    for (int i = 0; i < iterations; ++i)
        for (std::size_t k = 0; k < constraints.size(); ++k) {
            const auto [a, b] = constraints.all()[k].ends;
            const double rest = constraints.all()[k].rest, w = inverse_mass[a] + inverse_mass[b];
            const double soft = compliances[k] / (dt * dt), n = std::max(count[a], count[b]);
            const Vec<double, D> s = start[b] - start[a], r = s + moved[b] - moved[a];
            const Vec<double, D> then = s * (1 / norm(s)), now = r * (1 / norm(r));
            const auto change = [&](const Vec<double, D>& d) {
                return (rest - norm(r) - soft * lambda[k]) / (w * dot(d, now) + soft);
            };
            const double pull = n * w * -(lambda[k] + change(then)) / rest;
            const double beta = dot(then, now) < 0.5 ? 1 : pull > 2 ? 1 - 2 / pull : 0;
            Vec<double, D> d = then * (1 - beta) + now * beta;
            d = d * (1 / norm(d));
            const double by = change(d);
            lambda[k] += by;
            moved[a] -= d * (by * inverse_mass[a]);
            moved[b] += d * (by * inverse_mass[b]);
        }
}

}  // namespace

TEMPLATE_TEST_CASE("links: a dumbbell keeps its angular momentum and its energy, rigid or compliant", "[lagrangian]",
                   Verlet, SymplecticEuler) {
    for (const double compliance : {0.0, 1e-4})
        for (const double dt : {0.02, 0.01, 1e-3}) {
            CAPTURE(compliance, dt);
            ParticleSystem<2, double, TestType> system;
            system.gravity = {};
            // 10 rad/s; a link that yields is as long as its centripetal force asks for.
            const double half = 0.5 + compliance * 25;
            system.points.add({.position = {-half, 0}, .velocity = {0, -5}});
            system.points.add({.position = {half, 0}, .velocity = {0, 5}});
            system.constraints.add({0U, 1U}, 1.0, {.compliance = compliance});
            const double before = spin(system);
            system.advance(10, dt);
            CHECK(spin(system) == Approx(before).epsilon(1e-12));
            CHECK(norm(system.points.position[0] + system.points.position[1]) < 1e-12);
            // Velocities are those of chords; a link that yields swings by what the force changes with its length.
            CHECK(norm(system.points.velocity[0]) == Approx(5).epsilon(20 * dt * dt + 1e-4));
        }
}

TEST_CASE("links: a triangle in space keeps its angular momentum with every update, and a float's", "[lagrangian]") {
    for (const ConstraintUpdate update :
         {ConstraintUpdate::immediate, ConstraintUpdate::coloured, ConstraintUpdate::averaged}) {
        const auto run = [&]<class S>(S) {
            ParticleSystem<3, S> system;
            system.gravity = {};
            system.constraints.update = update;
            system.iterations = 30;
            const Vec<double, 3> corners[] = {{0.3, 0, 0}, {-0.2, 0.4, 0.1}, {-0.1, -0.3, 0.2}}, turn{3, -2, 6};
            for (const auto& x : corners) system.points.add({.position = x, .velocity = cross(turn, x)});
            for (const auto& [a, b] : {std::pair{0U, 1U}, {1U, 2U}, {2U, 0U}})
                system.constraints.add({a, b}, norm(corners[a] - corners[b]));
            const auto momentum = [&] {
                Vec<double, 3> sum{};
                for (std::size_t i = 0; i < 3; ++i)
                    sum += cross(system.points.position[i], cast<double>(system.points.velocity[i]));
                return sum;
            };
            const auto before = momentum();
            system.advance(10, 2e-3);
            return norm(momentum() - before) / norm(before);
        };
        CAPTURE(int(update));
        CHECK(run(0.0) < 1e-10);
        CHECK(run(0.0F) < 1e-3);
    }
}

TEST_CASE("links: a rigid pendulum keeps its height, and its time is of second order", "[lagrangian]") {
    const auto highest_of = [](double dt) {
        ParticleSystem<2, double> swing;
        swing.points.add({});
        swing.points.pin(0);
        swing.points.add({.position = {std::sin(0.5), -std::cos(0.5)}});
        swing.constraints.add({0U, 1U}, 1.0);
        double highest = 0, last = -1, crossed = 0;
        int crossings = 0;
        while (swing.time() < 40) {
            swing.step(dt);
            const double x = swing.points.position[1][0];
            if (last > 0 && x <= 0) {
                crossed = swing.time() - dt * x / (x - last);
                ++crossings;
            }
            last = x;
            if (swing.time() > 35) highest = std::max(highest, 1 + swing.points.position[1][1]);
        }
        return std::pair{highest / (1 - std::cos(0.5)), crossed / (crossings - 0.75)};
    };
    // 2π √(l/g) (1 + θ²/16 + 11 θ⁴/3072 + …)
    const double period = 2 * 3.14159265358979 / std::sqrt(g) * (1 + 0.25 / 16 + 11 * 0.0625 / 3072);
    const auto [height, time] = highest_of(0.01);
    const auto [finer_height, finer_time] = highest_of(0.005);
    CHECK(height == Approx(1).epsilon(2e-3));
    CHECK(finer_height == Approx(1).epsilon(5e-4));
    CHECK(std::abs(finer_time - period) < std::abs(time - period) / 3);
    CHECK(finer_time == Approx(period).epsilon(2e-4));
}

TEST_CASE("links: light points under a heavy load stay in line, in steps that are far too long for them",
          "[lagrangian][slow]") {
    // k = n w dt² T/l₀ is 2 × 200 × 9.81 × dt² / 0.05 per link: 8 for 10 ms. Along e₀ alone, the rope would not end.
    for (const double compliance : {0.0, 1e-4})
        for (const int iterations : {8, 50})
            for (const double dt : {0.01, 0.002}) {
                CAPTURE(compliance, iterations, dt);
                auto system = loaded_rope<double>(1, compliance, 0.4);
                system.iterations = iterations;
                double sharpest = 1;
                for (double end = 15; system.time() < end;) {
                    system.step(dt);
                    for (std::size_t i = 1; i < 20; ++i) {
                        const V a = system.points.position[i] - system.points.position[i - 1],
                                b = system.points.position[i + 1] - system.points.position[i];
                        sharpest = std::min(sharpest, dot(a, b) / (norm(a) * norm(b)));
                    }
                }
                CHECK(sharpest > 0.99);  // 8°
                CHECK(system.points.position[20][1] < -0.9);
            }
}

TEST_CASE("links: what turns by more than 60° in a step is still solved", "[lagrangian]") {
    for (const double turn : {0.5, 1.0, 1.2, 2.0, 3.0, 3.14159265358979}) {
        DistanceConstraints<double, 2> constraints;
        constraints.add({0, 1}, 1);
        const std::vector<V> start{{0, 0}, {1, 0}};
        std::vector<V> moved{{0, 0}, V{1.2 * std::cos(turn), 1.2 * std::sin(turn)} - start[1]};
        const std::vector<double> inverse_mass{1, 2};
        constraints.solve(start, moved, inverse_mass, 0.01, 8, 1);
        CHECK(norm(start[1] + moved[1] - moved[0]) == Approx(1).epsilon(1e-6));
        CHECK(norm(moved[0] * 2 + moved[1] - (V{1.2 * std::cos(turn), 1.2 * std::sin(turn)} - start[1])) < 1e-12);
    }
}

TEST_CASE("links: lanes give what the definition says, straight and turned, soft and rigid", "[lagrangian]") {
    for (const bool soft : {false, true})
        for (const double disorder : {0.01, 0.6}) {
            CAPTURE(soft, disorder);
            test_support::Random random(4);
            const Net<3> net = cloth({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {12, 9});
            const std::size_t count = net.positions.size();
            DistanceConstraints<double, 3> constraints;
            std::vector<double> compliances, given;
            for (const Link& link : net.links) {
                given.push_back(soft ? random.uniform(0, 2e-4) : 0);
                constraints.add({link.a, link.b}, rest_length(net, link), {.compliance = given.back()});
            }
            std::vector<double> inverse_mass;
            std::vector<Vec<double, 3>> moved;
            for (std::size_t i = 0; i < count; ++i) {
                inverse_mass.push_back(i % 7 == 3 ? 0 : random.uniform(1, 50));
                moved.push_back(random.vector<3>(-0.1 * disorder, 0.1 * disorder));
            }
            auto expected = moved;
            constraints.solve(net.positions, moved, inverse_mass, 0.01, 3, 1);
            for (const auto& each : constraints.all())  // sorted by colours now
                for (std::size_t k = 0; k < net.links.size(); ++k)
                    if (each.ends[0] == net.links[k].a && each.ends[1] == net.links[k].b)
                        compliances.push_back(given[k]);
            REQUIRE(compliances.size() == constraints.size());
            correct_by_definition(constraints, compliances, net.positions, expected, inverse_mass, 0.01, 3);
            double off = 0;
            for (std::size_t i = 0; i < count; ++i) off = std::max(off, norm(moved[i] - expected[i]));
            CHECK(off < 1e-10);
        }
}

TEST_CASE("links: with averaged corrections a symmetric cloth stays symmetric", "[lagrangian]") {
    const auto crooked = [](ConstraintUpdate update) {
        ParticleSystem<3, double> system;
        system.warn = {};
        system.damping = 0.5;
        system.constraints.update = update;
        const Net<3> net = cloth({-1, 0, 0}, {2, 0, 0}, {0, 0, 2}, {10, 10});
        system.add(net, {.mass = 0.01});
        for (const std::uint32_t corner : {0U, 10U}) system.points.pin(corner);
        system.constraints.add(net);
        system.advance(0.5, 2e-3);
        double most = 0;
        for (std::size_t i = 0; i < 121; ++i) {
            Vec<double, 3> mirrored = system.points.position[i / 11 * 11 + 10 - i % 11];
            mirrored[0] = -mirrored[0];
            most = std::max(most, norm(system.points.position[i] - mirrored));
        }
        return most;
    };
    CHECK(crooked(ConstraintUpdate::averaged) < 1e-9);
    CHECK(crooked(ConstraintUpdate::coloured) > 1e-4);  // the order of links is not symmetric
}

TEST_CASE("links: iterations that do not solve the constraints are said once, and those that do are not",
          "[lagrangian]") {
    const auto said_of = [](int iterations, double dt, double point, double compliance, auto change) {
        ParticleSystem<2, double> system;
        std::vector<std::string> said;
        system.warn = [&](const std::string& text) { said.push_back(text); };
        system.damping = 5;
        system.iterations = iterations;
        system.points.add({});
        system.points.pin(0);
        for (std::uint32_t i = 1; i <= 10; ++i) {
            system.points.add({.position = {0, -0.1 * i}, .mass = i == 10 ? 1 : point});
            system.constraints.add({i - 1, i}, 0.1, {.compliance = compliance});
        }
        change(system);
        for (int i = 0; i < 400; ++i) system.step(dt);
        double exact = 0;
        for (int i = 1; i <= 10; ++i) exact += compliance * g * (1 + point * (10 - i));
        const double stretch = -1 - system.points.position[10][1];
        const ConstraintErrors errors = system.constraints.errors();
        CHECK(errors.compliant_count == (compliance > 0 ? 10 : 0));
        CHECK(errors.rigid_count == (compliance > 0 ? 0 : 10));
        return std::tuple{said, stretch - exact, exact};
    };
    const auto as_is = [](auto&) {};
    for (const auto& [iterations, dt, point, compliance, is_solved] : {std::tuple{8, 1e-2, 1e-3, 1e-4, false},
                                                                       {8, 1e-3, 1e-3, 1e-4, false},
                                                                       {1, 1e-2, 1.0, 1e-4, false},
                                                                       {8, 1e-2, 1.0, 1e-4, true},
                                                                       {100, 1e-2, 1.0, 1e-4, true},
                                                                       {8, 1e-2, 1e-2, 0.0, false},
                                                                       {100, 1e-2, 1.0, 0.0, true}}) {
        CAPTURE(iterations, dt, point, compliance);
        const auto [said, error, exact] = said_of(iterations, dt, point, compliance, as_is);
        CHECK(said.size() == (is_solved ? 0 : 1));
        CHECK((std::abs(error) < 0.02 * std::max(exact, 0.05)) == is_solved);
        if (is_solved) continue;
        const bool is_rigid = compliance == 0;
        CHECK(said.at(0).find(is_rigid ? "rigid_tolerance" : "compliant_tolerance") != std::string::npos);
        CHECK(said.at(0).find("at step 31") != std::string::npos);
    }
    const auto silent = [](auto& system) { system.constraints.compliant_tolerance = 1e9; };
    CHECK(std::get<0>(said_of(8, 1e-2, 1e-3, 1e-4, silent)).empty());
    const auto no_more = [](auto& system) { system.constraints.rigid_tolerance = 1e9; };
    CHECK(std::get<0>(said_of(8, 1e-2, 1e-2, 0, no_more)).empty());
}

TEST_CASE("links: errors are those of the last iteration, by their definition", "[lagrangian]") {
    DistanceConstraints<double, 2> constraints;
    CHECK(constraints.errors().worst == 0);
    constraints.add({0, 1}, 1);
    constraints.add({1, 2}, 2, {.compliance = 0.5});
    constraints.add({3, 4}, 1);  // pinned at both ends
    const std::vector<V> start{{0, 0}, {1, 0}, {3, 0}, {0, 5}, {7, 5}};
    std::vector<V> moved(5, V::zero());
    moved[1] = {0.5, 0};
    const std::vector<double> inverse_mass{0, 2, 0, 0, 0};
    constraints.solve(start, moved, inverse_mass, 1, 1, 1);
    // First 1 is moved to 1.0 by the rigid one; then it shall be 2 away from 3, and is.
    auto errors = constraints.errors(2);
    CHECK(errors.rigid_count == 1);
    CHECK(errors.compliant_count == 1);
    CHECK(errors.rigid() < 1e-15);
    CHECK(errors.compliant() < 1e-15);
    // Between 1 and 3.4 it is 0.4 too long: λ = −0.4/(2 + 0.5), which moves 1 by 0.32, and leaves no error; but now the
    // rigid one is 0.32 too long.
    moved[2] = {0.4, 0};
    constraints.solve(start, moved, inverse_mass, 1, 1, 1);
    errors = constraints.errors();
    CHECK(errors.rigid() == Approx(0.32));
    CHECK(errors.compliant() < 1e-12);
    CHECK(errors.worst == Approx(0.32));
    CHECK(errors.ends == std::array{0U, 1U});
    constraints.add({0, 2}, 3);
    CHECK(constraints.errors().rigid_count == 0);
}

}  // namespace links_tests
