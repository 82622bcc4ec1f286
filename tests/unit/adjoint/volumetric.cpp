// quick: no
// sanitized: no
/// \file The gradient through the average of the rates of volume change.
#include "support/gradient_checks.hpp"

namespace volumetric_gradient_tests {
using namespace firn;
namespace {

template <int D, class... Policies>
void check(NodesBehind behind = NodesBehind::held) {
    auto walls = derivatives::walls_of_run<D>();
    walls.nodes_behind = behind;
    derivatives::Run<SimulationWith<D, FixedCorotated<double>, FBar, Policies...>> run{derivatives::jelly, walls};
    run.boundary_changes = false;
    run.dt = 1e-3;
    derivatives::check_derivatives(run);
    run.dt = 0x1p-11;
    tangent::check_transposed(run.at(0), 12, 2);
}

}  // namespace

TEST_CASE("gradients through F-bar", "[adjoint]") {
    check<2>();
    check<2, Flip<double>>();
    check<3, WeightGradientForce>();
}
TEST_CASE("gradients through F-bar beside mirrored walls, and without constant inertia", "[adjoint]") {
    check<2>(NodesBehind::mirrored);
    check<2, CompactQuartic, WeightGradientForce>();
}

}  // namespace volumetric_gradient_tests
