/// \file Sorts particles by block, cell and id: a counting sort in four steps.
///
/// The result depends only on the particles' blocks, cells and ids, neither on the order of particles before nor on the
/// number of threads.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/data/block_partition.hpp>
#include <firn/sort/arrange.hpp>
#include <firn/sort/block_numbers.hpp>
#include <firn/sort/radix_sort.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace firn::inline FIRN_BUILD {

/// For up to sixteen particles: the block and the cell that contain the particle's base node (the lowest node to which
/// the particle scatters). Each array has one element per particle.
struct BlockCells {
    static constexpr int far = 27;  ///< value of `beside` if `block` is not a neighbour of `origin`

    /// key of the origin block, from whose lower corner the base node is counted
    std::uint64_t origin[pack_size];
    std::uint64_t block[pack_size];  ///< key of the block that contains the base node
    /// index of `block` among the 3^D blocks around the origin block, the last axis fastest; or `far`
    std::uint8_t beside[pack_size];
    /// index of the base node's cell within `block`, the first axis fastest. \see find_cells
    std::uint8_t cell[pack_size];
};

/// Finds the blocks and cells of particles' base nodes.
///
/// The cells of a block are counted with the first axis fastest, while rows of nodes lie along the last axis. Therefore
/// many of the rows to which the particles of one cell scatter are also rows of the next cell, with the same addresses.
/// This makes P2G fast. P2G reads a row soon after it wrote the row, and then a processor forwards the written row at
/// once if the address and the size are the same.
/// \param base  coordinates of the base nodes [cells], counted from the lower corners of the blocks to.origin
/// \param to    the result; the caller must set `origin`, and find_cells() sets the other members
template <std::floating_point S, int D>
FIRN_INLINE void find_cells(const S (&base)[D][pack_size], BlockCells& to) {
    unsigned cell[pack_size] = {}, beside[pack_size] = {}, beyond[pack_size] = {};
    std::copy_n(to.origin, pack_size, to.block);
    for (int a = 0; a < D; ++a)
        for (int l = 0; l < pack_size; ++l) {
            const int node = int(base[a][l]), blocks = node >> 2;
            cell[l] |= unsigned(node & (block_size - 1)) << 2 * a;
            beside[l] = 3 * beside[l] + unsigned(blocks + 1);
            beyond[l] |= unsigned(blocks + 1) > 2;
            to.block[l] += std::uint64_t(std::int64_t(blocks)) << 21 * (D - 1 - a);
        }
    for (int l = 0; l < pack_size; ++l) {
        to.cell[l] = std::uint8_t(cell[l]);
        to.beside[l] = std::uint8_t(beyond[l] ? BlockCells::far : beside[l]);
    }
}

/// Sorts particles by block, then by cell, then by id, and collects blocks into groups. No particle is moved: the
/// result is a partition with the new order. The class does not read the particles' fields; a function of the caller
/// returns the cell of each particle. Particle indices are indices into the caller's arrays, in which padding entries
/// have an index, too.
///
///     BlockSort<3> sort(count, ids, threads, room);
///     sort.look(is_particle, cells_of);
///     BlockPartition<3> partition = sort.partition(colours);
template <int D>
class BlockSort {
public:
    /// Size of the scratch memory that the sort needs per particle index [bytes].
    static constexpr std::size_t room = 2 * sizeof(std::uint32_t) + sizeof(std::uint8_t);

    /// Prepares a sort. Call look() and then partition().
    /// \param candidates  number of indices, including those of padding
    /// \param ids         for each index, the id of the particle (no two ids are the same); nullptr: a particle's id is
    ///                    its index
    /// \param threads     number of threads; 0: thread_count() chooses
    /// \param memory      scratch memory of `room` bytes per index, aligned as std::uint32_t
    BlockSort(std::size_t candidates, const std::uint32_t* ids, int threads, std::byte* memory)
        : candidates_(candidates),
          ids_(ids),
          threads_(int(std::min<std::size_t>(std::size_t(thread_count(threads)), candidates / 4096 + 1))),
          met_(std::size_t(threads_)),
          number_of_(reinterpret_cast<std::uint32_t*>(memory)),
          by_block_(number_of_ + candidates),
          cell_of_(reinterpret_cast<std::uint8_t*>(by_block_ + candidates)) {}

    /// Does the first step of the sort: finds each particle's cell, gives each block an index, and counts the particles
    /// of each block.
    /// \param is_particle  is_particle(i) is true if index i belongs to a particle, false if it belongs to padding
    /// \param cells_of     cells_of(i, count, cells) finds the cells of the particles with indices i to i + count − 1,
    ///                     where i is a multiple of pack_size and count ≤ pack_size
    template <class IsParticle, class CellsOf>
    void look(const IsParticle& is_particle, const CellsOf& cells_of) {
        parallel_for(std::size_t(threads_), threads_, [&](std::size_t t, int) {
            Met& mine = met_[t];
            // Indices of the blocks around the origin block, or no_particle for a block whose index is not known yet.
            // Particles that are neighbours in memory mostly have the same origin block.
            std::array<std::uint32_t, BlockCells::far + 1> around;
            around.fill(no_particle);
            std::uint64_t origin = 0;
            for (std::size_t first = first_of(t), end = first_of(t + 1); first < end; first += pack_size) {
                BlockCells cells;
                const std::size_t count = std::min<std::size_t>(pack_size, end - first);
                cells_of(first, count, cells);
                std::copy_n(cells.cell, count, cell_of_ + first);
                for (std::size_t l = 0; l < count; ++l) {
                    if (!is_particle(first + l)) {
                        number_of_[first + l] = no_particle;
                        continue;
                    }
                    if (cells.origin[l] != origin) around.fill(no_particle);
                    origin = cells.origin[l];
                    std::uint32_t& number = around[cells.beside[l]];
                    if (number == no_particle || cells.beside[l] == BlockCells::far) {
                        number = mine.blocks.number(cells.block[l]);
                        if (number == mine.counts.size()) mine.counts.push_back(0);
                    }
                    ++mine.counts[number];
                    number_of_[first + l] = number;
                }
            }
        });
    }

    /// Does the second to fourth steps of the sort and returns the partition. look() must be called before.
    /// \param colours  number of colours of dense blocks along an axis. \see colours_along_axis
    BlockPartition<D> partition(int colours);

private:
    // The blocks that one thread has met. Each object has cache lines of its own.
    struct alignas(64) Met {
        BlockNumbers blocks;
        std::vector<std::size_t> counts;  // particles per block
        std::size_t first = 0;            // index of the thread's first block among the blocks of all threads
    };

    /// Returns the first of the indices that thread t processes. The last of them is first_of(t + 1) − 1.
    std::size_t first_of(std::size_t t) const {
        if (t == std::size_t(threads_)) return candidates_;
        return candidates_ * t / std::size_t(threads_) / pack_size * pack_size;
    }

    /// The second step: returns all blocks that contain particles, sorted by key, with the number of particles in each.
    std::vector<BlockRange<D>> blocks_in_order();

    /// The third step: sorts the indices of particles by range (the particles of one block), and within a range by
    /// index. Within a range, particles that thread t counted follow those that thread t − 1 counted.
    void place_by_block(const BlockPartition<D>& partition);

    /// The fourth step: sorts the particles of each range by cell and id, and writes the result to partition.order.
    void order_by_cell(BlockPartition<D>& partition) const;

    /// Sorts some particles of a pack by their ids: the `count` particles from lane `first` on. The rank of a particle,
    /// its place in the sorted order, is the number of smaller ids. Ids are compared in SIMD lanes, without branches
    /// that a processor could mispredict.
    FIRN_INLINE static void order_few(std::uint32_t* places, const std::uint32_t* ids, std::size_t first,
                                      std::size_t count) {
        using Pack [[gnu::vector_size(4 * pack_size)]] = std::uint32_t;
        constexpr Pack lanes{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
        constexpr std::size_t half = pack_size / 2;
        Pack id, rank{};
        std::memcpy(&id, ids, sizeof id);
        id |= Pack(lanes - std::uint32_t(first) >= std::uint32_t(count));  // other lanes get the highest id
        alignas(64) std::uint32_t each[2 * pack_size], place[pack_size];
        std::memcpy(each, &id, sizeof id);
        std::fill_n(each + pack_size, pack_size, no_particle);
        for (std::size_t i = 0; i < half; ++i) rank -= Pack(each[first + i] < id);
        if (count > half)
            for (std::size_t i = half; i < pack_size; ++i) rank -= Pack(each[first + i] < id);
        std::memcpy(each, &rank, sizeof rank);
        std::memcpy(place, places, sizeof place);
        for (std::size_t i = first; i < first + count; ++i) places[first + each[i]] = place[i];
    }

    std::size_t candidates_;
    const std::uint32_t* ids_;
    int threads_;
    std::vector<Met> met_;
    std::uint32_t* number_of_;  // per particle: index of its block among the thread's blocks; no_particle for padding
    std::uint32_t* by_block_;   // indices of particles, range by range
    std::uint8_t* cell_of_;
    // per block of each thread: at first the number of particles, later the next index in by_block_
    std::vector<std::size_t> places_;
    std::vector<std::uint32_t> block_of_;   // per block of each thread: index of the block among the sorted blocks
    std::vector<std::size_t> first_place_;  // per range: index in by_block_ of its first particle
};

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES
#include <firn/sort/block_sort-inl.hpp>
#endif
