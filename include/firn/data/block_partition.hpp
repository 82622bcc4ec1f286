/// \file Blocks of cells, and which particles belong to which block. Colours, sparse grids and packs build on them.
#pragma once

#include <firn/data/domain.hpp>
#include <firn/data/field.hpp>

#include <algorithm>
#include <vector>

namespace firn {

/// Cells (and nodes) of a block along one axis.
inline constexpr int block_size = 4;

/// Cells (and nodes) of a block.
template <int D>
inline constexpr int block_nodes = D == 2 ? block_size * block_size : block_size * block_size * block_size;

/// How far [cells] a particle's base node may leave its block before particles must be sorted again.
inline constexpr int allowed_drift = 1;

/// Integer coordinates of a block: its lower corner lies block_size times as many cells from the domain's lower corner.
template <int D>
using BlockCoordinate = std::array<int, std::size_t(D)>;

/// A block's coordinates packed into one number, 21 bits per axis. Keys sort as the coordinates do.
template <int D>
std::uint64_t block_key(const BlockCoordinate<D>& block) {
    std::uint64_t key = 0;
    for (int a = 0; a < D; ++a) key = key << 21 | (std::uint64_t(block[std::size_t(a)] + (1 << 20)) & 0x1fffff);
    return key;
}
/// The coordinates of a block from its key.
template <int D>
BlockCoordinate<D> block_of_key(std::uint64_t key) {
    BlockCoordinate<D> block{};
    for (int a = D - 1; a >= 0; --a, key >>= 21) block[std::size_t(a)] = int(key & 0x1fffff) - (1 << 20);
    return block;
}

/// The remainder of a / n in [0, n), also for negative a.
constexpr int modulo(int a, int n) { return (a % n + n) % n; }

/// Number of blocks along a periodic axis; 0 if the axis is not periodic.
template <int D>
int block_period(const Domain<D>& domain, int axis) {
    return domain.periodic[std::size_t(axis)] ? domain.cells(axis) / block_size : 0;
}
/// True if the domain is periodic along any axis.
template <int D>
bool is_periodic(const Domain<D>& domain) {
    return std::find(domain.periodic.begin(), domain.periodic.end(), true) != domain.periodic.end();
}
/// Moves a block by whole periods along periodic axes, into the domain.
template <int D>
BlockCoordinate<D> wrapped(const Domain<D>& domain, BlockCoordinate<D> block) {
    for (int a = 0; a < D; ++a)
        if (const int n = block_period(domain, a); n > 0) block[std::size_t(a)] = modulo(block[std::size_t(a)], n);
    return block;
}
/// The same for the key of a block.
template <int D>
std::uint64_t wrapped_key(const Domain<D>& domain, std::uint64_t key) {
    return block_key<D>(wrapped(domain, block_of_key<D>(key)));
}
/// `from` − `to` along an axis [blocks]; along a periodic axis, the shorter way.
template <int D>
int block_distance(const Domain<D>& domain, int axis, int from, int to) {
    const int n = block_period(domain, axis), distance = from - to;
    if (n == 0) return distance;
    return distance > n / 2 ? distance - n : distance < -n / 2 ? distance + n : distance;
}

/// The position [m] of a place in a block, along one axis.
/// \param place  [cells], counted from the block's lower corner
template <int D>
double position_of_place(const Domain<D>& domain, const BlockCoordinate<D>& block, int axis, double place) {
    return domain.lower[axis] + domain.cell_size * (block_size * block[std::size_t(axis)] + place);
}

/// Blocks of a cube along one axis. Sparse blocks are worked through cube by cube.
inline constexpr int cube_blocks = 2;

/// Nodes along one axis of an arena: those that the particles of Blocks^D blocks can reach until they are sorted again.
template <class Kernel, int Blocks = 1>
inline constexpr int arena_size = Blocks * block_size + 2 * allowed_drift + Kernel::support - 1;

/// Number of colours of dense blocks along one axis. Blocks of one colour lie so many blocks apart that their arenas
/// never overlap.
template <class Kernel>
inline constexpr int colours_along_axis = (arena_size<Kernel> + block_size - 1) / block_size;

/// The colour of a block or of a cube, 0 to n^D − 1: its coordinates modulo n. Between two of one colour there
/// are n − 1 of other colours.
template <int D>
std::size_t block_colour(const BlockCoordinate<D>& block, int n) {
    std::size_t colour = 0;
    for (const int coordinate : block) colour = std::size_t(n) * colour + std::size_t(modulo(coordinate, n));
    return colour;
}

/// The particles whose base node lay in one block when they were sorted.
template <int D>
struct BlockRange {
    BlockCoordinate<D> block;  ///< the block
    std::size_t first_slot;    ///< slot of its first particle
    std::size_t particles;     ///< number of particles, from first_slot on
};

/// Sparse blocks of a cube that have no more particles than this together are spray. An arena for them would hold
/// mostly nodes that no particle reaches. So they scatter only to nodes that they reach, and gather in the grid.
inline constexpr std::size_t spray_particles = 64;

/// Particles that one worker scatters together: those of one dense block, or those of all sparse blocks of a cube,
/// which share packs. The rest of the last pack is padding. \see cube_blocks
struct BlockGroup {
    std::uint32_t first_range,  ///< the first of its ranges in BlockPartition::ranges
        ranges;                 ///< number of its ranges
    std::size_t first_slot;     ///< a multiple of pack_size
    std::size_t particles;      ///< number of particles, from first_slot on
    bool sparse;                ///< true if it consists of the sparse blocks of a cube

    /// Number of packs.
    std::size_t packs() const { return (particles + pack_size - 1) / pack_size; }
    /// True if the group is spray. \see spray_particles
    bool is_spray() const { return sparse && particles <= spray_particles; }
};

/// A block with no more particles than this is sparse. Its own packs would be mostly padding, and its own arena would
/// hold mostly nodes that no particle reaches.
inline constexpr std::size_t sparse_particles = 24;

/// Particles sorted by block: the range of slots of each block, the groups of ranges that are scattered together, and
/// the phases in which groups are scattered.
template <int D>
struct BlockPartition {
    std::vector<BlockRange<D>> ranges;    ///< dense blocks by block, then sparse ones by phase, cube and block
    std::vector<BlockGroup> groups;       ///< in the order of their ranges
    std::vector<std::uint32_t> by_block;  ///< numbers of ranges, sorted by block
    /// Numbers of groups, phase by phase. Groups of one phase never share a node. If two groups share a node, the same
    /// one always comes first.
    std::vector<std::uint32_t> by_phase;
    std::vector<std::size_t> phase_ends;  ///< end of each phase in by_phase
    /// The particle of each slot, or no_particle: its old slot, or its id once particles lie in this order.
    aligned_vector<std::uint32_t> order;
    std::size_t particles = 0;  ///< number of particles
    /// Where its ranges begin in the grid's table of neighbours. Not 0 if several sets share a grid.
    std::size_t first_row = 0;

    /// Number of slots: particles and padding.
    std::size_t slots() const { return order.size(); }
};

/// The kernel's base node along one axis. The fractional position is f = x/h − base.
/// \param x      position from the domain's lower corner [cells]
/// \param shift  the kernel's base_shift
template <scalar S>
FIRN_INLINE S base_node(const S& x, const S& shift) {
    return floor(x - shift);
}
/// The same for a given kernel.
template <class Kernel, scalar S>
FIRN_INLINE S base_node(const S& x) {
    return base_node(x, S(Kernel::base_shift));
}

}  // namespace firn
