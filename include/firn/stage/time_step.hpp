/// \file The bound of the time step.
#pragma once

#include <firn/material/concept.hpp>

namespace firn {

/// The fraction of h / (|v| + c) that a step may take. Symplectic Euler with quadratic B-splines is stable up to
/// 1.63 h/c in one dimension (the symbol of the stiffness, ω² = 1.5 c²/h² at worst, and dt < 2/ω); particles that
/// are unevenly spaced, and MLS forces, need the rest.
inline constexpr double time_step_safety = 0.6;

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

/// dt [s] from the cell size [m] and the largest |v| + c [m/s] of all particles.
inline double stable_time_step(double cell_size, double largest_signal_speed) {
    return time_step_safety * cell_size / largest_signal_speed;
}

}  // namespace firn
