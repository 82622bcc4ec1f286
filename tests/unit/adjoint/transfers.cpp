/// \file The gradient through every transfer against difference quotients.
// quick: no
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

TEST_CASE("gradients through PIC and FLIP", "[adjoint]") {
    check<2, Pic>();
    check<2, Flip<double>>();
}
TEST_CASE("gradients through AFLIP and ASFLIP", "[adjoint]") {
    check<2, Aflip<double>, WeightGradientForce>();
    check<2, Asflip<double>>();
}

}  // namespace transfers_gradient_tests
