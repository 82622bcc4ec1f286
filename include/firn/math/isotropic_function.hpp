/// \file Isotropic functions of the left stretch, U diag(f(σ)) Uᵀ, with derivatives that are right for equal stretches,
/// too.
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

/// Returns the divided difference f[x, y] of a function of one dual number.
///
/// It is the quotient of differences, but the mean of the two slopes where the two agree up to rounding: for close x
/// and y the mean has the smaller error, and for x = y it is f′(x). If a kink of f lies between x and y, they agree
/// only if the quotient is lost in rounding. f has the rounding errors of numbers of about 1, as strains have.
template <class T, class Function>
FIRN_INLINE T divided_difference(const Function& f, const T& x, const T& y) {
    // f may depend on other dual numbers, too: their part is in the derivative of f at a fixed x.
    const dual<T> at_x = f(dual<T>{x, T(0)}), at_y = f(dual<T>{y, T(0)});
    const T slope_x = f(dual<T>{x, T(1)}).derivative - at_x.derivative;
    const T slope_y = f(dual<T>{y, T(1)}).derivative - at_y.derivative;
    const T rounding = T(8 * double(std::numeric_limits<value_type_t<T>>::epsilon())) *
                       max(T(1), max(firn::abs(at_x.value), firn::abs(at_y.value)));
    const T apart = x - y, difference = at_x.value - at_y.value, slope = T(0.5) * (slope_x + slope_y);
    const auto close = firn::abs(difference - slope * apart) <= rounding;
    return select(close, slope, difference / select(apart == T(0), T(1), apart));
}

/// What the derivative of an isotropic function needs: the directions and stretches of a dual F without derivatives,
/// and the derivative of its left stretch in these directions.
template <class T, int D>
struct TurnedChange {
    Mat<T, D> directions;  ///< U
    Vec<T, D> stretches;   ///< σ
    Mat<T, D> stretch;     ///< Uᵀ dV U; off the diagonal it is 0 where σᵢ + σⱼ = 0, since V has no derivative there

    /// \param F    a matrix with its derivative;  \param own  its principal stretches
    FIRN_INLINE TurnedChange(const Mat<dual<T>, D>& F, const Principal<dual<T>, D>& own) {
        Mat<T, D> value, change;
        unroll<D * D>([&](auto k) FIRN_LAMBDA {
            value.m[k] = F.m[k].value;
            change.m[k] = F.m[k].derivative;
            directions.m[k] = own.directions.m[k].value;
        });
        // V² = FFᵀ, so (σᵢ + σⱼ) dVᵢⱼ = (dF Fᵀ + F dFᵀ)ᵢⱼ.
        const Mat<T, D> ut = transpose(directions);
        const Mat<T, D> half = ut * change * transpose(ut * value);
        unroll<D>([&](auto i) FIRN_LAMBDA { stretches.v[i] = own.stretches.v[i].value; });
        unroll<D>([&](auto i) FIRN_LAMBDA {
            stretch(i, i) = own.stretches.v[i].derivative;
            unroll<D>([&](auto j) FIRN_LAMBDA {
                if constexpr (int(i) != int(j)) {
                    const T sum = stretches.v[i] + stretches.v[j];
                    const auto none = sum == T(0);
                    stretch(i, j) = select(none, T(0), (half(i, j) + half(j, i)) / select(none, T(1), sum));
                }
            });
        });
    }

    /// Returns the matrix U diag(d) Uᵀ with the derivative U X Uᵀ.
    /// \param values  d, with the diagonal of X as derivative
    /// \param off     off(i, j) returns Xᵢⱼ, for i < j
    template <class Off>
    FIRN_INLINE Mat<dual<T>, D> matrix(const Vec<dual<T>, D>& values, const Off& off) const {
        Vec<T, D> principal;
        unroll<D>([&](auto i) FIRN_LAMBDA { principal.v[i] = values.v[i].value; });
        const Mat<T, D> value = spectral(directions, principal);
        const Mat<T, D> turned = symmetric<T, D>([&](auto i, auto j) FIRN_LAMBDA {
            if constexpr (int(i) == int(j))
                return values.v[i].derivative;
            else
                return off(std::min(int(i), int(j)), std::max(int(i), int(j)));
        });
        const Mat<T, D> derivative = symmetric_product(directions * turned, transpose(directions));
        Mat<dual<T>, D> result;
        unroll<D * D>([&](auto k) FIRN_LAMBDA { result.m[k] = {value.m[k], derivative.m[k]}; });
        return result;
    }
};

}  // namespace detail

/// Returns U diag(f(σ)) Uᵀ for the principal stretches σ of F and their directions U. It is exactly symmetric. With
/// dual numbers its derivative is right for equal and nearly equal stretches, too.
/// \param own  principal_stretches(F)
/// \param f    f(σᵢ) returns a scalar, for every scalar type
/// @{
template <scalar S, int D, class Function>
FIRN_INLINE Mat<S, D> isotropic_function(const Mat<S, D>&, const Principal<S, D>& own, const Function& f) {
    Vec<S, D> values;
    unroll<D>([&](auto i) FIRN_LAMBDA { values.v[i] = f(own.stretches.v[i]); });
    return spectral(own.directions, values);
}
template <scalar T, int D, class Function>
FIRN_INLINE Mat<dual<T>, D> isotropic_function(const Mat<dual<T>, D>& F, const Principal<dual<T>, D>& own,
                                               const Function& f) {
    const detail::TurnedChange<T, D> change(F, own);
    Vec<dual<T>, D> values;
    unroll<D>([&](auto i) FIRN_LAMBDA { values.v[i] = f(own.stretches.v[i]); });
    return change.matrix(values, [&](int i, int j) FIRN_LAMBDA {
        return detail::divided_difference<T>(f, change.stretches.v[i], change.stretches.v[j]) * change.stretch(i, j);
    });
}
/// @}

/// Returns U diag(f(a, σ)) Uᵀ for the principal stretches σ of F, their directions U, and the principal values a of a
/// symmetric matrix A that has these directions. With dual numbers the derivative is as that of the function of σ
/// alone; A must have the directions of F with its derivative, too, as an isotropic function of F has.
/// \param own  principal_stretches(F)
/// @{
template <scalar S, int D, class Function>
FIRN_INLINE Mat<S, D> isotropic_function(const Mat<S, D>&, const Principal<S, D>& own, const Mat<S, D>& A,
                                         const Function& f) {
    const Mat<S, D> turned = transpose(own.directions) * A * own.directions;
    Vec<S, D> values;
    unroll<D>([&](auto i) FIRN_LAMBDA { values.v[i] = f(turned(i, i), own.stretches.v[i]); });
    return spectral(own.directions, values);
}
template <scalar T, int D, class Function>
FIRN_INLINE Mat<dual<T>, D> isotropic_function(const Mat<dual<T>, D>& F, const Principal<dual<T>, D>& own,
                                               const Mat<dual<T>, D>& A, const Function& f) {
    const detail::TurnedChange<T, D> change(F, own);
    Mat<dual<T>, D> fixed;  // U without its derivative
    unroll<D * D>([&](auto k) FIRN_LAMBDA { fixed.m[k] = {change.directions.m[k], T(0)}; });
    const Mat<dual<T>, D> turned = transpose(fixed) * A * fixed;
    Vec<dual<T>, D> values;
    unroll<D>([&](auto i) FIRN_LAMBDA { values.v[i] = f(turned(i, i), own.stretches.v[i]); });
    // f(aᵢ, σᵢ) − f(aⱼ, σⱼ) is a difference along σ, for aⱼ, and one along a, for σᵢ.
    return change.matrix(values, [&](int i, int j) FIRN_LAMBDA {
        const T a_i = turned(i, i).value, a_j = turned(j, j).value;
        const T sigma_i = change.stretches.v[i], sigma_j = change.stretches.v[j];
        const auto of_stretch = [&](const dual<T>& s) FIRN_LAMBDA { return f(dual<T>{a_j, T(0)}, s); };
        const auto of_a = [&](const dual<T>& a) FIRN_LAMBDA { return f(a, dual<T>{sigma_i, T(0)}); };
        return detail::divided_difference<T>(of_stretch, sigma_i, sigma_j) * change.stretch(i, j) +
               detail::divided_difference<T>(of_a, a_i, a_j) * turned(i, j).derivative;
    });
}
/// @}

}  // namespace firn::inline FIRN_BUILD
