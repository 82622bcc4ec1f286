/// \file What firn::webgpu::on_gpu() promises, on a device without contraction (see firn_swiftshader in
/// cmake/webgpu.sh): a run on the device is a run on the CPU to the bit, and goes from one to the other; what cannot be
/// done is refused in a sentence. Closes with "N passed, M failed".
#include <firn/io/restart.hpp>
#include <firn/webgpu/on_gpu.hpp>
#include <firn/webgpu/pass_times.hpp>

#include "on_gpu_checks.hpp"
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>

namespace {

using namespace firn;
using namespace checks;
using scenes::Integers;

auto mirrored() {
    return made<2>(Snow<float>{}, 1.0 / 30, 1e-4, Pic{}, WeightGradientForce{}, CubicBSpline{},
                   scenes::mirrored_walls<2>(), FBar{});
}

/// A ball of water in the far corner of a domain of 4096^3 cells, whose nodes no device could store.
void in_a_far_corner(const webgpu::Device& device) {
    Domain<3> domain;
    domain.cell_size = 1.0 / 32;
    domain.upper = Vec<double, 3>::filled(128);
    auto far = Simulation(domain, Fluid<float>{}, Integers{},
                          Walls<float, 3>::all({0, 0, 0}, {128, 128, 128}, {Contact::separate, 0.3}));
    far.warn = {};
    far.fixed_time_step = 1e-4;
    far.add(sample_sphere<3>({127.7, 127.7, 127.7}, 0.15, {.spacing = 1.0 / 50}), 1000, {20, 30, 10});
    compare("a far corner", bounded(std::move(far)), 40, 1, device);
}

void runs_are_the_cpus() {
    compare("thrown", thrown(), 200, 3);
    compare("thrown, in steps at their bound", bounded(thrown()), 60, 2);
    auto hit = bounded(thrown());
    std::get<1>(hit.boundary.parts).linear_velocity = {40, 0};
    compare("a collider that bounds the steps", std::move(hit), 20, 1);
    auto due = thrown();
    while (!due.report().sort_needed) due.step();
    compare("from where the next step sorts", std::move(due), 8, 1);
    {
        auto snow = mirrored();
        add_block<2>(snow, 1.0 / 60, {3, -5});
        compare("snow", std::move(snow), 80);
    }
    {
        auto water = made<2>(Fluid<float>::from_properties({.viscosity = 5}), 1.0 / 30, 1e-4,
                             VolumeFilter{.every = 3, .shifting = 20});
        water.most_steps_between_sorts = 7;
        add_block<2>(water, 1.0 / 70, {8, -6});
        for (int k = 0; k < 4; ++k) water.step();  // the filter counts these
        compare("water", water, 80);
        compare("water, in steps at their bound", bounded(std::move(water)), 40);
    }
    {
        auto filtered = made<2>(Fluid<float>{}, 1.0 / 80, 1e-4, VolumeFilter{.every = 2, .shifting = 0});
        add_block<2>(filtered, 1.0 / 160, {8, -6});
        compare("water on a sparse grid, filtered", std::move(filtered), 30);
        auto averaged = made<2>(Fluid<float>{}, 1.0 / 80, 1e-4, FBar{});
        add_block<2>(averaged, 1.0 / 160, {8, -6});
        compare("water on a sparse grid, averaged", std::move(averaged), 30);
    }
    {
        using Varied = PerParticle<Sand<float>, "mu", "lambda">;
        auto sand = made<2>(Varied{}, 1.0 / 30, 2e-4, scenes::rough_walls<2>());
        add_block<2>(sand, 1.0 / 60, {2, -4});
        compare("sand", std::move(sand), 60);
    }
    {
        // Its program is the shortest in 3D: a software GPU takes long to compile others.
        auto splash = made<3>(Fluid<float>{}, 1.0 / 20, 1e-4, scenes::rough_walls<3>());
        add_block<3>(splash, 1.0 / 30, {20, -40, 10});
        const webgpu::Device device;
        compare("splash", bounded(std::move(splash)), 60, 2, device);
        in_a_far_corner(device);
    }
}

/// Colliders with distances in a buffer: of a mesh that moves; and beside several materials, of another grid later.
void grids_of_distances(const webgpu::Device& device) {
    auto ramp = scenes::ramp();
    ramp.linear_velocity = {0.5, 4, -0.25};
    ramp.angular_velocity = {1, -2, 3};
    auto splash = made<3>(Fluid<float>{}, 1.0 / 20, 1e-4, ramp);
    add_block<3>(splash, 1.0 / 30, {4, -20, 2});
    compare("a mesh that moves", splash, 60, 2, device);
    compare("a mesh that moves, in steps at their bound", bounded(std::move(splash)), 30, 1, device);

    auto block = made<2>(FixedCorotated<float>::from_young_poisson(2e4, 0.3), 1.0 / 50, 4e-4,
                         Together(scenes::rough_walls<2>(), scenes::lump()));
    std::get<1>(block.boundary.parts).linear_velocity = {0.3, 0.5};
    block.add(sample_box<2>({0.25, 0.5}, {0.5, 0.7}, {.spacing = 1.0 / 90}), 1000, {1, -2});
    compare("a grid of distances, as on hardware", std::move(block), 60, 1,
            webgpu::Device({.arithmetic = wgsl::Arithmetic::exact, .sums_by_block = true}));

    using Water = Fluid<float>;
    using Jelly = FixedCorotated<float>;
    auto fixed = made<2>(Materials<Water, Jelly>({}, Jelly::from_young_poisson(5e4, 0.3)), 1.0 / 120, 1e-4,
                         Together(scenes::rough_walls<2>(), scenes::lump()));
    std::get<1>(fixed.boundary.parts).linear_velocity = {0.3, 0.5};
    std::get<1>(fixed.boundary.parts).angular_velocity = 2;
    fixed.template set<Water>().add(sample_box<2>({0.3, 0.52}, {0.4, 0.6}, {.spacing = 1.0 / 240}), 1000, {3, -9});
    fixed.template set<Jelly>().add(sample_box<2>({0.42, 0.52}, {0.5, 0.6}, {.spacing = 1.0 / 240}), 2000, {-3, -9});
    for (const bool at_bound : {false, true}) {
        auto cpu = at_bound ? bounded(fixed) : fixed;
        auto gpu = webgpu::on_gpu(cpu, device);
        const std::string name = sentence("two materials on a grid of distances", at_bound ? ", bounded: " : ": ");
        check(gpu.blocks() > 0, name + "the nodes are sparse");
        const auto compare_after = [&](const std::string& part, int steps, const auto& change) {
            change(std::get<1>(cpu.boundary.parts).shape), change(std::get<1>(gpu.edit().boundary.parts).shape);
            const std::uint64_t before = cpu.steps();
            const double duration = (steps - 0.5) * fixed.fixed_time_step;
            cpu.advance(duration), gpu.advance(duration);
            check(cpu.steps() > before, name + part + "steps are taken");
            check_same_state(name + part + "water, ", state_of(cpu.template set<Water>()),
                             gpu.template state_of_set<Water>());
            check_same_state(name + part + "jelly, ", state_of(cpu.template set<Jelly>()),
                             gpu.template state_of_set<Jelly>());
        };
        const auto lump_of = [](double radius, double spacing = 0.03) {
            return [=](auto& shape) { shape = scenes::lump(radius, spacing).shape; };
        };
        compare_after("", 60, [](const auto&) {});
        compare_after("other distances, ", 60, lump_of(0.12));
        compare_after("others, ", 4, lump_of(0.13));
        compare_after("others soon, ", 4, lump_of(0.15));  // in the same buffers
        compare_after("more distances, ", 30, lump_of(0.16, 0.02));
    }
}

/// Blocks of the grid are found where particles are, and memory for them is made.
void sparse_grids() {
    const auto burst = [] {
        auto simulation = made<2>(Fluid<float>{}, 1.0 / 160, 5e-5, scenes::rough_walls<2>());
        simulation.add(sample_box<2>({0.46, 0.46}, {0.54, 0.54}, {.spacing = 1.0 / 320}), 1000);
        auto& particles = simulation.edit_particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot))
                particles.set_velocity(slot,
                                       400.0F * cast<float>(particles.exact_position(slot) - Vec<double, 2>{0.5, 0.5}));
        return simulation;
    };
    const webgpu::Device device;
    for (const bool at_bound : {false, true}) {
        auto cpu = at_bound ? bounded(burst()) : burst();
        auto gpu = webgpu::on_gpu(cpu, device);
        const std::size_t before = gpu.blocks();
        const std::string name = at_bound ? "a burst, in steps at their bound: " : "a burst: ";
        for (int k = 0; k < 150 && !at_bound; ++k) cpu.step(), gpu.step();
        cpu.advance(0.00513), gpu.advance(0.00513);  // ends in a step that was taken again, and shortened
        check_same_run(name, cpu, gpu);
        check(before > 0 && gpu.blocks() >= 4 * before, name + "the grid grows",
              sentence(before, " blocks, then ", gpu.blocks()));
    }
    auto cpu = burst();
    auto gpu = webgpu::on_gpu(cpu, webgpu::Device({.at_most = {16 << 10, 16 << 10, 64, 8}}));
    check_throws<parameter_error>("no room for the blocks of a burst", {"'nodes'", "1024 nodes fit"}, [&] {
        for (int k = 0; k < 400; ++k) gpu.step();
        gpu.advance(0);
    });
    check(gpu.steps() > 10 && gpu.steps() < 400, "steps are taken until then", sentence(gpu.steps()));
    while (cpu.steps() < gpu.steps()) cpu.step();
    check_same_run("no room for more blocks: ", cpu, gpu);
}

/// Mirrored walls where blocks of the grid are found: in the far corner of a domain of 4096^2 cells, whose nodes would
/// take 268 MB each time; and on a ring.
void mirrored_walls_where_particles_are() {
    const auto into_corner = [](const auto& transfer, const auto&... policies) {
        Domain<2> domain;
        domain.cell_size = 1.0 / 32;
        domain.upper = {128, 128};
        auto walls = Walls<float, 2>::all({0, 0}, {128, 128}, {Contact::separate, 0.3});
        walls.at_upper[1] = Wall{Contact::slip, 0.2};
        walls.nodes_behind = NodesBehind::mirrored;
        Simulation far(domain, Fluid<float>{}, Integers{}, walls, transfer, policies...);
        far.warn = {};
        far.fixed_time_step = 2e-4;
        far.add(sample_box<2>({127.4, 127.5}, {127.9, 127.9}, {.spacing = 1.0 / 64}), 1000, {20, 30});
        far.add(sample_box<2>({0, 60}, {0.25, 60.25}, {.spacing = 1.0 / 64}), 1000, {-5, 3});
        return far;
    };
    const webgpu::Device device, hardware({.arithmetic = wgsl::Arithmetic::exact, .sums_by_block = true});
    const auto flip = into_corner(Flip{});
    check(webgpu::on_gpu(flip, device).blocks() > 0, "mirrored walls do not need all nodes");
    compare("a far corner of mirrored walls, blended", flip, 60, 2, device);
    compare("a far corner of mirrored walls, as on hardware", bounded(flip), 40, 1, hardware);
    compare("a far corner of mirrored walls, refined", into_corner(Fmpm{.order = 3}, FBar{}), 60, 1, device);

    Domain<2> ring;
    ring.cell_size = 1.0 / 48;
    ring.periodic[0] = true;
    auto walls = scenes::mirrored_walls<2>();
    walls.at_lower[0] = walls.at_upper[0] = {};
    Simulation turning(ring, FixedCorotated<float>::from_young_poisson(2e4, 0.3), Integers{}, walls);
    turning.warn = {};
    turning.fixed_time_step = 4e-4;
    turning.add(sample_box<2>({0.7, 0.02}, {0.95, 0.3}, {.spacing = 0.01}), 1000, {6, -3});
    turning.add(sample_box<2>({0.05, 0.7}, {0.3, 1}, {.spacing = 0.01}), 1000, {-5, 2});
    compare("mirrored walls along a ring", turning, 100, 2, device);
    turning.reactions.emplace();
    compare("mirrored walls along a ring, with reactions", turning, 20, 1, device);
}

/// Matter that leaves periodic domains at one end and comes in at the other, into other matter and a sink.
void periodic_domains() {
    const auto domain = [](auto unit, double cell_size) {
        unit.cell_size = cell_size;
        unit.periodic.fill(true);
        return unit;
    };
    Domain<2> ring = domain(Domain<2>{}, 1.0 / 48);
    ring.periodic[1] = false;
    auto walls = scenes::rough_walls<2>();
    walls.at_lower[0] = walls.at_upper[0] = {};
    Collider<Sphere<float, 2>> ball{.shape = {0.1F}, .contact = Contact::separate, .friction = 0.2};
    ball.position = {0.5, 0.2};
    ball.linear_velocity = {0.3, 0.1};
    Simulation round(ring, FixedCorotated<float>::from_young_poisson(2e4, 0.3), Integers{}, Together(walls, ball));
    round.warn = {};
    round.fixed_time_step = 4e-4;
    round.add(sample_box<2>({0.7, 0.3}, {0.95, 0.6}, {.spacing = 0.01}), 1000, {6, -2});
    round.add(sample_box<2>({0.05, 0.1}, {0.3, 0.4}, {.spacing = 0.01}), 1000, {-5, 0});
    round.add_sink({.lower = {0, 0.4}, .upper = {0.005, 0.6}});  // at the end, above the second body
    auto cpu = round;
    cpu.advance(0.04);
    check(cpu.particles().size() > 1000 && cpu.particles().size() < 1450, "a sink takes some of what has come round",
          sentence(cpu.particles().size(), " of 1500 particles are left"));
    compare("a ring", round, 100);
    compare("a ring, in steps at their bound", bounded(round), 60);
    compare("a ring, as on hardware", round, 60, 1,
            webgpu::Device({.arithmetic = wgsl::Arithmetic::exact, .sums_by_block = true}));

    Simulation everywhere(domain(Domain<3>{}, 1.0 / 16), Fluid<float>{}, Integers{}, FBar{});
    everywhere.warn = {};
    everywhere.gravity = {};
    everywhere.add(sample_box<3>({0.6, 0.1, 0.6}, {0.9, 0.4, 0.9}, {.spacing = 1.0 / 32}), 1000, {9, -11, 10});
    compare("water goes round a domain without ends", bounded(std::move(everywhere)), 240);
}

/// Loads that are the same on all particles of a body push them in float, on the CPU, too.
void loads() {
    const auto pushed = [](double times) {  // by so many times the force
        auto simulation = thrown({1, 0});
        auto& ball = std::get<1>(simulation.boundary.parts);
        ball.linear_velocity = {};  // else the device gets all uniforms anew in each step
        ball.angular_velocity = 0;
        simulation.execution.float_steps = true;
        const Body first = simulation.bodies()[0],
                   later = simulation.add(sample_box<2>({0.1, 0.6}, {0.2, 0.8}, {.spacing = 1.0 / 70}), 1300);
        const auto add = [&](const Body& body, const auto& force) {
            simulation.add_load(body, UniformForce<2>([=](double time) { return times * force(time); }));
        };
        add(first, [](double time) { return Vec<double, 2>{3 * std::sin(300 * time), 2}; });
        add(later, [](double) { return Vec<double, 2>{5, 1.7}; });
        add(first, [](double time) { return Vec<double, 2>{0, time < 0.01 ? 4.0 : -7.0}; });
        return simulation;
    };
    compare("loads", pushed(1), 60);
    compare("loads, in steps that they bound", bounded(pushed(200)), 12);
    compare(
        "loads, in several chunks, as on hardware", pushed(1), 20, 1,
        webgpu::Device(
            {.arithmetic = wgsl::Arithmetic::exact, .sums_by_block = true, .at_most = {24 << 10, 24 << 10, 64, 8}}));
    auto cpu = pushed(1);
    auto gpu = webgpu::on_gpu(cpu);
    const auto step = [](auto& simulation) {
        for (int k = 0; k < 10; ++k) simulation.step();
    };
    step(cpu), step(gpu);
    gpu.edit().remove_load({0, 1}), cpu.remove_load({0, 1});
    step(cpu), step(gpu);
    check_same_run("loads, one of which is removed: ", cpu, gpu);
    step(gpu.edit()), step(cpu);
    check_same_run("loads, then on the CPU: ", cpu, gpu);
    cpu.execution.float_steps = false;
    check_throws<parameter_error>("loads in double", {"loads in float", "execution.float_steps"},
                                  [&] { webgpu::on_gpu(cpu); });
}

/// A jet whose water lives for a while, over a pool; or into an empty domain, from some time on.
void sources(const webgpu::Device& device) {
    const auto pouring = [](bool into_pool, double start) {
        auto simulation = made<2>(Fluid<float>{}, 1.0 / 50, 2e-4, scenes::rough_walls<2>());
        if (into_pool) simulation.add(sample_box<2>({0.1, 0.05}, {0.6, 0.2}, {.spacing = 0.01}), 1000);
        auto jet = Source<2>::jet(sample_box<2>({0.4, 0.7}, {0.5, 0.71}, {.spacing = 0.01}), 0.01, 1000, {2, -3});
        jet.start = start;
        jet.lifespan = 0.0127;
        simulation.add_source(std::move(jet));
        if (into_pool) {
            simulation.add_sink({.lower = {0.5, 0}, .upper = {0.55, 0.15}});  // in the pool from the beginning
            simulation.add_sink({.lower = {0.3, 0.69}, .upper = {0.7, 0.69}});
        }
        return simulation;
    };
    const auto is_same = [&](const std::string& name, auto cpu) {
        compare(name, cpu, 150, 2, device);
        compare(name + ", in steps at their bound", bounded(cpu), 80, 3, device);
    };
    is_same("a jet over a pool", pouring(true, 0));
    is_same("a jet from some time on", pouring(false, 0.0031));
    auto brief = made<2>(Fluid<float>{}, 1.0 / 50, 2e-4, scenes::rough_walls<2>());
    brief.add(sample_box<2>({0.1, 0.05}, {0.6, 0.2}, {.spacing = 0.01, .pattern = Pattern::jittered, .jitter = 0.5}),
              1000, {3, 0});
    brief.add_source({.samples = sample_box<2>({0.4, 0.7}, {0.43, 0.73}, {.spacing = 0.01}),
                      .density = 1000,
                      .velocity = {0, -3},
                      .rate = 4e4,
                      .lifespan = 1e-4});
    brief.add_sink({.lower = {0.5, 0}, .upper = {0.55, 0.15}});
    is_same("water that lives for less than a step, and a sink", std::move(brief));
    auto soft = made<2>(FixedCorotated<float>::from_young_poisson(1, 0.3), 1.0 / 50, 0.01, scenes::rough_walls<2>());
    soft.add(sample_box<2>({0.3, 0.6}, {0.5, 0.8}, {.spacing = 0.01}), 1000);
    compare("soft matter begins to fall, in steps that gravity bounds", bounded(std::move(soft)), 6, 1, device);
    auto cpu = bounded(pouring(true, 0.0005));
    auto gpu = webgpu::on_gpu(cpu, device);
    for (int k = 0; k < 40; ++k) cpu.step(), gpu.step();
    check(cpu.bodies().size() > 3, "bursts come in single steps");
    check_same_run("a jet, in single steps at their bound: ", cpu, gpu);
    const auto state = firn::state_of(gpu);
    const auto pool = cpu.bodies()[0].count;
    const auto left = std::ranges::count_if(state.id, [&](std::uint32_t id) { return id < pool; });
    check(left > 0 && std::uint32_t(left) < pool - 50, "a sink takes from the pool", sentence(left, " of ", pool));
}

/// Buffers and dispatches that are too small for all particles: there are several of each.
void small_limits() {
    const auto is_same = [](const std::string& name, auto cpu, int steps, const wgsl::Limits& limits) {
        compare(name, std::move(cpu), steps, 1, webgpu::Device({.at_most = limits}));
    };
    auto many = made<2>(FixedCorotated<float>{}, 1.0 / 200, 1e-4, scenes::rough_walls<2>());
    many.add(sample_box<2>({0.2, 0.2}, {0.8, 0.7}, {.spacing = 1.0 / 400}), 1000, {1, -2});
    check(many.particles().size() > (1 << 20) / 24, "two chunks of buffers of 1 MiB",
          sentence(many.particles().size(), " particles"));
    is_same("buffers of 1 MiB, 64 workgroups", std::move(many), 4, {1 << 20, 1 << 20, 64, 8});
    auto fine = thrown({1, -2}, 1.0 / 250);
    const webgpu::Device device({.at_most = {48 << 10, 48 << 10, 64, 8}});
    compare("several chunks", fine, 60, 2, device);
    compare("several chunks, in steps at their bound", bounded(fine), 30, 2, device);
    std::get<0>(fine.boundary.parts).at_upper[1].contact = Contact::none;
    auto& particles = fine.edit_particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot) && particles.exact_position(slot)[0] > 0.65)
            particles.set_velocity(slot, {0, 2000});
    auto gpu = webgpu::on_gpu(fine, device);
    check_throws<particle_error>("particles of the last chunk leave", {"It is particle ", "velocity (0, 2000) m/s"},
                                 [&] { gpu.advance(0.01); });
    const webgpu::Device tiny({.at_most = {4 << 10, 4 << 10, 64, 8}});
    check_throws<parameter_error>("nodes that do not fit", {"'nodes'", "maxStorageBufferBindingSize"},
                                  [&] { webgpu::on_gpu(thrown(), tiny); });
}

/// Water, sand and jelly fall on each other, beside a ball that moves; then comes snow, and more water.
void four_materials(bool at_bound, const webgpu::Device& device = webgpu::Device()) {
    using Water = Fluid<float>;
    using Jelly = FixedCorotated<float>;
    Collider<Sphere<float, 2>> ball{.shape = {0.1F}, .contact = Contact::separate, .friction = 0.2};
    ball.position = {0.5, 0.12};
    ball.linear_velocity = {0.3, 0.1};
    auto cpu =
        made<2>(Materials<Water, Sand<float>, Snow<float>, Jelly>({}, {}, {}, Jelly::from_young_poisson(5e4, 0.3)),
                1.0 / 40, 1e-4, Together(scenes::rough_walls<2>(), ball));
    const double duration = 59.5 * cpu.fixed_time_step;
    if (at_bound) cpu = bounded(cpu);
    const auto add = [](auto set, double x, double y, const Vec<double, 2>& velocity) {
        set.add(sample_box<2>({x, y}, {x + 0.2, y + 0.2}, {.spacing = 1.0 / 80}), 1000, velocity);
    };
    add(cpu.template set<Water>(), 0.2, 0.25, {9, -3});
    add(cpu.template set<Sand<float>>(), 0.42, 0.25, {1, -4});
    add(cpu.template set<Jelly>(), 0.45, 0.5, {-2, -9});
    auto gpu = webgpu::on_gpu(cpu, device);
    const std::string name = at_bound ? "four materials, in steps at their bound: " : "four materials: ";
    for (const std::string part : {"three, ", "and snow, "}) {
        if (part == "and snow, ") {
            const auto pour = [&](auto& simulation) {
                add(simulation.template set<Snow<float>>(), 0.22, 0.5, {3, -8});
                add(simulation.template set<Water>(), 0.7, 0.7, {-3, -8});
            };
            pour(cpu), pour(gpu.edit());
        }
        cpu.advance(duration);
        gpu.advance(duration);
        check(cpu.steps() >= 10 && gpu.moment() == cpu.moment(), name + part + "steps are taken");
        const auto compare = [&]<class M>(std::type_identity<M>) {
            check_same_state(name + part + M::name + ", ", state_of(cpu.template set<M>()),
                             gpu.template state_of_set<M>());
        };
        compare(std::type_identity<Water>{});
        compare(std::type_identity<Sand<float>>{});
        if (part == "and snow, ") compare(std::type_identity<Snow<float>>{});
        compare(std::type_identity<Jelly>{});
    }
}

/// A domain whose corner is not the origin, also where a float in metres has 6 cm: positions count from the corner.
void away_from_the_origin() {
    const webgpu::Device device;
    for (const auto& corner : {Vec<double, 2>{-3.7, 5.3}, Vec<double, 2>{-3.7, 5.25e5}}) {
        const std::string name = sentence("from (", corner[0], ", ", corner[1], ") m on");
        Collider<Sphere<float, 2>> ball{.shape = {0.1F}, .contact = Contact::separate, .friction = 0.2};
        ball.position = corner + Vec<double, 2>{0.5, 0.12};
        ball.linear_velocity = {0.3, 0.1};
        auto there = block_from(corner, 0.22, [&](const auto& walls) { return Together(walls, ball); });
        compare(name, there, 60, 2, device);
        compare(name + ", in steps at their bound", bounded(there), 20, 2, device);
        there.reactions = Reactions<2>{.about = corner};
        compare_reactions(name + ", reactions", there, 50, 1, device);  // walls are out of reach
    }
}

/// Programs as they are on hardware: exact, and P2G adds up in workgroup memory.
void as_on_hardware() {
    const webgpu::Device device({.arithmetic = wgsl::Arithmetic::exact, .sums_by_block = true}),
        small({.sums_by_block = true, .at_most = {48 << 10, 48 << 10, 64, 8}});
    check(device.arithmetic() == wgsl::Arithmetic::exact && device.sums_by_block(), "what is asked for is chosen");
    compare("thrown, as on hardware", thrown(), 60, 1, device);
    auto sand = made<2>(Sand<float>{}, 1.0 / 60, 1e-4);
    add_block<2>(sand, 1.0 / 120, {8, -16});
    compare("sand on a sparse grid, as on hardware", bounded(std::move(sand)), 60, 1, device);
    four_materials(true, device);
    compare("several chunks, added up by block", bounded(thrown({1, -2}, 1.0 / 250)), 30, 1, small);
    const webgpu::Device here;
    check(here.sums_by_block() != here.is_software() &&
              (here.arithmetic() == wgsl::Arithmetic::plain) == here.is_software(),
          "a software driver gets plain programs");
}

void times_of_passes() {
    auto cpu = thrown();
    cpu.most_steps_between_sorts = 7;
    auto gpu = webgpu::on_gpu(cpu, webgpu::Device({.timestamps = true}));
    for (int k = 0; k < 45; ++k) cpu.step();
    gpu.step();
    const std::vector<webgpu::PassTime> times = webgpu::time_passes(gpu, 40);
    for (int k = 0; k < 4; ++k) gpu.step();
    check_same_run("steps of which some were timed: ", cpu, gpu);
    const auto has = [&](const std::string& name) {
        return std::ranges::any_of(times, [&](const webgpu::PassTime& pass) {
            return pass.entry_point == name && pass.median > 0 && pass.mean > 0;
        });
    };
    check(has("begin_step") && has("p2g") && has("g2p"), "passes of a simulation's step have times");
    auto slow = webgpu::on_gpu(cpu, gpu.device()), plain = webgpu::on_gpu(cpu);
    slow.edit().fixed_time_step = 0;
    check_throws<usage_error>("times of steps that are not fixed", {"fixed_time_step"},
                              [&] { webgpu::time_passes(slow, 1); });
    check_throws<usage_error>("times of a device without timestamps", {"DeviceOptions::timestamps"},
                              [&] { webgpu::time_passes(plain, 1); });
    cpu.step(), plain.step();
    check_same_run("after a refusal: ", cpu, plain);
}

void from_one_to_the_other() {
    auto stayed = thrown(), cpu = thrown();
    for (int k = 0; k < 90; ++k) stayed.step();
    for (int k = 0; k < 30; ++k) cpu.step();
    auto gpu = webgpu::on_gpu(cpu);
    for (int k = 0; k < 30; ++k) gpu.step();
    auto back = gpu.simulation();
    for (int k = 0; k < 30; ++k) back.step();
    check_same_run("CPU, GPU, CPU by a copy: ", stayed, back);

    auto restarted = thrown(), again = thrown();
    restore(restarted, state_of(gpu));
    for (int k = 0; k < 30; ++k) restarted.step();
    check_same_run("CPU, GPU, CPU by a state: ", stayed, restarted);

    auto on_other = webgpu::on_gpu(again, gpu.device());
    restore(on_other.edit(), state_of(gpu));
    for (int k = 0; k < 30; ++k) on_other.step();
    check_same_run("CPU, GPU, GPU by a state: ", stayed, on_other);

    auto twin = gpu.simulation();
    const auto change = [](auto& simulation) {
        simulation.gravity = {2, -5};
        std::get<0>(simulation.boundary.parts).at_lower[1].friction = 0.5;
        simulation.fixed_time_step = 3e-4;
        simulation.add(sample_box<2>({0.1, 0.6}, {0.3, 0.8}, {.spacing = 1.0 / 90}), 500, {1, 0});
    };
    change(twin);
    change(gpu.edit());
    for (int k = 0; k < 70; ++k) twin.step();
    for (int k = 0; k < 10; ++k) gpu.step();
    for (int k = 0; k < 20; ++k) gpu.edit().step();  // on the CPU
    for (int k = 0; k < 40; ++k) gpu.step();
    check_same_run("a run that is changed: ", twin, gpu);
}

/// Transfers that blend velocities go to the device and back, in steps at their bound; their parameters may change.
void blended_transfers() {
    const webgpu::Device device;
    const auto goes_and_returns = [&](const std::string& name, auto stayed) {
        stayed = bounded(stayed);
        auto cpu = stayed;
        const auto step = [](auto& simulation, int count) {
            for (int k = 0; k < count; ++k) simulation.step();
        };
        step(stayed, 40), step(cpu, 20);
        auto gpu = webgpu::on_gpu(cpu, device);
        step(gpu, 20);
        auto back = gpu.simulation();
        stayed.transfer.ratio = back.transfer.ratio = gpu.edit().transfer.ratio = 0.5F;
        step(stayed, 20), step(back, 20), step(gpu, 20);
        check_same_run(name + ": CPU, GPU, CPU: ", stayed, back);
        check_same_run(name + ": CPU, GPU, changed: ", stayed, gpu);
    };
    goes_and_returns("FLIP", thrown({1, -2}, 1.0 / 90, Flip<>{}));
    compare("FLIP in several chunks", thrown({1, -2}, 1.0 / 250, Flip<>{}), 10, 1,
            webgpu::Device({.at_most = {48 << 10, 48 << 10, 64, 8}}));
    goes_and_returns("ASFLIP", thrown({1, -2}, 1.0 / 90, Asflip<>{.separation = 0.75F, .approach = 0.25F}));
}

/// Transfers that refine velocities by a series, of which the number of terms may change.
void refined_transfers() {
    const webgpu::Device device;
    const auto refined = [](int order, double spacing = 1.0 / 90) {
        auto simulation = thrown({1, -2}, spacing, Fmpm{.order = order});
        // Heavy grains move otherwise: in some steps the largest momentum is that of an earlier term.
        simulation.add(sample_box<2>({0.45, 0.35}, {0.55, 0.4}, {.spacing = 0.04}), 1e4, {-0.1, 0.2});
        return simulation;
    };
    compare("FMPM", refined(3), 60, 2, device);
    compare("FMPM in steps at their bound", bounded(refined(3)), 40, 2, device);
    compare("FMPM in several chunks, added up by block", refined(2, 1.0 / 250), 10, 1,
            webgpu::Device({.sums_by_block = true, .at_most = {96 << 10, 96 << 10, 64, 8}}));
    auto cpu = refined(2);
    auto gpu = webgpu::on_gpu(cpu, device);
    for (const int order : {2, 4, 1, 3}) {
        cpu.transfer.order = gpu.edit().transfer.order = order;
        for (int k = 0; k < 10; ++k) cpu.step(), gpu.step();
        check_same_run(sentence("FMPM, now of order ", order, ": "), cpu, gpu);
    }
    gpu.edit().transfer.order = 0;
    check_throws<parameter_error>("FMPM of order 0", {"The order of fmpm is 0"}, [&] { gpu.step(); });

    using Water = Fluid<float>;
    using Jelly = FixedCorotated<float>;
    auto fixed = made<2>(Materials<Water, Jelly>({}, Jelly::from_young_poisson(5e4, 0.3)), 1.0 / 120, 1e-4,
                         scenes::rough_walls<2>(), Fmpm{.order = 3});
    fixed.template set<Water>().add(sample_box<2>({0.32, 0.32}, {0.4, 0.4}, {.spacing = 1.0 / 240}), 1000, {9, -3});
    fixed.template set<Jelly>().add(sample_box<2>({0.41, 0.32}, {0.48, 0.4}, {.spacing = 1.0 / 200}), 2000, {-9, 5});
    const webgpu::Device hardware({.arithmetic = wgsl::Arithmetic::exact, .sums_by_block = true});
    for (const bool at_bound : {false, true}) {
        auto both = at_bound ? bounded(fixed) : fixed;
        auto on_device = webgpu::on_gpu(both, hardware);
        const std::string name = sentence("two materials by FMPM", at_bound ? ", bounded: " : ": ");
        check(on_device.blocks() > 0, name + "the nodes are sparse");
        both.advance(0.00395), on_device.advance(0.00395);
        check(both.steps() > 4, name + "steps are taken");
        check_same_state(name + "water: ", state_of(both.template set<Water>()),
                         on_device.template state_of_set<Water>());
        check_same_state(name + "jelly: ", state_of(both.template set<Jelly>()),
                         on_device.template state_of_set<Jelly>());
    }
}

/// Water and jelly, whose volumes are averaged or filtered apart, on a sparse grid, also beside mirrored walls.
void volumes_of_two_materials() {
    using Water = Fluid<float>;
    using Jelly = FixedCorotated<float>;
    const webgpu::Device device;
    const auto is_same = [&](const std::string& of, const auto& boundary, const auto&... policies) {
        auto cpu = made<2>(Materials<Water, Jelly>({}, Jelly::from_young_poisson(5e4, 0.3)), 1.0 / 120, 1e-4, boundary,
                           policies...);
        cpu.template set<Water>().add(sample_box<2>({0.32, 0.32}, {0.4, 0.4}, {.spacing = 1.0 / 240}), 1000, {9, -3});
        cpu.template set<Jelly>().add(sample_box<2>({0.41, 0.32}, {0.48, 0.4}, {.spacing = 1.0 / 200}), 2000, {-9, 5});
        cpu.execution.float_steps = true;
        cpu.template set<Jelly>().add_load(cpu.template set<Jelly>().bodies()[0],
                                           UniformForce<2>([](double) { return Vec<double, 2>{-1, 2}; }));
        auto gpu = webgpu::on_gpu(cpu, device);
        const bool mirrored = boundary.nodes_behind == NodesBehind::mirrored;
        const std::string name = of + (mirrored ? ", mirrored: " : ": ");
        check(gpu.blocks() > 0, name + "the kind of grid");
        cpu.advance(0.00595), gpu.advance(0.00595);
        check_same_state(name + "water: ", state_of(cpu.template set<Water>()), gpu.template state_of_set<Water>());
        check_same_state(name + "jelly: ", state_of(cpu.template set<Jelly>()), gpu.template state_of_set<Jelly>());
    };
    for (const auto& walls : {scenes::rough_walls<2>(), scenes::mirrored_walls<2>(0.3)}) {
        is_same("two materials by AFLIP, averaged", walls, Aflip<>{}, FBar{});
        is_same("two materials, filtered", walls, VolumeFilter{.every = 2, .shifting = 0});
    }
}

/// The sentence of the error that f throws.
template <class Error, class F>
std::string said(const F& f) {
    try {
        f();
    } catch (const Error& e) {
        return e.what();
    }
    return "nothing";
}

/// While it exists, the process can have only so many bytes more than now; the driver of a software GPU, too.
class MemoryLimit {
public:
    explicit MemoryLimit(std::size_t more) {
        std::size_t pages = 0;
        std::ifstream("/proc/self/statm") >> pages;
        getrlimit(RLIMIT_AS, &before_);
        const rlimit now{pages * std::size_t(sysconf(_SC_PAGESIZE)) + more, before_.rlim_max};
        setrlimit(RLIMIT_AS, &now);
    }
    ~MemoryLimit() { setrlimit(RLIMIT_AS, &before_); }
    MemoryLimit(const MemoryLimit&) = delete;
    MemoryLimit& operator=(const MemoryLimit&) = delete;

private:
    rlimit before_{};
};

/// A grid for which the device has no memory: nothing is lost, and a smaller one goes on.
void out_of_memory() {
    const auto water = [](double cell_size) {  // shifting needs all nodes of the domain
        auto simulation =
            made<2>(Fluid<float>{}, cell_size, 0.01 * cell_size, VolumeFilter{.every = 1, .shifting = 20});
        simulation.add(
            sample_box<2>({0.2, 0.2}, Vec<double, 2>::filled(0.2 + 10 * cell_size), {.spacing = 0.5 * cell_size}), 1000,
            {1, 0});
        return simulation;
    };
    auto cpu = water(1.0 / 30);
    auto gpu = webgpu::on_gpu(cpu);
    {
        gpu.edit() = water(1.0 / 3000);  // 144 MB of nodes
        const MemoryLimit limit(std::size_t{96} << 20);
        check_throws<device_error>("out of memory", {"cannot allocate", "bytes"}, [&] { gpu.step(); });
    }
    check(gpu.edit().particles().size() == 400 && gpu.steps() == 0, "particles are kept, out of memory");
    gpu.edit() = cpu;
    cpu.step(), gpu.step();
    check_same_run("after it was out of memory: ", cpu, gpu);
}

void errors_of_steps() {
    // Twenty cells a step, out through a ceiling that does not hold.
    const auto open_above = [](const Vec<double, 2>& velocity) {
        auto simulation = thrown(velocity);
        std::get<0>(simulation.boundary.parts).at_upper[1].contact = Contact::none;
        return simulation;
    };
    auto cpu = open_above({0, 1000});
    auto gpu = webgpu::on_gpu(cpu);
    const std::string theirs = said<particle_error>([&] { cpu.advance(0.01); }),
                      ours = said<particle_error>([&] { gpu.advance(0.01); });
    const std::string where = theirs.substr(0, theirs.find(" on: "));
    check(where.starts_with("At step ") && ours.starts_with(where + " on: "), "a particle leaves in the CPU's step",
          theirs + "; " + ours);
    check(ours.find("It is particle ") != std::string::npos && ours.find("velocity (0, ") != std::string::npos &&
              ours.find("times the bound") != std::string::npos,
          "one of the particles, and the cause", ours);
    check(gpu.moment() == cpu.moment(), "a run ends before the step that fails");
    const auto& boundary = std::get<1>(gpu.edit().boundary.parts);
    check(boundary.position == std::get<1>(cpu.boundary.parts).position, "and so does its boundary");
    for (int k = 0; k < 2; ++k)
        check_throws<particle_error>("after a step that failed", {"restore()"}, [&] { gpu.step(); });
    check_throws<particle_error>("a state after a step that failed", {"restore()"}, [&] { (void)state_of(gpu); });
    auto good = open_above({1, -2});
    restore(gpu.edit(), state_of(good));
    gpu.advance(0.01);
    good.advance(0.01);
    check_same_run("restored after a step that failed: ", good, gpu);

    auto scaled = thrown();
    scaled.execution.momentum_scale = 0x1p60;
    gpu.edit() = scaled;
    check_throws<overflow_error>("too large a scale", {"At step 0, of 0.0004 s", wgsl::error_sentences[2]},
                                 [&] { gpu.advance(0.01); });

    auto wrong = thrown();
    auto& particles = wrong.edit_particles();
    particles.set_velocity(0, {std::nanf(""), 0});
    check_throws<particle_error>("a particle that is not finite", {"Before step 0"},
                                 [&] { webgpu::on_gpu(wrong, gpu.device()); });
    gpu.edit() = wrong;
    check_throws<particle_error>("a particle that is edited wrongly", {"Before step 0"}, [&] { gpu.step(); });
}

void what_is_refused() {
    const webgpu::Device device;
    auto gpu = webgpu::on_gpu(thrown(), device);
    const auto refused = [&]<class Error>(std::type_identity<Error>, const std::string& what,
                                          const std::vector<std::string>& parts, const auto& change) {
        auto simulation = thrown();
        change(simulation);
        check_throws<Error>(what, parts, [&] { webgpu::on_gpu(simulation, device); });
        gpu.edit() = simulation;
        check_throws<Error>(what + ", later", parts, [&] { gpu.step(); });
    };
    constexpr std::type_identity<usage_error> usage;
    constexpr std::type_identity<parameter_error> parameter;
    refused(usage, "a pass of the program", {"the pass 'probe'", "CPU"},
            [](auto& simulation) { simulation.add_pass("probe", "p2g", [](auto&, const auto&) {}); });
    refused(usage, "a load that depends on the position", {"loads", "UniformForce"}, [](auto& simulation) {
        simulation.add_load(simulation.bodies()[0], [](const Vec<double, 2>&, double) { return Vec<double, 2>{1, 0}; });
    });
    const Collider<HalfSpace<float, 2>> side{.contact = Contact::separate};
    auto in_nine =
        made<2>(Fluid<float>{}, 1.0 / 50, 1e-4, Together(side, side, side, side, side, side, side, side, side));
    add_block<2>(in_nine, 1.0 / 60, {0, 0});
    in_nine.reactions.emplace();
    check_throws<usage_error>("reactions of nine parts", {"at most 8 parts", "has 9"},
                              [&] { webgpu::on_gpu(in_nine, device); });
    refused(parameter, "steps at their bound in double", {"execution.float_steps", "fixed_time_step"},
            [](auto& simulation) { simulation.fixed_time_step = 0; });
    Domain<2> ring;
    ring.cell_size = 1.0 / 48;
    ring.periodic[0] = true;
    Simulation turning(ring, Fluid<float>{}, Integers{}, VolumeFilter{.every = 1, .shifting = 20});
    turning.fixed_time_step = 1e-4;
    turning.add(sample_box<2>({0.3, 0.3}, {0.5, 0.5}, {.spacing = 0.01}), 1000, {1, 0});
    check_throws<usage_error>("particle shifting in a periodic domain", {"particle shifting", "periodic"},
                              [&] { webgpu::on_gpu(turning, device); });
    gpu.edit() = thrown();
    check_throws<parameter_error>("a time that runs back", {"-1 s"}, [&] { gpu.advance(-1); });

    std::vector<std::string> warnings;
    auto hasty = thrown();
    hasty.warn = [&](const std::string& text) { warnings.push_back(text); };
    hasty.fixed_time_step = 4e-3;
    gpu.edit() = hasty;
    gpu.step();
    check(warnings.size() == 1 && warnings[0].find("times the bound") != std::string::npos,
          "a step above its bound is warned of", warnings.empty() ? "nothing" : warnings[0]);

    wgpuDeviceDestroy(device.handle());
    check_throws<device_error>("a lost device", {"was lost"}, [&] { gpu.step(), (void)state_of(gpu); });
    check_throws<device_error>("a lost device, again", {"was lost"}, [&] { (void)gpu.totals(); });
}

}  // namespace

int main() {
    try {
        runs_are_the_cpus();
        for (const bool at_bound : {false, true}) four_materials(at_bound);
        sources(webgpu::Device());
        grids_of_distances(webgpu::Device());
        sparse_grids();
        mirrored_walls_where_particles_are();
        periodic_domains();
        loads();
        times_of_passes();
        checks::reactions();
        away_from_the_origin();
        as_on_hardware();
        small_limits();
        from_one_to_the_other();
        blended_transfers();
        refined_transfers();
        volumes_of_two_materials();
        checks::acceleration_fields();
        checks::materials();
        errors_of_steps();
        out_of_memory();
        what_is_refused();
    } catch (const std::exception& e) {
        check(false, "the test", e.what());
    }
    return finish();
}
