/// \file exp and log for every scalar, without branches.
///
/// The functions give the same bits for a single number and in SIMD lanes, and (with floating-point contraction off)
/// under every compiler. Their largest errors, measured over the whole range, are:
///
///     exp        1.1 ulp, also for subnormal results; exp(−∞) = 0, exp(∞) = ∞
///     log        0.9 ulp, also of subnormal numbers; log 0 = −∞, log x = NaN for x < 0
///     log(x, y)  0.9 ulp, where y = x − 1 is given, too, so that nothing is lost near x = 1
///
/// For NaN, they return NaN. They sum a Taylor series, after the argument is reduced to a small range as in
/// Cody & Waite, Software Manual for the Elementary Functions (1980).
#pragma once

#include <firn/core/bits.hpp>
#include <firn/core/dual.hpp>

#include <array>

namespace firn::inline FIRN_BUILD {

namespace detail {

template <class S>
inline constexpr bool is_single = sizeof(value_type_t<S>) == 4;

/// Returns the polynomial c₀ + c₁ x + c₂ x² + …
template <class S, std::size_t N>
FIRN_INLINE S polynomial(const S& x, const std::array<double, N>& c) {
    S sum = S(c[N - 1]);
    unroll<int(N) - 1>([&](auto k) FIRN_LAMBDA { sum = sum * x + S(c[N - 2 - k]); });
    return sum;
}

/// Returns the whole number nearest to x, for |x| < 2²¹ in float and |x| < 2⁵⁰ in double.
template <class S>
FIRN_INLINE S nearest_whole(const S& x) {
    constexpr auto whole = binary_layout<value_type_t<S>>::whole;
    return (x + S(whole)) - S(whole);
}

template <class S>
struct Pair {
    S high, low;
};

/// Returns the rounded sum `high` of a and b, and the rounding error `low` of this sum: a + b = high + low exactly
/// (Knuth, The Art of Computer Programming, vol. 2, 4.2.2).
template <class S>
FIRN_INLINE Pair<S> two_sum(const S& a, const S& b) {
    const S sum = settled(a + b);
    const S part = sum - a;
    return {sum, (a - (sum - part)) + (b - part)};
}

// ln 2 = ln2_high + ln2_low. ln2_high has so few binary digits that the product of ln2_high and the exponent of any
// float or double is exact.
template <class S>
inline constexpr double ln2_high = is_single<S> ? 0x1.62e4p-1 : 0x1.62e42fefa3p-1;
template <class S>
inline constexpr double ln2_low = is_single<S> ? 0x1.7f7d1cf79abcap-20 : 0x1.3de6af278ece6p-42;

// For x > exp_highest, exp(x) overflows. For x < exp_lowest, exp(x) is less than half of the smallest subnormal number.
template <class S>
inline constexpr double exp_highest = is_single<S> ? 89 : 710;
template <class S>
inline constexpr double exp_lowest = is_single<S> ? -104 : -746;

/// Returns the coefficients 1/2!, 1/3!, …, 1/(N+1)!
template <std::size_t N>
constexpr std::array<double, N> inverse_factorials_from_two() {
    std::array<double, N> c{};
    double factorial = 1;
    for (std::size_t k = 0; k < N; ++k) c[k] = 1 / (factorial *= double(k + 2));
    return c;
}

/// eˣ = (1 + q) 2ⁿ, where |q| < ½ and n is a whole number.
template <class S>
struct ExpParts {
    S q, n;

    FIRN_INLINE S whole() const {
        const S half = nearest_whole(n * S(0.5));  // two factors, since 2ⁿ itself may be out of range
        return (S(1) + q) * power_of_two(half) * power_of_two(n - half);
    }
};
/// Returns the parts of exp(high + low), where |low| ≪ |high| or low = 0, and exp_lowest ≤ high ≤ exp_highest.
template <class S>
FIRN_INLINE ExpParts<S> exp_parts(const S& high, const S& low) {
    const S n = nearest_whole((high + low) * S(1.44269504088896340736));
    const S r = ((high - n * S(ln2_high<S>)) - n * S(ln2_low<S>)) + low;  // |r| ≤ ½ ln 2
    constexpr auto series = inverse_factorials_from_two<is_single<S> ? 6 : 12>();
    return {r + r * r * polynomial(r, series), n};
}
/// Returns exp(high + low), where |low| ≪ |high| or low = 0, and exp_lowest ≤ high ≤ exp_highest.
template <class S>
FIRN_INLINE S exp_of_sum(const S& high, const S& low) {
    return exp_parts(high, low).whole();
}

/// The factor m and the exponent e of a number x = m 2ᵉ > 0, where √½ ≤ m < √2. x may be subnormal.
template <class S>
struct Split {
    S m, e;
};
template <class S>
FIRN_INLINE Split<S> split(const S& x) {
    const auto subnormal = x < S(std::numeric_limits<value_type_t<S>>::min());
    const S lifted = select(subnormal, x * S(0x1p54), x);
    const S m = significand_of(lifted);
    const S e = exponent_of(lifted) - select(subnormal, S(54), S(0));
    const auto upper = S(1.41421356237309504880) < m;
    return {select(upper, m * S(0.5), m), select(upper, e + S(1), e)};
}

}  // namespace detail

/// Returns eˣ. The error is at most 1.1 ulp (measured).
template <scalar S>
FIRN_INLINE S exp(const S& x) {
    const S low = S(detail::exp_lowest<S>);
    const S high = S(detail::exp_highest<S>);
    return detail::exp_of_sum(select(x < low, low, select(high < x, high, x)), S(0));
}

namespace detail {
/// Returns log x for x = (1 + f) 2ᵉ, as e log 2 + 2 artanh s with s = f / (2 + f); −∞ for x = 0, NaN for x < 0.
template <class S>
FIRN_INLINE S log_of(const S& x, const S& f, const S& e) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    const S s = f / (S(2) + f);
    const S z = s * s;
    // 2 artanh s = 2 s + s R, where R is the rest of the series, and 2 s = f − s f, where f is exact.
    S R = z;
    if constexpr (is_single<S>) {
        R = z * polynomial(z, std::array{2. / 3, 2. / 5, 2. / 7, 2. / 9});
    } else {
        R = z * polynomial(z, std::array{2. / 3, 2. / 5, 2. / 7, 2. / 9, 2. / 11, 2. / 13, 2. / 15, 2. / 17, 2. / 19,
                                         2. / 21});
    }
    const S finite = e * S(ln2_high<S>) + (f - (s * (f - R) - e * S(ln2_low<S>)));
    const S special = select(x < S(0), S(nan), select(x == S(0), S(-infinity), x));  // x: ∞ or NaN
    return select((S(0) < x) & (x < S(infinity)), finite, special);
}
}  // namespace detail

/// Returns the natural logarithm of x; −∞ for x = 0, NaN for x < 0. The error is at most 0.9 ulp (measured).
template <scalar S>
FIRN_INLINE S log(const S& x) {
    const auto [m, e] = detail::split(x);
    return detail::log_of(x, m - S(1), e);
}
/// Returns the natural logarithm of x, where x − 1 is known more exactly than x; −∞ for x = 0, NaN for x < 0. The error
/// is at most 0.9 ulp (measured).
/// \param less_one  x − 1
template <scalar S>
FIRN_INLINE S log(const S& x, const std::type_identity_t<S>& less_one) {
    const auto [m, e] = detail::split(x);
    return detail::log_of(x, select(e == S(0), less_one, m - S(1)), e);
}

/// Returns eˣ and its derivative.
template <scalar T>
FIRN_INLINE dual<T> exp(const dual<T>& x) {
    const T value = exp(x.value);
    return {value, value * x.derivative};
}
/// Returns the natural logarithm of x and its derivative.
template <scalar T>
FIRN_INLINE dual<T> log(const dual<T>& x) {
    return {log(x.value), x.derivative / x.value};
}
/// Returns the natural logarithm of x and its derivative, where x − 1 is known more exactly than x.
template <scalar T>
FIRN_INLINE dual<T> log(const dual<T>& x, const dual<T>& less_one) {
    return {log(x.value, less_one.value), less_one.derivative / x.value};
}

}  // namespace firn::inline FIRN_BUILD
