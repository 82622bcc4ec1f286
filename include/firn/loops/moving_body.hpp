/// \file Rigid bodies as the solver of their contact sees them: motions, inertia, drives.
#pragma once

#include <firn/boundary/rigid_body.hpp>
#include <firn/loops/reactions.hpp>

#include <array>
#include <cmath>
#include <optional>
#include <tuple>
#include <type_traits>
#include <utility>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// A body as the solver sees it: its motions, and what acts on it besides matter.
template <int D>
struct MovingBody {
    static constexpr int n = D == 2 ? 3 : 6;  ///< number of motions
    using Motion = Motions<D>;
    using Matrix = std::array<Motion, std::size_t(n)>;  ///< rows

    int part = 0;                                    ///< index among the parts of the boundary
    Vec<double, D> centre = Vec<double, D>::zero();  ///< [m]
    Matrix inertia = {};                             ///< M [kg], [kg m²]
    Matrix inverse_inertia = {};                     ///< M⁻¹
    Motion free = Motion::zero();                    ///< M u*: momenta without contact and drive [kg m/s], [kg m²/s]
    Motion velocity = Motion::zero();                ///< u [m/s], [rad/s]
    Drive<D> drive{};                                ///< what drives it
    Motion to_target = Motion::zero();               ///< where springs end, from the place of the body [m], [rad]
    Motion force = Motion::zero();                   ///< of the drive [N], [N m]
    Motion by_drive = Motion::zero();  ///< what the drive adds to the derivative of each residual [kg], [kg m²]
    std::optional<double> layer{};     ///< of the collider [cells], if matter flows around the body
    std::array<bool, std::size_t(n)> kept = {};  ///< whether a motion has exactly the velocity of the drive

    /// Returns the velocity of the body at x [m/s].
    Vec<double, D> velocity_at(const Vec<double, D>& x) const {
        const Vec<double, D> arm = x - centre;
        if constexpr (D == 2)
            return {velocity[0] - velocity[2] * arm[1], velocity[1] + velocity[2] * arm[0]};
        else
            return Vec<double, 3>{velocity[0], velocity[1], velocity[2]} +
                   cross(Vec<double, 3>{velocity[3], velocity[4], velocity[5]}, arm);
    }
    /// Finds the drive's force along a motion at the end of a step of dt.
    /// \param without  M (u − u*) + R of this motion
    /// \return         the residual of this motion
    double drive_along(int i, double dt, double without) {
        const auto at = std::size_t(i);
        const double most = drive.most[i], missing = drive.velocity[i] - velocity[i];
        by_drive[i] = 0;
        if (drive.keeps_if_it_can(i)) {
            // The velocity is kept, unless that takes too large a force.
            const double own = inertia[at][i], needed = (without + own * missing) / dt;
            kept[at] = std::abs(needed) <= most;
            force[i] = kept[at] ? without / dt : std::copysign(most, needed);
            return kept[at] ? -own * missing : without - dt * force[i];
        }
        const double k = drive.stiffness[i], c = drive.damping[i];
        force[i] = k * (to_target[i] - dt * velocity[i]) + c * missing;
        if (std::abs(force[i]) <= most)
            by_drive[i] = dt * (k * dt + c);
        else
            force[i] = std::copysign(most, force[i]);
        return without - dt * force[i];
    }
    /// Returns the derivatives of the residuals. \param slope  ∂R/∂u
    Matrix derivatives(const Matrix& slope) const {
        Matrix all = inertia;
        for (std::size_t i = 0; i < n; ++i) {
            all[i] += slope[i];
            all[i][int(i)] += by_drive[int(i)];
            if (!kept[i]) continue;
            all[i] = Motion::zero();
            all[i][int(i)] = inertia[i][int(i)];
        }
        return all;
    }
};

/// Returns A x.
template <int n>
Vec<double, n> product(const std::array<Vec<double, n>, std::size_t(n)>& A, const Vec<double, n>& x) {
    Vec<double, n> y{};
    for (int i = 0; i < n; ++i) y[i] = dot(A[std::size_t(i)], x);
    return y;
}
/// Returns x with A x = b, by elimination with the largest pivot of each column.
template <int n>
Vec<double, n> solved(std::array<Vec<double, n>, std::size_t(n)> A, Vec<double, n> b) {
    for (std::size_t i = 0; i < n; ++i) {
        std::size_t pivot = i;
        for (std::size_t k = i + 1; k < n; ++k)
            if (std::abs(A[k][int(i)]) > std::abs(A[pivot][int(i)])) pivot = k;
        std::swap(A[i], A[pivot]);
        std::swap(b[int(i)], b[int(pivot)]);
        for (std::size_t k = i + 1; k < n; ++k) {
            const double factor = A[k][int(i)] / A[i][int(i)];
            A[k] = A[k] - A[i] * factor;
            b[int(k)] -= b[int(i)] * factor;
        }
    }
    for (int i = n - 1; i >= 0; --i) {
        for (int k = i + 1; k < n; ++k) b[i] -= A[std::size_t(i)][k] * b[k];
        b[i] /= A[std::size_t(i)][i];
    }
    return b;
}

/// Calls f(body, part) for each rigid body of a boundary, with the index of its part.
template <class B, class F>
void for_bodies(B& boundary, const F& f, int first = 0) {
    using Boundary = std::remove_const_t<B>;
    if constexpr (!has_rigid_bodies<Boundary>) {
        return;
    } else if constexpr (requires { Boundary::is_rigid_body; }) {
        f(boundary, first);
    } else if constexpr (requires { boundary.parts; }) {
        std::apply([&](auto&... part) { ((for_bodies(part, f, first), first += firn::part_count(part)), ...); },
                   boundary.parts);
    } else if constexpr (requires { boundary.all; }) {
        for (auto& one : boundary.all) for_bodies(one, f, first), first += firn::part_count(one);
    } else {
        for_bodies(boundary.boundary, f, first);
    }
}

/// Returns a body as the solver sees it.
/// \param acceleration  [m/s²];  \param dt  [s]
template <class C, int D = C::D>
MovingBody<D> moving(const RigidBody<C>& body, int part, const Vec<double, D>& acceleration, double dt) {
    MovingBody<D> one{.part = part, .centre = body.collider.position, .drive = body.drive};
    constexpr int n = MovingBody<D>::n;
    for (int a = 0; a < D; ++a) {
        one.inertia[std::size_t(a)][a] = body.mass;
        one.inverse_inertia[std::size_t(a)][a] = 1 / body.mass;
        one.free[a] = body.momentum[a] + dt * (body.mass * acceleration[a] + body.force[a]);
        one.to_target[a] = body.drive.position[a] - body.collider.position[a];
    }
    if (body.in_flow) one.layer = double(body.collider.thickness_in_cells);
    const auto about = body.inertia_in_space(body.collider.rotation);
    const auto turn = turn_between(body.collider.rotation, body.drive.rotation);
    if constexpr (D == 2) {
        one.inertia[2][2] = about, one.inverse_inertia[2][2] = 1 / about;
        one.free[2] = body.angular_momentum + dt * body.torque;
        one.to_target[2] = turn;
    } else {
        const Mat<double, 3> inverse = inverse_transposed(about);
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                one.inertia[std::size_t(3 + i)][3 + j] = about(i, j);
                one.inverse_inertia[std::size_t(3 + i)][3 + j] = inverse(i, j);
            }
            one.free[3 + i] = body.angular_momentum[i] + dt * body.torque[i];
            one.to_target[3 + i] = turn[i];
        }
    }
    one.velocity = product<n>(one.inverse_inertia, one.free);
    for (int i = 0; i < n; ++i)
        if (one.drive.keeps(i)) one.velocity[i] = one.drive.velocity[i];
    return one;
}

/// Gives a body the momenta that it has after contact.
/// \param reaction  the impulse of the body on matter, about its centre;  \param dt  [s]
template <class C, int D = C::D>
void pushed(RigidBody<C>& body, const MovingBody<D>& one, const Reaction<D>& reaction, double dt) {
    constexpr int n = MovingBody<D>::n;
    Motions<D> on_matter{}, momenta{};
    for (int a = 0; a < D; ++a) on_matter[a] = reaction.impulse[a];
    if constexpr (D == 2)
        on_matter[2] = reaction.angular_impulse;
    else
        for (int a = 0; a < 3; ++a) on_matter[3 + a] = reaction.angular_impulse[a];
    const Motions<D> kept = product<n>(one.inertia, one.velocity);
    for (int i = 0; i < n; ++i) {
        momenta[i] = one.free[i] - on_matter[i];
        body.driven[i] = one.kept[std::size_t(i)] ? (kept[i] - momenta[i]) / dt : one.force[i];
        momenta[i] = one.kept[std::size_t(i)] ? kept[i] : momenta[i] + dt * body.driven[i];
    }
    for (int a = 0; a < D; ++a) body.momentum[a] = momenta[a];
    if constexpr (D == 2)
        body.angular_momentum = momenta[2];
    else
        for (int a = 0; a < 3; ++a) body.angular_momentum[a] = momenta[3 + a];
    body.place_velocities();
    for (int a = 0; a < D; ++a)
        if (one.kept[std::size_t(a)]) body.collider.linear_velocity[a] = one.velocity[a];
    for (int i = D; i < n; ++i)
        if (one.kept[std::size_t(i)]) {
            if constexpr (D == 2)
                body.collider.angular_velocity = one.velocity[i];
            else
                body.collider.angular_velocity[i - 3] = one.velocity[i];
        }
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
