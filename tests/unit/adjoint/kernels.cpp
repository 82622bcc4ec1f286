/// \file The gradient through every kernel and force form against difference quotients.
// quick: no
#include "support/derivatives.hpp"

using namespace derivatives;

namespace kernels_gradient_tests {
namespace {

const FixedCorotated<double> jelly = FixedCorotated<double>::from_young_poisson(1e5, 0.3);

template <int D, class... Policies>
void check() {
    using Simulation = SimulationWith<D, FixedCorotated<double>, Policies...>;
    Run<Simulation> run{jelly, walls_of_run<D>()};
    run.dt = 1e-3;
    check_derivatives(run);
}

}  // namespace

TEST_CASE("gradients through splines", "[adjoint]") {
    check<3, WeightGradientForce>();
    check<2, CubicBSpline>();
}
TEST_CASE("gradients through kernels without constant inertia", "[adjoint]") {
    check<2, CompactQuartic, WeightGradientForce>();
    check<2, Linear, WeightGradientForce>();
}

}  // namespace kernels_gradient_tests
