/// \file What firn/webgpu promises, on a device without contraction (see firn_swiftshader in cmake/webgpu.sh): numbers
/// as the CPU's to the bit, and an error with its reason for all that goes wrong. Closes with "N passed, M failed".
#include <firn/webgpu/host.hpp>
#include <firn/webgpu/pass_times.hpp>

#include "checks.hpp"
#include "scene.hpp"

#include <chrono>
#include <cstdlib>
#include <iostream>

namespace {

using namespace firn;
using namespace checks;

template <int D>
struct Blocks : scenes::MovingBlocks<D, Apic, MlsForce, FixedCorotated<float>> {
    Blocks()
        : scenes::MovingBlocks<D, Apic, MlsForce, FixedCorotated<float>>(
              {D == 2 ? 0.3 : 0.2, D == 2 ? 1.0 / 64 : 1.0 / 32, D == 2 ? 1.0 / 32 : 1.0 / 16},
              FixedCorotated<float>::from_young_poisson(1e5, 0.3)) {}

    /// A device of its own, which only the simulation keeps.
    webgpu::Host on_device() const {
        const webgpu::Device device;
        return {device, this->program, this->inputs(device.limits())};
    }
};

const std::vector<float>& numbers_of(const wgsl::Inputs& inputs, const std::string& name) {
    for (const auto& [buffer, numbers] : inputs.buffers)
        if (buffer == name) return numbers;
    throw usage_error("The inputs have no " + name + ".");
}

std::vector<std::string> until(const std::vector<std::string>& order, const std::string& last) {
    return {order.begin(), std::find(order.begin(), order.end(), last) + 1};
}

/// Sums at the nodes and one step, with half of the time step that the inputs were made for.
template <int D>
void compare_with_cpu(Blocks<D>& blocks, webgpu::Host& simulation, bool sorted) {
    const std::string name = sentence(D, "D", sorted ? ", sorted: " : ": ");
    const long steps_before = simulation.steps();
    simulation.run(until(wgsl::step_order_of(blocks.program, sorted), sorted ? "p2g_blocks" : "p2g"));
    check_same_bits(name + "integers at the nodes after P2G", simulation.read_buffer<std::int32_t>("nodes"),
                    scenes::node_sums<QuadraticBSpline, Apic, MlsForce>(blocks.simulation, blocks.inputs().nodes));
    simulation.step(1, sorted);
    blocks.simulation.step();
    const wgsl::Inputs after = blocks.inputs();
    for (const char* buffer : {"motion", "affine", "stress", "state"})
        check_same_bits(name + buffer + " after a step", simulation.read_buffer(buffer), numbers_of(after, buffer));

    const std::size_t count = after.particles;
    const std::vector<float>& motion = numbers_of(after, "motion");
    std::vector<float> velocities;
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t a = 0; a < std::size_t(D); ++a) velocities.push_back(motion[(2 * D + a) * count + i]);
    check_same_bits(name + "velocities, particle after particle", simulation.read("velocity"), velocities);
    const webgpu::Status status = simulation.check();
    check(status.error == 0 && status.particle == webgpu::no_particle && simulation.steps() == steps_before + 1 &&
              simulation.particles() == count,
          name + "no error, one step");
    check(status.signal_speed == float(blocks.simulation.report().signal_speed), name + "the fastest signal",
          sentence(status.signal_speed, " m/s instead of ", blocks.simulation.report().signal_speed));
}

template <int D>
void compare_with_cpu() {
    Blocks<D> blocks;
    webgpu::Host simulation = blocks.on_device();  // a software GPU takes long to compile a program in 3D
    simulation.initialise();
    blocks.simulation.fixed_time_step = 0.5 * blocks.simulation.fixed_time_step;
    simulation.set("time_step", {blocks.simulation.fixed_time_step});
    for (const bool sorted : {false, true}) compare_with_cpu(blocks, simulation, sorted);
}

void mirrored_walls() {
    scenes::MovingBlocks<2, Apic, MlsForce, FixedCorotated<float>> blocks(
        {0.3, 1.0 / 64, 1.0 / 32, 0}, FixedCorotated<float>::from_young_poisson(1e5, 0.3), scenes::mirrored_walls<2>());
    webgpu::Host simulation(webgpu::Device(), blocks.program, blocks.inputs());
    simulation.initialise();
    simulation.step(3);
    for (int i = 0; i < 3; ++i) blocks.simulation.step();
    const std::vector<float> moved = simulation.read_buffer("motion");
    check_same_bits("motion after three steps between mirrored walls", moved, numbers_of(blocks.inputs(), "motion"));
    simulation.set("boundary_upper", {1, 0.99});
    simulation.step();
    check_throws<parameter_error>("a mirrored wall between nodes", {"mirrored wall", "plane of nodes"},
                                  [&] { simulation.check(); });
    check_same_bits("with a mirrored wall between nodes particles stay as they were", simulation.read_buffer("motion"),
                    moved);
}

/// advance() of the device and of the CPU, until a last step that is shortened.
/// \param boundary_speed  of a collider far from matter [m/s];  \param first_step  the first step [s], if it is known
template <int D, class Volume = OwnVolume>
void advance_with_cpu(const std::string& what, double cell_size, const FixedCorotated<float>& material, double steps,
                      bool sorted, double boundary_speed = 0, float first_step = 0, const Volume& volume = {}) {
    const std::string name = sentence("advance in ", D, "D, ", what, ": ");
    Collider<Box<float, D>> wall{.shape = {Vec<float, D>::filled(0.05F)}, .contact = Contact::separate};
    wall.position = Vec<double, D>::filled(0.85);
    wall.position[0] = 0.2;
    wall.linear_velocity[0] = boundary_speed;
    scenes::MovingBlocks<D, Apic, MlsForce, FixedCorotated<float>, QuadraticBSpline,
                         Together<Walls<float, D>, Collider<Box<float, D>>>, Volume>
        blocks({0.2, cell_size / 2, cell_size}, material, Together(scenes::rough_walls<D>(), wall), volume);
    auto& cpu = blocks.simulation;
    auto& slower = cpu.edit_particles();  // so that no particle leaves the reach of its block
    for (std::size_t slot = 0; slot < slower.slots(); ++slot)
        if (slower.is_particle(slot)) slower.set_velocity(slot, slower.velocity(slot) * 0.1F);
    cpu.partition();
    cpu.warn = {};
    webgpu::Host simulation(webgpu::Device(), blocks.program, blocks.inputs());
    simulation.set("boundary_speed", {boundary_speed});
    simulation.initialise();

    cpu.fixed_time_step = 0;
    cpu.execution.float_steps = true;
    std::vector<float> dts;
    cpu.add_pass("note", "sinks and sources", [&](auto&, const StepNow<float, D>& now) {
        dts.push_back(float(now.dt));
        if (double(dts.back()) != now.dt) throw usage_error("A step that was chosen in float is none.");
    });
    const auto ids = [&] {
        std::vector<std::uint64_t> all;
        for (std::size_t slot = 0; slot < cpu.particles().slots(); ++slot) all.push_back(cpu.particles().id(slot));
        return all;
    };
    const auto sorted_ids = ids();
    const double bound = cpu.stable_time_step();
    for (const char* part : {"first, ", "then, "}) {
        const double duration = ((part[0] == 'f' ? steps : 3) - 0.6) * bound;
        const std::uint64_t before = cpu.steps();
        dts.clear();
        cpu.advance(duration);
        const std::vector<float> taken = simulation.advance(duration, sorted);
        check(ids() == sorted_ids, name + part + "the CPU has not sorted, so its order is that of the device");
        const bool shortened = dts.size() == 1 || dts.back() < 0.9F * *std::max_element(dts.begin(), dts.end());
        check(double(dts.size()) > 0.4 * duration / bound && taken.size() == cpu.steps() - before && shortened,
              name + part + "the steps are counted, and the last is shortened",
              sentence(taken.size(), " instead of ", dts.size(), "; last ", dts.back(), " s"));
        check_same_bits(name + part + "time steps", taken, dts);
        check(first_step == 0 || dts.front() == first_step, name + part + "what bounds the steps",
              sentence("not ", first_step, " s, but ", dts.front(), " s"));
        const webgpu::Status status = simulation.status();
        check(status.time_left == 0 && status.steps == taken.size(), name + part + "the device has arrived");
        blocks.simulation.fixed_time_step = 1;  // for the inputs, which have one
        const wgsl::Inputs after = blocks.inputs();
        blocks.simulation.fixed_time_step = 0;
        for (const char* buffer : {"motion", "affine", "stress", "state"})
            check_same_bits(name + part + buffer, simulation.read_buffer(buffer), numbers_of(after, buffer));
    }
    check(simulation.steps() == long(cpu.steps() - 10), name + "all steps are counted");
}

void advances() {
    const auto stiff = FixedCorotated<float>::from_young_poisson(1e5, 0.3),
               soft = FixedCorotated<float>::from_young_poisson(1, 0.3);
    advance_with_cpu<2>("bounded by waves", 1.0 / 50, stiff, 32, false);
    advance_with_cpu<2>("with a filter of volumes", 1.0 / 50, stiff, 12, false, 0, 0, VolumeFilter{.every = 1});
    advance_with_cpu<2>("bounded by waves, sorted", 1.0 / 30, stiff, 30, true);
    constexpr float h = 1.0F / 30;
    advance_with_cpu<2>("bounded by gravity", 1.0 / 30, soft, 3, false, 0, acceleration_time_step(h, 9.81F));
    advance_with_cpu<2>("bounded by a collider", 1.0 / 30, stiff, 8, false, 40,
                        stable_time_step<QuadraticBSpline>(h, 40.0F));

    const Blocks<2> blocks;
    webgpu::Host one = blocks.on_device(), other = blocks.on_device();
    one.initialise();
    other.initialise();
    check(one.advance(0).empty(), "an advance of 0 s takes no step");
    one.step(3);
    other.step(3);
    check_same_bits("steps after an advance are of the time step that was set", one.read_buffer("motion"),
                    other.read_buffer("motion"));
    check_throws<parameter_error>("an advance backwards", {"-1 s"}, [&] { one.advance(-1); });
    one.set("boundary_speed", {1e4});
    const float dt = stable_time_step<QuadraticBSpline>(1.0F / 32, 1e4F);
    const std::vector<float> many = one.advance(600.5 * double(dt));
    double time = 0;
    for (const float step : many) time += double(step);
    check(many.size() == 601 && one.steps() == 3 + 601 && std::count(many.begin(), many.end(), dt) == 600 &&
              many.back() < 0.6F * dt,
          "more steps than the device's log holds", sentence(many.size(), " steps"));
    check(std::abs(time - 600.5 * double(dt)) < 1e-7 * double(dt), "they sum up to the time that was asked for");
    one.set("boundary_speed", {1e37});
    check_throws<particle_error>("steps that do not change the time", {"bound of the time step"},
                                 [&] { one.advance(1); });
    check_throws<parameter_error>("a negative speed", {"-1 m/s"}, [&] { one.set("boundary_speed", {-1}); });
}

void many_steps_are_single_steps() {
    const Blocks<2> blocks;
    webgpu::Host together = blocks.on_device(), single = blocks.on_device();
    together.initialise();
    single.initialise();
    together.step(37);
    for (int i = 0; i < 37; ++i) single.step();
    check(together.steps() == 37 && single.steps() == 37, "37 steps are counted");
    check_same_bits("37 steps at once are 37 single steps", together.read_buffer("motion"),
                    single.read_buffer("motion"));
}

void sorted_steps_sort() {
    const Blocks<2> blocks;
    webgpu::Host simulation = blocks.on_device();
    simulation.initialise();
    simulation.step();
    const auto first_bins = [&] {
        std::vector<std::uint32_t> bins = simulation.read_buffer<std::uint32_t>("bins");
        bins.resize(simulation.particles());
        return bins;
    };
    const std::vector<std::uint32_t> zeros(simulation.particles());
    check(first_bins() == zeros, "a plain step does not order the particles");
    simulation.step(1, true);
    std::vector<std::uint32_t> order = first_bins(), all = zeros;
    std::sort(order.begin(), order.end());
    for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
    check(order == all, "a sorted step puts every particle into the order once");
}

void times_of_passes() {
    const Blocks<2> blocks;
    const webgpu::Device device({.timestamps = true});
    check(device.has_timestamps() && !webgpu::Device().has_timestamps(), "timestamps only where they are asked for");
    webgpu::Host timed(device, blocks.program, blocks.inputs()), plain = blocks.on_device();
    for (webgpu::Host* host : {&timed, &plain}) host->initialise();
    const std::vector<std::string> order = wgsl::step_order_of(blocks.program, true);
    constexpr int steps = 37;
    const auto begin = std::chrono::steady_clock::now();
    const std::vector<webgpu::PassTime> times = webgpu::time_passes(timed.sequence(order), steps);
    const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    plain.step(steps, true);
    check_same_bits("steps whose passes are timed", timed.read_buffer("motion"), plain.read_buffer("motion"));
    std::vector<std::string> names;
    double sum = 0;
    bool good = true;
    for (const webgpu::PassTime& pass : times) {
        names.push_back(pass.entry_point);
        sum += steps * pass.mean;
        good = good && pass.material == blocks.program.material && pass.particles == timed.particles() &&
               pass.median > 0 && std::isfinite(pass.mean) && pass.mean * steps > 0.49 * pass.median * steps;
    }
    check(names == order && good, "each pass of a step has a name and a time", sentence(names.size(), " passes"));
    check(sum > 0.02 * wall && sum < wall, "the times make up much of the time that passes",
          sentence(sum, " s of ", wall, " s"));
    const auto pass = [&](const std::string& name) {
        return times.at(std::size_t(std::ranges::find(names, name) - names.begin()));
    };
    check(pass("p2g_blocks").bytes_a_particle == 0 && pass("grid_update").bytes_a_particle == 0,
          "what does not run for each particle has no bytes of it");
    check(webgpu::time_passes({}, 3).empty(), "no passes take no time");
    check_throws<usage_error>("times of a device that was made without", {"DeviceOptions::timestamps", device.name()},
                              [&] { webgpu::time_passes(plain.sequence(order), 1); });
    check_throws<usage_error>("the time of no entry point", {"no entry point no_such"},
                              [&] { webgpu::time_passes(timed.sequence({"no_such"}), 1); });
    check_throws<usage_error>("too many passes to be timed", {"2050", "2048"},
                              [&] { webgpu::time_passes(timed.sequence(std::vector<std::string>(2050, "clear")), 1); });
}

void errors_of_a_step() {
    const Blocks<2> blocks;
    webgpu::Host simulation = blocks.on_device();
    simulation.initialise();
    const std::vector<float> before = simulation.read_buffer("motion");
    simulation.set("momentum_scale", {0x1p60});
    simulation.step(3);
    check_throws<overflow_error>("too large a scale", {wgsl::error_sentences[2], "step 3"},
                                 [&] { simulation.check(); });
    check_same_bits("after too large a scale particles are as they were", simulation.read_buffer("motion"), before);
    simulation.set("momentum_scale", {0});
    simulation.initialise();
    simulation.step();
    check(simulation.check().error == 0 && simulation.read_buffer("motion") != before,
          "initialise() forgets the error, and the next step moves the particles");

    constexpr std::size_t lost = 7;
    std::vector<float> state = simulation.read_buffer("state");
    state[lost] = std::nanf("");
    simulation.write_buffer("state", state);
    check_throws<particle_error>("a particle that is not a number", {wgsl::error_sentences[3], "(particle 7, "},
                                 [&] { simulation.step(1000); });
    check(simulation.steps() == 1 + 3 + 256, "1000 steps stop at the first look", sentence(simulation.steps()));
}

void mistakes_in_a_program() {
    const Blocks<2> blocks;
    const webgpu::Device device;
    const wgsl::Inputs inputs = blocks.inputs();
    wgsl::Program wrong = blocks.program;
    const std::string right = "base_node_of(place)";
    const std::size_t at = wrong.code.find(right);
    const auto line = 1 + std::count(wrong.code.begin(), wrong.code.begin() + std::ptrdiff_t(at), '\n');
    wrong.code.replace(at, right.size(), "no_such_function(place)");
    check_throws<device_error>("a mistake in the code", {sentence(".wgsl:", line, ":"), "no_such_function(place)"},
                               [&] { webgpu::Host(device, wrong, inputs); });

    wrong = blocks.program;
    for (wgsl::EntryPoint& e : wrong.entry_points)
        if (e.name == "g2p") e.bindings.pop_back();
    check_throws<device_error>("an entry point that lacks a binding", {"entry point g2p", "inding"},
                               [&] { webgpu::Host(device, wrong, inputs); });

    wrong = blocks.program;
    wrong.entry_points.back().per = "face";
    check_throws<usage_error>("an unknown count", {"per face"}, [&] { webgpu::Host(device, wrong, inputs); });
    device.check();
    check(true, "what was refused with an error does not come again");
}

void too_many_particles() {
    const Blocks<3> blocks;
    const webgpu::Device usual(webgpu::DeviceOptions{.raise_limits = false}), raised;
    check(usual.limits().storage_binding_bytes == wgsl::Limits{}.storage_binding_bytes, "what every device has");
    check(raised.limits().storage_binding_bytes > usual.limits().storage_binding_bytes, "this one has more");
    for (const webgpu::Device* device : {&usual, &raised}) {
        const wgsl::Limits& limits = device->limits();
        WGPULimits own{};
        wgpuDeviceGetLimits(device->handle(), &own);
        check(limits.storage_binding_bytes == own.maxStorageBufferBindingSize &&
                  limits.buffer_bytes == own.maxBufferSize &&
                  limits.groups_per_dimension == own.maxComputeWorkgroupsPerDimension &&
                  limits.storage_buffers_per_stage == int(own.maxStorageBuffersPerShaderStage),
              "limits are the device's own");
        const std::uint64_t each = 4 * std::uint64_t(blocks.program.buffer("motion").count),
                            most = std::min(limits.storage_binding_bytes, limits.buffer_bytes) / each;
        wgsl::Inputs inputs = blocks.inputs();
        inputs.buffers.clear();
        inputs.particles = std::uint32_t(most + 1);
        inputs.set("particles", {double(inputs.particles)});
        inputs.set("capacity", {double(inputs.particles)});
        check_throws<parameter_error>("one particle too many", {"'motion'", sentence(most, " particles fit"), "max"},
                                      [&] { webgpu::Host(*device, blocks.program, inputs); });
    }
}

void wrong_calls() {
    const Blocks<2> blocks;
    webgpu::Host simulation = blocks.on_device();
    check_throws<usage_error>("a buffer that does not exist", {"no buffer nothing"},
                              [&] { (void)simulation.read_buffer("nothing"); });
    check_throws<usage_error>("a component that does not exist", {"no component nothing", "velocity"},
                              [&] { (void)simulation.read("nothing"); });
    check_throws<usage_error>("integers read as floats", {"nodes holds i32, not f32"},
                              [&] { (void)simulation.read_buffer<float>("nodes"); });
    check_throws<usage_error>("too few numbers", {"motion holds", "2 were given"},
                              [&] { simulation.write_buffer<float>("motion", {1, 2}); });
    check_throws<usage_error>("an entry point that does not exist", {"no entry point nothing"},
                              [&] { simulation.run({"nothing"}); });
    check_throws<usage_error>("a uniform that does not exist", {"no uniform nothing"},
                              [&] { simulation.set("nothing", {1}); });
    check_throws<usage_error>("too many components", {"2 components", "3 were given"},
                              [&] { simulation.set("field_gravity", {1, 2, 3}); });
    check_throws<parameter_error>("a time step that is no number", {"time_step", "nan"},
                                  [&] { simulation.set("time_step", {std::nan("")}); });
    check_throws<parameter_error>("a part of a particle", {"particles", "1.5"},
                                  [&] { simulation.set("particles", {1.5}); });
    check_throws<parameter_error>("more particles than memory", {"1000000 particles", "capacity"},
                                  [&] { simulation.set("particles", {1000000}); });
    check_throws<parameter_error>("another capacity", {"capacity", "cannot change"},
                                  [&] { simulation.set("capacity", {10}); });
    check_throws<parameter_error>("another cell size", {"cell_size", "cannot change"},
                                  [&] { simulation.set("cell_size", {0.1}); });
    check_throws<parameter_error>("a time step back", {"-1 s"}, [&] { simulation.set("time_step", {-1}); });
    check_throws<parameter_error>("a scale of 3", {"power of two"}, [&] { simulation.set("mass_scale", {3}); });
    const Blocks<3> others;
    const webgpu::Device device;
    check_throws<error>("inputs of another program", {},
                        [&] { webgpu::Host(device, blocks.program, others.inputs()); });
    wgsl::Inputs inputs = blocks.inputs();
    --inputs.particles;
    check_throws<usage_error>("inputs that contradict themselves", {"particles"},
                              [&] { webgpu::Host(device, blocks.program, inputs); });
    simulation.set("particles", {10});
    check(simulation.read("mass").size() == 10, "only particles that are there are read");
}

/// A program of three lines, with workgroups of one, so that a few particles need a second row of them.
void every_particle_once() {
    wgsl::Program program;
    program.name = "visits";
    program.dimension = 2;
    wgsl::detail::UniformLayout uniforms(program);
    wgsl::detail::add_uniforms(uniforms, 2, {});
    program.uniform_bytes = (program.uniform_bytes + 15) / 16 * 16;
    program.buffers = {{"visits", "u32", 1, "particle", 1, {{"visits", 1, "1"}}},
                       {"status", "u32", 2, "program", 16, {}}};
    program.entry_points = {{"visit", "particle", 1, {{1, true}}}};
    program.code = R"(@group(0) @binding(1) var<storage, read_write> visits: array<u32>;
@compute @workgroup_size(1)
fn visit(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = group.y * groups.x + group.x;
    if (i < arrayLength(&visits)) { visits[i] += i + 1u; }
})";
    constexpr std::uint32_t count = 70000;
    wgsl::Inputs inputs(program);
    inputs.particles = count;
    inputs.nodes = {4, 8};
    inputs.set("nodes", {4, 8});
    inputs.set("particles", {count});
    inputs.set("capacity", {count});
    webgpu::Host simulation(webgpu::Device({.timestamps = true}), program, inputs);
    simulation.run({"visit"}, 2);
    check(webgpu::time_passes(simulation.sequence({"visit"}), 1).at(0).bytes_a_particle == 8,
          "what is written is also read");
    std::vector<std::uint32_t> expected(count);
    for (std::uint32_t i = 0; i < count; ++i) expected[i] = 3 * (i + 1);
    check_same_bits("every particle is visited, in two rows of workgroups", simulation.read<std::uint32_t>("visits"),
                    expected);
}

void refusal_and_loss() {
    const Blocks<2> blocks;
    const webgpu::Device device;
    webgpu::Host simulation(device, blocks.program, blocks.inputs());
    wgpuBufferDestroy(simulation.buffer("motion"));
    simulation.step();
    check_throws<device_error>("a command that the device refused", {"refused", "motion"}, [&] { simulation.step(); });
    wgpuDeviceDestroy(device.handle());
    for (int i = 0; i < 2; ++i)
        check_throws<device_error>("a lost device", {"was lost"}, [&] { (void)simulation.status(); });
    check_throws<device_error>("a lost device for another simulation", {"was lost"},
                               [&] { webgpu::Host(device, blocks.program, blocks.inputs()); });
}

void no_gpu() {
    setenv("VK_ICD_FILENAMES", "/no/such/driver.json", 1);
    check_throws<device_error>("no driver", {"no GPU", "VK_ICD_FILENAMES"}, [] { webgpu::Device(); });
}

}  // namespace

int main() {
    try {
        std::cout << webgpu::Device().name() << '\n';
        check(webgpu::Device({.only_software = true}).is_software(), "a device in software");
        compare_with_cpu<2>();
        compare_with_cpu<3>();
        advances();
        mirrored_walls();
        many_steps_are_single_steps();
        sorted_steps_sort();
        times_of_passes();
        errors_of_a_step();
        mistakes_in_a_program();
        too_many_particles();
        wrong_calls();
        every_particle_once();
        refusal_and_loss();
        no_gpu();
    } catch (const std::exception& e) {
        check(false, "the test", e.what());
    }
    return finish();
}
