// quick: no
/// \file The verification suite's dam break on coarse cells, against Martin and Moyce 1952.
#include "../../benchmarks/verification/scenes/dam_break.hpp"

#include "support/catch.hpp"

using namespace firn;
using verification::DamBreak;

TEST_CASE("The front of a dam break is where Martin and Moyce saw it, to 5 % once the gate's delay is taken off") {
    DamBreak<float, Apic> dam(10);
    const auto front = dam.history(9);
    const auto raw = front_error(front, "A"), shifted = delayed_front_error(front, "A");
    CAPTURE(raw.mean, raw.largest, shifted.mean, shifted.delay);
    CHECK(raw.mean < 0.15);  // others have that without the delay, too: interFoam 9.8 %
    CHECK(shifted.mean < 0.05);
    CHECK((front.at(9) - front.at(7)) / 2 == Approx(2).epsilon(0.05));  // Ritter 1892, no friction: 2 √(2 g a)
    CHECK(front.most_energy <= 1 + 1e-6);
}
