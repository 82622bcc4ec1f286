/// \file How whole steps are timed, sorting included: step/SCENE/EXECUTION/threads:N. Every policy is a source file of
/// its own, so that compilers can work side by side.
#pragma once

#include "scenes.hpp"
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace scenes {

inline bool is_set(const char* variable) {
    const char* value = std::getenv(variable);
    return value && *value;
}
inline bool quick() { return is_set("FIRN_BENCHMARK_QUICK"); }
inline bool full() { return is_set("FIRN_BENCHMARK_FULL"); }

/// The most memory that the process has held since this began, the program and the scene's points included.
class PeakMemory {
public:
    PeakMemory() {
#ifdef __GLIBC__
        malloc_trim(0);  // what earlier benchmarks have given back
#endif
        std::ofstream("/proc/self/clear_refs") << 5;  // proc(5): resets the peak
    }
    /// [bytes]; 0 where the system does not say.
    double peak() const {
        std::ifstream status("/proc/self/status");
        for (std::string word; status >> word;)
            if (double kilobytes = 0; word == "VmHWM:" && status >> kilobytes) return 1024 * kilobytes;
        return 0;
    }
};

/// 1, 2, 4, … up to all processors; at least 1 and 2.
inline std::vector<int> thread_counts() {
    const int processors = int(std::thread::hardware_concurrency());
    std::vector<int> counts{1, 2};
    while (counts.back() * 2 <= processors) counts.push_back(counts.back() * 2);
    if (counts.back() < processors) counts.push_back(processors);
    return counts;
}

/// Puts what was measured into the counters. \param particle_steps  how many were timed
inline void report(benchmark::State& state, double particle_steps, const Stopwatch& watch) {
    state.counters["particle_steps_per_second"] = particle_steps / watch.seconds();
    state.counters["particle_steps_per_cpu_second"] = particle_steps / watch.cpu_seconds();
}

/// Times the steps of what make() gives, a pointer to something that has step(). Returns it as it is at the end, when
/// the rate is in the counters. \param particles  of all that make() gives
template <class Make>
auto time_steps(benchmark::State& state, const Steps& steps, std::size_t particles, const Make& make) {
    const int least = quick() ? 10 : steps.least;
    auto simulation = make();
    Stopwatch watch;
    int step = 0, timed = 0;
    for (; step < steps.before; ++step) simulation->step();
    const auto timed_step = [&] {
        watch.run([&] { simulation->step(); });
        ++step, ++timed;
    };
    for (auto _ : state) {
        if (step == steps.before + steps.all) {
            state.PauseTiming();
            simulation = nullptr;  // before the next takes memory
            simulation = make();
            for (step = 0; step < steps.before; ++step) simulation->step();
            state.ResumeTiming();
        }
        timed_step();
    }
    while (timed < least) timed_step();
    report(state, double(particles) * timed, watch);
    return simulation;
}

/// A simulation of a scene, before its first step.
/// \param policies  policies that have parameters, such as a boundary or a contact law
template <class Simulation, class Execution, int D, class... Policies>
std::unique_ptr<Simulation> make_simulation(const Scene<D>& scene, const Execution& execution,
                                            const Policies&... policies) {
    using S = typename Simulation::scalar_type;
    auto made = std::make_unique<Simulation>(
        scene.domain, firn::FixedCorotated<S>::from_young_poisson(scene.young, scene.poisson), execution, policies...);
    add(*made, scene);
    return made;
}

template <int D, class S, class Transfer, class Execution, class Force = firn::MlsForce,
          class Kernel = firn::QuadraticBSpline>
using Elastic = firn::Simulation<D, firn::FixedCorotated<S>, Transfer, Force, Kernel, Execution>;

/// Registers step/SCENE/EXECUTION/threads:N, for a simulation of the given policies.
template <class S, class Transfer, class Force = firn::MlsForce, class Kernel = firn::QuadraticBSpline, class Execution,
          int D>
benchmark::internal::Benchmark* add_step(const std::string& scene_name, Scene<D> (*make_scene)(),
                                         const Execution& execution, int threads) {
    const std::string name = "step/" + scene_name + "/" + Execution::name + "/threads:" + std::to_string(threads);
    return benchmark::RegisterBenchmark(
               name.c_str(),
               [make_scene, execution](benchmark::State& state) {
                   using Simulation = Elastic<D, S, Transfer, Execution, Force, Kernel>;
                   const PeakMemory memory;
                   const Scene<D> scene = make_scene();
                   const auto simulation = time_steps(state, scene.steps, scene.size(),
                                                      [&] { return make_simulation<Simulation>(scene, execution); });
                   const double count = double(scene.size());
                   state.counters["particles"] = count;
                   const std::size_t order = simulation->partition().order.capacity() * sizeof(std::uint32_t);
                   state.counters["bytes_per_particle"] = double(simulation->particles().bytes() + order) / count;
                   state.counters["grid_bytes_per_particle"] = double(simulation->grid().bytes()) / count;
                   if (const double peak = memory.peak(); peak > 0) state.counters["peak_resident_bytes"] = peak;
               })
        ->Unit(benchmark::kMillisecond);
}

/// Registers NAME/threads:1 and NAME/threads:2, which call run(state, threads).
template <class Run>
bool add_on_threads(const std::string& name, const Run& run) {
    for (const int threads : {1, 2})
        benchmark::RegisterBenchmark((name + "/threads:" + std::to_string(threads)).c_str(),
                                     [=](benchmark::State& state) { run(state, threads); })
            ->Unit(benchmark::kMillisecond);
    return true;
}
/// Registers step/SCENE/coloured/threads:N, for what make(scene, threads) returns: a pointer to a simulation of the
/// scene.
template <class Make>
bool add_coloured(const std::string& scene_name, Scene<3> (*make_scene)(), const Make& make) {
    return add_on_threads("step/" + scene_name + "/coloured", [=](benchmark::State& state, int threads) {
        const Scene<3> scene = make_scene();
        time_steps(state, scene.steps, scene.size(), [&] { return make(scene, threads); });
    });
}

/// Registers step/SCENE/coloured/threads:N for the two cubes (in 2D: squares) with other policies.
template <class S, class Transfer, int D, class Force = firn::MlsForce, class Kernel = firn::QuadraticBSpline>
bool add_two_cubes(const char* scene_name, Scene<D> (*make_scene)() = +[] { return two_cubes<D>(); }) {
    for (const int threads : {1, 2})
        add_step<S, Transfer, Force, Kernel>(scene_name, make_scene, firn::Coloured{threads}, threads);
    return true;
}

}  // namespace scenes
