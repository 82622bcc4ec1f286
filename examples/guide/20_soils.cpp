//! # Soils, and the third direction in two dimensions
//!
//! Slopes, footings and cuts are long, so they are computed in two dimensions; but the soil remains three-dimensional.
//! This page says what 2D means for a material, how ground begins in the stress of its own weight, how strength is
//! reduced in a run, and where pore water comes in. All of it is in `firn/soil.hpp`, beside `firn/firn.hpp`.
#include <firn/firn.hpp>
#include <firn/soil.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace {

using Point = firn::Vec<double, 2>;
constexpr double height = 2, h = 0.1, density = 2000, g = 9.81;  // [m], [m], [kg/m³], [m/s²]

//! ## What 2D means
//!
//! In two dimensions firn's plastic materials are models of two-dimensional matter: they take the deviator in the plane,
//! and keep no stress across it. firn::PlaneStrain runs the same material in three dimensions: nothing moves across the
//! plane, but the elastic and plastic parts of that strain may, so the stress across it carries load and yields. States
//! have it as `kirchhoff_stress_zz`.
//!
//! The two differ in strength. Sheared at φ = 30°, firn::Sand slips at 26.6° in 2D (τ/p = sin φ), and
//! `PlaneStrain<Sand>` at 34.7°: its cone touches the Mohr–Coulomb pyramid in triaxial compression, and plane strain is
//! no triaxial compression. To slip where Mohr–Coulomb does, in plane strain without dilatancy, the cone needs the slope
//! α = (√2/3) sin φ. Or take firn::MohrCoulomb, whose strength in plane strain is c and φ as they were measured.
//!
//! | you simulate | take |
//! | --- | --- |
//! | a cut through something long: a slope, a dam, a footing, rolled metal | `PlaneStrain<…>` |
//! | grains in a narrow channel, a picture of sand, a game in the plane | the material itself |
using Soil = firn::PlaneStrain<firn::MohrCoulomb<double>>;

auto ground(const Soil& soil) {
    const firn::Domain<2> domain{{0, 0}, {1, height + 0.4}, h};
    auto walls = firn::Walls<double, 2>::all(domain.lower, domain.upper, {firn::Contact::slip, 0});
    walls.at_upper[1].contact = firn::Contact::none;
    walls.nodes_behind = firn::NodesBehind::mirrored;
    firn::Simulation simulation(domain, soil, walls);
    simulation.gravity = {0, -g};
    simulation.add(firn::sample_box<2>({0, 0}, {1, height}, {.spacing = h / 2}), density);
    return simulation;
}
double fastest(const auto& simulation) {
    double most = 0;
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) most = std::max(most, double(norm(particles.velocity(slot))));
    return most;
}

//! ## Ground at rest
//!
//! Ground that is added without stress falls into its weight, bounces, and yields on the way. firn::set_at_rest lets each
//! particle begin in the elastic state that bears the stress at its depth: the weight above it, K₀ times that sideways,
//! and the pressure of the water below a water table. It serves every material with F or J in its state. Density and
//! volume are those of the loaded ground. firn::earth_pressure_at_rest gives K₀ from the angle of friction and the
//! over-consolidation.
bool ground_stands(const Soil& soil) {
    auto simulation = ground(soil);
    firn::set_at_rest(simulation.set(), simulation.bodies()[0],
                      {.surface = [](const Point&) { return height; },
                       .earth_pressure = firn::earth_pressure_at_rest(firn::degrees(30))});
    simulation.advance(0.2);
    auto falling = ground(soil);
    falling.advance(0.2);
    std::printf("level ground: %.1e m/s after 0.2 s; without its stress at the start, %.1e m/s\n", fastest(simulation),
                fastest(falling));
    return fastest(simulation) < 1e-3 && fastest(falling) > 1e-2;
}

//! Under a slope, or a building, the stress is another one. Begin with `earth_pressure = 1`, which yields nowhere, and
//! let firn::Damped bring the ground to rest; or raise it by a step of firn::QuasiStatic.
//!
//! ## Strength that changes in a run
//!
//! `edit_material()` changes parameters of the material during a run. Stresses and the bound of the time step follow,
//! states say that it was changed, and a restart takes the parameters from the state. firn::factor_of_safety uses it:
//! copies of ground at rest are tried with c and tan φ divided by a factor (`weaken()`), until one fails.
//!
//! Here a block of clay, φ = 0, stands free on a rough floor. It fails where ρ g H is a few times c.
bool block_has_a_factor(const firn::MohrCoulomb<double>& clay) {
    const firn::Domain<2> domain{{-2, 0}, {2, height + 0.4}, 2 * h};
    auto walls = firn::Walls<double, 2>::all(domain.lower, domain.upper, {firn::Contact::stick, 0});
    firn::Simulation block(domain, Soil{clay}, walls, firn::FBar{});
    block.gravity = {0, -g};
    block.add(firn::sample_box<2>({-1, 0}, {1, height}, {.spacing = h}), density);
    block.advance(1, firn::Damped<double, 2>{.field = {{0, -g}}, .rate = 20});
    const auto fails = [](auto& trial) {
        const auto top = [&] {
            double y = 0;
            const auto& particles = trial.particles();
            for (std::size_t slot = 0; slot < particles.slots(); ++slot)
                if (particles.is_particle(slot)) y = std::max(y, particles.exact_position(slot)[1]);
            return y;
        };
        const double before = top();
        trial.advance(2);
        return top() < before - 0.05 * height;
    };
    const auto weaken = [](Soil& soil, double factor) { soil.weaken(factor); };
    const firn::FactorOfSafety safety = firn::factor_of_safety(block, weaken, fails, {.highest = 10, .tolerance = 0.2});
    const double number = density * g * height / (clay.cohesion / safety.value());
    std::printf("block of clay: factor of safety %.1f, fails at rho g H / c = %.1f\n", safety.value(), number);
    return number > 2 && number < 6;
}

//! ## Soil that dilates, and F-bar
//!
//! If the dilatancy angle ψ is not zero, take `PlasticVolume<M>` with firn::FBar, in two dimensions
//! `PlaneStrain<PlasticVolume<M>>`. FBar averages the volume changes of the particles of a cell. With PlasticVolume, it
//! leaves each particle the part that its plastic flow asks for. FBar alone gives a footing on such soil many times
//! its limit load.
//!
//! ## Pore water
//!
//! `Undrained<M>` adds water that cannot leave the pores: the model bears the effective stress, and the water a pressure
//! that grows by K_w for each unit of compression. It is the field `pore_pressure`; firn::set_at_rest fills it below a
//! water table. In two dimensions write `PlaneStrain<Undrained<M>>`. Take firn::FBar with it, as wet soil keeps its
//! volume.
//!
//! ## p′, q and the Lode angle
//!
//! firn::add_stress_invariants adds them to a state before it is written: the mean effective pressure, the deviatoric
//! stress and the Lode angle of the Kirchhoff stress, as fields for ParaView.
//!
//! ## Materials that ask
//!
//! A material of your own may depend on where and when a particle is: give it a function `at(surroundings)` that returns
//! the material with the parameters that it has there. It is told position, velocity of the nodes, cell size, time and
//! density (firn::Surroundings), in every explicit and implicit step.

}  // namespace

int main() {
    const auto soil = firn::MohrCoulomb<double>::from_properties(
        {.young = 1e7, .poisson = 0.3, .cohesion = 2e3, .friction_angle = firn::degrees(30)});
    const auto clay = firn::MohrCoulomb<double>::from_properties(
        {.young = 1e6, .poisson = 0.3, .cohesion = 3e4, .friction_angle = firn::degrees(0)});
    return ground_stands(Soil{soil}) && block_has_a_factor(clay) ? EXIT_SUCCESS : EXIT_FAILURE;
}
