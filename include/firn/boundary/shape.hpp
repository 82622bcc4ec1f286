/// \file What a shape is: a signed distance in its own coordinates. A Collider gives it a position and a motion.
///
/// A shape is a policy with a scalar S. For every position x [m] it must have
///
///     S signed_distance(x)   [m], negative inside. It may be smaller than the true distance, but must change by at
///                            most |Δx| from point to point: whole blocks of nodes are skipped by it
///
/// and it may have
///
///     Vec normal(x)          outward unit normal, the gradient of the distance; else dual numbers differentiate it
///     double uncertainty()   by how much [m] the distance may change from point to point beyond |Δx|
///     double extent()        largest distance [m] of a point of the shape from its origin
///     flat = true            the normal is the same everywhere
///     void check()           throws parameter_error if a number is impossible
#pragma once

#include <firn/core/dual.hpp>
#include <firn/core/parameters.hpp>

namespace firn {

/// The scalar and the dimension of a shape that declares them as `scalar_type` and `dimension`.
template <class Shape>
struct shape_facts {
    using scalar_type = typename Shape::scalar_type;
    static constexpr int dimension = Shape::dimension;
};
/// The scalar and the dimension of a shape `P<S, D>`.
template <template <class, int> class P, class S, int D>
struct shape_facts<P<S, D>> {
    using scalar_type = S;
    static constexpr int dimension = D;
};

/// Has Shape `signed_distance(x)`? It returns the signed distance of x from the surface [m], negative inside.
template <class Shape, class S, int D>
concept has_signed_distance = requires(const Shape shape, const Vec<S, D> x) {
    { shape.signed_distance(x) } -> std::same_as<S>;
};

/// Is the shape's normal the same everywhere? False if the shape does not declare `flat`.
template <class Shape>
inline constexpr bool is_flat = false;
/// Is the shape's normal the same everywhere? The shape's own `flat`.
template <class Shape>
    requires requires { Shape::flat; }
inline constexpr bool is_flat<Shape> = Shape::flat;

/// The unit vector along v; the second axis if v is not longer than 1e-15, as at the centre of a sphere.
template <scalar S, int D>
FIRN_INLINE Vec<S, D> direction_or_up(const Vec<S, D>& v) {
    Vec<S, D> up = Vec<S, D>::zero();
    up[1] = S(1);
    const S square = dot(v, v);
    const auto long_enough = S(1e-30) < square;
    return select(long_enough, v * (S(1) / sqrt(select(long_enough, square, S(1)))), up);
}

/// The outward unit normal of a shape at x [m], in the shape's coordinates: its normal(x) if it has one, else the
/// gradient of its distance by dual numbers.
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

}  // namespace firn
