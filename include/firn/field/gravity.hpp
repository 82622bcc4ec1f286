/// \file Gravity: the same acceleration everywhere.
#pragma once

#include <firn/core/parameters.hpp>

namespace firn::inline FIRN_BUILD {

/// An acceleration field with the same acceleration everywhere: gravity.
///
/// An acceleration field is a function object. firn calls the function object with a position [m], or with a position,
/// a velocity [m/s] and a time step [s]. The function object returns an acceleration [m/s²]. \see acceleration_at
template <scalar S, int D>
struct Gravity {
    Vec<S, D> gravity{};  ///< the acceleration of gravity [m/s²]

    static constexpr const char* name = "gravity";
    static constexpr auto parameters() { return std::tuple{parameter{"gravity", "m/s^2", &Gravity::gravity}}; }

    /// Returns the field for positions that are measured from another point: the same.
    Gravity measured_from(const Vec<double, D>&) const { return *this; }
    /// Returns the acceleration [m/s²], the same at every position.
    FIRN_INLINE Vec<S, D> operator()(const Vec<S, D>&) const { return gravity; }
};

}  // namespace firn::inline FIRN_BUILD
