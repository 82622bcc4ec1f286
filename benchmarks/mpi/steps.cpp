// What steps cost on several ranks: steps [--particles N] [--intervals K] [--steps-of-interval S] [--scene cubes|block]
// [--plain] [--trace FILE]. Prints the processor time of a step, of all ranks together and without waiting: the median
// over intervals. --plain runs firn::Simulation without ranks. --trace writes what each rank did in the last interval.
#include <firn/firn.hpp>
#include <firn/mpi.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <string>
#include <vector>

namespace {

struct Options {
    double particles = 1e6;
    int intervals = 20, steps = 4;
    bool plain = false;
    std::string scene = "cubes", trace{};
};

Options read(int argc, char** argv) {
    Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string name = argv[i];
        if (name == "--plain") {
            options.plain = true;
            continue;
        }
        if (i + 1 == argc) throw firn::parameter_error(name + " needs a value, or is no option.");
        const char* value = argv[++i];
        if (name == "--particles")
            options.particles = std::atof(value);
        else if (name == "--intervals")
            options.intervals = std::atoi(value);
        else if (name == "--steps-of-interval")
            options.steps = std::atoi(value);
        else if (name == "--scene")
            options.scene = value;
        else if (name == "--trace")
            options.trace = value;
        else
            throw firn::parameter_error("There is no option " + name + ".");
    }
    return options;
}

/// Two elastic cubes that fly towards each other, or one block that falls; 8 particles in a cell.
template <class Simulation>
void fill(Simulation& simulation, const Options& options, double h) {
    const firn::SamplingOptions lattice{.spacing = h / 2};
    if (options.scene == "block") {
        simulation.add(firn::sample_box<3>({0.2, 0.3, 0.2}, {0.7, 0.55, 0.45}, lattice), 1000);
        return;
    }
    simulation.add(firn::sample_box<3>({0.2, 0.3, 0.3}, {0.45, 0.55, 0.55}, lattice), 1000, {1, 0, 0});
    simulation.add(firn::sample_box<3>({0.55, 0.35, 0.35}, {0.8, 0.6, 0.6}, lattice), 1000, {-1, 0, 0});
}

template <class Simulation>
void measure(Simulation&& simulation, const Options& options, const firn::mpi::Communicator& all) {
    fill(simulation, options, simulation.domain().cell_size);
    firn::mpi::Trace trace;
    constexpr bool on_ranks = requires { simulation.execution.record(&trace); };
    if constexpr (on_ranks) simulation.execution.record(&trace);
    for (int i = 0; i < 3; ++i) simulation.step();

    std::vector<double> each;  // processor time of a step, without waiting [s]
    std::map<std::string, double> phases;
    std::uint64_t bytes = 0, messages = 0;
    // An interval in which particles are sorted does not count.
    for (int tries = 0; int(each.size()) < options.intervals && tries < 10 * options.intervals; ++tries) {
        all.barrier();
        trace = {};
        const double begin = firn::mpi::detail::seconds_of(CLOCK_PROCESS_CPUTIME_ID);
        for (int i = 0; i < options.steps; ++i) simulation.step();
        const double mine = firn::mpi::detail::seconds_of(CLOCK_PROCESS_CPUTIME_ID) - begin - trace.waited();
        const bool sorts = std::ranges::any_of(
            trace.events, [](const auto& event) { return std::string(event.what) == "find shared blocks"; });
        if (all.max(sorts ? 1 : 0) > 0) continue;
        each.push_back(all.sum(mine) / options.steps);
        phases.clear();
        for (const auto& event : trace.events) phases[event.what] += event.cpu / options.steps;
        bytes = trace.bytes_sent / std::uint64_t(options.steps);
        messages = trace.messages_sent / std::uint64_t(options.steps);
    }
    std::ranges::sort(each);
    const double median = each[each.size() / 2];
    const auto particles = double(all.sum(std::uint64_t(simulation.particles().size())));
    const auto all_bytes = all.sum(bytes), all_messages = all.sum(messages);
    if (all.rank() == 0) {
        std::printf("%d ranks, %.0f particles: %.3f ms a step, %.2f ns a particle; %.3f MB in %.1f messages a rank\n",
                    all.size(), particles, 1e3 * median, 1e9 * median / particles,
                    1e-6 * double(all_bytes) / all.size(), double(all_messages) / all.size());
        for (const auto& [name, seconds] : phases)
            std::printf("    %-22s %8.3f ms a step on rank 0\n", name.c_str(), 1e3 * seconds);
    }
    if (options.trace.empty()) return;
    for (int rank = 0; rank < all.size(); ++rank) {
        all.barrier();
        if (rank != all.rank()) continue;
        std::ofstream file(options.trace, rank == 0 ? std::ios::trunc : std::ios::app);
        if (rank == 0) file << "rank,phase,begin,end,waits\n";
        for (const auto& event : trace.events)
            file << rank << ',' << event.what << ',' << std::to_string(event.begin) << ',' << std::to_string(event.end)
                 << ',' << event.waits << '\n';
    }
}

}  // namespace

int main(int argc, char** argv) {
    firn::mpi::Session session(argc, argv);
    const firn::mpi::Communicator all;
    const Options options = read(argc, argv);
    const double h = 2 * 0.25 / std::cbrt(options.particles / 2);
    const firn::Domain<3> domain{{0, 0, 0}, {1, 1, 1}, h};
    const auto material = firn::FixedCorotated<float>::from_young_poisson(1e5, 0.3);
    if (options.plain)
        measure(firn::Simulation(domain, material, firn::Coloured{1}), options, all);
    else
        measure(firn::Simulation(domain, material, firn::mpi::Distributed<firn::Coloured>({1})), options, all);
}
