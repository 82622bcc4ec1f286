// labels: full
/// \file As restart.cpp, with other scenes.
#include "mpi/restart.hpp"

namespace mpi_restart {

TEST_CASE("States and restarts of spray have the bits of a run without MPI") {
    check_restart<Coloured>([](const auto& e) { return scenes::spray(e); }, 10, 15);
}
TEST_CASE("States and restarts of four materials have the bits of a run without MPI") {
    check_restart<Coloured>([](const auto& e) { return scenes::four_materials(e); }, 8, 12);
}
TEST_CASE("States and restarts of a fountain have the bits of a run without MPI") {
    check_restart<Coloured>([](const auto& e) { return scenes::fountain(e); }, 60, 60);
}
TEST_CASE("States and restarts of waves in double have the bits of a run without MPI") {
    check_restart<Coloured>([](const auto& e) { return scenes::waves(e); }, 15, 20);
}
TEST_CASE("States and restarts of sums in integers have the bits of a run without MPI") {
    check_restart<FixedPoint<std::int64_t>>([](const auto& e) { return scenes::two_cubes(e); }, 10, 10);
}

}  // namespace mpi_restart
