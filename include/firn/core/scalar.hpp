/// \file What a scalar is: a type of number with which every formula of firn works, such as float, double, pack (SIMD
/// lanes) or dual.
///
/// A formula may use + − × ÷, comparisons, and the functions of this file. A comparison returns a *mask*, which is on
/// (true) or off (false) in each lane. The functions are `select(mask, a, b)` instead of `if`, `sqrt`, `abs`, `min`,
/// `max`, `floor`, `any(mask)`. Use `if (any(mask))` to skip work that no lane needs. This work must not change lanes
/// where the mask is off.
///
/// `firn::sqrt(x)` works for every scalar. Outside of namespace firn, `sqrt(x)` is firn's function if x is a pack or a
/// dual number, but the C library's function if x is a float or a double.
#pragma once

#include <firn/core/config.hpp>

// With these headers, abs(x) of a float x returns a float in a user's namespace, too. With cmath alone, abs(x) may be
// C's abs(int).
#include <math.h>
#include <stdlib.h>

#include <bit>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <type_traits>

namespace firn::inline FIRN_BUILD {

/// Returns if_true if the mask is on (true), else if_false.
template <std::floating_point S>
FIRN_INLINE constexpr S select(bool mask, S if_true, S if_false) {
    return mask ? if_true : if_false;
}
/// Returns the mask itself, since a float or double has only one lane.
FIRN_INLINE constexpr bool any(bool mask) { return mask; }

/// Returns √a.
template <std::floating_point S>
FIRN_INLINE S sqrt(S a) {
    return std::sqrt(a);
}
/// Returns the largest whole number ≤ a.
template <std::floating_point S>
FIRN_INLINE S floor(S a) {
    return std::floor(a);
}
/// Returns |a|.
template <std::floating_point S>
FIRN_INLINE constexpr S abs(S a) {
    return a < S(0) ? -a : a;
}

namespace detail {
/// Stops the compilation with a message. This function is called where a mask is converted to bool.
template <class Mask>
constexpr bool refuse_to_branch() {
    static_assert(!std::same_as<Mask, Mask>,
                  "firn: a policy cannot branch on a scalar with `if`, `?:`, `&&` or `||`: sixteen particles may "
                  "disagree. Write select(mask, a, b); combine masks with & | !.");
    return false;
}
}  // namespace detail

/// Traits of a scalar S: the type of its numbers and the number of its lanes. There are specialisations for pack, dual,
/// …
template <class S>
struct scalar_traits {
    using value_type = S;            ///< type of the numbers: float or double
    static constexpr int lanes = 1;  ///< number of lanes of S
};
/// Whether S is one of firn's scalar classes (pack, dual, …). The functions of these classes, e.g. sqrt(), are friend
/// functions: only argument-dependent lookup finds them.
template <class S>
inline constexpr bool has_friends = requires { scalar_traits<S>::has_friends; };

/// The type of the numbers in the lanes of S: float or double.
template <class S>
using value_type_t = typename scalar_traits<S>::value_type;

/// The type that a comparison of two scalars of type S returns: bool or a mask.
template <class S>
using mask_t = decltype(std::declval<const S&>() < std::declval<const S&>());

// clang-format off

/// A type with the operators + − × ÷.
template <class S>
concept has_arithmetic = requires(const S a, const S b) {
    { a + b } -> std::same_as<S>;  { a - b } -> std::same_as<S>;
    { a * b } -> std::same_as<S>;  { a / b } -> std::same_as<S>;
    { -a } -> std::same_as<S>;
};
/// A type that is constructible from double and int.
template <class S>
concept has_literals = std::constructible_from<S, double> && std::constructible_from<S, int>;

/// A type with comparisons, select() and any().
template <class S>
concept has_select = requires(const S a, const S b) {
    { select(a < b, a, b) } -> std::same_as<S>;
    { select(a <= b, a, b) } -> std::same_as<S>;
    { any(a < b) } -> std::same_as<bool>;
};
/// A type with sqrt() and abs().
template <class S>
concept has_roots = requires(const S a) {
    { sqrt(a) } -> std::same_as<S>;
    { abs(a) } -> std::same_as<S>;
};
// clang-format on

/// Calls the friend function of firn's scalar class S, so that e.g. firn::sqrt(x) works for all scalars.
/// @{
template <class S>
    requires has_friends<S>
FIRN_INLINE constexpr S select(const mask_t<S>& mask, const S& if_true, const S& if_false) {
    return select(mask, if_true, if_false);
}
template <class S>
    requires has_friends<S>
FIRN_INLINE constexpr S sqrt(const S& a) {
    return sqrt(a);
}
template <class S>
    requires has_friends<S>
FIRN_INLINE constexpr S floor(const S& a) {
    return floor(a);
}
template <class S>
    requires has_friends<S>
FIRN_INLINE constexpr S abs(const S& a) {
    return abs(a);
}
/// @}

/// Returns x. If S is the scalar that records a program for a GPU, x gets the given name in that program.
template <class S>
FIRN_INLINE constexpr const S& named(const char*, const S& x) {
    return x;
}

/// Returns x. Write s = settled(a + b) for a sum whose rounding error (s − a) − b is computed next. If S is the scalar
/// that records a program for a GPU, settled() prevents the compiler of that program from simplifying the error to 0.
template <class S>
FIRN_INLINE constexpr const S& settled(const S& x) {
    return x;
}

/// A type of number with which all formulas of firn work: float, double, pack, dual, …
template <class S>
concept scalar = has_arithmetic<S> && has_literals<S> && has_select<S> && has_roots<S>;

namespace detail {
/// A length, a speed or another size below this is not divided by [unit of the size]. Its inverse and the square of the
/// inverse are numbers that a float holds.
/// @{
inline constexpr double least_size = 1e-15;
inline constexpr double least_square = 1e-30;  ///< The square of least_size.
/// @}
}  // namespace detail

/// Returns the smaller one of a and b, in each lane.
template <scalar S>
FIRN_INLINE constexpr S min(const S& a, const S& b) {
    return select(b < a, b, a);
}
/// Returns the larger one of a and b, in each lane.
template <scalar S>
FIRN_INLINE constexpr S max(const S& a, const S& b) {
    return select(a < b, b, a);
}

}  // namespace firn::inline FIRN_BUILD
