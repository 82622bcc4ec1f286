// labels: full
// ranks: 2 3 7
// threads: 1 2
#include "mpi/bits.hpp"

using namespace scenes;

TEST_CASE("Volume changes averaged set by set have the same bits on any number of ranks", "[mpi]") {
    const auto make = [](const auto& e) { return fountain(e, NodesBehind::mirrored, FBar{}); };
    const Seen many = check_same_bits<Coloured>(make, 100);
    if (mpi::Communicator(MPI_COMM_WORLD).size() > 2) CHECK(many.migrations >= 2);  // two shares stay even
    if (mpi::Communicator(MPI_COMM_WORLD).rank() > 0) return;
    const Seen plain = look_at(make(Coloured{}), 100);
    CHECK(many == plain);
    CHECK(many.particles != look_at(fountain(Coloured{}, NodesBehind::mirrored), 100).particles);
}

TEST_CASE("So they have with sums in integers", "[mpi]") {
    check_same_bits<ColouredFixedPoint<std::int32_t>>(
        [](const auto& e) { return fountain(e, NodesBehind::held, FBar{}); }, 60);
}

TEST_CASE("Filtered volume ratios and shifted particles have the same bits on any number of ranks", "[mpi]") {
    const auto make = [](double shifting) {
        return [=](const auto& e) {
            return fountain(e, NodesBehind::mirrored, VolumeFilter{.every = 3, .shifting = shifting});
        };
    };
    const Seen many = check_same_bits<Coloured>(make(1), 60);
    if (mpi::Communicator(MPI_COMM_WORLD).rank() > 0) return;
    CHECK(many == look_at(make(1)(Coloured{}), 60));
    CHECK(many.particles != look_at(make(0)(Coloured{}), 60).particles);
}

TEST_CASE("So have particles of a liquid that are shifted beside matter of other contact groups", "[mpi]") {
    const auto make = [](const auto& e) {
        Simulation simulation(Domain<2>{{0, 0}, {1, 1}, 1. / 48},
                              Materials(Fluid<float>::from_properties({.bulk = 2e4}),
                                        FixedCorotated<float>::from_young_poisson(1e5, 0.3)),
                              e, CoulombContact{.friction = 0.2}, VolumeFilter{.every = 2, .shifting = 1});
        simulation.template set<0>().add(sample_box<2>({0.0, 0.0}, {0.9, 0.2}, {.spacing = 1. / 96}), 1000);
        for (int group = 1; group < 4; ++group) {
            auto solid = simulation.template set<1>();
            solid.set_contact_group(
                solid.add(sample_sphere<2>({0.28 * group - 0.1, 0.3}, 0.1, {.spacing = 1. / 96}), 2000, {0.5, -2}),
                group);
        }
        simulation.contact_impulses.emplace();
        return simulation;
    };
    check_same_bits<Coloured>(make, 60);
}
