// part: arithmetic
/// \file Restitution: who has passed a surface, or another point, is thrown back from where they met. Expected motions
/// are parabolas and the impact of two bodies.
#include "support/catch.hpp"
#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/lagrangian/particle_system.hpp>

#include <cmath>
#include <vector>

using namespace firn;

namespace rebound_tests {

namespace {

using V = Vec<double, 2>;
using Room = Walls<double, 2>;
constexpr double g = 9.81, radius = 0.05;

/// A floor at y = 0.
Room room(double friction = 0) { return Room::all({-100, 0}, {100, 50}, {Contact::separate, friction}); }

/// A ball that falls on the floor, from a height of 1 m at t = 0, without air.
double height_at(double t, double e) {
    double speed = std::sqrt(2 * g), begin = speed / g;  // at the floor, and when
    if (t < begin) return 1 - g * t * t / 2;
    for (speed *= e; t > begin + 2 * speed / g; speed *= e) begin += 2 * speed / g;
    return speed * (t - begin) - g * (t - begin) * (t - begin) / 2;
}

template <class System>
double energy(const System& system) {
    double sum = 0;
    for (std::size_t i = 0; i < system.points.size(); ++i) {
        const auto& v = system.points.velocity[i];
        sum +=
            double(system.points.mass[i]) * (double(dot(v, v)) / 2 - system.gravity[1] * system.points.position[i][1]);
    }
    return sum;
}

}  // namespace

TEST_CASE("rebound: on a parabola through a surface it is exact, and rest is recognised", "[lagrangian]") {
    // A point meets the surface at 3 m/s under −10 m/s², and has gone on for 0.02 s.
    const double a = -10, in = 3, since = 0.02, lag = 0.005, step = 0.03;
    const double now = -in + a * since, overlap = -(-in * since + a * since * since / 2);
    for (const double e : {1.0, 0.4}) {
        const auto after = rebound(overlap, now - a * lag, a, lag, step, e);
        CHECK(after.since == Approx(since).epsilon(1e-13));
        CHECK(after.leaving == Approx(e * in + a * since - a * lag).epsilon(1e-13));
    }
    CHECK(rebound(overlap, now - a * lag, a, lag, step, 0.03).leaving == 0);  // it would be back already
    CHECK(rebound(overlap, now - a * lag, a, lag, step, 0.0).since == 0);
    // What has lain beyond the surface since before the step has no more than the step behind it.
    const auto deep = rebound(10.0, -3.0, 0.0, 0.0, 0.01, 0.5);
    CHECK(deep.since == 0.01);
    CHECK(deep.leaving == 1.5);
    // On the surface since the step began: its speed is that of falling for a step.
    const auto resting = rebound(g * 1e-6 / 2, -g * 1e-3 / 2, -g, 5e-4, 1e-3, 1.0);
    CHECK(resting.leaving == 0);
    CHECK(resting.since == 0);
    // Pulled away faster than it comes
    CHECK(rebound(1e-3, 0.5, -10.0, 0.005, 0.01, 1.0).since == 0);
}

TEMPLATE_TEST_CASE("rebound: a ball comes back to e squared of its height, at the right time, in any steps",
                   "[lagrangian]", Verlet, SymplecticEuler) {
    for (const bool collide : {false, true})
        for (const double dt : {1e-2, 1e-3})
            for (const double e : {1.0, 0.7}) {
                CAPTURE(collide, dt, e);
                ParticleSystem<2, double, TestType, Room> system(room());
                system.restitution = e;
                if (collide) system.collisions.emplace();
                // Euler's first step is half a step of falling ahead of Verlet's.
                const double first = std::is_same_v<TestType, Verlet> ? 0 : g * dt / 2;
                system.points.add({.position = {0, 1 + radius}, .velocity = {0, first}, .radius = radius});
                double off = 0;
                while (system.time() < (e < 1 ? 1.9 : 3.3)) {  // 4 bounces
                    system.step(dt);
                    off = std::max(off, std::abs(system.points.position[0][1] - radius - height_at(system.time(), e)));
                }
                CHECK(off < 1e-9);
            }
}

TEST_CASE("rebound: steps may change in length, and drag takes what it takes", "[lagrangian]") {
    ParticleSystem<2, double, Verlet, Room> system(room());
    system.restitution = 1;
    system.points.add({.position = {0, 1 + radius}, .radius = radius});
    double off = 0;
    for (int i = 0; i < 3000; ++i) {
        system.step(1e-3 * (1 + i % 3));
        off = std::max(off, std::abs(system.points.position[0][1] - radius - height_at(system.time(), 1)));
    }
    CHECK(off < 1e-9);
}

TEST_CASE("rebound: a ball at rest stays at rest, on a floor and on a ball, whatever the restitution", "[lagrangian]") {
    for (const bool on_ball : {false, true})
        for (const double e : {0.0, 0.3, 1.0})
            for (const double gap : {0.0, -3e-5, 1e-6}) {
                CAPTURE(on_ball, e, gap);
                ParticleSystem<2, double, Verlet, Room> system(room(0.3));
                system.restitution = e;
                system.collisions.emplace();
                system.collisions->restitution = e;
                system.points.add({.position = {0, radius + (on_ball ? 1 : 0)}, .radius = radius});
                if (on_ball) {
                    system.points.pin(0);
                    system.points.add({.position = {0, 1 + 3 * radius + gap}, .radius = radius});
                } else {
                    system.points.position[0][1] += gap;
                }
                const double begin = system.points.position[on_ball][1];
                for (int i = 0; i < 100; ++i) system.step(1e-3);
                double speed = 0;
                for (int i = 0; i < 2000; ++i) {
                    system.step(1e-3);
                    speed = std::max(speed, norm(system.points.velocity[on_ball]));
                }
                CHECK(speed < 1e-12);
                CHECK(std::abs(system.points.position[on_ball][1] - begin) < 3 * contact_slack * radius);
            }
}

TEST_CASE("rebound: piles come to rest with restitution", "[lagrangian][slow]") {
    for (const double e : {0.0, 0.3, 0.8}) {
        CAPTURE(e);
        ParticleSystem<2, double, Verlet, Room> system(Room::all({0, 0}, {1, 5}, {Contact::separate, 0.3}));
        system.restitution = e;
        system.collisions.emplace();
        system.collisions->restitution = e;
        system.collisions->friction = 0.3;
        for (int i = 0; i < 90; ++i)
            system.points.add({.position = {0.06 + 0.11 * (i % 9) + 0.045 * (i / 9 % 2), 0.05 + 0.12 * (i / 9)},
                               .radius = 0.05 - 0.002 * (i * 7 % 4)});
        for (int i = 0; i < 6000; ++i) system.step(1e-3);
        double fastest = 0;
        for (const auto& v : system.points.velocity) fastest = std::max(fastest, norm(v));
        CHECK(fastest < 1e-6);
    }
}

TEST_CASE("rebound: a ball on a pinned ball bounces for ever", "[lagrangian]") {
    for (const double dt : {1e-2, 1e-3}) {
        ParticleSystem<2, double> system;
        system.collisions.emplace();
        system.collisions->restitution = 1;
        system.points.add({.position = {0, -radius}, .radius = radius});
        system.points.pin(0);
        system.points.add({.position = {0, 1 + radius}, .radius = radius});
        double off = 0;
        while (system.time() < 5) {
            system.step(dt);
            // A meeting is found in the step after it.
            const double y = system.points.position[1][1] - radius;
            if (y > std::sqrt(2 * g) * dt) off = std::max(off, std::abs(y - height_at(system.time(), 1)));
        }
        CHECK(off < 1e-9);
    }
}

TEST_CASE("rebound: two free balls go on as if they had met between the steps", "[lagrangian]") {
    for (const double dt : {0.01, 0.0037})
        for (const double e : {1.0, 0.5, 0.0}) {
            CAPTURE(dt, e);
            ParticleSystem<2, double> system;
            system.gravity = {};
            system.collisions.emplace();
            system.collisions->restitution = e;
            const double ua = 1, ub = -2, ma = 2, mb = 1;
            system.points.add({.position = {-1, 0}, .velocity = {ua, 0}, .mass = ma, .radius = 0.3});
            system.points.add({.position = {1, 0}, .velocity = {ub, 0}, .mass = mb, .radius = 0.3});
            while (system.time() < 2) system.step(dt);
            const double met = 1.4 / 3, t = system.time() - met;
            const double common = (ma * ua + mb * ub) / (ma + mb);
            const double va = common - e * (ua - ub) * mb / (ma + mb), vb = common + e * (ua - ub) * ma / (ma + mb);
            CHECK(system.points.velocity[0][0] == Approx(va).margin(1e-12));
            CHECK(system.points.velocity[1][0] == Approx(vb).margin(1e-12));
            // Without restitution they overlap by what they had passed each other, or by the slack.
            const double allowed = e > 0 ? 1e-12 : 3 * dt;
            CHECK(std::abs(system.points.position[0][0] - (-1 + ua * met + va * t)) < allowed);
            CHECK(std::abs(system.points.position[1][0] - (1 + ub * met + vb * t)) < allowed);
            CHECK(ma * system.points.position[0][0] + mb * system.points.position[1][0] == Approx(-1).margin(1e-12));
        }
}

TEST_CASE("rebound: a pair keeps its energy in oblique and skew meetings, with friction it loses some",
          "[lagrangian]") {
    for (const double friction : {0.0, 0.4}) {
        double least = 1, most = 0;
        for (int k = 0; k < 40; ++k) {
            ParticleSystem<2, double> system;
            system.gravity = {};
            system.collisions.emplace();
            system.collisions->restitution = 1;
            system.collisions->friction = friction;
            system.points.add({.position = {-1, 0.007 * k}, .velocity = {2, 0}, .mass = 2, .radius = 0.2});
            system.points.add({.position = {1, 0}, .velocity = {-1, 0.1}, .mass = 1, .radius = 0.25});
            const double before = energy(system);
            system.advance(2, 0.01);
            least = std::min(least, energy(system) / before);
            most = std::max(most, energy(system) / before);
        }
        CHECK(most < 1 + 1e-12);
        CHECK(least == Approx(1).epsilon(friction > 0 ? 0.2 : 1e-12));
        if (friction > 0) CHECK(least < 0.999);
    }
}

TEST_CASE("rebound: a moving wall and a turning ball throw points as seen from them", "[lagrangian]") {
    // A piston that comes on at 3 m/s, against a point at 1 m/s: it leaves at 3 + e (3 + 1).
    for (const double e : {1.0, 0.5}) {
        using Piston = Collider<HalfSpace<double, 2>>;
        ParticleSystem<2, double, Verlet, Piston> system(
            Piston{.shape = {{1, 0}}, .position = {-1, 0}, .linear_velocity = {3, 0}});
        system.gravity = {};
        system.restitution = e;
        system.points.add({.position = {0.13, 0}, .velocity = {-1, 0}});
        system.advance(1, 0.01);
        const double met = 1.13 / 4, at = 0.13 - met;
        CHECK(system.points.velocity[0][0] == Approx(3 + e * 4));
        CHECK(system.points.position[0][0] == Approx(at + (3 + e * 4) * (1 - met)).epsilon(1e-12));
    }
}

TEST_CASE("rebound: friction acts from where a point met the floor", "[lagrangian]") {
    // Coulomb's impulse is μ (1 + e) times the speed of approach; what is left of the step is gone with the new speed.
    const double mu = 0.2, e = 0.5, dt = 0.01;
    ParticleSystem<2, double, Verlet, Room> system(room(mu));
    system.gravity = {};
    system.restitution = e;
    system.points.add({.position = {0, 1.0033}, .velocity = {6, -2}});
    system.advance(1, dt);
    const double met = 1.0033 / 2, along = 6 - mu * (1 + e) * 2;
    CHECK(system.points.velocity[0][0] == Approx(along));
    CHECK(system.points.position[0][0] == Approx(6 * met + along * (1 - met)).epsilon(1e-12));
    CHECK(system.points.position[0][1] == Approx(e * 2 * (1 - met)).epsilon(1e-12));
}

TEST_CASE("rebound: in a corner both walls throw back", "[lagrangian]") {
    ParticleSystem<2, double, Verlet, Room> system(Room::all({0, 0}, {1, 1}, {Contact::separate, 0}));
    system.gravity = {};
    system.restitution = 1;
    system.points.add({.position = {0.5, 0.497}, .velocity = {-1, -1}});
    system.advance(10, 0.01);  // a triangle wave of period 2
    CHECK(norm(system.points.position[0] - V{0.5, 0.497}) < 1e-12);
    CHECK(norm(system.points.velocity[0] - V{-1, -1}) < 1e-12);
}

}  // namespace rebound_tests
