//! # Implicit and quasi-static steps
//!
//! An explicit step, the default, is bounded by the speed of sound: with four times the stiffness, a run takes twice as
//! many steps. Two other time integrations solve equations in each step, and have no such bound. They are policies, in
//! `firn/implicit.hpp`; programs that do not include it pay nothing for them.
//!
//! | you simulate | take |
//! | --- | --- |
//! | impacts, waves, flows, tearing: what is fast, or never at rest | firn::Explicit, the default |
//! | a state at rest: settlement, stresses under gravity, slow loads, the start of another run | firn::QuasiStatic |
//! | stiff matter that moves slowly: a step may last hundreds of times the explicit bound | firn::Implicit |
#include <firn/firn.hpp>
#include <firn/implicit.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace {

constexpr double h = 0.05, young = 1e7, density = 1000, g = 9.81;  // [m], [Pa], [kg/m³], [m/s²]

/// Returns a column of 0.2 m × 1 m between smooth walls, on a floor that holds it.
template <class Time>
auto column(const Time& time) {
    const firn::Domain<2> domain{.lower = {0, 0}, .upper = {0.2, 1.4}, .cell_size = h};
    auto walls = firn::Walls<double, 2>::all(domain.lower, domain.upper, {firn::Contact::slip, 0});
    walls.at_lower[1].contact = firn::Contact::stick;
    firn::Simulation simulation(domain, firn::Hencky<double>::from_young_poisson(young, 0.0), walls, time,
                                firn::WeightGradientForce{});
    simulation.add(firn::sample_box<2>({0, 0}, {0.2, 1}, {.spacing = h / 2}), density);
    return simulation;
}

//! ## Quasi-static steps
//!
//! A step of firn::QuasiStatic finds the displacement after which forces are in equilibrium with gravity, loads and the
//! boundary. There is no inertia: velocities are 0 after a step. Time only says how far loads and moving boundaries have
//! come, so `advance(1)` puts all of gravity on the matter at once. A second step under the same loads costs little, and
//! lets the grid's weights follow matter that has settled.
bool column_settles() {
    auto simulation = column(firn::QuasiStatic{});
    simulation.reactions.emplace();
    simulation.advance(1);
    const firn::StepSolution first = simulation.solution;
    simulation.advance(1);

    //! The floor bears the weight, to the tolerance of Newton's method, and the stress in the middle is ρ g × depth.
    const double weight = simulation.totals().mass * g;
    double borne = 0, stress = 0;
    for (const auto& part : simulation.reactions->parts) borne += part.impulse[1] / simulation.last_time_step();
    const auto& particles = simulation.particles();
    double nearest = 1, expected = 0;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const double y = particles.exact_position(slot)[1];
        if (std::abs(y - 0.5) >= nearest) continue;
        nearest = std::abs(y - 0.5);
        stress = particles.stress(slot)(1, 1);
        expected = -density * g * (1 - y);
    }
    std::printf("the floor bears %.4f of the weight; in the middle the stress is %.2f kPa, by theory %.2f kPa\n",
                borne / weight, 1e-3 * stress, 1e-3 * expected);

    //! `solution` tells how the last step was solved. A product is one product of the Hessian with a vector: it costs
    //! about as much as an explicit step of the same particles, and it is what a step's time goes to.
    std::printf("the first step took %d Newton steps and %d products; %zu nodes with little matter follow others\n",
                first.newton_steps, first.products, first.small_nodes);
    return std::abs(borne / weight - 1) < 2e-3 && std::abs(stress / expected - 1) < 0.02;
}

//! A load step that does not converge is halved until its parts do; `most_halvings` limits that. To follow a load or a
//! moving boundary on its way, set `fixed_time_step`, or call `advance` with short times.
//!
//! To go on from there with another time integration or another material, give positions and deformation gradients to a
//! second simulation: `examples/24_slope.cpp` raises a slope so, and lets it slide.
//!
//! ## Friction, and what has no equilibrium
//!
//! Walls and colliders act as in explicit steps: they hold, let slide, let go, and rub by Coulomb's law. A step looks for
//! the nodes that stick, slide and part, in rounds: `solution.rounds`. A block on a rough floor stays where it is as long
//! as tan α ≤ μ. Steeper, nothing holds it, and there is no equilibrium to be found: the step throws a
//! firn::convergence_error, and the particles are those before the step.
//!
//! Mirrored walls (firn::NodesBehind::mirrored) are planes of symmetry, or matter sticks to them: half of a body beside one
//! comes to rest as half of the whole body does, and a column settles on one to second order. On 20 cells its settlement is
//! right to 1.4e-4, on a floor that holds nodes to 1.7e-2. They take no more products.
bool block_holds(double angle) {
    const firn::Domain<2> domain{.lower = {0, 0}, .upper = {1.6, 0.6}, .cell_size = h};
    const auto walls = firn::Walls<double, 2>::all(domain.lower, domain.upper, {firn::Contact::separate, 0.5});
    firn::Simulation simulation(domain, firn::NeoHookean<double>::from_young_poisson(1e6, 0.3), walls,
                                firn::QuasiStatic{}, firn::WeightGradientForce{});
    simulation.add(firn::sample_box<2>({0.6, 0}, {1, 0.2}, {.spacing = h / 2}), density);
    simulation.gravity = {g * std::sin(angle), -g * std::cos(angle)};
    simulation.integration.most_halvings = 2;
    try {
        simulation.advance(1);
        std::printf("tan α = %.2f: the floor holds the block, after %d rounds\n", std::tan(angle),
                    simulation.solution.rounds);
        return true;
    } catch (const firn::convergence_error& problem) {
        std::printf("tan α = %.2f: %s\n", std::tan(angle), problem.what());
        return false;
    }
}

//! Sand and other matter that flows is solved for, too, by a method that needs no energy (GMRES). Where little of it flows
//! that takes as few products; near failure it takes many more, and a step may end in the error.
//!
//! The same is true of a body that nothing holds. Where loads push all matter along a direction in which no boundary holds
//! it, the step says so at once. Matter without stiffness against shear, such as a fluid without viscosity, is refused by a
//! firn::parameter_error. Take firn::Implicit or firn::TrBdf2: inertia is what holds it then. A fluid with viscosity
//! creeps.
//!
//! ## Implicit steps
//!
//! A step of firn::Implicit takes the forces at its end (backward Euler). Without a `fixed_time_step`, steps are as long
//! as matter needs to move by half a cell; a step in which a node moves farther is halved. Free fall and momentum are as
//! right as in explicit steps, and so are friction and contact with the boundary.
//!
//! **Waves that a step does not resolve die out.** With n steps a period, a vibration keeps (1 + (2π/n)²)⁻ⁿ of its energy
//! after one period: 46 % with 50 steps, 82 % with 200, next to nothing with 10. So a stiff body does not bounce. If
//! the bounce matters, resolve it: then explicit steps are cheaper. firn::TrBdf2 is of second order, for two solves a
//! step, and takes firn::Flip: with 10 steps a quarter of a period the error of a bar's vibration is 1.5e-3, that of
//! firn::Implicit 0.11.
double energy_left(int steps_a_period) {
    auto simulation = column(firn::Implicit{});
    simulation.gravity = {0, 0};
    const double period = 4 * std::sqrt(density / young);  // of the lowest vibration along the column
    auto& particles = simulation.edit_particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot))
            particles.set_velocity(slot, {0.0, 0.01 * std::sin(1.5708 * particles.exact_position(slot)[1])});
    const auto energy = [&] { return simulation.totals().kinetic_energy + simulation.totals().elastic_energy; };
    const double before = energy();
    simulation.fixed_time_step = period / steps_a_period;
    simulation.advance(period);
    return energy() / before;
}

}  // namespace

int main() {
    const bool settles = column_settles(), holds = block_holds(0.42), slides = !block_holds(0.5);
    bool decays = true;
    for (const int n : {50, 200}) {
        const double left = energy_left(n), theory = std::pow(1 + std::pow(2 * 3.14159265 / n, 2), -n);
        std::printf("with %3d steps a period, %.0f %% of the energy is left, by theory %.0f %%\n", n, 100 * left,
                    100 * theory);
        decays = decays && std::abs(left - theory) < 0.06;
    }
    return settles && holds && slides && decays ? EXIT_SUCCESS : EXIT_FAILURE;
}

//! ## What they cost
//!
//! Newton's method takes a few steps, each of some ten products with a matrix that is never stored. A multigrid keeps this
//! number where it is on finer grids; it grows with ν near ½, in 3D to about twice as many, and in matter that flows. This
//! is what it comes to beside explicit steps on the same grid, in processor time on one thread:
//!
//! | run | solved steps | explicit |
//! | --- | ---: | ---: |
//! | `firn_implicit_gain cantilever`: a slender beam of 4096 particles to rest | 1 step, 7 products, 0.018 s | 13,400 steps with damping, 2.0 s |
//! | `firn_implicit_gain slope 256`: an elastic slope of 73,742 particles to rest | 1 step, 7 products, 0.24 s | 825 steps with damping, 2.3 s |
//! | `firn_implicit_gain slope 1024`: the same with 1,179,941 particles | 1 step, 9 products, 5.8 s | 3280 steps with damping, 180 s |
//! | `25_stiff_jelly`: 1600 particles for 1.7 s, E = 1 GPa | 88 steps, 1060 products, 1.0 s | 163,000 steps, 9.5 s |
//! | `25_stiff_jelly --young 1e6 --steps 80`: the same for 0.5 s | 151 steps, 1060 products, 1.4 s | 1600 steps, 0.1 s |
//!
//! Explicit damping ends when little moves, and how little is for you to judge; a quasi-static step ends when forces
//! balance to `integration.newton.tolerance`, a part of the loads. Implicit steps pay where matter is stiff and slow. Soft
//! matter, as in the last line, is quicker by explicit steps.
//!
//! A simulation of these steps keeps 2 D² more numbers for each particle, and some ten layers of nodes.
//!
//! ## What can be set
//!
//! | `simulation.integration.` | |
//! | --- | --- |
//! | `newton.tolerance` | largest force out of balance, as a part of the loads: 1e-3. Reactions are as exact as that. Floats reach 1e-5 on 64² cells; a tolerance below rounding is refused, with the one that can be reached |
//! | `preconditioning` | a multigrid; or `block_jacobi`, for short implicit steps |
//! | `newton.iterations`, `newton.solver_iterations` | when Newton's method and its linear solves give up |
//! | `largest_motion` | of a node in a step, in cells: 0.5 in firn::Implicit, without limit in firn::QuasiStatic |
//! | `most_halvings`, `most_rounds` | when a step throws |
//! | `small_nodes.threshold` | nodes with less than this part of the fullest node's volume follow their neighbours: 0.1 |
//!
//! Nodes at the edge of matter, on which little hangs, have next to no stiffness, and Newton steps would run away with
//! them. They move as the linear function through the nodes beside them. This stiffens edges: a beam or a block of 32
//! cells by 0.1 %, Cook's membrane of 32 cells by 1 to 2 %. A threshold of 0.01 leaves all but corners free, and takes 1.5
//! to 1.8 times as many products; explicit steps know no small nodes.
//!
//! With firn::FBar, matter near ν = ½ and plastic flow do not lock. In steps of any size, it is the volume change
//! det(I + ∇u) that is averaged, not the trace of ∇u (firn::FBarOfStep); forces are those of explicit steps, so both come
//! to rest at the same place. Their Hessian is not symmetric then, so GMRES solves; a block of 64² cells took 18, 108, 252
//! and 1468 products for a load step to 1e-8, with ν = 0.3, 0.49, 0.499 and 0.4999.
//!
//! ## What they refuse
//!
//! | what | when |
//! | --- | --- |
//! | transfers other than firn::Flip with firn::TrBdf2 | the program does not compile |
//! | `VolumeFilter`; contact groups; `GapContact`, and boundaries of your own that ask for masses; several machines; GPUs; firn::Adjoint | the program does not compile |
//! | mirrored walls with friction, or from which matter may separate | firn::parameter_error |
//! | a step without a length: `step()` of firn::QuasiStatic without `fixed_time_step` | firn::parameter_error |
//! | matter without stiffness against shear in a step of firn::QuasiStatic | firn::parameter_error |
//! | loads along a direction in which nothing holds matter, in a step of firn::QuasiStatic | firn::convergence_error, with the sum of these loads |
//! | a load step without an equilibrium, a step in which matter moves too far | firn::convergence_error, with the forces out of balance after each Newton step |
//!
//! After an error, particles, time and boundary are those before the step, or before the part of it that failed. The
//! simulation can go on: with other loads, more Newton steps, or shorter steps.
