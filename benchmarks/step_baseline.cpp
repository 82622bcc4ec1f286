/// \file The two cubes in the straightforward code that firn is measured against: step/two_cubes/baseline/threads:1,
/// and step/two_cubes_late/baseline/threads:1. Its singular value decomposition takes longer once F is no rotation any
/// more.
#include "baseline/of_scene.hpp"
#include "step.hpp"

namespace {

/// The scene's time step with the baseline's step().
struct Baseline {
    baseline::MlsMpm simulation;
    float dt;
    void step() { simulation.step(dt); }
};

template <class Make>
void time_baseline(benchmark::State& state, const scenes::Scene<3>& scene, int steps_before, const Make& make) {
    scenes::time_steps(state, scene.size(), steps_before, scene.steps,
                       [&] { return std::make_unique<Baseline>(Baseline{make(), float(scene.time_step)}); });
    state.counters["particles"] = double(scene.size());
    state.counters["bytes_per_particle"] = sizeof(baseline::Particle);
}

void two_cubes(benchmark::State& state) {
    const scenes::Scene<3> scene = scenes::two_cubes<3>();
    time_baseline(state, scene, scene.steps_before, [&] { return baseline::of_scene(scene); });
}

/// firn goes the way there, which is the same.
void two_cubes_late(benchmark::State& state) {
    const scenes::Scene<3> scene = scenes::two_cubes_late<3>();
    time_baseline(state, scene, 0, [&] {
        using Simulation = scenes::Elastic<3, float, firn::Apic, firn::Serial>;
        const auto simulation = scenes::make_simulation<Simulation>(scene, firn::Serial{});
        for (int step = 0; step < scene.steps_before; ++step) simulation->step();
        return baseline::of_simulation(*simulation, scene);
    });
}

const bool registered = [] {
    benchmark::RegisterBenchmark("step/two_cubes/baseline/threads:1", two_cubes)->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark("step/two_cubes_late/baseline/threads:1", two_cubes_late)
        ->Unit(benchmark::kMillisecond);
    return true;
}();

}  // namespace
