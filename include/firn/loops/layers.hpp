/// \file The layers of a grid by name: what passes keep of the nodes besides their present numbers. \see
/// SparseGrid::layer
#pragma once

#include <firn/transfer/concept.hpp>

#include <cstddef>

namespace firn::inline FIRN_BUILD::layer {

/// Transfers that blend velocities: the velocities before forces act, from before P2G to G2P.
inline constexpr std::size_t before_forces = 1;

/// FMPM, while it refines velocities: v_1, the first term of the series; v_j, the sum of the first j terms; and v_1
/// before walls act.
inline constexpr std::size_t first_of_series = 1;
inline constexpr std::size_t last_of_series = 2;      ///< v_j.
inline constexpr std::size_t first_before_walls = 3;  ///< v_1 before walls act.

/// Contact beside mirrored walls, while groups meet: the momenta before walls mirror them, and afterwards.
inline constexpr std::size_t before_mirroring = 2;
inline constexpr std::size_t mirrored = 3;  ///< The momenta after walls have mirrored them.

/// Volumetric policies that average: the velocities and masses, and the masses while averages ride in their place.
template <class Transfer>
inline constexpr std::size_t of_volumes = blends_velocities<Transfer> ? 2 : 1;

// Layers that hold something at the same time have different numbers.
static_assert(before_forces != before_mirroring && before_forces != mirrored);

}  // namespace firn::inline FIRN_BUILD::layer
