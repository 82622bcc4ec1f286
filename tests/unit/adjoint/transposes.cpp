// sanitized: no
// quick: no
/// \file Steps and their ways back, with each policy once.
#include "support/transposes.hpp"

namespace transposes_tests {
using namespace firn;

TEST_CASE("twelve steps and their way back are transposes, with each policy once", "[adjoint]") {
    using transposes::check;
    check<2, Apic>(NeoHookean<double>::from_young_poisson(1e5, 0.3), Contact::none);
    check<3, Pic, WeightGradientForce, CubicBSpline>(Hencky<double>::from_young_poisson(1e5, 0.3), Contact::slip);
    check<3, Flip<double>>(Sand<double>::from_properties({.young = 1e5}), Contact::stick, 0.99, 0.08);
    check<2, Aflip<double>, WeightGradientForce, CompactQuartic>(
        Nacc<double>::from_properties({.young = 1e5, .consolidation = 500}), Contact::separate, 0.95);
    check<2, Asflip<double>, WeightGradientForce, Linear>(
        Fluid<double>::from_properties({.bulk = 1e4, .viscosity = 10}), Contact::slip, 0.97);
    check<2, Fmpm>(NeoHookean<double>::from_young_poisson(1e5, 0.3), Contact::slip);
}

}  // namespace transposes_tests
