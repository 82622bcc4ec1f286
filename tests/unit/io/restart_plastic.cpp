// quick: no
// Plastic materials and fluids: a restart goes on to the same bits.
#include <firn/soil.hpp>

#include "restart_scene.hpp"

namespace restart_plastic_tests {

using namespace firn;
using restarts::goes_on_with;

TEST_CASE("Snow goes on to the same bits, threads changed at the restart", "[io][restart]") {
    goes_on_with<FixedPoint<std::int64_t>>(Snow<float>::from_properties({}));
}
TEST_CASE("Sand goes on to the same bits, threads changed at the restart", "[io][restart]") {
    goes_on_with<ColouredFixedPoint<std::int32_t>, Pic>(Sand<float>::from_properties({}));
}
TEST_CASE("Von Mises goes on to the same bits, threads changed at the restart", "[io][restart]") {
    goes_on_with<detail::Serial>(VonMises<float>::from_properties({.young = 1e5, .yield_stress = 2e3}));
}
TEST_CASE("Cam clay goes on to the same bits, threads changed at the restart", "[io][restart]") {
    goes_on_with<Coloured>(Nacc<float>::from_properties({.young = 1e5}));
}
TEST_CASE("Soil that softens goes on to the same bits, threads changed at the restart", "[io][restart]") {
    goes_on_with<Coloured>(
        MohrCoulomb<float>::from_properties({.young = 1e5, .cohesion = 2e3, .softening_strain = 0.1}));
}
TEST_CASE("A fluid goes on to the same bits, threads changed at the restart", "[io][restart]") {
    goes_on_with<Coloured, Aflip<float>>(Fluid<float>::from_properties({.viscosity = 0.5}));
}
TEST_CASE("What plastic flow took is counted on after a restart to the same bits", "[io][restart]") {
    goes_on_with<Coloured>(
        Dissipating<VonMises<double>>{VonMises<double>::from_properties({.young = 1e5, .yield_stress = 2e3})});
}

}  // namespace restart_plastic_tests
