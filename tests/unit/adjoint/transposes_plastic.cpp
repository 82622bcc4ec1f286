// part: full
// sanitized: no
/// \file Steps and their ways back, with every policy: metals and clay.
#include "support/transposes.hpp"

namespace transposes_plastic_tests {
using namespace firn;

TEST_CASE("steps and their ways back are transposes: metals and clay", "[adjoint][slow]") {
    transposes::check_rows<6>(VonMises<double>::from_properties({.young = 1e5, .yield_stress = 500, .hardening = 1e3}));
    // Pressed: clay that has opened so far that nothing holds it any more turns rounding into errors of 1e-11.
    transposes::check_rows<7>(Nacc<double>::from_properties({.young = 1e5, .consolidation = 500}), 0.95);
    transposes::check_rows<8>(Dissipating<VonMises<double>>{VonMises<double>{3e3, 5e3, 100, 100}});
}

}  // namespace transposes_plastic_tests
