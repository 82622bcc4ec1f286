/// \file The bound of the time step.
#pragma once

#include <firn/material/concept.hpp>

namespace firn {

/// The fraction of h / (|v| + c) that a step may take. Symplectic Euler with quadratic B-splines is stable up to
/// 1.63 h/c in one dimension (the symbol of the stiffness, ω² = 1.5 c²/h² at worst, and dt < 2/ω); particles that
/// are unevenly spaced, and MLS forces, need the rest.
inline constexpr double time_step_safety = 0.6;

/// |v| + c of a particle [m/s]; 0 without mass.
template <class Material, scalar S, int D, class State>
FIRN_INLINE S signal_speed(const Material& material, const Vec<S, D>& velocity, const S& mass, const S& volume,
                           const State& state) {
    const auto real = mass > S(0);
    const S density = select(real, mass, S(1)) / select(real, volume, S(1));
    return select(real, norm(velocity) + wave_speed(material, density, state), S(0));
}

/// dt [s] from the cell size [m] and the largest |v| + c [m/s] of all particles.
inline double stable_time_step(double cell_size, double largest_signal_speed) {
    return time_step_safety * cell_size / largest_signal_speed;
}

}  // namespace firn
