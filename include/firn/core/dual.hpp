/// \file Dual numbers a + b ε with ε² = 0. If a function is evaluated with a dual number, the result holds the
/// function's value and its derivative with respect to one variable.
#pragma once

#include <firn/core/scalar.hpp>

namespace firn::inline FIRN_BUILD {

/// A number and its derivative with respect to one variable.
/// \tparam T  type of the value and of the derivative: float, double, pack, …
template <scalar T>
struct dual {
    T value;       ///< the number: a in a + b ε
    T derivative;  ///< the number's derivative: b in a + b ε

    dual() = default;  ///< Leaves value and derivative uninitialised.
    /// Makes the dual number v + d ε.
    FIRN_INLINE constexpr dual(T v, T d) : value(v), derivative(d) {}
    /// Makes a dual number with derivative zero from a number.
    template <class U>
        requires std::is_arithmetic_v<U>
    FIRN_INLINE constexpr dual(U v) : value(T(v)), derivative(T(0)) {}
    /// Makes a dual number with derivative zero from a value of type T. (For T = float or double, the constructor above
    /// does this.)
    FIRN_INLINE constexpr explicit dual(const T& v)
        requires(!std::is_arithmetic_v<T>)
        : value(v), derivative(T(0)) {}

    /// Arithmetic operators. The derivative of the result follows the rules for sums, products and quotients.
    /// @{
    FIRN_INLINE friend constexpr dual operator+(dual a, dual b) {
        return {a.value + b.value, a.derivative + b.derivative};
    }
    FIRN_INLINE friend constexpr dual operator-(dual a, dual b) {
        return {a.value - b.value, a.derivative - b.derivative};
    }
    FIRN_INLINE friend constexpr dual operator*(dual a, dual b) {
        return {a.value * b.value, a.derivative * b.value + a.value * b.derivative};
    }
    FIRN_INLINE friend constexpr dual operator/(dual a, dual b) {
        const T quotient = a.value / b.value;
        return {quotient, (a.derivative - quotient * b.derivative) / b.value};
    }
    FIRN_INLINE friend constexpr dual operator-(dual a) { return {-a.value, -a.derivative}; }
    FIRN_INLINE constexpr dual& operator+=(dual b) { return *this = *this + b; }
    FIRN_INLINE constexpr dual& operator-=(dual b) { return *this = *this - b; }
    FIRN_INLINE constexpr dual& operator*=(dual b) { return *this = *this * b; }
    /// @}

    /// Compares only the values and ignores the derivatives.
    /// @{
    FIRN_INLINE friend constexpr auto operator<(dual a, dual b) { return a.value < b.value; }
    FIRN_INLINE friend constexpr auto operator<=(dual a, dual b) { return a.value <= b.value; }
    FIRN_INLINE friend constexpr auto operator>(dual a, dual b) { return a.value > b.value; }
    FIRN_INLINE friend constexpr auto operator>=(dual a, dual b) { return a.value >= b.value; }
    FIRN_INLINE friend constexpr auto operator==(dual a, dual b) { return a.value == b.value; }
    /// @}

    /// Returns `a`, with its derivative, in the lanes where the mask is on, and `b`, with its derivative, in the other
    /// lanes.
    FIRN_INLINE friend constexpr dual select(mask_t<T> m, dual a, dual b) {
        return {select(m, a.value, b.value), select(m, a.derivative, b.derivative)};
    }
    /// Returns √a. Where the derivative of a is zero, so is that of the result: also at a = 0, so that the norm of a
    /// zero vector has the derivative 0. Elsewhere at a = 0 the derivative of the result is infinite.
    FIRN_INLINE friend dual sqrt(dual a) {
        using firn::sqrt;
        const T root = sqrt(a.value);
        const auto constant = a.derivative == T(0);
        return {root, select(constant, T(0), a.derivative / select(constant, T(1), root + root))};
    }
    /// Returns |a|.
    FIRN_INLINE friend dual abs(dual a) { return select(a.value < T(0), -a, a); }
    /// Returns the largest whole number ≤ a, with derivative zero.
    FIRN_INLINE friend dual floor(dual a) {
        using firn::floor;
        return {floor(a.value), T(0)};
    }
};

/// Traits of a dual number: the type of its numbers and the number of its lanes. Both are the same as for T.
template <class T>
struct scalar_traits<dual<T>> {
    using value_type = value_type_t<T>;                    ///< type of the numbers: float or double
    static constexpr int lanes = scalar_traits<T>::lanes;  ///< number of lanes of T
    static constexpr bool has_friends = true;              ///< makes `firn::has_friends<S>` true for dual numbers
};

/// \name What every number with derivatives has
/// Dual numbers, and the traced numbers of core/traced.hpp.
/// @{

/// Returns the value without the derivative.
template <class T>
FIRN_INLINE const T& plain(const dual<T>& x) {
    return x.value;
}
/// Returns a number with this value, and with the derivative of x.
template <class T>
FIRN_INLINE dual<T> with_value(const dual<T>& x, const T& value) {
    return {value, x.derivative};
}
/// The value and the slope of a function at a point.
template <class T>
struct ValueAndSlope {
    T value,    ///< f(x)
        slope;  ///< f′(x)
};
/// Returns f(x) and f′(x) of a function of one number with derivatives. f may depend on other such numbers.
/// \param f  takes and returns a dual<T>
template <class T, class Function>
FIRN_INLINE ValueAndSlope<T> value_and_slope(std::type_identity<dual<T>>, const Function& f, const T& x) {
    const dual<T> at_rest = f(dual<T>{x, T(0)});
    return {at_rest.value, f(dual<T>{x, T(1)}).derivative - at_rest.derivative};
}
/// A number with derivatives.
template <class S>
concept has_derivatives = requires(const S x) { plain(x); };
/// @}

}  // namespace firn::inline FIRN_BUILD
