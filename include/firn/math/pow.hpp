/// \file pow for every scalar, without branches.
///
/// xʸ = exp(y log x). The logarithm is computed as the sum of two numbers, because the relative error of the logarithm
/// is multiplied by y log x. The error of pow is at most 1.3 ulp over the whole range (measured), also for subnormal
/// results.
///
/// x must not be negative: a negative x gives NaN, also for whole y (as on a GPU). pow(x, 0) = pow(1, y) = 1. For x or
/// y equal to 0 or ∞ the results are those of the C standard, except that −0 is treated as 0. If x or y is NaN, the
/// result is NaN, also in pow(NaN, 0).
#pragma once

#include <firn/math/exp_log.hpp>

namespace firn {

namespace detail {

/// Returns log x as the sum of two numbers, for finite x > 0, with a relative error of about ε / 100 (ε: machine
/// epsilon). All products whose rounding errors would matter are products of two results of leading_half(), and
/// therefore exact. So these products are the same with and without fused multiply-adds.
template <class S>
FIRN_INLINE Pair<S> log_pair(const S& x) {
    const auto [m, e] = split(x);
    const S f = m - S(1);

    // s = f / (m + 1)
    const S divisor = settled(m + S(1));
    const S divisor_rest = m - (divisor - S(1));
    const S divisor_head = leading_half(divisor);
    const S s = leading_half(f / divisor);
    const S s_rest = (((f - s * divisor_head) - s * (divisor - divisor_head)) - s * divisor_rest) / divisor;

    // log m = 2 artanh s = 2 s (1 + z/3 + z²/5 + …), z = s²
    const S zz = s * s;
    const S z = leading_half(zz);
    const S z_rest = (zz - z) + s_rest * (s + s + s_rest);
    const S square = z + z_rest;
    S series = z;
    if constexpr (is_single<S>) {
        series = polynomial(square, std::array{1. / 5, 1. / 7, 1. / 9, 1. / 11, 1. / 13});
    } else {
        series = polynomial(square, std::array{1. / 5, 1. / 7, 1. / 9, 1. / 11, 1. / 13, 1. / 15, 1. / 17, 1. / 19,
                                               1. / 21, 1. / 23, 1. / 25});
    }
    constexpr double third = is_single<S> ? 0x1.554p-2 : 0x1.555555p-2;  // the leading half of 1/3
    constexpr double third_rest = (is_single<S> ? 0x1p-12 : 0x1p-26) / 3;
    const S linear = z * S(third);
    const S linear_head = leading_half(linear);
    const S t_rest = (linear - linear_head) + (z * S(third_rest) + z_rest * S(1. / 3)) + square * square * series;

    const Pair<S> sum = two_sum(e * S(ln2_high<S>), s + s);
    const Pair<S> sum2 = two_sum(sum.high, (s + s) * linear_head);
    const S correction = S(2) * (s_rest + s_rest * (linear_head + t_rest) + s * t_rest);
    return two_sum(sum2.high, (sum.low + sum2.low) + (correction + e * S(ln2_low<S>)));
}

}  // namespace detail

/// Returns xʸ for x ≥ 0, NaN for x < 0. The error is at most 1.3 ulp (measured).
template <scalar S>
FIRN_INLINE S pow(const S& x, const std::type_identity_t<S>& y) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const auto [log_high, log_low] = detail::log_pair(x);
    const S rough = y * log_high;
    const auto over = S(detail::exp_highest<S>) < rough;
    const auto under = rough < S(detail::exp_lowest<S>);

    const S log_head = leading_half(log_high);
    const S log_rest = (log_high - log_head) + log_low;
    const S y_head = leading_half(y);
    const S high = y_head * log_head;
    const S low = (y - y_head) * log_head + y * log_rest;
    S r = detail::exp_of_sum(select(over | under, S(0), high), select(over | under, S(0), low));

    r = select(under, S(0), select(over, S(infinity), r));
    const auto at_zero = x == S(0);
    const auto at_infinity = x == S(infinity);
    const auto grows = S(0) < y;
    const auto falls = y < S(0);
    r = select((at_zero & grows) | (at_infinity & falls), S(0), r);
    r = select((at_zero & falls) | (at_infinity & grows), S(infinity), r);
    r = select((y == S(0)) | (x == S(1)), S(1), r);
    r = select(x < S(0), S(std::numeric_limits<double>::quiet_NaN()), r);
    return select((x == x) & (y == y), r, x + y);
}

/// Returns xʸ and its derivative, d(xʸ) = y xʸ⁻¹ dx + xʸ log x dy. The first term is 0 if dx = 0 or y = 0, the second
/// term is 0 if dy = 0, even where the other factors of a term are infinite.
template <scalar T>
FIRN_INLINE dual<T> pow(const dual<T>& x, const std::type_identity_t<dual<T>>& y) {
    const T value = pow(x.value, y.value);
    const T by_base = y.value * pow(x.value, y.value - T(1)) * x.derivative;
    const T by_exponent = value * log(x.value) * y.derivative;
    const auto base_matters = !((x.derivative == T(0)) | (y.value == T(0)));
    const auto exponent_matters = !(y.derivative == T(0));
    return {value, select(base_matters, by_base, T(0)) + select(exponent_matters, by_exponent, T(0))};
}

}  // namespace firn
