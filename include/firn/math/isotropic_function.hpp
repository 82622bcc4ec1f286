/// \file Isotropic functions of the left stretch, U diag(f(σ)) Uᵀ, and of symmetric matrices, with derivatives that are
/// right for equal principal values, too.
///
/// With dual numbers the directions U have no derivative where stretches are equal, and lose digits where they are
/// nearly equal. The function has one everywhere: in the principal directions of V = U diag(σ) Uᵀ,
///
///     d f(V)ᵢⱼ = f[σᵢ, σⱼ] dVᵢⱼ,        f[x, y] = (f(x) − f(y))/(x − y),    f[x, x] = f′(x)
///
/// (Daleckii and Krein 1965; Higham 2008, "Functions of Matrices", theorem 3.11). f[x, y] is a divided difference.
#pragma once

#include <firn/core/dual.hpp>
#include <firn/math/principal_axes.hpp>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Returns the divided difference f[x, y] of a function of one number S with derivatives.
///
/// It is the quotient of differences, but the mean of the two slopes where the two agree up to rounding: for close x
/// and y the mean has the smaller error, and for x = y it is f′(x). If a kink of f lies between x and y, they agree
/// only if the quotient is lost in rounding. f has the rounding errors of numbers of about 1, as strains have.
template <class S, class T, class Function>
FIRN_INLINE T divided_difference(const Function& f, const T& x, const T& y) {
    const ValueAndSlope<T> at_x = value_and_slope(std::type_identity<S>{}, f, x),
                           at_y = value_and_slope(std::type_identity<S>{}, f, y);
    const T rounding = T(8 * double(std::numeric_limits<value_type_t<T>>::epsilon())) *
                       max(T(1), max(firn::abs(at_x.value), firn::abs(at_y.value)));
    const T apart = x - y, difference = at_x.value - at_y.value, slope = T(0.5) * (at_x.slope + at_y.slope);
    const auto close = firn::abs(difference - slope * apart) <= rounding;
    return select(close, slope, difference / select(apart == T(0), T(1), apart));
}

/// Returns a matrix without derivatives as one of numbers with derivatives.
template <class S, class T, int D>
FIRN_INLINE Mat<S, D> constant_matrix(const Mat<T, D>& A) {
    Mat<S, D> constant;
    unroll<D * D>([&](auto k) FIRN_LAMBDA { constant.m[k] = S(A.m[k]); });
    return constant;
}
/// Returns Uᵀ A U for directions U without derivatives.
template <class S, class T, int D>
FIRN_INLINE Mat<S, D> turned_to(const Mat<T, D>& directions, const Mat<S, D>& A) {
    return constant_matrix<S>(transpose(directions)) * A * constant_matrix<S>(directions);
}

/// Returns U X Uᵀ for directions U without derivatives. Off the diagonal X has derivatives, but the value 0.
/// \param principal  the diagonal of X;  \param off  off(i, j) returns Xᵢⱼ, for i < j
template <class S, class T, int D, class Off>
FIRN_INLINE Mat<S, D> turned_back(const Mat<T, D>& directions, const Vec<S, D>& principal, const Off& off) {
    const Mat<S, D> X = symmetric<S, D>([&](auto i, auto j) FIRN_LAMBDA {
        if constexpr (int(i) == int(j))
            return principal.v[i];
        else
            return off(std::min(int(i), int(j)), std::max(int(i), int(j)));
    });
    const Mat<S, D> U = constant_matrix<S>(directions);
    Vec<T, D> plain_values;
    unroll<D>([&](auto i) FIRN_LAMBDA { plain_values.v[i] = plain(principal.v[i]); });
    const Mat<T, D> value = spectral(directions, plain_values);
    Mat<S, D> result = symmetric_product(U * X, transpose(U));
    unroll<D * D>([&](auto k) FIRN_LAMBDA { result.m[k] = with_value(result.m[k], value.m[k]); });
    return result;
}

/// The left stretch V of a matrix F of numbers with derivatives, in its principal directions.
template <class S, int D>
struct TurnedStretch {
    using T = std::remove_cvref_t<decltype(plain(std::declval<S>()))>;

    Mat<T, D> directions;  ///< U, without derivatives
    Mat<S, D> stretch;  ///< Uᵀ V U: σ on the diagonal, 0 off it. Where σᵢ + σⱼ = 0 there is no derivative, and it is 0

    /// \param own  the principal stretches of F without derivatives
    FIRN_INLINE TurnedStretch(const Mat<S, D>& F, const Principal<T, D>& own) : directions(own.directions) {
        // V² = FFᵀ, so (σᵢ + σⱼ) dVᵢⱼ = (dF Fᵀ + F dFᵀ)ᵢⱼ.
        const Mat<S, D> ut = constant_matrix<S>(transpose(directions)), uF = ut * F;
        const Mat<S, D> b = uF * transpose(uF);
        unroll<D>([&](auto i) FIRN_LAMBDA {
            unroll<D>([&](auto j) FIRN_LAMBDA {
                const T sum = own.stretches.v[i] + own.stretches.v[j];
                const auto none = sum == T(0);
                const S scaled = select(none, S(0), b(i, j) * S(T(1) / select(none, T(1), sum)));
                stretch(i, j) = with_value(scaled, int(i) == int(j) ? own.stretches.v[i] : T(0));
            });
        });
    }

    /// Returns U X Uᵀ. \param principal  the diagonal of X;  \param off  off(i, j) returns Xᵢⱼ, for i < j
    template <class Off>
    FIRN_INLINE Mat<S, D> matrix(const Vec<S, D>& principal, const Off& off) const {
        return turned_back(directions, principal, off);
    }
};

/// Returns principal stretches without their derivatives.
template <has_derivatives S, int D>
FIRN_INLINE auto plain_principal(const Principal<S, D>& own) {
    Principal<std::remove_cvref_t<decltype(plain(std::declval<S>()))>, D> result;
    unroll<D>([&](auto i) FIRN_LAMBDA { result.stretches.v[i] = plain(own.stretches.v[i]); });
    unroll<D * D>([&](auto k) FIRN_LAMBDA { result.directions.m[k] = plain(own.directions.m[k]); });
    return result;
}

}  // namespace detail

/// Returns U diag(f(σ)) Uᵀ for the principal stretches σ of F and their directions U. It is exactly symmetric. With
/// dual numbers its derivative is right for equal and nearly equal stretches, too.
/// \param own  principal_stretches(F)
/// \param f    f(σᵢ) returns a scalar, for every scalar type
/// @{
template <scalar S, int D, class Function>
    requires(!has_derivatives<S>)
FIRN_INLINE Mat<S, D> isotropic_function(const Mat<S, D>&, const Principal<S, D>& own, const Function& f) {
    Vec<S, D> values;
    unroll<D>([&](auto i) FIRN_LAMBDA { values.v[i] = f(own.stretches.v[i]); });
    return spectral(own.directions, values);
}
template <has_derivatives S, int D, class Function>
FIRN_INLINE Mat<S, D> isotropic_function(const Mat<S, D>& F, const Principal<S, D>& own, const Function& f) {
    const detail::TurnedStretch<S, D> turned(F, detail::plain_principal(own));
    Vec<S, D> values;
    unroll<D>([&](auto i) FIRN_LAMBDA { values.v[i] = f(turned.stretch(i, i)); });
    return turned.matrix(values, [&](int i, int j) FIRN_LAMBDA {
        return turned.stretch(i, j) *
               S(detail::divided_difference<S>(f, plain(turned.stretch(i, i)), plain(turned.stretch(j, j))));
    });
}
/// @}

/// Returns U diag(f(a, σ)) Uᵀ for the principal stretches σ of F, their directions U, and the principal values a of a
/// symmetric matrix A that has these directions. With dual numbers the derivative is as that of the function of σ
/// alone; A must have the directions of F with its derivative, too, as an isotropic function of F has.
/// \param own  principal_stretches(F)
/// @{
template <scalar S, int D, class Function>
    requires(!has_derivatives<S>)
FIRN_INLINE Mat<S, D> isotropic_function(const Mat<S, D>&, const Principal<S, D>& own, const Mat<S, D>& A,
                                         const Function& f) {
    const Mat<S, D> turned = transpose(own.directions) * A * own.directions;
    Vec<S, D> values;
    unroll<D>([&](auto i) FIRN_LAMBDA { values.v[i] = f(turned(i, i), own.stretches.v[i]); });
    return spectral(own.directions, values);
}
template <has_derivatives S, int D, class Function>
FIRN_INLINE Mat<S, D> isotropic_function(const Mat<S, D>& F, const Principal<S, D>& own, const Mat<S, D>& A,
                                         const Function& f) {
    const detail::TurnedStretch<S, D> turned(F, detail::plain_principal(own));
    const Mat<S, D> a = detail::turned_to(turned.directions, A);
    Vec<S, D> values;
    unroll<D>([&](auto i) FIRN_LAMBDA { values.v[i] = f(a(i, i), turned.stretch(i, i)); });
    // f(aᵢ, σᵢ) − f(aⱼ, σⱼ) is a difference along σ, for aⱼ, and one along a, for σᵢ.
    return turned.matrix(values, [&](int i, int j) FIRN_LAMBDA {
        const auto a_i = plain(a(i, i)), a_j = plain(a(j, j));
        const auto s_i = plain(turned.stretch(i, i)), s_j = plain(turned.stretch(j, j));
        const auto of_stretch = [&](const S& s) FIRN_LAMBDA { return f(S(a_j), s); };
        const auto of_a = [&](const S& x) FIRN_LAMBDA { return f(x, S(s_i)); };
        const S off = with_value(a(i, j), decltype(a_i)(0));
        return turned.stretch(i, j) * S(detail::divided_difference<S>(of_stretch, s_i, s_j)) +
               off * S(detail::divided_difference<S>(of_a, a_i, a_j));
    });
}
/// @}

/// A symmetric matrix A = U diag(a) Uᵀ, for functions whose values each depend on all principal values a. With dual
/// numbers the derivatives are right for equal and nearly equal values, too.
template <class S, int D>
class PrincipalForm {
public:
    Vec<S, D> values;  ///< a, in descending order; has the unit of A. The derivative of aᵢ is (Uᵀ dA U)ᵢᵢ

    /// Decomposes A.
    FIRN_INLINE explicit PrincipalForm(const Mat<S, D>& A) {
        if constexpr (has_derivatives<S>) {
            Mat<T, D> value;
            unroll<D * D>([&](auto k) FIRN_LAMBDA { value.m[k] = plain(A.m[k]); });
            const PrincipalAxes<T, D> axes = principal_axes(value);
            directions_ = axes.directions;
            turned_ = detail::turned_to(directions_, A);
            unroll<D>([&](auto i) FIRN_LAMBDA { values.v[i] = with_value(turned_(i, i), axes.values.v[i]); });
        } else {
            const PrincipalAxes<S, D> axes = principal_axes(A);
            directions_ = axes.directions;
            values = axes.values;
        }
    }

    /// Returns U diag(d) Uᵀ for changes d of the principal values. It is exactly symmetric. d is a function of A that
    /// turns with A.
    /// \param joined  joined(i, j), for i < j, returns the mask of where the change makes aᵢ and aⱼ equal, aᵢ + dᵢ = aⱼ
    ///                + dⱼ, for all A near this one
    template <class Joined>
    FIRN_INLINE Mat<S, D> changes(const Vec<S, D>& d, const Joined& joined) const {
        if constexpr (has_derivatives<S>) {
            // The divided difference (dᵢ − dⱼ)/(aᵢ − aⱼ) is −1 where the values join. Where they do not and are equal,
            // so are dᵢ and dⱼ, and remain equal nearby.
            return detail::turned_back(directions_, d, [&](int i, int j) FIRN_LAMBDA {
                const T apart = plain(values.v[i]) - plain(values.v[j]);
                const T quotient = (plain(d.v[i]) - plain(d.v[j])) / select(apart == T(0), T(1), apart);
                return with_value(turned_(i, j), T(0)) * S(select(joined(i, j), T(-1), quotient));
            });
        } else {
            return spectral(directions_, d);
        }
    }

private:
    template <class X>
    static auto value_of(const X& x) {
        if constexpr (has_derivatives<X>)
            return std::remove_cvref_t<decltype(plain(x))>();
        else
            return X();
    }
    using T = decltype(value_of(std::declval<S>()));
    struct Nothing {};

    Mat<T, D> directions_;                                               ///< U, without derivatives
    std::conditional_t<has_derivatives<S>, Mat<S, D>, Nothing> turned_;  ///< Uᵀ A U
};

}  // namespace firn::inline FIRN_BUILD
