// quick: no
// Elastic materials: a restart goes on to the same bits.
#include "restart_scene.hpp"

namespace restart_elastic_tests {

using namespace firn;
using restarts::goes_on_with;

TEST_CASE("Fixed corotated goes on to the same bits, threads changed at the restart", "[io][restart]") {
    const auto material = FixedCorotated<float>::from_young_poisson(2e4, 0.3);
    goes_on_with<detail::Serial, Flip<float>>(material);
    goes_on_with<Coloured, Asflip<float>>(material);
}
TEST_CASE("Neo-Hookean goes on to the same bits, threads changed at the restart", "[io][restart]") {
    goes_on_with<FixedPoint<std::int32_t>>(NeoHookean<float>::from_young_poisson(2e4, 0.3));
}
TEST_CASE("Hencky goes on to the same bits, threads changed at the restart", "[io][restart]") {
    goes_on_with<Coloured, Fmpm>(Hencky<double>::from_young_poisson(2e4, 0.3));
}
TEST_CASE("A material with moduli of each particle goes on to the same bits, threads changed at the restart",
          "[io][restart]") {
    goes_on_with<ColouredFixedPoint<std::int64_t>>(
        PerParticle<FixedCorotated<float>, "mu", "lambda">{FixedCorotated<float>::from_young_poisson(2e4, 0.3)});
}

}  // namespace restart_elastic_tests
