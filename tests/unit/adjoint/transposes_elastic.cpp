// part: full
// sanitized: no
/// \file Steps and their ways back, with every policy: solids that are elastic.
#include "support/transposes.hpp"

namespace transposes_elastic_tests {
using namespace firn;

TEST_CASE("steps and their ways back are transposes: solids that are elastic", "[adjoint][slow]") {
    transposes::check_rows<0>(derivatives::jelly);
    transposes::check_rows<1>(NeoHookean<double>::from_young_poisson(1e5, 0.3));
    transposes::check_rows<2>(Hencky<double>::from_young_poisson(1e5, 0.3));
}

}  // namespace transposes_elastic_tests
