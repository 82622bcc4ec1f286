/// \file Angles, which say their unit: degrees(35), radians(0.6).
#pragma once

#include <firn/core/requirements.hpp>

#include <compare>
#include <numbers>

namespace firn {

/// A plane angle. A bare number is none: nobody could tell which unit it has.
class Angle {
public:
    constexpr Angle() = default;

    constexpr double in_radians() const { return radians_; }
    constexpr double in_degrees() const { return radians_ * 180 / std::numbers::pi; }

    friend constexpr Angle radians(double number);
    friend constexpr Angle degrees(double number);

    friend constexpr Angle operator+(Angle a, Angle b) { return Angle(a.radians_ + b.radians_); }
    friend constexpr Angle operator-(Angle a, Angle b) { return Angle(a.radians_ - b.radians_); }
    friend constexpr Angle operator-(Angle a) { return Angle(-a.radians_); }
    friend constexpr Angle operator*(Angle a, double factor) { return Angle(a.radians_ * factor); }
    friend constexpr Angle operator*(double factor, Angle a) { return a * factor; }
    friend constexpr Angle operator/(Angle a, double divisor) { return Angle(a.radians_ / divisor); }
    friend constexpr auto operator<=>(Angle, Angle) = default;

private:
    constexpr explicit Angle(double number) : radians_(number) {}
    double radians_ = 0;
};

constexpr Angle radians(double number) { return Angle(number); }
constexpr Angle degrees(double number) { return Angle(number * std::numbers::pi / 180); }

}  // namespace firn
