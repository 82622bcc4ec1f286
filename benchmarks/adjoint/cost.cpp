/// \file What a gradient costs: the time of a run and its gradient over the time of the run alone.
///
///     firn_adjoint_cost [STEPS [THREADS [PARTICLES [MEGABYTES [MEGABYTES_ON_DISK FOLDER]]]]]
///
/// The program has used its memory before, as in the second gradient of a search. With FIRN_NEW_MEMORY=1 in the
/// environment it has not, and the system clears each new page when it is first used.
#include <firn/adjoint.hpp>

#include "../scenes.hpp"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <numeric>
#include <vector>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace {

double argument(int argc, char** argv, int k, double otherwise) { return argc > k ? std::atof(argv[k]) : otherwise; }

/// Uses memory, and gives it back to this program's heap.
void use_memory(std::size_t bytes) {
#ifdef __GLIBC__
    mallopt(M_MMAP_MAX, 0);
    mallopt(M_TRIM_THRESHOLD, -1);
#endif
    constexpr std::size_t piece = 1 << 24;
    std::vector<void*> pieces(bytes / piece + 1);
    for (void*& one : pieces)
        if ((one = std::malloc(piece))) std::memset(one, 1, piece);
    for (void* const one : pieces) std::free(one);
}

}  // namespace

int main(int argc, char** argv) {
    const auto steps = int(argument(argc, argv, 1, 500)), threads = int(argument(argc, argv, 2, 1));
    const auto scene = scenes::two_cubes<3>(std::size_t(argument(argc, argv, 3, 144'054)));
    const auto memory = std::size_t(argument(argc, argv, 4, 1024) * 1024 * 1024);
    if (!std::getenv("FIRN_NEW_MEMORY")) use_memory(memory / 2 * 3 + scene.size() * 2000);
    const auto made = [&] {
        firn::Simulation<3> simulation(scene.domain,
                                       firn::FixedCorotated<float>::from_young_poisson(scene.young, scene.poisson),
                                       firn::Coloured{threads});
        scenes::add(simulation, scene);
        simulation.step();  // memory is touched
        return simulation;
    };
    const double time = steps * scene.time_step;
    scenes::Stopwatch run, both;
    {
        auto simulation = made();
        run.run([&] { simulation.advance(time); });
    }
    auto simulation = made();
    const auto disk = std::size_t(argument(argc, argv, 5, 0) * 1024 * 1024);
    firn::Adjoint adjoint(simulation, {.memory = memory, .folder = argc > 6 ? argv[6] : "", .disk = disk});
    double growth = 0;
    both.run([&] {
        adjoint.advance(time);
        adjoint.measure([](const auto& p) { return p.position[0] * p.position[0] * p.mass; });
        const auto gradient = adjoint.gradient();
        growth = gradient.position_norm.front() / gradient.position_norm.back();
    });
    const auto& again = adjoint.repetitions();
    std::printf(
        "%zu particles, %zu steps, %d threads, %zu checkpoints: a run takes %.2f s, with its gradient %.2f s: %.2f "
        "times; by CPU time %.2f times. Steps taken again: %u, none more than %u times. Adjoints have grown %.3g "
        "times\n",
        scene.size(), adjoint.steps(), threads, adjoint.checkpoints(), run.seconds(), both.seconds(),
        both.seconds() / run.seconds(), both.cpu_seconds() / run.cpu_seconds(),
        std::accumulate(again.begin(), again.end(), 0U), *std::max_element(again.begin(), again.end()), growth);
}
