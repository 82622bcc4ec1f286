// quick: no
/// \file The verification suite's water after a splash, on coarse cells; and water that is set up at rest.
#include "../../benchmarks/verification/scenes/splash.hpp"

#include "support/catch.hpp"

using namespace firn;
using verification::Splash;

TEST_CASE("Water fills its volume again after a splash, with a hydrostatic pressure") {
    const auto held = NodesBehind::held;
    Splash<float, VolumeFilter> water(0.4, 0.4, 1.0 / 32, 2, held),
        unshifted(0.4, 0.4, 1.0 / 32, 2, held, 0, {8, 1, 0});
    water.go_on(16);
    unshifted.go_on(16);
    const auto mean = water.go_on(4);
    const double depth = mean.depth / water.depth_at_rest;
    CAPTURE(depth, mean.raw_depth / water.depth_at_rest, mean.worst_layer(), mean.kinetic / water.released);
    CHECK(depth == Approx(water.compressed()).margin(0.03));
    CHECK(mean.worst_layer() < 0.1);
    CHECK(mean.kinetic_besides_waves / water.released < 0.01);
    CHECK(unshifted.go_on(4).depth / unshifted.depth_at_rest < 0.7);
}

TEST_CASE("Water that is set up in hydrostatic pressure stays at rest: shifting makes no motion") {
    const auto speed_after = [](double shifting) {
        Splash<double, VolumeFilter> water(1, 0.25, 1.0 / 32, 2, NodesBehind::mirrored, 0, {1, 1, shifting});
        auto& simulation = water.simulation;
        const double top = water.depth_at_rest;
        auto& particles = simulation.edit_particles();
        double most = 0;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            auto x = particles.exact_position(slot);
            auto state = particles.state(slot);
            // p = K/γ (J^−γ − 1) = ρ g d: each layer, and how far the layers below it are compressed, to first order.
            const double depth = top - x[1];
            state.J = std::pow(1 + 7 * 1000 * 9.81 * depth / 1e5, -1.0 / 7);
            x[1] -= 9810 / 1e5 * (top * x[1] - x[1] * x[1] / 2);
            particles.set_state(slot, state);
            particles.set_position(slot, x);
        }
        const double c = 10, work = 9.81 * top;
        while (simulation.time() < 8 * top / c) {  // two periods of sound
            simulation.step();
            most = std::max(most, simulation.totals().kinetic_energy / simulation.totals().mass / work);
        }
        double lowest = 1, highest = 0;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) {
                const auto x = particles.exact_position(slot);
                lowest = std::min(lowest, x[1]), highest = std::max(highest, x[1]);
            }
        CHECK(lowest > 0);
        CHECK(highest < top);
        return most;
    };
    const double without = speed_after(0), with = speed_after(1);
    CAPTURE(without, with);
    CHECK(with < 1e-6);  // of g H: the layers of the start are at rest to first order, and ρ g H/K = 2.5 %
    CHECK(with < 1.5 * without);
}
