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
