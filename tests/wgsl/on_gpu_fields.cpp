/// \file What firn::webgpu::on_gpu() promises of acceleration fields: steps have those of the CPU, to the bit.
#include <firn/field/attraction.hpp>
#include <firn/field/damped.hpp>
#include <firn/io/restart.hpp>

#include "on_gpu_checks.hpp"

namespace {

using namespace checks;
using scenes::Integers;
using Pull = Attraction<float, 2>;
using Drag = Damped<float, 2>;
using DampedPull = Damped<float, 2, Attraction>;

/// A field of a program's own, which gets positions in metres.
template <scalar S>
struct Shear {
    S rate = S(0);
    static constexpr auto parameters() { return std::tuple{parameter{"rate", "1/s^2", &Shear::rate}}; }
    Vec<S, 2> operator()(const Vec<S, 2>& x) const { return {x[1] * rate, S(-2) * x[0]}; }
};

const Pull pull{.gravity = {0, -3}, .centre = {0.4, 0.6}, .radius = 0.5F, .strength = 60};

/// Whether both have the same bound of the time step by a field, as seen before and after steps by it.
template <class Simulation, class Field>
void check_same_bound(const std::string& name, Simulation& cpu, webgpu::OnGpu<Simulation>& gpu, const Field& field) {
    const double expected = cpu.stable_time_step(field), got = gpu.stable_time_step(field);
    check(got == expected, name + "bound by the field", sentence(got, " s, not ", expected, " s"));
}

/// A run in parts, each by another acceleration and ending in a shortened step.
template <class Simulation, class... Fields>
void compare_by(const std::string& name, Simulation cpu, const webgpu::Device& device, int steps,
                const Fields&... fields) {
    cpu.execution.float_steps = true;  // so that the largest acceleration is a float's
    auto gpu = webgpu::on_gpu(cpu, device);
    int part = 0;
    const auto take = [&](const auto& field) {
        const std::string of_part = sentence(name, ", part ", ++part, ": ");
        check_same_bound(of_part, cpu, gpu, field);
        const std::uint64_t before = cpu.steps();
        const double step = cpu.fixed_time_step > 0 ? cpu.fixed_time_step : cpu.stable_time_step(field);
        cpu.advance((steps - 0.5) * step, field), gpu.advance((steps - 0.5) * step, field);
        check(cpu.steps() > before, of_part + "steps are taken");
        check_same_bound(of_part, cpu, gpu, field);
        check(gpu.simulation().largest_acceleration() == cpu.largest_acceleration(), of_part + "largest acceleration");
        if constexpr (Simulation::material_count == 1) check_same_run(of_part, cpu, gpu);
    };
    (take(fields), ...);
    check(gpu.stable_time_step() == cpu.stable_time_step(), name + ": bound by gravity");
}

void fields_of_firn(const webgpu::Device& device) {
    compare_by("fields", thrown(), device, 20, pull, DampedPull{pull, 30}, Drag{{{0, -9.81F}}, 5},
               Vec<double, 2>{3, -1});
    Pull strong = pull, stronger = pull;
    strong.strength = 1e4F, stronger.strength = 4e4F;
    auto cpu = bounded(thrown({0, 0}));
    cpu.advance(0.5 * cpu.stable_time_step(strong), strong);
    check(cpu.stable_time_step(strong) < 0.7 * cpu.stable_time_step(), "a field bounds the steps");
    compare_by("fields that bound the steps", bounded(thrown({0, 0})), device, 5, strong, stronger, pull,
               Vec<double, 2>{0, -2e4}, Vec<double, 2>{1, -4e4}, Vec<double, 2>{0, -1}, DampedPull{strong, 400});
    Attraction<float, 3> line{.gravity = {0, -9, 0}, .centre = {0.4, 0.4, 0.3}, .direction = {0, 0.6F, 0.8F}};
    line.radius = 0.3F, line.strength = 900;
    auto splash = made<3>(Fluid<float>{}, 1.0 / 20, 1e-4, scenes::rough_walls<3>());
    add_block<3>(splash, 1.0 / 30, {4, -9, 2});
    compare_by("a line pulls water", bounded(std::move(splash)), device, 8, line);
}

/// Fields of the program's own, also far from the origin, where positions count from the domain's corner.
void fields_of_a_program(const webgpu::Device& device) {
    const auto turning = []<class P>(const Vec<P, 2>& x, const Vec<P, 2>& v, const P& dt) {
        return Vec<P, 2>{v[1] * P(20) - dt * x[0], v[0] * P(-20)};
    };
    for (const auto& corner : {Vec<double, 2>{-3.7, 5.3}, Vec<double, 2>{-3.7, 5.25e5}}) {
        const auto there = block_from(corner, 0.25, [](const auto& walls) { return walls; });
        Pull moved = pull;
        moved.centre += corner;
        const std::string name = sentence("from (", corner[0], ", ", corner[1], ") m on");
        compare_by(name, there, device, 20, moved, DampedPull{moved, 20});
        auto cpu = there;
        cpu.advance(40 * cpu.fixed_time_step, moved);
        check(cpu.particles().size() < there.particles().size(), name + ": a sink takes particles");
        if (corner[1] > 1e5) {
            auto gpu = webgpu::on_gpu(there, device);
            check_throws<parameter_error>(name + ", a field in metres", {"An acceleration field of your own"},
                                          [&] { gpu.step(turning); });
            continue;
        }
        compare_by(name + ", in metres", there, device, 10, Shear<float>{300}, turning);
        compare_by(name + ", at their bound", bounded(there), device, 10, moved, Shear<float>{3e3F}, moved);
    }
    Domain<2> ring;
    ring.cell_size = 1.0 / 48;
    ring.periodic[0] = true;
    auto walls = scenes::rough_walls<2>();
    walls.at_lower[0] = walls.at_upper[0] = {};
    Simulation round(ring, Fluid<float>{}, Integers{}, walls);
    round.warn = {};
    round.add(sample_box<2>({0.7, 0.3}, {0.95, 0.5}, {.spacing = 0.01}), 1000, {9, -2});
    compare_by("a ring", bounded(std::move(round)), device, 25, Shear<float>{30}, pull);
}

/// Fields of which the parameters change from step to step, and runs that go from the CPU to the device and back.
void fields_that_change(const webgpu::Device& device) {
    for (const bool at_bound : {false, true}) {
        auto stayed = at_bound ? bounded(thrown()) : thrown();
        stayed.execution.float_steps = true;
        auto cpu = stayed;
        Pull moving = pull;
        const auto steps = [&](auto& simulation) {
            for (int k = 0; k < 12; ++k) {
                moving.strength = at_bound ? 2e4F - 3e3F * float(k) : 60.0F * float(k);
                moving.centre[0] = 0.4 + 0.02 * k;
                simulation.step(moving);
            }
        };
        const auto falls = [](auto& simulation) {
            for (int k = 0; k < 4; ++k) simulation.step({0.5 * k, -4e4 / (1 + 3 * k)});
            simulation.step();
        };
        steps(stayed), steps(stayed), falls(stayed), steps(stayed), steps(stayed);
        steps(cpu);
        auto gpu = webgpu::on_gpu(cpu, device);
        steps(gpu), falls(gpu), steps(gpu);
        auto back = gpu.simulation();
        steps(back);
        check_same_run(sentence("CPU, GPU, CPU by fields", at_bound ? ", at their bound: " : ": "), stayed, back);
        steps(gpu);
        check_same_run(sentence("CPU, GPU by fields", at_bound ? ", at their bound: " : ": "), stayed, gpu);
        auto restarted = thrown();
        if (at_bound) restarted = bounded(restarted);
        restarted.execution.float_steps = true;
        restore(restarted, state_of(gpu));
        steps(restarted), steps(stayed);
        check_same_run(sentence("GPU, CPU by a state", at_bound ? ", at their bound: " : ": "), stayed, restarted);
    }
}

/// A pull apart: memory for blocks of nodes is made within steps by a field, and those steps are taken again.
void fields_on_sparse_grids(const webgpu::Device& device) {
    Pull apart{.centre = {0.5, 0.5}, .radius = 0.5F, .strength = -3e4F};
    for (const bool at_bound : {false, true}) {
        auto cpu = made<2>(Fluid<float>{}, 1.0 / 160, 5e-5, scenes::rough_walls<2>());
        cpu.add(sample_box<2>({0.46, 0.46}, {0.54, 0.54}, {.spacing = 1.0 / 320}), 1000);
        if (at_bound) cpu = bounded(cpu);
        cpu.execution.float_steps = true;
        auto gpu = webgpu::on_gpu(cpu, device);
        const std::size_t before = gpu.blocks();
        const std::string name = at_bound ? "pulled apart, at their bound: " : "pulled apart: ";
        for (int k = 0; k < 100 && !at_bound; ++k) {
            if (k == 50) apart.strength = -2e4F;
            cpu.step(apart), gpu.step(apart);
        }
        if (at_bound) cpu.advance(0.005, apart), gpu.advance(0.005, apart);
        check_same_run(name, cpu, gpu);
        check(before > 0 && gpu.blocks() >= 2 * before, name + "the grid grows",
              sentence(before, " blocks, then ", gpu.blocks()));
    }
}

void fields_on_two_materials(const webgpu::Device& device) {
    using Water = Fluid<float>;
    using Jelly = FixedCorotated<float>;
    auto cpu = made<2>(Materials<Water, Jelly>({}, Jelly::from_young_poisson(5e4, 0.3)), 1.0 / 60, 1e-4,
                       scenes::rough_walls<2>(), Flip<>{});
    cpu.template set<Water>().add(sample_box<2>({0.2, 0.3}, {0.4, 0.4}, {.spacing = 1.0 / 120}), 1000, {4, -3});
    cpu.template set<Jelly>().add(sample_box<2>({0.41, 0.3}, {0.6, 0.4}, {.spacing = 1.0 / 100}), 2000, {-4, 2});
    cpu = bounded(cpu);
    auto gpu = webgpu::on_gpu(cpu, device);
    for (const float strength : {4e3F, -3e4F}) {
        DampedPull field{pull, 20};
        field.field.strength = strength;
        cpu.advance(0.002, field), gpu.advance(0.002, field);
        const std::string name = sentence("two materials by a pull of ", strength, " m/s^2: ");
        check(cpu.steps() > 3, name + "steps are taken", sentence(cpu.steps()));
        check_same_state(name + "water: ", state_of(cpu.template set<Water>()), gpu.template state_of_set<Water>());
        check_same_state(name + "jelly: ", state_of(cpu.template set<Jelly>()), gpu.template state_of_set<Jelly>());
    }
}

void wrong_fields(const webgpu::Device& device) {
    auto cpu = thrown();
    std::vector<std::string> of_cpu, of_gpu;
    cpu.warn = [&](const std::string& text) { of_cpu.push_back(text); };
    auto same = cpu;
    same.warn = [&](const std::string& text) { of_gpu.push_back(text); };
    auto gpu = webgpu::on_gpu(same, device);
    for (int k = 0; k < 3; ++k) cpu.step(Drag{.rate = 3}), gpu.step(Drag{.rate = 3});
    (void)gpu.totals();
    check(of_cpu.size() == 1 && of_gpu == of_cpu, "gravity that a field lacks is warned of",
          sentence(of_gpu.size(), " warnings, not ", of_cpu.size()));
    const auto refused = [&](const std::string& what, const std::string& part, const auto& field) {
        check_throws<parameter_error>(what, {part}, [&] { gpu.step(field); });
        check_throws<parameter_error>(what + ", in an advance", {part}, [&] { gpu.advance(0.01, field); });
    };
    refused("a negative rate", "rate of damping is -1", Drag{{}, -1});
    refused("a pull without a radius", "radius", Pull{.radius = 0});
    refused("a field that is not finite", "rate", Shear<float>{std::nanf("")});
    refused("gravity that is not finite", "Component 1", Vec<double, 2>{0, std::nan("")});
    Drag drag{{{0, -9.81F}}, 3};
    for (int k = 0; k < 3; ++k) cpu.step(drag), gpu.step(drag);
    cpu.step(), gpu.step();
    check_same_run("after fields that were refused: ", cpu, gpu);

    Pull wild = pull;
    wild.strength = 1e9F;
    check_throws<particle_error>("a field that throws particles out", {"At step ", "It is particle "}, [&] {
        for (int k = 0; k < 5; ++k) gpu.step(wild);
        (void)gpu.totals();
    });
    check_throws<particle_error>("after that, another field", {"restore()"}, [&] { gpu.step(drag); });
    restore(gpu.edit(), state_of(cpu));
    cpu.step(drag), gpu.step(drag);
    cpu.step(), gpu.step();
    check_same_run("restored: ", cpu, gpu);
}

}  // namespace

void checks::acceleration_fields() {
    const webgpu::Device device;
    fields_of_firn(device);
    fields_of_a_program(device);
    fields_that_change(device);
    fields_on_sparse_grids(device);
    fields_on_two_materials(device);
    wrong_fields(device);
}
