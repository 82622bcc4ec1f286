/// \file One step of everything that a GPU can do, with about 1,000 and 10,000 particles, in two and three dimensions:
/// each has the CPU's bits (of reactions: but for 1e-6). Closes with "N passed, M failed".
///
///     firn_webgpu_features [NAME…]
///
/// With names, only these features, as "FLIP" or "mirrored walls".
#include <firn/field/attraction.hpp>
#include <firn/field/damped.hpp>
#include <firn/kernel/compact_quartic.hpp>
#include <firn/kernel/cubic_b_spline.hpp>
#include <firn/kernel/linear.hpp>
#include <firn/material/dissipating.hpp>
#include <firn/material/hencky.hpp>
#include <firn/material/mohr_coulomb.hpp>
#include <firn/material/modified_cam_clay.hpp>
#include <firn/material/nacc.hpp>
#include <firn/material/neo_hookean.hpp>
#include <firn/material/plane_strain.hpp>
#include <firn/material/von_mises.hpp>
#include <firn/transfer/fmpm.hpp>
#include <firn/transfer/pic.hpp>
#include <firn/webgpu/on_gpu.hpp>

#include "asking.hpp"
#include "on_gpu_checks.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>

namespace {

using namespace firn;
using namespace checks;

using Jelly = FixedCorotated<float>;

/// Strains particles at random.
template <int D>
void strain(auto& particles) {
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot))
            particles.set_state(slot, scenes::strained<D>(particles.state(slot), slot, 0.05F));
}

/// Matter in the lower corner of the unit box, so near to its walls and to the ball that they act in the next step.
template <int D>
struct Corner {
    static constexpr double side = 0.3;  ///< of a block [m]

    std::size_t particles;
    const std::set<std::string>& chosen;
    const webgpu::Device& device;  ///< one for both sizes: it compiles their programs once
    bool is_bounded = false;       ///< whether steps are at their bound: the CPU chooses the first, the device two more

    double spacing() const { return side / std::round(std::pow(double(particles), 1.0 / D)); }
    double cell_size() const { return 1 / std::ceil(1 / (2 * spacing())); }
    Samples<D> block(int number = 0) const {
        Vec<double, D> lower = Vec<double, D>::filled(0.3 * cell_size());
        lower[0] += number * side;
        return sample_box<D>(lower, lower + Vec<double, D>::filled(side),
                             {.spacing = spacing(), .pattern = Pattern::jittered, .jitter = 0.1});
    }
    Collider<Sphere<float, D>> ball() const {
        Collider<Sphere<float, D>> moving{.shape = {0.1F}, .contact = Contact::separate, .friction = 0.2};
        moving.position = Vec<double, D>::filled(side);
        moving.linear_velocity = Vec<double, D>::filled(-1);
        return moving;
    }
    static Vec<double, D> fall() {
        Vec<double, D> velocity = Vec<double, D>::filled(-2);
        velocity[0] = -1;
        return velocity;
    }
    bool wants(const std::string& feature) const { return chosen.empty() || chosen.contains(feature); }

    /// Compares impulses in the last step, of which there are some.
    static void check_same_impulses(const std::string& what, const std::vector<Reaction<D>>& expected,
                                    const std::vector<Reaction<D>>& got) {
        double largest = 0, worst = 0;
        for (std::size_t k = 0; k < expected.size(); ++k) {
            largest = std::max(largest, norm(expected[k].impulse));
            worst = std::max(worst, norm(got.at(k).impulse - expected[k].impulse));
        }
        check(largest > 0 && worst <= 1e-6 * largest, what, sentence(worst, " of ", largest));
    }
    static void check_same_reactions(const std::string& name, const Reactions<D>& expected, const Reactions<D>& got) {
        check_same_impulses(name + "reactions", expected.parts, got.parts);
        if (!expected.loads.empty())
            check_same_impulses(name + "reactions of loads", impulses_of_loads(expected), impulses_of_loads(got));
    }

    /// Matter that has taken some steps. `change` gives the simulation what is no policy.
    template <class Material, class Change, class... Policies>
    auto moving(const Material& material, const Change& change, const Policies&... policies) const {
        auto simulation = made<D>(material, cell_size(), 0, policies...);
        simulation.execution.float_steps = true;
        if constexpr (decltype(simulation)::material_count == 1) {
            simulation.add(block(), 1000, fall());
            strain<D>(simulation.edit_particles());
        }
        change(simulation);
        if (!is_bounded) simulation.fixed_time_step = 0.2 * simulation.stable_time_step();
        for (int k = 0; k < 8; ++k) simulation.step();
        return simulation;
    }
    /// Compares one step of it.
    template <class Material, class Change, class... Policies>
    void has_same_bits(const std::string& feature, const Material& material, const Change& change,
                       const Policies&... policies) const {
        if (wants(feature)) one_step(feature, moving(material, change, policies...));
    }
    /// Compares one step of a feature. \param acceleration  in place of gravity, if it is given
    template <class Simulation, class... Acceleration>
    void one_step(const std::string& feature, Simulation cpu, const Acceleration&... acceleration) const {
        auto gpu = webgpu::on_gpu(cpu, device);
        for (int k = 0; k < (is_bounded ? 3 : 1); ++k) cpu.step(acceleration...), gpu.step(acceleration...);
        const std::string name = sentence(D, "D, ", particles, ", ", feature, ": ");
        if constexpr (Simulation::material_count == 1) {
            check_same_run(name, cpu, gpu);
            if (cpu.reactions) check_same_reactions(name, *cpu.reactions, gpu.reactions());
        } else {
            check_same_state(name, firn::state_of(cpu.template set<0>()), firn::state_of(gpu.edit().template set<0>()));
            check_same_state(name, firn::state_of(cpu.template set<1>()), firn::state_of(gpu.edit().template set<1>()));
        }
    }
};

const auto unchanged = [](auto&) {};

template <int D>
void policies(const Corner<D>& corner) {
    const auto jelly = Jelly::from_young_poisson(2e4, 0.3);
    const auto walls = scenes::rough_walls<D>();
    const auto of_jelly = [&](const std::string& feature, const auto&... policies) {
        corner.has_same_bits(feature, jelly, unchanged, policies...);
    };
    of_jelly("APIC", walls);
    of_jelly("PIC", walls, Pic{});
    of_jelly("FLIP", walls, Flip{0.9});
    of_jelly("AFLIP", walls, Aflip{0.95});
    of_jelly("ASFLIP", walls, Asflip{});
    of_jelly("FMPM", walls, Fmpm{3});
    of_jelly("linear kernel", walls, Linear{}, WeightGradientForce{});
    of_jelly("weight gradients", walls, WeightGradientForce{});
    of_jelly("cubic kernel", walls, CubicBSpline{}, WeightGradientForce{});
    of_jelly("compact quartic kernel", walls, CompactQuartic{}, WeightGradientForce{});
    of_jelly("mirrored walls", scenes::mirrored_walls<D>());
    of_jelly("F-bar", walls, FBar{});
    of_jelly("a ball", Together(walls, corner.ball()));
    Collider<DistanceGrid<float, D>> sampled{
        .shape = {sampled_distance<D>(
            [](const Vec<double, D>& x) { return norm(x) - 0.1; },
            {.lower = Vec<double, D>::filled(-0.2), .upper = Vec<double, D>::filled(0.2), .spacing = 0.05})},
        .friction = 0.4};
    sampled.position = corner.ball().position;
    of_jelly("a grid of distances", sampled);
    corner.has_same_bits("volume filter", Fluid<float>{}, unchanged, walls, VolumeFilter{.every = 3, .shifting = 0});
    corner.has_same_bits("particle shifting", Fluid<float>{}, unchanged, walls, VolumeFilter{.every = 3});
}

template <int D>
void materials(const Corner<D>& corner) {
    const auto walls = scenes::rough_walls<D>();
    const auto of = [&](const std::string& feature, const auto& material) {
        corner.has_same_bits(feature, material, unchanged, walls);
    };
    of("NeoHookean", NeoHookean<float>{});
    of("Hencky", Hencky<float>{});
    of("Snow", Snow<float>{});
    of("Sand", Sand<float>{});
    of("VonMises", VonMises<float>{});
    of("Nacc", Nacc<float>{});
    of("MohrCoulomb", MohrCoulomb<float>{});
    of("ModifiedCamClay", ModifiedCamClay<float>::from_properties({.compression = 1.2, .swelling = 0.6}));
    of("Fluid", Fluid<float>::from_properties({.viscosity = 5}));
    of("Dissipating", Dissipating<VonMises<float>>{});
    of("PerParticle", PerParticle<Sand<float>, "mu", "lambda">{});
    of("a material that asks", scenes::Graded<float>{});
    of("sand that asks", scenes::GradedSand<float>{});
    if constexpr (D == 2) {
        of("PlaneStrain", PlaneStrain<Sand<float>>{});
        of("PlaneStrain of what asks", PlaneStrain<scenes::GradedSand<float>>{});
        of("PlaneStrain of a viscous fluid",
           PlaneStrain<Fluid<float>>{Fluid<float>::from_properties({.viscosity = 5})});
    }
    corner.has_same_bits(
        "two materials", Materials<Jelly, Fluid<float>>(Jelly::from_young_poisson(2e4, 0.3), {}),
        [&](auto& simulation) {
            simulation.template set<Jelly>().add(corner.block(), 1000, corner.fall());
            simulation.template set<Fluid<float>>().add(corner.block(1), 1000, corner.fall());
        },
        walls);
}

/// Compares one step of a simulation in a domain that is periodic along all axes but the first.
template <int D>
void periodic_axes(const Corner<D>& corner) {
    if (!corner.wants("periodic axes")) return;
    Domain<D> ring;
    ring.cell_size = 1.0 / (16 * std::ceil(1 / corner.cell_size() / 16));  // as a periodic axis wants it
    ring.periodic.fill(true);
    ring.periodic[0] = false;
    Simulation round(ring, Jelly::from_young_poisson(2e4, 0.3), scenes::Integers{},
                     scenes::walls_across_first_axis<D>());
    round.warn = {};
    round.add(corner.block(), 1000, 20 * corner.fall());
    strain<D>(round.edit_particles());
    round.fixed_time_step = 0.2 * round.stable_time_step();
    for (int k = 0; k < 8; ++k) round.step();
    corner.one_step("periodic axes", std::move(round));
}

/// What is no policy: loads, a source and a sink, reactions, steps at their bound.
template <int D>
void events(const Corner<D>& corner) {
    const auto jelly = Jelly::from_young_poisson(2e4, 0.3);
    const auto walls = scenes::rough_walls<D>();
    corner.has_same_bits(
        "loads", jelly,
        [](auto& simulation) {
            simulation.add_load(simulation.bodies()[0], UniformForce<D>([](double time) {
                                    return (1 + 1e3 * time) * Vec<double, D>::filled(1e-2);
                                }));
        },
        walls);
    corner.has_same_bits(
        "a source and a sink", jelly,
        [&](auto& simulation) {
            const Vec<double, D> lower = Vec<double, D>::filled(0.5),
                                 upper = lower + Vec<double, D>::filled(3 * corner.spacing());
            simulation.add_source({.samples = sample_box<D>(lower, upper, {.spacing = corner.spacing()}),
                                   .density = 1000,
                                   .velocity = corner.fall(),
                                   .rate = 2e4,  // in every step, several times
                                   .lifespan = 3e-4});
            simulation.add_sink({.lower = Vec<double, D>::filled(0.1), .upper = Vec<double, D>::filled(0.2)});
        },
        walls);
    corner.has_same_bits(
        "reactions", jelly, [](auto& simulation) { simulation.reactions.emplace(); }, Together(walls, corner.ball()));
    corner.has_same_bits(
        "loads and their reactions", jelly,
        [&](auto& simulation) {
            simulation.reactions.emplace();
            simulation.add_load(simulation.bodies()[0],
                                UniformForce<D>([](double) { return Vec<double, D>::filled(1e-2); }));
        },
        walls);
    if (corner.wants("attraction"))
        corner.one_step("attraction", corner.moving(jelly, unchanged, walls),
                        Attraction<float, D>{.centre = Vec<double, D>::filled(0.4), .radius = 0.5F, .strength = 30});
    if (corner.wants("damping"))
        corner.one_step("damping", corner.moving(jelly, unchanged, walls), Damped<float, D>{.rate = 40});
    Corner<D> bounded = corner;
    bounded.is_bounded = true;
    bounded.has_same_bits("steps at their bound", jelly, unchanged, walls);
}

template <int D>
void all(const std::set<std::string>& chosen) {
    const webgpu::Device device;
    for (const std::size_t particles : {1000, 10000}) {
        const Corner<D> corner{particles, chosen, device};
        policies(corner);
        materials(corner);
        periodic_axes(corner);
        events(corner);
    }
}

}  // namespace

int main(int argc, char** argv) {
    try {
        const std::set<std::string> chosen(argv + 1, argv + argc);
        all<2>(chosen);
        all<3>(chosen);
    } catch (const std::exception& e) {
        check(false, "the test", e.what());
    }
    return finish();
}
