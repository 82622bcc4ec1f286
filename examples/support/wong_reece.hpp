/// \file The law of Bekker, Wong and Reece for a driven rigid wheel in soil: what sinkage, pull and torque it predicts.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

namespace example {

/// What a soil does under a plate that sinks and one that shears.
struct SoilOfWheels {
    double exponent;              ///< n of Bekker's pressure (k_c/b + k_φ) zⁿ [1]
    double cohesive, frictional;  ///< k_c [N/m^(n+1)], k_φ [N/m^(n+2)]
    double cohesion;              ///< c [Pa]
    double friction_angle;        ///< φ [rad]
    double shear_length;          ///< K: over which shear stress grows, as 1 − exp(−j/K) [m]
    double c1, c2;                ///< the largest pressure is at c₁ + c₂ slip of the angle of entry [1]
};

/// The dry sand of the Land Locomotion Laboratory (Wong, "Theory of Ground Vehicles", table 2.3), whose K was not
/// measured: 1 cm to 2.5 cm are usual for firm to loose sand (there); c₁ and c₂ of compact and loose sand are from Wong
/// and Reece 1967, part I.
inline constexpr SoilOfWheels firm_sand{1.1, 990, 1528.43e3, 1040, 28 * std::numbers::pi / 180, 0.01, 0.43, 0.32},
    loose_sand{1.1, 990, 1528.43e3, 1040, 28 * std::numbers::pi / 180, 0.025, 0.18, 0.32};

/// A wheel's forces per width, in steady state.
struct WheelInSoil {
    double sinkage;  ///< [m]
    double load;     ///< vertical [N/m]
    double pull;     ///< drawbar pull: what the wheel pulls with beyond its own resistance [N/m]
    double torque;   ///< [N]
};

/// Integrates the stresses on the rim of a wheel that enters the soil at an angle [rad] before its lowest point and
/// leaves it there.
/// \param width  b of Bekker's pressure [m]
inline WheelInSoil wheel_that_enters(const SoilOfWheels& soil, double entry, double radius, double width, double slip) {
    const double modulus = (soil.cohesive / width + soil.frictional) * std::pow(radius, soil.exponent);
    const double middle = std::min(soil.c1 + soil.c2 * slip, 1.0) * entry;  // of the largest pressure
    WheelInSoil sum{radius * (1 - std::cos(entry)), 0, 0, 0};
    constexpr int parts = 2000;
    for (int k = 0; k < parts; ++k) {
        const double angle = (k + 0.5) / parts * entry;
        const double in_front = angle > middle ? angle : entry - angle / middle * (entry - middle);
        const double pressure = modulus * std::pow(std::cos(in_front) - std::cos(entry), soil.exponent);
        const double sheared = radius * ((entry - angle) - (1 - slip) * (std::sin(entry) - std::sin(angle)));
        const double shear =
            (soil.cohesion + pressure * std::tan(soil.friction_angle)) * (1 - std::exp(-sheared / soil.shear_length));
        const double arc = radius * entry / parts;
        sum.load += arc * (pressure * std::cos(angle) + shear * std::sin(angle));
        sum.pull += arc * (shear * std::cos(angle) - pressure * std::sin(angle));
        sum.torque += arc * radius * shear;
    }
    return sum;
}

/// Returns what a wheel under a load does at a slip. \param load  per width [N/m];  \see wheel_that_enters
inline WheelInSoil wheel_under_load(const SoilOfWheels& soil, double load, double radius, double width, double slip) {
    double low = 1e-6, high = 1.4;
    for (int halving = 0; halving < 60; ++halving) {
        const double entry = (low + high) / 2;
        (wheel_that_enters(soil, entry, radius, width, slip).load < load ? low : high) = entry;
    }
    return wheel_that_enters(soil, low, radius, width, slip);
}

}  // namespace example
