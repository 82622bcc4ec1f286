/// \file An acceleration field: gravity, plus a pull towards (or a push away from) a point or a line.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/parameters.hpp>

#include <cmath>
#include <concepts>
#include <type_traits>

namespace firn::inline FIRN_BUILD {

/// An acceleration field: gravity, plus a pull towards (or a push away from) a point or a line.
///
///     g + s max(0, 1 − r/R) e       [m/s²]
///
/// g is gravity, s the `strength`. r is the distance to the centre, or to the line through the centre. e is the unit
/// vector towards the centre, or towards the nearest point of the line. R is the `radius`; for r > R there is only
/// gravity. Use an Attraction to let a user pull matter with the mouse: the line is then the line of sight through the
/// mouse pointer.
template <scalar S, int D>
struct Attraction {
    /// The scalar type of the centre: double if S is float or double, else S.
    using P = std::conditional_t<std::floating_point<S>, double, S>;

    Vec<S, D> gravity{};    ///< g: gravity [m/s²], which replaces that of the simulation
    Vec<P, D> centre{};     ///< the point of attraction, or a point on the line [m]
    Vec<S, D> direction{};  ///< unit vector along the line [1]; the zero vector: attraction to a point
    S radius = S(0.1);      ///< R: distance at which the attraction ends [m], positive
    S strength = S(0);      ///< s [m/s²]: positive attracts, negative repels

    static constexpr const char* name = "attraction";
    static constexpr auto parameters() {
        return std::tuple{
            parameter{"gravity", "m/s^2", &Attraction::gravity}, parameter{"centre", "m", &Attraction::centre},
            parameter{"direction", "1", &Attraction::direction}, parameter{"radius", "m", &Attraction::radius},
            parameter{"strength", "m/s^2", &Attraction::strength}};
    }

    /// Checks the parameters.
    /// \throws parameter_error unless the radius is positive, the length of the direction is 0 or differs from 1 by
    /// less than 1e-5, and all parameters are finite
    void check() const
        requires std::floating_point<S>
    {
        if (!(radius > 0) || !std::isfinite(radius) || !std::isfinite(strength))
            throw parameter_error(sentence("An attraction of radius ", radius, " m and strength ", strength,
                                           " m/s^2: both must be finite, and the radius positive."));
        const double length = norm(cast<double>(direction));
        if (!(length == 0 || std::abs(length - 1) < 1e-5))
            throw parameter_error(sentence("The direction of an attraction has the length ", length,
                                           "; it must be 1, or 0 for an attraction to a point."));
        if (!std::isfinite(norm(cast<double>(gravity)) + norm(centre)))
            throw parameter_error("The gravity and the centre of an attraction must be finite.");
    }

    /// Returns the field converted to scalar type T.
    template <class T>
    Attraction<T, D> lifted() const {
        using Q = typename Attraction<T, D>::P;
        return {cast<T>(gravity), cast<Q>(centre), cast<T>(direction), T(radius), T(strength)};
    }
    /// Returns the field for positions that are measured from `corner` [m].
    Attraction measured_from(const Vec<double, D>& corner) const
        requires std::floating_point<S>
    {
        Attraction there = *this;
        there.centre -= corner;
        return there;
    }

    /// Returns the acceleration [m/s²] at position x [m].
    FIRN_INLINE Vec<S, D> operator()(const Vec<S, D>& x) const {
        const Vec<S, D> to_centre = cast<S>(centre) - x;
        const Vec<S, D> there = to_centre - direction * dot(to_centre, direction);
        const S distance = named("distance", norm(there));
        const auto apart = S(0) < distance;
        const S pull = named("pull", strength * max(S(1) - distance / radius, S(0)));
        return gravity + there * select(apart, pull / select(apart, distance, S(1)), S(0));
    }
};

}  // namespace firn::inline FIRN_BUILD
