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

TEST_CASE("A body whose samples are spread over ranks is the body that every rank adds", "[mpi]") {
    const mpi::Communicator all;
    const auto run = [&](bool in_parts) {
        Simulation simulation(Domain<3>{{0, 0, 0}, {1, 1, 1}, 1. / 24},
                              FixedCorotated<float>::from_young_poisson(2e4, 0.3), mpi::Distributed<Coloured>({}, all));
        simulation.warn = nullptr;
        Samples<3> samples = sample_box<3>({0.1, 0.1, 0.1}, {0.5, 0.5, 0.5}, {.spacing = 0.025});
        if (!in_parts) {
            simulation.add(samples, 1000);
        } else {
            // All of the samples but those of the last rank, which has none.
            const Share share{std::size_t(all.rank()), std::size_t(all.size() - 1)};
            const std::size_t n = samples.positions.size();
            const bool is_last = all.rank() + 1 == all.size();
            const std::vector<Vec<double, 3>> whole = std::move(samples.positions);
            samples.positions.assign(whole.begin() + std::ptrdiff_t(is_last ? n : share.first(n)),
                                     whole.begin() + std::ptrdiff_t(is_last ? n : share.last(n)));
            const Body body = mpi::add(simulation, samples, 1000);
            CHECK(body.count == n);
        }
        for (int k = 0; k < 5; ++k) simulation.step();
        return fingerprint(simulation);
    };
    CHECK(run(true) == run(false));
}
