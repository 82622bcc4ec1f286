/// \file The friction angle of granular matter, and the slope of its yield cone.
#pragma once

#include <firn/core/angle.hpp>
#include <firn/core/error.hpp>
#include <firn/core/scalar.hpp>

#include <cmath>
#include <numbers>

namespace firn::inline FIRN_BUILD {

/// Returns the slope α [1] of the Drucker–Prager cone ‖dev τ‖ + α tr τ ≤ 0, from the sine of the friction angle φ. τ is
/// the Kirchhoff stress, negative under compression.
///
/// In 3D α = √(2/3) 2 sin φ / (3 − sin φ): the cone touches the Mohr–Coulomb pyramid in triaxial compression (Klár et
/// al. 2016, "Drucker-Prager elastoplasticity for sand animation", §4.3). In 2D α = sin φ / √2: the cone and the
/// pyramid coincide.
/// \tparam D  the number of dimensions
/// \param sine  sine of the friction angle φ [1]
template <int D, scalar S>
FIRN_INLINE S friction_slope(const S& sine) {
    if constexpr (D == 3)
        return S(2 * 0.81649658092772603273) * sine / (S(3) - sine);
    else
        return S(1 / std::numbers::sqrt2) * sine;
}

/// Returns the given friction angle φ, after a check of its value.
/// \throws parameter_error unless 0° ≤ φ < 90°
inline Angle check_friction_angle(Angle angle) {
    if (!(angle >= degrees(0) && angle < degrees(90)))
        throw parameter_error(sentence("The friction angle is ", angle.in_degrees(),
                                       " degrees; it must be at least 0 and below 90. Dry sand has 30 to 40."));
    return angle;
}

}  // namespace firn::inline FIRN_BUILD
