/// \file What one particle tells a material that asks for its surroundings.
#pragma once

#include <firn/material/surroundings.hpp>

namespace firn::inline FIRN_BUILD {

/// Returns the position x of a particle [m], from where it is counted.
/// \param lower  lower corner of the domain [m]
/// \param block  lower corner of the particle's block [cells from the domain's lower corner]
/// \param place  position relative to this corner [cells]
/// \param cell_size  h [m]
template <scalar S, int D>
FIRN_INLINE Vec<S, D> position_of(const Vec<S, D>& lower, const Vec<S, D>& block, const Vec<S, D>& place,
                                  const S& cell_size) {
    return lower + (block + place) * cell_size;
}

/// Returns the surroundings of a particle. \see Surroundings
/// \param position  x [m];  \param velocity  of the nodes around it, or its own [m/s]
/// \param mass, volume  [kg], [m^D]; both may be zero in a lane of padding
/// \param cell_size  h [m];  \param time  t [s]
template <scalar S, int D>
FIRN_INLINE Surroundings<S, D> surroundings_of(const Vec<S, D>& position, const Vec<S, D>& velocity, const S& mass,
                                               const S& volume, const S& cell_size, const S& time) {
    const auto real = mass > S(0);
    return {position, velocity, cell_size, time, select(real, mass, S(1)) / select(real, volume, S(1))};
}

}  // namespace firn::inline FIRN_BUILD
