//! # What engineers measure
//!
//! Loads, sources and sinks put matter under known conditions. Totals, reactions and fields of particles tell you what
//! happened.
#include <firn/firn.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

int main() {
    //! ## A column under its own weight and a load
    //!
    //! An elastic column, 1 m high, stands between walls that slip; in 2D it is a slice one metre thick. A pressure of
    //! 2 kPa acts on its top. The program applies it as a force on each particle of the top layer.
    const double E = 1e6, density = 1500, spacing = 1.0 / 40, pressure = 2000;
    const firn::Domain<2> box{.lower = {0, 0}, .upper = {0.25, 1.25}, .cell_size = 2 * spacing};
    const auto walls = firn::Walls<double, 2>::all({0, 0}, {0.25, 1.25}, {firn::Contact::slip, 0});
    firn::Simulation simulation(box, firn::Hencky<double>::from_young_poisson(E, 0.0), walls);
    const auto column = simulation.add(firn::sample_box<2>({0, 0}, {0.25, 1 - spacing}, {.spacing = spacing}), density);
    const auto top = simulation.add(firn::sample_box<2>({0, 1 - spacing}, {0.25, 1}, {.spacing = spacing}), density);

    //! `add_load` takes a function of position and time. The function returns the force on one particle [N]. The load
    //! grows over half a second, so that the column does not swing. What `add_load` returns names the load:
    //! `remove_load` ends it. A force that is the same on all particles of the body may be a firn::UniformForce, which
    //! is a function of the time alone: such loads run on a GPU, too.
    const double force = pressure * 0.25 / double(top.count);
    const firn::LoadId load = simulation.add_load(top, [=](const firn::Vec<double, 2>&, double time) {
        return firn::Vec<double, 2>{0.0, -force * std::min(time / 0.5, 1.0)};
    });
    //! firn::Damped slows down all motion at a rate [1/s]. It is the quick way to a state at rest. `advance` uses it
    //! instead of `simulation.gravity`, so gravity is given here. It grows with the load. (`Damped{.rate = 20}` alone
    //! has no gravity; a simulation warns of that.)
    for (int i = 1; i <= 20; ++i)
        simulation.advance(0.1, firn::Damped<double, 2>{.field = {{0, -9.81 * std::min(i / 5.0, 1.0)}}, .rate = 20});

    //! ## Totals
    //!
    //! `totals` returns sums over the particles of a set: mass, momentum, angular momentum, first moment, kinetic and
    //! elastic energy. The first moment divided by the mass is the centre of mass. The sums are exact, and have the
    //! same bits on any number of threads.
    const auto sums = simulation.totals();
    std::printf("mass %.1f kg, kinetic energy %.2g J\n", sums.mass, sums.kinetic_energy);

    //! ## Stresses
    //!
    //! Every particle has a Kirchhoff stress τ = J σ [Pa]. The vertical stress at depth z must be −(p + ρ g z).
    const auto& particles = simulation.particles();
    double surface = 0, worst = 0;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) surface = std::max(surface, double(particles.position(slot)[1]) + spacing / 2);
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const auto x = particles.position(slot);
        if (x[1] < 0.2 || x[1] > 0.8) continue;  // two cells from the ends
        const double expected = -(pressure + density * 9.81 * (surface - x[1]));
        worst = std::max(worst, std::abs(double(particles.stress(slot)(1, 1)) / expected - 1));
    }
    std::printf("vertical stress within %.1f %% of p + ρ g z\n", 100 * worst);

    //! ## Reactions
    //!
    //! Reactions are the impulses that the walls gave to matter in a step. The upward impulse must balance the weight
    //! and the load. Damping would change this impulse, so this step has no damping.
    simulation.reactions.emplace();
    simulation.step();
    const double borne = simulation.reactions->parts[0].impulse[1] / simulation.last_time_step();
    const double weight = sums.mass * 9.81 + pressure * 0.25;
    std::printf("the floor bears %.0f N; weight and load are %.0f N\n", borne, weight);

    //! The impulses of loads are among the reactions, too. Floor, load and weight balance:
    const double pressed = simulation.reactions->of(load).impulse[1] / simulation.last_time_step();
    std::printf("the load presses with %.1f N, by the program %.1f N\n", -pressed, pressure * 0.25);

    //! ## To begin at rest
    //!
    //! Matter that is added has no stress, and gravity makes it fall onto itself. Either let it settle, as above:
    //! `advance` with firn::Damped and a gravity that grows, until `totals().kinetic_energy` is small; then go on
    //! without damping from there, or from a copy of the simulation. Or let a [quasi-static
    //! step](19_implicit_steps.cpp) find the state at rest. Or give it the stress that it will have. At the
    //! depth z of a level bed between walls that slip, with M = E (1 − ν)/((1 + ν)(1 − 2ν)):
    //!
    //! ```cpp
    //! simulation.set_states(bed, [&](const auto& x, auto& state) {
    //!     state.F = firn::Mat<double, 2>::rows(1, 0, 0, std::exp(-density * 9.81 * (top - x[1]) / M));
    //! });
    //! ```
    //!
    //! A bed of sand, 0.5 m deep (E = 1 MPa, ν = 0.3, h = 1/32 m), then moves by 0.03 mm, and its vertical stress is
    //! off by 1.5 % after a second; without, it moves by 2 mm and swings, and the stress is off by 42 %. The horizontal
    //! stress is ν/(1 − ν) of the vertical one.
    //!
    //! Sand has no cohesion. For soil that stands in a cut or bears tension, take firn::Nacc: its largest tension is
    //! `cohesion` times its `consolidation` pressure. For clay that keeps its
    //! volume, firn::VonMises has the shear strength.
    //!
    //! ## Where matter comes from and goes to
    //!
    //! ```cpp
    //! simulation.add_source(firn::Source<3>::jet(layer, spacing, 1000, {2, 0, 0}));   // a jet without gaps
    //! simulation.add_sink({.lower = {1.8, 0, 0}, .upper = {2, 1, 1}});                // takes out what enters
    //! simulation.remove_if([](const auto& x, std::uint32_t) { return x[1] < 0.1; });  // at once
    //! ```
    return worst < 0.05 && std::abs(borne / weight - 1) < 0.02 && std::abs(pressed / (pressure * 0.25) + 1) < 1e-6 &&
                   column.count > 0
               ? 0
               : 1;
}
