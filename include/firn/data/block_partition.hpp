/// \file Which particles belong to which block of cells: what colouring, sparse grids and packs rest on.
#pragma once

#include <firn/data/domain.hpp>
#include <firn/data/field.hpp>

#include <vector>

namespace firn {

/// Cells (and nodes) a block along one axis.
inline constexpr int block_size = 4;

template <int D>
inline constexpr int block_nodes = D == 2 ? block_size * block_size : block_size * block_size * block_size;

/// How far, in cells, a particle's base node may leave its block before particles must be sorted again.
inline constexpr int allowed_drift = 1;

template <int D>
using BlockCoordinate = std::array<int, std::size_t(D)>;

/// Coordinates packed into one number, 21 bits an axis; sorts as the coordinates do.
template <int D>
std::uint64_t block_key(const BlockCoordinate<D>& block) {
    std::uint64_t key = 0;
    for (int a = 0; a < D; ++a) key = key << 21 | (std::uint64_t(block[std::size_t(a)] + (1 << 20)) & 0x1fffff);
    return key;
}
template <int D>
BlockCoordinate<D> block_of_key(std::uint64_t key) {
    BlockCoordinate<D> block{};
    for (int a = D - 1; a >= 0; --a, key >>= 21) block[std::size_t(a)] = int(key & 0x1fffff) - (1 << 20);
    return block;
}

/// The colour of a block, 0 to 2^D − 1: whether each coordinate is odd. Blocks of one colour lie two blocks apart.
template <int D>
std::size_t block_colour(const BlockCoordinate<D>& block) {
    std::size_t colour = 0;
    for (const int coordinate : block) colour = 2 * colour + std::size_t(coordinate & 1);
    return colour;
}

/// The particles whose base node lay in one block when they were sorted.
template <int D>
struct BlockRange {
    BlockCoordinate<D> block;
    std::size_t first_slot;  ///< a multiple of pack_size
    std::size_t particles;   ///< from first_slot on; the rest of the last pack is padding

    std::size_t packs() const { return (particles + pack_size - 1) / pack_size; }
};

template <int D>
struct BlockPartition {
    static constexpr int colour_count = 1 << D;

    std::vector<BlockRange<D>> ranges;                                          ///< sorted by block
    std::array<std::vector<std::uint32_t>, std::size_t(colour_count)> colours;  ///< numbers of ranges, a colour each
    std::vector<std::uint32_t>
        order;  ///< particle of each slot (its id, once particles lie in this order), or no_particle
    std::size_t particles = 0;

    std::size_t slots() const { return order.size(); }
};

/// The kernel's base node along one axis, and the fractional position f = x/h − base.
/// \param x  position from the domain's lower corner, in cells
template <class Kernel, scalar S>
FIRN_INLINE S base_node(const S& x) {
    return floor(x - S(Kernel::base_shift));
}

}  // namespace firn
