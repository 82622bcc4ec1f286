// A long run on several ranks: soak [MINUTES] [PARTICLES]. Water sloshes across all cuts, because gravity turns. Checks
// that no particle is lost or doubled, that the mass is exact, and prints the memory of each rank.
#include <firn/firn.hpp>
#include <firn/mpi.hpp>

#include <sys/resource.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

int main(int argc, char** argv) {
    firn::mpi::Session session(argc, argv);
    const double minutes = argc > 1 ? std::atof(argv[1]) : 30, particles = argc > 2 ? std::atof(argv[2]) : 1e5;
    const double spacing = std::cbrt(0.5 * 0.4 * 0.25 / particles);
    firn::Simulation simulation(firn::Domain<3>{{0, 0, 0}, {1, 0.5, 0.25}, 2 * spacing},
                                firn::Fluid<float>::from_properties({.bulk = 2e4}),
                                firn::mpi::Distributed<firn::Coloured>({1}));
    simulation.add(firn::sample_box<3>({0, 0, 0}, {0.5, 0.4, 0.25}, {.spacing = spacing}), 1000);
    const firn::mpi::Communicator& all = simulation.execution.communicator();
    const double mass = simulation.totals().mass;
    const std::uint64_t ids = simulation.particles().next_id();
    const double begin = firn::mpi::detail::seconds_of(CLOCK_MONOTONIC);
    for (double last = begin;;) {
        for (int i = 0; i < 50; ++i) {
            const double angle = 0.9 * std::sin(2.5 * simulation.time());
            simulation.gravity = {9.81 * std::sin(angle), -9.81 * std::cos(angle), 0};
            simulation.step();
        }
        std::uint64_t here[3] = {};  // sums that show a lost or doubled id
        const auto& mine = simulation.particles();
        for (std::size_t slot = 0; slot < mine.slots(); ++slot)
            if (mine.is_particle(slot)) {
                const std::uint64_t id = mine.id(slot);
                here[0] += 1;
                here[1] += id;
                here[2] += id * id;
            }
        all.sum(std::span<std::uint64_t>(here));
        std::uint64_t wanted[3] = {};
        for (std::uint64_t id = 0; id < ids; ++id) wanted[0] += 1, wanted[1] += id, wanted[2] += id * id;
        if (!std::equal(here, here + 3, wanted)) throw firn::usage_error("The ids are not complete.");
        if (simulation.totals().mass != mass) throw firn::usage_error("The mass has changed.");
        const double now = firn::mpi::detail::seconds_of(CLOCK_MONOTONIC);
        const bool ends = all.max(now - begin) > 60 * minutes;
        if (all.max(now - last) < 60 && !ends) continue;
        last = now;
        rusage usage{};
        getrusage(RUSAGE_SELF, &usage);
        const auto memory = all.all(double(usage.ru_maxrss) / 1024);
        const auto counts = all.all(mine.size());
        if (all.rank() == 0) {
            std::string text;
            for (int r = 0; r < all.size(); ++r)
                text += firn::sentence("  ", counts[std::size_t(r)], " (", memory[std::size_t(r)], " MiB)");
            std::printf("%.1f min, step %llu, %.2f s, %llu new cuts:%s\n", (now - begin) / 60,
                        static_cast<unsigned long long>(simulation.steps()), simulation.time(),
                        static_cast<unsigned long long>(simulation.execution.migrations()), text.c_str());
            std::fflush(stdout);
        }
        if (ends) break;
    }
}
