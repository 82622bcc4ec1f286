/// \file Two elastic bodies collide in free space: what must be conserved, and how much energy the method loses.
#include "support/catch.hpp"
#include "support/scenes.hpp"

using namespace firn;

TEST_CASE("Two disks collide: momentum and angular momentum to rounding, energy never above its start") {
    // Sulsky, Chen and Schreyer 1994: E = ρ = 1000, ν = 0.3, R = 0.2, v = ±(0.1, 0.1), unit box, 20² cells, 2 × 2 a
    // cell.
    const Domain<2> domain{{0.0, 0.0}, {1.0, 1.0}, 1.0 / 20};
    Simulation<2, FixedCorotated<double>> simulation(domain, FixedCorotated<double>::from_young_poisson(1000, 0.3));
    simulation.gravity = {0.0, 0.0};
    simulation.add(sample_sphere<2>({0.25, 0.25}, 0.2, {.spacing = 1.0 / 40}), 1000, {0.1, 0.1});
    simulation.add(sample_sphere<2>({0.75, 0.75}, 0.2, {.spacing = 1.0 / 40}), 1000, {-0.1, -0.1});
    const Totals<2> start = simulation.totals();
    const double energy = start.kinetic_energy + start.elastic_energy;
    const double momentum_scale = start.mass * 0.1 * std::sqrt(2.0);
    double highest = energy;
    while (simulation.time() < 2.5) {
        simulation.step();
        const Totals<2> now = simulation.totals();
        highest = std::max(highest, now.kinetic_energy + now.elastic_energy);
        REQUIRE(norm(now.momentum - start.momentum) < 1e-12 * momentum_scale);
        REQUIRE(std::abs(now.angular_momentum - start.angular_momentum) < 1e-12 * momentum_scale);
    }
    const Totals<2> end = simulation.totals();
    const double left = end.kinetic_energy + end.elastic_energy;
    CAPTURE(highest / energy, left / energy);
    CHECK(highest <= energy * (1 + 1e-6));
    CHECK(left > 0.75 * energy);  // measured: 0.81 after the bounce
    // They have bounced: the disk that came from below goes back.
    Vec<double, 2> v{};
    for (std::size_t slot = 0; slot < simulation.particles().slots(); ++slot)
        if (simulation.particles().is_particle(slot) && simulation.particles().id(slot) < simulation.bodies()[1].first)
            v += simulation.particles().velocity(slot);
    CHECK(v[0] < 0);
    CHECK(v[1] < 0);
}
