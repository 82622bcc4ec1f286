/// \file A rigid body that particles push: it loses the impulse that its collider gives to the particles.
///
///     body.place(collider);
///     … grid_update(…, collider, reactions), …
///     body.push(-reactions.parts[k].impulse + weight * dt, -reactions.parts[k].angular_impulse);
///     body.move(dt);
#pragma once

#include <firn/core/error.hpp>
#include <firn/math/rotor.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace example {

using firn::Axial, firn::Mat, firn::Vec;

/// The inverse of a symmetric 3 × 3 matrix, from its adjugate.
inline Mat<double, 3> inverse(const Mat<double, 3>& a) {
    Mat<double, 3> adjugate{};
    for (int i = 0; i < 3; ++i) {
        const Vec<double, 3> row = cross(a.column((i + 1) % 3), a.column((i + 2) % 3));
        for (int j = 0; j < 3; ++j) adjugate(i, j) = row[j];
    }
    return adjugate * (1 / determinant(a));
}

/// A rigid body. It stores momentum and angular momentum, so that both are conserved up to rounding.
///
/// Call push() first, then move(), which uses the new velocities (symplectic Euler). The rotation uses the angular
/// velocity half a step ahead, which is of second order in the step.
template <int D>
class RigidBody {
public:
    /// Inertia about the centre of mass in the body's axes [kg m²]: a number in 2D, a symmetric matrix in 3D.
    using Inertia = std::conditional_t<D == 2, double, Mat<double, 3>>;

    Vec<double, D> position{};  ///< of the centre of mass [m]
    firn::Rotor<double, D> rotation = firn::no_rotation<double, D>();
    Vec<double, D> momentum{};            ///< [kg m/s]
    Axial<double, D> angular_momentum{};  ///< about the centre of mass [kg m²/s]

    /// \throws parameter_error  if mass or moments of inertia are not positive and finite
    RigidBody(double mass, const Inertia& inertia) : mass_(mass) {
        bool possible = mass > 0 && std::isfinite(mass);
        if constexpr (D == 2) {
            possible = possible && inertia > 0 && std::isfinite(inertia);
            inverse_inertia_ = 1 / inertia;
        } else {
            const double minor = inertia(0, 0) * inertia(1, 1) - inertia(0, 1) * inertia(1, 0);
            possible = possible && inertia(0, 0) > 0 && minor > 0 && determinant(inertia) > 0 &&
                       std::isfinite(squared_norm(inertia));
            inverse_inertia_ = inverse(inertia);
        }
        if (!possible)
            throw firn::parameter_error(firn::sentence(
                "A rigid body of ", mass, " kg: its mass and its moments of inertia must be positive and finite."));
    }

    double mass() const { return mass_; }
    Vec<double, D> velocity() const { return momentum * (1 / mass_); }
    Axial<double, D> angular_velocity() const { return spin(rotation, angular_momentum); }
    /// The velocity of the point x [m] of the body [m/s].
    Vec<double, D> velocity_at(const Vec<double, D>& x) const {
        return velocity() + firn::skew(angular_velocity()) * (x - position);
    }
    /// Kinetic energy [J].
    double kinetic_energy() const {
        const auto w = angular_velocity();
        double turning = 0;
        if constexpr (D == 2)
            turning = w * angular_momentum;
        else
            turning = dot(w, angular_momentum);
        return 0.5 * (dot(momentum, momentum) / mass_ + turning);
    }

    /// Adds an impulse.
    /// \param impulse          [N s]
    /// \param angular_impulse  about the centre of mass [N m s]
    void push(const Vec<double, D>& impulse, const Axial<double, D>& angular_impulse = {}) {
        momentum += impulse;
        angular_momentum += angular_impulse;
    }

    /// Stops the point x [m] of the body from moving into a wall with the unit normal n, by an impulse at this point.
    /// Friction slows its sliding along the wall by an impulse of at most `friction` times that along n.
    void stop_at(const Vec<double, D>& x, const Vec<double, D>& n, double friction) {
        // Changes the point's speed along a direction by `change`, but with an impulse of at most `most`.
        const auto change_speed = [&](const Vec<double, D>& direction, double change, double most) {
            const auto axial = axial_product(x - position, direction);
            const auto turns = firn::skew(spin(rotation, axial)) * (x - position);
            const double impulse = std::min(change / (1 / mass_ + dot(turns, direction)), most);
            push(direction * impulse, axial * impulse);
            return impulse;
        };
        const double towards = -dot(velocity_at(x), n);
        if (!(towards > 0)) return;
        const double pressed = change_speed(n, towards, std::numeric_limits<double>::infinity());
        const Vec<double, D> along = velocity_at(x) - n * dot(velocity_at(x), n);
        if (const double speed = norm(along); speed > 0) change_speed(along * (-1 / speed), speed, friction * pressed);
    }

    /// Moves for a time dt [s] without forces.
    void move(double dt) {
        position += velocity() * dt;
        const auto halfway = turned(rotation, angular_velocity() * (dt / 2));
        rotation = turned(rotation, spin(halfway, angular_momentum) * dt);
    }

    /// Gives a collider the body's position, rotation and velocities. The collider's origin is the centre of mass.
    template <class Collider>
    void place(Collider& collider) const {
        collider.position = position;
        collider.rotation = rotation;
        collider.linear_velocity = velocity();
        collider.angular_velocity = angular_velocity();
    }

private:
    /// The angular velocity that this angular momentum gives the body after the rotation `turn`.
    Axial<double, D> spin(const firn::Rotor<double, D>& turn, const Axial<double, D>& momentum_about) const {
        if constexpr (D == 2) {
            return inverse_inertia_ * momentum_about;
        } else {
            const Mat<double, 3> R = matrix_of(turn);
            return R * (inverse_inertia_ * (transpose(R) * momentum_about));
        }
    }

    double mass_;
    Inertia inverse_inertia_;
};

/// A ball with this density [kg/m³] and radius [m]; in 2D a disc, with a density in kg/m².
template <int D>
RigidBody<D> ball(double density, double radius) {
    if constexpr (D == 2) {
        const double mass = density * std::numbers::pi * radius * radius;
        return {mass, mass * radius * radius / 2};
    } else {
        const double mass = density * 4.0 / 3 * std::numbers::pi * radius * radius * radius;
        return {mass, Mat<double, 3>::diagonal(0.4 * mass * radius * radius)};
    }
}

}  // namespace example
