// quick: no
// sanitized: -O1
/// \file Cook's membrane by a load step, nearly incompressible: what is hard for the multigrid.
#include "../../../benchmarks/verification/scenes/cook.hpp"

#include "support/catch.hpp"
#include <firn/implicit.hpp>

namespace implicit_cook_tests {
using namespace firn;

TEST_CASE("A coarsest level that is indefinite by a little stays a multigrid's", "[implicit]") {
    // After the first Newton step, matter is under pressure. With block Jacobi in place of the multigrid, 737 products.
    verification::CookMembrane<WeightGradientForce, QuasiStatic> membrane(0.49, 16, 32);
    membrane.simulation.warn = {};
    verification::load(membrane.simulation, 1, 1e-8);
    CHECK(membrane.simulation.solution.halvings == 0);
    CHECK(membrane.simulation.solution.products < 80);
}

}  // namespace implicit_cook_tests
