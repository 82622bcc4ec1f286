/// \file The left stretch V = √(FFᵀ) of a deformation gradient F and, in 2D, the rotation R in F = V R.
///
/// V is symmetric, V² = FFᵀ, and the smallest eigenvalue of V has the sign of det F. So det V = det F, and F = V R with
/// a proper rotation R, also for inverted elements (Irving, Teran and Fedkiw, SCA 2004). In this file ε is the machine
/// epsilon, σᵢ are the singular values of F, and ‖·‖ is the Frobenius norm.
#pragma once

#include <firn/core/dual.hpp>
#include <firn/core/repeat.hpp>
#include <firn/math/deformation.hpp>
#include <firn/math/jacobi.hpp>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Computes the left stretch V of F by Jacobi rotations (see jacobi.hpp). F may be any finite matrix.
template <class S>
[[gnu::noinline]] void left_stretch_by_jacobi(const Mat<S, 3>& F, Mat<S, 3>& V) {
    const LeftSingular<S> f = left_singular(F);
    V = symmetric<S, 3>([&](auto i, auto j) FIRN_LAMBDA {
        S sum = f.vectors(i, 0) * f.vectors(j, 0) * f.values.v[0];
        sum = sum + f.vectors(i, 1) * f.vectors(j, 1) * f.values.v[1];
        sum = sum + f.vectors(i, 2) * f.vectors(j, 2) * f.values.v[2];
        return sum * f.scale;
    });
}

/// Computes the left stretch V of F, and its derivative dV. The derivative solves V dV + dV V = dF Fᵀ + F dFᵀ. In the
/// basis of the eigenvectors of V, element (i, j) of dV is element (i, j) of the right side of this equation, divided
/// by σᵢ + σⱼ, where σᵢ are the singular values of F. Where σᵢ + σⱼ = 0 there is no derivative; this element of dV is
/// set to 0. (The derivatives of the eigenvectors are not used, since they do not exist for equal singular values.)
template <class T>
[[gnu::noinline]] void left_stretch_by_jacobi(const Mat<dual<T>, 3>& F, Mat<dual<T>, 3>& V) {
    Mat<T, 3> value{}, change{}, stretch{};
    unroll<9>([&](auto k) FIRN_LAMBDA {
        value.m[k] = F.m[k].value;
        change.m[k] = F.m[k].derivative;
    });
    left_stretch_by_jacobi(value, stretch);
    const LeftSingular<T> f = left_singular(value);
    const Mat<T, 3> ut = transpose(f.vectors);
    const Mat<T, 3> turned = ut * change;
    Mat<T, 3> unit = value;
    unroll<9>([&](auto k) FIRN_LAMBDA { unit.m[k] = unit.m[k] / f.scale; });
    const Mat<T, 3> half = turned * transpose(ut * unit);
    const Mat<T, 3> inner = symmetric<T, 3>([&](auto i, auto j) FIRN_LAMBDA {
        const T sum = f.values.v[i] + f.values.v[j];
        const auto zero = sum == T(0);
        return select(zero, T(0), (half(i, j) + half(j, i)) / select(zero, T(1), sum));
    });
    const Mat<T, 3> derivative = f.vectors * inner * ut;
    V = symmetric<dual<T>, 3>([&](auto i, auto j) FIRN_LAMBDA { return dual<T>(stretch(i, j), derivative(i, j)); });
}

}  // namespace detail

/// Returns the rotation R of the decomposition F = V R in 2D, where V is the left stretch. R is the rotation nearest to
/// F. The angle θ of R has tan θ = (F₁₀ − F₀₁) / (F₀₀ + F₁₁). If all rotations are equally near to F (for singular
/// values σ₁ = −σ₀, or F = 0), R = I. The error of R is a few ε for every finite F (ε: machine epsilon).
template <scalar S>
FIRN_INLINE Mat<S, 2> polar_rotation(const Mat<S, 2>& F) {
    const S x = S(0.5) * F(0, 0) + S(0.5) * F(1, 1);  // the halves prevent overflow
    const S y = S(0.5) * F(1, 0) - S(0.5) * F(0, 1);
    const S largest = max(abs(x), abs(y));
    const auto turns = S(0) < largest;
    const S divisor = select(turns, largest, S(1));
    const S cosine = select(turns, x / divisor, S(1));
    const S sine = y / divisor;
    const S length = sqrt(cosine * cosine + sine * sine);
    const S c = cosine / length;
    const S s = sine / length;
    return Mat<S, 2>::rows(c, -s, s, c);
}

namespace detail {
/// Returns the symmetric part of A Rᵀ. It is exactly symmetric. For R = polar_rotation(F), F Rᵀ is symmetric itself.
template <class S>
FIRN_INLINE Mat<S, 2> turned_back(const Mat<S, 2>& A, const Mat<S, 2>& R) {
    const S off = S(0.5) * (A(0, 0) * R(1, 0) + A(0, 1) * R(1, 1)) + S(0.5) * (A(1, 0) * R(0, 0) + A(1, 1) * R(0, 1));
    return Mat<S, 2>::rows(A(0, 0) * R(0, 0) + A(0, 1) * R(0, 1), off, off, A(1, 0) * R(1, 0) + A(1, 1) * R(1, 1));
}
}  // namespace detail

/// Returns the left stretch V = F Rᵀ of a 2 × 2 matrix, where R = polar_rotation(F). V is exactly symmetric, and
/// ‖V² − FFᵀ‖ ≤ 10 ε ‖F‖² for every finite F (ε: machine epsilon).
template <scalar S>
FIRN_INLINE Mat<S, 2> left_stretch(const Mat<S, 2>& F) {
    return detail::turned_back(F, polar_rotation(F));
}

namespace detail {

/// Whether S is a number with derivatives: dual or traced.
template <class S>
concept has_derivatives =
    requires(const S a) { a.value; } && (requires(const S a) { a.derivative; } || requires(const S a) { a.node; });

/// Returns tr V − 3 I for the left stretch V of F, where I is 1 or 0. With b = FFᵀ and J = det F, the trace is the
/// largest root λ of
///
///     f(λ) = λ⁴ − 2 I_b λ² − 8 J λ + I_b² − 4 II_b
///
/// where I_b and II_b are the first and second invariant of b. (With II_V = (λ² − I_b)/2, f(λ) = 0 is II_V² = II_b + 2
/// J λ.) All four roots are real: ±σ₀ ±σ₁ ±σ₂ with an even number of minus signs, where σᵢ are the singular values of
/// F. Halley's iteration starts at the upper bound √(3 I_b), or at tangents of this root where I_b is 3 and 12, and
/// descends to the largest root.
///
/// With I = 1 the iteration is for λ − 3, and f is written as a polynomial in λ − 3, the invariants of b − I and J − 1.
/// So near the undeformed body the error is relative to the strain.
///
/// A step of the iteration turns an error e of λ into an error K e³. The factor K is at most 36/λ² wherever
/// left_stretch() uses the root (there f′(λ) = 8Δ ≥ λ³, see there for Δ), and near 3.4/λ² if F is a rotation. So if the
/// last step was shorter than ∛ε λ / 5 (ε: machine epsilon), the error is below ε λ / 3. All lanes take the first two
/// (double: three) steps, which are enough for strains up to 0.45. Lanes whose last step was longer take two more
/// steps.
/// \tparam I        1 or 0
/// \param e1, e2  first and second invariant of b − I;  \param j  J − I
template <int I, class S>
FIRN_INLINE S trace_of_stretch(const S& e1, const S& e2, const S& j) {
    constexpr bool single = sizeof(value_type_t<S>) == 4;
    const auto plus = [](const S& a, double b) FIRN_LAMBDA { return I == 0 ? a : a + S(b); };
    const S Ib = named("Ib", plus(e1, 3));
    const S two_J = plus(S(2) * j, 2);
    const S c0 = I == 0 ? e1 * e1 - S(4) * e2 : (e1 - S(20)) * e1 - S(4) * e2 - S(24) * j;
    const S c1 = I == 0 ? S(-8) * j : S(64) - S(8) * j - S(12) * e1;
    const S c2 = plus(S(-2) * e1, 48);
    const auto next = [&](const S& s) FIRN_LAMBDA {
        const S x = plus(s, 3), xx = x * x;  // x: λ
        const S value = named("value", ((plus(s, 12) * s + c2) * s + c1) * s + c0);
        const S slope = named("slope", (xx - Ib) * x - two_J);  // f′ / 4
        const S bend = named("bend", S(3) * xx - Ib);           // f″ / 4
        return s - S(2) * value * slope / (S(8) * slope * slope - value * bend);
    };
    // The derivatives of a root are those of one step from it.
    if constexpr (has_derivatives<S>) return next(S(trace_of_stretch<I>(e1.value, e2.value, j.value)));

    S first = e1;
    if constexpr (I == 0)
        first = sqrt(S(3) * Ib);
    else
        first = min(S(0.5) * e1, S(0.25) * e1 + S(0.75));
    const S near = repeat<single ? 0 : 1>(next(first), next);
    const S nearer = next(near);
    const auto far = !(abs(near - nearer) <= S(single ? 1e-3 : 1.2e-6) * plus(nearer, 3));
    if (!any(far)) [[likely]]
        return nearer;
    return select(far, repeat<2>(nearer, next), nearer);
}

/// Computes V − I of a 2 × 2 matrix by invariants: (E + (j − s) I)/(2 + s), where s = tr V − 2 and (tr V)² = tr b + 2
/// J.
/// \param E  FFᵀ − I;  \param j  det F − 1
/// \param rare  gets the lanes in which the result is not accurate
template <int I, class S>
    requires(I == 1)
FIRN_INLINE Mat<S, 2> left_stretch_by_invariants(const Mat<S, 2>& E, const S& j, mask_t<S>& rare) {
    const S e1 = named("e1", trace(E));
    const S q = e1 + S(2) * j;
    const S s = named("s", q / (S(2) + sqrt(S(4) + q)));
    const mask_t<S> is_small = e1 < S(1e7), is_thick = S(-0.75) < j, ordinary = (S(-1) < e1) & is_thick & is_small;
    rare = !ordinary;  // includes lanes with NaN
    return (E + Mat<S, 2>::diagonal(j - s)) * (S(1) / (S(2) + s));
}
/// Computes V − I by invariants. \param E  FFᵀ − I;  \param j  det F − I;  \tparam I  1 or 0
/// \param rare  gets the lanes in which the result is not accurate
template <int I, class S>
FIRN_INLINE Mat<S, 3> left_stretch_by_invariants(const Mat<S, 3>& E, const S& j, mask_t<S>& rare) {
    const S e1 = named("e1", trace(E));
    const S e2 = E(0, 0) * E(1, 1) - E(0, 1) * E(0, 1) + (E(1, 1) * E(2, 2) - E(1, 2) * E(1, 2)) +
                 (E(2, 2) * E(0, 0) - E(0, 2) * E(0, 2));
    const S s = trace_of_stretch<I>(e1, e2, j);
    const S half = S(0.5) * (s * s - e1);
    const S lambda = named("lambda", I == 0 ? s : S(3) + s);
    const S increase = S(3) * s + half;  // of II
    const S II = named("II", I == 0 ? half : S(3) + increase);
    const S denominator = named("denominator", lambda * II - (I == 0 ? j : S(1) + j));
    const S inverse = S(1) / denominator;
    const S of_identity = I == 0 ? lambda * j : S(4) * j + S(2) * e1 - S(8) * s + (j - half - S(4) * s) * s;
    const S of_E = lambda * lambda - (I == 0 ? II : S(5) + increase);
    const Mat<S, 3> V = symmetric<S, 3>([&](auto i, auto k) FIRN_LAMBDA {
        const S EE = E(i, 0) * E(0, k) + E(i, 1) * E(1, k) + E(i, 2) * E(2, k);
        const S sum = of_E * E(i, k) - EE;
        if constexpr (int(i) == int(k))
            return (sum + of_identity) * inverse;
        else
            return sum * inverse;
    });

    constexpr bool single = sizeof(value_type_t<S>) == 4;
    const S Ib = I == 0 ? e1 : e1 + S(3);
    const mask_t<S> apart = S(0.125) * (lambda * lambda * lambda) < denominator;
    // Outside of these bounds, slope² in trace_of_stretch() could underflow, and the result would look right but be
    // wrong. With I = 1, matter that is small or inverted is left to I = 0, which has smaller rounding errors there.
    const mask_t<S> not_small = I == 0 ? S(single ? 1e-6 : 1e-60) < Ib : S(-1) < e1;
    const mask_t<S> not_large = Ib < S(I == 1 ? 40 : single ? 1e7 : 1e60);
    const mask_t<S> upright = I == 0 ? not_small : S(-0.75) < j;
    const mask_t<S> ordinary = apart & not_small & not_large & upright;
    rare = !ordinary;  // includes lanes with NaN
    return V;
}

}  // namespace detail

/// Returns the left stretch V = √(FFᵀ) of a 3 × 3 matrix F.
///
/// For every finite F, V is exactly symmetric, and ‖V² − FFᵀ‖ ≤ 100 ε ‖F‖² (measured: ≤ 30 ε ‖F‖², ε: machine epsilon).
/// If the absolute value of the smallest eigenvalue of V exceeds 50 ε ‖F‖, this eigenvalue has the sign of det F. All
/// |Fᵢⱼ| must be below a third of the largest number of the scalar, so that V can be represented.
///
/// Most lanes use a closed form by invariants (Hoger & Carlson, Q. Appl. Math. 42 (1984)), with b = FFᵀ, J = det F,
/// λ = tr V and II = (λ² − tr b)/2:
///
///     V = [λ J I + (λ² − II) b − b²] / (λ II − J)
///
/// The denominator is Δ = (σ₀+σ₁)(σ₁+σ₂)(σ₂+σ₀), where σᵢ are the singular values of F. If Δ is small (two small
/// singular values, or σ₂ ≈ −σ₁), neither λ nor V can be computed accurately in this way: the error of V grows as
/// (Δ/λ³)⁻². For a rotation, Δ/λ³ is 0.3.
///
/// The other lanes use Jacobi rotations, which are some twenty times slower: lanes where Δ < 0.125 λ³, and lanes where
/// F is so large or small that λ⁷ could leave the range of the scalar (‖F‖ outside 1e-3 … 3e3 in float, 1e-30 … 1e30 in
/// double). The result of a lane depends on that lane only.
///
/// With dual numbers, the derivative dV is right with both methods (in the closed form, to about 200 ε ‖dF‖), except
/// where V has no derivative, that is, where σᵢ + σⱼ = 0 for some i ≠ j.
template <scalar S>
FIRN_INLINE Mat<S, 3> left_stretch(const Mat<S, 3>& F) {
    const Mat<S, 3> b = detail::symmetric_product(F, transpose(F));
    mask_t<S> rare;
    Mat<S, 3> V = detail::left_stretch_by_invariants<0>(b, named("J", determinant(F)), rare);
    if (any(rare)) [[unlikely]] {
        Mat<S, 3> sure;
        using detail::left_stretch_by_jacobi;  // or a scalar's own
        left_stretch_by_jacobi(F, sure);
        V = select(rare, sure, V);
    }
    return V;
}

namespace detail {
/// Computes the left stretch V of F, in a function of its own because few lanes need it. \see left_stretch_change
template <class S, int D>
[[gnu::noinline]] void left_stretch_of_far(const Mat<S, D>& F, Mat<S, D>& V) {
    V = left_stretch(F);
}
}  // namespace detail

/// Returns V − I [1] for the left stretch V = √(FFᵀ) of a deformation gradient F. It is exactly symmetric. Its error is
/// relative to ‖F − I‖, and so to the strain of a body that has not turned.
///
/// Most lanes use a closed form in b − I and J − 1, which are computed from F − I, so that no difference to 1 is lost.
/// In 3D it is that of left_stretch(). Lanes in which F is small or inverted take left_stretch() itself.
template <deformation_gradient G>
FIRN_INLINE matrix_of_t<G> left_stretch_change(const G& F) {
    using M = matrix_of_t<G>;
    mask_t<scalar_of_t<G>> far;
    M change = detail::left_stretch_by_invariants<1>(left_cauchy_green_change(F), volume_change(F), far);
    if (any(far)) [[unlikely]] {
        const M whole = F;  // a copy, so that F itself need not lie in memory
        M sure;
        detail::left_stretch_of_far(whole, sure);
        change = select(far, sure - M::identity(), change);
    }
    return change;
}

}  // namespace firn::inline FIRN_BUILD
