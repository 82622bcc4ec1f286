// ranks: 3 7
// threads: 2 1
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

TEST_CASE("A wrong particle on one rank is an error on all, with one text", "[mpi]") {
    const mpi::Communicator all;
    const auto text_of = [&](auto&& simulation) -> std::string {
        simulation.warn = nullptr;
        try {
            for (int k = 0; k < 50; ++k) simulation.step();
        } catch (const particle_error& failure) {
            return failure.what();
        }
        return "nothing was thrown";
    };
    SECTION("before a step") {
        auto simulation = two_cubes(mpi::Distributed<Coloured>({}, all));
        auto& particles = simulation.edit_particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.id(slot) == 77)
                particles.set_velocity(slot, Vec<float, 3>::filled(std::numeric_limits<float>::quiet_NaN()));
        const std::string text = text_of(simulation);
        CAPTURE(text);
        CHECK(text == all.text_of(0, text));
        CHECK(text.find("particle 77 at") != std::string::npos);
        CHECK(text.starts_with("Rank "));
    }
    SECTION("in a step") {
        auto simulation = two_cubes(mpi::Distributed<Coloured>({}, all));
        simulation.fixed_time_step = 0.05;
        const std::string text = text_of(simulation);
        CAPTURE(text);
        CHECK(text == all.text_of(0, text));
        CHECK(text.starts_with("Rank "));
        CHECK(text.find("times the bound of the time step") != std::string::npos);
    }
}

TEST_CASE("A signal to one rank stops all at the same step", "[mpi]") {
    const mpi::Communicator all;
    const Interruption interruption;
    auto simulation = two_cubes(mpi::Distributed<Coloured>({}, all));
    for (int k = 0; k < 5 && !simulation.execution.interrupted(); ++k) {
        if (k == 1 && all.rank() + 1 == all.size()) std::raise(SIGTERM);
        simulation.step();
    }
    CHECK(simulation.steps() == 2);
}

TEST_CASE("A warning is given once, by rank 0", "[mpi]") {
    const mpi::Communicator all;
    Simulation simulation(Domain<3>{{0, 0, 0}, {1, 1, 1}, 1. / 24}, FixedCorotated<float>::from_young_poisson(2e4, 0.3),
                          mpi::Distributed<Coloured>({}, all));
    int warnings = 0;
    simulation.warn = [&](const std::string&) { ++warnings; };
    simulation.add(sample_box<3>({0.1, 0.1, 0.1}, {0.5, 0.5, 0.5}, {.spacing = 0.025}), 1000);
    simulation.add(sample_box<3>({0.1, 0.1, 0.1}, {0.5, 0.5, 0.5}, {.spacing = 0.025}), 1000);
    simulation.step();
    CHECK(warnings == (all.rank() == 0 ? 1 : 0));
}
