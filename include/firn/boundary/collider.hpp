/// \file A solid that moves as it is told: a shape with a place, a rotation and their rates.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/boundary/contact.hpp>
#include <firn/boundary/shape.hpp>
#include <firn/core/error.hpp>
#include <firn/core/names.hpp>
#include <firn/math/rotor.hpp>

#include <limits>

namespace firn {

namespace detail {
struct named_collider {
    static constexpr const char* name = "collider";
};
}  // namespace detail

/// Nodes in the solid, and within `thickness` of it, follow its contact with the velocity of its surface,
/// V + ω × (x − c). What moves matter by an explicit velocity is such a solid, too: contact stick.
///
/// It is where it is said to be: `advanced(dt)` gives the collider dt later. Place and rates are held in double, so
/// that the smallest of steps count.
template <class Shape>
struct Collider {
    using S = typename shape_facts<Shape>::scalar_type;
    static constexpr int D = shape_facts<Shape>::dimension;
    /// Of place and motion: double for float and double, the scalar itself for lanes and the like.
    using P = std::conditional_t<std::floating_point<S>, double, S>;
    template <class T>
    using with_scalar = Collider<with_scalar_t<Shape, T>>;

    Shape shape{};
    Contact contact = Contact::separate;
    P friction = P(0);                               ///< Coulomb's coefficient μ [1]
    P thickness = P(0);                              ///< of the layer around the solid that counts as solid [m]
    Vec<P, D> position = Vec<P, D>::zero();          ///< c: of the shape's origin [m]
    Rotor<P, D> rotation = no_rotation<P, D>();      ///< from the shape's axes to the world's; see rotor()
    Vec<P, D> linear_velocity = Vec<P, D>::zero();   ///< V: of the origin [m/s]
    Axial<P, D> angular_velocity = no_spin<P, D>();  ///< ω: about the origin [rad/s]; in the plane counter-clockwise

    static constexpr const char* name = detail::joined_names<detail::named_collider, Shape>::text;
    static constexpr auto parameters() {
        return std::tuple{parameter{"shape", "", &Collider::shape},
                          parameter{"friction", "1", &Collider::friction},
                          parameter{"thickness", "m", &Collider::thickness},
                          parameter{"position", "m", &Collider::position},
                          parameter{"rotation", "1", &Collider::rotation},
                          parameter{"linear_velocity", "m/s", &Collider::linear_velocity},
                          parameter{"angular_velocity", "rad/s", &Collider::angular_velocity}};
    }

    /// \throws parameter_error for a place or motion that is not finite, a rotor whose length is not 1 to 1e-6,
    /// negative friction or thickness, and as the shape's check
    void check() const
        requires std::floating_point<S>
    {
        if constexpr (requires { shape.check(); }) shape.check();
        const auto refuse = [](const char* what, const auto& given, const char* allowed) {
            throw parameter_error(sentence("The ", what, " of a ", name, " is ", given, "; it must be ", allowed, "."));
        };
        if (!(friction >= 0) || !std::isfinite(friction)) refuse("friction", friction, "finite and not negative");
        if (!(thickness >= 0) || !std::isfinite(thickness)) refuse("thickness", thickness, "finite and not negative");
        for (int a = 0; a < D; ++a) {
            if (!std::isfinite(position[a])) refuse("position", position[a], "finite along every axis");
            if (!std::isfinite(linear_velocity[a]))
                refuse("linear velocity", linear_velocity[a], "finite along every axis");
        }
        const Mat<P, D> spin = skew(angular_velocity);
        if (!std::isfinite(squared_norm(spin))) refuse("angular velocity", squared_norm(spin), "finite");
        const double length = norm(rotation);
        if (!(std::abs(length - 1) < 1e-6))
            refuse("rotation", sentence("a quaternion of length ", length), "of length 1: make it with rotor()");
    }

    /// Once a step, before any node is touched. \throws parameter_error, as check()
    template <class T>
    with_scalar<T> lifted() const {
        if constexpr (std::floating_point<S>) check();
        using Q = typename with_scalar<T>::P;
        return {lift<T>(shape),
                contact,
                Q(friction),
                Q(thickness),
                cast<Q>(position),
                cast<Q>(rotation),
                cast<Q>(linear_velocity),
                cast_axial<Q, D>(angular_velocity)};
    }

    /// The collider dt [s] later, moved and turned by its constant rates: exactly, but for rounding in double.
    Collider advanced(double dt) const
        requires std::floating_point<S>
    {
        Collider later = *this;
        later.position += linear_velocity * dt;
        later.rotation = turned(rotation, angular_velocity * dt);
        return later;
    }

    double largest_speed(const Vec<double, D>& lower, const Vec<double, D>& upper) const
        requires std::floating_point<S>
    {
        if (!reaches(lower, upper)) return 0;
        Vec<double, D> arm{};  // to the farthest corner of the box
        for (int a = 0; a < D; ++a)
            arm[a] = std::max(std::abs(lower[a] - position[a]), std::abs(upper[a] - position[a]));
        double radius = norm(arm);
        if constexpr (requires { shape.extent(); }) radius = std::min(radius, shape.extent() + thickness);
        return norm(linear_velocity) + std::sqrt(squared_norm(skew(angular_velocity)) / 2) * radius;
    }

    /// The velocity of the solid at x [m/s].
    FIRN_INLINE Vec<S, D> surface_velocity(const Vec<S, D>& x) const {
        return cast<S>(linear_velocity) + skew(cast_axial<S, D>(angular_velocity)) * (x - cast<S>(position));
    }

    FIRN_INLINE Vec<S, D> velocity(const Vec<S, D>& x, const Vec<S, D>& v) const {
        const Mat<S, D> R = matrix_of(cast<S>(rotation));
        const Vec<S, D> local = transpose(R) * (x - cast<S>(position));
        const auto touched = named("distance", shape.signed_distance(local)) <= S(thickness);
        if (!any(touched)) return v;
        const Vec<S, D> surface = surface_velocity(x);
        const Vec<S, D> normal = contact == Contact::stick ? Vec<S, D>::zero() : R * normal_of(shape, local);
        return select(touched, surface + velocity_after_contact(v - surface, normal, contact, S(friction)), v);
    }

    /// The layer's surface. \see has_surfaces
    template <class Seen>
    FIRN_INLINE void surfaces(const Vec<S, D>& x, const Seen& seen) const {
        const Mat<S, D> R = matrix_of(cast<S>(rotation));
        const Vec<S, D> local = transpose(R) * (x - cast<S>(position));
        seen(shape.signed_distance(local) - S(thickness), R * normal_of(shape, local), surface_velocity(x), contact,
             S(friction));
    }

    bool reaches(const Vec<double, D>& lower, const Vec<double, D>& upper) const
        requires std::floating_point<S>
    {
        const auto exact = lift<double>(shape);
        const Mat<double, D> R = matrix_of(rotation);
        const Vec<double, D> middle = (lower + upper) * 0.5, half = (upper - lower) * 0.5;
        const Vec<double, D> local = transpose(R) * (middle - position);
        const double distance = exact.signed_distance(local);
        double farthest = norm(half);  // by which the distance changes at most, from the middle of the box
        if constexpr (is_flat<Shape>) {
            const Vec<double, D> normal = R * normal_of(exact, local);
            farthest = 0;
            for (int a = 0; a < D; ++a) farthest += std::abs(normal[a]) * half[a];
        }
        if constexpr (requires { exact.uncertainty(); }) farthest += exact.uncertainty();
        // velocity() sees nodes rounded to S.
        const double rounding = 32 * double(std::numeric_limits<S>::epsilon()) *
                                (norm(middle) + norm(half) + norm(position) + std::abs(distance));
        return distance <= farthest + thickness + rounding;
    }

    /// "collider_sphere: separate, friction 0.3", for files.
    std::string description() const { return sentence(name, ": ", firn::name_of(contact), ", friction ", friction); }
};

}  // namespace firn
