/// \file A curve through all cubes of blocks (Morton, 1966), which gives every cube a place in one order. Cubes that
/// are near each other on the curve are mostly near each other in space.
#pragma once

#include <firn/data/block_partition.hpp>

#include <cstdint>

namespace firn::inline FIRN_BUILD {

/// Returns the coordinates of the cube (cube_blocks blocks along each axis) to which a block belongs.
template <int D>
BlockCoordinate<D> cube_of(BlockCoordinate<D> block) {
    static_assert(cube_blocks == 2);
    for (int& coordinate : block) coordinate >>= 1;
    return block;
}

namespace detail {
/// Moves bit i of the lowest 21 bits (in 2D: of the lowest 32 bits) of x to bit D i.
template <int D>
constexpr std::uint64_t spread_bits(std::uint64_t x) {
    if constexpr (D == 2) {
        x = (x | x << 16) & 0x0000ffff0000ffffull;
        x = (x | x << 8) & 0x00ff00ff00ff00ffull;
        x = (x | x << 4) & 0x0f0f0f0f0f0f0f0full;
        x = (x | x << 2) & 0x3333333333333333ull;
        return (x | x << 1) & 0x5555555555555555ull;
    } else {
        x = (x | x << 32) & 0x001f00000000ffffull;
        x = (x | x << 16) & 0x001f0000ff0000ffull;
        x = (x | x << 8) & 0x100f00f00f00f00full;
        x = (x | x << 4) & 0x10c30c30c30c30c3ull;
        return (x | x << 2) & 0x1249249249249249ull;
    }
}
}  // namespace detail

/// Returns a cube's place on the curve: its Morton key, in which the bits of the coordinates alternate. The first axis
/// has the highest bit of each group of D bits.
///
/// Cubes are counted from −1, because particles beside the lower wall of a domain have base nodes and blocks at −1. If
/// they were counted from 0, all cubes at −1 would be far from their neighbours on the curve, and one rank would own a
/// thin sheet along the whole wall.
/// \param cube  coordinates of the cube, each from −2¹⁹ to 2¹⁹ − 2. \see cube_of
template <int D>
std::uint64_t curve_key(const BlockCoordinate<D>& cube) {
    std::uint64_t key = 0;
    for (int a = 0; a < D; ++a)
        key = key << 1 | detail::spread_bits<D>(std::uint64_t(cube[std::size_t(a)] + 1 + (1 << 19)));
    return key;
}

/// Number of bits of a curve_key().
template <int D>
inline constexpr int curve_key_bits = 20 * D;

/// Returns whether block `one` comes before block `other` along the curve. The blocks of a cube follow each other, in
/// the order of their keys.
template <int D>
bool before_on_curve(const BlockCoordinate<D>& one, const BlockCoordinate<D>& other) {
    const std::uint64_t cube = curve_key<D>(cube_of<D>(one)), other_cube = curve_key<D>(cube_of<D>(other));
    return cube != other_cube ? cube < other_cube : block_key<D>(one) < block_key<D>(other);
}

}  // namespace firn::inline FIRN_BUILD
