/// \file No average of the volume change: every particle resists its own.
#pragma once

#include <firn/volumetric/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// The default: the velocity gradient of a particle updates its material state unchanged. Nearly incompressible solids,
/// and plastic flow without volume change, lock. \see FBar
struct OwnVolume {
    static constexpr const char* name = "own_volume";
    static constexpr bool averages_volume = false;  ///< A particle keeps its own rate of volume change.
};

static_assert(volumetric<OwnVolume>);

}  // namespace firn::inline FIRN_BUILD
