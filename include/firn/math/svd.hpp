/// \file Singular value decomposition F = U Σ Vᵀ of 2 × 2 and 3 × 3 matrices, without branches.
///
/// U and V are proper rotations; the smallest singular value has the sign of det F (Irving, Teran and Fedkiw, SCA
/// 2004). For every finite F: ‖F − U Σ Vᵀ‖ ≤ 10 ε ‖F‖, ‖UUᵀ − I‖ ≤ 10 ε, ‖VVᵀ − I‖ ≤ 20 ε (measured: 7 ε ‖F‖, 6 ε and
/// 11 ε), with the machine epsilon ε. In 3D the decomposition is computed by Jacobi rotations (jacobi.hpp), with at
/// most six sweeps in float and seven in double; in 2D in closed form.
///
/// A return mapping does not need V. If the return mapping changes the singular values from σ to σ′, the new
/// deformation gradient is F′ = U diag(σ′/σ) Uᵀ F. An isotropic stress with the principal values τ̂ is U diag(τ̂) Uᵀ.
/// For both, left_singular() and spectral() are enough.
#pragma once

#include <firn/math/left_stretch.hpp>

namespace firn::inline FIRN_BUILD {

/// Returns the matrix U diag(d) Uᵀ. The result is exactly symmetric. With dual numbers it has the derivative that U and
/// d have; where U has none, at equal stretches, isotropic_function() gives it.
template <scalar S, int D>
FIRN_INLINE Mat<S, D> spectral(const Mat<S, D>& U, const Vec<S, D>& d) {
    return detail::symmetric<S, D>([&](auto i, auto j) FIRN_LAMBDA {
        S sum = U(i, 0) * U(j, 0) * d.v[0];
        unroll<D - 1>([&](auto k) FIRN_LAMBDA { sum = sum + U(i, k + 1) * U(j, k + 1) * d.v[k + 1]; });
        return sum;
    });
}

namespace detail {

/// Returns the left singular vectors U and the singular values σ of a 2 × 2 matrix F from its left stretch V, by the
/// Jacobi rotation that makes V diagonal.
/// \param scale  factor by which F was divided before V was computed
template <class S>
FIRN_INLINE LeftSingular<S, 2> left_singular_of_stretch(const Mat<S, 2>& V, const S& scale) {
    // The angle θ of the rotation has tan θ = 2 V₀₁ / (d ± √(d² + 4 V₀₁²)), where d = V₀₀ − V₁₁. The sign ± is the sign
    // of d, so that no digits cancel.
    const S difference = V(0, 0) - V(1, 1);
    const S twice = S(2) * V(0, 1);
    const S root = sqrt(difference * difference + twice * twice);
    const auto round = root == S(0);  // V is a multiple of I: any θ is right
    const S tangent = select(round, S(0), twice) / (abs(difference) + select(round, S(1), root));
    const S c = S(1) / sqrt(S(1) + tangent * tangent);
    const S s = c * tangent;
    const auto turned = difference < S(0);  // the larger stretch is nearer to the second axis: add a quarter turn
    const S cosine = select(turned, s, c);
    const S sine = select(turned, c, s);
    const S mean = S(0.5) * (V(0, 0) + V(1, 1));
    return {Mat<S, 2>::rows(cosine, -sine, sine, cosine), {{mean + S(0.5) * root, mean - S(0.5) * root}}, scale};
}

template <class S, int D>
FIRN_INLINE Mat<S, D> divided(const Mat<S, D>& a, const S& by) {
    Mat<S, D> r;
    unroll<D * D>([&](auto k) FIRN_LAMBDA { r.m[k] = a.m[k] / by; });
    return r;
}

}  // namespace detail

/// Returns the left singular vectors (U) and the singular values (σ) of a 2 × 2 matrix F, in closed form: F = scale · U
/// diag(σ) Qᵀ with rotations U and Q and σ₀ ≥ |σ₁|. U is a rotation for every F, also for F = 0.
template <scalar S>
FIRN_INLINE LeftSingular<S, 2> left_singular(const Mat<S, 2>& F) {
    const S scale = detail::largest_or_one(F);
    return detail::left_singular_of_stretch(left_stretch(detail::divided(F, scale)), scale);
}

namespace detail {

/// Returns the singular values σ and the left singular vectors U of F, with their derivatives: dσᵢ = (Uᵀ dF Fᵀ U)ᵢᵢ /
/// σᵢ, and dU = U Ω with Ωᵢⱼ = (Uᵀ d(FFᵀ) U)ᵢⱼ / (σⱼ² − σᵢ²) for i ≠ j.
template <class T, int D>
FIRN_INLINE LeftSingular<dual<T>, D> left_singular_of_dual(const Mat<dual<T>, D>& F) {
    Mat<T, D> value, change;
    unroll<D * D>([&](auto k) FIRN_LAMBDA {
        value.m[k] = F.m[k].value;
        change.m[k] = F.m[k].derivative;
    });
    const LeftSingular<T, D> f = left_singular(value);
    const Mat<T, D> ut = transpose(f.vectors);
    const Mat<T, D> half = ut * divided(change, f.scale) * transpose(ut * divided(value, f.scale));
    LeftSingular<dual<T>, D> result;
    Mat<T, D> spin = Mat<T, D>::zero();
    unroll<D>([&](auto i) FIRN_LAMBDA {
        const auto zero = f.values.v[i] == T(0);
        result.values.v[i] = {f.values.v[i], select(zero, T(0), half(i, i) / select(zero, T(1), f.values.v[i]))};
        unroll<D>([&](auto j) FIRN_LAMBDA {
            if constexpr (int(i) != int(j)) {
                const T apart = (f.values.v[j] - f.values.v[i]) * (f.values.v[j] + f.values.v[i]);
                const auto equal = apart == T(0);
                spin(i, j) = select(equal, T(0), (half(i, j) + half(j, i)) / select(equal, T(1), apart));
            }
        });
    });
    const Mat<T, D> turned = f.vectors * spin;
    unroll<D * D>([&](auto k) FIRN_LAMBDA { result.vectors.m[k] = {f.vectors.m[k], turned.m[k]}; });
    result.scale = {f.scale, T(0)};
    return result;
}

}  // namespace detail

/// Returns the left singular vectors (U) and the singular values (σ) of a 2 × 2 matrix, with their derivatives.
///
/// If a singular value is 0, its derivative is set to 0. Otherwise, the derivative is right wherever it exists. If |σ₀|
/// = |σ₁|, U has no derivative, and dU is set to 0. If |σ₀| and |σ₁| are nearly equal, dU loses digits.
template <scalar T>
FIRN_INLINE LeftSingular<dual<T>, 2> left_singular(const Mat<dual<T>, 2>& F) {
    return detail::left_singular_of_dual(F);
}
/// Returns the left singular vectors (U) and the singular values (σ) of a 3 × 3 matrix, with their derivatives.
///
/// If a singular value is 0, its derivative is set to 0. Otherwise, the derivative is right wherever it exists. If |σᵢ|
/// = |σⱼ|, the rotation of columns i and j of U into each other has no derivative; this part of dU is set to 0. If |σᵢ|
/// and |σⱼ| are nearly equal, this part of dU loses digits.
template <scalar T>
FIRN_INLINE LeftSingular<dual<T>, 3> left_singular(const Mat<dual<T>, 3>& F) {
    return detail::left_singular_of_dual(F);
}

/// The decomposition F = U diag(σ) Vᵀ. σ is in descending order, except for rounding. With dual numbers the values of
/// U, σ and V are right, but their derivatives are not.
template <scalar S, int D>
struct Svd {
    Mat<S, D> U;       ///< left singular vectors, in columns; a rotation
    Vec<S, D> values;  ///< σ; the last one has the sign of det F
    Mat<S, D> V;       ///< right singular vectors, in columns; a rotation
};

/// Returns the singular value decomposition of a 2 × 2 matrix F: U and σ are those of the left stretch of F, and V =
/// RᵀU with R = polar_rotation(F).
template <scalar S>
FIRN_INLINE Svd<S, 2> svd(const Mat<S, 2>& F) {
    const S scale = detail::largest_or_one(F);
    const Mat<S, 2> unit = detail::divided(F, scale);
    const Mat<S, 2> R = polar_rotation(unit);
    const LeftSingular<S, 2> f = detail::left_singular_of_stretch(detail::turned_back(unit, R), scale);
    return {f.vectors, f.values * scale, transpose(R) * f.vectors};
}

/// Returns the singular value decomposition of a 3 × 3 matrix. The singular vectors of singular values below 1e-3 ε ‖F‖
/// (ε: machine epsilon) are arbitrary, but U and V are rotations.
template <scalar S>
FIRN_INLINE Svd<S, 3> svd(const Mat<S, 3>& F) {
    constexpr double negligible = 1e-3 * double(std::numeric_limits<value_type_t<S>>::epsilon());
    const S largest = detail::largest_or_one(F);
    std::array<Vec<S, 3>, 6> w;
    unroll<9>([&](auto k) FIRN_LAMBDA {
        w[k / 3].v[k % 3] = F.m[k] / largest;
        w[k / 3 + 3].v[k % 3] = S(k % 3 == k / 3 ? 1 : 0);
    });
    w = detail::orthogonal_columns(w);

    const S first = norm(w[0]);  // 0 for F = 0, else at least 1
    const auto zero = first == S(0);
    const Vec<S, 3> axis{{S(1), S(0), S(0)}};
    const Vec<S, 3> u0 = select(zero, axis, w[0] * (S(1) / select(zero, S(1), first)));
    // `across` is perpendicular to u0: it is the vector product of u0 with the first or the second axis, the one that
    // is farther from u0.
    const Vec<S, 3> across = cross(select(u0.v[0] * u0.v[0] < S(0.5), axis, Vec<S, 3>{{S(0), S(1), S(0)}}), u0);
    const auto vanishes = norm(w[1]) < S(negligible);
    const Vec<S, 3> second = select(vanishes, across, w[1]);
    const Vec<S, 3> u1 = second * (S(1) / norm(second));
    const Vec<S, 3> u2 = cross(u0, u1);
    Svd<S, 3> result;
    result.values = Vec<S, 3>{{dot(u0, w[0]), dot(u1, w[1]), dot(u2, w[2])}} * largest;
    unroll<3>([&](auto i) FIRN_LAMBDA {
        result.U(i, 0) = u0.v[i];
        result.U(i, 1) = u1.v[i];
        result.U(i, 2) = u2.v[i];
        unroll<3>([&](auto j) FIRN_LAMBDA { result.V(i, j) = w[j + 3].v[i]; });
    });
    return result;
}

}  // namespace firn::inline FIRN_BUILD
