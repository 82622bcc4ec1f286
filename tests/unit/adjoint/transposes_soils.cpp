// part: full
// sanitized: no
/// \file Steps and their ways back, with every policy: fluids, snow and sand.
#include "support/transposes.hpp"

namespace transposes_soils_tests {
using namespace firn;

TEST_CASE("steps and their ways back are transposes: fluids, snow and sand", "[adjoint][slow]") {
    transposes::check_rows<3>(Fluid<double>::from_properties({.bulk = 1e4, .viscosity = 10}), 0.97);
    transposes::check_rows<4>(Snow<double>::from_properties({}));
    transposes::check_rows<5>(Sand<double>::from_properties({.young = 1e5}), 0.99, 0.08);
}

}  // namespace transposes_soils_tests
