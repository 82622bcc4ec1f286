/// \file Sets the nodes of the grid to zero before they are scattered to: band by band, so that they are in the cache.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/data/particle_set.hpp>
#include <firn/data/sparse_grid.hpp>

#include <algorithm>
#include <cstring>
#include <limits>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Some of the phases of a partition: those with the indices first ≤ i < last. By default all.
struct PhaseRange {
    std::size_t first = 0,                               ///< index of the first phase
        last = std::numeric_limits<std::size_t>::max();  ///< index of the last phase, plus 1
};

namespace detail {

/// Sets `per_node` values of type T to zero for each node of the grid's blocks from `begin` on.
/// \param numbers  the values of all nodes of the grid
/// \param begin    index of the first block that is cleared
/// \param end      index of the last block that is cleared, plus 1
template <int D, class T>
void clear_blocks(T* numbers, int per_node, std::size_t begin, std::size_t end, int threads) {
    // The pieces are large, because memset writes a large piece to memory without reading its cache lines first.
    const std::size_t per_block = std::size_t(block_nodes<D> * per_node), together = 1 << 14;
    T* const first = numbers + begin * per_block;
    const std::size_t count = (end - begin) * per_block;
    const auto clear_some = [&](std::size_t i, int) {
        const std::size_t from = i * together;
        std::memset(static_cast<void*>(first + from), 0, std::min(together, count - from) * sizeof(T));
    };
    parallel_for((count + together - 1) / together, threads, clear_some);
}

/// Sets `per_node` values of type T to zero for each node of the grid.
template <class T, std::floating_point S, int D>
void clear(T* numbers, int per_node, const SparseGrid<S, D>& grid, int threads) {
    clear_blocks<D>(numbers, per_node, 0, grid.block_count(), threads);
}

/// Consecutive phases of a partition, with all blocks of the grid to which their groups and the groups of the phases
/// before contribute.
struct Band {
    PhaseRange phases;
    std::size_t blocks;  ///< number of these blocks: they are the first blocks of the grid
};

/// A grid with at most this many numbers stays in the cache of a processor core from clearing to scattering.
inline constexpr std::size_t numbers_in_cache = 1 << 18;

/// Returns all phases of a partition, divided into bands. If the blocks of a band are cleared just before the band is
/// scattered, they are still in the cache. \see Waves
template <std::floating_point S, int D>
std::vector<Band> bands(const SparseGrid<S, D>& grid, const BlockPartition<D>& partition) {
    const std::size_t all = grid.block_count();
    if (all * std::size_t(block_nodes<D> * node_width) <= numbers_in_cache || is_periodic(grid.domain()))
        return {{PhaseRange{}, all}};
    std::vector<Band> bands;
    std::size_t blocks = 0, first = 0;
    for (std::size_t phase = 0; phase < partition.phase_ends.size(); first = partition.phase_ends[phase++]) {
        bool sparse = false;
        for (std::size_t i = first; i < partition.phase_ends[phase]; ++i) {
            const BlockGroup& group = partition.groups[partition.by_phase[i]];
            sparse = group.sparse;
            // Blocks are sorted by key, so the last neighbour is the last block to which the range contributes.
            for (std::uint32_t r = group.first_range; r < group.first_range + group.ranges; ++r)
                blocks = std::max<std::size_t>(blocks, grid.neighbours(partition, r)[grid.neighbour_count - 1] + 1);
        }
        if (bands.empty() || (sparse && blocks > bands.back().blocks)) bands.push_back({{phase, phase}, blocks});
        bands.back().phases.last = phase + 1;
        bands.back().blocks = blocks;
    }
    return bands;
}

/// Clears all blocks of the grid and scatters all sets of particles, band by band.
/// \param clear    clear(begin, end) clears the blocks begin ≤ b < end
/// \param scatter  scatter(set, phases) adds the contributions of a set's groups in a PhaseRange
template <std::floating_point S, int D, class Clear, class Scatter, class View>
void scatter_by_bands(const SparseGrid<S, D>& grid, const Clear& clear, const Scatter& scatter,
                      ParticleSets<View> sets) {
    std::size_t cleared = 0;
    const auto clear_to = [&](std::size_t block) {
        if (block > cleared) clear(cleared, block);
        cleared = std::max(cleared, block);
    };
    for (const ParticleSet<View>& set : sets) {
        if (set.partition.groups.empty()) continue;  // of many materials, a simulation may have particles of few
        for (const Band& band : bands(grid, set.partition)) {
            clear_to(band.blocks);
            scatter(set, band.phases);
        }
    }
    clear_to(grid.block_count());
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
