/// \file Whole steps, sorting included: step/SCENE/EXECUTION/threads:N.
#include "scenes.hpp"
#include <benchmark/benchmark.h>

namespace {

template <class Execution>
using Elastic =
    firn::Simulation<3, firn::FixedCorotated<float>, firn::Apic, firn::MlsForce, firn::QuadraticBSpline, Execution>;

/// The scene starts anew after this many steps: long enough to be sorted again many times, short of the walls.
constexpr int steps_of_scene = 500;

template <class Execution>
void two_cubes(benchmark::State& state, const Execution& execution) {
    std::optional<Elastic<Execution>> simulation;
    scenes::Stopwatch watch;
    for (auto _ : state) {
        if (!simulation || simulation->steps() == steps_of_scene) {
            state.PauseTiming();
            simulation.emplace(scenes::unit_box(),
                               firn::FixedCorotated<float>::from_young_poisson(scenes::young, scenes::poisson),
                               execution);
            simulation->warn = [](const std::string&) {};
            scenes::add_two_cubes(*simulation);
            simulation->stable_time_step();  // sorts
            state.ResumeTiming();
        }
        watch.run([&] { simulation->step(); });
    }
    state.counters["particle_steps_per_second"] =
        double(simulation->particles().size()) * double(state.iterations()) / watch.seconds();
    state.counters["bytes_per_particle"] =
        double(simulation->particles().bytes()) / double(simulation->particles().size());
}

template <class Execution>
void add(const std::string& name, const Execution& execution, int threads) {
    benchmark::RegisterBenchmark(("step/two_cubes/" + name + "/threads:" + std::to_string(threads)).c_str(),
                                 [execution](benchmark::State& state) { two_cubes(state, execution); })
        ->Unit(benchmark::kMillisecond);
}

const bool registered = [] {
    add("serial", firn::Serial{}, 1);
    for (const int threads : {1, 2}) add("coloured", firn::Coloured{threads}, threads);
    for (const int threads : {1, 2}) add("fixed_point", firn::FixedPoint<std::int32_t>{threads}, threads);
    for (const int threads : {1, 2}) add("fixed_point_64", firn::FixedPoint<std::int64_t>{threads}, threads);
    return true;
}();

}  // namespace
