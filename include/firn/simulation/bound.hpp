/// \file The bound of the time step (the largest stable step), from the signal speeds of particles, the motion of the
/// boundary, and forces between particles.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/loops/ranks_of.hpp>
#include <firn/simulation/blow_up.hpp>
#include <firn/simulation/set_of.hpp>
#include <firn/stage/time_step.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

namespace firn::inline FIRN_BUILD::detail {

/// The largest allowed time step, as a fraction of the largest stable step for the forces between particles. The
/// fraction is less than 1 because the stiffness of these forces changes with strain.
inline constexpr double force_safety = 0.5;

/// Returns the largest signal speed |v| + c of all particles [m/s], from the reports of all sets. A signal speed of NaN
/// is ignored.
template <std::floating_point S, int D>
double fastest_signal(const SetList<S, D>& sets) {
    double fastest = 0;
    for (const SetOf<S, D>& set : sets) fastest = std::max(fastest, set.report.signal_speed);
    return fastest;
}

/// Returns the largest speed [m/s] that the boundary can give to nodes of the domain.
template <class S, class Boundary, int D>
double speed_of_boundary(const Boundary& boundary, const Domain<D>& domain) {
    if constexpr (boundary_fits<Boundary, S, D>::value)
        return largest_speed(on_grid(boundary, domain.cell_size), domain.lower, domain.upper);
    return 0;
}

/// Throws a particle_error because the largest signal speed [m/s] of the particles is not finite, or because there are
/// no particles.
[[noreturn, gnu::cold]] void throw_wrong_signal(double fastest);
/// Throws a particle_error because nothing limits the time step.
[[noreturn, gnu::cold]] double throw_at_rest();

[[noreturn, gnu::cold]] void throw_spoiled(std::uint64_t step);
[[noreturn, gnu::cold]] void throw_overflow(const overflow_error& failure, std::uint64_t step, double dt, double time,
                                            double times_the_bound);

/// Throws an error because a step of dt [s] is too small to change the time: a parameter_error if the program chose the
/// step, a particle_error if the step is the bound of the time step.
/// \param reason  a sentence that tells what limits the time step; empty if the program chose the step
[[noreturn, gnu::cold]] void throw_no_step(double dt, double time, std::uint64_t step, const std::string& reason);

/// Returns whether any rank has particles. Collective.
template <std::floating_point S, int D>
bool has_particles(const SetList<S, D>& sets, const RanksOf<S, D>& ranks) {
    std::size_t here = 0;
    for (const SetOf<S, D>& set : sets) here += set.store().size();
    return ranks.sum(here) > 0;
}
/// Returns the time of the next burst of any source [s]; infinite if no burst follows.
template <std::floating_point S, int D>
double next_burst(const SetList<S, D>& sets) {
    double next = std::numeric_limits<double>::infinity();
    for (const SetOf<S, D>& set : sets) next = std::min(next, set.next_burst());
    return next;
}
/// Returns whether there are particles, or a source will add some. Collective.
template <std::floating_point S, int D>
bool may_have_particles(const SetList<S, D>& sets, const RanksOf<S, D>& ranks) {
    return std::isfinite(next_burst(sets)) || has_particles(sets, ranks);
}

/// The parts of a run on which the bound of the time step depends.
template <std::floating_point S, int D>
struct StepInputs {
    SetList<S, D>& sets;
    const Domain<D>& domain;
    const KernelFacts& kernel;
    double time;                 ///< present time [s]
    int threads;                 ///< number of threads of loops over particles
    const RanksOf<S, D>& ranks;  ///< what the processes of the run tell each other
    bool in_float = false;       ///< whether the bound is computed in float. \see FixedPoint::float_steps

    /// Returns the bound that results from forces between particles [s]; infinite if there are no such forces.
    double of_forces() const;
    /// Returns the largest acceleration [m/s²] of the particles by loads, and by forces between particles that do not
    /// limit the time step otherwise. Call it after of_forces().
    double of_pushes() const;
    /// Returns the bound of the time step [s] by sources: a burst that is due in the step moves on by at most as much
    /// as particles may in a step. The particles of a source are added at the end of the step, so nothing else limits
    /// how far a fast burst is shot into slow matter.
    double of_sources() const;
    /// Returns the bound by signals of this speed [m/s].
    double of_signal(double speed) const {
        if (!in_float) return stable_time_step(kernel, domain.cell_size, speed);
        return double(stable_time_step(kernel, float(domain.cell_size), float(speed)));
    }
    /// Returns the bound by an acceleration [m/s²].
    double of_acceleration(double size) const {
        if (!in_float) return acceleration_time_step(domain.cell_size, size);
        const float in_32_bits = float(size);  // a GPU goes without the bound where this has overflowed
        return double(acceleration_time_step(float(domain.cell_size), std::isfinite(in_32_bits) ? in_32_bits : 0));
    }
};

/// The bound of the time step, and the speeds and accelerations from which it was computed.
struct StepBound {
    double step = 0;             ///< the bound, for the present step [s]
    double acceleration = 0;     ///< the largest acceleration from which the bound was computed [m/s²]
    double of_boundary = 0;      ///< the largest speed of the boundary from which the bound was computed [m/s]
    double of_acceleration = 0;  ///< the bound by this acceleration alone [s]
    bool in_float = false;       ///< whether the bound is computed in float. \see FixedPoint::float_steps
    double field_at_nodes = -1;  ///< the largest acceleration of a field at nodes in the last step; −1: it had none

    /// Computes the bound for prepared particles.
    /// \param boundary_speed  largest speed of the boundary [m/s]
    /// \param given           the largest acceleration by gravity or a field [m/s²]
    /// \return  the bound [s]; infinite if nothing limits the time step
    template <std::floating_point S, int D>
    double find(const StepInputs<S, D>& of, double boundary_speed, double given);

    /// Returns a sentence that tells what limits the time step.
    template <std::floating_point S, int D>
    [[gnu::cold]] std::string reason(const StepInputs<S, D>& of) const;
    /// Returns whether an acceleration limits the time step, and nothing else does so more.
    bool is_of_acceleration() const { return acceleration > 0 && !(step < of_acceleration); }
};

}  // namespace firn::inline FIRN_BUILD::detail

#if FIRN_HAS_BODIES
#include <firn/simulation/bound-inl.hpp>
#endif
