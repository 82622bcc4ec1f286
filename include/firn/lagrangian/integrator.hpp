/// \file How velocities follow forces, and positions velocities. Both schemes move positions by x ← x + v dt with the
/// velocity after the kick; they differ in how long an acceleration acts in a step.
#pragma once

#include <concepts>

namespace firn {

/// v ← v + a dt, x ← x + v dt. First order.
struct SymplecticEuler {
    static constexpr const char* name = "symplectic_euler";

    /// For how long the acceleration acts on a velocity [s].
    /// \param since  how long before the step's beginning the velocity was as given [s]
    template <class S>
    static S kick(const S& dt, const S&) {
        return dt;
    }
    /// `since`, after the step [s].
    template <class S>
    static S since(const S&) {
        return S(0);
    }
};

/// Verlet's scheme by positions, corrected for steps that change:
///
///     x₊ = x + (x − x₋)(dt/dt₋) + a dt (dt + dt₋)/2,    first step x + v dt + ½ a dt²
///
/// written with the velocity of the step before, v = (x − x₋)/dt₋, that of its middle: what acts between the middles of
/// two steps acts for (dt + dt₋)/2. In numbers of few digits that is finer than the difference of two positions, and a
/// point that is new, or whose velocity was set, begins with a first step of its own. Second order in x; velocities
/// are those of half a step ago.
struct Verlet {
    static constexpr const char* name = "verlet";

    template <class S>
    static S kick(const S& dt, const S& since) {
        return dt * S(0.5) + since;
    }
    template <class S>
    static S since(const S& dt) {
        return dt * S(0.5);
    }
};

/// Both say for how long an acceleration acts in a step.
template <class I>
concept integrator = requires(const float dt) {
    { I::kick(dt, dt) } -> std::same_as<float>;
    { I::since(dt) } -> std::same_as<float>;
};

}  // namespace firn
