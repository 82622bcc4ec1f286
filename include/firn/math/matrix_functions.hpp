/// \file Functions of symmetric matrices without eigenvectors: the logarithmic strain of a deformation gradient, and
/// deformation gradients with another strain. In this file ε is the machine epsilon.
///
/// A matrix function of A is a power series in A. The theorem of Cayley and Hamilton turns each power into a polynomial
/// of degree D − 1 in A, so each term of the series costs a few operations on the invariants of A (Higham 2008,
/// "Functions of Matrices", §1.2 and §11.3).
#pragma once

#include <firn/math/exp_log.hpp>
#include <firn/math/isotropic_function.hpp>

#include <array>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// A principal stretch counts as at least this where its logarithm is taken [1], so that the strain of matter that is
/// flat or inverted is finite.
/// @{
inline constexpr double least_stretch = 1e-6;
inline constexpr double least_square_of_stretch = 1e-12;  ///< The square of least_stretch.
inline constexpr double least_volume_ratio = 1e-18;       ///< For J = det F: the product of three such stretches.
/// @}

/// Returns the square of a symmetric 3 × 3 matrix. It is exactly symmetric.
template <class S>
FIRN_INLINE Mat<S, 3> square_of_symmetric(const Mat<S, 3>& A) {
    return symmetric<S, 3>([&](auto i, auto j) FIRN_LAMBDA {
        if constexpr (int(i) == int(j)) {
            return A(i, 0) * A(i, 0) + A(i, 1) * A(i, 1) + A(i, 2) * A(i, 2);
        } else {
            constexpr int k = 3 - int(i) - int(j);
            return A(i, j) * (A(i, i) + A(j, j)) + A(i, k) * A(k, j);
        }
    });
}

/// Returns the matrix c₀ I + c₁ A + c₂ A² + … of a symmetric matrix A. It is exactly symmetric.
/// \param c  the coefficients; at least D of them
template <class S, int D, std::size_t N>
FIRN_INLINE Mat<S, D> polynomial_of(const Mat<S, D>& A, const std::array<double, N>& c) {
    static_assert(N >= D);
    // p has the coefficients of I, A (and A²) of what was summed so far. It is multiplied by A and increased by c I.
    const auto plus = [](const S& a, double b) FIRN_LAMBDA { return b == 0 ? a : a + S(b); };
    if constexpr (D == 2) {
        const S first = trace(A);
        const S second = determinant(A);
        std::array<S, 2> p{S(c[N - 2]), S(c[N - 1])};
        unroll<int(N) - 2>(
            [&](auto k) FIRN_LAMBDA { p = {plus(-(second * p[1]), c[N - 3 - std::size_t(k)]), p[0] + first * p[1]}; });
        return symmetric<S, 2>([&](auto i, auto j) FIRN_LAMBDA {
            const S of_A = p[1] * A(i, j);
            return int(i) == int(j) ? of_A + p[0] : of_A;
        });
    } else {
        const Mat<S, 3> AA = square_of_symmetric(A);
        const S first = trace(A);
        const S second = S(0.5) * (first * first - trace(AA));
        const S third = determinant(A);
        std::array<S, 3> p{S(c[N - 3]), S(c[N - 2]), S(c[N - 1])};
        unroll<int(N) - 3>([&](auto k) FIRN_LAMBDA {
            p = {plus(third * p[2], c[N - 4 - std::size_t(k)]), p[0] - second * p[2], p[1] + first * p[2]};
        });
        return symmetric<S, 3>([&](auto i, auto j) FIRN_LAMBDA {
            const S sum = p[2] * AA(i, j) + p[1] * A(i, j);
            return int(i) == int(j) ? sum + p[0] : sum;
        });
    }
}

/// Returns the inverse of a symmetric matrix. It is exactly symmetric.
template <class S, int D>
FIRN_INLINE Mat<S, D> inverse_of_symmetric(const Mat<S, D>& A) {
    if constexpr (D == 2) {
        const S per_determinant = S(1) / determinant(A);
        const S off = -(A(0, 1) * per_determinant);
        return Mat<S, 2>::rows(A(1, 1) * per_determinant, off, off, A(0, 0) * per_determinant);
    } else {
        const Mat<S, 3> adjugate = adjugate_of_symmetric(A);
        const S per_determinant =
            S(1) / (A(0, 0) * adjugate(0, 0) + A(0, 1) * adjugate(0, 1) + A(0, 2) * adjugate(0, 2));
        return adjugate * per_determinant;
    }
}

/// The coefficients of the series artanh z = z + z³/3 + z⁵/5 + …, up to the power `highest`.
template <std::size_t highest>
constexpr std::array<double, highest + 1> series_of_artanh() {
    std::array<double, highest + 1> c{};
    for (std::size_t k = 1; k <= highest; k += 2) c[k] = 1.0 / double(k);
    return c;
}
/// The coefficients of the series exp x − 1 = x + x²/2 + x³/6 + …, up to the power `highest`.
template <std::size_t highest>
constexpr std::array<double, highest + 1> series_of_exp_minus_one() {
    std::array<double, highest + 1> c{};
    double factorial = 1;
    for (std::size_t k = 1; k <= highest; ++k) c[k] = 1 / (factorial *= double(k));
    return c;
}

/// The coefficients of the series √((1 + x)/(1 − x)) − 1 = x + x²/2 + x³/2 + 3x⁴/8 + …, up to the power `highest`.
template <std::size_t highest>
constexpr std::array<double, highest + 1> series_of_stretch_ratio() {
    std::array<double, highest + 1> c{};
    double binomial = 1;  // (2n choose n)/4ⁿ, the coefficient of x²ⁿ and x²ⁿ⁺¹ in (1 + x)/√(1 − x²)
    for (std::size_t k = 1; k <= highest; ++k) {
        if (k % 2 == 0) binomial *= double(k - 1) / double(k);
        c[k] = binomial;
    }
    return c;
}

/// Computes the logarithmic strain of F in principal axes.
template <class S, int D>
[[gnu::noinline]] void strain_in_principal_axes(const Mat<S, D>& F, Mat<S, D>& strain) {
    const Principal<S, D> own = principal_stretches(F);
    strain = isotropic_function(F, own, [](const S& sigma) FIRN_LAMBDA { return log(max(sigma, S(least_stretch))); });
}

/// Computes the matrix X for which F + X F has other principal stretches σ′ than F (σ): X = U diag(σ′/σ − 1) Uᵀ, where
/// U are the principal directions of F. If F is inverted (det F < 0), F + X F is upright. For |σ| below 1e-9 the
/// divisor is 1e-9.
/// \param A        a symmetric matrix with the principal directions of FFᵀ
/// \param stretch  stretch(a, σ) returns σ′, for the principal value a of A and the principal stretch σ of F
template <class S, int D, class Stretch>
[[gnu::noinline]] void change_in_principal_axes(const Mat<S, D>& F, const Mat<S, D>& A, const Stretch& stretch,
                                                Mat<S, D>& change) {
    const Principal<S, D> own = principal_stretches(F);
    change = isotropic_function(F, own, A, [&](const S& a, const S& sigma) FIRN_LAMBDA {
        return stretch(a, sigma) / select(abs(sigma) < S(1e-9), S(1e-9), sigma) - S(1);
    });
}

/// Returns F + X F. In the lanes of `rare`, X is that of change_in_principal_axes(); in all others it is `change`.
template <class G, class S, int D, class Mask, class Stretch>
FIRN_INLINE G changed(const G& F, Mat<S, D> change, const Mask& rare, const Mat<S, D>& A, const Stretch& stretch) {
    const Mat<S, D>& whole = F;
    if (any(rare)) [[unlikely]] {
        Mat<S, D> sure;
        change_in_principal_axes(whole, A, stretch, sure);
        change = select(rare, sure, change);
    }
    return increased(F, change * whole);
}

}  // namespace detail

/// Returns the logarithmic strain (Hencky strain) ½ ln(FFᵀ) of a deformation gradient F [1]. It is exactly symmetric.
///
/// A principal stretch below 1e-6, also a negative one, is replaced by 1e-6. The error is at most 10 ε (measured: 5.1
/// ε) where all principal strains are below 0.4, elsewhere that of principal_stretches().
///
/// With b = FFᵀ and z = (b − I)(b + I)⁻¹ the strain is artanh z. Where ‖z‖ exceeds 0.4, or where det F is not positive,
/// it is computed in principal axes, which takes longer. b − I comes from F − I, so that of a body that has not turned
/// the error is relative to the strain.
template <deformation_gradient G>
FIRN_INLINE matrix_of_t<G> logarithmic_strain(const G& F) {
    using S = scalar_of_t<G>;
    constexpr int D = dimension_of<G>;
    constexpr bool single = sizeof(value_type_t<S>) == 4;
    // Bound of ‖z‖. The series is cut off at 0.4¹⁷/17 = 1e-8; in double at 0.4³⁷/37 = 5e-17.
    constexpr double most = 0.4;
    const Mat<S, D>& whole = F;
    const Mat<S, D> E = left_cauchy_green_change(F);
    const Mat<S, D> z = detail::symmetric_product(E, detail::inverse_of_symmetric(E + Mat<S, D>::diagonal(S(2))));
    Mat<S, D> strain = detail::polynomial_of(z, detail::series_of_artanh<single ? 15 : 35>());
    const mask_t<S> near = squared_norm(z) < S(most * most);
    const mask_t<S> upright = S(0) < determinant(whole);
    const auto rare = !(near & upright);  // includes NaN
    if (any(rare)) [[unlikely]] {
        Mat<S, D> sure;
        detail::strain_in_principal_axes(whole, sure);
        strain = select(rare, sure, strain);
    }
    return strain;
}

/// Returns the deformation gradient exp(A) F. The symmetric matrix A has the principal directions of FFᵀ, so the result
/// has the logarithmic strain logarithmic_strain(F) + A.
///
/// The result is computed as F + (exp(A) − I) F. So a small change has only the rounding errors of the sum, and the
/// volume does not drift with many small changes without volume. The errors are relative to the larger of F and the
/// result: if A shrinks F to a thousandth, three digits of the result are lost.
///
/// Where ‖A‖ exceeds 0.4, or where det F is not positive, it is computed in principal axes. An inverted F becomes
/// upright: a principal stretch below 1e-6 is first replaced by 1e-6, as in logarithmic_strain().
template <deformation_gradient G>
FIRN_INLINE G strained_by(const G& F, const matrix_of_t<G>& A) {
    using S = scalar_of_t<G>;
    constexpr bool single = sizeof(value_type_t<S>) == 4;
    // Bound of ‖A‖. The series is cut off at 0.4⁸/8! = 2e-8; in double at 0.4¹⁴/14! = 3e-17.
    constexpr double most = 0.4;
    const auto change = detail::polynomial_of(A, detail::series_of_exp_minus_one<single ? 7 : 13>());
    const mask_t<S> near = squared_norm(A) < S(most * most);
    const matrix_of_t<G>& whole = F;
    const mask_t<S> upright = S(0) < determinant(whole);
    const auto rare = !(near & upright);  // includes NaN
    return detail::changed(F, change, rare, A, [](const S& a, const S& sigma) FIRN_LAMBDA {
        return exp(a) * max(sigma, S(detail::least_stretch));
    });
}

/// Returns the deformation gradient √(b′ b⁻¹) F, which has the left Cauchy–Green tensor b′.
///
/// With z = (b′ − b)(b′ + b)⁻¹ the result is F + (√((I + z)(I − z)⁻¹) − I) F, a series in z. Where all principal
/// strains are below 0.4, its error is at most 50 ε ‖F‖ (measured: 5 ε ‖F‖).
///
/// Where ‖z‖ exceeds 0.25, where the principal stretches of F differ by a factor of more than three to four (in 2D:
/// ten), or where det F is not positive, the result is computed in principal axes. An inverted F becomes upright.
/// \param b   the left Cauchy–Green tensor FFᵀ [1]
/// \param J   det F [1]; if F is inverted, any number that is not positive
/// \param to  b′ [1]: symmetric, with the principal directions of b
template <deformation_gradient G>
FIRN_INLINE G stretched_to(const G& F, const matrix_of_t<G>& b, const scalar_of_t<G>& J, const matrix_of_t<G>& to) {
    using S = scalar_of_t<G>;
    constexpr int D = dimension_of<G>;
    constexpr bool single = sizeof(value_type_t<S>) == 4;
    // Bound of ‖z‖. The series is cut off at 0.22 · 0.25¹² = 1e-8; in double at 0.16 · 0.25²⁶ = 4e-17.
    constexpr double most = 0.25;
    const Mat<S, D> z = detail::symmetric_product(to - b, detail::inverse_of_symmetric(to + b));
    const Mat<S, D> change = detail::polynomial_of(z, detail::series_of_stretch_ratio<single ? 11 : 25>());
    const mask_t<S> near = squared_norm(z) < S(most * most);
    const mask_t<S> round = detail::is_round(b, J);
    const auto rare = !(near & round);  // includes NaN
    return detail::changed(F, change, rare, to,
                           [](const S& squared, const S&) FIRN_LAMBDA { return sqrt(max(squared, S(0))); });
}

}  // namespace firn::inline FIRN_BUILD
