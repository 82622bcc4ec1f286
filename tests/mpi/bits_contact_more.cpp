// labels: full
// ranks: 2 3 4 7
#include "mpi/restart.hpp"
#include "mpi/scenes_contact.hpp"

using namespace scenes;

TEST_CASE("Contact in 3D has the same bits on any number of ranks", "[mpi]") {
    check_contact<Coloured>([](const auto& e) { return balls<3>(e, NodesBehind::mirrored, false, only_walls); }, 60);
}

TEST_CASE("So it has across a periodic end, with FMPM and F-bar", "[mpi]") {
    check_contact<Coloured>(
        [](const auto& e) { return balls<2>(e, NodesBehind::held, true, only_walls, Fmpm{}, FBar{}); }, 100);
}

TEST_CASE("So it has with sums in integers", "[mpi]") {
    check_contact<ColouredFixedPoint<std::int32_t>>(
        [](const auto& e) { return balls<2>(e, NodesBehind::held, false, only_walls); }, 100);
}

TEST_CASE("So it has with walls and a sphere by the gap of particles, with FLIP", "[mpi]") {
    check_contact<Coloured>([](const auto& e) { return balls<2>(e, NodesBehind::held, false, by_gap, Flip<float>{}); },
                            100);
    check_contact<Coloured>([](const auto& e) { return balls<3>(e, NodesBehind::held, true, by_gap); }, 40);
}

TEST_CASE("States and restarts with contact groups have the bits of a run without MPI") {
    mpi_restart::check_restart<Coloured>(
        [](const auto& e) { return balls<2>(e, NodesBehind::held, false, only_walls); }, 70, 60);
}
