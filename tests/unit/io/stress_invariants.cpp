/// \file Invariants of stress in states.
#include "support/message.hpp"
#include <firn/soil.hpp>

#include "restart_scene.hpp"

#include <numbers>

namespace stress_invariants_tests {

using namespace firn;

TEST_CASE("The invariants of a stress: triaxial compression, extension and pure shear", "[io]") {
    const double pi = std::numbers::pi;
    const double compression[9] = {-1, 0, 0, 0, -3, 0, 0, 0, -1}, extension[9] = {-3, 0, 0, 0, -1, 0, 0, 0, -3},
                 shear[9] = {0, 2, 0, 2, 0, 0, 0, 0, 0}, nothing[9] = {-2, 0, 0, 0, -2, 0, 0, 0, -2};
    CHECK(stress_invariants(compression).mean_pressure == Approx(5.0 / 3));
    CHECK(stress_invariants(compression).deviatoric_stress == Approx(2));
    CHECK(stress_invariants(compression).lode_angle == Approx(pi / 6));
    CHECK(stress_invariants(extension).lode_angle == Approx(-pi / 6));
    CHECK(stress_invariants(shear).deviatoric_stress == Approx(2 * std::sqrt(3.0)));
    CHECK(stress_invariants(shear).lode_angle == Approx(0).margin(1e-12));
    CHECK(stress_invariants(nothing).deviatoric_stress == 0);
    CHECK(stress_invariants(nothing).lode_angle == 0);
}

#ifndef FIRN_TEST_QUICK
TEST_CASE("A state gets the invariants of its particles, of the effective stress where there is water", "[io]") {
    const auto add_to = []<int D>(const auto& material, std::integral_constant<int, D>) {
        Simulation<D, std::remove_cvref_t<decltype(material)>> simulation({{}, Vec<double, D>::filled(1), 0.1},
                                                                          material);
        const Body body = simulation.add(
            sample_box<D>(Vec<double, D>::filled(0.3), Vec<double, D>::filled(0.5), {.spacing = 0.1}), 1000);
        simulation.set_states(body, [](const auto&, auto& state) {
            state.F(0, 0) = 0.99, state.F(0, 1) = 0.02;
            if constexpr (requires { state.pore_pressure; }) state.pore_pressure = 100;
        });
        auto state = state_of(simulation);
        add_stress_invariants(state);
        add_stress_invariants(state);  // anew, not twice
        return state;
    };
    using Solid = Hencky<double>;
    const auto solid = Solid::from_young_poisson(1e5, 0.3);
    const auto flat = add_to(PlaneStrain<Undrained<Solid>>{{solid, 1e5}}, std::integral_constant<int, 2>{});
    const auto full = add_to(solid, std::integral_constant<int, 3>{});
    for (const char* name : {"mean_pressure", "deviatoric_stress", "lode_angle"}) {
        CHECK(std::ranges::count(flat.fields, name, &StateField<double>::name) == 1);
        CHECK(flat.field(name).values[0] == Approx(full.field(name).values[0]).epsilon(1e-9));
        CHECK(full.field(name).values[0] != 0);
    }
    const states::Folder folder;
    write_state(folder / "state.hdf", flat);
    CHECK((read_state<double>(folder / "state.hdf") == flat));

    Simulation<2, Solid> plain({{0, 0}, {1, 1}, 0.1}, solid);
    plain.add(sample_box<2>({0.3, 0.3}, {0.5, 0.5}, {.spacing = 0.1}), 1000);
    auto state = state_of(plain);
    test_support::check_refused<parameter_error>([&] { add_stress_invariants(state); }, "PlaneStrain");
}
#endif

}  // namespace stress_invariants_tests
