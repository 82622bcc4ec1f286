/// \file What moves a rigid body besides matter: springs and dampers to a target, velocities that are kept, and how
/// much force they may use.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/parameters.hpp>
#include <firn/math/rotor.hpp>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace firn::inline FIRN_BUILD {

/// One number for each way in which a rigid body can move: along the axes of space, then about them. In 2D (x, y,
/// about z), in 3D (x, y, z, about x, about y, about z).
template <int D>
using Motions = Vec<double, D == 2 ? 3 : 6>;

/// Returns the rotation vector [rad] that turns the rotation `from` into `to`, by at most half a turn.
template <std::floating_point S, int N>
Axial<S, N == 2 ? 2 : 3> turn_between(const Vec<S, N>& from, const Vec<S, N>& to) {
    // The quaternion `to` times the conjugate of `from`.
    const auto a = axial_part(to), b = axial_part(from);
    S w{}, length{};
    Axial<S, N == 2 ? 2 : 3> part{};
    if constexpr (N == 2) {
        w = to[0] * from[0] + a * b;
        part = a * from[0] - b * to[0];
        length = std::abs(part);
    } else {
        w = to[0] * from[0] + dot(a, b);
        part = a * from[0] - b * to[0] - cross(a, b);
        length = norm(part);
    }
    if (w < S(0)) w = -w, part = part * S(-1);
    return part * (length > S(0) ? S(2) * std::atan2(length, w) / length : S(2));
}

/// What drives a rigid body: for each way to move, a force
///
///     clamp(k (target − place) + c (velocity − V), −most, most)      [N], about axes [N m]
///
/// at the end of the step, so that stiff springs need no short steps. A damper without end keeps a velocity: whatever
/// pushes the body, it moves with `velocity` unless that takes more than the largest force. A velocity of 0 locks the
/// axis.
///
///     drive.keep(1, 0.05)              // along y with 0.05 m/s
///     drive.keep(0, 0.2, 30)           // along x with 0.2 m/s, with at most 30 N
///     drive.hold(0, 1e4, 50, 20)       // along x by a spring of 1e4 N/m and a damper of 50 N s/m, with at most 20 N
template <int D>
struct Drive {
    static constexpr double without_end = 1e30;  ///< Above any force [N] and any damping [N s/m].

    Motions<D> velocity = Motions<D>::zero();              ///< target velocities [m/s], [rad/s]
    Motions<D> stiffness = Motions<D>::zero();             ///< k of springs [N/m], [N m/rad]
    Motions<D> damping = Motions<D>::zero();               ///< c of dampers [N s/m], [N m s/rad]
    Motions<D> most = Motions<D>::filled(without_end);     ///< the largest force [N], torque [N m]
    Vec<double, D> position = Vec<double, D>::zero();      ///< where springs pull the centre of mass to [m]
    Rotor<double, D> rotation = no_rotation<double, D>();  ///< the rotation that springs turn the body to

    static constexpr auto parameters() {
        return std::tuple{parameter{"velocity", "", &Drive::velocity},  parameter{"stiffness", "", &Drive::stiffness},
                          parameter{"damping", "", &Drive::damping},    parameter{"most", "", &Drive::most},
                          parameter{"position", "m", &Drive::position}, parameter{"rotation", "1", &Drive::rotation}};
    }

    /// Keeps a velocity. \param motion  0, 1, 2 along x, y, z, then about x, y, z; in 2D 2 is about z
    /// \param speed      [m/s], [rad/s];  \param most_force  the largest force [N] or torque [N m]
    Drive& keep(int motion, double speed, double most_force = without_end) {
        velocity[motion] = speed, stiffness[motion] = 0, damping[motion] = without_end, most[motion] = most_force;
        return *this;
    }
    /// Pulls towards `position` or turns towards `rotation`, by a spring and a damper. \see keep
    Drive& hold(int motion, double spring, double damper, double most_force = without_end) {
        velocity[motion] = 0, stiffness[motion] = spring, damping[motion] = damper, most[motion] = most_force;
        return *this;
    }
    /// Lets the body move freely.
    Drive& release(int motion) { return hold(motion, 0, 0); }
    /// Locks the rotation.
    Drive& keep_upright() {
        for (int i = D; i < D + (D == 2 ? 1 : 3); ++i) keep(i, 0);
        return *this;
    }

    /// Whether a motion has the target velocity, unless that takes more than the largest force.
    bool keeps_if_it_can(int motion) const { return damping[motion] >= without_end; }
    /// Whether a motion has exactly the target velocity.
    bool keeps(int motion) const { return keeps_if_it_can(motion) && most[motion] >= without_end; }

    /// \throws parameter_error  if a number is not finite that must be, or is negative
    void check() const {
        const auto refuse = [](const char* what, double given, const char* allowed) {
            throw parameter_error(sentence("The ", what, " of a drive is ", given, "; it must be ", allowed, "."));
        };
        for (const double v : velocity.v)
            if (!std::isfinite(v)) refuse("velocity", v, "finite");
        for (const double k : stiffness.v)
            if (!(k >= 0) || !std::isfinite(k)) refuse("stiffness", k, "finite and not negative");
        for (const double c : damping.v)
            if (!(c >= 0) || !std::isfinite(c)) refuse("damping", c, "finite and not negative; see keep()");
        for (const double f : most.v)
            if (!(f >= 0) || !std::isfinite(f)) refuse("largest force", f, "finite and not negative; see without_end");
        for (const double x : position.v)
            if (!std::isfinite(x)) refuse("position", x, "finite");
        if (!(std::abs(norm(rotation) - 1) < 1e-6)) refuse("rotation", norm(rotation), "of length 1: see rotor()");
    }
};

}  // namespace firn::inline FIRN_BUILD
