/// \file The two disks of the verification suite: what must be conserved, and how much energy the method loses.
#include "support/catch.hpp"

#include "../../benchmarks/verification/scenes/disks.hpp"

using namespace firn;

TEST_CASE("Two disks collide: momentum and angular momentum to rounding, energy never above its start") {
    verification::Disks<double> disks(1.0 / 20);
    auto& simulation = disks.simulation;
    const Totals<2> start = simulation.totals();
    const double energy = start.kinetic_energy + start.elastic_energy;
    const double momentum_scale = start.mass * 0.1 * std::sqrt(2.0);
    double highest = energy;
    while (simulation.time() < 3.5) {
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
    CHECK(left > 0.75 * energy);  // measured: 0.79 after the bounce
    // They have bounced: the disk that came from below goes back.
    CHECK(disks.speed(disks.lower) < 0);
}
