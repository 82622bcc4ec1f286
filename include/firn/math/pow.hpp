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

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Returns log x as the sum of two numbers, for x = (1 + f) 2ᵉ > 0, with a relative error of about ε / 100 (ε: machine
/// epsilon). All products whose rounding errors would matter are products of two results of leading_half(), and
/// therefore exact. So these products are the same with and without fused multiply-adds.
template <class S>
FIRN_INLINE Pair<S> log_pair(const S& f, const S& e) {
    // s = f / (f + 2)
    const S divisor = settled(f + S(2));
    const S divisor_rest = f - (divisor - S(2));
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

/// Returns y log x as the sum of two numbers, from log_pair().
template <class S>
FIRN_INLINE Pair<S> times_log(const S& y, const Pair<S>& log) {
    const S log_head = leading_half(log.high);
    const S log_rest = (log.high - log_head) + log.low;
    const S y_head = leading_half(y);
    return {y_head * log_head, (y - y_head) * log_head + y * log_rest};
}

}  // namespace detail

/// Returns xʸ for x ≥ 0, NaN for x < 0. The error is at most 1.3 ulp (measured).
template <scalar S>
FIRN_INLINE S pow(const S& x, const std::type_identity_t<S>& y) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const auto [m, e] = detail::split(x);
    const detail::Pair<S> log = detail::log_pair(m - S(1), e);
    const S rough = y * log.high;
    const auto over = S(detail::exp_highest<S>) < rough;
    const auto under = rough < S(detail::exp_lowest<S>);

    const auto [high, low] = detail::times_log(y, log);
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

/// Returns xʸ − 1 for x = 1 + less_one, so that nothing is lost near x = 1. x must be positive, and xʸ in the range of
/// the scalar. The error is at most 5 ulp where x is between 0.71 and 1.41 (measured: 4.5), and |y| + 5 ulp elsewhere.
template <scalar S>
FIRN_INLINE S pow_less_one(const S& less_one, const std::type_identity_t<S>& y) {
    const S x = S(1) + less_one;
    const auto [m, e] = detail::split(x);
    const S f = select(e == S(0), less_one, m - S(1));
    const auto [high, low] = detail::times_log(y, detail::log_pair(f, e));
    const detail::ExpParts<S> power = detail::exp_parts(high, low);
    return select(power.n == S(0), power.q, power.whole() - S(1));
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

/// Returns xʸ − 1 for x = 1 + less_one, and its derivative.
template <scalar T>
FIRN_INLINE dual<T> pow_less_one(const dual<T>& less_one, const std::type_identity_t<dual<T>>& y) {
    const dual<T> power = pow(dual<T>(T(1) + less_one.value, less_one.derivative), y);
    return {pow_less_one(less_one.value, y.value), power.derivative};
}

}  // namespace firn::inline FIRN_BUILD
