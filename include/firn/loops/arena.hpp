/// \file Arenas: contiguous memory for the values of the nodes around a block, or around a cube of 2^D blocks.
#pragma once

#include <firn/data/sparse_grid.hpp>

#include <algorithm>
#include <array>

namespace firn::inline FIRN_BUILD {

/// A box of nodes in an arena: the smallest one that contains every node to which a particle of the group contributes.
template <int D>
struct ArenaBox {
    int first[D],  ///< Index, in the arena, of the box's first node along each axis.
        last[D];   ///< Index, in the arena, of the box's last node along each axis.
    /// Whether a particle of the group is so far from its block that the arena lacks some of the particle's nodes.
    bool strays = false;
};

/// Grid indices of the blocks that the arena of a group covers: the block or the cube of blocks of the group, and the
/// blocks around it.
template <int D>
class BlocksAround {
public:
    /// Looks up the blocks in the grid's table of neighbours, for each range of the group (the particles of one block).
    template <class Grid>
    BlocksAround(const Grid& grid, const BlockPartition<D>& partition, const BlockGroup& group) {
        if (!group.sparse) {
            blocks_ = grid.neighbours(partition, group.first_range);
            return;
        }
        blocks_ = of_cube_;
        std::fill(std::begin(of_cube_), std::end(of_cube_), no_block);
        for (std::uint32_t r = group.first_range; r < group.first_range + group.ranges; ++r) {
            int corner = 0;
            for (const int coordinate : partition.ranges[r].block) corner = corner * n + (coordinate & 1);
            const std::uint32_t* neighbour = grid.neighbours(partition, r);
            for (int line = 0; line < (D == 2 ? 3 : 9); ++line)
                for (int k = 0; k < 3; ++k)
                    of_cube_[corner + (D == 2 ? line : line / 3 * n + line % 3) * n + k] = *neighbour++;
        }
    }
    BlocksAround(const BlocksAround&) = delete;
    /// Returns the list of grid indices of the arena's blocks, last axis fastest; an inactive block has no_block. The
    /// list covers 3 blocks along each axis if the arena belongs to one block, cube_blocks + 2 if it belongs to a cube.
    const std::uint32_t* data() const { return blocks_; }

private:
    static constexpr int n = cube_blocks + 2;
    const std::uint32_t* blocks_;
    std::uint32_t of_cube_[D == 2 ? n * n : n * n * n];
};

/// Returns the number of nodes of an arena with n nodes along each axis.
template <int D>
constexpr int arena_nodes(int n) {
    return D == 2 ? n * n : n * n * n;
}

/// Contiguous memory for the nodes to which the particles of a group can contribute: the nodes of the group's block or
/// cube of blocks, and some nodes around it. Nodes are stored with the last axis fastest. A line is a row of nodes
/// through the whole arena along the last axis.
///
/// The number of nodes along each axis, n, is a run-time value, so that the arenas of blocks and of cubes share the
/// same code. Two versions of the code, with n known at compile time, are not faster, and take twice as long to
/// compile.
/// \tparam Number  type of the values: a floating-point number, or an integer for fixed-point sums
/// \tparam Width   number of values per node
template <class Kernel, class Number, int D, int Width = node_width>
struct Arena {
    static constexpr int n_of_block = arena_size<Kernel>,  ///< Number of nodes along each axis in a block's arena.
        n_of_cube = arena_size<Kernel, cube_blocks>;       ///< Number of nodes along each axis in a cube's arena.
    static_assert(n_of_block <= colours_along_axis<Kernel> * block_size && n_of_cube <= 2 * cube_blocks * block_size,
                  "firn: two groups of one colour never touch one node");

    int n;  ///< number of nodes along each axis: n_of_block or n_of_cube
    /// The values of the nodes, `Width` values for each node. There is memory for 4 more nodes, because a SIMD register
    /// that is read or written may extend beyond the last node.
    alignas(64) Number node[(arena_nodes<D>(n_of_cube) + 4) * Width];

    /// Sets `n` to the number of nodes along each axis of the group's arena, and sets the nodes of all lines that cross
    /// `box` to zero.
    FIRN_INLINE void clear(const BlockGroup& group, const ArenaBox<D>& box) {
        n = group.sparse ? n_of_cube : n_of_block;
        if (group.sparse)
            clear_lines<cube_blocks>(box);
        else
            clear_lines<1>(box);
        std::fill_n(node + arena_nodes<D>(n) * Width, 4 * Width, Number(0));
    }

    /// Calls f(index, values, count) for each run of nodes in `box`. A run is a sequence of nodes that are next to each
    /// other both in the arena and in the grid. The runs together contain all nodes of the box, except for those of
    /// inactive blocks. `index` is the index in `node` of the first value of the run, `values` points to the value of
    /// the same node in the grid, and `count` is the number of nodes of the run, a compile-time constant.
    /// \param nodes  the values of all nodes of the grid
    template <class N, class F>
    FIRN_INLINE void for_runs(N* nodes, const BlocksAround<D>& around, const ArenaBox<D>& box, const F& f) const {
        if (n == n_of_block)
            for_runs_of<1>(nodes, around.data(), box, f);
        else
            for_runs_of<cube_blocks>(nodes, around.data(), box, f);
    }

private:
    static constexpr int before = block_size - allowed_drift;  // index of the arena's first node within its block

    template <int Blocks>
    FIRN_INLINE void clear_lines(const ArenaBox<D>& box) {
        constexpr int numbers = arena_size<Kernel, Blocks> * Width;
        for_lines<Blocks>(
            box, [&](int line, int, int) FIRN_LAMBDA { std::fill_n(node + line * numbers, numbers, Number(0)); });
    }

    /// Does the work of for_runs(), for the arena of one block (Blocks = 1) or of a cube of blocks (Blocks =
    /// cube_blocks).
    /// \param of_block  grid indices of the blocks that the arena covers. \see BlocksAround::data
    template <int Blocks, class N, class F>
    FIRN_INLINE static void for_runs_of(N* nodes, const std::uint32_t* of_block, const ArenaBox<D>& box, const F& f) {
        constexpr int size = arena_size<Kernel, Blocks>, blocks = Blocks + 2;
        static_assert(size + before <= blocks * block_size);
        for_lines<Blocks>(box, [&](int line, int outer_block, int outer_node) FIRN_LAMBDA {
            unroll<blocks>([&](auto b) FIRN_LAMBDA {
                constexpr int first = b == 0 ? before : 0;
                constexpr int last = std::min(block_size, before + size - b * block_size);
                constexpr int place = b * block_size + first - before;  // index of the run's first node within its line
                const std::uint32_t block = of_block[outer_block * blocks + b];
                if (place > box.last[D - 1] || place + last - first <= box.first[D - 1] || block == no_block) return;
                N* run = nodes +
                         (block * std::size_t(block_nodes<D>) + std::size_t(outer_node * block_size + first)) * Width;
                f((line * size + place) * Width, run, std::integral_constant<int, last - first>{});
            });
        });
    }

    /// Calls f(line, block, node) for each line that crosses the box. `line` is the index of the line in the arena. The
    /// other two arguments tell where the line lies along the leading axes (all but the last): `block` is the index of
    /// the row of blocks that the line crosses, and `node` is the index of the line within these blocks.
    template <int Blocks, class F>
    FIRN_INLINE static void for_lines(const ArenaBox<D>& box, const F& f) {
        for (int i = box.first[0]; i <= box.last[0]; ++i) {
            const int block = (i + before) / block_size, in_block = (i + before) % block_size;
            if constexpr (D == 2)
                f(i, block, in_block);
            else
                for (int j = box.first[1]; j <= box.last[1]; ++j)
                    f(i * arena_size<Kernel, Blocks> + j, block * (Blocks + 2) + (j + before) / block_size,
                      in_block * block_size + (j + before) % block_size);
        }
    }
};

/// Number of lines of an arena that contain nodes of one particle's support. In each of these lines, the nodes of the
/// support form one row of Kernel::support nodes. A line is all nodes of the arena along the last axis.
template <class Kernel, int D>
inline constexpr int lines_of_particle = D == 2 ? Kernel::support : Kernel::support * Kernel::support;

/// Returns where row `line` of the nodes around a particle begins in an arena: the number of nodes from the particle's
/// base node to the first node of this row.
/// \param line  index of the row: 0 to lines_of_particle − 1;  \param n  number of nodes along each axis of the arena
template <class Kernel, int D>
FIRN_INLINE constexpr std::ptrdiff_t line_begin(int line, std::ptrdiff_t n) {
    constexpr int K = Kernel::support;
    return (D == 2 ? line : line / K * n + line % K) * n;
}

/// Where the rows of nodes around one particle are in the grid. A row lies in one block, or in two blocks that are
/// neighbours along the last axis. The nodes of a row that lie in one block are consecutive. No Arena is needed.
template <class Kernel, int D>
class RowsInGrid {
public:
    static constexpr int count = lines_of_particle<Kernel, D>;  ///< Number of rows of nodes around a particle.

    int split;  ///< Number of nodes of each row that lie in the row's first block.
    /// For each row: where the numbers of its nodes are, among those of all nodes of the grid. The numbers of node k
    /// begin at first[row] + k node_width if k < split, else at second[row] + k node_width. If a row lies in one block,
    /// `second` equals `first`.
    std::ptrdiff_t first[count],
        second[count];  ///< \see first

    /// Finds the rows around a particle. Calls f(row) for each row that is found.
    /// \param neighbours  grid indices of the particle's block and of the blocks around it. \see SparseGrid::neighbours
    /// \param corner      index, among all values of the arena of one block, of the first value of the particle's base
    ///                    node
    template <class F>
    FIRN_INLINE void find(const std::uint32_t* neighbours, std::ptrdiff_t corner, const F& f) {
        const unsigned base = unsigned(corner) / node_width, k = base % n + before;
        split = block_size - int(k % block_size);
        const bool two_blocks = split < Kernel::support;
        const std::ptrdiff_t in_first = std::ptrdiff_t(k % block_size) * node_width,
                             in_second = two_blocks ? -split * node_width : in_first;
        const std::uint32_t *const blocks = neighbours + k / block_size, *const second_blocks = blocks + two_blocks;
        const Line* const corner_line = lines.data() + base / n;
        unroll<count>([&](auto row) FIRN_LAMBDA {
            const Line line = corner_line[line_begin<Kernel, D>(row, n) / n];
            const auto number = [&](std::uint32_t block) FIRN_LAMBDA {
                return std::ptrdiff_t(block) * (block_nodes<D> * node_width) + line.number;
            };
            first[row] = number(blocks[line.neighbour]) + in_first;
            second[row] = number(second_blocks[line.neighbour]) + in_second;
            f(row);
        });
    }
    /// Returns where the numbers of node k of a row begin, among those of all nodes of the grid.
    FIRN_INLINE std::ptrdiff_t number(int row, int k) const {
        return (k < split ? first : second)[row] + k * node_width;
    }
    /// Returns where the numbers of the last node of a row begin, among those of all nodes of the grid.
    FIRN_INLINE std::ptrdiff_t last(int row) const { return second[row] + (Kernel::support - 1) * node_width; }

private:
    static constexpr int n = arena_size<Kernel>, before = block_size - allowed_drift;
    static_assert(Kernel::support <= block_size + 1, "firn: a row of nodes lies in at most two blocks");

    /// Where a line of the arena of one block lies: the place of its first block among the neighbours, and the index,
    /// among the numbers of this block, of the first number of the line.
    struct Line {
        std::uint8_t neighbour, number;
    };
    static constexpr auto lines = [] {
        std::array<Line, std::size_t(arena_nodes<D>(n) / n)> table{};
        for (int line = 0; line < int(table.size()); ++line)
            for (int a = 0, along = D == 2 ? line : line / n; a < D - 1; ++a, along = line % n) {
                Line& to = table[std::size_t(line)];
                to.neighbour = std::uint8_t(3 * to.neighbour + 3 * ((along + int(before)) / block_size));
                to.number = std::uint8_t(block_size * (to.number + (along + int(before)) % block_size * node_width));
            }
        return table;
    }();
};

/// If the group after `group` is spray, brings the nodes of its blocks into the second-level cache. Spray has few
/// particles in a block, so what a group prefetches for itself comes too late.
/// \param nodes  the values of all nodes of the grid
template <class Grid, std::floating_point S, int D>
FIRN_INLINE void prefetch_next_spray(const S* nodes, const Grid& grid, const BlockPartition<D>& partition,
                                     const BlockGroup& group) {
    const BlockGroup* const next = &group + 1;
    if (next == partition.groups.data() + partition.groups.size() || !is_spray<D>(*next)) return;
    constexpr int middle = SparseGrid<S, D>::neighbour_count / 2;
    for (std::uint32_t r = next->first_range; r < next->first_range + next->ranges; ++r) {
        const std::size_t block = grid.neighbours(partition, r)[middle];
        const S* const first = nodes + block * std::size_t(block_nodes<D> * node_width);
        for (int i = 0; i < block_nodes<D> * node_width; i += int(64 / sizeof(S))) __builtin_prefetch(first + i, 0, 2);
    }
}

}  // namespace firn::inline FIRN_BUILD
