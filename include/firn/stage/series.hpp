/// \file The series of a transfer that refines velocities: what one node has of it in the end. \see refines_velocities
#pragma once

#include <firn/core/tensor.hpp>

namespace firn::inline FIRN_BUILD {

/// Returns the momentum of a node after the series [kg m/s].
/// \param v  the sum of the series [m/s];  \param mass  mass of the node [kg]
template <scalar S, int D>
FIRN_INLINE Vec<S, D> momentum_of_series(const Vec<S, D>& v, const S& mass) {
    return v * mass;
}
/// Returns the momentum of a node after a series whose terms mirrored walls have acted on. What they changed in the
/// first term is given back, so that the grid update sees the full impulse of the walls.
/// \param v       the sum of the series [m/s];  \param mass  mass of the node before walls act [kg]
/// \param before  the first term before walls act [m/s];  \param first  the first term [m/s]
template <scalar S, int D>
FIRN_INLINE Vec<S, D> momentum_of_series(const Vec<S, D>& v, const Vec<S, D>& before, const Vec<S, D>& first,
                                         const S& mass) {
    return (v + (before - first)) * mass;
}

}  // namespace firn::inline FIRN_BUILD
