/// \file The two cubes in every execution: step/two_cubes/EXECUTION/threads:N.
#include "step.hpp"

namespace {

template <class Execution>
void add(const Execution& execution, int threads, scenes::Scene<3> (*make)() = +[] { return scenes::two_cubes<3>(); }) {
    scenes::add_step<float, firn::Apic>("two_cubes", make, execution, threads);
}

/// The scene twice, side by side, a thread each: all that two threads can be over one on this machine.
class Apart {
public:
    Apart() {
        for (auto& simulation : both_)
            simulation = scenes::make_simulation<Simulation>(scenes::two_cubes<3>(), firn::Coloured{1});
    }
    void step() {
        firn::parallel_for(2, 2, [&](std::size_t i, int) { both_[i]->step(); });
    }

private:
    using Simulation = scenes::Elastic<3, float, firn::Apic, firn::Coloured>;
    std::unique_ptr<Simulation> both_[2];
};

const bool registered = [] {
    benchmark::RegisterBenchmark("step/two_cubes/apart/threads:2", [](benchmark::State& state) {
        const auto scene = scenes::two_cubes<3>();
        scenes::time_steps(state, scene.steps, 2 * scene.size(), [] { return std::make_unique<Apart>(); });
    })->Unit(benchmark::kMillisecond);
    add(firn::detail::Serial{}, 1, scenes::all_of_two_cubes);
    for (const int threads : {1, 2}) {
        add(firn::FixedPoint<std::int32_t>{threads}, threads);
        add(firn::FixedPoint<std::int64_t>{threads}, threads);
        add(firn::ColouredFixedPoint<std::int32_t>{threads}, threads, scenes::all_of_two_cubes);
        add(firn::ColouredFixedPoint<std::int64_t>{threads}, threads);
    }
    return true;
}();

}  // namespace
