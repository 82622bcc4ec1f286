/// \file The bound of the time step: the largest stable step.
#pragma once

#include <firn/core/error.hpp>
#include <firn/data/kernel_facts.hpp>
#include <firn/kernel/concept.hpp>
#include <firn/material/concept.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>

namespace firn::inline FIRN_BUILD {

/// Returns the safety factor of a kernel with this courant_limit. \see time_step_safety
constexpr double time_step_safety_of(double courant_limit) { return 0.6 * (courant_limit / 1.6329931618554521); }

/// The factor f for which f h / (|v| + c) is the largest safe time step. h is the cell size, v the velocity and c the
/// wave speed of a particle.
///
/// In matter without gaps, symplectic Euler is stable for steps up to courant_limit × h/c; this is 1.63 h/c for
/// quadratic B-splines. Unevenly spaced particles and MLS forces need smaller steps. For a single particle, the squared
/// angular frequency ω² is at most (c²/h²) max Σ N'²/N. The sum is taken over the nodes, with their weights N and the
/// derivatives N' of the weights; the maximum is taken over the positions of the particle. More particles do not raise
/// this value. The limit 2/ω of the time step is then 0.82 h/c for the quadratic and 1.13 h/c for the cubic spline. So
/// the same fraction of the courant_limit is safe for both splines.
template <class Kernel>
inline constexpr double time_step_safety = time_step_safety_of(Kernel::courant_limit);

/// The factor f for which f √(h/a) is the largest time step with an acceleration a [m/s²]; in this step, a moves matter
/// at rest by a dt² = f² h, a sixteenth of the cell size h.
inline constexpr double acceleration_safety = 0.25;

/// Returns the signal speed of a particle [m/s]: |v| + c, with the velocity v and the wave speed c. If the material has
/// a diffusivity d [m²/s], 2 d/h is added, with the cell size h. Returns 0 for a particle without mass.
///
/// Why 2 d/h: on a grid of lumped masses, viscosity damps a wave at the rate λ = s d/h², where the factor s depends on
/// the wave (s is the symbol of the discrete Laplacian). With many particles per cell, the maximum of s over all waves
/// is 1.5 for quadratic B-splines and weight gradients, and 1.94 for MLS forces. With two or more particles per cell
/// along each axis, s is at most 2. In two and three dimensions s is not larger, because the weights along the other
/// axes only lower it. Symplectic Euler with stiffness ω² = s c²/h² and damping λ is stable for (ω dt)² + 2 λ dt < 4
/// (then, both roots of z² − (2 − ω²dt² − λdt) z + 1 − λdt lie in the unit circle). With a step of 0.6 h / (c + 2 d/h)
/// the left side of this condition is at most 1.2.
template <class Material, scalar S, int D, class State>
FIRN_INLINE S signal_speed(const Material& material, const Vec<S, D>& velocity, const S& mass, const S& volume,
                           const State& state, [[maybe_unused]] const S& cell_size) {
    const auto real = mass > S(0);
    const S density = select(real, mass, S(1)) / select(real, volume, S(1));
    S speed = norm(velocity) + wave_speed(material, density, state);
    if constexpr (has_diffusivity<Material, D>) speed = speed + S(2) * material.diffusivity(density, state) / cell_size;
    return select(real, speed, S(0));
}

namespace detail {
/// Checks a time step.
/// \throws parameter_error  if `dt` [s] is negative or not finite
inline void check_step(double dt) {
    if (!(dt >= 0) || !std::isfinite(dt))
        throw parameter_error(sentence("The time step is ", dt, " s; it must be finite and not negative."));
}
/// Checks the time that a run is to advance.
/// \tparam S  the scalar in which the run counts this time
/// \throws parameter_error  if `duration` [s] is negative, or not finite as an S
template <std::floating_point S = double>
void check_duration(double duration) {
    if (!(duration >= 0) || !std::isfinite(S(duration)))
        throw parameter_error(sentence("The time to advance is ", duration, " s; it must be finite and not negative."));
}
}  // namespace detail

/// The time that is left until a run arrives [s]: a number, and what rounding it has left out. Two floats hold 48 bits,
/// so that the time is still exact enough after many steps.
template <scalar S>
struct TimeLeft {
    S high;  ///< the time left, rounded
    S low;   ///< what `high` lacks
};

/// A step, and the time that is left after it.
template <scalar S>
struct StepWithin {
    S step;            ///< the step [s]
    TimeLeft<S> left;  ///< the time left after it; 0 after the last one
};

/// Returns the step to take when so much time is left: the bound; or all that is left, rounded, if that is not longer.
/// So no last step is left that is shorter than half of a unit in the last place of the step before it.
///
/// There are only sums, differences and comparisons, none of which a compiler can contract: a CPU and a GPU get the
/// same bits.
/// \param bound  the bound of the time step [s]
template <scalar S>
StepWithin<S> step_within(const TimeLeft<S>& left, const S& bound) {
    const auto is_last = left.high <= bound;
    const S step = select(is_last, left.high, bound);
    const S rest = settled(left.high - step), taken = settled(left.high - rest);
    const S low = settled(left.low + (taken - step)), high = settled(rest + low), added = settled(high - rest);
    return {step, {select(is_last, S(0), high), select(is_last, S(0), low - added)}};
}

/// Returns a time [s] in two floats.
inline TimeLeft<float> time_left(double time) {
    const float high = float(time);
    return {high, std::isfinite(high) ? float(time - double(high)) : 0};
}

/// The time that a run has reached [s], in two floats as the time left.
template <scalar S>
struct TimeReached {
    S high;  ///< the time, rounded
    S low;   ///< what `high` lacks
};

/// Returns the time after a step, without a compiler's freedom. \see step_within
/// \param dt  time step [s]
template <scalar S>
TimeReached<S> time_after(const TimeReached<S>& before, const S& dt) {
    const S sum = settled(before.high + dt), of_step = settled(sum - before.high);
    const S lost = settled(before.high - settled(sum - of_step)) + settled(dt - of_step);
    const S low = settled(before.low + lost), high = settled(sum + low);
    return {high, settled(low - settled(high - sum))};
}

/// Returns how far a velocity of 1 m/s moves matter in a step [cells]: dt / h.
/// \param dt  time step [s];  \param cell_size  h [m]
template <scalar S>
FIRN_INLINE S cells_per_velocity(const S& dt, const S& cell_size) {
    return dt / cell_size;
}

/// The time step of a pass, and how its displacements are rounded. A number of seconds is a TimeStep, too.
struct TimeStep {
    double dt;              ///< Time step [s].
    bool in_float = false;  ///< Whether dt was chosen in float, as a WGSL program does. \see FixedPoint::float_steps
    double start = 0;       ///< Time at which the step starts [s].

    /// Makes a step.
    TimeStep(double seconds, bool was_in_float = false, double from = 0)
        : dt(seconds), in_float(was_in_float), start(from) {}
    operator double() const { return dt; }  ///< Returns the time step [s].

    /// Returns the displacement of particles with a velocity of 1 m/s [cells]. It is rounded once; or, if the step was
    /// chosen in float, dt and h are rounded before they are divided.
    template <std::floating_point S>
    S cells_per_velocity(double cell_size) const {
        if (std::same_as<S, float> && in_float) return S(firn::cells_per_velocity(float(dt), float(cell_size)));
        return S(firn::cells_per_velocity(dt, cell_size));
    }
};

namespace detail {
/// Does the work of stable_time_step(). \param safety  \see time_step_safety
template <scalar S>
S step_of_signal(double safety, const S& cell_size, const S& largest_signal_speed) {
    return S(safety) * cell_size / largest_signal_speed;
}
}  // namespace detail

/// Returns the largest stable time step [s] for the signal speeds of the particles.
/// \param cell_size             cell size h [m]
/// \param largest_signal_speed  the largest signal speed of all particles [m/s]. \see signal_speed
template <class Kernel, scalar S>
S stable_time_step(const S& cell_size, const S& largest_signal_speed) {
    return detail::step_of_signal(time_step_safety<Kernel>, cell_size, largest_signal_speed);
}
/// Returns the largest stable time step [s], as above, in double.
template <class Kernel>
double stable_time_step(double cell_size, double largest_signal_speed) {
    return stable_time_step<Kernel, double>(cell_size, largest_signal_speed);
}
/// As stable_time_step(), for a kernel of which only the facts are known.
template <std::floating_point S>
S stable_time_step(const KernelFacts& kernel, S cell_size, S largest_signal_speed) {
    return detail::step_of_signal(time_step_safety_of(kernel.courant_limit), cell_size, largest_signal_speed);
}

/// Returns the largest time step [s] for an acceleration a [m/s²]: ¼ √(h/a), with the cell size h [m].
///
/// Matter that is slow and soft has a signal speed near 0, which allows a step in which it would fall many cells. After
/// a time t of free fall in such steps, matter is at most a t dt/2 = t √(a h)/8 too low, as symplectic Euler gives it
/// the velocity of the end of each step.
template <scalar S>
S acceleration_time_step(const S& cell_size, const S& acceleration) {
    return S(acceleration_safety) * sqrt(cell_size / acceleration);
}

/// Returns the bound of the time step [s] (the largest step) from signal speeds and accelerations; infinite if both are
/// 0.
/// \param cell_size             cell size h [m]
/// \param largest_signal_speed  the largest signal speed of all particles [m/s]. \see signal_speed
/// \param largest_acceleration  the largest acceleration at any node [m/s²]: that of gravity, for example
template <class Kernel>
double stable_time_step(double cell_size, double largest_signal_speed, double largest_acceleration) {
    return std::min(stable_time_step<Kernel>(cell_size, largest_signal_speed),
                    acceleration_time_step(cell_size, largest_acceleration));
}

}  // namespace firn::inline FIRN_BUILD
