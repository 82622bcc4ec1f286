/// \file Steps on the GPU that is there: how long they take, pass by pass, and whether their bits are the CPU's.
///
///     firn_gpu_steps [--particles N[,N…]] [--scene elastic|snow|sand|four] [--steps K] [--turns K] [--quick]
///     firn_gpu_steps --check [--particles N[,N…]] [--scene …] [--steps K]
///     firn_gpu_steps --adapter
///
/// A line for each scene and number of particles: milliseconds a step, the median of the turns, each of K steps; and
/// million particle-steps a second (M p-s/s). Below it, if the GPU has timestamps, a line for each entry point of a
/// step: the mean of its milliseconds over other K steps, in which each is a compute pass of its own, and its share of
/// their sum. If it runs for each particle: the bytes of the buffers of particles that it has access to, those that it
/// writes counted twice, and the gigabytes a second that they would be. That is an upper bound: it may touch fewer; but
/// what it reads and adds at nodes is not in it.
///
/// --check takes K steps (20) on the GPU and on the CPU instead, and counts the particles that have other bits then
/// (zeros may have another sign, and numbers below 1.2e-38 may be 0). --quick is a short measurement of the smaller
/// size.
/// --adapter names the GPU, and ends with 1 if there is none.
#include <firn/io/simulation_state.hpp>
#include <firn/webgpu/on_gpu.hpp>
#include <firn/webgpu/pass_times.hpp>

#include "../scenes.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace {

using namespace firn;

using Point = Vec<double, 3>;
using Jelly = FixedCorotated<float>;
using Water = Fluid<float>;

struct Options {
    std::vector<std::size_t> particles;
    std::string scene;  // empty: all
    int steps = 0, turns = 0;
    bool quick = false, check = false, adapter = false;
};

constexpr double density = 1000, of_snow = 400;  // [kg/m³]

double median(std::vector<double> times) {
    std::ranges::sort(times);
    return times.size() % 2 ? times[times.size() / 2] : (times[times.size() / 2 - 1] + times[times.size() / 2]) / 2;
}

/// A simulation in a box with rough walls, in cells of two particles a side. Its time step is chosen when matter is
/// there. \see begin
template <class Material>
auto in_box(const Material& material, double cell_size) {
    Domain<3> domain;
    domain.cell_size = cell_size;
    Simulation simulation(domain, material, FixedPoint<std::int32_t>{.float_steps = true},
                          Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {Contact::separate, 0.3}));
    simulation.warn = {};
    return simulation;
}
/// How far particles lie from each other if so many fill a volume [m].
double spacing_of(double volume, std::size_t particles) { return std::cbrt(volume / double(particles)); }
SamplingOptions filling(double spacing) { return {.spacing = spacing, .pattern = Pattern::jittered, .jitter = 0.1}; }

/// With less than half of the largest time step, as matter grows stiffer on its way.
template <class Simulation>
Simulation begin(Simulation simulation) {
    simulation.fixed_time_step = 0.4 * simulation.stable_time_step();
    return simulation;
}

/// The two cubes that the benchmarks of the CPU have.
auto elastic(std::size_t particles) {
    const scenes::Scene<3> cubes = scenes::two_cubes<3>(particles);
    auto simulation = in_box(Jelly::from_young_poisson(cubes.young, cubes.poisson), cubes.domain.cell_size);
    scenes::add(simulation, cubes);
    simulation.most_steps_between_sorts = 0;
    return simulation;
}
/// A ball just before it hits the ground.
auto snow(std::size_t particles) {
    constexpr double radius = 0.2;
    const double spacing = spacing_of(4.0 / 3 * std::numbers::pi * std::pow(radius, 3), particles);
    auto simulation = in_box(Snow<float>{}, 2 * spacing);
    simulation.add(sample_sphere<3>({0.5, radius + 3 * spacing, 0.5}, radius, filling(spacing)), of_snow,
                   {0.5, -5, 0.3});
    return begin(std::move(simulation));
}
/// A column that collapses.
auto sand(std::size_t particles) {
    constexpr double side = 0.3, height = 0.6;
    const double spacing = spacing_of(side * height * side, particles);
    auto simulation = in_box(Sand<float>{}, 2 * spacing);
    const Point lower{0.35, spacing, 0.35};
    simulation.add(sample_box<3>(lower, lower + Point{side, height, side}, filling(spacing)), density);
    return begin(std::move(simulation));
}
/// Water, sand, snow and jelly in the corners of a tank, on their way to its centre.
auto four(std::size_t particles) {
    constexpr double side = 0.4, height = 0.3, speed = 1;
    const double spacing = spacing_of(4 * side * height * side, particles);
    auto simulation =
        in_box(Materials<Water, Sand<float>, Snow<float>, Jelly>({}, {}, {}, Jelly::from_young_poisson(1e5, 0.3)),
               2 * spacing);
    const auto add = [&](auto set, int k, double of = density) {
        const Point lower{k % 2 ? 0.95 - side : 0.05, spacing, k / 2 ? 0.95 - side : 0.05};
        set.add(sample_box<3>(lower, lower + Point{side, height, side}, filling(spacing)), of,
                {k % 2 ? -speed : speed, 0, k / 2 ? -speed : speed});
    };
    add(simulation.template set<0>(), 0);
    add(simulation.template set<1>(), 1);
    add(simulation.template set<2>(), 2, of_snow);
    add(simulation.template set<3>(), 3);
    return begin(std::move(simulation));
}

template <class Simulation>
std::size_t size_of(const Simulation& simulation) {
    return [&]<std::size_t... I>(std::index_sequence<I...>) {
        return (std::size_t{0} + ... + simulation.template set<I>().particles().size());
    }(std::make_index_sequence<Simulation::material_count>{});
}

template <class Simulation>
void take_steps(webgpu::OnGpu<Simulation>& gpu, int steps) {
    gpu.step_by(std::uint64_t(steps),
                [](const webgpu::Host::Sequence& step, int times) { webgpu::Host::run(step, times); });
}

/// What a material's entry points of one name take together: particles of many sets may be in several buffers.
std::vector<webgpu::PassTime> together(const std::vector<webgpu::PassTime>& all) {
    std::vector<webgpu::PassTime> sums;
    for (const webgpu::PassTime& pass : all) {
        const auto same = std::ranges::find_if(sums, [&](const webgpu::PassTime& other) {
            return other.entry_point == pass.entry_point && other.material == pass.material;
        });
        if (same == sums.end()) {
            sums.push_back(pass);
        } else {
            same->mean += pass.mean;
            same->particles += pass.particles;
        }
    }
    return sums;
}

void print(const std::vector<webgpu::PassTime>& passes, bool with_material) {
    double all = 0;
    for (const webgpu::PassTime& pass : passes) all += pass.mean;
    for (const webgpu::PassTime& pass : passes) {
        const std::string name = pass.entry_point + (with_material ? " " + pass.material : "");
        std::printf("    %-32s %9.4f ms %5.1f %%", name.c_str(), 1e3 * pass.mean, 100 * pass.mean / all);
        if (pass.bytes_a_particle > 0)
            std::printf("  <= %3d B a particle, %6.1f GB/s", pass.bytes_a_particle,
                        1e-9 * pass.bytes_a_particle * double(pass.particles) / pass.mean);
        std::printf("\n");
    }
    std::printf("    %-32s %9.4f ms\n", "sum of the passes", 1e3 * all);
}

template <class Simulation>
void measure(const std::string& scene, Simulation simulation, const webgpu::Device& device, const Options& options) {
    const std::size_t particles = size_of(simulation);
    std::uint64_t nodes = 1;
    for (int a = 0; a < 3; ++a) nodes *= wgsl::grid_nodes(simulation.domain().cells(a));
    auto gpu = webgpu::on_gpu(std::move(simulation), device);
    take_steps(gpu, options.steps);
    std::vector<double> times;
    for (int turn = 0; turn < options.turns; ++turn) {
        const auto begin = std::chrono::steady_clock::now();
        take_steps(gpu, options.steps);
        times.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() /
                        options.steps);
    }
    const double time = median(times);
    const bool sparse = gpu.blocks() > 0;
    if (sparse) nodes = gpu.blocks() * std::uint64_t(block_nodes<3>);
    std::printf("%-8s %11zu %11llu %-6s %10.4f %9.1f\n", scene.c_str(), particles,
                static_cast<unsigned long long>(nodes), sparse ? "sparse" : "dense", 1e3 * time,
                1e-6 * double(particles) / time);
    if (device.has_timestamps())
        print(together(webgpu::time_passes(gpu, options.steps)), Simulation::material_count > 1);
    std::fflush(stdout);
}

struct Differences {
    std::size_t particles = 0;          // that have other bits
    double position = 0, velocity = 0;  // the largest [cells], [m/s]
};

/// Returns the slot of each particle, in the order of ids.
template <class Particles>
std::vector<std::size_t> slots_by_id(const Particles& particles) {
    std::vector<std::size_t> slots;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) slots.push_back(slot);
    std::ranges::sort(slots, {}, [&](std::size_t slot) { return particles.id(slot); });
    return slots;
}

/// Compares set I of two simulations.
template <std::size_t I, class Simulation>
void compare(Simulation& cpu, Simulation& gpu, Differences& differences) {
    const auto a = state_of(cpu.template set<I>()), b = state_of(gpu.template set<I>());
    const std::size_t count = a.id.size();
    if (a.id != b.id) throw usage_error("The CPU and the GPU have other particles.");
    std::vector<char> differs(count, 0);
    const auto bits = [](float x) {
        return std::abs(x) < std::numeric_limits<float>::min() ? 0U : std::bit_cast<std::uint32_t>(x);
    };
    for (std::size_t f = 0; f < a.fields.size(); ++f) {
        const std::size_t each = a.fields[f].values.size() / std::max<std::size_t>(count, 1);
        for (std::size_t i = 0; i < count * each; ++i)
            if (bits(a.fields[f].values[i]) != bits(b.fields[f].values[i])) differs[i / each] = 1;
    }
    differences.particles += std::size_t(std::ranges::count(differs, 1));
    const auto of_cpu = cpu.template set<I>().particles(), of_gpu = gpu.template set<I>().particles();
    const std::vector<std::size_t> s = slots_by_id(of_cpu), t = slots_by_id(of_gpu);
    const double h = cpu.domain().cell_size;
    for (std::size_t i = 0; i < count; ++i)
        for (int k = 0; k < 3; ++k) {
            const double x = of_cpu.exact_position(s[i])[k] - of_gpu.exact_position(t[i])[k],
                         v = double(of_cpu.velocity(s[i])[k]) - double(of_gpu.velocity(t[i])[k]);
            differences.position = std::max(differences.position, std::abs(x) / h);
            differences.velocity = std::max(differences.velocity, std::abs(v));
        }
}

template <class Simulation>
void check(const std::string& scene, Simulation cpu, const webgpu::Device& device, int steps) {
    auto gpu = webgpu::on_gpu(cpu, device);
    take_steps(gpu, steps);
    for (int k = 0; k < steps; ++k) cpu.step();
    Differences found;
    [&]<std::size_t... I>(std::index_sequence<I...>) {
        (compare<I>(cpu, gpu.edit(), found), ...);
    }(std::make_index_sequence<Simulation::material_count>{});
    const std::size_t all = size_of(cpu);
    std::printf("%-8s %11zu %11zu %9.3f %% %10.3g cells %10.3g m/s\n", scene.c_str(), all, found.particles,
                100 * double(found.particles) / double(all), found.position, found.velocity);
    std::fflush(stdout);
}

[[noreturn]] void refuse(std::string_view word) {
    throw usage_error("What is " + std::string(word) + "? There are --particles N[,N...], --scene NAME, --steps K, " +
                      "--turns K, --quick, --check and --adapter; scenes are elastic, snow, sand and four.");
}

std::size_t number(const std::string& word) {
    std::size_t end = 0;
    double value = 0;
    try {
        value = std::stod(word, &end);  // also 1e6
    } catch (const std::exception&) {
    }
    if (end != word.size() || !(value >= 1 && value < 1e9)) refuse("the number '" + word + "'");
    return std::size_t(std::llround(value));
}

Options options_of(const std::vector<std::string>& words) {
    Options options;
    for (std::size_t i = 0; i < words.size(); ++i) {
        const auto value = [&]() -> const std::string& {
            if (i + 1 == words.size()) refuse("behind " + words[i]);
            return words[++i];
        };
        if (words[i] == "--particles") {
            const std::string list = value() + ",";
            for (std::size_t at = 0, end; (end = list.find(',', at)) != std::string::npos; at = end + 1)
                options.particles.push_back(number(list.substr(at, end - at)));
        } else if (words[i] == "--scene") {
            options.scene = value();
        } else if (words[i] == "--steps") {
            options.steps = int(number(value()));
        } else if (words[i] == "--turns") {
            options.turns = int(number(value()));
        } else if (words[i] == "--quick") {
            options.quick = true;
        } else if (words[i] == "--check") {
            options.check = true;
        } else if (words[i] == "--adapter") {
            options.adapter = true;
        } else {
            refuse("'" + words[i] + "'");
        }
    }
    return options;
}

void run(const webgpu::Device& device, Options options) {
    const bool software = device.is_software();
    if (options.particles.empty()) {
        options.particles =
            software ? std::vector<std::size_t>{8'000, 64'000} : std::vector<std::size_t>{100'000, 1'000'000};
        if (options.quick) options.particles.pop_back();
    }
    if (options.steps == 0) options.steps = options.check ? 20 : software ? 4 : options.quick ? 10 : 50;
    if (options.turns == 0) options.turns = options.quick ? 1 : software ? 3 : 5;
    if (options.scene.empty() && software) {
        std::printf("On a software GPU, which compiles a program for a minute, only one scene; others by --scene.\n");
        options.scene = "elastic";
    }
    if (options.check)
        std::printf("%-8s %11s   other bits, and their largest differences, after %d steps\n", "scene", "particles",
                    options.steps);
    else
        std::printf("%-8s %11s %11s %-6s %10s %9s    (%d turns of %d steps)\n", "scene", "particles", "nodes", "grid",
                    "ms a step", "M p-s/s", options.turns, options.steps);
    bool found = false;
    const auto one = [&](const std::string& scene, auto make) {
        if (!options.scene.empty() && options.scene != scene) return;
        found = true;
        for (const std::size_t particles : options.particles) {
            if (options.check)
                check(scene, make(particles), device, options.steps);
            else
                measure(scene, make(particles), device, options);
        }
    };
    one("elastic", elastic);
    one("snow", snow);
    one("sand", sand);
    one("four", four);
    if (!found) refuse("the scene '" + options.scene + "'");
}

}  // namespace

int main(int count, char** words) {
    try {
        const Options options = options_of({words + 1, words + count});
        const webgpu::Device device({.timestamps = true});
        std::printf("adapter: %s%s\n", device.name().c_str(), device.has_timestamps() ? "" : " (without timestamps)");
        if (!options.adapter) run(device, options);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
}
