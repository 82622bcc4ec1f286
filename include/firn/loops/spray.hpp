/// \file The arena for spray (few particles in sparse blocks). Only the nodes around these particles are cleared and
/// added to the grid.
#pragma once

#include <firn/loops/arena.hpp>
#include <firn/simd/row.hpp>

#include <bit>

namespace firn::inline FIRN_BUILD {

/// The arena of a spray group (few particles in sparse blocks): memory for the nodes in and around a cube of blocks,
/// line after line. A line is a row of nodes along the last axis, through all blocks that the arena meets. The
/// particles need only some of the nodes. Therefore the arena records which runs are used: a run is the part of a line
/// in one block.
template <class Kernel, std::floating_point S, int D>
class SprayArena {
    static constexpr int K = Kernel::support;
    static constexpr int blocks = cube_blocks + 2;  // that the arena meets along each axis; runs of a line

public:
    /// Distance between two lines, and number of lines in a plane [nodes]. After the nodes of its blocks, a line has
    /// unused nodes: if lines were a power of two apart, they would compete for the same places in the cache.
    static constexpr int n = (blocks + 1) * block_size;

    /// Marks the runs that contain nodes of a particle's support as used.
    /// \param corner  index of the first value of the particle's base node, among all values from node() on
    FIRN_INLINE void reach(std::size_t corner) {
        const unsigned base = unsigned(corner) / node_width + before, k = base % n, line = base / n;
        const std::uint64_t runs = (k % block_size + K > block_size ? 3 : 1) * runs_of_lines;
        const unsigned run = line % n * blocks + k / block_size;
        unroll<D == 2 ? 1 : K>([&](auto i) FIRN_LAMBDA { used_[line / n + i] |= runs << run; });
    }
    /// Sets the values of the used runs to zero, and brings these runs of the grid's nodes into the cache. Call this
    /// function after reach() was called for all particles of the group, before the first contribution is added.
    FIRN_INLINE void clear(const S* nodes, const BlocksAround<D>& around) {
        for_runs(around, [&](std::size_t in_grid, std::size_t in_arena) FIRN_LAMBDA {
            Run{}.store(numbers_ + in_arena);
            __builtin_prefetch(nodes + in_grid, 1);
        });
    }
    /// Adds the values of the used runs to the nodes of the grid.
    FIRN_INLINE void add_to_grid(S* nodes, const BlocksAround<D>& around) const {
        for_runs(around, [&](std::size_t in_grid, std::size_t in_arena) FIRN_LAMBDA {
            (Run::load(nodes + in_grid) + Run::load(numbers_ + in_arena)).store(nodes + in_grid);
        });
    }
    /// The values of the nodes, from the lowest node on to which a particle of the group can contribute.
    FIRN_INLINE S* node() { return numbers_ + before * node_width; }

private:
    using Run = row<S, block_size>;

    /// Calls f(in_grid, in_arena) for every used run, with the indices of its first value in the grid and in the arena.
    template <class F>
    FIRN_INLINE void for_runs(const BlocksAround<D>& around, const F& f) const {
        const auto in_blocks = [](std::size_t line) { return line + std::size_t(before); };
        for (std::size_t i = 0; i < planes; ++i)
            for (std::uint64_t left = used_[i]; left != 0; left &= left - 1) {
                const std::size_t run = std::size_t(std::countr_zero(left)), j = run / blocks, b = run % blocks;
                const std::size_t x = D == 2 ? 0 : in_blocks(i), y = in_blocks(j);
                const std::size_t block = around.data()[(x / block_size * blocks + y / block_size) * blocks + b];
                const std::size_t line = x % block_size * block_size + y % block_size;
                f((block * std::size_t(block_nodes<D>) + line * block_size) * node_width,
                  ((i * n + j) * n + b * block_size) * node_width);
            }
    }

    static constexpr int reached = arena_size<Kernel, cube_blocks>;  // nodes that particles can reach along an axis
    static constexpr int planes = D == 2 ? 1 : reached;
    static constexpr int before = block_size - allowed_drift;  // index of the first of them in its block
    static_assert(before + reached <= blocks * block_size && reached * blocks <= 64);

    /// Bits of the first runs of K lines that are next to each other.
    static constexpr std::uint64_t runs_of_lines = [] {
        std::uint64_t bits = 0;
        for (int l = 0; l < K; ++l) bits |= std::uint64_t(1) << l * blocks;
        return bits;
    }();

    alignas(64) S numbers_[planes * n * n * node_width];
    std::uint64_t used_[planes] = {};  // for each plane, a bit for each run of its lines
};

}  // namespace firn::inline FIRN_BUILD
