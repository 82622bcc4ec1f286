// quick: no
// sanitized: no
/// \file The gradient through transfers that blend velocities against difference quotients.
#include "support/gradient_checks.hpp"

using namespace derivatives;

namespace transfers_gradient_tests {
TEST_CASE("gradients through FLIP and ASFLIP", "[adjoint]") {
    check_policies<2, Flip<double>>();
    check_policies<2, Asflip<double>, WeightGradientForce>();
}

}  // namespace transfers_gradient_tests
