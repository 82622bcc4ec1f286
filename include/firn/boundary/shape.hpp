/// \file The concept of a shape: a solid, given by the signed distance from its surface in the shape's own coordinates.
/// A Collider gives the shape a position and a motion.
///
/// A shape is a policy with a scalar type S. It must have
///
///     S signed_distance(x)   signed distance [m] of the position x [m] from the surface, negative inside. The result
///                            may be smaller than the true distance. For two positions with a distance |Δx| between
///                            them, the results must not differ by more than |Δx|, since firn skips blocks of nodes
///                            that are far from the surface
///
/// and it may have
///
///     Vec normal(x)          outward unit normal, the gradient of the signed distance. Without this function, firn
///                            differentiates the signed distance with dual numbers
///     double uncertainty()   error [m]: the signed distances of two positions differ by at most |Δx| plus this error
///     distances_within(x, r) two numbers [m] between which the signed distances of all positions lie that are at most
///                            r [m] from x; for shapes that keep neither to |Δx| nor to |Δx| plus one error
///     double exact_up_to()   the size [m] from which on signed distances are not exact, for a shape that caps them: a
///                            shape with min(d, 0.1) returns 0.1. Without this function, none is capped. firn compares
///                            distances with the layer of a Collider and with the radii of points, and refuses a shape
///                            that does not know distances so large
///     double extent()        largest distance [m] of a point of the shape from the origin
///     flat = true            the normal is the same everywhere
///     convex = true          the solid is convex;  smooth = true: its surface has no edges. Unless one of them is
///                            true, firn looks for concave corners around nodes that touch the solid
///     void faces(x, seen)    calls seen(distance, normal) for each face of a solid that several half-spaces form
///                            together: the signed distance of x from the plane of the face [m], and its normal. Then
///                            all faces that are near a node act on the node, in corners, too
///     void check()           throws parameter_error if a parameter is out of range
#pragma once

#include <firn/core/dual.hpp>
#include <firn/core/parameters.hpp>

namespace firn::inline FIRN_BUILD {

/// The scalar type and the dimension of a shape that declares them as `scalar_type` and `dimension`.
template <class Shape>
struct shape_facts {
    using scalar_type = typename Shape::scalar_type;
    static constexpr int dimension = Shape::dimension;
};
/// The scalar type and the dimension of a shape `P<S, D>`.
template <template <class, int> class P, class S, int D>
struct shape_facts<P<S, D>> {
    using scalar_type = S;
    static constexpr int dimension = D;
};

/// Whether Shape has a function `signed_distance(x)`. The function returns the signed distance of x from the surface
/// [m], negative inside.
template <class Shape, class S, int D>
concept has_signed_distance = requires(const Shape shape, const Vec<S, D> x) {
    { shape.signed_distance(x) } -> std::same_as<S>;
};

/// Whether the shape's normal is the same everywhere: false for a shape that does not declare `flat`.
template <class Shape>
inline constexpr bool is_flat = false;
/// Whether the shape's normal is the same everywhere: Shape::flat, for a shape that declares `flat`.
template <class Shape>
    requires requires { Shape::flat; }
inline constexpr bool is_flat<Shape> = Shape::flat;

/// Whether the solid is convex: false for a shape that does not declare `convex`.
template <class Shape>
inline constexpr bool is_convex = false;
/// Whether the solid is convex: Shape::convex, for a shape that declares `convex`.
template <class Shape>
    requires requires { Shape::convex; }
inline constexpr bool is_convex<Shape> = Shape::convex;
/// Whether the surface has no edges: false for a shape that does not declare `smooth`.
template <class Shape>
inline constexpr bool is_smooth = false;
/// Whether the surface has no edges: Shape::smooth, for a shape that declares `smooth`.
template <class Shape>
    requires requires { Shape::smooth; }
inline constexpr bool is_smooth<Shape> = Shape::smooth;

/// Whether the shape has a function `faces(x, seen)`. The function calls seen(distance, normal) for each face.
template <class Shape>
concept has_faces =
    requires(const Shape shape, const Vec<typename shape_facts<Shape>::scalar_type, shape_facts<Shape>::dimension> x) {
        shape.faces(x, [](const auto&, const auto&) {});
    };

/// Whether the shape may have concave corners that it does not name.
template <class Shape>
inline constexpr bool may_have_corners = !is_flat<Shape> && !is_convex<Shape> && !is_smooth<Shape> && !has_faces<Shape>;

/// Returns the unit vector v/‖v‖; or the unit vector along the second axis if ‖v‖ ≤ 1e-15, as at the centre of a
/// sphere.
template <scalar S, int D>
FIRN_INLINE Vec<S, D> direction_or_up(const Vec<S, D>& v) {
    Vec<S, D> up = Vec<S, D>::zero();
    up[1] = S(1);
    const S square = dot(v, v);
    const auto long_enough = S(detail::least_square) < square;
    return select(long_enough, v * (S(1) / sqrt(select(long_enough, square, S(1)))), up);
}

/// Returns the outward unit normal of a shape at x [m], in the shape's coordinates: shape.normal(x) if the shape has
/// this function, else the direction of the gradient of the shape's signed distance, computed with dual numbers.
template <class Shape, scalar S, int D>
FIRN_INLINE Vec<S, D> normal_of(const Shape& shape, const Vec<S, D>& x) {
    if constexpr (requires { shape.normal(x); }) {
        return detail::in_own_terms(shape.normal(x));
    } else {
        const auto differentiable = lift<dual<S>>(shape);
        Vec<S, D> gradient{};
        unroll<D>([&](auto axis) FIRN_LAMBDA {
            Vec<dual<S>, D> along{};
            unroll<D>([&](auto i) FIRN_LAMBDA { along.v[i] = {x.v[i], S(i == axis ? 1 : 0)}; });
            gradient.v[axis] = differentiable.signed_distance(along).derivative;
        });
        return direction_or_up(gradient);
    }
}

}  // namespace firn::inline FIRN_BUILD
