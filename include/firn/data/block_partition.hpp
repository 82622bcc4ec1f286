/// \file Which particles belong to which block of cells: what colouring, sparse grids and packs rest on.
#pragma once

#include <firn/data/domain.hpp>
#include <firn/data/field.hpp>

#include <algorithm>
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

/// The remainder in [0, n), of negative numbers, too.
constexpr int modulo(int a, int n) { return (a % n + n) % n; }

/// Blocks along an axis after which they repeat; 0: they do not.
template <int D>
int block_period(const Domain<D>& domain, int axis) {
    return domain.periodic[std::size_t(axis)] ? domain.cells(axis) / block_size : 0;
}
template <int D>
bool is_periodic(const Domain<D>& domain) {
    return std::find(domain.periodic.begin(), domain.periodic.end(), true) != domain.periodic.end();
}
/// The same block as one in the domain, along its periodic axes.
template <int D>
BlockCoordinate<D> wrapped(const Domain<D>& domain, BlockCoordinate<D> block) {
    for (int a = 0; a < D; ++a)
        if (const int n = block_period(domain, a); n > 0) block[std::size_t(a)] = modulo(block[std::size_t(a)], n);
    return block;
}
template <int D>
std::uint64_t wrapped_key(const Domain<D>& domain, std::uint64_t key) {
    return block_key<D>(wrapped(domain, block_of_key<D>(key)));
}
/// Blocks from `to` to `from` along an axis, the shorter way.
template <int D>
int block_distance(const Domain<D>& domain, int axis, int from, int to) {
    const int n = block_period(domain, axis), distance = from - to;
    if (n == 0) return distance;
    return distance > n / 2 ? distance - n : distance < -n / 2 ? distance + n : distance;
}

/// The position [m] along one axis of a place in a block, counted from the block's lower corner [cells].
template <int D>
double position_of_place(const Domain<D>& domain, const BlockCoordinate<D>& block, int axis, double place) {
    return domain.lower[axis] + domain.cell_size * (block_size * block[std::size_t(axis)] + place);
}

/// Sparse blocks are worked through by cubes of so many along an axis.
inline constexpr int cube_blocks = 2;

/// Nodes along one axis that the particles of a cube of Blocks^D blocks can touch until they are sorted again.
template <class Kernel, int Blocks = 1>
inline constexpr int arena_size = Blocks * block_size + 2 * allowed_drift + Kernel::support - 1;

/// How many blocks apart along an axis dense blocks of one colour are: so far that their arenas never overlap.
template <class Kernel>
inline constexpr int colours_along_axis = (arena_size<Kernel> + block_size - 1) / block_size;

/// The colour of a block, or of a cube of blocks, 0 to n^D − 1: its coordinates modulo n. Those of one colour have
/// n − 1 of other colours between them.
template <int D>
std::size_t block_colour(const BlockCoordinate<D>& block, int n) {
    std::size_t colour = 0;
    for (const int coordinate : block) colour = std::size_t(n) * colour + std::size_t(modulo(coordinate, n));
    return colour;
}

/// The particles whose base node lay in one block when they were sorted.
template <int D>
struct BlockRange {
    BlockCoordinate<D> block;
    std::size_t first_slot;
    std::size_t particles;  ///< from first_slot on
};

/// Sparse blocks that have no more than this together are spray: an arena for them holds mostly nodes that no particle
/// reaches. Of it they scatter to those that they reach, and they gather from the grid where its nodes lie.
inline constexpr std::size_t spray_particles = 64;

/// What one thread works through at once: the particles of one block; or those of all the sparse blocks in a cube,
/// which share packs. The rest of the last pack is padding. \see cube_blocks
struct BlockGroup {
    std::uint32_t first_range, ranges;
    std::size_t first_slot;  ///< a multiple of pack_size
    std::size_t particles;   ///< from first_slot on
    bool sparse;

    std::size_t packs() const { return (particles + pack_size - 1) / pack_size; }
    bool is_spray() const { return sparse && particles <= spray_particles; }
};

/// A block with no more particles than this is sparse: packs of its own would be mostly padding, and an arena of its
/// own would hold mostly nodes that no particle reaches.
inline constexpr std::size_t sparse_particles = 24;

template <int D>
struct BlockPartition {
    std::vector<BlockRange<D>> ranges;    ///< dense blocks by block, then sparse ones by phase, cube and block
    std::vector<BlockGroup> groups;       ///< in the order of their ranges
    std::vector<std::uint32_t> by_block;  ///< numbers of ranges, sorted by block
    /// Numbers of groups in the order of the phases in which they are scattered: no two of a phase ever share a node,
    /// and of any two groups that share one, it is always the same that comes first.
    std::vector<std::uint32_t> by_phase;
    std::vector<std::size_t> phase_ends;  ///< in by_phase
    /// Particle of each slot (its id, once particles lie in this order), or no_particle.
    aligned_vector<std::uint32_t> order;
    std::size_t particles = 0;
    /// Where its ranges begin in the grid's table of neighbours: not 0 where several sets of particles share a grid.
    std::size_t first_row = 0;

    std::size_t slots() const { return order.size(); }
};

/// The kernel's base node along one axis, and the fractional position f = x/h − base.
/// \param x      position from the domain's lower corner, in cells
/// \param shift  the kernel's base_shift
template <scalar S>
FIRN_INLINE S base_node(const S& x, const S& shift) {
    return floor(x - shift);
}
template <class Kernel, scalar S>
FIRN_INLINE S base_node(const S& x) {
    return base_node(x, S(Kernel::base_shift));
}

}  // namespace firn
