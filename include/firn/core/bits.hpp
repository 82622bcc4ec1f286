/// \file Exact operations on the binary digits of a float, a double, or all lanes of a pack. The functions exp, log and
/// pow use these operations. Their results are right for normal numbers only; callers must treat zero, subnormal
/// numbers, ±∞ and NaN separately.
#pragma once

#include <firn/core/scalar.hpp>

#include <limits>

namespace firn::inline FIRN_BUILD {

/// The layout of the bits of an IEEE 754 float or double.
template <std::floating_point T>
struct binary_layout {
    /// The integer type of the same size as T.
    using integer = std::conditional_t<sizeof(T) == 4, std::int32_t, std::int64_t>;
    /// Number of bits of the fraction. The fraction is in the lowest bits of a number; above it are the bits of the
    /// exponent, then the sign bit.
    static constexpr int fraction_bits = std::numeric_limits<T>::digits - 1;
    static constexpr integer bias = std::numeric_limits<T>::max_exponent - 1;    ///< stored exponent − true exponent
    static constexpr integer fraction_mask = (integer(1) << fraction_bits) - 1;  ///< fraction bits are 1, others 0
    static constexpr integer one = bias << fraction_bits;                        ///< the bits of the number 1
    /// The number 1.5 · 2^fraction_bits. It serves to convert a whole number n to an integer: if |n| \<
    /// 2^(fraction_bits − 1), the lowest bits of n + whole are the integer n.
    static constexpr T whole = T(1.5) * T(integer(1) << fraction_bits);
};

namespace detail::bits {

// In these functions T is float or double, V is T or a SIMD vector of T, and I is the integer or the vector of integers
// that has the same size as V.

template <class T, class I, class V>
FIRN_INLINE V power_of_two(V n) {
    using L = binary_layout<T>;
    return std::bit_cast<V>((std::bit_cast<I>(n + L::whole) + L::bias) << L::fraction_bits);
}
template <class T, class I, class V>
FIRN_INLINE V exponent_of(V x) {
    using L = binary_layout<T>;
    constexpr auto two_to_fraction_bits = (L::bias + L::fraction_bits) << L::fraction_bits;
    const I digits = (std::bit_cast<I>(x) >> L::fraction_bits) | two_to_fraction_bits;
    return std::bit_cast<V>(digits) - T((typename L::integer(1) << L::fraction_bits) + L::bias);
}
template <class T, class I, class V>
FIRN_INLINE V significand_of(V x) {
    using L = binary_layout<T>;
    return std::bit_cast<V>((std::bit_cast<I>(x) & L::fraction_mask) | L::one);
}
template <class T, class I, class V>
FIRN_INLINE V leading_half(V x) {
    using L = binary_layout<T>;
    constexpr auto trailing = (typename L::integer(1) << (L::fraction_bits / 2 + 1)) - 1;
    return std::bit_cast<V>(std::bit_cast<I>(x) & ~trailing);
}

}  // namespace detail::bits

/// Returns 2ⁿ for a whole number n, −126 ≤ n ≤ 127 (double: −1022 ≤ n ≤ 1023).
template <std::floating_point T>
FIRN_INLINE T power_of_two(T n) {
    return detail::bits::power_of_two<T, typename binary_layout<T>::integer>(n);
}
/// Returns the exponent e of x = m 2ᵉ, where 1 ≤ m < 2, for a normal number x > 0.
template <std::floating_point T>
FIRN_INLINE T exponent_of(T x) {
    return detail::bits::exponent_of<T, typename binary_layout<T>::integer>(x);
}
/// Returns the factor m of x = m 2ᵉ, where 1 ≤ m < 2, for a normal number x > 0.
template <std::floating_point T>
FIRN_INLINE T significand_of(T x) {
    return detail::bits::significand_of<T, typename binary_layout<T>::integer>(x);
}
/// Returns x with only the first 12 (for a double: 26) binary digits of its significand; the other digits are set to
/// zero. The product of two numbers returned by this function is exact.
template <std::floating_point T>
FIRN_INLINE T leading_half(T x) {
    return detail::bits::leading_half<T, typename binary_layout<T>::integer>(x);
}

/// Whether two numbers have the same bits, so that −0 differs from 0, and a NaN equals itself.
template <std::floating_point T>
FIRN_INLINE constexpr bool same_bits(T a, T b) {
    using integer = typename binary_layout<T>::integer;
    return std::bit_cast<integer>(a) == std::bit_cast<integer>(b);
}

}  // namespace firn::inline FIRN_BUILD
