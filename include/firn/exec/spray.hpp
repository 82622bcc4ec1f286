/// \file The arena for spray (few particles in sparse blocks). Only the nodes around these particles are cleared and
/// added to the grid.
#pragma once

#include <firn/exec/arena.hpp>
#include <firn/simd/row.hpp>

#include <bit>

namespace firn {

/// The arena of a spray group (few particles in sparse blocks): memory for the nodes in and around a cube of blocks.
/// The particles need only some of these nodes, and the arena records which runs of nodes are used. A line is a row of
/// nodes through the whole arena along the last axis; a run is the part of a line in one block.
template <class Kernel, std::floating_point S, int D>
class SprayArena {
    static constexpr int K = Kernel::support;

public:
    static constexpr int n = arena_size<Kernel, cube_blocks>;  ///< number of nodes along each axis

    /// Marks the runs that contain nodes of a particle's support as used, and sets the values of their nodes to zero.
    /// Call reach() for all particles of the group before the first contribution is added.
    /// \param corner  index, among all values of the arena, of the first value of the particle's base node
    FIRN_INLINE void reach(std::size_t corner) {
        const unsigned base = unsigned(corner) / node_width, line = base / n, k = base % n;
        const unsigned first = (k + before) / block_size, last = (k + before + K - 1) / block_size;
        // Two runs have at most 2 block_size nodes. Some nodes of other runs may be set to zero, too: this is harmless,
        // because nothing was added to these nodes yet.
        const unsigned begin = line * n + unsigned(std::max(int(first * block_size) - before, 0));
        S* const run = node + begin * node_width;
        unroll<lines_of_particle<Kernel, D>>([&](auto l) FIRN_LAMBDA {
            std::fill_n(run + line_begin<Kernel, D>(l, n) * node_width, 2 * block_size * node_width, S(0));
        });
        const unsigned word = line / 64, shift = line % 64;
        for (const unsigned block : {first, last}) {
            reached_[block][word] |= lines_from_0 << shift;
            if constexpr (words > 1) reached_[block][word + 1] |= lines_from_0 >> 1 >> (63 - shift);
        }
    }

    /// Brings the used runs of the grid's nodes into the cache, so that add_to_grid() need not wait for them.
    FIRN_INLINE void prefetch(const S* nodes, const BlocksAround<D>& around) const {
        for_runs(around, [&](auto, std::size_t in_grid, int) FIRN_LAMBDA { __builtin_prefetch(nodes + in_grid, 1); });
    }
    /// Adds the values of the used runs to the nodes of the grid.
    FIRN_INLINE void add_to_grid(S* nodes, const BlocksAround<D>& around) const {
        for_runs(around, [&](auto count, std::size_t in_grid, int in_arena) FIRN_LAMBDA {
            using Run = exact_row<S, count>;
            (Run::load(nodes + in_grid) + Run::load(node + in_arena)).store(nodes + in_grid);
        });
    }

    /// The values of the nodes. There is additional memory because reach() may write zeros beyond the last node.
    alignas(64) S node[(arena_nodes<D>(n) + 2 * block_size) * node_width];

private:
    /// Calls f(count, in_grid, in_arena) for every used run. `count` is the number of its nodes, a compile-time
    /// constant; the other two are the indices of its first value in the grid and in the arena.
    template <class F>
    FIRN_INLINE void for_runs(const BlocksAround<D>& around, const F& f) const {
        unroll<blocks>([&](auto b) FIRN_LAMBDA {
            constexpr int begin = b == 0 ? before : 0, end = std::min(block_size, before + n - b * block_size);
            constexpr int place = b * block_size + begin - before;  // index of the run's first node within its line
            for (int word = 0; word < words; ++word)
                for (std::uint64_t left = reached_[b][word]; left != 0; left &= left - 1) {
                    const int line = 64 * word + std::countr_zero(left);
                    const Line in_grid = lines[std::size_t(line)];
                    const std::size_t block = around.data()[in_grid.block * blocks + b];
                    f(std::integral_constant<int, end - begin>{},
                      (block * std::size_t(block_nodes<D>) + std::size_t(in_grid.node * block_size + begin)) *
                          node_width,
                      (line * n + place) * node_width);
                }
        });
    }

    static constexpr int before = block_size - allowed_drift;  // index of the arena's first node within its block
    static constexpr int blocks = cube_blocks + 2, line_count = arena_nodes<D>(n) / n;
    static constexpr int words = line_count <= 64 ? 1 : line_count / 64 + 2;

    /// Bit l is set if line l contains nodes of the support of a particle whose base node lies in line 0.
    static constexpr std::uint64_t lines_from_0 = [] {
        std::uint64_t bits = 0;
        for (int l = 0; l < lines_of_particle<Kernel, D>; ++l)
            bits |= std::uint64_t(1) << line_begin<Kernel, D>(l, n) / n;
        return bits;
    }();

    /// Where a line lies along the leading axes (all but the last): `block` is the index of the row of blocks that the
    /// line crosses, and `node` is the index of the line within these blocks.
    struct Line {
        std::uint8_t block, node;
    };
    static constexpr auto lines = [] {
        std::array<Line, std::size_t(line_count)> all{};
        for (int line = 0; line < line_count; ++line)
            for (int a = 0, at = D == 2 ? line : line / n; a < D - 1; ++a, at = line % n) {
                Line& to = all[std::size_t(line)];
                to.block = std::uint8_t(to.block * blocks + (at + before) / block_size);
                to.node = std::uint8_t(to.node * block_size + (at + before) % block_size);
            }
        return all;
    }();

    std::uint64_t reached_[blocks][words] = {};  // reached_[b]: bits of the lines whose run in block b is used
};

}  // namespace firn
