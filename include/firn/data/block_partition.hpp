/// \file Blocks of cells, and lists of the particles in each block. Parallel scattering, sparse grids and packs of
/// particles all use these blocks.
#pragma once

#include <firn/data/domain.hpp>
#include <firn/data/field.hpp>

#include <algorithm>
#include <vector>

namespace firn {

/// Number of cells (and of nodes) of a block along one axis.
inline constexpr int block_size = 4;

/// Number of cells (and of nodes) of a block in D dimensions.
template <int D>
inline constexpr int block_nodes = D == 2 ? block_size * block_size : block_size * block_size * block_size;

/// The maximum distance [cells] of a particle's base node from the particle's block. Beyond it, particles must be
/// sorted again.
inline constexpr int allowed_drift = 1;

/// Integer coordinates of a block. Multiplied by block_size, they are the position [cells] of the block's lower corner,
/// counted from the domain's lower corner.
template <int D>
using BlockCoordinate = std::array<int, std::size_t(D)>;

/// Packs a block's coordinates into one integer, the block's key, with 21 bits per axis. The first axis has the highest
/// bits, so keys are sorted as the coordinates are.
template <int D>
std::uint64_t block_key(const BlockCoordinate<D>& block) {
    std::uint64_t key = 0;
    for (int a = 0; a < D; ++a) key = key << 21 | (std::uint64_t(block[std::size_t(a)] + (1 << 20)) & 0x1fffff);
    return key;
}
/// Returns the coordinates of the block that has this key.
template <int D>
BlockCoordinate<D> block_of_key(std::uint64_t key) {
    BlockCoordinate<D> block{};
    for (int a = D - 1; a >= 0; --a, key >>= 21) block[std::size_t(a)] = int(key & 0x1fffff) - (1 << 20);
    return block;
}

/// Returns the remainder of a / n in [0, n), also for negative a.
constexpr int modulo(int a, int n) { return (a % n + n) % n; }

/// Returns the number of blocks along a periodic axis, or 0 if the axis is not periodic.
template <int D>
int block_period(const Domain<D>& domain, int axis) {
    return domain.periodic[std::size_t(axis)] ? domain.cells(axis) / block_size : 0;
}
/// True if at least one axis of the domain is periodic.
template <int D>
bool is_periodic(const Domain<D>& domain) {
    return std::find(domain.periodic.begin(), domain.periodic.end(), true) != domain.periodic.end();
}
/// Returns the coordinates of a block after it was moved into the domain by whole periods along the periodic axes.
/// Along the other axes coordinates stay as they are.
template <int D>
BlockCoordinate<D> wrapped(const Domain<D>& domain, BlockCoordinate<D> block) {
    for (int a = 0; a < D; ++a)
        if (const int n = block_period(domain, a); n > 0) block[std::size_t(a)] = modulo(block[std::size_t(a)], n);
    return block;
}
/// Returns the key of a block after the block was moved into the domain by wrapped().
/// \param key  the block's key before
template <int D>
std::uint64_t wrapped_key(const Domain<D>& domain, std::uint64_t key) {
    return block_key<D>(wrapped(domain, block_of_key<D>(key)));
}
/// Returns `from` − `to` [blocks], the difference of two blocks' coordinates along an axis. Along a periodic axis it is
/// measured the shorter way round.
template <int D>
int block_distance(const Domain<D>& domain, int axis, int from, int to) {
    const int n = block_period(domain, axis), distance = from - to;
    if (n == 0) return distance;
    return distance > n / 2 ? distance - n : distance < -n / 2 ? distance + n : distance;
}

/// Returns the position [m], along one axis, of a point that is given by a block and the point's place in that block.
/// \param place  position within the block [cells], counted from the block's lower corner
template <int D>
double position_of_place(const Domain<D>& domain, const BlockCoordinate<D>& block, int axis, double place) {
    return domain.lower[axis] + domain.cell_size * (block_size * block[std::size_t(axis)] + place);
}

/// Number of blocks of a cube along one axis. Sparse blocks are scattered cube by cube.
inline constexpr int cube_blocks = 2;

/// Number of nodes of an arena along one axis. An arena has all nodes to which the particles of Blocks^D blocks can
/// scatter before they must be sorted again.
/// \tparam Blocks  number of blocks along one axis
template <class Kernel, int Blocks = 1>
inline constexpr int arena_size = Blocks * block_size + 2 * allowed_drift + Kernel::support - 1;

/// Number of colours of dense blocks along one axis. Blocks of the same colour are at least this many blocks apart, so
/// their arenas never overlap.
template <class Kernel>
inline constexpr int colours_along_axis = (arena_size<Kernel> + block_size - 1) / block_size;

/// Returns the colour of a block or a cube, 0 to n^D − 1, from its coordinates modulo n. Along an axis, there are n − 1
/// blocks of other colours between two blocks of the same colour.
/// \param n  number of colours along one axis
template <int D>
std::size_t block_colour(const BlockCoordinate<D>& block, int n) {
    std::size_t colour = 0;
    for (const int coordinate : block) colour = std::size_t(n) * colour + std::size_t(modulo(coordinate, n));
    return colour;
}

/// The particles whose base nodes lay in one block when particles were last sorted. Their slots are consecutive.
template <int D>
struct BlockRange {
    BlockCoordinate<D> block;  ///< coordinates of the block
    std::size_t first_slot;    ///< slot of the block's first particle
    std::size_t particles;     ///< number of particles
};

/// The largest number of particles in a group of sparse blocks that is treated as spray. Most nodes of the group's
/// arena would stay empty. Therefore P2G clears and adds to the grid only the nodes of the arena that spray scatters
/// to, and G2P reads the nodes from the grid, without an arena.
inline constexpr std::size_t spray_particles = 64;

/// Particles that one worker scatters together: those of one dense block, or those of all sparse blocks of a cube. The
/// sparse blocks of a cube share packs. The rest of the group's last pack is padding. \see cube_blocks
struct BlockGroup {
    std::uint32_t first_range,  ///< index of the group's first range in BlockPartition::ranges
        ranges;                 ///< number of the group's ranges
    std::size_t first_slot;     ///< slot of the group's first particle, a multiple of pack_size
    std::size_t particles;      ///< number of particles; their slots are consecutive
    bool sparse;                ///< true: the sparse blocks of a cube; false: one dense block

    /// Number of packs, including the last one, which may contain padding.
    std::size_t packs() const { return (particles + pack_size - 1) / pack_size; }
    /// True if the group is spray. \see spray_particles
    bool is_spray() const { return sparse && particles <= spray_particles; }
};

/// A block with at most this many particles is sparse. Packs of its own would be mostly padding, and most nodes of an
/// arena of its own would stay empty.
inline constexpr std::size_t sparse_particles = 24;

/// The result of sorting particles by block: the slots of each block, the groups of blocks that are scattered together,
/// and the phases in which groups are scattered.
template <int D>
struct BlockPartition {
    std::vector<BlockRange<D>> ranges;    ///< dense blocks by key, then sparse ones by phase, cube and key
    std::vector<BlockGroup> groups;       ///< groups, in the order of their first ranges
    std::vector<std::uint32_t> by_block;  ///< indices into `ranges`, sorted by the keys of the blocks
    /// Indices into `groups`, phase by phase. Groups of one phase never share a node. Of two groups that share a node,
    /// the same one always comes first, so that sums are always formed in the same order.
    std::vector<std::uint32_t> by_phase;
    std::vector<std::size_t> phase_ends;  ///< for each phase, the index in by_phase after its last group
    /// For each slot: its particle, or no_particle if the slot is padding. Before particles are moved into this order,
    /// the old slot of the particle is stored (or its index in another program's arrays); afterwards, its id.
    aligned_vector<std::uint32_t> order;
    std::size_t particles = 0;  ///< number of particles
    /// The row of the first range in the grid's table of neighbours; 0 unless several sets share a grid. \see
    /// SparseGrid::activate
    std::size_t first_row = 0;

    /// Number of slots: those of particles and those of padding.
    std::size_t slots() const { return order.size(); }
};

/// Returns the coordinate of the kernel's base node along one axis: ⌊x − shift⌋. The particle's position relative to
/// the base node is f = x − base [cells].
/// \param x      position [cells], counted from the domain's or a block's lower corner
/// \param shift  the kernel's base_shift
template <scalar S>
FIRN_INLINE S base_node(const S& x, const S& shift) {
    return floor(x - shift);
}
/// Returns the coordinate of the base node of `Kernel` along one axis.
/// \param x  position [cells], counted from the domain's or a block's lower corner
template <class Kernel, scalar S>
FIRN_INLINE S base_node(const S& x) {
    return base_node(x, S(Kernel::base_shift));
}

}  // namespace firn
