/// \file A scalar for tests of policies, with only those operations that every scalar has.
///
/// If a policy does something that cannot run in SIMD lanes or on a GPU, the compiler says so in a sentence when the
/// policy is evaluated with this scalar. `firn::check_policy` uses this scalar.
#pragma once

#include <firn/core/bits.hpp>
#include <firn/core/scalar.hpp>

namespace firn::inline FIRN_BUILD {

/// A float or double with only those operations that every scalar has.
template <std::floating_point T>
struct strict {
    /// The result of a comparison, which is on (true) or off (false). A mask does not convert to bool.
    struct mask {
        bool bit;  ///< whether the mask is on
        /// Logical operators: a and b, a or b, not a.
        /// @{
        friend constexpr mask operator&(mask a, mask b) { return {a.bit && b.bit}; }
        friend constexpr mask operator|(mask a, mask b) { return {a.bit || b.bit}; }
        friend constexpr mask operator!(mask a) { return {!a.bit}; }
        /// @}

        /// Whether the mask is on.
        friend constexpr bool any(mask m) { return m.bit; }

        /// Conversion to bool. It stops the compilation with a message, since a policy cannot branch on a comparison of
        /// scalars.
        template <class M = mask>
        explicit constexpr operator bool() const {
            return detail::refuse_to_branch<M>();
        }
    };

    T value;  ///< the number

    strict() = default;  ///< Leaves the number uninitialised.
    /// Makes a strict scalar from a number.
    template <class U>
        requires std::is_arithmetic_v<U>
    constexpr strict(U v) : value(T(v)) {}

    /// Arithmetic operators. They give the same results as the operators of T.
    /// @{
    friend constexpr strict operator+(strict a, strict b) { return a.value + b.value; }
    friend constexpr strict operator-(strict a, strict b) { return a.value - b.value; }
    friend constexpr strict operator*(strict a, strict b) { return a.value * b.value; }
    friend constexpr strict operator/(strict a, strict b) { return a.value / b.value; }
    friend constexpr strict operator-(strict a) { return -a.value; }
    constexpr strict& operator+=(strict b) { return *this = *this + b; }
    constexpr strict& operator-=(strict b) { return *this = *this - b; }
    constexpr strict& operator*=(strict b) { return *this = *this * b; }
    /// @}

    /// Comparisons, which return a mask.
    /// @{
    friend constexpr mask operator<(strict a, strict b) { return {a.value < b.value}; }
    friend constexpr mask operator<=(strict a, strict b) { return {a.value <= b.value}; }
    friend constexpr mask operator>(strict a, strict b) { return {a.value > b.value}; }
    friend constexpr mask operator>=(strict a, strict b) { return {a.value >= b.value}; }
    friend constexpr mask operator==(strict a, strict b) { return {a.value == b.value}; }
    /// @}

    /// Functions that every scalar has. They are documented in core/scalar.hpp and core/bits.hpp.
    /// @{
    friend constexpr strict select(mask m, strict a, strict b) { return m.bit ? a : b; }
    friend strict sqrt(strict a) { return std::sqrt(a.value); }
    friend constexpr strict abs(strict a) { return a.value < T(0) ? -a.value : a.value; }
    friend strict floor(strict a) { return std::floor(a.value); }
    friend strict power_of_two(strict a) { return firn::power_of_two(a.value); }
    friend strict exponent_of(strict a) { return firn::exponent_of(a.value); }
    friend strict significand_of(strict a) { return firn::significand_of(a.value); }
    friend strict leading_half(strict a) { return firn::leading_half(a.value); }
    friend constexpr mask same_bits(strict a, strict b) { return {firn::same_bits(a.value, b.value)}; }
    /// @}
};

/// Traits of a strict scalar, which has one lane with a number of type T.
template <class T>
struct scalar_traits<strict<T>> {
    using value_type = T;                      ///< type of the numbers: float or double
    static constexpr int lanes = 1;            ///< number of lanes
    static constexpr bool has_friends = true;  ///< makes `firn::has_friends<S>` true for strict scalars
};

}  // namespace firn::inline FIRN_BUILD
