/// \file The two cubes in the straightforward code that firn is measured against: step/two_cubes/baseline/threads:1.
/// Its singular value decomposition takes three times as long once F is no rotation any more, so its steps are timed
/// all along the way: every tenth of those that all_of_two_cubes() has.
#include "baseline/of_scene.hpp"
#include "step.hpp"

namespace {

/// firn goes the way, which is the same.
class Way {
public:
    /// The baseline where the next step is to be timed, its memory touched.
    baseline::MlsMpm next() {
        if (!simulation_ || steps_ + stride > scene_.steps.before + scene_.steps.all) {
            simulation_ = scenes::make_simulation<Simulation>(scene_, firn::Coloured{});
            steps_ = 0;
        }
        for (const int end = steps_ == 0 ? scene_.steps.before : steps_ + stride; steps_ < end; ++steps_)
            simulation_->step();
        baseline::MlsMpm copy = baseline::of_simulation(*simulation_, scene_);
        copy.step(float(scene_.time_step));
        return copy;
    }
    const scenes::Scene<3>& scene() const { return scene_; }
    /// Of the whole way.
    int samples() const { return scenes::quick() ? 5 : scene_.steps.all / stride; }

private:
    using Simulation = scenes::Elastic<3, float, firn::Apic, firn::Coloured>;
    static constexpr int stride = 10;

    scenes::Scene<3> scene_ = scenes::all_of_two_cubes();
    std::unique_ptr<Simulation> simulation_;
    int steps_ = 0;
};

void two_cubes(benchmark::State& state) {
    Way way;
    scenes::Stopwatch watch;
    int timed = 0;
    const auto timed_step = [&](baseline::MlsMpm& simulation) {
        watch.run([&] { simulation.step(float(way.scene().time_step)); });
        ++timed;
    };
    for (auto _ : state) {
        state.PauseTiming();
        baseline::MlsMpm simulation = way.next();
        state.ResumeTiming();
        timed_step(simulation);
    }
    while (timed < way.samples()) {
        baseline::MlsMpm simulation = way.next();
        timed_step(simulation);
    }
    const double count = double(way.scene().size());
    scenes::report(state, count * timed, watch);
    state.counters["particles"] = count;
    state.counters["bytes_per_particle"] = sizeof(baseline::Particle);
}

const bool registered = [] {
    benchmark::RegisterBenchmark("step/two_cubes/baseline/threads:1", two_cubes)->Unit(benchmark::kMillisecond);
    return true;
}();

}  // namespace
