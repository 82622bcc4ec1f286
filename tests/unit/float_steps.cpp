/// \file Time steps that are chosen in float, as a WGSL program chooses them: they are those of the usual rule to
/// rounding, and a run with them arrives where it was sent.
#include "support/catch.hpp"
#include "support/scenes.hpp"
#include <firn/field/attraction.hpp>

using namespace firn;

namespace float_steps_tests {

namespace {

using Integers = FixedPoint<std::int32_t>;

template <int D>
Domain<D> box() {
    return {Vec<double, D>::zero(), Vec<double, D>::filled(1), 0.05};
}

/// Two blocks that meet, in cells whose size is no float.
template <int D>
auto colliding(double youngs_modulus, const Integers& execution) {
    Simulation simulation(box<D>(), FixedCorotated<float>::from_young_poisson(youngs_modulus, 0.3), execution);
    scenes::add_two_blocks<D>(simulation, 0.3, 0.025);
    simulation.warn = {};
    return simulation;
}
Integers in_float(int threads = 1) { return {.threads = threads, .float_steps = true}; }

/// Takes steps, and compares the bound of each with the bound in double for the same particles.
template <class Simulation, class Acceleration>
void check_bounds(Simulation simulation, const Acceleration& acceleration) {
    for (int i = 0; i < 4; ++i) {
        Simulation twin = simulation;
        twin.execution.float_steps = false;
        const double bound = simulation.stable_time_step(acceleration), usual = twin.stable_time_step(acceleration);
        CHECK(bound == Approx(usual).epsilon(1e-6));
        CHECK(bound == double(float(bound)));
        simulation.step(acceleration);
        CHECK(simulation.last_time_step() == bound);
    }
}

}  // namespace

TEST_CASE("a bound in float is the usual one to rounding, whatever sets it") {
    const Vec<double, 2> gravity{0.1, -9.81};
    check_bounds(colliding<2>(1e5, in_float()), gravity);
    check_bounds(colliding<3>(1e5, in_float()), Vec<double, 3>{0.1, -9.81, 0.3});
    auto slow = colliding<2>(0.1, in_float());
    for (auto [slot, particles] = std::pair(std::size_t(0), &slow.edit_particles()); slot < particles->slots(); ++slot)
        if (particles->is_particle(slot)) particles->set_velocity(slot, {});
    check_bounds(slow, gravity);
    check_bounds(slow, Attraction<float, 2>{.gravity = {0, -9.81F}, .centre = {0.5F, 0.5F}, .strength = 50});
    slow.add_load(Body{0, 1}, [](const Vec<double, 2>&, double) { return Vec<double, 2>{100, 0}; });
    check_bounds(slow, gravity);

    Simulation pushed(box<2>(), FixedCorotated<float>::from_young_poisson(1e4, 0.3),
                      Together(Walls<float, 2>::all({0, 0}, {1, 1}, {}),
                               Collider<Box<float, 2>>{.shape = {{0.1F, 0.1F}}, .linear_velocity = {90, 0}}),
                      in_float());
    pushed.warn = {};
    scenes::add_two_blocks<2>(pushed, 0.3, 0.025);
    check_bounds(pushed, gravity);
}

TEST_CASE("an advance in float steps ends at the time that was asked for, as two halves of it do") {
    auto whole = colliding<2>(1e5, in_float()), halves = whole;
    whole.advance(0.0123);
    CHECK(whole.time() == 0.0123);
    halves.advance(0.0123 / 2);
    CHECK(halves.time() == 0.0123 / 2);
    halves.advance(0.0123 / 2);
    CHECK(halves.time() == 0.0123);
    const auto steps = halves.steps();
    CHECK(steps >= whole.steps());
    CHECK(steps <= whole.steps() + 1);
    halves.advance(0);
    CHECK(halves.steps() == steps);
    for (int i = 0; i < 20; ++i) halves.advance(0.001);
    CHECK(halves.time() == Approx(0.0323).epsilon(1e-15));
}

TEST_CASE("the time is the sum of the steps, each of which is a float") {
    auto simulation = colliding<2>(1e5, in_float());
    double time = 0;
    simulation.add_pass("sum", "sinks and sources", [&](auto&, const StepNow<float, 2>& now) {
        CHECK(now.dt == double(float(now.dt)));
        time += now.dt;
    });
    simulation.advance(0.0123);
    CHECK(time == Approx(simulation.time()).epsilon(1e-7 / double(simulation.steps())));
}

TEST_CASE("a run in float steps has the same bits on 1 and 3 threads") {
    auto one = colliding<3>(1e5, in_float(1)), three = colliding<3>(1e5, in_float(3));
    one.advance(0.012);
    three.advance(0.012);
    CHECK(one.steps() > 3);
    CHECK(scenes::hash(one) == scenes::hash(three));
}

TEST_CASE("float steps change the bits of a run whose steps are chosen, not those of a fixed time step") {
    auto chosen = colliding<2>(1e5, in_float()), usual = colliding<2>(1e5, {.threads = 1});
    chosen.advance(0.004);
    usual.advance(0.004);
    CHECK(scenes::hash(chosen) != scenes::hash(usual));
    auto fixed = colliding<2>(1e5, in_float()), fixed_usual = colliding<2>(1e5, {.threads = 1});
    fixed.fixed_time_step = fixed_usual.fixed_time_step = 3e-4;
    fixed.advance(0.004);
    fixed_usual.advance(0.004);
    CHECK(fixed.time() == 0.004);
    CHECK(scenes::hash(fixed) == scenes::hash(fixed_usual));
}

TEST_CASE("the time left loses nothing in many steps, and no tiny last step is left") {
    const double duration = 1.2345678912345;
    TimeLeft<float> left = time_left(duration);
    double taken = 0;
    std::size_t steps = 0;
    for (; left.high > 0; ++steps) {
        const StepWithin<float> within = step_within(left, 1e-5F * float(1 + scenes::noise(steps)));
        left = within.left;
        CHECK(within.step > 0);
        CHECK(double(left.high) + double(left.low) == Approx(duration - taken - double(within.step)).margin(2e-12));
        taken += double(within.step);
    }
    CHECK(steps > 70000);
    CHECK(taken == Approx(duration).epsilon(2e-12));

    const float bound = 0.1F, next = std::nextafter(bound, 1.0F);
    const auto rest_after = [&](double rest) { return step_within(time_left(rest), bound).left.high; };
    CHECK(rest_after(double(bound)) == 0);
    CHECK(rest_after(0.7 * double(bound) + 0.3 * double(next)) == 0);
    CHECK(rest_after(0.3 * double(bound) + 0.7 * double(next)) > 0);
    CHECK(step_within(time_left(0.05), bound).step == 0.05F);
}

TEST_CASE("the time reached is the sum of the steps, also where a float has no room for one") {
    for (const double start : {0.0, 0.3, 5000.0}) {
        const TimeLeft<float> split = time_left(start);
        TimeReached<float> time{split.high, split.low};
        double expected = start;
        for (std::size_t k = 0; k < 100000; ++k) {
            const float dt = 1e-5F * float(1 + scenes::noise(k));
            time = time_after(time, dt);
            expected += double(dt);
        }
        CHECK(expected > start + 1);
        CHECK(double(time.high) + double(time.low) == Approx(expected).epsilon(2e-12));
        CHECK(time.high == float(double(time.high) + double(time.low)));
    }
    const TimeReached<float> first = time_after(TimeReached<float>{0, 0}, 0.1F);
    CHECK(first.high == 0.1F);
    CHECK(first.low == 0);
}

}  // namespace float_steps_tests
