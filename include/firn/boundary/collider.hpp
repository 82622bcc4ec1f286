/// \file A rigid solid with a given motion: a shape with a position, a rotation and their rates.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/boundary/contact.hpp>
#include <firn/boundary/shape.hpp>
#include <firn/core/error.hpp>
#include <firn/core/names.hpp>
#include <firn/math/rotor.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace firn {

namespace detail {
struct named_collider {
    static constexpr const char* name = "collider";
};
}  // namespace detail

/// A rigid solid with a given motion: a floor, a ball, a wheel, a shovel, a container.
///
/// Nodes in the solid, and in a layer around it, get the velocity that its contact gives against the velocity of its
/// surface,
///
///     V + ω × (x − c)       [m/s]
///
/// Matter does not push it: the motion is as given. advanced() gives the collider a time later, and a simulation calls
/// it in every step. Simulation::reactions gives the forces on it. To move matter at a chosen velocity, use a collider
/// with contact `stick`.
///
/// The layer keeps matter out. A particle on the surface takes its velocity from nodes up to 1.5 cells away, the radius
/// of the quadratic spline; if all of them are held, the particle does not move in, wherever the surface lies between
/// nodes. Without a layer, matter gets in by up to 1.5 cells. With the default layer, it comes to rest up to one cell
/// before the surface.
///
/// Other solids (in a Together or a BoundaryList) can cover a face of this one, as a floor covers the lower face of a
/// box that stands on it. If nodes there took the normal of the covered face, the box would push them up and down and
/// let matter through sideways. So a node in another solid, or within two cells of it, takes the normal at the point
/// two cells outside that solid.
///
/// Position and rates are held in double, so that small steps add up. The contact is by Stomakhin et al. 2013, §8, as
/// in velocity_after_contact().
/// \tparam Shape  a shape, see boundary/shape.hpp: `Sphere<float, 3>`
template <class Shape>
struct Collider {
    using S = typename shape_facts<Shape>::scalar_type;      ///< The scalar of the shape.
    static constexpr int D = shape_facts<Shape>::dimension;  ///< The number of dimensions of space: 2 or 3.
    /// The scalar of position and motion: double if S is float or double, else S.
    using P = std::conditional_t<std::floating_point<S>, double, S>;
    /// The collider of the same shape with scalar T.
    template <class T>
    using with_scalar = Collider<with_scalar_t<Shape, T>>;

    Shape shape{};                                   ///< The shape, in its own coordinates.
    Contact contact = Contact::separate;             ///< How matter meets the surface.
    P friction = P(0);                               ///< Coulomb's coefficient μ [1]
    P thickness = P(0);                              ///< thickness of the layer [m], added to that in cells
    P thickness_in_cells = P(1.5);                   ///< thickness of the layer in cells of the grid [1]
    Vec<P, D> position = Vec<P, D>::zero();          ///< c: the shape's origin in space [m]
    Rotor<P, D> rotation = no_rotation<P, D>();      ///< from the shape's axes to those of space; make it with rotor()
    Vec<P, D> linear_velocity = Vec<P, D>::zero();   ///< V: velocity of the origin [m/s]
    Axial<P, D> angular_velocity = no_spin<P, D>();  ///< ω: about the origin [rad/s]; in 2D counter-clockwise
    P cell_size = P(0);                              ///< cell size of the grid [m], set by on_grid()

    static constexpr const char* name = detail::joined_names<detail::named_collider, Shape>::text;
    static constexpr auto parameters() {
        return std::tuple{parameter{"shape", "", &Collider::shape},
                          parameter{"friction", "1", &Collider::friction},
                          parameter{"thickness", "m", &Collider::thickness},
                          parameter{"thickness_in_cells", "1", &Collider::thickness_in_cells},
                          parameter{"position", "m", &Collider::position},
                          parameter{"rotation", "1", &Collider::rotation},
                          parameter{"linear_velocity", "m/s", &Collider::linear_velocity},
                          parameter{"angular_velocity", "rad/s", &Collider::angular_velocity}};
    }

    /// Checks the numbers of the collider and of its shape.
    /// \throws parameter_error if position or motion is not finite, if the rotor's length is not 1 to 1e-6, if friction
    /// or thickness is negative or not finite, and as the shape's check
    void check() const
        requires std::floating_point<S>
    {
        if constexpr (requires { shape.check(); }) shape.check();
        const auto refuse = [](const char* what, const auto& given, const char* allowed) {
            throw parameter_error(sentence("The ", what, " of a ", name, " is ", given, "; it must be ", allowed, "."));
        };
        if (!(friction >= 0) || !std::isfinite(friction)) refuse("friction", friction, "finite and not negative");
        if (!(thickness >= 0) || !std::isfinite(thickness)) refuse("thickness", thickness, "finite and not negative");
        if (!(thickness_in_cells >= 0) || !std::isfinite(thickness_in_cells))
            refuse("thickness in cells", thickness_in_cells, "finite and not negative");
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

    /// The collider with scalar T. Called once a step, before any node changes. \throws parameter_error as check()
    template <class T>
    with_scalar<T> lifted() const {
        if constexpr (std::floating_point<S>) check();
        using Q = typename with_scalar<T>::P;
        return {lift<T>(shape),
                contact,
                Q(friction),
                Q(thickness),
                Q(thickness_in_cells),
                cast<Q>(position),
                cast<Q>(rotation),
                cast<Q>(linear_velocity),
                cast_axial<Q, D>(angular_velocity),
                Q(cell_size)};
    }

    /// The collider for a grid with cells of side h [m].
    FIRN_INLINE Collider on_grid(const P& h) const {
        Collider there = *this;
        there.cell_size = h;
        return there;
    }
    /// The thickness of the layer around the solid [m].
    FIRN_INLINE P layer() const { return thickness + thickness_in_cells * cell_size; }

    /// The collider dt [s] later, moved and turned by its rates. Exact for constant rates, except for rounding in
    /// double.
    Collider advanced(double dt) const
        requires std::floating_point<S>
    {
        Collider later = *this;
        later.position += linear_velocity * dt;
        later.rotation = turned(rotation, angular_velocity * dt);
        return later;
    }

    /// The largest speed [m/s] of the solid in the box [lower, upper] [m]. \see firn::largest_speed
    double largest_speed(const Vec<double, D>& lower, const Vec<double, D>& upper) const
        requires std::floating_point<S>
    {
        if (!reaches(lower, upper)) return 0;
        Vec<double, D> arm{};  // to the farthest corner of the box
        for (int a = 0; a < D; ++a)
            arm[a] = std::max(std::abs(lower[a] - position[a]), std::abs(upper[a] - position[a]));
        double radius = norm(arm);
        if constexpr (requires { shape.extent(); }) radius = std::min(radius, shape.extent() + layer());
        return norm(linear_velocity) + std::sqrt(squared_norm(skew(angular_velocity)) / 2) * radius;
    }

    /// The velocity of the solid at x [m]: V + ω × (x − c) [m/s].
    FIRN_INLINE Vec<S, D> surface_velocity(const Vec<S, D>& x) const {
        return cast<S>(linear_velocity) + skew(cast_axial<S, D>(angular_velocity)) * (x - cast<S>(position));
    }

    /// The velocity [m/s] of a node at x [m] after contact, from its velocity v [m/s].
    FIRN_INLINE Vec<S, D> velocity(const Vec<S, D>& x, const Vec<S, D>& v) const {
        return velocity_beside(NoOthers{}, x, v);
    }
    /// As velocity(), beside other solids. \see velocity_among
    template <class Others>
    FIRN_INLINE Vec<S, D> velocity_beside(const Others& others, const Vec<S, D>& x, const Vec<S, D>& v) const {
        const Mat<S, D> R = matrix_of(cast<S>(rotation));
        const S thick = S(layer());
        Vec<S, D> local = transpose(R) * (x - cast<S>(position));
        S distance = named("distance", shape.signed_distance(local));
        if constexpr (!is_flat<Shape> && !std::same_as<Others, NoOthers>) {
            if (!any(distance <= thick + S(sight()) * S(cell_size))) return v;
            local = local + transpose(R) * way_out_of(others, x);
            distance = min(distance, shape.signed_distance(local));
        }
        const auto touched = distance <= thick;
        if (!any(touched)) return v;
        const Vec<S, D> surface = surface_velocity(x);
        const Vec<S, D> normal = contact == Contact::stick ? Vec<S, D>::zero() : R * normal_of(shape, local);
        return select(touched, surface + velocity_after_contact(v - surface, normal, contact, S(friction)), v);
    }

    /// Calls `seen` for the outer surface of the layer. \see has_surfaces
    template <class Seen>
    FIRN_INLINE void surfaces(const Vec<S, D>& x, const Seen& seen) const {
        const Mat<S, D> R = matrix_of(cast<S>(rotation));
        const Vec<S, D> local = transpose(R) * (x - cast<S>(position));
        seen(shape.signed_distance(local) - S(layer()), R * normal_of(shape, local), surface_velocity(x), contact,
             S(friction));
    }

    /// Can the solid or its layer change nodes of the box [lower, upper] [m]?
    bool reaches(const Vec<double, D>& lower, const Vec<double, D>& upper) const
        requires std::floating_point<S>
    {
        const auto exact = lift<double>(shape);
        const Mat<double, D> R = matrix_of(rotation);
        const Vec<double, D> middle = (lower + upper) * 0.5, half = (upper - lower) * 0.5;
        const Vec<double, D> local = transpose(R) * (middle - position);
        const double distance = exact.signed_distance(local);
        double farthest = norm(half);  // the most by which the distance in the box differs from that at its middle
        if constexpr (is_flat<Shape>) {
            const Vec<double, D> normal = R * normal_of(exact, local);
            farthest = 0;
            for (int a = 0; a < D; ++a) farthest += std::abs(normal[a]) * half[a];
        }
        if constexpr (requires { exact.uncertainty(); }) farthest += exact.uncertainty();
        // velocity() gets positions rounded to S.
        const double rounding = 32 * double(std::numeric_limits<S>::epsilon()) *
                                (norm(middle) + norm(half) + norm(position) + std::abs(distance));
        return distance <= farthest + layer() + rounding;
    }

    /// How far a node is from other solids, at most [m], for its normal to depend on them. \see firn::looks_around
    double looks_around() const
        requires std::floating_point<S>
    {
        return is_flat<Shape> ? 0 : sight() * cell_size * (1 + 1e-6);
    }

    /// A description for files: "collider_sphere: separate, friction 0.3".
    std::string description() const { return sentence(name, ": ", firn::name_of(contact), ", friction ", friction); }

private:
    static constexpr double off_others = 2, farthest_off = 4;  ///< in cells, along each axis
    /// How far a node is moved off other solids, at most [cells].
    static double sight() { return farthest_off * std::sqrt(double(D)); }

    /// The way [m] from x out of other solids, to two cells outside of them; at most `farthest_off` along each axis.
    template <class Others>
    FIRN_INLINE Vec<S, D> way_out_of(const Others& others, const Vec<S, D>& x) const {
        const S cell = S(cell_size), off = S(off_others) * cell, most = S(farthest_off) * cell;
        Vec<S, D> way = Vec<S, D>::zero();
        others(x,
               [&](const S& distance, const Vec<S, D>& normal, const Vec<S, D>&, Contact kind, const S&) FIRN_LAMBDA {
                   if (kind != Contact::none) way += normal * min(max(off - distance, S(0)), most);
               });
        unroll<D>([&](auto a) FIRN_LAMBDA { way.v[a] = min(max(way.v[a], -most), most); });
        return way;
    }
};

}  // namespace firn
