/// \file The two bunnies on a GPU: the steps of a simulation run on whatever adapter WebGPU finds, and its states and
/// pictures are those of the CPU's run.
#include "support/bunnies.hpp"
#include "support/run.hpp"
#include <firn/boundary/walls.hpp>
#include <firn/simulation.hpp>
#include <firn/webgpu/on_gpu.hpp>

#include <cmath>
#include <cstdio>

namespace {

int on_gpu(int argc, char** argv) {
    example::CommandLine line({.name = "on_gpu",
                               .about = "Two elastic bunnies from an OBJ file collide, on a GPU.",
                               .particles = 150'000,
                               .steps = 2400,
                               .frames = 30});
    double young = 2e4;
    line.add("--young", young, "Young's modulus in Pa", 1e3, 1e6);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();
    const firn::webgpu::Device device;  // throws if there is none
    std::printf("on %s\n", device.name().c_str());

    const auto bunnies = example::bunnies_from_mesh(FIRN_EXAMPLES_DATA_DIR "/bunny.obj", options.particles);
    firn::Simulation simulation(firn::Domain<3>({0, 0, 0}, {1, 1, 1}, 1 / std::round(0.5 / bunnies.spacing)),
                                firn::FixedCorotated<float>::from_young_poisson(young, 0.3),
                                firn::FixedPoint<std::int32_t>{.threads = options.threads},
                                firn::Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {firn::Contact::separate, 0.3}));
    simulation.add(bunnies.below, 1000);
    simulation.add(bunnies.above, 1000, {0, -2, 0});
    simulation.fixed_time_step = 0.5 * simulation.stable_time_step();

    auto gpu = firn::webgpu::on_gpu(simulation, device);
    firn::BackgroundSeries<float> states(options.output, options.name);
    const auto write = [&] {
        auto state = states.spare();
        firn::state_of(gpu, state);
        states.write(std::move(state));
    };
    example::View view;
    view.frame = example::Box{{{0.3F, 0, 0.3F}}, {{0.88F, 0.5F, 0.7F}}};
    const example::Outcome outcome = example::run_schedule(
        options, [&] { return std::int64_t(bunnies.below.positions.size() + bunnies.above.positions.size()); }, {},
        write, [&] { states.finish(); }, [&] { gpu.step(); },
        [&] { return example::picture(gpu.simulation(), bunnies.spacing, view); }, {options.file(".hdf.series")});
    std::printf("kinetic energy at the end: %.4g J\n", gpu.totals().kinetic_energy);
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return on_gpu(argc, argv); });
}
