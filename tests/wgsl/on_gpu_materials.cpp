/// \file Runs with materials in plane strain, and with materials that ask for the surroundings of their particles.
#include <firn/io/restart.hpp>
#include <firn/material/plane_strain.hpp>
#include <firn/material/sand.hpp>

#include "asking.hpp"
#include "on_gpu_checks.hpp"

#include <algorithm>
#include <string>

namespace {

using namespace firn;
using namespace checks;
using scenes::Graded, scenes::GradedSand;

using Jelly = FixedCorotated<float>;

constexpr double time_step = 0x1p-13;  // [s]; sums of it are the same in double and in two floats

/// A domain away from the origin, of which positions on the device are counted from the lower corner.
Domain<2> domain_elsewhere() { return {{3.25, -1.5}, {4.25, -0.5}, 1.0 / 40}; }
Walls<float, 2> walls_elsewhere() {
    auto walls = scenes::rough_walls<2>();
    walls.lower = domain_elsewhere().lower;
    walls.upper = domain_elsewhere().upper;
    return walls;
}
/// A block that falls to the floor there.
Samples<2> block_elsewhere(double left) {
    const Vec<double, 2> corner = domain_elsewhere().lower + Vec<double, 2>{left, 0.04};
    return sample_box<2>(corner, corner + Vec<double, 2>{0.25, 0.3},
                         {.spacing = 1.0 / 80, .pattern = Pattern::jittered, .jitter = 0.1});
}
/// Adds a strained block.
template <class Set>
void add_strained(Set&& set, const Samples<2>& block, const Vec<double, 2>& velocity) {
    set.add(block, 800, velocity);
    auto& particles = set.edit_particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot))
            particles.set_state(slot, scenes::strained<2>(particles.state(slot), slot, 0.05F));
}
template <class Material, class... Policies>
auto falling(const Material& material, const Policies&... policies) {
    Simulation simulation(domain_elsewhere(), material, walls_elsewhere(), scenes::Integers{}, policies...);
    simulation.warn = {};
    simulation.fixed_time_step = time_step;
    if constexpr (decltype(simulation)::material_count == 1) add_strained(simulation, block_elsewhere(0.2), {0.5, -2});
    return simulation;
}

void plane_strain(const webgpu::Device& device) {
    const PlaneStrain<Sand<float>> sand{Sand<float>::from_properties({.young = 1e5})};
    compare("plane strain", falling(sand), 60, 2, device);
    compare("plane strain in steps at their bound", bounded(falling(sand)), 60, 2, device);

    auto gpu = webgpu::on_gpu(falling(sand), device);
    gpu.advance(0.02);
    const auto state = firn::state_of(gpu);
    const auto found =
        std::ranges::find_if(state.fields, [](const auto& f) { return f.name == "kirchhoff_stress_zz"; });
    std::vector<float> expected;
    const auto& particles = gpu.simulation().particles();
    for (const auto id : state.id)
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot) && std::int64_t(particles.id(slot)) == id)
                expected.push_back(sand.model().kirchhoff_stress(particles.state(slot))(2, 2));
    check(found != state.fields.end(), "states of a GPU have the stress across the plane");
    if (found != state.fields.end()) check_same_bits("the stress across the plane", found->values, expected);
    check(std::ranges::any_of(expected, [](float x) { return x < -100; }), "the stress across the plane bears load");
}

void asking(const webgpu::Device& device) {
    compare("a material that asks", falling(Graded<float>{}), 80, 2, device);
    compare("a material that asks, in steps at their bound", bounded(falling(Graded<float>{})), 80, 2, device);
    compare("FLIP of sand that asks", falling(GradedSand<float>{}, Flip<>{}), 40, 2, device);
    compare("plane strain of sand that asks", falling(PlaneStrain<GradedSand<float>>{}), 40, 2, device);
    compare("a material that asks, with F-bar", falling(Graded<float>{}, FBar{}), 40, 2, device);
    compare("a material that asks, filtered", falling(Graded<float>{}, VolumeFilter{.every = 2}), 40, 2, device);
}

/// Of two materials only the second one asks; the program of the first one begins the steps, which keep the time.
void one_of_two_asks(const webgpu::Device& device) {
    auto cpu = falling(Materials<Jelly, Graded<float>>(Jelly::from_young_poisson(1e5, 0.3), {}));
    add_strained(cpu.template set<Jelly>(), block_elsewhere(0.1), {1, -1});
    add_strained(cpu.template set<Graded<float>>(), block_elsewhere(0.36), {-1, -2});
    auto gpu = webgpu::on_gpu(cpu, device);
    for (int k = 0; k < 3; ++k) {
        cpu.advance(20 * time_step), gpu.advance(20 * time_step);
        if (k == 1) gpu.edit();  // to the device again, at a time that is not 0
        check_same_state("one of two materials asks: jelly: ", state_of(cpu.template set<Jelly>()),
                         gpu.template state_of_set<Jelly>());
        check_same_state("one of two materials asks: ", state_of(cpu.template set<Graded<float>>()),
                         gpu.template state_of_set<Graded<float>>());
    }
}

/// A ring around which matter goes more than once.
void around_a_ring(const webgpu::Device& device) {
    Domain<2> ring{{-0.5, -2}, {0.5, -1.5}, 1.0 / 48};
    ring.periodic[0] = true;
    Simulation cpu(ring, Graded<float>{}, scenes::Integers{});
    cpu.warn = {};
    cpu.gravity = {};
    cpu.fixed_time_step = time_step;
    add_strained(cpu, sample_box<2>({0.1, -1.9}, {0.3, -1.7}, {.spacing = 1.0 / 96}), {20, 1});
    compare("a material that asks, on a ring", cpu, 500, 2, device);
}

/// A run that the device takes up at a time at which a float has no room for steps.
void late(const webgpu::Device& device) {
    auto cpu = falling(Graded<float>{.mu = 0.5F, .lambda = 0.6F});  // stiffer with time
    auto state = state_of(cpu);
    state.time = 3000 + time_step;
    restore(cpu, state);
    compare("a material that asks, late", cpu, 40, 2, device);
}

}  // namespace

void checks::materials() {
    const webgpu::Device device;
    plane_strain(device);
    asking(device);
    one_of_two_asks(device);
    around_a_ring(device);
    late(device);
}
