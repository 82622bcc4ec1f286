/// \file The bound of the time step.
#pragma once

#include <firn/core/error.hpp>
#include <firn/kernel/concept.hpp>
#include <firn/material/concept.hpp>

#include <cmath>

namespace firn {

/// The fraction of h / (|v| + c) that a step may take. In matter without gaps symplectic Euler is stable up to the
/// kernel's courant_limit: 1.63 h/c for quadratic B-splines. Particles that are unevenly spaced, and MLS forces, need
/// the rest: of a single particle, ω² is at most c²/h² max Σ N'²/N, and with more of them no more. That gives 0.82 h/c
/// for the quadratic and 1.13 h/c for the cubic spline, so that the same share of the limit serves both.
template <class Kernel>
inline constexpr double time_step_safety = 0.6 * (Kernel::courant_limit / 1.6329931618554521);

/// |v| + c of a particle [m/s], and 2 d/h where momentum diffuses, d [m²/s] of the model; 0 without mass.
///
/// Why 2 d/h: on a grid of lumped masses, viscosity damps a wave at the rate λ = s d/h², s the symbol of the Laplacian.
/// Its maximum over all waves is 1.5 for quadratic B-splines and weight gradients, 1.94 for MLS forces, with many
/// particles, and at most 2 with two or more a cell and axis; in two and three dimensions no more, as the weights along
/// the other axes only lower it. Symplectic Euler with stiffness ω² = s c²/h² and damping λ is stable for
/// (ω dt)² + 2 λ dt < 4 (both roots of z² − (2 − ω²dt² − λdt) z + 1 − λdt lie in the unit circle). With a step of
/// 0.6 h / (c + 2 d/h) the left side is at most 1.2.
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
/// \throws parameter_error  unless the step [s] is finite and not negative
inline void check_step(double dt) {
    if (!(dt >= 0) || !std::isfinite(dt))
        throw parameter_error(sentence("The time step is ", dt, " s; it must be finite and not negative."));
}
}  // namespace detail

/// dt [s] from the cell size [m] and the largest |v| + c [m/s] of all particles.
template <class Kernel>
double stable_time_step(double cell_size, double largest_signal_speed) {
    return time_step_safety<Kernel> * cell_size / largest_signal_speed;
}

}  // namespace firn
