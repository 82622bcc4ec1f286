/// \file Time integrators: symplectic Euler and Verlet.
///
/// In each step, both integrators first change velocities, v ← v + a k (the kick), and then positions, x ← x + v dt.
/// Here x is a position, v a velocity, a an acceleration, dt the time step, and k the time for which the acceleration
/// acts. The two integrators differ only in k.
#pragma once

#include <firn/core/build.hpp>

#include <concepts>

namespace firn::inline FIRN_BUILD {

/// The symplectic Euler method: v ← v + a dt, then x ← x + v dt. It is of first order.
struct SymplecticEuler {
    static constexpr const char* name = "symplectic_euler";

    /// Returns dt [s]: the acceleration changes the velocity for the whole length of the step. The second parameter is
    /// not used; see Verlet::kick.
    template <class S>
    static S kick(const S& dt, const S&) {
        return dt;
    }
    /// Returns 0, the time [s] by which the velocity lags behind the position after a step.
    template <class S>
    static S since(const S&) {
        return S(0);
    }
};

/// Verlet's method for positions, corrected for time steps that change:
///
///     x₊ = x + (x − x₋)(dt/dt₋) + a dt (dt + dt₋)/2,    in the first step x₊ = x + v dt + ½ a dt²
///
/// Here x₋, x and x₊ are the previous, present and next positions, v is the velocity, a the acceleration, and dt₋ and
/// dt are the previous and the present time step. The error of x is of second order in dt.
///
/// Instead of x₋, the velocity v = (x − x₋)/dt₋ is stored, because this has smaller rounding errors. This velocity v
/// belongs to the middle of the previous step, so v lags behind the position by dt₋/2. In the present step, the
/// acceleration changes v for the time (dt + dt₋)/2, so that v then belongs to the middle of the present step. For a
/// point that was just added or unpinned, the lag is 0. So the formula of the first step holds for the next step of
/// this point.
struct Verlet {
    static constexpr const char* name = "verlet";

    /// Returns the time [s] for which the acceleration changes the velocity in a step: dt/2 + since.
    /// \param dt     time step [s]
    /// \param since  time by which the velocity lags behind the position before the step [s]
    template <class S>
    static S kick(const S& dt, const S& since) {
        return dt * S(0.5) + since;
    }
    /// Returns the time [s] by which the velocity lags behind the position after a step of length dt [s]: dt/2.
    template <class S>
    static S since(const S& dt) {
        return dt * S(0.5);
    }
};

/// A time integrator, such as SymplecticEuler or Verlet. A type I is a time integrator if it has the static functions
/// I::kick(dt, since) and I::since(dt).
template <class I>
concept integrator = requires(const float dt) {
    { I::kick(dt, dt) } -> std::same_as<float>;
    { I::since(dt) } -> std::same_as<float>;
};

}  // namespace firn::inline FIRN_BUILD
