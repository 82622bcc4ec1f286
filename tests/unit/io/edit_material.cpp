/// \file Parameters of a material that change during a run: the bound and the stresses follow, states have them, and a
/// restart takes them.
#include "support/message.hpp"

#include "restart_scene.hpp"

namespace edit_material_tests {

using namespace firn;

namespace {

using Clay = VonMises<double>;
using Run = Simulation<2, Clay>;

Run fallen(int threads) {
    Run run({{0, 0}, {1, 1}, 1.0 / 16}, Clay::from_properties({.young = 1e5, .yield_stress = 1e4}), Coloured{threads});
    run.add(sample_box<2>({0.3, 0}, {0.7, 0.4}, {.spacing = 1.0 / 32}), 1000, {0.5, -1});
    return run;
}
void steps(Run& run, int count) {
    for (int i = 0; i < count; ++i) run.step();
}
double strain(const Run& run) {
    double sum = 0;
    const auto& particles = run.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) sum += particles.state(slot).plastic_strain;
    return sum;
}

}  // namespace

TEST_CASE("A material that is edited in a run acts from the next step on", "[io]") {
    Run run = fallen(2), plain = fallen(2);
    steps(run, 20), steps(plain, 20);
    const double bound = run.stable_time_step();
    run.edit_material([](Clay& clay) { clay.mu *= 100, clay.lambda *= 100; });
    CHECK(run.stable_time_step() < bound / 5);
    const auto& particles = run.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot))
            CHECK(particles.stress(slot)(1, 1) ==
                  Approx(run.material().kirchhoff_stress(particles.state(slot))(1, 1)).epsilon(1e-12));
    run.edit_material([&](Clay& clay) { clay = plain.material(), clay.yield_stress = 10; });
    run.advance(0.05), plain.advance(0.05);
    CHECK(strain(run) > 5 * strain(plain) + 1);

    const Clay before = run.material();
    test_support::check_refused<parameter_error>([&] { run.edit_material([](Clay& clay) { clay.yield_stress = -1; }); },
                                                 "must be positive");
    CHECK(run.material().yield_stress == before.yield_stress);
}

TEST_CASE("A run with an edited material goes on from its state to the same bits", "[io][restart]") {
    Run whole = fallen(1), stopped = fallen(4);
    const states::Folder folder;
    for (Run* run : {&whole, &stopped}) {
        steps(*run, 30);
        run->edit_material([](Clay& clay) { clay.yield_stress = 200; });
        steps(*run, 30);
    }
    write_state(folder / "state.hdf", state_of(stopped));
    const auto state = read_state<double>(folder / "state.hdf");
    Run continued = fallen(3);  // with the strength at the start
    restore(continued, state);
    CHECK(continued.material().yield_stress == 200);
    steps(whole, 60), steps(continued, 60);
    CHECK((state_of(continued) == state_of(whole)));
    CHECK(strain(whole) > 1);

    Run converted = fallen(1);
    restore(converted, state, Restart::converted);
    CHECK(converted.material().yield_stress == 1e4);
}

TEST_CASE("An edited material whose parameters are damaged is refused at a restart", "[io][restart]") {
    Run run = fallen(1);
    run.edit_material([](Clay& clay) { clay.yield_stress = 200; });
    steps(run, 3);
    auto state = state_of(run);
    for (auto& parameter : state.parameters)
        if (parameter.group == "material" && parameter.name == "yield_stress") parameter.values = {-200};
    Run other = fallen(1);
    test_support::check_refused<io_error>([&] { restore(other, state); }, "is damaged");
    CHECK(other.material().yield_stress == 1e4);
}

TEST_CASE("Another material than that of an unedited run is still refused at a restart", "[io][restart]") {
    Run run = fallen(1);
    steps(run, 3);
    const auto state = state_of(run);
    Run other({{0, 0}, {1, 1}, 1.0 / 16}, Clay::from_properties({.young = 2e5, .yield_stress = 1e4}));
    test_support::check_refused<io_error>([&] { restore(other, state); }, "material of the state has mu");
}

}  // namespace edit_material_tests
