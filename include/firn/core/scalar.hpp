/// \file What a scalar is: the seam through which one definition runs as float, double, SIMD lanes, dual numbers.
///
/// A definition may use + − × ÷, comparisons (which give a *mask*), and the functions of this file:
/// `select(mask, a, b)` in place of `if`, `sqrt`, `abs`, `min`, `max`, `floor`, `any(mask)`.
/// `any` is for skipping work that no lane needs; what it guards must not change lanes whose mask is off.
///
/// All may be called as firn::sqrt(x), whatever x is. A name without firn:: finds those of lanes by itself; of float
/// and double, outside of firn, it finds the C library's.
#pragma once

#include <firn/core/config.hpp>

// With these abs(x) of a float is a float's in a program's own namespace, too: with cmath alone it may be C's abs(int).
#include <math.h>
#include <stdlib.h>

#include <bit>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <type_traits>

namespace firn {

template <std::floating_point S>
FIRN_INLINE constexpr S select(bool mask, S if_true, S if_false) {
    return mask ? if_true : if_false;
}
FIRN_INLINE constexpr bool any(bool mask) { return mask; }

template <std::floating_point S>
FIRN_INLINE S sqrt(S a) {
    return std::sqrt(a);
}
template <std::floating_point S>
FIRN_INLINE S floor(S a) {
    return std::floor(a);
}
template <std::floating_point S>
FIRN_INLINE constexpr S abs(S a) {
    return a < S(0) ? -a : a;
}

namespace detail {
/// What converting a mask of lanes to bool comes to.
template <class Mask>
constexpr bool refuse_to_branch() {
    static_assert(!std::same_as<Mask, Mask>,
                  "firn: a policy cannot branch on a scalar with `if`, `?:`, `&&` or `||`: sixteen particles may "
                  "disagree. Write select(mask, a, b); combine masks with & | !.");
    return false;
}
}  // namespace detail

/// How a scalar relates to the machine number it is made of; specialised by pack, dual, …
template <class S>
struct scalar_traits {
    using value_type = S;            ///< float or double
    static constexpr int lanes = 1;  ///< particles held by one S
};
/// Is S one of firn's classes (pack, dual, …), whose functions are friends that only unqualified names find?
template <class S>
inline constexpr bool has_friends = requires { scalar_traits<S>::has_friends; };

template <class S>
using value_type_t = typename scalar_traits<S>::value_type;

/// The type of a comparison of two S.
template <class S>
using mask_t = decltype(std::declval<const S&>() < std::declval<const S&>());

// clang-format off
template <class S>
concept has_arithmetic = requires(const S a, const S b) {
    { a + b } -> std::same_as<S>;  { a - b } -> std::same_as<S>;
    { a * b } -> std::same_as<S>;  { a / b } -> std::same_as<S>;
    { -a } -> std::same_as<S>;
};
template <class S>
concept has_literals = std::constructible_from<S, double> && std::constructible_from<S, int>;

template <class S>
concept has_select = requires(const S a, const S b) {
    { select(a < b, a, b) } -> std::same_as<S>;
    { select(a <= b, a, b) } -> std::same_as<S>;
    { any(a < b) } -> std::same_as<bool>;
};
template <class S>
concept has_roots = requires(const S a) {
    { sqrt(a) } -> std::same_as<S>;
    { abs(a) } -> std::same_as<S>;
};
// clang-format on

// The friends by their qualified names.

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

/// x. What a definition calls it: a scalar that records a program writes it under that name.
template <class S>
FIRN_INLINE constexpr const S& named(const char*, const S& x) {
    return x;
}

/// x. Marks a sum whose rounding is needed: (a + b) − a for the error of a + b. A scalar that writes a program sees to
/// it that compilers do not simplify it.
template <class S>
FIRN_INLINE constexpr const S& settled(const S& x) {
    return x;
}

/// A number type that every definition of firn can be evaluated with.
template <class S>
concept scalar = has_arithmetic<S> && has_literals<S> && has_select<S> && has_roots<S>;

template <scalar S>
FIRN_INLINE constexpr S min(const S& a, const S& b) {
    return select(b < a, b, a);
}
template <scalar S>
FIRN_INLINE constexpr S max(const S& a, const S& b) {
    return select(a < b, b, a);
}

}  // namespace firn
