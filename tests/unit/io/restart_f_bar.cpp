// quick: no
/// \file Volumetric policies: a restart goes on to the same bits, and a run with another policy does not go on.
#include "restart_scene.hpp"

namespace restart_f_bar_tests {

using namespace firn;

TEST_CASE("FBar goes on to the same bits, threads changed at the restart", "[io][restart]") {
    restarts::goes_on<NeoHookean<float>, Coloured, Apic, FBar>(NeoHookean<float>::from_young_poisson(2e4, 0.45));
}

TEST_CASE("The filter of volume ratios goes on to the same bits, between two of its passes as well", "[io][restart]") {
    restarts::goes_on<NeoHookean<float>, Coloured, Apic, VolumeFilter>(
        NeoHookean<float>::from_young_poisson(2e4, 0.45));
}

TEST_CASE("Water whose particles are shifted goes on to the same bits", "[io][restart]") {
    restarts::goes_on<Fluid<float>, Coloured, Apic, VolumeFilter>(Fluid<float>::from_properties({.bulk = 2e4}));
}

TEST_CASE("A state that does not say how fast particles are shifted is of a run without shifting", "[io][restart]") {
    const Domain<2> domain{{0.0, 0.0}, {1.0, 1.0}, 1.0 / 16};
    Simulation water(domain, Fluid<float>{}, VolumeFilter{.every = 3, .shifting = 0.5});
    water.add(sample_box<2>({0.4, 0.4}, {0.6, 0.6}, {.spacing = 1.0 / 32}), 1000);
    auto state = state_of(water);
    water.volume = {};
    restore(water, state);
    CHECK((water.volume.every == 3 && water.volume.shifting == 0.5));
    CHECK(std::erase_if(state.parameters, [](const auto& p) { return p.name == "shifting"; }) == 1);
    restore(water, state);
    CHECK(water.volume.shifting == 0);
}

TEST_CASE("A run goes on from a state only with the same volumetric policy", "[io][restart]") {
    const Domain<2> domain{{0.0, 0.0}, {1.0, 1.0}, 1.0 / 16};
    const auto material = NeoHookean<float>::from_young_poisson(2e4, 0.45);
    Simulation averaged(domain, material, FBar{});
    Simulation own(domain, material);
    averaged.add(sample_box<2>({0.4, 0.4}, {0.6, 0.6}, {.spacing = 1.0 / 32}), 1000);
    own.add(sample_box<2>({0.4, 0.4}, {0.6, 0.6}, {.spacing = 1.0 / 32}), 1000);
    const auto of_averaged = state_of(averaged), of_own = state_of(own);
    CHECK_THROWS_AS(restore(own, of_averaged), io_error);
    CHECK_THROWS_AS(restore(averaged, of_own), io_error);
    CHECK_NOTHROW(restore(averaged, of_averaged));
}

}  // namespace restart_f_bar_tests
