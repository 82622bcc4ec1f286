/// \file What firn::webgpu::on_gpu() promises of reactions: they are the CPU's but for rounding, and the same from run
/// to run.
#include "on_gpu_checks.hpp"

namespace {

using namespace checks;
using scenes::Integers;

/// Impulses of walls, in corners, of mirrored walls and of colliders that move.
void reactions_of_boundaries() {
    const webgpu::Device device;
    auto near = thrown({6, -8});
    near.advance(0.02);
    compare_reactions("reactions", near, 30, 0, device);
    near.reactions = Reactions<2>{.about = Vec<double, 2>{0.25, -3}};
    compare_reactions("reactions in steps at their bound", bounded(near), 30, 0, device);

    // Nodes where a wedge, walls and a ball act at once, with friction; of water that was at rest, which has no
    // momentum until the ball pushes it.
    Collider<Sphere<float, 2>> ball{.shape = {0.2F}, .contact = Contact::separate, .friction = 0.4};
    ball.position = {0.3, 0.1};
    ball.linear_velocity = {-1, -0.5};
    ball.angular_velocity = 5;
    Collider<HalfSpace<float, 2>> wedge{.shape = {{0.6F, 0.8F}}, .contact = Contact::separate, .friction = 0.1};
    wedge.position = {0.03, 0};
    auto squeezed = made<2>(Fluid<float>{}, 1.0 / 40, 1e-4, Together(scenes::rough_walls<2>(), ball, wedge));
    squeezed.gravity = {};
    squeezed.add(sample_box<2>({0, 0}, {0.15, 0.2}, {.spacing = 1.0 / 100}), 1000);
    compare_reactions("reactions at once, of matter at rest", squeezed, 20, 0, device);
    compare_reactions("reactions at once, in steps at their bound", bounded(squeezed), 20, 0, device);

    // A dense grid; and a wall that no matter reaches.
    auto snow = made<2>(Snow<float>{}, 1.0 / 30, 1e-4, Pic{}, WeightGradientForce{}, CubicBSpline{},
                        Together(scenes::mirrored_walls<2>(), ball), FBar{});
    add_block<2>(snow, 1.0 / 60, {-3, -5});
    snow.add(sample_box<2>({0, 0}, {0.3, 0.1}, {.spacing = 1.0 / 60}), 1000, {-2, -3});
    compare_reactions("reactions of mirrored walls", snow, 30, 0, device);
    auto flip = made<2>(Fluid<float>{}, 1.0 / 30, 1e-4, Flip{}, scenes::mirrored_walls<2>());
    flip.add(sample_box<2>({0, 0}, {0.3, 0.1}, {.spacing = 1.0 / 60}), 1000, {-2, -3});
    compare_reactions("reactions of mirrored walls, with blended velocities", flip, 20, 0, device);
    auto fmpm = made<2>(Fluid<float>{}, 1.0 / 30, 1e-4, Fmpm{.order = 3}, scenes::mirrored_walls<2>());
    fmpm.add(sample_box<2>({0, 0}, {0.3, 0.1}, {.spacing = 1.0 / 60}), 1000, {-2, -3});
    compare_reactions("reactions of mirrored walls, with refined velocities", fmpm, 20, 0, device);

    // One plane: a software GPU takes long to compile more in 3D.
    Collider<HalfSpace<float, 3>> floor{.shape = {{0.36F, 0.48F, 0.8F}}, .contact = Contact::separate, .friction = 0.3};
    floor.position = {0.2, 0.2, 0.2};
    auto splash = made<3>(Fluid<float>{}, 1.0 / 20, 1e-4, floor);
    splash.add(sample_box<3>({0.2, 0.2, 0.2}, {0.4, 0.3, 0.3}, {.spacing = 1.0 / 40}), 1000, {-1, -2, -30});
    splash.reactions = Reactions<3>{.about = Vec<double, 3>{0.1, 0.2, 0.3}};
    compare_reactions("reactions in 3D", splash, 10, 0, device);

    auto two =
        made<2>(Materials<Fluid<float>, Sand<float>>(), 1.0 / 40, 1e-4, Together(scenes::rough_walls<2>(), ball));
    two.set<Fluid<float>>().add(sample_box<2>({0, 0}, {0.2, 0.2}, {.spacing = 1.0 / 80}), 1000, {-2, -3});
    two.set<Sand<float>>().add(sample_box<2>({0.4, 0}, {0.6, 0.2}, {.spacing = 1.0 / 80}), 1000, {-2, -3});
    compare_reactions("reactions on two materials", two, 20, 0, device);
    compare_reactions("reactions on two materials, as on hardware", bounded(two), 20, 0,
                      webgpu::Device({.arithmetic = wgsl::Arithmetic::exact, .sums_by_block = true}));

    // A run that goes to the device and back gives what the CPU would.
    auto stayed = near, cpu = near;
    Reaction<2> expected, got;
    const auto take = [](auto& simulation, Reaction<2>& sum, const auto& of) {
        for (int k = 0; k < 10; ++k) {
            simulation.step();
            sum += of().parts[0];
        }
    };
    const auto of = [](auto& simulation) { return [&] { return *simulation.reactions; }; };
    take(stayed, expected, of(stayed)), take(stayed, expected, of(stayed)), take(stayed, expected, of(stayed));
    take(cpu, got, of(cpu));
    auto gpu = webgpu::on_gpu(cpu, device);
    check(gpu.reactions().parts[0].impulse == cpu.reactions->parts[0].impulse, "reactions go to the GPU");
    take(gpu, got, [&] { return *gpu.simulation().reactions; });
    auto back = gpu.simulation();
    take(back, got, of(back));
    check(norm(got.impulse - expected.impulse) < 1e-6 * norm(expected.impulse), "reactions of CPU, GPU, CPU");
    gpu.edit().reactions->about = Vec<double, 2>{400, 0};
    gpu.step();
    check(gpu.reactions().parts[0].about[0] == 400, "the point of moments may change");
    gpu.edit().reactions.reset();
    gpu.step();
    check_throws<usage_error>("reactions that are not asked for any more", {"no reactions", "emplace"},
                              [&] { (void)gpu.reactions(); });
}

/// Impulses of loads, on matter that moves much faster than they push it, too.
void reactions_of_loads() {
    const webgpu::Device device;
    auto pushed = thrown({3, -4});
    pushed.execution.float_steps = true;
    const Body first = pushed.bodies()[0],
               later = pushed.add(sample_box<2>({0.1, 0.6}, {0.2, 0.8}, {.spacing = 1.0 / 70}), 1300, {0, 40});
    const auto add = [](auto& to, const Body& body, const auto& force) { to.add_load(body, UniformForce<2>(force)); };
    add(pushed, first, [](double time) { return Vec<double, 2>{3 * std::sin(300 * time + 0.1), 2}; });
    add(pushed, later, [](double) { return Vec<double, 2>{5e-3, -1e-3}; });
    add(pushed, first, [](double time) { return Vec<double, 2>{0, time < 0.004 ? 4.0 : -7e-7}; });
    compare_reactions("reactions of loads", pushed, 20, 0, device);
    pushed.reactions = Reactions<2>{.about = Vec<double, 2>{0.412, 0.377}};
    compare_reactions("reactions of loads in steps at their bound", bounded(pushed), 12, 0, device);
    compare_reactions(
        "reactions of loads, in several chunks, as on hardware", pushed, 10, 0,
        webgpu::Device(
            {.arithmetic = wgsl::Arithmetic::exact, .sums_by_block = true, .at_most = {24 << 10, 24 << 10, 64, 8}}));

    // Not one part of a boundary; a periodic axis, over whose end matter goes.
    Domain<3> ring{.cell_size = 1.0 / 16};
    ring.periodic[0] = true;
    Simulation round(ring, Fluid<float>{}, Integers{}, NoBoundary{});
    round.warn = {};
    round.gravity = {};
    round.fixed_time_step = 5e-4;
    round.execution.float_steps = true;
    round.reactions.emplace();
    round.add_load(round.add(sample_box<3>({0.8, 0.4, 0.4}, {0.99, 0.5, 0.5}, {.spacing = 1.0 / 40}), 1000, {9, 1, -1}),
                   UniformForce<3>([](double) { return Vec<double, 3>{0.1, -2, 3}; }));
    compare_reactions("reactions of a load in 3D", round, 20, 1, device);  // NoBoundary is a part

    auto two = made<2>(Materials<Fluid<float>, Sand<float>>(), 1.0 / 40, 1e-4, scenes::rough_walls<2>());
    two.execution.float_steps = true;
    two.set<Fluid<float>>().add(sample_box<2>({0, 0}, {0.2, 0.2}, {.spacing = 1.0 / 80}), 1000, {-2, -3});
    const Body sand =
        two.set<Sand<float>>().add(sample_box<2>({0.4, 0}, {0.6, 0.2}, {.spacing = 1.0 / 80}), 1000, {-2, -3});
    for (const double force : {3.0, -0.2})
        two.set<Sand<float>>().add_load(sand, UniformForce<2>([=](double) { return Vec<double, 2>{force, 1}; }));
    two.set<Sand<float>>().remove_load({1, 0});
    compare_reactions("reactions of a load on one of two materials", two, 10, 0, device);

    // Steps after which the CPU acts; a load that was removed; and a run without reactions.
    auto cpu = pushed;
    cpu.add_sink({.lower = {0.1, 0.81}, .upper = {0.15, 0.84}});
    auto gpu = webgpu::on_gpu(cpu, device);
    const auto is_same = [&](const std::string& name) {
        const auto &expected = cpu.reactions->loads, &got = gpu.reactions().loads;
        bool same = got.size() == expected.size();
        for (std::size_t k = 0; same && k < got.size(); ++k)
            same = got[k].load == expected[k].load && norm(got[k].reaction.impulse - expected[k].reaction.impulse) <=
                                                          1e-6 * norm(expected[k].reaction.impulse);
        check(same, name + ": loads", sentence(got.size(), " loads, not ", expected.size()));
    };
    const std::size_t before = cpu.particles().size();
    for (int k = 0; k < 4; ++k) {
        cpu.advance(9.5 * cpu.fixed_time_step), gpu.advance(9.5 * cpu.fixed_time_step);
        is_same(sentence("reactions beside a sink, part ", k));
    }
    check(cpu.particles().size() < before, "the sink takes particles");
    check_same_run("reactions beside a sink: ", cpu, gpu);
    cpu.remove_load({0, 1}), gpu.edit().remove_load({0, 1});
    cpu.step(), gpu.step();
    is_same("reactions after a load was removed");
    gpu.edit().reactions.reset(), cpu.reactions.reset();
    cpu.step(), gpu.step();
    check_same_run("loads, without reactions again: ", cpu, gpu);
}

/// A wall that stops matter which has no signal speed yet: an impulse that integers cannot hold.
void impulse_too_large() {
    auto dust = made<2>(FixedCorotated<float>::from_young_poisson(1e-2, 0.3), 1.0 / 50, 1e-3,
                        Walls<float, 2>::all({0, 0}, {1, 1}, {Contact::stick, 0}));
    dust.add(sample_box<2>({0.4, 0}, {0.6, 0.1}, {.spacing = 1.0 / 100}), 1000);
    dust.reactions.emplace();
    dust.gravity = {0, -1e11};
    auto gpu = webgpu::on_gpu(dust);
    check_throws<overflow_error>(
        "an impulse that is too large for reactions",
        {"At step 0, of 0.001 s", wgsl::error_sentences[wgsl::detail::reaction_error - 1], "times the bound"}, [&] {
            gpu.step();
            (void)gpu.reactions();
        });
    check_throws<particle_error>("reactions after that", {"restore()"}, [&] { (void)gpu.simulation(); });
}

}  // namespace

void checks::reactions() {
    reactions_of_boundaries();
    reactions_of_loads();
    impulse_too_large();
}
