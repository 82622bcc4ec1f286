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
    std::size_t first_slot;
    std::size_t particles;  ///< from first_slot on
};

/// What is worked through at once: the particles of one block, or those of several blocks of one colour that have few
/// particles each and share packs. The rest of the last pack is padding.
struct BlockGroup {
    std::uint32_t first_range, ranges;
    std::size_t first_slot;  ///< a multiple of pack_size
    std::size_t particles;   ///< from first_slot on

    std::size_t packs() const { return (particles + pack_size - 1) / pack_size; }
};

/// Blocks with no more particles than this share packs, as many as make up a group of at most most_grouped.
inline constexpr std::size_t few_particles = 24, most_grouped = 64;

template <int D>
struct BlockPartition {
    static constexpr int colour_count = 1 << D;

    std::vector<BlockRange<D>> ranges;    ///< blocks of many particles by block, then those of few by colour and block
    std::vector<BlockGroup> groups;       ///< in the order of their ranges
    std::vector<std::uint32_t> by_block;  ///< numbers of ranges, sorted by block
    std::array<std::vector<std::uint32_t>, std::size_t(colour_count)> colours;  ///< numbers of groups, a colour each
    std::vector<std::uint32_t>
        order;  ///< particle of each slot (its id, once particles lie in this order), or no_particle
    std::size_t particles = 0;

    std::size_t slots() const { return order.size(); }
};

/// Groups and slots for blocks of which only the counts of particles are known; the order is empty.
/// \param sorted  by block, each once, with at least one particle
template <int D>
BlockPartition<D> arrange(const std::vector<BlockRange<D>>& sorted) {
    BlockPartition<D> partition;
    const std::size_t count = sorted.size();
    partition.ranges.resize(count);
    partition.by_block.resize(count);

    constexpr std::size_t many = BlockPartition<D>::colour_count;  // a place before the colours of the small ones
    const auto place_of = [&](const BlockRange<D>& range) {
        return range.particles > few_particles ? 0 : 1 + block_colour<D>(range.block);
    };
    std::array<std::size_t, many + 2> first{};
    for (const BlockRange<D>& range : sorted) ++first[place_of(range) + 1];
    for (std::size_t p = 0; p <= many; ++p) first[p + 1] += first[p];
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t r = first[place_of(sorted[i])]++;
        partition.ranges[r] = sorted[i];
        partition.by_block[i] = std::uint32_t(r);
    }

    std::size_t slots = 0;
    for (std::size_t r = 0; r < count;) {
        BlockGroup group{std::uint32_t(r), 0, slots, 0};
        const std::size_t colour = block_colour<D>(partition.ranges[r].block);
        const auto fits = [&](const BlockRange<D>& range) {
            return group.ranges == 0 ||
                   (range.particles <= few_particles && group.particles + range.particles <= most_grouped &&
                    block_colour<D>(range.block) == colour);
        };
        const bool alone = partition.ranges[r].particles > few_particles;
        do {
            partition.ranges[r].first_slot = slots + group.particles;
            group.particles += partition.ranges[r].particles;
            ++group.ranges;
            ++r;
        } while (!alone && r < count && fits(partition.ranges[r]));
        slots += group.packs() * pack_size;
        partition.particles += group.particles;
        partition.colours[colour].push_back(std::uint32_t(partition.groups.size()));
        partition.groups.push_back(group);
    }
    partition.order.assign(slots, no_particle);
    return partition;
}

/// The kernel's base node along one axis, and the fractional position f = x/h − base.
/// \param x  position from the domain's lower corner, in cells
template <class Kernel, scalar S>
FIRN_INLINE S base_node(const S& x) {
    return floor(x - S(Kernel::base_shift));
}

}  // namespace firn
