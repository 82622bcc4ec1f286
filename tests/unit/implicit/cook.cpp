// quick: no
// sanitized: -O1
/// \file Cook's membrane by load steps, nearly incompressible: what is hard for Newton's method and for the multigrid.
#include "../../../benchmarks/verification/scenes/cook.hpp"

#include "support/catch.hpp"
#include <firn/implicit.hpp>

namespace implicit_cook_tests {
using namespace firn;
using Membrane = verification::CookMembrane<WeightGradientForce, QuasiStatic>;

void bend(Membrane& membrane, double small_nodes, double tolerance) {
    membrane.simulation.warn = {};
    membrane.simulation.integration.small_nodes.threshold = small_nodes;
    verification::load(membrane.simulation, 1, tolerance);
    CHECK(membrane.simulation.solution.halvings == 0);
}

TEST_CASE("A coarsest level that is indefinite by a little stays a multigrid's", "[implicit]") {
    // After the first Newton step, matter is under pressure. With block Jacobi in place of the multigrid, 737 products.
    Membrane membrane(0.49, 16, 32);
    bend(membrane, 0.1, 1e-8);
    CHECK(membrane.simulation.solution.products < 80);
}

TEST_CASE("Newton's method goes on where rounding hides the last changes of the energy", "[implicit]") {
    // Without that, the load step is halved after 26 Newton steps.
    Membrane membrane(0.499, 16, 32);
    bend(membrane, 0, 1e-10);
    CHECK(membrane.simulation.solution.newton.residuals.back() <= 1e-10);
}

}  // namespace implicit_cook_tests
