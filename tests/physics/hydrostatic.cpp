/// \file The verification suite's water in a box, for a short time.
#include "../../benchmarks/verification/scenes/hydrostatic.hpp"

#include "support/catch.hpp"

using namespace firn;
using Water = verification::Hydrostatic<double, Apic, MlsForce, QuadraticBSpline>;

TEST_CASE("Water at rest has the pressure of the water above it, and is compressed by that") {
    Water water(0.01);
    water.advance(0.1, true);
    const auto state = water.state();
    CAPTURE(state.noise, state.centre);
    CHECK(state.noise < 0.025);  // h/4H
    CHECK(std::abs(state.centre - Water::centre_at_rest()) < 2 * Water::pressure / Water::bulk * 0.1);
    water.step();
    CHECK(water.load() == Approx(1).epsilon(1e-3));
}

TEST_CASE("The load on the floor of water that is let go at once is the triangular wave of sound") {
    Water water(0.01);
    double worst = 0;
    while (water.simulation.time() < 0.9 * Water::period()) {
        water.step();
        const double middle = water.simulation.time() - water.simulation.last_time_step() / 2;
        worst = std::max(worst, std::abs(water.load() - Water::wave(middle)));
    }
    CHECK(worst < 4 * 0.1 / 2);  // slope 4 a period of 4 H/c: what sound takes for half a cell there and back, h/H
}

TEST_CASE("Between mirrored walls, water stays at rest with a smooth pressure, with and without a filter", "[slow]") {
    using Filtered = verification::Hydrostatic<double, Apic, WeightGradientForce, QuadraticBSpline, VolumeFilter>;
    using Own = verification::Hydrostatic<double, Apic, WeightGradientForce, QuadraticBSpline>;
    Own own(0.01, NodesBehind::mirrored);
    Filtered filtered(0.01, NodesBehind::mirrored);
    own.advance(0.1, true);
    filtered.advance(0.1, true);
    own.advance(0.2, false);
    filtered.advance(0.2, false);
    CAPTURE(own.state().noise, filtered.state().noise);
    CHECK(own.state().noise < 0.02);
    CHECK(filtered.state().noise < 0.02);
    CHECK(own.state().whole < 0.02);  // up to the walls, where it is a fifth with NodesBehind::held
    CHECK(filtered.state().whole < 0.02);
    CHECK(std::abs(filtered.state().centre - Own::centre_at_rest()) < 0.01);  // a tenth of a cell
}
