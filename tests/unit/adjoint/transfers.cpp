// quick: no
// sanitized: no
/// \file The gradient through transfers that blend velocities against difference quotients.
#include "support/derivatives.hpp"

using namespace derivatives;

namespace transfers_gradient_tests {
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

TEST_CASE("gradients through FLIP and ASFLIP", "[adjoint]") {
    check<2, Flip<double>>();
    check<2, Asflip<double>, WeightGradientForce>();
}

}  // namespace transfers_gradient_tests
