/// \file The same acceleration everywhere.
#pragma once

#include <firn/core/parameters.hpp>

namespace firn {

/// A field of acceleration is a policy that is called with a position [m], or with position, velocity [m/s] and time
/// step [s], and returns an acceleration [m/s²].
template <scalar S, int D>
struct Gravity {
    Vec<S, D> gravity{};  ///< [m/s²]

    static constexpr const char* name = "gravity";
    static constexpr auto parameters() { return std::tuple{parameter{"gravity", "m/s^2", &Gravity::gravity}}; }

    FIRN_INLINE Vec<S, D> operator()(const Vec<S, D>&) const { return gravity; }
};

}  // namespace firn
