/// \file Contact groups: a restart goes on to the same bits, states hold the groups, and a run with another law does
/// not go on.
#include "support/catch.hpp"
#include <firn/contact/coulomb.hpp>
#include <firn/firn.hpp>
#include <firn/io/states.hpp>

#include "example_state.hpp"

namespace restart_contact_tests {

using namespace firn;

const Domain<2> domain{{0.0, 0.0}, {1.0, 1.0}, 1.0 / 16};
const auto material = NeoHookean<float>::from_young_poisson(2e4, 0.3);

/// A block of group 5 falls on a block of group 0, and a source adds blocks of group 2.
auto made(int threads, double friction = 0.4) {
    Simulation simulation(domain, material, CoulombContact{.friction = friction}, Coloured{threads});
    simulation.warn = {};
    simulation.add_source({.samples = sample_box<2>({0.1, 0.7}, {0.2, 0.8}, {.spacing = 1.0 / 32}),
                           .velocity = {1.0, -2.0},
                           .rate = 20,
                           .start = 0.01,
                           .contact_group = 2});
    return simulation;
}
template <class Simulation>
void add_blocks(Simulation& simulation) {
    simulation.add(sample_box<2>({0.35, 0.0}, {0.6, 0.25}, {.spacing = 1.0 / 32}), 1000);
    const Body upper =
        simulation.add(sample_box<2>({0.4, 0.26}, {0.65, 0.5}, {.spacing = 1.0 / 32}), 1000, {0.3, -2.5});
    simulation.set_contact_group(upper, 5);
}

TEST_CASE("Contact goes on to the same bits, threads changed at the restart", "[io][restart]") {
    auto whole = made(1), stopped = made(4);
    for (auto* run : {&whole, &stopped}) add_blocks(*run);
    for (int i = 0; i < 300; ++i) whole.step();
    for (int i = 0; i < 140; ++i) stopped.step();
    const states::Folder folder;
    write_state(folder / "state.hdf", state_of(stopped));
    auto continued = made(3);
    restore(continued, read_state<float>(folder / "state.hdf"));
    CHECK(continued.bodies().size() > 2);
    CHECK(continued.bodies()[1].contact_group == 5);
    CHECK(continued.bodies().back().contact_group == 2);
    for (int i = 0; i < 160; ++i) continued.step();
    CHECK((state_of(continued) == state_of(whole)));  // too large to be printed
}

TEST_CASE("A converted state keeps its contact groups", "[io][restart]") {
    auto first = made(1);
    add_blocks(first);
    for (int i = 0; i < 40; ++i) first.step();
    Simulation finer(Domain<2>{{-0.5, 0.0}, {1.5, 1.0}, 1.0 / 32}, material, CoulombContact{});
    finer.warn = {};
    restore(finer, state_of(first), Restart::converted);
    const auto& particles = finer.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        for (const Body& body : finer.bodies())
            if (particles.is_particle(slot) && body.holds(particles.id(slot)))
                CHECK(particles.contact_group(slot) == body.contact_group);
    CHECK(finer.bodies()[1].contact_group == 5);
    CHECK_NOTHROW(finer.step());
}

TEST_CASE("A run goes on from a state only with the same contact law", "[io][restart]") {
    auto run = made(1), rougher = made(1, 0.5);
    Simulation one_field(domain, material);
    for (auto* each : {&run, &rougher}) add_blocks(*each);
    one_field.add(sample_box<2>({0.4, 0.4}, {0.6, 0.6}, {.spacing = 1.0 / 32}), 1000);
    const auto state = state_of(run);
    CHECK_THROWS_AS(restore(one_field, state), io_error);
    CHECK_THROWS_AS(restore(rougher, state), io_error);
    CHECK_THROWS_AS(restore(run, state_of(one_field)), io_error);
    CHECK_NOTHROW(restore(run, state));
}

TEST_CASE("A state whose groups contradict its blocks is refused", "[io][restart]") {
    auto run = made(1);
    add_blocks(run);
    auto state = state_of(run);
    for (auto& table : state.tables)
        if (table.name == "contact_group") table.values[1] = 4;
    CHECK_THROWS_AS(restore(run, state), io_error);
    for (auto& table : state.tables)
        if (table.name == "contact_group") table.values[1] = 1 << 25;
    CHECK_THROWS_AS(restore(run, state), io_error);
    for (auto& table : state.tables)
        if (table.name == "contact_group") table.values.pop_back();
    CHECK_THROWS_AS(restore(run, state), io_error);
}

}  // namespace restart_contact_tests
