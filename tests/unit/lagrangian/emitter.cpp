/// \file Emitters: when and where particles are born, what they know of the step's size, how long they live.
#include "support/catch.hpp"
#include "support/message.hpp"
#include "support/not_finite.hpp"
#include <firn/lagrangian/emitter.hpp>

#include <set>

using namespace firn;
using test_support::holds;
using test_support::message;
using test_support::not_a_number;

namespace emitter_tests {

namespace {

Emitter<3> fountain() {
    return {.position = {0.1, 0.2, 0.3},
            .direction = {1, 2, -2},  // 3 long
            .nozzle = 0.05,
            .speed = 4,
            .speed_spread = 1,
            .cone = 0.4,
            .rate = 1000,
            .start = 0.5,
            .lifespan = 2,
            .lifespan_spread = 0.5,
            .mass = 0.01,
            .radius = 0.002,
            .group = 7,
            .seed = 42};
}

/// Flies freely for `dt`, exactly.
template <class S, int D>
void fly(PointMasses<S, D>& points, const Vec<S, D>& g, S dt) {
    for (std::size_t i = 0; i < points.size(); ++i) {
        points.position[i] += points.velocity[i] * dt + g * (dt * dt / 2);
        points.velocity[i] += g * dt;
    }
}

template <int D>
void run(Emitter<D>& emitter, PointMasses<double, D>& points, double dt, int steps, const Vec<double, D>& g) {
    for (int step = 1; step <= steps; ++step) {
        fly(points, g, dt);
        emitter.give(points, step * dt, g);
        const double now = step * dt;
        points.remove_if([&](std::size_t i) { return points.end[i] <= now; });
    }
}

}  // namespace

TEST_CASE("Number k is born at start + k / rate, until the end") {
    PointMasses<float, 3> points;
    auto emitter = fountain();
    emitter.end = 0.6;
    CHECK(emitter.give(points, 0.4999) == 0);
    CHECK(emitter.give(points, 0.5) == 1);
    CHECK(emitter.give(points, 0.5) == 0);
    CHECK(emitter.give(points, 0.5105) == 10);
    CHECK(emitter.give(points, 1) == 90);  // the last at 0.6 s
    CHECK(emitter.give(points, 2) == 0);
    CHECK(emitter.births == 101);
    CHECK(points.size() == 101);
    CHECK(points.group[100] == 7);
    CHECK(points.mass[3] == 0.01f);
    CHECK(points.radius[3] == 0.002f);
}

TEST_CASE("Particles come from the nozzle's disc, within the cone, at the speeds and with the lifespans asked for") {
    const auto emitter = fountain();
    const Vec<double, 3> ahead{1.0 / 3, 2.0 / 3, -2.0 / 3};
    double widest = 0, farthest = 0, slowest = 9, fastest = 0, shortest = 9, longest = 0, cosines = 0, squares = 0;
    constexpr int n = 20'000;
    for (int k = 0; k < n; ++k) {
        const auto point = emitter.born(std::uint64_t(k));
        const auto from = point.position - emitter.position;
        CHECK(std::abs(dot(from, ahead)) < 1e-15);
        const double speed = norm(point.velocity), cosine = dot(point.velocity, ahead) / speed;
        const double life = point.end - emitter.time_of(std::uint64_t(k));
        widest = std::max(widest, std::acos(std::min(1.0, cosine)));
        farthest = std::max(farthest, norm(from));
        slowest = std::min(slowest, speed), fastest = std::max(fastest, speed);
        shortest = std::min(shortest, life), longest = std::max(longest, life);
        cosines += cosine / n, squares += dot(from, from) / n;
    }
    // The bounds are kept and, with 20,000 draws, nearly reached.
    CHECK((widest <= 0.4 + 1e-9 && widest > 0.399));
    CHECK((farthest <= 0.05 + 1e-12 && farthest > 0.0499));
    CHECK((slowest >= 3 && slowest < 3.001));
    CHECK((fastest <= 5 + 1e-12 && fastest > 4.999));
    CHECK((shortest >= 1.5 - 1e-12 && shortest < 1.501));
    CHECK((longest <= 2.5 + 1e-12 && longest > 2.499));
    // Means of what is even over a cap, (1 + cos α)/2, and over a disc, R²/2; four standard errors.
    CHECK(std::abs(cosines - (1 + std::cos(0.4)) / 2) < 4 * (1 - std::cos(0.4)) / std::sqrt(12.0 * n));
    CHECK(std::abs(squares - 0.05 * 0.05 / 2) < 4 * 0.05 * 0.05 / std::sqrt(12.0 * n));
}

TEST_CASE("In the plane the nozzle is a segment and the cone an angle to both sides") {
    const Emitter<2> emitter{.position = {1, 2}, .direction = {0, -3}, .nozzle = 0.1, .speed = 2, .cone = 0.3};
    double left = 0, right = 0, widest = 0;
    for (std::uint64_t k = 0; k < 5000; ++k) {
        const auto point = emitter.born(k);
        CHECK(point.position[1] == Approx(2).epsilon(1e-15));
        left = std::min(left, point.position[0] - 1), right = std::max(right, point.position[0] - 1);
        widest = std::max(widest, std::abs(std::atan2(point.velocity[0], -point.velocity[1])));
        CHECK(norm(point.velocity) == Approx(2).epsilon(1e-12));
    }
    CHECK((left >= -0.1 - 1e-12 && left < -0.0995));
    CHECK((right <= 0.1 + 1e-12 && right > 0.0995));
    CHECK((widest <= 0.3 + 1e-12 && widest > 0.298));
}

TEST_CASE("The step's size changes neither which particles there are nor, in free flight, where") {
    const Vec<double, 3> g{0, -9.81, 0};
    const double dt = 1.0 / 64;  // exact, as are its multiples
    auto coarse = fountain(), fine = fountain();
    PointMasses<double, 3> few, many;
    run(coarse, few, 8 * dt, 40, g);  // to 5 s: the first have died
    run(fine, many, dt, 320, g);
    REQUIRE(few.size() == many.size());
    REQUIRE(few.size() > 1000);
    double farthest = 0;
    for (std::size_t i = 0; i < few.size(); ++i) {
        farthest = std::max(farthest, norm(few.position[i] - many.position[i]));
        CHECK(few.end[i] == many.end[i]);
    }
    CHECK(farthest < 1e-11);  // 20 m far: rounding of some hundred steps
}

TEST_CASE("At most `maximum` live at a time: births while it is full do not happen, however long the step") {
    auto emitter = fountain();
    emitter.start = 0;
    emitter.lifespan_spread = 0;
    emitter.lifespan = 1;
    emitter.maximum = 64;
    emitter.rate = 256;
    // The 64 first, then none until they die, each 1 s after its birth: then one for one.
    std::set<double> ends;
    for (const int steps_a_second : {4, 64, 1}) {
        auto source = emitter;
        PointMasses<double, 3> points;
        std::set<double> seen;
        std::size_t most = 0;
        for (int step = 1; step <= 3 * steps_a_second; ++step) {
            const double now = double(step) / steps_a_second;
            source.give(points, now);
            most = std::max(most, points.size());
            points.remove_if([&](std::size_t i) { return points.end[i] <= now; });
            for (const double end : points.end) seen.insert(end);
            CHECK(points.size() <= 64);
        }
        CHECK(source.births == 769);
        // Those of the last 64 births of a full second: 2 to 2 + 63/256 s.
        const std::set<double> last(points.end.begin(), points.end.end());
        CHECK(*last.begin() > 3);
        if (ends.empty()) ends = last;
        CHECK(last == ends);
        if (steps_a_second == 64) CHECK(seen.size() == 3 * 64 + 1);
    }
}

TEST_CASE("What others take out makes room below the maximum") {
    auto emitter = fountain();
    emitter.start = 0;
    emitter.maximum = 10;
    PointMasses<float, 3> points;
    CHECK(emitter.give(points, 0.1) == 10);
    CHECK(emitter.give(points, 0.2) == 0);
    points.remove_if([](std::size_t i) { return i % 2 == 0; });
    CHECK(emitter.give(points, 0.3) == 5);
    CHECK(points.size() == 10);
}

TEST_CASE("A particle that is born and dies within a step is not given; skipped births never come") {
    Emitter<2> emitter{.rate = 100, .lifespan = 0.05};
    PointMasses<double, 2> points;
    CHECK(emitter.give(points, 1.0) == 5);  // those born after 0.95 s
    CHECK(emitter.births == 101);
    Emitter<2> late{.rate = 100};
    late.skip(0.5);
    CHECK(late.births == 51);
    CHECK(late.give(points, 0.6) == 10);
}

TEST_CASE("An emitter that cannot be is refused before it gives anything") {
    PointMasses<float, 3> points;
    const auto refusal = [&](const auto& change) {
        auto emitter = fountain();
        change(emitter);
        const auto text = message<parameter_error>([&] { emitter.give(points, 1); });
        CHECK(points.size() == 0);
        return text;
    };
    CHECK(holds(refusal([](auto& e) { e.rate = 1e300 * 1e300; }), "rate"));
    CHECK(holds(refusal([](auto& e) { e.direction = {}; }), "direction"));
    CHECK(holds(refusal([](auto& e) { e.position[1] = not_a_number; }), "give finite metres"));
    CHECK(holds(refusal([](auto& e) { e.nozzle = -1; }), "nozzle"));
    CHECK(holds(refusal([](auto& e) { e.speed_spread = 5; }), "spread of speed"));
    CHECK(holds(refusal([](auto& e) { e.cone = 4; }), "cone"));
    CHECK(holds(refusal([](auto& e) { e.lifespan = 0; }), "lifespan"));
    CHECK(holds(refusal([](auto& e) { e.lifespan_spread = 3; }), "spread of the lifespan"));
    CHECK(holds(refusal([](auto& e) { e.mass = not_a_number; }), "mass"));
    CHECK(holds(refusal([](auto& e) { e.radius = -1; }), "radius"));
    CHECK(holds(refusal([](auto& e) { e.maximum = 0; }), "maximum"));
    auto emitter = fountain();
    emitter.end = 0.4;
    CHECK(holds(message<parameter_error>([&] { emitter.check(); }), "not after the end"));
    emitter = fountain();
    emitter.rate = 0;
    CHECK(holds(message<parameter_error>([&] { emitter.check(); }), "rate"));
}

}  // namespace emitter_tests
