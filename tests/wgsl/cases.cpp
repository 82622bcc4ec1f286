/// \file Writes programs for WebGPU, what goes into them, and what the CPU makes of that: a folder each below
/// FOLDER/cases, for run.mjs; and programs with mistakes below FOLDER/broken.
///
///     firn_wgsl_cases FOLDER [--large] [--exact]
///
/// Compiled without contraction, the CPU evaluates the definitions of a program in the same order, so that the integers
/// of a step are the same to the bit, and particles on a device that does not contract either.
#include <firn/field/attraction.hpp>
#include <firn/force/weight_gradient.hpp>
#include <firn/material/fluid.hpp>
#include <firn/material/mohr_coulomb.hpp>
#include <firn/material/modified_cam_clay.hpp>
#include <firn/material/nacc.hpp>
#include <firn/material/per_particle.hpp>
#include <firn/material/plane_strain.hpp>
#include <firn/material/sand.hpp>
#include <firn/material/snow.hpp>
#include <firn/material/von_mises.hpp>
#include <firn/transfer/aflip.hpp>
#include <firn/transfer/flip.hpp>
#include <firn/transfer/fmpm.hpp>
#include <firn/transfer/pic.hpp>
#include <firn/volumetric/f_bar.hpp>
#include <firn/volumetric/volume_filter.hpp>
#include <firn/wgsl/inputs.hpp>
#include <firn/wgsl/program.hpp>

#include "../examples/eigen_material.hpp"
#include "../examples/own_material.hpp"
#include "asking.hpp"
#include "scene.hpp"

#include <filesystem>
#include <fstream>
#include <iostream>

namespace {

using namespace firn;

/// A shape by its distance alone, whose normal is found by dual numbers: all within a radius of the last axis.
template <scalar S, int D>
struct Tube {
    S radius = S(0.5);
    static constexpr const char* name = "tube";
    static constexpr auto parameters() { return std::tuple{parameter{"radius", "m", &Tube::radius}}; }
    S signed_distance(const Vec<S, D>& x) const {
        using firn::abs, firn::sqrt;
        if constexpr (D == 2)
            return abs(x[0]) - radius;
        else
            return sqrt(x[0] * x[0] + x[1] * x[1]) - radius;
    }
};

class Case {
public:
    Case(const std::filesystem::path& folder, const wgsl::Program& program) : folder_(folder) {
        std::filesystem::create_directories(folder);
        write("program.wgsl", program.code);
        write("manifest.json", wgsl::manifest(program));
    }
    template <class T>
    std::string file(const std::string& name, const std::vector<T>& numbers) {
        write(name + ".bin", std::string(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(T)));
        return name + ".bin";
    }
    void write(const std::string& name, const std::string& bytes) {
        std::ofstream out(folder_ / name, std::ios::binary);
        out << bytes;
        if (!out.flush()) throw io_error("Cannot write " + (folder_ / name).string());
    }

private:
    std::filesystem::path folder_;
};

/// What run.mjs shall find.
struct Expectation {
    std::string buffer, after;
    int step;
    std::string file;
    double tolerance;  ///< 0: equal to the bit
};

template <int D>
void write_case_file(Case& files, const wgsl::Program& program, const wgsl::Inputs& inputs, const std::string& schedule,
                     int steps, const std::vector<Expectation>& expectations, int error = 0) {
    Json json;
    json.object([&] {
        json.field("particles", inputs.particles).field("steps", steps).field("schedule", schedule);
        json.field("error", error);
        json.key("uniforms").object([&] {
            for (std::size_t k = 0; k < program.uniforms.size(); ++k) {
                const std::vector<double>& values = inputs.uniform(k);
                json.key(program.uniforms[k].name.c_str());
                if (values.size() == 1)
                    json.value(values[0]);
                else
                    json.array(values, [&](double x) { json.value(x); });
            }
        });
        json.key("inputs").object([&] {
            for (const auto& [of, numbers] : inputs.buffers) json.field(of.c_str(), files.file(of, numbers));
        });
        json.key("expect").array(expectations, [&](const Expectation& e) {
            json.object([&] {
                json.field("buffer", e.buffer).field("after", e.after).field("steps", e.step).field("file", e.file);
                if (e.tolerance == 0)
                    json.field("exactly", true);
                else
                    json.field("tolerance", e.tolerance);
            });
        });
    });
    files.write("case.json", json.text());
}

/// One step and more, to the bit, from particles that are in motion and strained.
template <int D, class Transfer, class Force, class Material = FixedCorotated<float>, class Kernel = QuadraticBSpline,
          class Boundary = Walls<float, D>, class Volume = OwnVolume>
void write_case(const std::filesystem::path& root, const std::string& name, const scenes::Matter& matter,
                const std::string& schedule, int steps,
                const Material& material = FixedCorotated<float>::from_young_poisson(1e5, 0.3), double time_step = 0,
                const Boundary& boundary = scenes::rough_walls<D>(), const Volume& volume = {},
                wgsl::GridStorage grid = wgsl::GridStorage::dense, const Transfer& transfer = {}) {
    scenes::MovingBlocks<D, Transfer, Force, Material, Kernel, Boundary, Volume> blocks(matter, material, boundary,
                                                                                        volume, grid, transfer);
    auto& simulation = blocks.simulation;
    if (time_step > 0) simulation.fixed_time_step = time_step;
    const auto& particles = simulation.particles();
    const wgsl::Program& program = blocks.program;
    wgsl::Inputs inputs = blocks.inputs();
    if (program.keeps_time) {
        const TimeLeft<float> time = time_left(simulation.time());
        std::vector<float> status(std::size_t(program.buffer("status").count));
        status.at(wgsl::detail::time_word) = time.high;
        status.at(wgsl::detail::time_low_word) = time.low;
        inputs.buffers.emplace_back("status", status);
    }
    std::vector<std::uint32_t> ids;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) ids.push_back(particles.id(slot));

    Case files(root / name, program);
    std::vector<Expectation> expectations;
    if (!filters_volume<Volume> && grid == wgsl::GridStorage::dense)  // a filter acts before P2G
        expectations.push_back(
            {"nodes", schedule == "step" ? "p2g" : "p2g_blocks", 1,
             files.file("nodes_1", scenes::node_sums<Kernel, Transfer, Force>(simulation, inputs.nodes)), 0});
    simulation.step();
    for (const auto& [buffer, numbers] : blocks.inputs().buffers)
        if (buffer != "constants" && buffer != "coordinates")
            expectations.push_back({buffer, schedule, 1, files.file(buffer + "_1", numbers), 0});
    if (steps > 1) {
        for (int i = 1; i < steps; ++i) simulation.step();
        std::vector<std::size_t> slot_of(particles.size());
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) slot_of[particles.id(slot)] = slot;
        std::vector<float> positions, velocities;  // [cells], [m/s], in the order of the inputs
        for (const std::uint32_t id : ids)
            for (int a = 0; a < D; ++a) {
                const std::size_t slot = slot_of[id];
                positions.push_back(
                    float(double(particles.place(slot)[a]) + block_size * particles.block(slot)[std::size_t(a)]));
                velocities.push_back(particles.velocity(slot)[a]);
            }
        expectations.push_back({"position", schedule, steps, files.file("position", positions), 0});
        expectations.push_back({"velocity", schedule, steps, files.file("velocity", velocities), 0});
    }
    write_case_file<D>(files, program, inputs, schedule, steps, expectations);
    std::cout << name << ": " << inputs.particles << " particles\n";
}

template <class Transfer, class Force>
void write_both_dimensions(const std::filesystem::path& root, const std::string& name) {
    write_case<2, Transfer, Force>(root, "2d_" + name, {0.3, 1.0 / 64, 1.0 / 32}, "step", 50);
    write_case<3, Transfer, Force>(root, "3d_" + name, {0.25, 1.0 / 32, 1.0 / 16}, "step", 50);
}

/// Solids between the blocks, one of them a stranger's: they turn, but stay where they are.
template <int D>
void write_solids(const std::filesystem::path& root, const scenes::Matter& matter) {
    Collider<Sphere<float, D>> ball{.shape = {0.12F}, .contact = Contact::slip, .friction = 0.2};
    ball.position = Vec<double, D>::filled(0.35);
    ball.linear_velocity = Vec<double, D>::filled(0.25);
    Collider<Complement<Tube<float, D>>> tube{.shape = {{0.3F}}, .thickness = 0.02};
    tube.position = Vec<double, D>::filled(0.5);
    if constexpr (D == 2) {
        ball.angular_velocity = -3;
        tube.rotation = rotor(radians(0.7));
    } else {
        ball.angular_velocity = {1.0, -2.0, 3.0};
        tube.rotation = rotor({1.0, 2.0, 3.0}, radians(0.7));
    }
    const auto material = FixedCorotated<float>::from_young_poisson(1e5, 0.3);
    write_case<D, Apic, MlsForce>(root, std::to_string(D) + "d_solids", matter, "step", 1, material, 0,
                                  Together(scenes::rough_walls<D>(), ball, tube));
}

/// Blocks in corners with friction: of walls, and of a hollow box that is turned in them and moves.
void write_corners(const std::filesystem::path& root) {
    const auto material = FixedCorotated<float>::from_young_poisson(1e5, 0.3);
    write_case<2, Apic, MlsForce>(root, "2d_corners", {0.3, 1.0 / 64, 1.0 / 32, 0}, "step", 4, material);
    Collider<Complement<Box<float, 3>>> hollow{.shape = {{Vec<float, 3>::filled(0.48F)}}, .friction = 0.5};
    hollow.position = Vec<double, 3>::filled(0.49);
    hollow.rotation = rotor({1.0, 2.0, 3.0}, radians(0.05));
    hollow.linear_velocity = {0.5, -0.25, 0.125};
    write_case<3, Apic, MlsForce>(root, "3d_corners", {0.25, 1.0 / 32, 1.0 / 16, 0}, "step", 2, material, 0,
                                  Together(scenes::rough_walls<3>(), hollow));
}

/// Blocks in the corners of mirrored walls, some of them inside of the domain and beside a ball.
void write_mirrored(const std::filesystem::path& root) {
    const auto material = FixedCorotated<float>::from_young_poisson(1e5, 0.3);
    write_case<2, Apic, MlsForce>(root, "2d_mirrored", {0.3, 1.0 / 64, 1.0 / 32, 0}, "step", 4, material, 0,
                                  scenes::mirrored_walls<2>());
    write_case<2, Pic, WeightGradientForce, FixedCorotated<float>, CubicBSpline>(
        root, "2d_mirrored_sorted", {0.3, 1.0 / 64, 1.0 / 32, 1.0 / 32}, "step_sorted", 1, material, 0,
        scenes::mirrored_walls<2>(1.0 / 32));
    Collider<Sphere<float, 3>> ball{.shape = {0.1F}, .contact = Contact::slip, .friction = 0.2};
    ball.position = Vec<double, 3>::filled(0.47);
    write_case<3, Apic, MlsForce>(root, "3d_mirrored", {0.25, 1.0 / 32, 1.0 / 16, 2.0 / 16}, "step", 3, material, 0,
                                  Together(ball, scenes::mirrored_walls<3>(2.0 / 16)));
    // On sparse grids: beside walls that no particle reaches, but whose columns have matter, or blocks without any;
    // with matter on both sides; and on a ring.
    using Elastic = FixedCorotated<float>;
    constexpr auto sparse = wgsl::GridStorage::sparse;
    auto beside = scenes::mirrored_walls<2>();
    beside.lower = Vec<double, 2>::filled(3.0 / 64);
    beside.upper = Vec<double, 2>::filled(63.0 / 64);
    write_case<2, Flip<>, MlsForce, Elastic, QuadraticBSpline, Walls<float, 2>, FBar>(
        root, "2d_mirrored_sparse", {0.15, 1.0 / 128, 1.0 / 64, 4.75 / 64}, "step", 4, material, 0, beside, {}, sparse);
    write_case<2, Pic, WeightGradientForce, Elastic, CubicBSpline>(
        root, "2d_mirrored_sparse_sorted", {0.15, 1.0 / 128, 1.0 / 64, 0.04}, "step_sorted", 4, material, 0,
        scenes::mirrored_walls<2>(4.0 / 64), OwnVolume{}, sparse);
    write_case<3, Fmpm, MlsForce>(root, "3d_mirrored_sparse", {0.15, 1.0 / 64, 1.0 / 32, 1.0 / 32}, "step", 3, material,
                                  0, scenes::mirrored_walls<3>(1.0 / 32), OwnVolume{}, sparse, Fmpm{.order = 2});
    auto across = scenes::walls_across_first_axis<2>();
    across.nodes_behind = NodesBehind::mirrored;
    write_case<2, Apic, MlsForce>(root, "2d_mirrored_periodic", {0.15, 1.0 / 128, 1.0 / 64, 0, true}, "step", 30,
                                  Elastic::from_young_poisson(1e3, 0.3), 3e-3, across, OwnVolume{}, sparse);
#if defined(FIRN_TEST_ALL)
    write_case<3, Pic, MlsForce>(root, "3d_mirrored_pic", {0.25, 1.0 / 32, 1.0 / 16, 0}, "step", 1, material, 0,
                                 scenes::mirrored_walls<3>());
#endif
    // A host that moves a wall to where there are no nodes.
    const scenes::MovingBlocks<2, Apic, MlsForce, FixedCorotated<float>> blocks({0.1, 1.0 / 64, 1.0 / 32, 0}, material,
                                                                                scenes::mirrored_walls<2>());
    wgsl::Inputs inputs = blocks.inputs();
    inputs.set("boundary_lower", {0, -0.01});
    Case files(root / "error_wall", blocks.program);
    write_case_file<2>(files, blocks.program, inputs, "step", 2, {}, wgsl::detail::mirror_error);
}

/// A shape with distances in a buffer around both blocks.
Collider<Complement<DistanceGrid<float, 2>>> room() {
    const auto distance = [](const Vec<double, 2>& x) {
        return std::max(std::abs(x[0]) - 0.45, std::abs(x[1]) - 0.46);
    };
    Collider<Complement<DistanceGrid<float, 2>>> hollow{.friction = 0.5};
    hollow.shape.hollow = {sampled_distance<2>(
        distance, {.lower = {-0.5, -0.5}, .upper = {0.5, 0.47}, .spacing = 0.04, .exact_up_to = 0.4})};
    hollow.position = {0.5, 0.5};
    return hollow;
}

/// Grids of distances: of functions, and of a mesh that moves.
void write_distances(const std::filesystem::path& root) {
    const auto material = FixedCorotated<float>::from_young_poisson(1e5, 0.3);
    auto moving = scenes::lump();
    moving.linear_velocity = {0.25, 0.25};
    moving.angular_velocity = -3;
    moving.rotation = rotor(radians(0.4));
    write_case<2, Apic, MlsForce>(root, "2d_distances", {0.3, 1.0 / 64, 1.0 / 32}, "step", 1, material, 0,
                                  Together(scenes::rough_walls<2>(), moving, room()));
    write_case<2, Pic, WeightGradientForce>(root, "2d_distances_sparse", {0.15, 1.0 / 128, 1.0 / 64}, "step", 30,
                                            FixedCorotated<float>::from_young_poisson(2e3, 0.3), 3e-3, room(),
                                            OwnVolume{}, wgsl::GridStorage::sparse);
    // Beside mirrored walls, where particles are shifted off it.
    write_case<2, Apic, MlsForce, Fluid<float>, QuadraticBSpline,
               Together<Walls<float, 2>, Collider<DistanceGrid<float, 2>>>, VolumeFilter>(
        root, "2d_distances_shifted", {0.3, 1.0 / 64, 1.0 / 32, 0}, "step", 3,
        Fluid<float>::from_properties({.viscosity = 5}), 2e-4, Together(scenes::mirrored_walls<2>(), scenes::lump()),
        {.every = 1, .shifting = 20});

    auto ramp = scenes::ramp();
    ramp.rotation = rotor({1.0, 2.0, 3.0}, radians(0.2));
    ramp.linear_velocity = {0.25, 0.5, -0.125};
    ramp.angular_velocity = {1.0, -2.0, 3.0};
    write_case<3, Apic, MlsForce>(root, "3d_distances", {0.25, 1.0 / 32, 1.0 / 16}, "step_sorted", 1, material, 0,
                                  ramp);
    auto other = ramp;  // meets the first one between the blocks
    other.shape = {sampled_distance<3>([](const Vec<double, 3>& x) { return norm(x) - 0.2; },
                                       {.lower = {-0.3, -0.3, -0.25}, .upper = {0.3, 0.25, 0.3}, .spacing = 0.06})};
    other.position = {0.55, 0.5, 0.5};
    other.contact = Contact::slip;
    write_case<3, Apic, MlsForce>(root, "3d_distances_twice", {0.25, 1.0 / 32, 1.0 / 16}, "step", 1, material, 0,
                                  Together(scenes::rough_walls<3>(), ramp, other));
}

/// Averages of the rates of volume change, also at mirrored walls.
void write_averaged(const std::filesystem::path& root) {
    const auto material = FixedCorotated<float>::from_young_poisson(1e5, 0.4);
    using Elastic = FixedCorotated<float>;
    write_case<2, Apic, MlsForce, Elastic, QuadraticBSpline, Walls<float, 2>, FBar>(
        root, "2d_f_bar_mirrored", {0.3, 1.0 / 64, 1.0 / 32, 0}, "step", 4, material, 0, scenes::mirrored_walls<2>());
    write_case<3, Apic, WeightGradientForce, Elastic, QuadraticBSpline, Walls<float, 3>, FBar>(
        root, "3d_f_bar", {0.25, 1.0 / 32, 1.0 / 16}, "step_sorted", 2, material);
#if defined(FIRN_TEST_ALL)
    write_case<3, Pic, MlsForce, Elastic, CubicBSpline, Walls<float, 3>, FBar>(
        root, "3d_f_bar_mirrored", {0.25, 1.0 / 32, 1.0 / 16, 0}, "step", 1, material, 0, scenes::mirrored_walls<3>());
#endif
}

/// Filters of the volume ratios: in every step, and in every second one.
void write_filtered(const std::filesystem::path& root) {
    const auto material = FixedCorotated<float>::from_young_poisson(1e5, 0.3);
    const auto honey = Fluid<float>::from_properties({.viscosity = 5});
    using Elastic = FixedCorotated<float>;
    write_case<2, Apic, MlsForce, Fluid<float>, QuadraticBSpline, Walls<float, 2>, VolumeFilter>(
        root, "2d_filter_mirrored", {0.3, 1.0 / 64, 1.0 / 32, 0}, "step", 4, honey, 2e-4, scenes::mirrored_walls<2>(),
        {.every = 1});
    // Particles that are shifted off overfull nodes, beside a ball and between walls inside of the domain.
    Collider<Sphere<float, 3>> ball{.shape = {0.1F}, .contact = Contact::slip, .friction = 0.2};
    ball.position = Vec<double, 3>::filled(0.47);
    write_case<3, Apic, MlsForce, Fluid<float>, QuadraticBSpline, Together<Walls<float, 3>, Collider<Sphere<float, 3>>>,
               VolumeFilter>(root, "3d_shifted", {0.25, 1.0 / 32, 1.0 / 16}, "step", 3, honey, 2e-4,
                             Together(scenes::rough_walls<3>(), ball), {.every = 1, .shifting = 20});
    write_case<2, Pic, WeightGradientForce, Fluid<float>, CubicBSpline, Walls<float, 2>, VolumeFilter>(
        root, "2d_shifted_sorted", {0.3, 1.0 / 64, 1.0 / 32, 1.0 / 32}, "step_sorted", 2, honey, 2e-4,
        scenes::mirrored_walls<2>(1.0 / 32), {.every = 1, .rate = 0, .shifting = 20});
    write_case<3, Apic, MlsForce, Elastic, QuadraticBSpline, Walls<float, 3>, VolumeFilter>(
        root, "3d_filter", {0.25, 1.0 / 32, 1.0 / 16}, "step_sorted", 4, material, 0, scenes::rough_walls<3>(),
        {.every = 2});
}

/// Transfers that blend the particles' velocities with those of the grid before forces act.
void write_blended(const std::filesystem::path& root) {
    using Elastic = FixedCorotated<float>;
    const auto soft = Elastic::from_young_poisson(2e3, 0.3), stiff = Elastic::from_young_poisson(1e5, 0.3);
    const scenes::Matter in_2d{0.3, 1.0 / 64, 1.0 / 32}, in_3d{0.25, 1.0 / 32, 1.0 / 16};
    scenes::Matter cornered = in_2d;
    cornered.in_corners = 1.0 / 32;
    write_case<2, Flip<>, MlsForce>(root, "2d_flip_drift", in_2d, "step", 50, soft, 3e-3, scenes::rough_walls<2>(), {},
                                    wgsl::GridStorage::dense, Flip<>{.ratio = 0.9F});
    write_case<2, Aflip<>, WeightGradientForce>(root, "2d_aflip_sorted", in_2d, "step_sorted", 50);
    write_case<2, Asflip<>, MlsForce>(root, "2d_asflip_sparse", {0.15, 1.0 / 128, 1.0 / 64}, "step", 50, soft, 3e-3,
                                      scenes::rough_walls<2>(), {}, wgsl::GridStorage::sparse,
                                      Asflip<>{.ratio = 0.9F, .separation = 0.75F, .approach = 0.25F});
    write_case<2, Asflip<>, MlsForce, Elastic, QuadraticBSpline, Walls<float, 2>, FBar>(
        root, "2d_asflip_mirrored", cornered, "step", 4, stiff, 0, scenes::mirrored_walls<2>(1.0 / 32));
#if defined(FIRN_TEST_ALL)
    write_case<3, Aflip<>, WeightGradientForce>(root, "3d_aflip_sorted", in_3d, "step_sorted", 50);
    write_case<3, Flip<>, WeightGradientForce, Elastic, CubicBSpline>(root, "3d_flip_cubic", in_3d, "step", 50);
    write_case<2, Aflip<>, MlsForce, Elastic, CubicBSpline>(root, "2d_aflip_cubic_sorted", in_2d, "step_sorted", 50);
    write_case<3, Asflip<>, MlsForce, Fluid<float>, QuadraticBSpline, Walls<float, 3>, VolumeFilter>(
        root, "3d_asflip_filter", in_3d, "step", 50, Fluid<float>::from_properties({.viscosity = 5}), 2e-4,
        scenes::rough_walls<3>(), {.every = 2, .shifting = 20});
    cornered = in_3d;
    cornered.in_corners = 0;
    write_case<3, Asflip<>, MlsForce>(root, "3d_asflip_mirrored", cornered, "step", 3, stiff, 0,
                                      scenes::mirrored_walls<3>());
    write_case<3, Aflip<>, MlsForce>(root, "3d_aflip_sparse", {0.15, 1.0 / 64, 1.0 / 32}, "step", 50, soft, 3e-3,
                                     scenes::rough_walls<3>(), {}, wgsl::GridStorage::sparse);
#endif
}

/// A transfer that refines velocities by a series, on whose terms mirrored walls act.
void write_refined(const std::filesystem::path& root) {
    using Elastic = FixedCorotated<float>;
    const auto soft = Elastic::from_young_poisson(2e3, 0.3), stiff = Elastic::from_young_poisson(1e5, 0.3);
    write_case<2, Fmpm, MlsForce, Elastic, QuadraticBSpline, Walls<float, 2>, FBar>(
        root, "2d_fmpm_mirrored", {0.3, 1.0 / 64, 1.0 / 32, 1.0 / 32}, "step", 4, stiff, 0,
        scenes::mirrored_walls<2>(1.0 / 32), {}, wgsl::GridStorage::dense, Fmpm{.order = 3});
    write_case<2, Fmpm, WeightGradientForce, Elastic, CubicBSpline>(
        root, "2d_fmpm_mirrored_sorted", {0.3, 1.0 / 64, 1.0 / 32, 0}, "step_sorted", 3, stiff, 0,
        scenes::mirrored_walls<2>(), {}, wgsl::GridStorage::dense, Fmpm{.order = 2});
    write_case<2, Fmpm, MlsForce>(root, "2d_fmpm_drift", {0.3, 1.0 / 64, 1.0 / 32}, "step", 50, soft, 3e-3,
                                  scenes::rough_walls<2>(), {}, wgsl::GridStorage::dense, Fmpm{.order = 4});
    write_case<3, Fmpm, MlsForce>(root, "3d_fmpm_sparse", {0.15, 1.0 / 64, 1.0 / 32}, "step_sorted", 50, soft, 3e-3,
                                  scenes::rough_walls<3>(), {}, wgsl::GridStorage::sparse, Fmpm{.order = 2});
#if defined(FIRN_TEST_ALL)
    write_case<3, Fmpm, MlsForce>(root, "3d_fmpm_mirrored", {0.25, 1.0 / 32, 1.0 / 16, 0}, "step", 3, stiff, 0,
                                  scenes::mirrored_walls<3>(), {}, wgsl::GridStorage::dense, Fmpm{.order = 3});
#endif
}

/// The largest signal speed of the particles [m/s].
template <class Simulation>
float largest_signal_speed(const Simulation& simulation) {
    const auto& particles = simulation.particles();
    const float h = float(simulation.domain().cell_size);
    float fastest = 0;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot))
            fastest =
                std::max(fastest, signal_speed(simulation.material(), particles.velocity(slot), particles.mass(slot),
                                               particles.volume(slot), particles.state(slot), h));
    return fastest;
}

/// Snow whose strength varies, an obstacle in its way, and steps that the program takes at their bound, which rises and
/// falls.
void write_bounded(const std::filesystem::path& root) {
    using Snow = PerParticle<firn::Snow<float>, "mu", "lambda", "lowest_stretch", "highest_stretch">;
    Collider<Box<float, 3>> wall{.shape = {{0.05F, 0.4F, 0.3F}}, .contact = Contact::separate, .friction = 0.3};
    wall.position = {0.45, 0.4, 0.5};
    scenes::MovingBlocks<3, Apic, MlsForce, Snow, QuadraticBSpline, Together<Walls<float, 3>, Collider<Box<float, 3>>>>
        blocks({0.25, 1.0 / 32, 1.0 / 16}, Snow{}, Together(scenes::rough_walls<3>(), wall));
    auto& simulation = blocks.simulation;
    simulation.warn = {};  // the bound in 32 bits may be above that in 64
    auto& changed = simulation.edit_particles();
    for (std::size_t slot = 0; slot < changed.slots(); ++slot) {
        if (!changed.is_particle(slot)) continue;
        auto state = changed.state(slot);
        firn::of<"mu">(state) *= float(0.5 + scenes::noise(slot));
        firn::of<"highest_stretch">(state) = 1 + 0.01F * float(scenes::noise(slot + 1));
        changed.set_state(slot, state);
    }
    simulation.partition();
    const wgsl::Program& program = blocks.program;
    wgsl::Inputs inputs = blocks.inputs();
    inputs.set("time_step", {1});  // far too long
    inputs.set("bound_time_step", {1});
    Case files(root / "3d_bounded", program);
    std::vector<Expectation> expectations;
    float slowest = 1, fastest = 0, time = 0;
    constexpr int steps = 30;
    for (int i = 0; i < steps; ++i) {
        const float dt =
            stable_time_step<QuadraticBSpline>(float(blocks.domain.cell_size), largest_signal_speed(simulation));
        slowest = std::min(slowest, dt);
        fastest = std::max(fastest, dt);
        time += dt;
        simulation.fixed_time_step = double(dt);
        if (i == 0) {
            const auto sums = scenes::node_sums<QuadraticBSpline, Apic, MlsForce>(simulation, inputs.nodes);
            expectations.push_back({"nodes", "p2g", 1, files.file("nodes_1", sums), 0});
        }
        simulation.step();
        if (i == 0)
            for (const auto& [buffer, numbers] : blocks.inputs().buffers)
                if (buffer != "constants" && buffer != "coordinates")
                    expectations.push_back({buffer, "step", 1, files.file(buffer + "_1", numbers), 0});
    }
    if (!(fastest > 1.02F * slowest)) throw usage_error("The bound of the bounded case is always the same.");
    expectations.push_back({"time", "step", steps, files.file("time", std::vector<float>{time}), 1e-5});
    write_case_file<3>(files, program, inputs, "step", steps, expectations);
    std::cout << "3d_bounded: " << inputs.particles << " particles, steps of " << slowest << " to " << fastest
              << " s\n";
}

/// Matter that is so soft that gravity bounds the steps that the program takes.
void write_falling(const std::filesystem::path& root) {
    scenes::MovingBlocks<2, Apic, MlsForce, FixedCorotated<float>> blocks(
        {0.3, 1.0 / 64, 1.0 / 32}, FixedCorotated<float>::from_young_poisson(1, 0.3));
    auto& simulation = blocks.simulation;
    simulation.warn = {};
    auto& changed = simulation.edit_particles();
    for (std::size_t slot = 0; slot < changed.slots(); ++slot)
        if (changed.is_particle(slot)) changed.set_velocity(slot, changed.velocity(slot) * 0.1F);
    simulation.partition();
    wgsl::Inputs inputs = blocks.inputs();
    inputs.set("time_step", {1});  // far too long
    inputs.set("bound_time_step", {1});
    Case files(root / "2d_falling", blocks.program);
    const float h = float(blocks.domain.cell_size);
    float time = 0;
    constexpr int steps = 3;
    for (int i = 0; i < steps; ++i) {
        const float of_gravity = acceleration_time_step(h, float(norm(simulation.gravity)));
        if (!(of_gravity < stable_time_step<QuadraticBSpline>(h, largest_signal_speed(simulation))))
            throw usage_error("Gravity does not bound the steps of the falling case.");
        time += of_gravity;
        simulation.fixed_time_step = double(of_gravity);
        simulation.step();
    }
    write_case_file<2>(files, blocks.program, inputs, "step", steps,
                       {{"time", "step", steps, files.file("time", std::vector<float>{time}), 1e-5}});
    std::cout << "2d_falling: " << inputs.particles << " particles, " << time << " s\n";
}

/// An advance of the program by itself: its last step is shortened, and those that the host still begins do nothing.
void write_arriving(const std::filesystem::path& root) {
    scenes::MovingBlocks<2, Apic, MlsForce, FixedCorotated<float>> blocks(
        {0.2, 1.0 / 100, 1.0 / 50}, FixedCorotated<float>::from_young_poisson(1e5, 0.3));
    auto& simulation = blocks.simulation;
    wgsl::Inputs inputs = blocks.inputs();
    simulation.fixed_time_step = 0;
    simulation.execution.float_steps = true;
    const double duration = 7.3 * simulation.stable_time_step();
    const TimeLeft<float> left = time_left(duration);
    std::vector<float> status(std::size_t(blocks.program.buffer("status").count));
    status.at(wgsl::detail::time_left_word) = left.high;
    status.at(wgsl::detail::time_left_word + 1) = left.low;
    inputs.buffers.emplace_back("status", status);
    inputs.set("time_step", {1});  // far too long
    inputs.set("bound_time_step", {2});
    Case files(root / "2d_arriving", blocks.program);
    simulation.advance(duration);
    const std::uint64_t steps = simulation.steps() - 10;
    const std::vector<float> last{float(simulation.last_time_step())};
    simulation.fixed_time_step = 1;  // for the inputs, which have one
    std::vector<Expectation> expectations{
        {"time", "step", int(steps), files.file("time", std::vector{float(duration)}), 1e-7},
        {"time_step", "step", int(steps), files.file("time_step", last), 1e-7},
        {"time_left", "step", int(steps), files.file("time_left", std::vector{0.0F}), 0},
        {"steps", "step", int(steps) + 5, files.file("steps", std::vector{float(steps)}), 0}};
    for (const auto& [buffer, numbers] : blocks.inputs().buffers)
        if (buffer == "motion") {
            expectations.push_back({buffer, "step", int(steps), files.file("motion_then", numbers), 0});
            expectations.push_back({buffer, "step", int(steps) + 5, "motion_then.bin", 0});
        }
    write_case_file<2>(files, blocks.program, inputs, "step", int(steps) + 5, expectations);
    std::cout << "2d_arriving: " << inputs.particles << " particles, " << steps << " steps\n";
}

/// Materials in three dimensions, of simulations in two.
void write_plane_strain(const std::filesystem::path& root) {
    const scenes::Matter matter{0.3, 1.0 / 64, 1.0 / 32};
    write_case<2, Apic, MlsForce>(root, "2d_plane_strain_sand", matter, "step", 50,
                                  PlaneStrain<Sand<float>>{Sand<float>::from_properties({})});
    write_case<2, Pic, WeightGradientForce>(root, "2d_plane_strain_mises", matter, "step_sorted", 50,
                                            PlaneStrain<VonMises<float>>{});
    write_case<2, Apic, MlsForce, PlaneStrain<FixedCorotated<float>>, QuadraticBSpline, Walls<float, 2>, VolumeFilter>(
        root, "2d_plane_strain_filtered", matter, "step", 4, {FixedCorotated<float>::from_young_poisson(1e5, 0.3)}, 0,
        scenes::rough_walls<2>(), {.every = 2});
}

/// Materials that ask for the surroundings of particles. In steps of a power of two, sums of them are the CPU's.
void write_asking(const std::filesystem::path& root) {
    using scenes::Graded, scenes::GradedSand;
    const scenes::Matter in_plane{0.3, 1.0 / 64, 1.0 / 32}, in_space{0.25, 1.0 / 32, 1.0 / 16};
    constexpr double dt = 0x1p-13;  // [s]
    write_case<2, Apic, MlsForce>(root, "2d_asking", in_plane, "step", 50, Graded<float>{}, dt);
    write_case<3, Flip<>, WeightGradientForce>(root, "3d_asking", in_space, "step_sorted", 20, Graded<float>{}, dt);
    write_case<2, Apic, MlsForce>(root, "2d_asking_sand", in_plane, "step", 50, GradedSand<float>{}, dt);
    write_case<2, Aflip<>, MlsForce, PlaneStrain<GradedSand<float>>, QuadraticBSpline, Walls<float, 2>, FBar>(
        root, "2d_asking_plane_strain", in_plane, "step", 20, {}, dt);
    write_case<2, Apic, MlsForce, Graded<float>, QuadraticBSpline, Walls<float, 2>, VolumeFilter>(
        root, "2d_asking_filtered", in_plane, "step", 20, {}, dt, scenes::rough_walls<2>(), {.every = 2});
}

/// For the page, whose pointer pulls: where the CPU has the centre of mass after a hundred steps.
void write_page_case(const std::filesystem::path& root) {
    scenes::MovingBlocks<3, Apic, MlsForce, FixedCorotated<float>> blocks(
        {0.25, 1.0 / 32, 1.0 / 16}, FixedCorotated<float>::from_young_poisson(1e5, 0.3));
    auto& simulation = blocks.simulation;
    const wgsl::Program program = wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 3>(
        simulation.material(), simulation.boundary, Attraction<float, 3>{cast<float>(simulation.gravity)});
    Case files(root / "3d_page", program);
    write_case_file<3>(files, program,
                       wgsl::make_inputs<3>(program, blocks.domain, simulation.particles(), simulation.fixed_time_step),
                       "step", 1, {});
    constexpr int steps = 100;
    for (int i = 0; i < steps; ++i) simulation.step();
    const auto& particles = simulation.particles();
    Vec<double, 3> sum{};
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) sum += particles.exact_position(slot);
    Json json;
    json.object([&] {
        json.field("steps", steps).field("tolerance", 1e-6);  // [m]
        json.key("centre_of_mass").array(sum.v, [&](double x) { json.value(x / double(particles.size())); });
    });
    files.write("page.json", json.text());
}

/// What must not go on: the program says why, and particles stay as they are where nothing could be computed.
void write_errors(const std::filesystem::path& root) {
    Domain<2> domain;
    domain.cell_size = 1.0 / 32;
    Simulation<2> simulation(domain);
    simulation.gravity = {};
    simulation.add(sample_box<2>({0.7, 0.3}, {0.98, 0.6}, {.spacing = 1.0 / 64}), 1000, {1, 0});
    simulation.partition();
    const double dt = 1e-4;
    const wgsl::Program program =
        wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 2>(simulation.material(), simulation.boundary);
    const auto write = [&](const char* name, int error, bool unchanged, const auto& change) {
        wgsl::Inputs inputs = wgsl::make_inputs<2>(program, domain, simulation.particles(), dt);
        std::vector<float>& motion = inputs.buffers.front().second;
        change(inputs, motion.data() + 4 * inputs.particles);
        Case files(root / name, program);
        std::vector<Expectation> expectations;
        if (unchanged) expectations.push_back({"motion", "step", 3, files.file("unchanged", motion), 0});
        write_case_file<2>(files, program, inputs, "step", 3, expectations, error);
    };
    write("error_not_finite", 1, true, [](wgsl::Inputs&, float* velocity) { velocity[5] = std::nanf(""); });
    write("error_too_fast", 4, false, [](wgsl::Inputs&, float* velocity) { velocity[5] = 1e38F; });
    write("error_scale", 3, true, [](wgsl::Inputs& inputs, float*) { inputs.set("momentum_scale", {0x1p40}); });
    write("error_left", 5, false, [&](wgsl::Inputs& inputs, float* velocity) {
        std::fill_n(velocity, inputs.particles, float(10 * domain.cell_size / dt));  // ten cells a step, into the wall
    });
    const wgsl::Program sparse = wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 2>(
        simulation.material(), simulation.boundary, Gravity<float, 2>{}, OwnVolume{},
        {.grid = wgsl::GridStorage::sparse});
    const wgsl::Inputs inputs = wgsl::make_inputs<2>(sparse, domain, simulation.particles(), dt, {}, 5);
    Case files(root / "error_blocks", sparse);
    write_case_file<2>(files, sparse, inputs, "step", 3,
                       {{"motion", "step", 3, files.file("unchanged", inputs.buffers.front().second), 0}}, 7);
}

/// A program with one mistake each. Both compilers refuse those in every/; naga lets those in tint/ pass.
void write_broken(const std::filesystem::path& root) {
    struct Mistake {
        const char *file, *right, *wrong;
    };
    constexpr Mistake mistakes[] = {
        {"every/undeclared.wgsl", "base_node_of(place)", "base_nodes_of(place)"},
        {"every/type.wgsl", "bitcast<u32>(load.mass)", "load.mass"},
        {"every/semicolon.wgsl", "workgroupBarrier();", "workgroupBarrier()"},
        {"every/no_binding.wgsl", "@group(0) @binding(7) ", ""},
        {"tint/plain_add.wgsl", "atomicAdd(&node_sums[4u * node + c], q[c]);", "node_sums[4u * node + c] += q[c];"},
        {"tint/barrier_in_a_branch.wgsl", "    workgroupBarrier();\n    if (local < 3u)",
         "    if (i < 7u) { workgroupBarrier(); }\n    if (local < 3u)"},
        {"tint/bare_read.wgsl", "atomicLoad(&status[0]) != 0u", "status[0] != 0u"}};
    const std::string good = wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 3>(
                                 FixedCorotated<float>{}, Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {}))
                                 .code;
    for (const auto& [file, right, wrong] : mistakes) {
        std::string code = good;
        const std::size_t at = code.find(right);
        if (at == std::string::npos) throw usage_error(sentence("No program has '", right, "' any more."));
        code.replace(at, std::string_view(right).size(), wrong);
        std::filesystem::create_directories((root / file).parent_path());
        std::ofstream out(root / file);
        out << code;
        if (!out.flush()) throw io_error("Cannot write " + (root / file).string());
    }
}

}  // namespace

int main(int count, char** words) {
    try {
        if (count < 2) throw usage_error("firn_wgsl_cases FOLDER [--large] [--exact]");
        const auto is_given = [&](std::string_view option) {
            return std::any_of(words + 2, words + count, [&](const char* word) { return word == option; });
        };
        if (is_given("--exact")) scenes::arithmetic = wgsl::Arithmetic::exact;
        write_broken(std::filesystem::path(words[1]) / "broken");
        const std::filesystem::path root = std::filesystem::path(words[1]) / "cases";
        write_errors(root);
        write_page_case(root);
        // Seven cells in fifty steps: places are counted from other blocks, by all particles at once.
        write_case<2, Apic, MlsForce>(root, "2d_drift", {0.3, 1.0 / 64, 1.0 / 32}, "step_sorted", 50,
                                      FixedCorotated<float>::from_young_poisson(2e3, 0.3), 3e-3);
        // Each transfer with each force in each dimension: of the elastic material where all is tested, else of others
        // below, which are as good for it.
        write_both_dimensions<Apic, MlsForce>(root, "apic_mls");
#if defined(FIRN_TEST_ALL)
        write_both_dimensions<Pic, MlsForce>(root, "pic_mls");
        write_both_dimensions<Apic, WeightGradientForce>(root, "apic_weight_gradient");
        write_both_dimensions<Pic, WeightGradientForce>(root, "pic_weight_gradient");
#endif
        write_case<2, Apic, MlsForce>(root, "2d_sorted", {0.3, 1.0 / 64, 1.0 / 32}, "step_sorted", 50);
        write_case<3, Apic, MlsForce>(root, "3d_sorted", {0.25, 1.0 / 32, 1.0 / 16}, "step_sorted", 50);
        using Elastic = FixedCorotated<float>;
        write_case<2, Apic, WeightGradientForce, Elastic, Linear>(root, "2d_linear", {0.3, 1.0 / 64, 1.0 / 32}, "step",
                                                                  50);
        write_case<3, Pic, WeightGradientForce, Elastic, Linear>(root, "3d_linear_sorted", {0.25, 1.0 / 32, 1.0 / 16},
                                                                 "step_sorted", 50);
        write_case<2, Apic, WeightGradientForce, Elastic, CubicBSpline>(root, "2d_cubic_sorted",
                                                                        {0.3, 1.0 / 64, 1.0 / 32}, "step_sorted", 50);
        write_case<3, Apic, MlsForce, Elastic, CubicBSpline>(root, "3d_cubic", {0.25, 1.0 / 32, 1.0 / 16}, "step", 50);
        write_case<3, Apic, MlsForce, Elastic, CubicBSpline>(root, "3d_cubic_sorted", {0.25, 1.0 / 32, 1.0 / 16},
                                                             "step_sorted", 50);
        write_case<2, Apic, WeightGradientForce, Elastic, CompactQuartic>(root, "2d_compact_quartic",
                                                                          {0.3, 1.0 / 64, 1.0 / 32}, "step", 50);
        write_case<2, Apic, MlsForce>(root, "2d_periodic", {0.15, 1.0 / 128, 1.0 / 64, 0.02, true}, "step", 50,
                                      FixedCorotated<float>::from_young_poisson(1e3, 0.3), 3e-3,
                                      scenes::walls_across_first_axis<2>(), OwnVolume{}, wgsl::GridStorage::sparse);
        write_case<3, Apic, WeightGradientForce>(root, "3d_periodic", {0.2, 1.0 / 32, 1.0 / 16, 0.03, true},
                                                 "step_sorted", 50, FixedCorotated<float>::from_young_poisson(1e3, 0.3),
                                                 3e-3, scenes::walls_across_first_axis<3>(), OwnVolume{},
                                                 wgsl::GridStorage::sparse);
        write_case<2, Apic, MlsForce>(root, "2d_sparse", {0.15, 1.0 / 128, 1.0 / 64}, "step", 50,
                                      FixedCorotated<float>::from_young_poisson(2e3, 0.3), 3e-3,
                                      scenes::rough_walls<2>(), OwnVolume{}, wgsl::GridStorage::sparse);
        const SoftTissue<float> own{.mu = 4e4F, .lambda = 6e4F};
        write_case<2, Pic, MlsForce>(root, "2d_own_material", {0.3, 1.0 / 64, 1.0 / 32}, "step", 50, own);
        write_case<3, Apic, WeightGradientForce>(root, "3d_own_material", {0.25, 1.0 / 32, 1.0 / 16}, "step", 50, own);
        const EigenNeoHookean<float> of_eigen{.mu = 4e4F, .lambda = 6e4F};
        write_case<2, Apic, WeightGradientForce>(root, "2d_eigen_material", {0.3, 1.0 / 64, 1.0 / 32}, "step", 50,
                                                 of_eigen);
        write_case<3, Apic, MlsForce>(root, "3d_eigen_material", {0.25, 1.0 / 32, 1.0 / 16}, "step", 50, of_eigen);
        write_case<2, Pic, WeightGradientForce>(root, "2d_snow", {0.3, 1.0 / 64, 1.0 / 32}, "step", 50, Snow<float>{});
        write_case<3, Pic, WeightGradientForce>(root, "3d_snow", {0.25, 1.0 / 32, 1.0 / 16}, "step", 50, Snow<float>{});
        write_case<3, Apic, MlsForce>(root, "3d_sand", {0.25, 1.0 / 32, 1.0 / 16}, "step", 50,
                                      Sand<float>::from_properties({.hardening = degrees(9), .hardening_decay = 0.2}));
        const auto honey = Fluid<float>::from_properties({.viscosity = 5});
        write_case<2, Apic, MlsForce>(root, "2d_fluid", {0.3, 1.0 / 64, 1.0 / 32}, "step", 50, honey);
        write_case<3, Pic, MlsForce>(root, "3d_fluid", {0.25, 1.0 / 32, 1.0 / 16}, "step", 50, honey);
        write_corners(root);
        write_mirrored(root);
        write_averaged(root);
        write_filtered(root);
        write_blended(root);
        write_refined(root);
        write_distances(root);
        write_solids<2>(root, {0.3, 1.0 / 64, 1.0 / 32});
        write_solids<3>(root, {0.25, 1.0 / 32, 1.0 / 16});
        write_case<3, Apic, MlsForce>(root, "3d_nacc", {0.25, 1.0 / 32, 1.0 / 16}, "step", 50, Nacc<float>{});
        write_case<3, Apic, MlsForce>(root, "3d_modified_cam_clay", {0.25, 1.0 / 32, 1.0 / 16}, "step", 50,
                                      ModifiedCamClay<float>::from_properties({.compression = 1.2, .swelling = 0.6}));
        PerParticle<FixedCorotated<float>, "mu"> varied{};
        varied.mu = 4e4F;
        varied.lambda = 6e4F;
        write_case<2, Apic, MlsForce>(root, "2d_per_particle", {0.3, 1.0 / 64, 1.0 / 32}, "step", 50, varied);
        write_bounded(root);
        write_plane_strain(root);
        write_asking(root);
        write_falling(root);
        write_arriving(root);
        write_case<2, Apic, MlsForce>(root, "2d_mises", {0.3, 1.0 / 64, 1.0 / 32}, "step", 50, VonMises<float>{});
        write_case<3, Apic, MlsForce>(root, "3d_mohr_coulomb", {0.25, 1.0 / 32, 1.0 / 16}, "step", 50,
                                      MohrCoulomb<float>::from_properties(
                                          {.young = 1e5, .cohesion = 500, .tension = 300, .softening_strain = 0.1}));
        write_case<2, Apic, MlsForce>(root, "2d_10k", {0.35, 1.0 / 204, 1.0 / 102}, "step", 1);
        write_case<3, Apic, MlsForce>(root, "3d_10k", {0.3, 1.0 / 57, 1.0 / 28.5}, "step", 1);
        write_case<3, Apic, MlsForce>(root, "3d_10k_sorted", {0.3, 1.0 / 57, 1.0 / 28.5}, "step_sorted", 1);
        scenes::arithmetic = wgsl::Arithmetic::exact;
        write_case<2, Apic, MlsForce>(root, "2d_exact", {0.3, 1.0 / 64, 1.0 / 32}, "step", 50);
        write_case<2, Pic, WeightGradientForce>(root, "2d_exact_sand", {0.3, 1.0 / 64, 1.0 / 32}, "step", 50,
                                                Sand<float>::from_properties({}));
        if (is_given("--large")) {
            write_case<2, Apic, MlsForce>(root, "2d_100k", {0.35, 1.0 / 640, 1.0 / 320}, "step", 1);
            write_case<3, Apic, MlsForce>(root, "3d_100k", {0.3, 1.0 / 123, 1.0 / 61.5}, "step", 1);
            write_case<3, Apic, MlsForce>(root, "3d_100k_sorted", {0.3, 1.0 / 123, 1.0 / 61.5}, "step_sorted", 1);
        }
    } catch (const std::exception& e) {
        std::cerr << e.what() << '\n';
        return 1;
    }
}
