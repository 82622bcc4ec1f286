/// \file Angles with a unit: degrees(35), radians(0.6).
#pragma once

#include <firn/core/requirements.hpp>

#include <compare>
#include <numbers>
#include <type_traits>

namespace firn::inline FIRN_BUILD {

/// A plane angle. Make it with degrees() or radians(): a number alone does not compile, since it has no unit.
class Angle {
public:
    constexpr Angle() = default;  ///< Makes the angle 0.
    /// Stops the compilation with a message, since a plain number has no unit.
    template <class Number>
        requires std::is_arithmetic_v<Number>
    constexpr Angle(Number) {
        static_assert(!std::is_arithmetic_v<Number>,
                      "firn: an angle says its unit: write firn::degrees(35) or firn::radians(0.6).");
    }

    constexpr double in_radians() const { return radians_; }                           ///< Returns the angle [rad].
    constexpr double in_degrees() const { return radians_ * 180 / std::numbers::pi; }  ///< Returns the angle [°].

    /// radians(number) returns the angle of `number` radians, and degrees(number) returns that of `number` degrees.
    /// @{
    friend constexpr Angle radians(double number);
    friend constexpr Angle degrees(double number);
    /// @}

    /// Returns the sum or difference of two angles, the angle with the opposite sign, or a multiple of an angle.
    /// @{
    friend constexpr Angle operator+(Angle a, Angle b) { return of(a.radians_ + b.radians_); }
    friend constexpr Angle operator-(Angle a, Angle b) { return of(a.radians_ - b.radians_); }
    friend constexpr Angle operator-(Angle a) { return of(-a.radians_); }
    friend constexpr Angle operator*(Angle a, double factor) { return of(a.radians_ * factor); }
    friend constexpr Angle operator*(double factor, Angle a) { return a * factor; }
    friend constexpr Angle operator/(Angle a, double divisor) { return of(a.radians_ / divisor); }
    /// @}

    /// Compares the values of two angles. Full turns count: 0° is less than 360°.
    friend constexpr auto operator<=>(Angle, Angle) = default;

private:
    static constexpr Angle of(double number) {
        Angle angle;
        angle.radians_ = number;
        return angle;
    }
    double radians_ = 0;
};

/// Returns the angle of `number` radians.
constexpr Angle radians(double number) { return Angle::of(number); }
/// Returns the angle of `number` degrees.
constexpr Angle degrees(double number) { return Angle::of(number * std::numbers::pi / 180); }

}  // namespace firn::inline FIRN_BUILD
