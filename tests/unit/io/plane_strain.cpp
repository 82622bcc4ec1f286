/// \file States of materials whose states have matrices of three dimensions in two, and outputs.

#include "restart_scene.hpp"

namespace plane_strain_state_tests {

using namespace firn;
using restarts::goes_on_with;

TEST_CASE("Matter in plane strain goes on to the same bits, threads changed at the restart", "[io][restart]") {
    goes_on_with<Coloured>(PlaneStrain<VonMises<float>>{VonMises<float>::from_properties({.young = 1e5})});
    goes_on_with<ColouredFixedPoint<std::int32_t>, Flip<double>>(
        PlaneStrain<Sand<double>>{Sand<double>::from_properties({})});
}

TEST_CASE("A state has F of three dimensions row by row, and the stress across the plane", "[io]") {
    using Model = PlaneStrain<VonMises<double>>;
    Simulation simulation(Domain<2>{{0, 0}, {1, 1}, 0.1}, Model{});
    const Body body = simulation.add(sample_box<2>({0.3, 0.3}, {0.6, 0.5}, {.spacing = 0.05}), 1000);
    int next = 0;
    simulation.set_states(body, [&](const Vec<double, 2>&, auto& state) {
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) state.F(i, j) = (i == j) + 1e-3 * (3 * i + j) + 1e-5 * next;
        state.plastic_strain = ++next;
    });
    auto state = state_of(simulation);
    CHECK(state.field("deformation_gradient").components == 9);
    CHECK(state.field("deformation_gradient_remainder").components == 3);
    CHECK(state.field("kirchhoff_stress_zz").unit == "Pa");
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const std::size_t row = particles.id(slot);
        const auto own = particles.state(slot);
        for (int k = 0; k < 9; ++k)
            CHECK(state.field("deformation_gradient").values[9 * row + std::size_t(k)] == own.F(k / 3, k % 3));
        CHECK(own.F(2, 0) == Approx(6e-3 + 1e-5 * (own.plastic_strain - 1)));
        CHECK(state.field("plastic_strain").values[row] == own.plastic_strain);
        const auto tau = VonMises<double>{}.kirchhoff_stress(own);
        CHECK(std::abs(tau(2, 2)) > 1e3);
        CHECK(state.field("kirchhoff_stress_zz").values[row] == tau(2, 2));
        CHECK(state.field("kirchhoff_stress").values[4 * row + 1] == tau(0, 1));
    }
}

}  // namespace plane_strain_state_tests
