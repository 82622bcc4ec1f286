/// \file The bound of the time step.
#pragma once

#include <firn/kernel/concept.hpp>
#include <firn/material/concept.hpp>

namespace firn {

/// The fraction of h / (|v| + c) that a step may take. In matter without gaps symplectic Euler is stable up to the
/// kernel's courant_limit: 1.63 h/c for quadratic B-splines. Particles that are unevenly spaced, and MLS forces, need
/// the rest: of a single particle, ω² is at most c²/h² max Σ N'²/N, and with more of them no more. That gives 0.82 h/c
/// for the quadratic and 1.13 h/c for the cubic spline, so that the same share of the limit serves both.
template <class Kernel>
inline constexpr double time_step_safety = 0.6 * (Kernel::courant_limit / 1.6329931618554521);

/// |v| + c of a particle [m/s]; 0 without mass.
template <class Material, scalar S, int D, class State>
FIRN_INLINE S signal_speed(const Material& material, const Vec<S, D>& velocity, const S& mass, const S& volume,
                           const State& state) {
    const auto real = mass > S(0);
    const S density = select(real, mass, S(1)) / select(real, volume, S(1));
    return select(real, norm(velocity) + wave_speed(material, density, state), S(0));
}

/// dt [s] from the cell size [m] and the largest |v| + c [m/s] of all particles.
template <class Kernel>
double stable_time_step(double cell_size, double largest_signal_speed) {
    return time_step_safety<Kernel> * cell_size / largest_signal_speed;
}

}  // namespace firn
