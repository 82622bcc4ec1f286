/// \file What a second of motion costs by implicit and by explicit steps:
/// motion/stiff_jelly_YOUNG/INTEGRATION/threads:1. The jelly of examples/25_stiff_jelly.cpp falls onto a floor; YOUNG
/// is its Young's modulus in Pa.
#include <firn/implicit.hpp>

#include "step.hpp"

namespace {

using Point = firn::Vec<double, 2>;
template <class Time>
using Jelly = firn::SimulationWith<2, firn::FixedCorotated<double>, firn::WeightGradientForce, Time>;

constexpr double duration = 1;        // of the motion [s]
constexpr int explicit_steps = 2000;  // So many are timed at most: whole runs at 10 and 100 MPa cost at most 5 % more.

/// A jelly of 40 × 40 particles, four a cell, above a floor, with a corner down.
template <class Time>
std::unique_ptr<Jelly<Time>> make(double young) {
    constexpr double side = 0.4, tilt = 0.2, fall = 0.2, width = 1;  // [m], [rad]
    const firn::Domain<2> room{{0, 0}, {width, width}, side / 20};
    auto made = std::make_unique<Jelly<Time>>(room, firn::FixedCorotated<double>::from_young_poisson(young, 0.3),
                                              firn::Coloured{1});
    auto samples = firn::sample_box<2>({0, 0}, {side, side}, {.spacing = side / 40});
    const double c = std::cos(tilt), s = std::sin(tilt), half = 0.5 * side;
    for (Point& x : samples.positions) {
        const Point arm = x - Point{half, half};
        x = Point{0.5 * width + c * arm[0] - s * arm[1], fall + half * (c + s) + s * arm[0] + c * arm[1]};
    }
    made->add(samples, 1000);
    made->warn = {};
    return made;
}

template <class Time>
void run(benchmark::State& state, double young) {
    scenes::Stopwatch watch;
    double moved = 0, steps = 0, products = 0;
    std::size_t particles = 0;
    for (auto _ : state) {
        const auto simulation = make<Time>(young);
        particles = simulation->particles().size();
        try {
            for (int k = 0; simulation->time() < duration && (!Time::is_explicit || k < explicit_steps); ++k) {
                watch.run([&] { simulation->step(); });
                ++steps;
                if constexpr (!Time::is_explicit) products += simulation->solution.products;
            }
        } catch (const firn::convergence_error& error) {
            return state.SkipWithError(error.what());
        }
        moved += simulation->time();
    }
    state.counters["young"] = young;
    state.counters["particles"] = double(particles);
    state.counters["cpu_seconds_per_second"] = watch.cpu_seconds() / moved;
    state.counters["steps_per_second"] = steps / moved;
    if (!Time::is_explicit) state.counters["products_per_step"] = products / steps;
}

template <class Time>
void add(const std::string& young) {
    benchmark::RegisterBenchmark(("motion/stiff_jelly_" + young + "/" + Time::name + "/threads:1").c_str(),
                                 [E = std::stod(young)](benchmark::State& state) { run<Time>(state, E); })
        ->Unit(benchmark::kMillisecond);
}

const bool registered = [] {
    for (const char* young : {"1e5", "3e5", "1e6", "3e6", "1e7", "3e7", "1e8", "3e8", "1e9", "3e9", "1e10"}) {
        add<firn::Explicit>(young);
        add<firn::Implicit>(young);
    }
    return true;
}();

}  // namespace
