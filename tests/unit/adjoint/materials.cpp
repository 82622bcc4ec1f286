// quick: no
// sanitized: no
/// \file The gradient through materials that flow, against difference quotients.
#include "support/gradient_checks.hpp"
#include <firn/soil.hpp>

using namespace derivatives;

namespace materials_gradient_tests {
namespace {

/// \param stretch  mean of the first stretches;  \param strain  their scatter
template <int D, class Material>
void check(const Material& material, double stretch, double strain) {
    Run<SimulationWith<D, Material>> run{material, walls_of_run<D>()};
    run.dt = 5e-4;
    run.stretch = stretch;
    run.strain = strain;
    CAPTURE(name_of<Material>());
    check_derivatives(run);
}

}  // namespace

TEST_CASE("gradients through viscous fluid, and through snow, metal and sand that flow", "[adjoint]") {
    check<2>(Fluid<double>::from_properties({.bulk = 1e4, .viscosity = 10}), 0.97, 0.03);
    check<2>(Snow<double>::from_properties({}), 1, 0.03);
    check<2>(VonMises<double>::from_properties({.young = 1e5, .yield_stress = 1e3, .hardening = 1e3}), 1, 0.03);
    check<3>(Sand<double>::from_properties({.young = 1e5}), 0.97, 0.03);
    check<3>(MohrCoulomb<double>::from_properties({.young = 1e5, .cohesion = 500, .dilatancy_angle = degrees(10)}),
             0.97, 0.03);
}

}  // namespace materials_gradient_tests
