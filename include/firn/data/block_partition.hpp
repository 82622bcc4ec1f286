/// \file Blocks of cells, and lists of the particles in each block. Parallel scattering, sparse grids and packs of
/// particles all use these blocks.
#pragma once

#include <firn/data/domain.hpp>
#include <firn/data/field.hpp>

#include <algorithm>
#include <span>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Number of cells (and of nodes) of a block along one axis.
inline constexpr int block_size = 4;

/// Number of cells (and of nodes) of a block in D dimensions.
template <int D>
inline constexpr int block_nodes = D == 2 ? block_size * block_size : block_size * block_size * block_size;

/// Largest distance [cells] of a particle's base node (the lowest node to which the particle scatters) from the block
/// into which the particle was last sorted. If a base node lies farther from its block, particles must be sorted again.
inline constexpr int allowed_drift = 1;

/// Integer coordinates of a block. Multiplied by block_size, they are the position [cells] of the block's lower corner,
/// counted from the domain's lower corner.
template <int D>
using BlockCoordinate = std::array<int, std::size_t(D)>;

/// Returns a block's key: the block's coordinates, packed into one integer with 21 bits per axis. The first axis has
/// the highest bits. So blocks sorted by key are sorted by their first coordinate, then by the second, then by the
/// third.
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

/// Returns the coordinate of a node along an axis, counted from the first node of its block.
/// \param node  index of the node in the block, the last axis fastest
template <int D>
constexpr int place_in_block(int node, int axis) {
    return node >> 2 * (D - 1 - axis) & (block_size - 1);
}

/// Returns the remainder of a / n as a number in [0, n), also if a is negative.
constexpr int modulo(int a, int n) { return (a % n + n) % n; }

/// Returns the number of blocks that hold this many cells along an axis.
constexpr int blocks_for(int cells) { return (cells + block_size - 1) / block_size; }

/// \name Copies of the domain's blocks
/// Each contact group has blocks and nodes of its own: a copy of the blocks of the domain. The copy of group g lies
/// g × copy_stride() blocks further along axis 0. Group 0 has the blocks themselves. So sorting, the grid, P2G and G2P
/// treat particles of different groups like particles that are far apart. \see contact/concept.hpp
/// @{

/// Number of blocks before the first block of a domain that belong to the same copy: those of ghost nodes, and more.
inline constexpr int copy_margin = 4;

/// Returns the distance along axis 0 between the copies of two consecutive groups [blocks]. It is a multiple of 12, so
/// that a copy of a block has the colour of the block.
template <int D>
int copy_stride(const Domain<D>& domain) {
    return (blocks_for(domain.cells(0)) + 2 * copy_margin + 11) / 12 * 12;
}
/// Returns the contact group to whose copy a block belongs.
/// \param along   coordinate of the block along axis 0
/// \param stride  copy_stride() of the domain
constexpr int group_of_copy(int along, int stride) {
    const int from = along + copy_margin;
    return from >= 0 ? from / stride : -((stride - 1 - from) / stride);
}
/// Returns the coordinate along axis 0 of the block of which a block is the copy.
/// \param along   coordinate of the copy along axis 0
/// \param stride  copy_stride() of the domain
constexpr int along_in_domain(int along, int stride) { return along - group_of_copy(along, stride) * stride; }
/// Returns the key of the block of the domain of which a block is the copy.
/// \param key  key of the copy
template <int D>
std::uint64_t key_in_domain(const Domain<D>& domain, std::uint64_t key) {
    BlockCoordinate<D> block = block_of_key<D>(key);
    block[0] = along_in_domain(block[0], copy_stride(domain));
    return block_key<D>(block);
}
/// Returns the number of contact groups that the keys of blocks can tell apart, group 0 included.
template <int D>
int most_contact_groups(const Domain<D>& domain) {
    return ((1 << 20) - copy_margin) / copy_stride(domain);
}
/// @}

/// Returns a block near a block: one before it along the axes whose bit is 0 in k. Bit D − 1 − a stands for axis a.
template <int D>
BlockCoordinate<D> block_before(BlockCoordinate<D> block, int k) {
    for (int a = 0; a < D; ++a) block[std::size_t(a)] -= (k >> (D - 1 - a) & 1) ^ 1;
    return block;
}

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
/// Returns the coordinates of a block, moved into the domain by whole periods: each coordinate along a periodic axis is
/// taken modulo the number of blocks. Coordinates along the other axes stay as they are. A block of a copy stays in it.
template <int D>
BlockCoordinate<D> wrapped(const Domain<D>& domain, BlockCoordinate<D> block) {
    for (int a = 0; a < D; ++a)
        if (const int n = block_period(domain, a); n > 0) {
            int& along = block[std::size_t(a)];
            const int inside = a == 0 ? along_in_domain(along, copy_stride(domain)) : along;
            along += modulo(inside, n) - inside;
        }
    return block;
}
/// Returns the key of wrapped(domain, block), for a block that is given by its key.
/// \param key  key of the block
template <int D>
std::uint64_t wrapped_key(const Domain<D>& domain, std::uint64_t key) {
    return block_key<D>(wrapped(domain, block_of_key<D>(key)));
}
/// Returns the difference `from` − `to` [blocks] of two blocks' coordinates along an axis. Along a periodic axis, where
/// two ways lead from block `to` to block `from`, the shorter way counts.
template <int D>
int block_distance(const Domain<D>& domain, int axis, int from, int to) {
    const int n = block_period(domain, axis), distance = from - to;
    if (n == 0) return distance;
    return distance > n / 2 ? distance - n : distance < -n / 2 ? distance + n : distance;
}

/// Returns a coordinate [m] that lies in the domain: x, or along a periodic axis the same place in the domain if x lies
/// outside of it by up to one extent.
template <int D>
double into_domain(const Domain<D>& domain, int axis, double x) {
    const double lower = domain.lower[axis], upper = domain.upper[axis];
    if (!domain.periodic[std::size_t(axis)] || (x >= lower && x <= upper)) return x;
    return std::clamp(x < lower ? x + (upper - lower) : x - (upper - lower), lower, upper);
}

/// Returns the coordinate [m], along one axis, of a point in a block of the domain.
/// \param along  coordinate of the block along the axis
/// \param place  the point's place along the axis: its distance [cells] from the block's lower corner
template <int D>
double position_along(const Domain<D>& domain, int axis, int along, double place) {
    return domain.lower[axis] + domain.cell_size * (block_size * along + place);
}

/// Returns the coordinate [m], along one axis, of a point that is given by its block and its place in that block.
/// \param block  coordinates of the block, or of a copy of it
/// \param place  as for position_along()
template <int D>
double position_of_place(const Domain<D>& domain, const BlockCoordinate<D>& block, int axis, double place) {
    int along = block[std::size_t(axis)];
    if (axis == 0) along = along_in_domain(along, copy_stride(domain));
    return position_along(domain, axis, along, place);
}

/// Number of blocks along each axis of a cube. Blocks with few particles (sparse blocks) are scattered together with
/// the other sparse blocks of the same cube.
inline constexpr int cube_blocks = 2;

/// Number of nodes along each axis of an arena. The arena of a block (or of a cube of Blocks^D blocks) consists of all
/// nodes to which the particles of the block (or cube) can scatter before they must be sorted again.
/// \tparam Blocks  number of blocks along each axis: 1 for a block, cube_blocks for a cube
template <class Kernel, int Blocks = 1>
inline constexpr int arena_size = Blocks * block_size + 2 * allowed_drift + Kernel::support - 1;

/// Number of colours of dense blocks (blocks with many particles) along one axis. Two blocks of the same colour are at
/// least this many blocks apart, so their arenas (the nodes to which their particles scatter) never overlap.
template <class Kernel>
inline constexpr int colours_along_axis = (arena_size<Kernel> + block_size - 1) / block_size;

/// Returns the colour of the block (or cube) with these coordinates: an index from 0 to n^D − 1, computed from the
/// coordinates modulo n. Along an axis, every n-th block has the same colour.
/// \param n  number of colours along one axis
template <int D>
std::size_t block_colour(const BlockCoordinate<D>& block, int n) {
    std::size_t colour = 0;
    for (const int coordinate : block) colour = std::size_t(n) * colour + std::size_t(modulo(coordinate, n));
    return colour;
}

/// A range: the particles of one block. The base node of a particle (the lowest node to which it scatters) lay in this
/// block when particles were last sorted. The slots of the particles are consecutive.
template <int D>
struct BlockRange {
    BlockCoordinate<D> block;  ///< coordinates of the block
    std::size_t first_slot;    ///< slot of the range's first particle
    std::size_t particles;     ///< number of particles in the range
};

/// If a group of sparse blocks has at most this many particles in total, the group is called spray. The particles of
/// spray scatter to only few nodes of the group's arena. Therefore P2G clears only these nodes and adds only these
/// nodes to the grid. G2P reads the nodes from the grid itself, not from an arena.
template <int D>
inline constexpr std::size_t spray_particles = std::size_t(16) << D;

/// A group of blocks whose particles one worker scatters together: one dense block, or all sparse blocks of one cube.
/// The group's particles fill one pack after the other; a pack may have particles of several blocks. The rest of the
/// group's last pack is padding. \see cube_blocks
struct BlockGroup {
    std::uint32_t first_range,  ///< index of the group's first range in BlockPartition::ranges
        ranges;                 ///< number of the group's ranges
    std::size_t first_slot;     ///< slot of the group's first particle, a multiple of pack_size
    std::size_t particles;      ///< number of the group's particles; their slots are consecutive
    bool sparse;                ///< true: the sparse blocks of a cube; false: one dense block

    /// Number of the group's packs, including the last one, which may contain padding.
    std::size_t packs() const { return (particles + pack_size - 1) / pack_size; }
};

/// Returns whether a group is spray. \see spray_particles
template <int D>
bool is_spray(const BlockGroup& group) {
    return group.sparse && group.particles <= spray_particles<D>;
}

/// Largest number of particles in a sparse block. If such a block had packs and an arena for itself alone, most lanes
/// of its packs would be padding, and most nodes of its arena would stay empty.
inline constexpr std::size_t sparse_particles = 24;

/// The result of sorting particles by block: the slots of each block, the groups of blocks that are scattered together,
/// and the phases (sets of groups that may be scattered at the same time).
template <int D>
struct BlockPartition {
    /// One range for each block that contains particles: first those of dense blocks, sorted by key, then those of
    /// sparse blocks, sorted by phase, cube and key.
    std::vector<BlockRange<D>> ranges;
    std::vector<BlockGroup> groups;       ///< groups of blocks, in the order of `ranges`
    std::vector<std::uint32_t> by_block;  ///< indices into `ranges`, sorted by the keys of the ranges' blocks
    /// Indices into `groups`, phase by phase. Groups of one phase never share a node. Two groups that share a node
    /// always come in the same order, so that the sum at this node is always formed in the same order.
    std::vector<std::uint32_t> by_phase;
    std::vector<std::size_t> phase_ends;  ///< for each phase, the index in by_phase one past the phase's last group
    /// The particle in each slot, or no_particle if the slot is padding. As long as the particles are not moved into
    /// this order, a particle is given by its old slot (or by its index in another program's arrays). Afterwards, the
    /// particle is given by its id.
    aligned_vector<std::uint32_t> order;
    std::size_t particles = 0;  ///< number of particles in all ranges
    /// copy_stride() of the domain if particles are in contact groups; 0 if all are in group 0.
    int copy_stride = 0;
    /// Row in the grid's table of neighbours that belongs to this partition's first range (the particles of one block).
    /// It is 0 unless several sets of particles share the grid. \see SparseGrid::activate
    std::size_t first_row = 0;

    /// Number of slots, including those of padding.
    std::size_t slots() const { return order.size(); }
    /// Returns the coordinate, along an axis, of the block of the domain in which range r lies, whichever copy of the
    /// block the range has.
    int block_along(std::size_t r, int axis) const {
        const int along = ranges[r].block[std::size_t(axis)];
        return axis == 0 && copy_stride > 0 ? along_in_domain(along, copy_stride) : along;
    }
};

/// Returns whether particles of one of the partitions are in contact groups other than 0.
template <int D>
bool has_contact_groups(std::span<BlockPartition<D>* const> partitions) {
    return std::any_of(partitions.begin(), partitions.end(), [](const auto* p) { return p->copy_stride > 0; });
}

/// Returns one coordinate of a particle's base node, the lowest node to which the particle scatters: ⌊x − shift⌋. The
/// particle's position relative to the base node is f = x − ⌊x − shift⌋ [cells].
/// \param x      coordinate of the particle [cells], counted from the lower corner of the domain or of a block
/// \param shift  the kernel's base_shift
template <scalar S>
FIRN_INLINE S base_node(const S& x, const S& shift) {
    return floor(x - shift);
}
/// Returns one coordinate of a particle's base node, the lowest node to which the particle scatters with this kernel.
/// \param x  coordinate of the particle [cells], counted from the lower corner of the domain or of a block
template <class Kernel, scalar S>
FIRN_INLINE S base_node(const S& x) {
    return base_node(x, S(Kernel::base_shift));
}

}  // namespace firn::inline FIRN_BUILD
