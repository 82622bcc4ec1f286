//! # Derivatives of a run
//!
//! Which modulus explains this film? Which throw lands in the basket? A `firn::Adjoint` takes the steps of a
//! simulation, and goes back through them: it returns the derivatives of one number that the program measures, by all
//! that the program has set, for the price of a few runs. The header is `firn/adjoint.hpp`; programs that do not
//! include it pay nothing for it.
//!
//! In the scene of this page, a block of jelly falls on a floor. Its Young's modulus is to be found from
//! where its particles are soon after it has hit the floor.
#include <firn/adjoint.hpp>
#include <firn/firn.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

namespace {

using Jelly = firn::FixedCorotated<double>;
using Simulation = firn::SimulationWith<2, Jelly>;
using Points = std::vector<firn::Vec<double, 2>>;
constexpr double poisson = 0.3, seconds = 0.27;

Simulation block_of(double young) {
    Simulation simulation(firn::Domain<2>{{0, 0}, {1, 1}, 1.0 / 32}, Jelly::from_young_poisson(young, poisson));
    simulation.add(firn::sample_box<2>({0.3, 0.2}, {0.6, 0.4}, {.spacing = 1.0 / 64}), 1000);
    simulation.fixed_time_step = 1e-3;
    return simulation;
}

/// Where the particles are, by id.
Points positions(const Simulation& simulation) {
    const auto& particles = simulation.particles();
    Points all(particles.next_id());
    for (const std::uint32_t slot : firn::slots_by_id(particles, 0))
        all[particles.id(slot)] = particles.exact_position(slot);
    return all;
}

struct Distance {
    double value, by_young;  // its square [m²], and its derivative by ln E
};

//! ## One gradient
//!
//! The steps are taken with the adjoint's `advance()` and `step()` in place of the simulation's. `measure(f)` adds the
//! sum of `f` over the present particles to what is differentiated; `f` is a template over the scalar, like a material.
//! It may be called at several times; `measure_steps(f)` adds it after every step. `measure_reaction(part, f)` and
//! `measure_reaction_steps` measure what a wall or a collider exerts on matter. A program with a loss function of its
//! own calls `measure_own()` with the derivatives by positions and velocities. `gradient()` goes back; afterwards the
//! simulation is as before.
//!
//! The gradient has the names of what was set: `gradient.set().position[id]`, `velocity`, `affine`, `mass`, `volume`,
//! `state` of each particle; `gradient.set().material.mu` for all particles; `gradient.intervals[k].gravity`,
//! `acceleration`, `boundary`, `transfer` for each call of `advance()` or `step()`. So actuation in many intervals is
//! many calls. Of a collider that moves, `boundary` has the derivatives by its velocity and spin, with what they do to
//! its later places. Loads that are made by `differentiable_load(f)`, of a template `f` over the scalar, have their
//! derivatives in `gradient.intervals[k].loads`. `examples/22_walk.cpp` has muscles whose tensions are parameters of a material of its own.
Distance distance(double young, const Points& wanted) {
    Simulation simulation = block_of(young);
    firn::Adjoint adjoint(simulation, {.memory = std::size_t(64) << 20});
    adjoint.advance(seconds);
    const double value = adjoint.measure([&](const auto& p) {
        using T = std::remove_cvref_t<decltype(p.mass)>;
        const firn::Vec<T, 2> apart = p.position - firn::cast<T>(wanted[p.id]);
        return dot(apart, apart) * T(1.0 / double(wanted.size()));
    });
    const auto gradient = adjoint.gradient();
    // Both Lamé parameters are proportional to E.
    const Jelly jelly = simulation.material();
    const auto& by = gradient.set().material;
    return {value, by.mu * jelly.mu + by.lambda * jelly.lambda};
}

}  // namespace

int main() {
    const double truth = 3e4;  // [Pa]
    Simulation film = block_of(truth);
    film.advance(seconds);
    const Points wanted = positions(film);

    //! ## Using it
    //!
    //! Any optimiser takes the value and the gradient; here the secant method looks for where the derivative is zero.
    double before = std::log(2.4e4), now = std::log(2.6e4);
    double slope_before = distance(std::exp(before), wanted).by_young;
    for (int k = 0; k < 8; ++k) {
        const Distance at = distance(std::exp(now), wanted);
        std::printf("E = %7.1f Pa: distance %.2e m, derivative %9.2e m^2\n", std::exp(now), std::sqrt(at.value),
                    at.by_young);
        if (std::abs(at.by_young) < 1e-12) break;
        const double step = at.by_young * (now - before) / (at.by_young - slope_before);
        before = now, slope_before = at.by_young;
        now -= std::clamp(step, -0.2, 0.2);
    }

    //! ## How far to trust it
    //!
    //! The gradient is exact, up to rounding, for the steps that were taken: their sizes dt are held, also where firn
    //! has chosen them. That does not make it useful. These things do not show in a gradient:
    //!
    //! - **Branches.** Where matter yields, or leaves a wall, the derivative is that of the branch that was taken.
    //! - **Jumps.** A step is smooth while particles stay in their cells. Where one changes its cell, `MlsForce` is
    //!   once differentiable with the quadratic spline and twice with the cubic one. With `WeightGradientForce` and the
    //!   quadratic spline, the velocity gradient of a particle that is the first on a node jumps; cubic and
    //!   `CompactQuartic` weights have a kink at edges of matter; `Linear` jumps at every crossing; `Asflip` jumps with
    //!   the sign of tr ∇v. A collider's layer takes nodes and leaves them in jumps. A position that is kept at a face
    //!   of the domain has the derivative zero. Of `Linear`, `Asflip` and `WeightGradientForce` with the quadratic
    //!   spline, an `Adjoint` warns once.
    //! - **Chaos.** `gradient.position_norm` and `velocity_norm` tell how the adjoints grow from the end to the start.
    //!   If they grow by orders of magnitude, the gradient holds for tiny changes only. Measure earlier.
    //!
    //! `check(gradient, direction, h)` takes the recorded steps again with all inputs changed along a direction, a
    //! `gradient.zero()` that the program fills. Where the forward and the backward difference disagree, there is a
    //! kink; it also tells how many particles end in another cell.
    //!
    //! ## What it costs
    //!
    //! The way back needs the states before all steps. As many as `memory` allows are kept, and the steps between are
    //! taken again, to the bit. A program with little memory and many steps also gives a `folder` on a fast disk, and in
    //! `disk` how many bytes checkpoints may take there. The gradient of 500 steps of 144,054 particles takes six runs
    //! with 1 GiB; `benchmarks/README.md` has the numbers. Elastic materials of firn's own are cheapest; a plastic one,
    //! and your own, takes some times more, because its formulas are traced. A load takes some 100 ns a particle and
    //! step.
    //!
    //! ## What has no way back
    //!
    //! `FixedPoint`, ranks, contact groups, `GapContact` and `VolumeFilter` are refused by the compiler. Passes of your
    //! own, loads that are not made by `differentiable_load()`, and forces between particles are refused with a sentence
    //! when the `Adjoint` is made.
    //!
    //! Sources and sinks have a way back. `velocity[id]` of a particle from a source is the derivative by the velocity
    //! with which it came in. When a particle comes or goes is held.
    const double found = std::exp(now);
    std::printf("found %.1f Pa, true are %.1f Pa\n", found, truth);
    return std::abs(found / truth - 1) < 1e-4 ? EXIT_SUCCESS : EXIT_FAILURE;
}
