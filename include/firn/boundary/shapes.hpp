/// \file Shapes with an exact signed distance: half-space, sphere, box, capsule, and the outside of a shape.
#pragma once

#include <firn/boundary/shape.hpp>
#include <firn/core/error.hpp>
#include <firn/core/names.hpp>

#include <array>
#include <cmath>
#include <utility>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Checks a length [m].
/// \throws parameter_error unless the length is positive and finite
inline void check_length(double length, const char* what, const char* shape) {
    if (!(length > 0) || !std::isfinite(length))
        throw parameter_error(
            sentence("The ", what, " of a ", shape, " is ", length, " m; it must be positive and finite."));
}

struct named_outside {
    static constexpr const char* name = "outside";
};

}  // namespace detail

/// A half-space: all points on one side of a plane through the origin, for a floor, a slope or a wall. The vector
/// `outward` points away from this side.
template <scalar S, int D>
struct HalfSpace {
    Vec<S, D> outward = up();  ///< unit vector out of the solid [1]; by default the second axis

    static constexpr const char* name = "half_space";
    static constexpr bool flat = true;  ///< The normal is the same everywhere.
    static constexpr auto parameters() { return std::tuple{parameter{"outward", "1", &HalfSpace::outward}}; }

    /// Checks the direction.
    /// \throws parameter_error unless the length of `outward` differs from 1 by less than 1e-5
    void check() const
        requires std::floating_point<S>
    {
        const double length = norm(cast<double>(outward));
        if (!(std::abs(length - 1) < 1e-5))
            throw parameter_error(sentence("The outward direction of a half-space has the length ", length,
                                           "; it must be 1. Divide it by its length."));
    }

    /// The signed distance of x from the plane [m], negative in the solid.
    FIRN_INLINE S signed_distance(const Vec<S, D>& x) const { return dot(outward, x); }
    /// The outward unit normal [1].
    FIRN_INLINE Vec<S, D> normal(const Vec<S, D>&) const { return outward; }

private:
    static constexpr Vec<S, D> up() {
        Vec<S, D> direction = Vec<S, D>::zero();
        direction[1] = S(1);
        return direction;
    }
};

/// A sphere with its centre at the origin; in 2D a disc.
template <scalar S, int D>
struct Sphere {
    S radius = S(0.1);  ///< radius of the sphere [m]

    static constexpr const char* name = "sphere";
    static constexpr bool convex = true,  ///< The solid is convex.
        smooth = true;                    ///< Its surface has no edges.
    static constexpr auto parameters() { return std::tuple{parameter{"radius", "m", &Sphere::radius}}; }

    /// Checks the radius.
    /// \throws parameter_error unless the radius is positive and finite
    void check() const
        requires std::floating_point<S>
    {
        detail::check_length(double(radius), "radius", name);
    }
    /// The largest distance of a point of the shape from the origin [m].
    double extent() const
        requires std::floating_point<S>
    {
        return double(radius);
    }

    /// The signed distance of x from the surface [m], negative inside.
    FIRN_INLINE S signed_distance(const Vec<S, D>& x) const { return norm(x) - radius; }
    /// The outward unit normal at x [1]; at the centre, it points along the second axis.
    FIRN_INLINE Vec<S, D> normal(const Vec<S, D>& x) const { return direction_or_up(x); }
};

/// A cuboid with its centre at the origin and its edges along the axes; in 2D a rectangle. To turn the cuboid, set
/// Collider::rotation.
template <scalar S, int D>
struct Box {
    Vec<S, D> half_extents = Vec<S, D>::filled(S(0.1));  ///< distances from the centre to the faces [m]

    static constexpr const char* name = "box";
    static constexpr bool convex = true;  ///< The solid is convex.
    static constexpr auto parameters() { return std::tuple{parameter{"half_extents", "m", &Box::half_extents}}; }

    /// Checks the half extents.
    /// \throws parameter_error unless all half extents are positive and finite
    void check() const
        requires std::floating_point<S>
    {
        for (int a = 0; a < D; ++a) detail::check_length(double(half_extents[a]), "half extent", name);
    }
    /// The largest distance of a point of the shape from the origin [m].
    double extent() const
        requires std::floating_point<S>
    {
        return norm(cast<double>(half_extents));
    }

    /// The signed distance of x from the surface [m], negative inside.
    FIRN_INLINE S signed_distance(const Vec<S, D>& x) const {
        const Position at = locate(x);
        return select(at.is_outside, sqrt(select(at.is_outside, dot(at.beyond, at.beyond), S(1))), at.depth);
    }
    /// The outward unit normal at x [1]; inside, it is the normal of the nearest face.
    FIRN_INLINE Vec<S, D> normal(const Vec<S, D>& x) const {
        const Position at = locate(x);
        return select(at.is_outside, direction_or_up(at.beyond), at.nearest_face);
    }
    /// Calls seen(distance, normal) for each face: the signed distance of x from its plane [m], negative on the side of
    /// the box, and its outward normal.
    template <class Seen>
    FIRN_INLINE void planes(const Vec<S, D>& x, const Seen& seen) const {
        unroll<D>([&](auto a) FIRN_LAMBDA {
            Vec<S, D> axis = Vec<S, D>::zero();
            axis[a] = S(1);
            seen(x.v[a] - half_extents.v[a], axis);
            seen(-x.v[a] - half_extents.v[a], -axis);
        });
    }

private:
    struct Position {
        Vec<S, D> beyond;        ///< vector from the nearest point of the box to x [m], zero inside
        Vec<S, D> nearest_face;  ///< outward normal of the nearest face, if x is inside
        S depth;                 ///< signed distance of x from the nearest face [m]
        mask_t<S> is_outside;
    };
    FIRN_INLINE Position locate(const Vec<S, D>& x) const {
        Position at{};
        unroll<D>([&](auto a) FIRN_LAMBDA {
            const S side = select(x.v[a] < S(0), S(-1), S(1)), over = abs(x.v[a]) - half_extents.v[a];
            at.beyond.v[a] = side * max(over, S(0));
            Vec<S, D> face = Vec<S, D>::zero();
            face.v[a] = side;
            if constexpr (a == 0) {
                at.nearest_face = face;
                at.depth = over;
            } else {
                at.nearest_face = select(at.depth < over, face, at.nearest_face);
                at.depth = max(at.depth, over);
            }
        });
        at.is_outside = S(0) < at.depth;
        return at;
    }
};

/// A cylinder with rounded ends along the second axis, with its centre at the origin: all points whose distance from a
/// segment is at most `radius`.
template <scalar S, int D>
struct Capsule {
    S half_length = S(0.1);  ///< half the length of the segment [m]
    S radius = S(0.05);      ///< radius of the cylinder and of its ends [m]

    static constexpr const char* name = "capsule";
    static constexpr bool convex = true,  ///< The solid is convex.
        smooth = true;                    ///< Its surface has no edges.
    static constexpr auto parameters() {
        return std::tuple{parameter{"half_length", "m", &Capsule::half_length},
                          parameter{"radius", "m", &Capsule::radius}};
    }

    /// Checks both lengths.
    /// \throws parameter_error unless `half_length` and `radius` are positive and finite
    void check() const
        requires std::floating_point<S>
    {
        detail::check_length(double(half_length), "half length", name);
        detail::check_length(double(radius), "radius", name);
    }
    /// The largest distance of a point of the shape from the origin [m].
    double extent() const
        requires std::floating_point<S>
    {
        return double(half_length) + double(radius);
    }

    /// The signed distance of x from the surface [m], negative inside.
    FIRN_INLINE S signed_distance(const Vec<S, D>& x) const { return norm(from_segment(x)) - radius; }
    /// Returns the outward unit normal [1] at the point x [m]. If x lies on the segment, the normal points along the
    /// second axis.
    FIRN_INLINE Vec<S, D> normal(const Vec<S, D>& x) const { return direction_or_up(from_segment(x)); }

private:
    FIRN_INLINE Vec<S, D> from_segment(Vec<S, D> x) const {
        x.v[1] = x.v[1] - min(max(x.v[1], -half_length), half_length);
        return x;
    }
};

/// The outside of a shape: a solid with a hollow that has this shape, such as a container for matter. In the corners of
/// a box all its faces act.
/// \tparam Shape  a shape, as in `Complement<Sphere<float, 3>>`
template <class Shape>
struct Complement {
    Shape hollow{};  ///< The shape of the free space (the hollow).

    using scalar_type = typename shape_facts<Shape>::scalar_type;
    static constexpr int dimension = shape_facts<Shape>::dimension;
    /// The type of this shape with scalar type T.
    template <class T>
    using with_scalar = Complement<with_scalar_t<Shape, T>>;

    static constexpr const char* name = detail::joined_names<detail::named_outside, Shape>::text;
    static constexpr bool flat = is_flat<Shape>;      ///< True if the normal is the same everywhere.
    static constexpr bool smooth = is_smooth<Shape>;  ///< True if the surface has no edges.
    static constexpr auto parameters() { return std::tuple{parameter{"hollow", "", &Complement::hollow}}; }
    /// Returns this shape with scalar type T.
    template <class T>
    with_scalar<T> lifted() const {
        return {lift<T>(hollow)};
    }

    /// Returns this shape for positions that are measured from another point, and this point [m].
    auto from_its_place() const
        requires requires(const Shape s) { s.from_its_place(); }
    {
        const auto [moved, origin] = hollow.from_its_place();
        return std::pair{Complement{moved}, origin};
    }
    /// Checks the shape `hollow`.
    /// \throws parameter_error if hollow.check() throws it
    void check() const
        requires requires(const Shape s) { s.check(); }
    {
        hollow.check();
    }
    /// Returns hollow.uncertainty(), an error [m]: the signed distances of two points differ by at most the distance
    /// between the two points plus this error.
    double uncertainty() const
        requires requires(const Shape s) { s.uncertainty(); }
    {
        return hollow.uncertainty();
    }
    /// Returns hollow.exact_up_to(), the size [m] from which on distances are not exact.
    double exact_up_to() const
        requires requires(const Shape s) { s.exact_up_to(); }
    {
        return hollow.exact_up_to();
    }
    /// Returns two numbers [m]. The signed distances of all points within `radius` [m] of x [m] lie between them.
    std::array<double, 2> distances_within(const Vec<double, dimension>& x, double radius) const
        requires requires(const Shape s) { s.distances_within(x, radius); }
    {
        const auto [least, greatest] = hollow.distances_within(x, radius);
        return {-greatest, -least};
    }

    /// The signed distance of x from the surface [m], negative outside of `hollow`.
    FIRN_INLINE scalar_type signed_distance(const Vec<scalar_type, dimension>& x) const {
        return -hollow.signed_distance(x);
    }
    /// The unit normal at x [1]; it points into `hollow`.
    FIRN_INLINE Vec<scalar_type, dimension> normal(const Vec<scalar_type, dimension>& x) const {
        return -normal_of(hollow, x);
    }
    /// Calls seen(distance, normal) for each face of a box. \see has_faces
    template <class Seen>
        requires requires(const Shape s, const Vec<scalar_type, dimension> x, const Seen f) { s.planes(x, f); }
    FIRN_INLINE void faces(const Vec<scalar_type, dimension>& x, const Seen& seen) const {
        hollow.planes(x, [&](const scalar_type& distance, const Vec<scalar_type, dimension>& normal)
                             FIRN_LAMBDA { seen(-distance, -normal); });
    }
};

}  // namespace firn::inline FIRN_BUILD
