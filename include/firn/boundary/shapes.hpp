/// \file Shapes whose signed distance is known exactly, centred on their own origin.
#pragma once

#include <firn/boundary/shape.hpp>
#include <firn/core/error.hpp>
#include <firn/core/names.hpp>

#include <cmath>

namespace firn {

namespace detail {

/// \throws parameter_error unless it is positive and finite
inline void check_length(double length, const char* what, const char* shape) {
    if (!(length > 0) || !std::isfinite(length))
        throw parameter_error(
            sentence("The ", what, " of a ", shape, " is ", length, " m; it must be positive and finite."));
}

struct named_outside {
    static constexpr const char* name = "outside";
};

}  // namespace detail

/// All that lies below the plane through the origin: a floor, a slope.
template <scalar S, int D>
struct HalfSpace {
    Vec<S, D> outward = up();  ///< unit vector [1] out of the solid; the second axis

    static constexpr const char* name = "half_space";
    static constexpr bool flat = true;
    static constexpr auto parameters() { return std::tuple{parameter{"outward", "1", &HalfSpace::outward}}; }

    /// \throws parameter_error unless |outward| = 1 to 1e-5
    void check() const
        requires std::floating_point<S>
    {
        const double length = norm(cast<double>(outward));
        if (!(std::abs(length - 1) < 1e-5))
            throw parameter_error(sentence("The outward direction of a half-space has the length ", length,
                                           "; it must be 1. Divide it by its length."));
    }

    FIRN_INLINE S signed_distance(const Vec<S, D>& x) const { return dot(outward, x); }
    FIRN_INLINE Vec<S, D> normal(const Vec<S, D>&) const { return outward; }

private:
    static constexpr Vec<S, D> up() {
        Vec<S, D> direction = Vec<S, D>::zero();
        direction[1] = S(1);
        return direction;
    }
};

/// In the plane a disc.
template <scalar S, int D>
struct Sphere {
    S radius = S(0.1);  ///< [m]

    static constexpr const char* name = "sphere";
    static constexpr auto parameters() { return std::tuple{parameter{"radius", "m", &Sphere::radius}}; }

    /// \throws parameter_error unless the radius is positive and finite
    void check() const
        requires std::floating_point<S>
    {
        detail::check_length(double(radius), "radius", name);
    }
    double extent() const
        requires std::floating_point<S>
    {
        return double(radius);
    }

    FIRN_INLINE S signed_distance(const Vec<S, D>& x) const { return norm(x) - radius; }
    FIRN_INLINE Vec<S, D> normal(const Vec<S, D>& x) const { return direction_or_up(x); }
};

/// A cuboid (in the plane a rectangle) along the axes; its collider's rotation turns it.
template <scalar S, int D>
struct Box {
    Vec<S, D> half_extents = Vec<S, D>::filled(S(0.1));  ///< from the centre to the faces [m]

    static constexpr const char* name = "box";
    static constexpr auto parameters() { return std::tuple{parameter{"half_extents", "m", &Box::half_extents}}; }

    /// \throws parameter_error unless all of them are positive and finite
    void check() const
        requires std::floating_point<S>
    {
        for (int a = 0; a < D; ++a) detail::check_length(double(half_extents[a]), "half extent", name);
    }
    double extent() const
        requires std::floating_point<S>
    {
        return norm(cast<double>(half_extents));
    }

    FIRN_INLINE S signed_distance(const Vec<S, D>& x) const {
        const Position at = locate(x);
        return select(at.is_outside, sqrt(select(at.is_outside, dot(at.beyond, at.beyond), S(1))), at.depth);
    }
    FIRN_INLINE Vec<S, D> normal(const Vec<S, D>& x) const {
        const Position at = locate(x);
        return select(at.is_outside, direction_or_up(at.beyond), at.nearest_face);
    }

private:
    struct Position {
        Vec<S, D> beyond;        ///< from the nearest point of the box, outside of it
        Vec<S, D> nearest_face;  ///< outward normal of the face that is nearest from inside
        S depth;                 ///< signed distance of that face
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

/// All within a radius of a segment along the second axis: a cylinder with rounded ends.
template <scalar S, int D>
struct Capsule {
    S half_length = S(0.1);  ///< of the segment [m]
    S radius = S(0.05);      ///< [m]

    static constexpr const char* name = "capsule";
    static constexpr auto parameters() {
        return std::tuple{parameter{"half_length", "m", &Capsule::half_length},
                          parameter{"radius", "m", &Capsule::radius}};
    }

    /// \throws parameter_error unless both are positive and finite
    void check() const
        requires std::floating_point<S>
    {
        detail::check_length(double(half_length), "half length", name);
        detail::check_length(double(radius), "radius", name);
    }
    double extent() const
        requires std::floating_point<S>
    {
        return double(half_length) + double(radius);
    }

    FIRN_INLINE S signed_distance(const Vec<S, D>& x) const { return norm(from_segment(x)) - radius; }
    /// On the segment itself, where there is none, the direction of the second axis.
    FIRN_INLINE Vec<S, D> normal(const Vec<S, D>& x) const { return direction_or_up(from_segment(x)); }

private:
    FIRN_INLINE Vec<S, D> from_segment(Vec<S, D> x) const {
        x.v[1] = x.v[1] - min(max(x.v[1], -half_length), half_length);
        return x;
    }
};

/// The outside of a shape, solid: a container.
template <class Shape>
struct Complement {
    Shape hollow{};  ///< what is free

    using scalar_type = typename shape_facts<Shape>::scalar_type;
    static constexpr int dimension = shape_facts<Shape>::dimension;
    template <class T>
    using with_scalar = Complement<with_scalar_t<Shape, T>>;

    static constexpr const char* name = detail::joined_names<detail::named_outside, Shape>::text;
    static constexpr bool flat = is_flat<Shape>;
    static constexpr auto parameters() { return std::tuple{parameter{"hollow", "", &Complement::hollow}}; }
    template <class T>
    with_scalar<T> lifted() const {
        return {lift<T>(hollow)};
    }

    /// \throws parameter_error, as the shape's
    void check() const
        requires requires(const Shape s) { s.check(); }
    {
        hollow.check();
    }
    double uncertainty() const
        requires requires(const Shape s) { s.uncertainty(); }
    {
        return hollow.uncertainty();
    }

    FIRN_INLINE scalar_type signed_distance(const Vec<scalar_type, dimension>& x) const {
        return -hollow.signed_distance(x);
    }
    FIRN_INLINE Vec<scalar_type, dimension> normal(const Vec<scalar_type, dimension>& x) const {
        return -normal_of(hollow, x);
    }
};

}  // namespace firn
