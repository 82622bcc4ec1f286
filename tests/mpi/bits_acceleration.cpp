// ranks: 2 3
#include "mpi/bits.hpp"

using namespace scenes;

namespace {

/// Jelly so soft that accelerations bound its steps: those of a field, and those of a load on some of its particles.
template <class Execution>
auto soft_blocks(const Execution& execution) {
    Simulation simulation(Domain<2>{{0, 0}, {2, 2}, 1. / 32}, FixedCorotated<float>::from_young_poisson(1, 0.3),
                          execution);
    simulation.warn = nullptr;
    simulation.add(sample_box<2>({0.2, 1.2}, {0.6, 1.6}, {.spacing = 1. / 64}), 1000);
    const Body right = simulation.add(sample_box<2>({1.4, 1.2}, {1.8, 1.6}, {.spacing = 1. / 64}), 1000);
    simulation.add_load(right, [](const Vec<double, 2>& x, double time) {
        return Vec<double, 2>{0, -(20 + 400 * time) * x[0] * 1000 / 4096};  // the largest is at the far end
    });
    return simulation;
}

}  // namespace

TEST_CASE("Steps that accelerations bound are the same on any number of ranks", "[mpi]") {
    const Attraction<float, 2> pull{{0, -5}, {0.4F, 0.6F}, {}, 1.5F, 40};
    const mpi::Communicator all;
    auto many = soft_blocks(mpi::Distributed<Coloured>({}, all));
    many.execution.largest_imbalance = 0;
    std::vector<double> seen, alone;
    const auto run = [&](auto& simulation, std::vector<double>& steps) {
        for (int i = 0; i < 10; ++i) {
            simulation.step(pull);
            steps.insert(steps.end(), {simulation.last_time_step(), simulation.largest_acceleration()});
            const double h = 1. / 32;  // neither waves nor speeds bound these steps
            REQUIRE(simulation.last_time_step() < stable_time_step<QuadraticBSpline>(h, 1.0));
        }
        return fingerprint(simulation);
    };
    const std::uint64_t bits = run(many, seen);
    if (all.rank() > 0) return;
    auto one = soft_blocks(mpi::Distributed<Coloured>({}, mpi::Communicator(MPI_COMM_SELF)));
    CHECK(run(one, alone) == bits);
    CHECK(seen == alone);
}
