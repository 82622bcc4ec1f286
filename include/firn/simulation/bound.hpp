/// \file What the bound of the time step comes from: signals on the grid, the boundary's motion, forces between
/// particles.
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

/// Part of the largest step of the forces between particles that a step may take: stiffness changes with strain.
inline constexpr double force_safety = 0.5;

/// Of all particles, their velocity and the waves in them [m/s]; NaN where one is.
template <class Sets>
double fastest_signal(const Sets& sets) {
    double fastest = 0;
    std::apply([&](const auto&... set) { ((fastest = std::max(fastest, set.report.signal_speed)), ...); }, sets);
    return fastest;
}

/// The largest speed [m/s] that the boundary gives to nodes of the domain.
template <class S, class Boundary, int D>
double speed_of_boundary(const Boundary& boundary, const Domain<D>& domain) {
    if constexpr (boundary_fits<Boundary, S, D>::value)
        return largest_speed(on_grid(boundary, domain.cell_size), domain.lower, domain.upper);
    return 0;
}

/// Of the time step [s], for the forces between particles.
template <class Sets>
double force_bound(Sets& sets, double time, int threads) {
    double bound = std::numeric_limits<double>::infinity();
    const auto look = [&](auto& set) {
        if (set.forces) bound = std::min(bound, force_safety * set.forces->largest_step(set.particles, time, threads));
    };
    std::apply([&](auto&... set) { (look(set), ...); }, sets);
    return bound;
}

/// A sentence about what the bound comes from.
/// \param of_boundary  the largest speed of the boundary [m/s]
/// \param of_forces    the bound for the forces between particles [s]
template <class Kernel, class Sets, int D>
[[gnu::cold]] std::string reason_of_bound(Sets& sets, const Domain<D>& domain, double of_boundary, double of_forces) {
    const double fastest = fastest_signal(sets);
    if (of_forces < stable_time_step<Kernel>(domain.cell_size, std::max(fastest, of_boundary)))
        return "It is set by forces between particles: take softer ones, or larger masses.";
    if (of_boundary > fastest)
        return sentence("It is set by the boundary, which moves at up to ", of_boundary, " m/s.");
    return fastest_particle(sets, domain);
}

[[noreturn, gnu::cold]] inline void throw_at_rest(double fastest) {
    throw particle_error(
        sentence("The fastest signal among the particles (their speed, plus the material's wave speed) is ", fastest,
                 " m/s; velocities and deformation gradients must be finite, and the moduli positive."));
}

[[noreturn, gnu::cold]] inline void throw_spoiled(std::uint64_t step) {
    throw particle_error(sentence("Step ", step,
                                  " failed and has left particles that are of no use, neither for a step nor for a "
                                  "state. Go on from the last state that was written: restore()."));
}
[[noreturn, gnu::cold]] inline void throw_overflow(const overflow_error& failure, std::uint64_t step, double dt,
                                                   double time, double times_the_bound) {
    throw overflow_error(sentence("At step ", step, ", of ", dt, " s from ", time, " s on (", times_the_bound,
                                  " times the bound of the time step): ", failure.what()));
}

/// A step that time does not notice.
/// \param reason  what the step comes from, if it is the bound; empty: it was chosen
[[noreturn, gnu::cold]] inline void throw_no_step(double dt, double time, std::uint64_t step,
                                                  const std::string& reason) {
    const std::string nowhere = sentence(" of ", dt, " s leads nowhere from the time of ", time, " s");
    if (reason.empty())
        throw parameter_error("A step" + nowhere + ": it must be positive and finite, and not vanish beside the time.");
    throw particle_error(sentence("At step ", step, " a step", nowhere, ", and larger ones are not stable. ", reason,
                                  " The simulation cannot go on; what was written before is as it was."));
}

}  // namespace firn::detail
