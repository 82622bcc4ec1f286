/// \file The left stretch V = √(FFᵀ) of a deformation gradient F and, in 2D, the rotation R in F = V R.
///
/// V is symmetric, V² = FFᵀ, and the smallest eigenvalue of V has the sign of det F. So det V = det F, and F = V R with
/// a proper rotation R, also for inverted elements (Irving, Teran and Fedkiw, SCA 2004). In this file ε is the machine
/// epsilon, σᵢ are the singular values of F, and ‖·‖ is the Frobenius norm.
#pragma once

#include <firn/core/dual.hpp>
#include <firn/core/repeat.hpp>
#include <firn/math/jacobi.hpp>

namespace firn {

namespace detail {

/// Returns the symmetric matrix whose elements in row i and column j, and in row j and column i, are entry(i, j). The
/// function `entry` is called only for i ≤ j.
template <class S, int D, class F>
FIRN_INLINE Mat<S, D> symmetric(F&& entry) {
    Mat<S, D> r{};
    unroll<D>([&](auto j) FIRN_LAMBDA {
        unroll<int(j) + 1>([&](auto i) FIRN_LAMBDA {
            const S value = entry(i, j);
            r(i, j) = value;
            r(j, i) = value;
        });
    });
    return r;
}

/// Returns the product of two matrices whose product is symmetric. It is exactly symmetric.
template <class S, int D>
FIRN_INLINE Mat<S, D> symmetric_product(const Mat<S, D>& a, const Mat<S, D>& b) {
    return symmetric<S, D>([&](auto i, auto j) FIRN_LAMBDA {
        S sum = a(i, 0) * b(0, j);
        unroll<D - 1>([&](auto k) FIRN_LAMBDA { sum = sum + a(i, k + 1) * b(k + 1, j); });
        return sum;
    });
}

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
/// Returns F Rᵀ for R = polar_rotation(F). The result is exactly symmetric.
template <class S>
FIRN_INLINE Mat<S, 2> turned_back(const Mat<S, 2>& F, const Mat<S, 2>& R) {
    const S off = S(0.5) * (F(0, 0) * R(1, 0) + F(0, 1) * R(1, 1)) + S(0.5) * (F(1, 0) * R(0, 0) + F(1, 1) * R(0, 1));
    return Mat<S, 2>::rows(F(0, 0) * R(0, 0) + F(0, 1) * R(0, 1), off, off, F(1, 0) * R(1, 0) + F(1, 1) * R(1, 1));
}
}  // namespace detail

/// Returns the left stretch V = F Rᵀ of a 2 × 2 matrix, where R = polar_rotation(F). V is exactly symmetric, and
/// ‖V² − FFᵀ‖ ≤ 10 ε ‖F‖² for every finite F (ε: machine epsilon).
template <scalar S>
FIRN_INLINE Mat<S, 2> left_stretch(const Mat<S, 2>& F) {
    return detail::turned_back(F, polar_rotation(F));
}

namespace detail {

/// Returns tr V, the trace of the left stretch V of F. The trace is the largest root λ of f(λ) = λ⁴ − 2 I_b λ² − 8 J λ
/// + I_b² − 4 II_b, where I_b and II_b are the first and second invariant of b = FFᵀ, and J = det F. (With II_V = (λ² −
/// I_b)/2, f(λ) = 0 is II_V² = II_b + 2 J λ.) All four roots are real: ±σ₀ ±σ₁ ±σ₂ with an even number of minus signs,
/// where σᵢ are the singular values of F. Halley's iteration starts at the upper bound √(3 I_b) and descends to the
/// largest root.
///
/// A step of the iteration turns an error e of λ into an error K e³. The factor K is at most 36/λ² wherever
/// left_stretch() uses the root (there f′(λ) = 8Δ ≥ λ³, see left_stretch() for Δ), and near 3.4/λ² if F is a rotation.
/// So if the last step was shorter than ∛ε λ / 5 (ε: machine epsilon), the error is below ε λ / 3. All lanes take the
/// first two (double: three) steps, which are enough for strains up to 0.45. Lanes whose last step was longer take two
/// more steps.
template <class S>
FIRN_INLINE S trace_of_stretch(const S& Ib, const S& IIb, const S& J) {
    constexpr bool single = sizeof(value_type_t<S>) == 4;
    const S two_Ib = S(2) * Ib;
    const S two_J = S(2) * J;
    const S eight_J = S(8) * J;
    const S constant = Ib * Ib - S(4) * IIb;
    const auto step = [&](const S& x, const S& xx) FIRN_LAMBDA {
        const S value = named("value", ((xx - two_Ib) * xx + constant) - eight_J * x);
        const S slope = named("slope", (xx - Ib) * x - two_J);  // f′ / 4
        const S bend = named("bend", S(3) * xx - Ib);           // f″ / 4
        return x - S(2) * value * slope / (S(8) * slope * slope - value * bend);
    };
    const auto next = [&](const S& x) FIRN_LAMBDA { return step(x, x * x); };

    const S bound = S(3) * Ib;
    const S near = repeat<single ? 0 : 1>(step(sqrt(bound), bound), next);
    const S nearer = next(near);
    const auto far = !(abs(near - nearer) <= S(single ? 1e-3 : 1.2e-6) * nearer);
    if (!any(far)) [[likely]]
        return nearer;
    return select(far, repeat<2>(nearer, next), nearer);
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
    const S J = named("J", determinant(F));
    const S Ib = named("Ib", trace(b));
    const S IIb = b(0, 0) * b(1, 1) - b(0, 1) * b(0, 1) + (b(1, 1) * b(2, 2) - b(1, 2) * b(1, 2)) +
                  (b(2, 2) * b(0, 0) - b(0, 2) * b(0, 2));
    const S lambda = detail::trace_of_stretch(Ib, IIb, J);
    const S II = named("II", S(0.5) * (lambda * lambda - Ib));
    const S denominator = named("denominator", lambda * II - J);
    const S inverse = S(1) / denominator;
    const S of_identity = lambda * J;
    const S of_b = lambda * lambda - II;
    Mat<S, 3> V = detail::symmetric<S, 3>([&](auto i, auto j) FIRN_LAMBDA {
        const S bb = b(i, 0) * b(0, j) + b(i, 1) * b(1, j) + b(i, 2) * b(2, j);
        const S sum = of_b * b(i, j) - bb;
        if constexpr (int(i) == int(j))
            return (sum + of_identity) * inverse;
        else
            return sum * inverse;
    });

    constexpr bool single = sizeof(value_type_t<S>) == 4;
    const mask_t<S> apart = S(0.125) * (lambda * lambda * lambda) < denominator;
    // Outside of these bounds, slope² in trace_of_stretch() could underflow, and the result would look right but be
    // wrong.
    const mask_t<S> not_small = S(single ? 1e-6 : 1e-60) < Ib;
    const mask_t<S> not_large = Ib < S(single ? 1e7 : 1e60);
    const mask_t<S> ordinary = apart & not_small & not_large;
    const mask_t<S> rare = !ordinary;  // includes lanes with NaN
    if (any(rare)) [[unlikely]] {
        Mat<S, 3> sure;
        detail::left_stretch_by_jacobi(F, sure);
        V = select(rare, sure, V);
    }
    return V;
}

}  // namespace firn
