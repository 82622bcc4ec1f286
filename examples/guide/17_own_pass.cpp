//! # A pass of your own
//!
//! A step is a list of passes: "sort", "push" (loads and forces), "p2g", "grid update", "g2p", "end g2p", "sinks and
//! sources". Policies add theirs: FMPM "refine velocities", a contact law "contact", F-bar "average volumes", GapContact
//! "find gaps" and "act by gap"; [implicit steps](19_implicit_steps.cpp) have "loads" and "solve" in place of "push" and
//! "grid update". `simulation.passes()` has them in order, each with what it reads and writes.
//!
//! A pass of your own is a function that gets the simulation and the present step. It stands behind another pass, acts
//! in every step, and a copy of the simulation has it, too. So a controller, a probe or a field of your own on the grid
//! needs no loop around `step()`, and works with `advance()`.
//!
//! In the scene of this page, a press squeezes a block with a force that is wanted.
#include <firn/firn.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>

int main() {
    const double h = 1.0 / 32, wanted = 2000;  // [m], [N per metre of thickness]
    const firn::Domain<2> domain{{0, 0}, {1, 1}, h};
    const firn::Collider<firn::Box<float, 2>> press{.shape = {.half_extents = {0.4F, 0.1F}}, .position = {0.5, 0.52}};
    const auto walls = firn::Walls<float, 2>::all(domain.lower, domain.upper, {});
    firn::Simulation simulation(domain, firn::FixedCorotated<float>::from_young_poisson(1e5, 0.3),
                                firn::Together(walls, press));
    simulation.add(firn::sample_box<2>({0.3, 0}, {0.7, 0.4}, {.spacing = h / 2}), 1000);
    simulation.gravity = {0, 0};

    //! ## A controller in five lines
    //!
    //! The force on the press in the last step is the impulse on it over the time step. The pass moves the press down
    //! while the force is below the wanted one. `auto& simulation` is the simulation itself, so that the pass may change
    //! its boundary, its loads and its gravity; it does not refer to the simulation that it was added to, which may be
    //! copied. `now.dt` is the time step [s].
    simulation.reactions.emplace();
    double force = 0;
    simulation.add_pass("controller", "grid update", [&force, wanted](auto& run, const auto& now) {
        const double measured = run.reactions->parts.back().impulse[1] / now.dt;  // of the press on the block
        force += 0.02 * (-measured - force);                                      // smoothed
        std::get<1>(run.boundary.parts).linear_velocity = {0, -1e-4 * (wanted - force)};
    });

    //! ## Where the time goes
    //!
    //! `times` measures the passes from now on. It costs as much as reading a clock twice a pass.
    simulation.times.emplace();
    simulation.advance(1);
    std::printf("the press pushes with %.0f N, wanted are %.0f N\n", force, wanted);
    for (const auto& [name, seconds] : simulation.times->seconds)
        std::printf("%20s  %6.1f us a step\n", name.c_str(), 1e6 * seconds / double(simulation.steps()));

    //! ## What a pass must know
    //!
    //! - Nodes hold momenta and masses behind "p2g", velocities and masses behind "grid update". A pass that reads or
    //!   writes them says so: `add_pass(name, after, act, kind, reads, writes)`. If nothing before it writes what it
    //!   reads, it is refused.
    //! - On many ranks, every rank runs the pass. A sum over all is `now.ranks.sum(…)`.
    //! - A pass that throws ends the step. Between "g2p" and "end g2p" the particles are then lost; elsewhere the
    //!   simulation can go on.
    return std::abs(force - wanted) < 0.05 * wanted ? EXIT_SUCCESS : EXIT_FAILURE;
}
