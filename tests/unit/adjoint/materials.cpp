/// \file The gradient through every material, flowing, against difference quotients.
// quick: no
#include "support/derivatives.hpp"

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

TEST_CASE("gradients through elastic materials and fluids", "[adjoint]") {
    check<2>(NeoHookean<double>::from_young_poisson(1e5, 0.3), 1, 0.03);
    check<2>(Hencky<double>::from_young_poisson(1e5, 0.3), 1, 0.03);
    check<2>(Fluid<double>::from_properties({.bulk = 1e4, .viscosity = 10}), 0.97, 0.03);
}
TEST_CASE("gradients through plastic materials", "[adjoint]") {
    check<2>(Snow<double>::from_properties({}), 1, 0.03);
    check<2>(VonMises<double>::from_properties({.young = 1e5, .yield_stress = 1e3, .hardening = 1e3}), 1, 0.03);
    check<3>(Sand<double>::from_properties({.young = 1e5}), 0.97, 0.03);
    check<2>(Nacc<double>::from_properties({}), 0.97, 0.03);
}
TEST_CASE("gradients through materials that wrap others", "[adjoint]") {
    using Varied = PerParticle<NeoHookean<double>, "mu">;
    Run<SimulationWith<2, Varied>> run{Varied{NeoHookean<double>{300, 500}}, walls_of_run<2>()};
    run.dt = 5e-3;
    run.along.material = 0;  // it gives the particles their first values
    check_derivatives(run);
    check<2>(Dissipating<VonMises<double>>{VonMises<double>{30, 50, 1, 1}}, 1, 0.03);
}

}  // namespace materials_gradient_tests
