/// \file sin and cos for every scalar, without branches.
///
/// The functions give the same bits for a single number and in SIMD lanes, and (with floating-point contraction off)
/// under every compiler. The argument x is in radians, |x| ≤ 1e5 in float and |x| ≤ 1e8 in double. For a larger |x| the
/// result is NaN, since the subtraction of quarter turns from x would lose digits. The error is at most 1.1 ulp in that
/// range (measured), also near the zeros of the functions.
#pragma once

#include <firn/math/exp_log.hpp>

namespace firn::inline FIRN_BUILD {

namespace detail {

// π/2 as a sum of parts. Each part except the last has so few binary digits that the product of the part and the number
// of quarter turns is exact (Cody & Waite).
template <class S>
inline constexpr auto quarter_turn =
    std::array{0x1.921fb4p+0, 0x1.4442dp-24, 0x1.846988p-48, 0x1.8cc516p-72, 0x1.01b839a25204ap-96};
template <class S>
    requires is_single<S>
inline constexpr auto quarter_turn<S> =
    std::array{0x1.92p+0, 0x1.fap-12, 0x1.54p-20, 0x1.1p-30, 0x1.68p-39, 0x1.84p-48, 0x1.a62634p-58};

/// Returns the coefficients ±1/n! of the series of sin and cos for n = first, first + 2, … A coefficient is negative if
/// n/2, rounded down, is odd.
template <int first, std::size_t N>
constexpr std::array<double, N> alternating_inverse_factorials() {
    double term = (first / 2) % 2 == 0 ? 1 : -1;
    for (int n = 2; n <= first; ++n) term /= n;
    std::array<double, N> c{};
    for (std::size_t k = 0; k < N; ++k) {
        c[k] = term;
        const int n = first + 2 * int(k);
        term = -term / ((n + 1) * (n + 2));
    }
    return c;
}

template <class S>
struct SineCosine {
    S sine, cosine;
};
/// Returns sine and cosine of r + rest by their series, for |r| ≤ π/4 and |rest| ≪ |r| or rest = 0.
template <class S>
FIRN_INLINE SineCosine<S> sine_cosine_series(const S& r, const S& rest) {
    const S z = r * r;
    const S past_r = polynomial(z, alternating_inverse_factorials<3, is_single<S> ? 4 : 8>());
    const S past_square = polynomial(z, alternating_inverse_factorials<4, is_single<S> ? 4 : 7>());
    return {r + (rest + r * z * past_r), S(1) - (S(0.5) * z - (z * z * past_square - r * rest))};
}
/// Returns the sine of an angle x [rad], |x| ≤ π/2, as 2 sin(x/2) cos(x/2). There are no quarter
/// turns to subtract, unlike in sin(). The error is at most 3 ulp.
template <class S>
FIRN_INLINE S sine_up_to_quarter_turn(const S& x) {
    const auto [sine, cosine] = sine_cosine_series(S(0.5) * x, S(0));
    return (sine + sine) * cosine;
}

template <class S>
struct QuarterTurn {
    S sine,      ///< sine of r = x minus the nearest multiple of π/2
        cosine;  ///< cosine of r
    S quadrant;  ///< number of quarter turns that were subtracted from x, modulo 4: 0, 1, 2 or 3
};
template <class S>
FIRN_INLINE QuarterTurn<S> reduced_sine_cosine(const S& x) {
    const S n = nearest_whole(x * S(0.636619772367581343076));
    S r = (x - n * S(quarter_turn<S>[0])) - n * S(quarter_turn<S>[1]);  // exact, unlike the differences below
    S rest = S(0);
    unroll<int(quarter_turn<S>.size()) - 2>([&](auto k) FIRN_LAMBDA {
        const auto [sum, error] = two_sum(r, -(n * S(quarter_turn<S>[k + 2])));
        r = sum;
        rest = rest + error;
    });
    const auto [sine, cosine] = sine_cosine_series(r, rest);
    return {sine, cosine, n - S(4) * nearest_whole(S(0.25) * n - S(0.375))};
}

template <class S>
FIRN_INLINE S within_range_or_nan(const S& x, const S& result) {
    return select(abs(x) <= S(is_single<S> ? 1e5 : 1e8), result, S(std::numeric_limits<double>::quiet_NaN()));
}

}  // namespace detail

/// Returns the sine of an angle x [rad]; NaN for |x| above 1e5 in float and 1e8 in double. The error is at most 1.1 ulp
/// (measured).
template <scalar S>
FIRN_INLINE S sin(const S& x) {
    const auto [sine, cosine, quadrant] = detail::reduced_sine_cosine(x);
    const S size = select((quadrant == S(1)) | (quadrant == S(3)), cosine, sine);
    return detail::within_range_or_nan(x, select(S(1) < quadrant, -size, size));
}
/// Returns the cosine of an angle x [rad]; NaN for |x| above 1e5 in float and 1e8 in double. The error is at most 1.1
/// ulp (measured).
template <scalar S>
FIRN_INLINE S cos(const S& x) {
    const auto [sine, cosine, quadrant] = detail::reduced_sine_cosine(x);
    const S size = select((quadrant == S(1)) | (quadrant == S(3)), sine, cosine);
    return detail::within_range_or_nan(x, select((quadrant == S(1)) | (quadrant == S(2)), -size, size));
}

/// Returns the tangent of an angle x [rad], the quotient of sine and cosine; NaN for |x| above 1e5 in float and 1e8 in
/// double. The error is at most 3 ulp (measured).
template <scalar S>
FIRN_INLINE S tan(const S& x) {
    return sin(x) / cos(x);
}

/// Returns the sine of x [rad] and its derivative.
template <scalar T>
FIRN_INLINE dual<T> sin(const dual<T>& x) {
    return {sin(x.value), cos(x.value) * x.derivative};
}
/// Returns the cosine of x [rad] and its derivative.
template <scalar T>
FIRN_INLINE dual<T> cos(const dual<T>& x) {
    return {cos(x.value), -sin(x.value) * x.derivative};
}

}  // namespace firn::inline FIRN_BUILD
