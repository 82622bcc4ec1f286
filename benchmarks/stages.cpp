/// \file Each stage by itself, on the two cubes: stage/NAME/threads:N. A stage is run again and again on the same
/// particles; G2P moves them by a step of 1 ns, so that they stay where they are.
#include "scenes.hpp"
#include <benchmark/benchmark.h>

namespace {

using Material = firn::FixedCorotated<float>;
using Kernel = firn::QuadraticBSpline;

/// The particles of the scene in firn's own storage, sorted, with a grid.
struct Stages {
    firn::Domain<3> domain = scenes::unit_box();
    Material material = Material::from_young_poisson(scenes::young, scenes::poisson);
    firn::Particles<float, 3> particles{domain};
    firn::BlockPartition<3> partition;
    firn::SparseGrid<float, 3> grid{domain};
    firn::Walls<float, 3> walls = firn::Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {});
    firn::Vec<double, 3> gravity{0.0, -9.81, 0.0};
    firn::Coloured execution;

    explicit Stages(int threads) : execution{threads} {
        firn::Simulation<3> simulation(domain, material);
        scenes::add_two_cubes(simulation);
        simulation.step();
        particles = simulation.particles();
        partition = simulation.partition();
        grid.activate(partition);
        p2g();
        grid_update();
    }
    void p2g() {
        firn::p2g<Kernel, firn::Apic, firn::MlsForce>(execution, particles.view(), partition, grid, scenes::time_step);
    }
    void grid_update() { firn::grid_update(execution, grid, scenes::time_step, gravity, walls); }
    void g2p() {
        firn::g2p<Kernel, firn::Apic, firn::MlsForce>(execution, particles.view(), partition, grid, material, 1e-9);
    }
    void sort() { partition = firn::sort_particles<Kernel>(particles, execution.threads); }
    void activate() { grid.activate(partition); }
};

template <void (Stages::*stage)()>
void run(benchmark::State& state, int threads) {
    Stages stages(threads);
    scenes::Stopwatch watch;
    for (auto _ : state) watch.run([&] { (stages.*stage)(); });
    state.counters["particles_per_second"] =
        double(stages.particles.size()) * double(state.iterations()) / watch.seconds();
}

template <void (Stages::*stage)()>
void add(const std::string& name, int threads) {
    benchmark::RegisterBenchmark(("stage/" + name + "/threads:" + std::to_string(threads)).c_str(),
                                 [threads](benchmark::State& state) { run<stage>(state, threads); })
        ->Unit(benchmark::kMillisecond);
}

const bool registered = [] {
    for (const int threads : {1, 2}) {
        add<&Stages::p2g>("p2g", threads);
        add<&Stages::grid_update>("grid_update", threads);
        add<&Stages::g2p>("g2p", threads);
        add<&Stages::sort>("sort", threads);
        add<&Stages::activate>("activate_grid", threads);
    }
    return true;
}();

}  // namespace
