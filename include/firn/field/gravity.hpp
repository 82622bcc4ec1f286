/// \file Gravity: the same acceleration everywhere.
#pragma once

#include <firn/core/parameters.hpp>

namespace firn {

/// The same acceleration everywhere: gravity.
///
/// An acceleration field is a policy that is called with a position [m], or with position, velocity [m/s] and time step
/// [s], and returns an acceleration [m/s²]. \see acceleration_at
template <scalar S, int D>
struct Gravity {
    Vec<S, D> gravity{};  ///< the acceleration [m/s²]

    static constexpr const char* name = "gravity";
    static constexpr auto parameters() { return std::tuple{parameter{"gravity", "m/s^2", &Gravity::gravity}}; }

    /// The acceleration at any position [m/s²].
    FIRN_INLINE Vec<S, D> operator()(const Vec<S, D>&) const { return gravity; }
};

}  // namespace firn
