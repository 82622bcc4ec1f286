// ranks: 3 7
// threads: 1 2
#include "mpi/bits.hpp"

using namespace scenes;

TEST_CASE("Two cubes have the bits of a run without MPI while cuts move", "[mpi]") {
    const Seen many = check_same_bits<Coloured>([](const auto& e) { return two_cubes(e); }, 300);
    CHECK(many.migrations >= 5);
    if (mpi::Communicator(MPI_COMM_WORLD).rank() > 0) return;
    const Seen plain = look_at(two_cubes(Coloured{}), 300);
    CHECK(many == plain);
}

TEST_CASE("The order of sums matters: with the own pieces first, bits differ", "[mpi]") {
    const mpi::Communicator all;
    const Seen right = look_at(two_cubes(mpi::Distributed<Coloured>({}, all)), 20);
    mpi::detail::adds_own_first = true;
    const Seen wrong = look_at(two_cubes(mpi::Distributed<Coloured>({}, all)), 20);
    mpi::detail::adds_own_first = false;
    CHECK(right.particles != wrong.particles);
}

TEST_CASE("A spray has the same bits on any number of ranks", "[mpi]") {
    const Seen many = check_same_bits<Coloured>([](const auto& e) { return spray(e); }, 150);
    CHECK(many.migrations >= 5);
}
