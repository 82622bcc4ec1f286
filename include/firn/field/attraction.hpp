/// \file Gravity, and a pull towards a point or a line (or a push away): what a user does with a pointer.
#pragma once

#include <firn/core/parameters.hpp>

namespace firn {

/// g + s (1 − r/R) e within the radius R, where r is the distance from the centre, or from the line through it, and e
/// points there.
template <scalar S, int D>
struct Attraction {
    Vec<S, D> gravity{};    ///< [m/s²]
    Vec<S, D> centre{};     ///< [m]
    Vec<S, D> direction{};  ///< of the line, of unit length [1]; zero: there is only the point
    S radius = S(0.1);      ///< R [m], positive
    S strength = S(0);      ///< s [m/s²]: positive attracts, negative repels

    static constexpr const char* name = "attraction";
    static constexpr auto parameters() {
        return std::tuple{
            parameter{"gravity", "m/s^2", &Attraction::gravity}, parameter{"centre", "m", &Attraction::centre},
            parameter{"direction", "1", &Attraction::direction}, parameter{"radius", "m", &Attraction::radius},
            parameter{"strength", "m/s^2", &Attraction::strength}};
    }

    FIRN_INLINE Vec<S, D> operator()(const Vec<S, D>& x) const {
        const Vec<S, D> to_centre = centre - x;
        const Vec<S, D> there = to_centre - direction * dot(to_centre, direction);
        const S distance = named("distance", norm(there));
        const auto apart = S(0) < distance;
        const S pull = named("pull", strength * max(S(1) - distance / radius, S(0)));
        return gravity + there * select(apart, pull / select(apart, distance, S(1)), S(0));
    }
};

}  // namespace firn
