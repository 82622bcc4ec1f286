// quick: no
/// \file Boundaries that act by the gap of particles: a restart goes on to the same bits, and a run whose boundary acts
/// on nodes does not go on.
#include "support/catch.hpp"
#include <firn/firn.hpp>
#include <firn/io/states.hpp>

#include "example_state.hpp"

namespace restart_gap_contact_tests {

using namespace firn;

namespace {

/// A floor with mirrored nodes, and a ball that moves upwards.
auto boundary() {
    auto walls = Walls<float, 2>::all({0, 0}, {1, 1}, {Contact::separate, 0.3});
    walls.nodes_behind = NodesBehind::mirrored;
    Collider<Sphere<float, 2>> ball{.shape = {0.1f}, .position = {0.4, 0.0}};
    ball.linear_velocity = {0, 0.3};
    return Together(walls, ball);
}

template <class Boundary>
auto made(int threads, const Boundary& boundary) {
    Simulation simulation(Domain<2>{{0.0, 0.0}, {1.0, 1.0}, 1.0 / 16}, NeoHookean<float>::from_young_poisson(2e4, 0.3),
                          boundary, Coloured{threads});
    simulation.warn = {};
    return simulation;
}
template <class Simulation>
void add_block(Simulation& simulation) {
    simulation.add(sample_box<2>({0.35, 0.12}, {0.6, 0.4}, {.spacing = 1.0 / 32}), 1000, {0.5, -2.5});
}

}  // namespace

TEST_CASE("A boundary by the gap goes on to the same bits, threads changed at the restart", "[io][restart]") {
    auto whole = made(1, GapContact{boundary()}), stopped = made(4, GapContact{boundary()});
    for (auto* run : {&whole, &stopped}) add_block(*run);
    for (int i = 0; i < 200; ++i) whole.step();
    for (int i = 0; i < 90; ++i) stopped.step();
    const states::Folder folder;
    write_state(folder / "state.hdf", state_of(stopped));
    auto continued = made(3, GapContact{boundary()});
    restore(continued, read_state<float>(folder / "state.hdf"));
    CHECK(std::get<1>(continued.boundary.boundary.parts).position[1] > 0);  // the ball is where it was
    for (int i = 0; i < 110; ++i) continued.step();
    CHECK((state_of(continued) == state_of(whole)));  // too large to be printed
}

TEST_CASE("A run by the gap does not go on with a boundary that acts on nodes", "[io][restart]") {
    auto by_gap = made(1, GapContact{boundary()});
    add_block(by_gap);
    auto on_nodes = made(1, boundary());
    CHECK_THROWS_AS(restore(on_nodes, state_of(by_gap)), io_error);
}

}  // namespace restart_gap_contact_tests
