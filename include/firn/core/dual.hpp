/// \file Dual numbers a + b ε with ε² = 0: one evaluation gives a value and its derivative along one direction.
#pragma once

#include <firn/core/scalar.hpp>

namespace firn {

template <scalar T>
struct dual {
    T value;
    T derivative;

    dual() = default;
    FIRN_INLINE constexpr dual(T v, T d) : value(v), derivative(d) {}
    template <class U>
        requires std::is_arithmetic_v<U>
    FIRN_INLINE constexpr dual(U v) : value(T(v)), derivative(T(0)) {}
    /// A constant of the scalar beneath, where that is none of C++'s numbers.
    FIRN_INLINE constexpr explicit dual(const T& v)
        requires(!std::is_arithmetic_v<T>)
        : value(v), derivative(T(0)) {}

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

    FIRN_INLINE friend constexpr auto operator<(dual a, dual b) { return a.value < b.value; }
    FIRN_INLINE friend constexpr auto operator<=(dual a, dual b) { return a.value <= b.value; }
    FIRN_INLINE friend constexpr auto operator>(dual a, dual b) { return a.value > b.value; }
    FIRN_INLINE friend constexpr auto operator>=(dual a, dual b) { return a.value >= b.value; }
    FIRN_INLINE friend constexpr auto operator==(dual a, dual b) { return a.value == b.value; }

    FIRN_INLINE friend constexpr dual select(mask_t<T> m, dual a, dual b) {
        return {select(m, a.value, b.value), select(m, a.derivative, b.derivative)};
    }
    FIRN_INLINE friend dual sqrt(dual a) {
        using firn::sqrt;
        const T root = sqrt(a.value);
        return {root, a.derivative / (root + root)};
    }
    FIRN_INLINE friend dual abs(dual a) { return select(a.value < T(0), -a, a); }
    FIRN_INLINE friend dual floor(dual a) {
        using firn::floor;
        return {floor(a.value), T(0)};
    }
};

template <class T>
struct scalar_traits<dual<T>> {
    using value_type = value_type_t<T>;
    static constexpr int lanes = scalar_traits<T>::lanes;
    static constexpr bool has_friends = true;
};

}  // namespace firn
