/// \file What a scalar is. One definition of a formula works for all scalars: float, double, SIMD lanes, dual numbers.
///
/// A definition may use + − × ÷, comparisons, which return a *mask*, and the functions of this file:
/// `select(mask, a, b)` instead of `if`, `sqrt`, `abs`, `min`, `max`, `floor`, `any(mask)`.
/// `any` serves to skip work that no lane needs. Guarded code must not change lanes whose mask is off.
///
/// `firn::sqrt(x)` works for every scalar. Outside of firn, plain `sqrt(x)` is firn's function for lanes, but the C
/// library's for float and double.
#pragma once

#include <firn/core/config.hpp>

// With these headers abs(x) of a float is a float in a user's namespace, too. With cmath alone it may be C's abs(int).
#include <math.h>
#include <stdlib.h>

#include <bit>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <type_traits>

namespace firn {

/// Returns if_true where the mask is on, if_false elsewhere.
template <std::floating_point S>
FIRN_INLINE constexpr S select(bool mask, S if_true, S if_false) {
    return mask ? if_true : if_false;
}
/// Whether the mask is on in any lane.
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
/// Called where a mask of lanes is converted to bool: does not compile.
template <class Mask>
constexpr bool refuse_to_branch() {
    static_assert(!std::same_as<Mask, Mask>,
                  "firn: a policy cannot branch on a scalar with `if`, `?:`, `&&` or `||`: sixteen particles may "
                  "disagree. Write select(mask, a, b); combine masks with & | !.");
    return false;
}
}  // namespace detail

/// The numbers that a scalar is made of. pack, dual, … specialise it.
template <class S>
struct scalar_traits {
    using value_type = S;            ///< float or double
    static constexpr int lanes = 1;  ///< particles held by one S
};
/// Whether S is one of firn's classes (pack, dual, …). Their functions are friends, which only argument-dependent
/// lookup finds.
template <class S>
inline constexpr bool has_friends = requires { scalar_traits<S>::has_friends; };

/// The type of the numbers in S: float or double.
template <class S>
using value_type_t = typename scalar_traits<S>::value_type;

/// The type that comparisons of two S return.
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

/// Calls the friend function of firn's class S, so that the name with firn:: in front works for all scalars.
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

/// Returns x. A scalar that records a program gives x this name in the program.
template <class S>
FIRN_INLINE constexpr const S& named(const char*, const S& x) {
    return x;
}

/// Returns x. Marks a sum whose rounding matters, such as (a + b) − a, which serves to find the error of a + b. A
/// scalar that records a program prevents compilers from simplifying it.
template <class S>
FIRN_INLINE constexpr const S& settled(const S& x) {
    return x;
}

/// A type of number that all of firn's definitions work with.
template <class S>
concept scalar = has_arithmetic<S> && has_literals<S> && has_select<S> && has_roots<S>;

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

}  // namespace firn
