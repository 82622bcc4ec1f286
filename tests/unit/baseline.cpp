// quick: no
// part: full
// sanitized: no
/// \file The straightforward code that the benchmarks compare firn with does the same physics.
#include "support/catch.hpp"

#include "../benchmarks/baseline/of_scene.hpp"

#include <limits>

namespace {

struct Difference {
    double x = 0, F = 0;  // largest, in metres and in components
};

/// After so many steps of both. x and F of the baseline are in the order of the scene, firn's are found by their ids.
Difference after(const scenes::Scene<3>& scene, int steps) {
    firn::Simulation<3> simulation(scene.domain,
                                   firn::FixedCorotated<float>::from_young_poisson(scene.young, scene.poisson), {1});
    scenes::add(simulation, scene);
    baseline::MlsMpm straightforward = baseline::of_scene(scene);
    for (int step = 0; step < steps; ++step) {
        simulation.step();
        straightforward.step(float(scene.time_step));
    }
    Difference difference;
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const auto& other = straightforward.particles[particles.id(slot)];
        for (int a = 0; a < 3; ++a)
            difference.x = std::max(difference.x, std::abs(double(particles.position(slot)[a]) - double(other.x[a])));
        const auto F = particles.state(slot).F;
        for (int k = 0; k < 9; ++k)
            difference.F = std::max(difference.F, std::abs(double(F.m[k]) - double(other.F(k % 3, k / 3))));
    }
    return difference;
}

/// The bodies are strained from the start, so that stresses are large, and in 40 steps two waves pass through them.
scenes::Scene<3> strained_cubes() {
    scenes::Scene<3> scene = scenes::two_cubes<3>(4000);
    for (auto& body : scene.matter) body.strain = 0.1;
    return scene;
}

/// Rounding is all that may differ. A position below 1 m is rounded to 2⁻²⁵ m in each step of either code. F is rounded
/// to some ε, and takes over a fifth (dt 4/h |v|) of what the velocities, sums over dozens of particles, are off by.
void check(const Difference& difference, int steps) {
    CHECK(difference.x < steps * 0x1p-24);
    CHECK(difference.F < steps * 4 * double(std::numeric_limits<float>::epsilon()));
}

}  // namespace

TEST_CASE("the baseline moves strained, turning bodies as firn does") { check(after(strained_cubes(), 40), 40); }

TEST_CASE("the baseline's walls hold matter as firn's do") {
    scenes::Scene<3> scene = strained_cubes();
    // Into two opposite corners, a cell or less away from all six walls.
    const firn::Vec<double, 3> shifts[] = {{-0.30, -0.31, -0.305}, {0.33, 0.35, 0.375}};
    for (std::size_t b = 0; b < 2; ++b) {
        scenes::Matter<3>& body = scene.matter[b];
        body.velocity = -body.velocity;
        body.centre += shifts[b];
        for (auto& x : body.samples.positions) x += shifts[b];
    }
    check(after(scene, 40), 40);
}
