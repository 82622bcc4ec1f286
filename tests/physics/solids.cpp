// quick: no
/// \file Matter and solids: sliding down a slope with friction, a driven piston.
#include "support/catch.hpp"
#include "support/watched_run.hpp"

#include "../../benchmarks/verification/scenes/incline.hpp"

#include <algorithm>
#include <numbers>

using namespace firn;
using scenes::WatchedRun;

TEST_CASE("a block slides down a slope by ½ g t² (sin θ − μ cos θ)") {
    // Of a rigid block; this one of 1e7 Pa is at first held less, until its shear waves have come to rest.
    for (const bool askew : {false, true})
        for (const double friction : {0.0, 0.2, 0.3}) {
            const auto run = verification::slide({.friction = friction, .young = 1e7, .askew = askew});
            CAPTURE(askew, friction, run.way.back(), run.expected.back());
            CHECK(run.error() <= 4e-3);  // measured: 2.4e-3
            CHECK(run.error_of_acceleration() <= 4e-3);
            CHECK(run.height <= 0.01);  // a fraction of a cell
        }
}

TEST_CASE("steeper friction than the slope holds a block") {
    Collider<HalfSpace<double, 2>> ground{.friction = 0.8};
    ground.rotation = rotor(degrees(-30));
    const auto R = matrix_of(ground.rotation);
    WatchedRun<2, double, decltype(ground)> run({{-1.0, -1.0}, {1.0, 1.0}, 1.0 / 40},
                                                FixedCorotated<double>::from_young_poisson(1e6, 0.3), ground);
    auto block = sample_box<2>({0.0, 0.0}, {0.3, 0.1}, {.spacing = 1.0 / 80});
    for (auto& x : block.positions) x = R * x;
    run.add(block, 1000);
    const double dt = 0.5 * run.stable_time_step();
    const auto start = run.centre();
    for (double time = 0; time < 0.4; time += dt) {
        run.gravity = {0.0, -9.81 * std::min(time / 0.1, 1.0)};  // not at once: a block that bounces is not pressed on
        run.step(dt);
    }
    CHECK(std::abs((transpose(R) * (run.centre() - start))[0]) <= 2e-3);  // free it would slide 0.3 m
}

TEST_CASE("a driven piston gives the same momentum to matter whatever the step") {
    // At 2 m/s into a free block for 20 ms, in steps of dt, dt/2, dt/4.
    double impulse[3];
    for (int i = 0; i < 3; ++i) {
        Collider<Box<double, 2>> piston{.shape = {{0.05, 0.3}}};
        piston.position = {0.15, 0.5};
        piston.linear_velocity = {2.0, 0.0};
        WatchedRun<2, double, decltype(piston)> run({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 40},
                                                    FixedCorotated<double>::from_young_poisson(1e5, 0.3), piston);
        const auto block = sample_box<2>({0.2, 0.4}, {0.5, 0.6}, {.spacing = 1.0 / 80});
        run.add(block, 1000);
        const int steps = 200 << i;
        Vec<double, 2> sum{};
        for (int n = 0; n < steps; ++n) {
            run.step(0.02 / steps);
            sum += run.reaction(0).impulse;
        }
        CHECK(norm(sum - run.momentum()) <= 1e-10 * norm(sum));
        CHECK(std::abs(sum[1]) <= 1e-10 * sum[0]);
        impulse[i] = sum[0];
    }
    CAPTURE(impulse[0], impulse[1], impulse[2]);
    CHECK(impulse[2] > 0.5 * 60 * 2);  // at least half of the block has been set in motion
    CHECK(std::abs(impulse[0] - impulse[2]) <= 0.02 * impulse[2]);
    CHECK(std::abs(impulse[1] - impulse[2]) <= 0.01 * impulse[2]);
}

TEST_CASE("a stirrer turns matter: its torque is what the matter's angular momentum grows by") {
    Collider<Box<double, 2>> stirrer{.shape = {{0.2, 0.03}}, .contact = Contact::slip};
    stirrer.position = {0.5, 0.5};
    stirrer.angular_velocity = 10;
    WatchedRun<2, double, decltype(stirrer)> run({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 40},
                                                 FixedCorotated<double>::from_young_poisson(1e4, 0.3), stirrer);
    const auto disc = sample_sphere<2>({0.5, 0.5}, 0.3, {.spacing = 1.0 / 80});
    run.add(disc, 1000);
    // About the stirrer, with the part that is in C: Jiang, Schroeder and Teran 2017, m h²/4 (C10 − C01).
    const auto angular_momentum = [&] {
        double sum = 0;
        run.for_particles([&](std::size_t slot) {
            const auto C = run.particles().affine(slot);
            sum += run.particles().mass(slot) * (axial_product(run.particles().exact_position(slot) - stirrer.position,
                                                               run.particles().velocity(slot)) +
                                                 1.0 / 6400 * (C(1, 0) - C(0, 1)));
        });
        return sum;
    };
    double given = 0;
    const double dt = 0.3 * run.stable_time_step();
    for (int i = 0; i < 100; ++i) {
        run.step(dt);
        given += run.reaction(0).angular_impulse;
    }
    CAPTURE(given, angular_momentum());
    CHECK(given > 1);
    CHECK(std::abs(given - angular_momentum()) <= 1e-9 * given);
}
