/// \file The two bunnies on a GPU: the steps of their simulation run on whatever adapter WebGPU finds, which the
/// program names. States and pictures are those of a run on the CPU. Prints how fast the steps were.
#include "support/bunnies.hpp"
#include "support/run.hpp"
#include <firn/webgpu/on_gpu.hpp>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>

namespace {

using Clock = std::chrono::steady_clock;

/// The options for a device: in software, where they are not given, those of a run of about a minute.
example::Options options_for(const firn::webgpu::Device& device, const example::CommandLine& line) {
    example::Options options = line.options();
    const auto is_free = [&](const char* option) { return device.is_software() && !line.is_given(option); };
    if (is_free("--particles")) options.particles = 4'000;
    if (is_free("--steps") && is_free("--frames")) options.schedule = example::spread(700, 10);
    if (device.is_software())
        std::printf(
            "This is a GPU in software, which takes a minute to compile the programs: the run is small, unless "
            "--particles and --steps make it larger.\n");
    return options;
}

int on_gpu(int argc, char** argv) {
    example::CommandLine line({.name = "on_gpu",
                               .about = "Two elastic bunnies from an OBJ file collide, on a GPU.",
                               .particles = 150'000,
                               .steps = 2400,
                               .frames = 30,
                               .writes_obj = false});
    double young = 1e3;
    line.add("--young", young, "Young's modulus in Pa", 1.0, 1e9);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const firn::webgpu::Device device;  // throws if there is none
    std::printf("on_gpu: on %s\n", device.name().c_str());
    const example::Options options = options_for(device, line);
    std::fflush(stdout);

    const auto bunnies = example::bunnies_from_mesh(FIRN_EXAMPLES_DATA_DIR "/bunny.obj", options.particles);
    const auto simulation = example::bunnies_in_a_box<firn::FixedPoint<std::int32_t>>(
        bunnies, firn::FixedCorotated<float>::from_young_poisson(young, 0.3), options.threads);
    const std::size_t particles = simulation.particles().size();
    example::View view;
    view.frame = example::frame_of(simulation);

    auto gpu = firn::webgpu::on_gpu(simulation, device);
    Clock::time_point start, end;
    firn::BackgroundSeries<float> states(options.output, options.name);
    const auto write = [&] {
        auto state = states.spare();
        firn::state_of(gpu, state);  // waits for the steps
        end = Clock::now();
        states.write(std::move(state));
    };
    const auto between_waits = std::uint64_t(std::max<std::int64_t>(1, options.schedule.steps / 100));
    const auto step = [&] {
        gpu.step();
        const bool is_first = gpu.steps() == 1;                          // for which drivers compile programs
        if (is_first || gpu.steps() % between_waits == 0) gpu.report();  // waits, so that the bar shows what is done
        if (is_first) start = Clock::now();
    };
    const example::Outcome outcome = example::run_schedule(
        options, [&] { return std::int64_t(particles); }, {}, write, [&] { states.finish(); }, step,
        [&] { return example::picture(gpu.simulation(), bunnies.spacing, view); }, {options.file(".hdf.series")});
    if (outcome.done > 1) {
        const double seconds = std::chrono::duration<double>(end - start).count();
        std::printf("%s%.3g million particle-steps a second on %s, with the states but without the first step\n",
                    outcome.part().c_str(), 1e-6 * double(particles) * double(outcome.done - 1) / seconds,
                    device.name().c_str());
    }
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return on_gpu(argc, argv); });
}
