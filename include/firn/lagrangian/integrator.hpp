/// \file Time integrators: symplectic Euler and Verlet.
///
/// In each step, both first change velocities, v ← v + a k (the kick), and then positions, x ← x + v dt. Here dt is the
/// time step, a the acceleration, and k the time for which a acts; the integrators differ in k.
#pragma once

#include <concepts>

namespace firn {

/// The symplectic Euler method: v ← v + a dt, then x ← x + v dt. It is of first order.
struct SymplecticEuler {
    static constexpr const char* name = "symplectic_euler";

    /// Returns for how long [s] the acceleration changes the velocity in a step of dt [s]: dt. The second parameter is
    /// not used; see Verlet::kick.
    template <class S>
    static S kick(const S& dt, const S&) {
        return dt;
    }
    /// Returns the time [s] by which the velocity lags behind the position after a step: 0.
    template <class S>
    static S since(const S&) {
        return S(0);
    }
};

/// Verlet's method for positions, corrected for time steps that change:
///
///     x₊ = x + (x − x₋)(dt/dt₋) + a dt (dt + dt₋)/2,    in the first step x₊ = x + v dt + ½ a dt²
///
/// Here x₋, x and x₊ are the previous, present and next positions, a is the acceleration, dt₋ is the previous and dt
/// the present time step. It is of second order in x.
///
/// Instead of x₋, the velocity v = (x − x₋)/dt₋ is stored, because this has smaller rounding errors. It is the velocity
/// in the middle of the previous step, so it lags behind the position by dt₋/2. The acceleration changes it for the
/// time (dt + dt₋)/2, until the middle of the present step. For a point that is new or unpinned, the lag is 0, so that
/// its next step is a first step.
struct Verlet {
    static constexpr const char* name = "verlet";

    /// Returns for how long [s] the acceleration changes the velocity in a step.
    /// \param dt     time step [s]
    /// \param since  time by which the velocity lags behind the position at the beginning of the step [s]
    template <class S>
    static S kick(const S& dt, const S& since) {
        return dt * S(0.5) + since;
    }
    /// Returns the time [s] by which the velocity lags behind the position after a step of dt [s].
    template <class S>
    static S since(const S& dt) {
        return dt * S(0.5);
    }
};

/// A time integrator, such as SymplecticEuler or Verlet.
template <class I>
concept integrator = requires(const float dt) {
    { I::kick(dt, dt) } -> std::same_as<float>;
    { I::since(dt) } -> std::same_as<float>;
};

}  // namespace firn
