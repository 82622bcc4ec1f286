/// \file The gradient of a few steps against difference quotients, with every policy and each kind of input.
// quick: no
#include "support/derivatives.hpp"

using namespace derivatives;

namespace one_step_tests {
namespace {

template <int D>
Walls<double, D> walls(Contact contact, double friction) {
    return Walls<double, D>::all(Vec<double, D>::filled(0), Vec<double, D>::filled(1), {contact, friction});
}
/// Checks each kind of input alone, and all together.
template <class Simulation>
void check_each(Run<Simulation> run) {
    constexpr double Along::* inputs[] = {&Along::position, &Along::velocity, &Along::affine,   &Along::state,
                                          &Along::mass,     &Along::volume,   &Along::material, &Along::transfer,
                                          &Along::gravity,  &Along::boundary};
    constexpr const char* names[] = {"position", "velocity", "affine", "state", "mass", "volume", "material", "transfer", "gravity", "boundary"};
    CHECK(run.error() < 1e-6);
    for (int k = 0; k < 10; ++k) {
        run.along = {};
        run.along.*inputs[k] = 1;
        CAPTURE(names[k]);
        if (run.slope() != 0 || run.value(1e-3) != run.value(-1e-3)) CHECK(run.error() < 1e-6);
    }
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("the gradient of three steps is the limit of difference quotients", "[adjoint]", ((int D), D), 2, 3) {
    const auto elastic = FixedCorotated<double>::from_young_poisson(1e5, 0.3);
    check_each(Run<SimulationWith<D, FixedCorotated<double>>>{elastic, walls<D>(Contact::separate, 0.3)});
}

}  // namespace one_step_tests
