/// \file Steps of three scenes, compiled natively and to WebAssembly: a ball of snow on the grid, balls that collide,
/// and a cloth in the wind that collides with itself.
#include <firn/firn.hpp>
#include <firn/lagrangian.hpp>

#include "runtime.hpp"

#include <cmath>
#include <memory>
#include <numbers>

namespace {

using Snow = firn::Simulation<3, firn::Snow<float>>;
using Room = firn::Walls<float, 3>;
using Points = firn::ParticleSystem<3, float, firn::Verlet, Room>;
std::unique_ptr<Snow> snow;
std::unique_ptr<Points> balls, cloth;

constexpr double cell = 1.0 / 64;  // m

}  // namespace

WASM_EXPORT(make_snow) void make_snow(int threads) {
    snow = std::make_unique<Snow>(firn::Domain<3>{{0, 0, 0}, {1, 1, 1}, cell},
                                  firn::Snow<float>::from_properties({.young = 1.4e5, .poisson = 0.2}),
                                  firn::Coloured{threads});
    const double radius = std::cbrt(50'000 / 8.0 * 3 / (4 * std::numbers::pi)) * cell;
    snow->add(firn::sample_sphere<3>({0.5, 0.3, 0.5}, radius, {.spacing = cell / 2}), 400, {1, -4, 0.5});
}
WASM_EXPORT(step_snow) void step_snow() { snow->step(); }

WASM_EXPORT(make_balls) void make_balls(int threads) {
    balls = std::make_unique<Points>(Room::all({0, 0, 0}, {0.5, 4, 0.5}, {firn::Contact::separate, 0.3}));
    balls->threads = threads;
    balls->collisions.emplace();
    constexpr int side = 20;
    for (int i = 0; i < 10'000; ++i) {
        const int x = i % side, z = i / side % side, y = i / side / side;
        balls->points.add(
            {.position = {0.012 + 0.025 * x + 0.001 * (y % 3), 0.012 + 0.021 * y, 0.012 + 0.025 * z - 0.0007 * (y % 5)},
             .mass = 0.01,
             .radius = 0.01});
    }
    for (int step = 0; step < 400; ++step) balls->step(1e-3);  // they fall and lie on one another
}
WASM_EXPORT(step_balls) void step_balls() { balls->step(1e-3); }

WASM_EXPORT(make_cloth) void make_cloth(int threads) {
    cloth = std::make_unique<Points>(Room::all({-1, -1, -1}, {3, 3, 3}, {firn::Contact::separate, 0.3}));
    cloth->threads = threads;
    cloth->damping = 0.5;
    const auto net = firn::cloth({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {127, 127});  // 128 × 128 points
    cloth->add(net, {.masses = firn::facet_masses(net, 0.2), .radius = 0.003});
    cloth->points.pin(0);
    cloth->points.pin(127);
    cloth->constraints.add(net, firn::ConstraintOptions{.compliance = 1e-5});
    cloth->add_force(firn::aerodynamic_surface_of<float>(net, {.wind = {0, 1, 3}}, 0));
    cloth->collisions.emplace();
    cloth->collisions->exclude(net.links, 0);
    for (int step = 0; step < 100; ++step) cloth->step(2e-3);
}
WASM_EXPORT(step_cloth) void step_cloth() { cloth->step(2e-3); }

#ifndef __wasm__
#include <chrono>
#include <cstdio>
#include <cstdlib>

/// steps [THREADS]: prints a line for each scene: its name and the shortest time of a step [ms].
int main(int argc, char** argv) {
    const int threads = argc > 1 ? std::atoi(argv[1]) : 1;
    const auto measure = [&](const char* name, auto make, auto step) {
        make(threads);
        double least = 1e9;
        for (int i = 0; i < 60; ++i) {
            const auto start = std::chrono::steady_clock::now();
            step();
            least = std::fmin(least, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
        }
        std::printf("%s %.3f\n", name, 1e3 * least);
    };
    measure("snow", make_snow, step_snow);
    measure("balls", make_balls, step_balls);
    measure("cloth", make_cloth, step_cloth);
}
#endif
