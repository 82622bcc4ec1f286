// quick: no
// sanitized: no
/// \file The gradient against runs in dual numbers.

#include "support/gradient_checks.hpp"

namespace tangent_tests {
using namespace firn;
using derivatives::jelly;
using derivatives::walls_of_run;

TEST_CASE("twelve steps and the way back are transposes of each other", "[adjoint]") {
    derivatives::Run<SimulationWith<2, FixedCorotated<double>>> run{jelly, walls_of_run<2>()};
    run.dt = 0x1p-10;
    tangent::check_transposed(run.at(0), 12, 4);
}

TEST_CASE("the gradient of 200 steps is the derivative of the run in dual numbers", "[adjoint]") {
    derivatives::Run<SimulationWith<2, FixedCorotated<double>>> run{jelly, walls_of_run<2>()};
    run.dt = 0x1p-11;
    for (const tangent::Compared& one : tangent::compare(run.at(0), 200, 16)) {
        CAPTURE(one.gradient, one.tangent);
        CHECK(std::abs(one.gradient - one.tangent) <= 1e-9 * std::abs(one.tangent));
    }
}

}  // namespace tangent_tests
