// quick: no
// sanitized: -O1
/// \file The incremental potential of elastic matter: gradient and Hessian against differences and dense matrices.
#include "support/implicit.hpp"

namespace implicit_elastic_tests {
using namespace firn;
using namespace implicit_steps;

template <template <class> class M, class Kernel, class Force, int D>
void check() {
    CAPTURE(M<double>::name, Kernel::support, Force::name, D);
    for (const double strain : {0.01, 0.1}) {
        Block<Kernel, Force, M<double>, D> block(M<double>::from_young_poisson(1e5, 0.3), strain);
        check_block(block, strain);
    }
}

TEMPLATE_TEST_CASE_SIG("Gradient and Hessian of elastic matter, every material and force form", "[implicit]",
                       ((int D), D), 2, 3) {
    check<FixedCorotated, QuadraticBSpline, WeightGradientForce, D>();
    check<NeoHookean, QuadraticBSpline, WeightGradientForce, D>();
    check<Hencky, QuadraticBSpline, WeightGradientForce, D>();
    check<FixedCorotated, QuadraticBSpline, MlsForce, D>();
    check<Hencky, CubicBSpline, MlsForce, D>();
    check<NeoHookean, CompactQuartic, WeightGradientForce, D>();
    check<NeoHookean, Linear, WeightGradientForce, D>();
}

}  // namespace implicit_elastic_tests
