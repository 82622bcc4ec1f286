/// \file Bodies of bound.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/simulation/blow_up.hpp>
#include <firn/simulation/bound.hpp>

namespace firn::inline FIRN_BUILD::detail {

[[gnu::cold]] FIRN_BODY void throw_wrong_signal(double fastest) {
    throw particle_error(
        sentence("The fastest signal among the particles (their speed, plus the material's wave speed) is ", fastest,
                 " m/s; there must be particles, their velocities and deformation gradients must be finite, and the "
                 "moduli positive."));
}

[[gnu::cold]] FIRN_BODY double throw_at_rest() {
    throw particle_error(
        "Nothing limits the time step: no particle moves, the material has no stiffness, and neither an acceleration "
        "nor the boundary moves it. Set fixed_time_step, or give the particles a velocity, gravity or a force.");
}

[[gnu::cold]] FIRN_BODY void throw_spoiled(std::uint64_t step) {
    throw particle_error(sentence("Step ", step,
                                  " failed half-way. Its particles can be used neither for a step nor for a state. "
                                  "Go on from the last state that was written: restore()."));
}

[[gnu::cold]] FIRN_BODY void throw_overflow(const overflow_error& failure, std::uint64_t step, double dt, double time,
                                            double times_the_bound) {
    throw overflow_error(sentence("At step ", step, ", of ", dt, " s from ", time, " s on (", times_the_bound,
                                  " times the bound of the time step): ", failure.what()));
}

[[gnu::cold]] FIRN_BODY void throw_no_step(double dt, double time, std::uint64_t step, const std::string& reason) {
    const std::string nowhere = sentence(" of ", dt, " s is too small to change the time of ", time, " s");
    if (reason.empty())
        throw parameter_error("A step" + nowhere + ": give a larger one. It must be positive and finite.");
    throw particle_error(sentence("At step ", step, " the bound", nowhere, ", and larger steps are not stable. ",
                                  reason, " The simulation cannot go on. States written before are still good."));
}

template <std::floating_point S, int D>
double StepInputs<S, D>::of_forces() const {
    double bound = std::numeric_limits<double>::infinity();
    for (SetOf<S, D>& set : sets)
        if (set.forces) bound = std::min(bound, force_safety * set.forces->largest_step(set.store(), time, threads));
    return bound;
}

template <std::floating_point S, int D>
double StepInputs<S, D>::of_pushes() const {
    double largest = 0;
    bool any = false;
    for (SetOf<S, D>& set : sets)
        for (auto* pushes : {&set.loads, &set.forces}) {
            if (!*pushes) continue;
            any = true;
            largest = std::max(largest, (*pushes)->largest_acceleration(set.store(), time, threads));
        }
    return any ? ranks.largest(largest) : 0;
}

template <std::floating_point S, int D>
double StepInputs<S, D>::of_sources() const {
    double bound = std::numeric_limits<double>::infinity();
    for (const SetOf<S, D>& set : sets)
        for (const auto& source : set.sources)
            if (const double due = source.time_of(source.bursts); due <= source.end)
                bound = std::min(bound, std::max(due - time, 0.0) + of_signal(norm(source.velocity)));
    return bound;
}

/// Returns a time [s], rounded downwards to a float if that is asked for.
FIRN_BODY double in_given_digits(double time, bool in_float) {
    if (!in_float) return time;
    const float rounded = float(time);
    return double(double(rounded) > time ? std::nextafter(rounded, 0.0F) : rounded);
}

template <std::floating_point S, int D>
double StepBound::find(const StepInputs<S, D>& of, double boundary_speed, double given) {
    const double fastest = fastest_signal(of.sets);
    of_boundary = boundary_speed;
    if (!(fastest > 0) && std::isfinite(next_burst(of.sets)) && !has_particles(of.sets, of.ranks))
        return step = in_given_digits(next_burst(of.sets) - of.time, of.in_float);  // the first particles
    const double of_forces = of.of_forces();
    acceleration = std::max(given, of.of_pushes());
    of_acceleration = of.of_acceleration(acceleration);
    const double bound =
        std::min({of.of_signal(std::max(fastest, of_boundary)), of_acceleration, of_forces, of.of_sources()});
    return step = in_given_digits(bound, of.in_float);
}

template <std::floating_point S, int D>
std::string StepBound::reason(const StepInputs<S, D>& of) const {
    const double fastest = fastest_signal(of.sets);
    const double of_signals = of.of_signal(std::max(fastest, of_boundary));
    if (of.of_forces() < std::min(of_signals, of_acceleration))
        return "It is set by forces between particles: take softer ones, or larger masses.";
    if (of_acceleration < of_signals)
        return sentence("It is set by an acceleration of ", acceleration,
                        " m/s^2, which moves matter at rest by a sixteenth of a cell in such a step.");
    if (of_boundary > fastest)
        return sentence("It is set by the boundary, which moves at up to ", of_boundary, " m/s.");
    const double at_least = of.ranks.share().parts > 1 ? fastest * (1 - 1e-6) : 0;
    return of.ranks.text_of_first(fastest_particle(of.sets, at_least));
}

}  // namespace firn::inline FIRN_BUILD::detail
