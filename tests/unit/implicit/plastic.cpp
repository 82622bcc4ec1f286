// quick: no
// sanitized: -O1
/// \file Gradient and Hessian of matter without a potential: plastic flow, fluids, viscosity, and the wrappers.
#include "support/implicit.hpp"
#include <firn/soil.hpp>

namespace implicit_plastic_tests {
using namespace firn;
using namespace implicit_steps;

template <int D, class Force = WeightGradientForce, class M>
auto block_of(const M& material, double strain, double dt = 1) {
    return Block<QuadraticBSpline, Force, M, D>(material, strain, 4, 5.3, dt);
}
template <int D, class Force = WeightGradientForce, class M>
void check(const M& material, double strain, double displacement, double dt = 1) {
    CAPTURE(M::name, D, strain);
    auto block = block_of<D, Force>(material, strain, dt);
    check_block(block, displacement);
}
/// Returns how many particles of a block flow in a displacement.
template <int D, class M>
int flowing(const M& material, double strain, double displacement) {
    const auto block = block_of<D>(material, strain);
    const Numbers u = block.random_displacement(displacement, 5);
    int count = 0;
    for (const auto& p : block.of) {
        const auto trial = followed(p.state, block.gradient_at(p, u), 1.0);
        count += squared_norm(material.returned(trial).F - trial.F) > 1e-20;
    }
    return count;
}

TEMPLATE_TEST_CASE_SIG("Gradient and Hessian of plastic matter, within the yield surface and in flow", "[implicit]",
                       ((int D), D), 2, 3) {
    const int all = D == 2 ? 16 : 64;
    const auto sand = Sand<double>::from_properties({.young = 1e5});
    const auto steel = VonMises<double>::from_properties({.young = 1e5, .poisson = 0.3, .yield_stress = 1e3});
    const auto clay = Nacc<double>::from_properties({.young = 1e5});
    const auto snow = Snow<double>::from_properties({});
    const auto soil = MohrCoulomb<double>::from_properties({.young = 1e5, .cohesion = 500, .tension = 200});
    CHECK(flowing<D>(sand, 0.01, 0.01) > all / 2);
    CHECK(flowing<D>(steel, 0.02, 0.02) > all / 2);
    CHECK(flowing<D>(steel, 0.001, 0.001) == 0);
    CHECK(flowing<D>(snow, 0.03, 0.03) > all / 2);
    CHECK(flowing<D>(clay, 0.1, 0.1) > 0);
    CHECK(flowing<D>(soil, 0.02, 0.02) > all / 2);
    check<D>(sand, 0.01, 0.01);
    check<D, MlsForce>(sand, 0.05, 0.05);
    check<D>(steel, 0.001, 0.001);
    check<D>(steel, 0.02, 0.02);
    check<D>(clay, 0.001, 0.001);
    check<D>(clay, 0.1, 0.1);
    check<D>(soil, 0.02, 0.02);
    check<D>(snow, 0.001, 0.001);
    check<D>(snow, 0.03, 0.03);
    check<D>(Dissipating<VonMises<double>>{steel}, 0.02, 0.02);
}

TEMPLATE_TEST_CASE_SIG("Gradient and Hessian of fluids, of viscosity, and with parameters per particle", "[implicit]",
                       ((int D), D), 2, 3) {
    const auto water = Fluid<double>::from_properties({.bulk = 1e5, .viscosity = 10});
    check<D>(water, 0.05, 0.01, 0.01);
    check<D, MlsForce>(water, 0.05, 0.01, 0.01);
    const PerParticle<NeoHookean<double>, "mu"> solid{NeoHookean<double>::from_young_poisson(1e5, 0.3)};
    check<D>(solid, 0.1, 0.1);
    static_assert(has_potential<NeoHookean<double>, D> && has_potential<PerParticle<Hencky<double>, "mu">, D> &&
                  !has_potential<Fluid<double>, D> && !has_potential<Sand<double>, D> &&
                  !has_potential<Dissipating<Snow<double>>, D>);
}

}  // namespace implicit_plastic_tests
