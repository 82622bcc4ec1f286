/// \file The bound of the time step (the largest stable step), from the signal speeds of particles, the motion of the
/// boundary, and forces between particles.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/simulation/blow_up.hpp>
#include <firn/stage/time_step.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <tuple>

namespace firn::detail {

/// The largest allowed time step, as a fraction of the largest stable step for the forces between particles. The
/// fraction is less than 1 because the stiffness of these forces changes with strain.
inline constexpr double force_safety = 0.5;

/// Returns the largest signal speed |v| + c of all particles [m/s], from the reports of all sets. A signal speed of NaN
/// is ignored.
template <class Sets>
double fastest_signal(const Sets& sets) {
    double fastest = 0;
    std::apply([&](const auto&... set) { ((fastest = std::max(fastest, set.report.signal_speed)), ...); }, sets);
    return fastest;
}

/// Returns the largest speed [m/s] that the boundary can give to nodes of the domain.
template <class S, class Boundary, int D>
double speed_of_boundary(const Boundary& boundary, const Domain<D>& domain) {
    if constexpr (boundary_fits<Boundary, S, D>::value)
        return largest_speed(on_grid(boundary, domain.cell_size), domain.lower, domain.upper);
    return 0;
}

/// Returns the bound of the time step that results from forces between particles [s]; infinite if there are no such
/// forces.
template <class Sets>
double force_bound(Sets& sets, double time, int threads) {
    double bound = std::numeric_limits<double>::infinity();
    const auto look = [&](auto& set) {
        if (set.forces) bound = std::min(bound, force_safety * set.forces->largest_step(set.particles, time, threads));
    };
    std::apply([&](auto&... set) { (look(set), ...); }, sets);
    return bound;
}

/// Returns a sentence that tells what limits the time step.
/// \param of_boundary  the largest speed that the boundary gives to nodes [m/s]
/// \param of_forces    bound of the time step that results from forces between particles [s]
/// \param ranks        what the processes of the run tell each other: one of them has the fastest particle
template <class Kernel, class Sets, int D, class Ranks>
[[gnu::cold]] std::string reason_of_bound(Sets& sets, const Domain<D>& domain, double of_boundary, double of_forces,
                                          const Ranks& ranks) {
    const double fastest = fastest_signal(sets);
    if (of_forces < stable_time_step<Kernel>(domain.cell_size, std::max(fastest, of_boundary)))
        return "It is set by forces between particles: take softer ones, or larger masses.";
    if (of_boundary > fastest)
        return sentence("It is set by the boundary, which moves at up to ", of_boundary, " m/s.");
    const double at_least = ranks.share().parts > 1 ? fastest * (1 - 1e-6) : 0;
    return ranks.text_of_first(fastest_particle(sets, domain, at_least));
}

/// Throws a particle_error because the bound of the time step is zero or not finite.
/// \param fastest  the largest signal speed [m/s]: zero, or not finite
[[noreturn, gnu::cold]] inline void throw_at_rest(double fastest) {
    throw particle_error(
        sentence("The fastest signal among the particles (their speed, plus the material's wave speed) is ", fastest,
                 " m/s; velocities and deformation gradients must be finite, and the moduli positive."));
}

[[noreturn, gnu::cold]] inline void throw_spoiled(std::uint64_t step) {
    throw particle_error(sentence("Step ", step,
                                  " failed half-way. Its particles can be used neither for a step nor for a state. "
                                  "Go on from the last state that was written: restore()."));
}
[[noreturn, gnu::cold]] inline void throw_overflow(const overflow_error& failure, std::uint64_t step, double dt,
                                                   double time, double times_the_bound) {
    throw overflow_error(sentence("At step ", step, ", of ", dt, " s from ", time, " s on (", times_the_bound,
                                  " times the bound of the time step): ", failure.what()));
}

/// Throws an error because a step of dt [s] is too small to change the time: a parameter_error if the program chose the
/// step, a particle_error if the step is the bound of the time step.
/// \param reason  a sentence that tells what limits the time step; empty if the program chose the step
[[noreturn, gnu::cold]] inline void throw_no_step(double dt, double time, std::uint64_t step,
                                                  const std::string& reason) {
    const std::string nowhere = sentence(" of ", dt, " s is too small to change the time of ", time, " s");
    if (reason.empty())
        throw parameter_error("A step" + nowhere + ": give a larger one. It must be positive and finite.");
    throw particle_error(sentence("At step ", step, " the bound", nowhere, ", and larger steps are not stable. ",
                                  reason, " The simulation cannot go on. States written before are still good."));
}

}  // namespace firn::detail
