/// \file A scalar that can do only what every scalar can: evaluate a policy with it and the compiler names, in a
/// sentence, what would not run in SIMD lanes or on a GPU. For tests of policies; `firn::check_policy` uses it.
#pragma once

#include <firn/core/bits.hpp>
#include <firn/core/scalar.hpp>

namespace firn {

template <std::floating_point T>
struct strict {
    struct mask {
        bool bit;
        friend constexpr mask operator&(mask a, mask b) { return {a.bit && b.bit}; }
        friend constexpr mask operator|(mask a, mask b) { return {a.bit || b.bit}; }
        friend constexpr mask operator!(mask a) { return {!a.bit}; }
        friend constexpr bool any(mask m) { return m.bit; }

        template <class M = mask>
        explicit constexpr operator bool() const {
            return detail::refuse_to_branch<M>();
        }
    };

    T value;

    strict() = default;
    template <class U>
        requires std::is_arithmetic_v<U>
    constexpr strict(U v) : value(T(v)) {}

    friend constexpr strict operator+(strict a, strict b) { return a.value + b.value; }
    friend constexpr strict operator-(strict a, strict b) { return a.value - b.value; }
    friend constexpr strict operator*(strict a, strict b) { return a.value * b.value; }
    friend constexpr strict operator/(strict a, strict b) { return a.value / b.value; }
    friend constexpr strict operator-(strict a) { return -a.value; }
    constexpr strict& operator+=(strict b) { return *this = *this + b; }
    constexpr strict& operator-=(strict b) { return *this = *this - b; }
    constexpr strict& operator*=(strict b) { return *this = *this * b; }

    friend constexpr mask operator<(strict a, strict b) { return {a.value < b.value}; }
    friend constexpr mask operator<=(strict a, strict b) { return {a.value <= b.value}; }
    friend constexpr mask operator>(strict a, strict b) { return {a.value > b.value}; }
    friend constexpr mask operator>=(strict a, strict b) { return {a.value >= b.value}; }
    friend constexpr mask operator==(strict a, strict b) { return {a.value == b.value}; }

    friend constexpr strict select(mask m, strict a, strict b) { return m.bit ? a : b; }
    friend strict sqrt(strict a) { return std::sqrt(a.value); }
    friend constexpr strict abs(strict a) { return a.value < T(0) ? -a.value : a.value; }
    friend strict floor(strict a) { return std::floor(a.value); }
    friend strict power_of_two(strict a) { return firn::power_of_two(a.value); }
    friend strict exponent_of(strict a) { return firn::exponent_of(a.value); }
    friend strict significand_of(strict a) { return firn::significand_of(a.value); }
    friend strict leading_half(strict a) { return firn::leading_half(a.value); }
};

template <class T>
struct scalar_traits<strict<T>> {
    using value_type = T;
    static constexpr int lanes = 1;
    static constexpr bool has_friends = true;
};

}  // namespace firn
