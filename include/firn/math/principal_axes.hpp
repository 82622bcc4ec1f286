/// \file Eigenvalues and eigenvectors of a symmetric matrix with the same work for every matrix, and the principal
/// stretches of a deformation gradient. In this file ε is the machine epsilon, and ‖·‖ is the Frobenius norm.
#pragma once

#include <firn/math/svd.hpp>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Returns the adjugate of a symmetric 3 × 3 matrix: its inverse times its determinant. It is exactly symmetric.
template <class S>
FIRN_INLINE Mat<S, 3> adjugate_of_symmetric(const Mat<S, 3>& A) {
    return symmetric<S, 3>([&](auto i, auto j) FIRN_LAMBDA {
        constexpr int i1 = (int(i) + 1) % 3, i2 = (int(i) + 2) % 3, j1 = (int(j) + 1) % 3, j2 = (int(j) + 2) % 3;
        return A(i1, j1) * A(i2, j2) - A(i1, j2) * A(i2, j1);
    });
}

}  // namespace detail

/// The eigenvalues of a symmetric matrix A and its eigenvectors: A = U diag(a) Uᵀ.
template <class S, int D>
struct PrincipalAxes {
    Mat<S, D> directions;  ///< U, a rotation; column i is the direction of aᵢ
    Vec<S, D> values;      ///< a, in descending order; has the unit of A
};

/// Returns the eigenvalues and eigenvectors of a symmetric 2 × 2 matrix A: ‖A − U diag(a) Uᵀ‖ ≤ 10 ε ‖A‖.
template <scalar S>
FIRN_INLINE PrincipalAxes<S, 2> principal_axes(const Mat<S, 2>& A) {
    const LeftSingular<S, 2> axes = detail::left_singular_of_stretch(A, S(1));
    return {axes.vectors, axes.values};
}

/// Returns the eigenvalues and eigenvectors of a symmetric 3 × 3 matrix A: ‖A − U diag(a) Uᵀ‖ ≤ 10 ε ‖A‖ and
/// ‖UUᵀ − I‖ ≤ 10 ε (measured: 5.4 ε ‖A‖ and 6.7 ε), also for equal or nearly equal eigenvalues.
///
/// The squares and cubes of A's deviator must lie in the range of the scalar.
///
/// The eigenvalues of C = dev A / √(‖dev A‖²/6) are 2 cos(θ + 2πk/3) with cos 3θ = ½ det C (Smith, Commun. ACM 4
/// (1961)). The one of largest absolute value, s x with s = sign(det C) and x in [√3, 2], is a well separated root of
/// x³ − 3x = |det C|; a polynomial gives the first guess, Newton's method the rest. Its direction is the longest column
/// of the adjugate of C − s x I. The other two come from the 2 × 2 matrix of C in the plane perpendicular to this
/// direction, by one Jacobi rotation. So no difference of nearly equal eigenvalues is divided by (compare Eberly,
/// "A robust eigensolver for 3 × 3 symmetric matrices", 2014).
template <scalar S>
FIRN_INLINE PrincipalAxes<S, 3> principal_axes(const Mat<S, 3>& A) {
    constexpr bool single = sizeof(value_type_t<S>) == 4;
    const S mean = named("mean", trace(A) * S(1. / 3));
    const Mat<S, 3> deviator = A - Mat<S, 3>::diagonal(mean);
    const S size = named("size", sqrt(squared_norm(deviator) * S(1. / 6)));
    const auto round = size == S(0);
    const Mat<S, 3> C = deviator * (S(1) / select(round, S(1), size));

    const S half = named("half", S(0.5) * determinant(C));
    const auto negative = half < S(0);
    const S r = abs(half);
    const S guess = S(1.73212376) + r * (S(0.330808334) + r * (S(-0.0817620091) + r * S(0.0188871079)));  // to 7.3e-5
    const S x = repeat<single ? 1 : 2>(guess, [&](const S& t) FIRN_LAMBDA {
        const S tt = t * t;
        return t - ((tt - S(3)) * t - (r + r)) / (S(3) * tt - S(3));
    });
    const S extreme = named("extreme", select(negative, -x, x));

    // The adjugate of C − extreme I is 3 (x² − 1) u uᵀ for the direction u.
    const Mat<S, 3> adjugate = detail::adjugate_of_symmetric(C - Mat<S, 3>::diagonal(extreme));
    const auto column = [&](int j) FIRN_LAMBDA { return Vec<S, 3>{{adjugate(0, j), adjugate(1, j), adjugate(2, j)}}; };
    const auto second_is_longer = adjugate(0, 0) < adjugate(1, 1);
    const Vec<S, 3> longer = select(second_is_longer, column(1), column(0));
    const auto third_is_longest = max(adjugate(0, 0), adjugate(1, 1)) < adjugate(2, 2);
    const Vec<S, 3> longest = select(third_is_longest, column(2), longer);
    const Vec<S, 3> u = longest * (S(1) / sqrt(dot(longest, longest)));

    // Two directions perpendicular to u (Duff et al., "Building an orthonormal basis, revisited", JCGT 6 (2017)).
    const S sign = select(u.v[2] < S(0), S(-1), S(1));
    const S a = S(-1) / (sign + u.v[2]);
    const S b = u.v[0] * u.v[1] * a;
    const Vec<S, 3> v{{S(1) + sign * u.v[0] * u.v[0] * a, sign * b, -(sign * u.v[0])}};
    const Vec<S, 3> w{{b, sign + u.v[1] * u.v[1] * a, -u.v[1]}};
    const Vec<S, 3> Cv = C * v, Cw = C * w;
    const S across = dot(v, Cw);
    const PrincipalAxes<S, 2> plane = principal_axes(Mat<S, 2>::rows(dot(v, Cv), across, across, dot(w, Cw)));
    const auto in_plane = [&](int j) FIRN_LAMBDA { return v * plane.directions(0, j) + w * plane.directions(1, j); };
    const Vec<S, 3> p = in_plane(0), q = in_plane(1);

    // u, p, q is a rotation, and so is p, q, u.
    PrincipalAxes<S, 3> axes;
    unroll<3>([&](auto i) FIRN_LAMBDA {
        axes.directions(i, 0) = select(negative, p.v[i], u.v[i]);
        axes.directions(i, 1) = select(negative, q.v[i], p.v[i]);
        axes.directions(i, 2) = select(negative, u.v[i], q.v[i]);
    });
    axes.values = Vec<S, 3>{{mean + size * select(negative, plane.values.v[0], extreme),
                             mean + size * select(negative, plane.values.v[1], plane.values.v[0]),
                             mean + size * select(negative, extreme, plane.values.v[1])}};
    return axes;
}

/// The principal stretches of a deformation gradient F, and their directions in the deformed body.
template <class S, int D>
struct Principal {
    Mat<S, D> directions;  ///< U, a rotation; its columns are the directions
    Vec<S, D> stretches;   ///< σ [1], in descending order; the last one has the sign of det F
};

namespace detail {

/// Returns whether F is upright and its principal stretches are so close that b = FFᵀ determines all of them well: tr b
/// < 5 J^{2/3}, in 2D tr b < 10 J. They then differ by a factor of at most 3.9, in 2D 9.9.
/// \param b  FFᵀ [1]
/// \param J  det F [1]
template <class S, int D>
FIRN_INLINE mask_t<S> is_round(const Mat<S, D>& b, const S& J) {
    const mask_t<S> large = S(sizeof(value_type_t<S>) == 4 ? 1e-9 : 1e-90) < J;  // below, J² may underflow
    const S part = trace(b) * S(D == 2 ? 0.1 : 0.2);
    const mask_t<S> close = D == 2 ? part < J : part * part * part < J * J;
    return large & close;
}

template <class S, int D>
FIRN_INLINE Principal<S, D> principal_of(const LeftSingular<S, D>& f) {
    return {f.vectors, f.values * f.scale};
}
template <class S>
[[gnu::noinline]] void principal_stretches_by_jacobi(const Mat<S, 3>& F, Principal<S, 3>& result) {
    result = principal_of(left_singular(F));
}

}  // namespace detail

/// Returns the principal stretches of a 2 × 2 deformation gradient F, and their directions in the deformed body, as
/// left_singular() computes them.
template <scalar S>
FIRN_INLINE Principal<S, 2> principal_stretches(const Mat<S, 2>& F) {
    return detail::principal_of(left_singular(F));
}
/// Returns the principal stretches of a 3 × 3 deformation gradient F, and their directions in the deformed body.
///
/// With V = U diag(σ) Uᵀ: ‖V² − FFᵀ‖ ≤ 20 ε ‖F‖² (measured: 8 ε ‖F‖²). Most lanes use principal_axes() of FFᵀ. Where
/// the stretches differ by a factor of more than three to four, or det F is not positive, F is decomposed by Jacobi
/// rotations.
template <scalar S>
FIRN_INLINE Principal<S, 3> principal_stretches(const Mat<S, 3>& F) {
    const Mat<S, 3> b = detail::symmetric_product(F, transpose(F));
    const PrincipalAxes<S, 3> axes = principal_axes(b);
    Principal<S, 3> result{axes.directions, {}};
    unroll<3>([&](auto i) FIRN_LAMBDA { result.stretches.v[i] = sqrt(max(axes.values.v[i], S(0))); });
    const auto rare = !detail::is_round(b, determinant(F));  // includes NaN
    if (any(rare)) [[unlikely]] {
        Principal<S, 3> sure;
        detail::principal_stretches_by_jacobi(F, sure);
        result.directions = select(rare, sure.directions, result.directions);
        result.stretches = select(rare, sure.stretches, result.stretches);
    }
    return result;
}
/// Returns the principal stretches of a 2 × 2 matrix and their directions, with their derivatives as of
/// left_singular().
template <scalar T>
FIRN_INLINE Principal<dual<T>, 2> principal_stretches(const Mat<dual<T>, 2>& F) {
    return detail::principal_of(left_singular(F));
}
/// Returns the principal stretches of a 3 × 3 matrix and their directions, with their derivatives as of
/// left_singular().
template <scalar T>
FIRN_INLINE Principal<dual<T>, 3> principal_stretches(const Mat<dual<T>, 3>& F) {
    return detail::principal_of(left_singular(F));
}

}  // namespace firn::inline FIRN_BUILD
