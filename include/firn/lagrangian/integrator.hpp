/// \file Time integrators: symplectic Euler and Verlet.
///
/// Both move positions by x ← x + v dt, with v after the kick. They differ in how long an acceleration acts in a step.
#pragma once

#include <concepts>

namespace firn {

/// Symplectic Euler: v ← v + a dt, x ← x + v dt. First order.
struct SymplecticEuler {
    static constexpr const char* name = "symplectic_euler";

    /// How long the acceleration acts on the velocity in a step of dt [s]. The second parameter is the time [s] by
    /// which the velocity lags behind the position at the beginning of the step.
    /// \return [s]
    template <class S>
    static S kick(const S& dt, const S&) {
        return dt;
    }
    /// The time [s] by which the velocity lags behind the position after a step: none.
    template <class S>
    static S since(const S&) {
        return S(0);
    }
};

/// Verlet's scheme in positions, corrected for changing time steps:
///
///     x₊ = x + (x − x₋)(dt/dt₋) + a dt (dt + dt₋)/2,    first step x + v dt + ½ a dt²
///
/// It stores the velocity v = (x − x₋)/dt₋, which belongs to the middle of the last step. The acceleration acts from
/// there to the middle of the next step, for (dt + dt₋)/2. In floating point this is more accurate than a difference of
/// two positions, and a point that is new, or whose velocity was set, can begin with a first step of its own. Second
/// order in x; velocities lag by half a step.
struct Verlet {
    static constexpr const char* name = "verlet";

    /// How long the acceleration acts on the velocity in a step [s].
    /// \param dt     time step [s]
    /// \param since  time by which the velocity lags behind the position at the beginning of the step [s]
    template <class S>
    static S kick(const S& dt, const S& since) {
        return dt * S(0.5) + since;
    }
    /// The time [s] by which the velocity lags behind the position after a step of dt [s].
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
