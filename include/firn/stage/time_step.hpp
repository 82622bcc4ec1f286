/// \file The bound of the time step.
#pragma once

namespace firn {

/// The fraction of h / (|v| + c) that a step may take. Symplectic Euler with quadratic B-splines is stable up to
/// 1.63 h/c in one dimension (the symbol of the stiffness, ω² = 1.5 c²/h² at worst, and dt < 2/ω); particles that
/// are unevenly spaced, and MLS forces, need the rest.
inline constexpr double time_step_safety = 0.6;

/// dt [s] from the cell size [m] and the largest |v| + c [m/s] of all particles.
inline double stable_time_step(double cell_size, double largest_signal_speed) {
    return time_step_safety * cell_size / largest_signal_speed;
}

}  // namespace firn
