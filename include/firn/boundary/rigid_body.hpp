/// \file A rigid body: a collider with a mass, which matter pushes.
#pragma once

#include <firn/boundary/collider.hpp>
#include <firn/boundary/drive.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/math/inverse.hpp>

#include <cmath>
#include <numbers>
#include <string>
#include <tuple>
#include <type_traits>

namespace firn::inline FIRN_BUILD {

/// Mass [kg] and inertia about the centre of mass, in the body's axes [kg m²].
template <int D>
struct MassOfBody {
    /// A number in 2D, a symmetric matrix in 3D.
    using Inertia = std::conditional_t<D == 2, double, Mat<double, 3>>;
    double mass;      ///< [kg]
    Inertia inertia;  ///< about the centre of mass [kg m²]
};

/// \name Bodies of uniform density [kg/m³]; in 2D, of a slice one metre thick
/// @{

/// Returns mass and inertia of a ball; in 2D of a disc.
template <class S, int D>
MassOfBody<D> mass_of(const Sphere<S, D>& shape, double density) {
    const double r = double(shape.radius), square = r * r;
    if constexpr (D == 2) {
        const double mass = density * std::numbers::pi * square;
        return {mass, mass * square / 2};
    } else {
        const double mass = density * 4.0 / 3 * std::numbers::pi * square * r;
        return {mass, Mat<double, 3>::diagonal(0.4 * mass * square)};
    }
}
/// Returns mass and inertia of a cuboid; in 2D of a rectangle.
template <class S, int D>
MassOfBody<D> mass_of(const Box<S, D>& shape, double density) {
    double mass = density, square = 0;
    for (int a = 0; a < D; ++a) {
        const double half = double(shape.half_extents[a]);
        mass *= 2 * half;
        square += half * half;
    }
    if constexpr (D == 2) {
        return {mass, mass * square / 3};
    } else {
        Mat<double, 3> inertia = Mat<double, 3>::zero();
        for (int a = 0; a < 3; ++a) {
            const double half = double(shape.half_extents[a]);
            inertia(a, a) = mass * (square - half * half) / 3;
        }
        return {mass, inertia};
    }
}
/// Returns mass and inertia of a capsule, a cylinder between halves of a ball.
template <class S, int D>
MassOfBody<D> mass_of(const Capsule<S, D>& shape, double density) {
    const double r = double(shape.radius), half = double(shape.half_length), square = r * r;
    if constexpr (D == 2) {
        const double middle = density * 4 * r * half, ends = density * std::numbers::pi * square;
        // The centroid of half a disc lies 4 r/(3 π) from its straight side.
        const double out = 4 * r / (3 * std::numbers::pi);
        return {middle + ends,
                middle * (half * half + square) / 3 + ends * (square / 2 + half * half + 2 * half * out)};
    } else {
        const double middle = density * 2 * half * std::numbers::pi * square,
                     ends = density * 4.0 / 3 * std::numbers::pi * square * r;
        // The centroid of half a ball lies 3 r/8 from its flat side.
        const double along = middle * square / 2 + ends * 0.4 * square;
        const double across =
            middle * (square / 4 + half * half / 3) + ends * (0.4 * square + half * half + 0.75 * r * half);
        Mat<double, 3> inertia = Mat<double, 3>::diagonal(across);
        inertia(1, 1) = along;
        return {middle + ends, inertia};
    }
}
/// @}

namespace detail {
struct named_rigid_body {
    static constexpr const char* name = "rigid_body";
};
}  // namespace detail

/// A rigid body: a collider with a mass, which matter pushes, and which gravity, forces of the program and a drive
/// move. It is a part of a boundary that acts by the gap of particles:
///
///     firn::Collider<firn::Sphere<float, 3>> ball{.shape = {0.1F}, .friction = 0.3, .position = {0.5, 0.8, 0.5}};
///     firn::Simulation simulation(domain, sand, firn::GapContact{firn::Together(walls, firn::RigidBody(ball,
///     600.0))});
///
/// and stands in `simulation.boundary.boundary.parts`. Include firn/rigid_body.hpp.
///
/// Body and matter move each other in one go: in each step, the body's velocity at the end of the step is found
/// together with the impulses of its contact, which depend on this velocity. So bodies may be much lighter than the
/// matter that they touch, contact never adds energy, and momentum and angular momentum are conserved to rounding.
/// Bodies that touch the same matter are found together, too.
///
/// In a fluid, set `in_flow`. Otherwise all matter in the collider's layer moves with the body along its normal, and as
/// fluids keep their volume, it then moves along as a whole: the body has the inertia of one that is as much larger,
/// and drags as much matter. With `in_flow`, the velocity along the normal goes on from that of the body to those of
/// matter 0.75 and 2.25 cells outside of the layer, by a parabola; matter on the surface itself still moves with the
/// body. A layer of 0.75 cells (Collider::thickness_in_cells) is best then. Momenta are conserved as always, but
/// contact may add a little energy, and runs of several processes refuse such bodies. Use it for fluids around smooth
/// bodies, at least 12 cells across, and leave it off for solids and sand.
///
/// Rigid bodies do not touch each other, nor solids or walls: a program that needs that has an engine for rigid bodies,
/// which owns them, and firn gives it the forces of matter. \see Simulation::reactions
///
/// The origin of the shape is the centre of mass. The body feels Simulation::gravity, or the uniform acceleration that
/// is given to step(). Momenta are stored, so that they are conserved; velocities follow from them.
/// \tparam C  the Collider, with the shape, the contact, the friction, the place and the rotation
template <class C>
struct RigidBody {
    using S = typename C::S;                          ///< The scalar type of the shape.
    static constexpr int D = C::D;                    ///< The number of dimensions of space: 2 or 3.
    static constexpr bool is_rigid_body = true;       ///< Matter pushes it. \see has_rigid_bodies
    static constexpr int motions = D == 2 ? 3 : 6;    ///< Number of ways to move. \see Motions
    using Inertia = typename MassOfBody<D>::Inertia;  ///< The type of an inertia.

    C collider{};                                      ///< Shape, contact, place and rotation; and velocities.
    double mass = 0;                                   ///< [kg]
    Vec<double, D == 2 ? 1 : 6> inertia{};             ///< [kg m²], in 3D xx, yy, zz, yz, xz, xy. \see inertia_matrix
    Vec<double, D> momentum = Vec<double, D>::zero();  ///< [kg m/s]
    Axial<double, D> angular_momentum = no_spin<double, D>();  ///< about the centre of mass [kg m²/s]
    Vec<double, D> force = Vec<double, D>::zero();             ///< of the program, on the centre of mass [N]
    Axial<double, D> torque = no_spin<double, D>();            ///< of the program, about the centre of mass [N m]
    Drive<D> drive{};                                          ///< Springs, dampers, velocities that are kept.
    bool in_flow = false;  ///< Whether matter in the collider's layer flows around the body. \see RigidBody
    Motions<D> driven = Motions<D>::zero();  ///< The drive's mean force [N] and torque [N m] of the last step.

    /// Makes a body of mass 0, which check() refuses.
    RigidBody() = default;
    /// Makes a body at rest with this mass and inertia.
    RigidBody(const C& solid, const MassOfBody<D>& of) : collider(solid), mass(of.mass) {
        if constexpr (D == 2)
            inertia[0] = of.inertia;
        else
            for (int k = 0; k < 6; ++k) inertia[k] = of.inertia(row_of[k], column_of[k]);
        set_velocity(solid.linear_velocity, solid.angular_velocity);
    }
    /// Makes a body of uniform density [kg/m³] whose shape has mass_of(), with the velocities of the collider.
    RigidBody(const C& solid, double density) : RigidBody(solid, mass_of(solid.shape, density)) {}

    /// The type of this boundary with scalar type T: contact sees the collider only.
    template <class T>
    using with_scalar = with_scalar_t<C, T>;
    static constexpr const char* name = detail::joined_names<detail::named_rigid_body, C>::text;
    static constexpr auto parameters() {
        return std::tuple{parameter{"collider", "", &RigidBody::collider},
                          parameter{"mass", "kg", &RigidBody::mass},
                          parameter{"inertia", "kg m^2", &RigidBody::inertia},
                          parameter{"momentum", "kg m/s", &RigidBody::momentum},
                          parameter{"angular_momentum", "kg m^2/s", &RigidBody::angular_momentum},
                          parameter{"force", "N", &RigidBody::force},
                          parameter{"torque", "N m", &RigidBody::torque},
                          parameter{"drive", "", &RigidBody::drive}};
    }

    /// Returns the inertia about the centre of mass in the body's axes [kg m²].
    Inertia inertia_matrix() const {
        if constexpr (D == 2) {
            return inertia[0];
        } else {
            Mat<double, 3> all{};
            for (int k = 0; k < 6; ++k) all(row_of[k], column_of[k]) = all(column_of[k], row_of[k]) = inertia[k];
            return all;
        }
    }
    /// Returns the inertia about the centre of mass in the axes of space [kg m²], for a rotation.
    Inertia inertia_in_space(const Rotor<double, D>& rotation) const {
        if constexpr (D == 2) {
            return inertia[0];
        } else {
            const Mat<double, 3> R = matrix_of(rotation);
            return R * inertia_matrix() * transpose(R);
        }
    }

    /// Returns the velocity of the centre of mass [m/s].
    Vec<double, D> velocity() const { return momentum * (1 / mass); }
    /// Returns the angular velocity [rad/s].
    Axial<double, D> angular_velocity() const { return spin(collider.rotation); }
    /// Sets the velocities [m/s], [rad/s].
    void set_velocity(const Vec<double, D>& linear, const Axial<double, D>& angular = no_spin<double, D>()) {
        momentum = linear * mass;
        angular_momentum = inertia_in_space(collider.rotation) * angular;
        place_velocities();
    }
    /// Gives the collider the velocities that follow from the momenta.
    void place_velocities() {
        collider.linear_velocity = velocity();
        collider.angular_velocity = angular_velocity();
    }
    /// Returns the kinetic energy [J].
    double kinetic_energy() const {
        const auto w = angular_velocity();
        double turning = 0;
        if constexpr (D == 2)
            turning = w * angular_momentum;
        else
            turning = dot(w, angular_momentum);
        return 0.5 * (dot(momentum, momentum) / mass + turning);
    }

    /// Checks the body.
    /// \throws parameter_error  if mass or moments of inertia are not positive and finite, if a momentum or a force is
    ///                          not finite, or if the collider or the drive is not valid
    void check() const {
        bool possible = mass > 0 && std::isfinite(mass);
        if constexpr (D == 2) {
            possible = possible && inertia[0] > 0 && std::isfinite(inertia[0]);
        } else {
            const Mat<double, 3> all = inertia_matrix();
            const double minor = all(0, 0) * all(1, 1) - all(0, 1) * all(1, 0);
            possible =
                possible && all(0, 0) > 0 && minor > 0 && determinant(all) > 0 && std::isfinite(squared_norm(all));
        }
        if (!possible)
            throw parameter_error(sentence("A ", name, " has a mass of ", mass,
                                           " kg; its mass and its moments of inertia must be positive and finite."));
        collider.check();
        drive.check();
        const auto finite = [](const auto& of) {
            if constexpr (std::is_arithmetic_v<std::remove_cvref_t<decltype(of)>>)
                return std::isfinite(of);
            else
                return std::isfinite(dot(of, of));
        };
        if (!finite(momentum) || !finite(angular_momentum) || !finite(force) || !finite(torque))
            throw parameter_error(
                sentence("A momentum, a force or a torque of a ", name, " is not finite; give numbers."));
    }

    /// \name Interface of boundaries, as in boundary/concept.hpp
    /// @{

    /// Calls f(collider).
    template <class F>
    FIRN_INLINE void for_members(const F& f) const {
        f(collider);
    }
    /// Returns the collider, converted to scalar type T.
    template <class T>
    with_scalar<T> lifted() const {
        check();
        return lift<T>(collider);
    }
    /// Returns the body at a time dt [s] later, moved without forces. The rotation uses the angular velocity half a
    /// step ahead, which is of second order in the step, so that a body that tumbles keeps its energy.
    RigidBody advanced(double dt) const {
        RigidBody later = *this;
        bool turns_freely = false;
        for (int i = D; i < motions; ++i) turns_freely = turns_freely || !drive.keeps(i);
        later.collider.position += collider.linear_velocity * dt;
        Rotor<double, D>& rotation = later.collider.rotation;
        if (turns_freely) {
            const auto halfway = turned(rotation, collider.angular_velocity * (dt / 2));
            rotation = turned(rotation, spin(halfway) * dt);
            later.collider.angular_velocity = later.angular_velocity();
        } else {
            rotation = turned(rotation, collider.angular_velocity * dt);
            later.angular_momentum = inertia_in_space(rotation) * collider.angular_velocity;
        }
        return later;
    }
    /// Returns the body adapted to a grid with cells of side h [m].
    template <class H>
    RigidBody on_grid(const H& h) const {
        RigidBody there = *this;
        there.collider = firn::on_grid(collider, h);
        return there;
    }
    /// Returns the collider for positions that are measured from `corner` [m].
    auto measured_from(const Vec<double, D>& corner) const { return collider.measured_from(corner); }
    /// Returns true if the solid or its layer may change nodes in the box [lower, upper] [m].
    bool reaches(const Vec<double, D>& lower, const Vec<double, D>& upper) const {
        return collider.reaches(lower, upper);
    }
    /// Returns what Collider::looks_around() does.
    double looks_around() const { return collider.looks_around(); }
    /// Calls `seen` for the surfaces of the collider.
    template <class T, class Seen>
        requires has_surfaces<C, T, D>
    void surfaces(const Vec<T, D>& x, const Seen& seen) const {
        collider.surfaces(x, seen);
    }
    /// Returns a description, as it is written into files.
    std::string description() const { return sentence("rigid body: ", collider.description()); }
    /// @}

private:
    static constexpr int row_of[6] = {0, 1, 2, 1, 0, 0}, column_of[6] = {0, 1, 2, 2, 2, 1};

    /// Returns the angular velocity that the angular momentum gives the body at this rotation [rad/s].
    Axial<double, D> spin(const Rotor<double, D>& rotation) const {
        if constexpr (D == 2) {
            return angular_momentum / inertia[0];
        } else {
            const Mat<double, 3> R = matrix_of(rotation);
            return R * (inverse_transposed(inertia_matrix()) * (transpose(R) * angular_momentum));
        }
    }
};

}  // namespace firn::inline FIRN_BUILD
