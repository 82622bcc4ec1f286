// quick: no
/// \file The verification suite's sloshing water on coarse cells: its period, and the noise of its pressure.
#include "../../benchmarks/verification/scenes/sloshing.hpp"

#include "support/catch.hpp"

using namespace firn;

TEST_CASE("Sloshing water has the period of linear theory, and a filter of its volumes keeps the pressure smooth") {
    using Own = verification::Sloshing<Apic, WeightGradientForce>;
    using Filtered = verification::Sloshing<Apic, WeightGradientForce, VolumeFilter>;
    Own own(1.0 / 16, NodesBehind::mirrored, 0);
    Filtered filtered(1.0 / 16, NodesBehind::mirrored, 0);
    own.run(2.3);
    filtered.run(2.3);
    CAPTURE(own.relative_period(), filtered.relative_period(), own.decay(), filtered.decay(), own.noise(),
            filtered.noise());
    CHECK(filtered.relative_period() == Approx(1).margin(0.02));  // Lamb, Hydrodynamics, §228
    CHECK(filtered.noise() < 0.02);                               // the bar for water at rest
    CHECK(filtered.noise() < 0.3 * own.noise());
    CHECK(filtered.decay() < own.decay() + 0.002);  // no worse than without; it is a hundredth a period
}
