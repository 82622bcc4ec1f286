/// \file What a shape is: a signed distance in coordinates of its own. Colliders give it a place and a motion.
///
/// A shape is a policy in a scalar with, for any position x [m],
///
///     S signed_distance(x)   [m], negative inside; it may be too small, but must change by at most |Δx| (its gradient
///                            has at most unit length), for by it whole blocks of nodes are found untouched
///
/// and, where it knows better than the general way:
///
///     Vec normal(x)          outward unit normal: the gradient of the distance. Else it comes from dual numbers.
///     double uncertainty()   by how much [m] the distance of two points may change beyond |Δx|
///     double extent()        no point of the shape is farther from its origin [m]
///     flat = true            the normal is the same everywhere
///     void check()           throws parameter_error for what cannot be
#pragma once

#include <firn/core/dual.hpp>
#include <firn/core/parameters.hpp>

namespace firn {

/// The scalar and the dimension of a shape P<S, D>; others say `using scalar_type = S` and `dimension`.
template <class Shape>
struct shape_facts {
    using scalar_type = typename Shape::scalar_type;
    static constexpr int dimension = Shape::dimension;
};
template <template <class, int> class P, class S, int D>
struct shape_facts<P<S, D>> {
    using scalar_type = S;
    static constexpr int dimension = D;
};

template <class Shape, class S, int D>
concept has_signed_distance = requires(const Shape shape, const Vec<S, D> x) {
    { shape.signed_distance(x) } -> std::same_as<S>;
};

/// Whether the shape's normal is the same everywhere.
template <class Shape>
inline constexpr bool is_flat = false;
template <class Shape>
    requires requires { Shape::flat; }
inline constexpr bool is_flat<Shape> = Shape::flat;

/// v over its length; where it is not longer than 1e-15 (at the centre of a sphere), the direction of the second axis.
template <scalar S, int D>
FIRN_INLINE Vec<S, D> direction_or_up(const Vec<S, D>& v) {
    Vec<S, D> up = Vec<S, D>::zero();
    up[1] = S(1);
    const S square = dot(v, v);
    const auto long_enough = S(1e-30) < square;
    return select(long_enough, v * (S(1) / sqrt(select(long_enough, square, S(1)))), up);
}

/// The outward unit normal of a shape at x, in the shape's coordinates.
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
