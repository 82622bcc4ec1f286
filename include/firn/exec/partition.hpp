/// \file Sorting particles into blocks: a stable counting sort, parallel, the same order for any number of threads.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/data/arrange.hpp>
#include <firn/data/block_numbers.hpp>
#include <firn/data/check_particles.hpp>
#include <firn/data/particles.hpp>
#include <firn/data/radix_sort.hpp>

#include <algorithm>
#include <memory>
#include <numeric>

namespace firn {

/// Where the base nodes of up to sixteen particles are.
struct BlockCells {
    static constexpr int far = 27;

    std::uint64_t origin[pack_size];  ///< keys of the blocks from whose lower corners they were counted
    std::uint64_t block[pack_size];   ///< keys
    std::uint8_t beside[pack_size];   ///< number of the block among the 3^D around its origin, or far
    std::uint8_t cell[pack_size];     ///< numbers in the block, first axis fastest: see find_cells
};

/// Cells are numbered along the first axis first: the rows of nodes of one cell and the next, which lie along the last
/// axis, then begin at the same places. P2G reads what it has just stored, and a processor hands on at once only what
/// is read as it was stored.
/// \param base  the base nodes, counted from the lower corners of to.origin
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

/// Bytes that partition_by writes for each place.
inline constexpr std::size_t sort_room = 2 * sizeof(std::uint32_t) + sizeof(std::uint8_t);

/// Sorts particles by block, then by cell, and gathers blocks into groups. Nothing is moved: the result is an order.
/// \param colours     of dense blocks along an axis. \see colours_along_axis
/// \param candidates  number of places to look at
/// \param room        sort_room bytes a place, aligned as std::uint32_t, that nobody else uses
/// \param is_particle is_particle(i): does place i hold a particle (or padding) ?
/// \param cells_of    cells_of(i, count, cells) finds those of `count` ≤ pack_size places from i on, a multiple of
///                    pack_size
template <int D, class IsParticle, class CellsOf>
BlockPartition<D> partition_by(int colours, std::size_t candidates, int threads, std::byte* room,
                               const IsParticle& is_particle, const CellsOf& cells_of) {
    threads = int(std::min<std::size_t>(std::size_t(thread_count(threads)), candidates / 4096 + 1));
    const auto first_of = [&](std::size_t t) {
        if (t == std::size_t(threads)) return candidates;
        return candidates * t / std::size_t(threads) / pack_size * pack_size;
    };

    struct alignas(64) Met {  // by one thread; no line of the cache is two threads'
        BlockNumbers blocks;
        std::vector<std::size_t> counts;  // of particles, a block each
        std::size_t first = 0;            // of its blocks, among those of all threads
    };
    std::vector<Met> met{std::size_t(threads)};
    auto* const number_of = reinterpret_cast<std::uint32_t*>(room);  // of blocks; no_particle
    std::uint32_t* const by_block = number_of + candidates;
    auto* const cell_of = reinterpret_cast<std::uint8_t*>(by_block + candidates);
    parallel_for(std::size_t(threads), threads, [&](std::size_t t, int) {
        Met& mine = met[t];
        // Numbers of the blocks around one origin, which neighbours in memory mostly share; no_particle: not known yet.
        std::array<std::uint32_t, BlockCells::far + 1> around;
        around.fill(no_particle);
        std::uint64_t origin = 0;
        for (std::size_t first = first_of(t), end = first_of(t + 1); first < end; first += pack_size) {
            BlockCells cells;
            const std::size_t count = std::min<std::size_t>(pack_size, end - first);
            cells_of(first, count, cells);
            std::copy_n(cells.cell, count, cell_of + first);
            for (std::size_t l = 0; l < count; ++l) {
                if (!is_particle(first + l)) {
                    number_of[first + l] = no_particle;
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
                number_of[first + l] = number;
            }
        }
    });

    RadixSort<std::uint64_t> by_key;  // blocks of all threads
    std::vector<std::size_t> places;  // their counts of particles; then where the next of each goes in by_block
    for (Met& m : met) {
        m.first = places.size();
        for (const std::uint64_t key : m.blocks.keys())
            by_key.items.push_back({key, std::uint32_t(by_key.items.size())});
        places.insert(places.end(), m.counts.begin(), m.counts.end());
    }
    by_key.sort();
    const auto& blocks = by_key.items;
    std::vector<BlockRange<D>> sorted;
    std::vector<std::uint32_t> range_of(blocks.size());
    for (std::size_t i = 0; i < blocks.size(); ++i) {
        if (i == 0 || blocks[i].key != blocks[i - 1].key) sorted.push_back({block_of_key<D>(blocks[i].key), 0, 0});
        sorted.back().particles += places[blocks[i].number];
        range_of[blocks[i].number] = std::uint32_t(sorted.size() - 1);
    }
    BlockPartition<D> partition = arrange<D>(sorted, colours, threads);

    // Within a range, thread t's particles follow those of thread t − 1: the order of a serial stable sort.
    std::vector<std::size_t> first_place(sorted.size()), next;  // in by_block
    for (std::size_t r = 1; r < sorted.size(); ++r)
        first_place[r] = first_place[r - 1] + partition.ranges[r - 1].particles;
    next = first_place;
    for (std::size_t n = 0; n < places.size(); ++n) {
        std::size_t& place = next[partition.by_block[range_of[n]]];
        const std::size_t begin = place;
        place += places[n];
        places[n] = begin;
    }
    parallel_for(std::size_t(threads), threads, [&](std::size_t t, int) {
        std::size_t* const place = places.data() + met[t].first;
        for (std::size_t i = first_of(t), end = first_of(t + 1); i < end; ++i)
            if (number_of[i] != no_particle) by_block[place[number_of[i]]++] = std::uint32_t(i);
    });

    const auto sort_by_cell = [&](std::size_t r, int) {
        const BlockRange<D>& range = partition.ranges[r];
        const std::uint32_t* from = by_block + first_place[r];
        std::uint32_t* to = partition.order.data() + range.first_slot;
        std::uint32_t first[block_nodes<D> + 1] = {};
        for (std::size_t i = 0; i < range.particles; ++i) ++first[cell_of[from[i]] + 1];
        for (int c = 0; c < block_nodes<D>; ++c) first[c + 1] += first[c];
        for (std::size_t i = 0; i < range.particles; ++i) to[first[cell_of[from[i]]]++] = from[i];
    };
    parallel_for(partition.ranges.size(), threads, sort_by_cell, 16);
    return partition;
}

/// For firn's own particles.
/// \param room  \see partition_by
template <class Kernel, std::floating_point S, int D, class State>
BlockPartition<D> partition_particles(const Particles<S, D, State>& particles, int threads, std::byte* room) {
    const Domain<D>& domain = particles.domain();
    const bool periodic = is_periodic(domain);
    for (int a = 0; a < D; ++a)
        if (block_period(domain, a) % colours_along_axis<Kernel> != 0)
            throw parameter_error(sentence("The domain has ", domain.cells(a), " cells along the periodic axis ", a,
                                           "; with a kernel of support ", Kernel::support,
                                           " their number must be a multiple of ",
                                           periodic_multiple * colours_along_axis<Kernel>, "."));
    return partition_by<D>(
        colours_along_axis<Kernel>, particles.slots(), threads, room,
        [&](std::size_t i) { return particles.is_particle(i); },
        [&](std::size_t first, std::size_t count, BlockCells& cells) {
            using P = native_pack<S>;
            S base[D][pack_size];
            const S* places = particles.places_of_pack(first);
            for (int a = 0; a < D; ++a)
                for (int lane = 0; lane < pack_size; lane += scalar_traits<P>::lanes)
                    base_node<Kernel>(P::load(places + a * pack_size + lane)).store(base[a] + lane);
            for (std::size_t l = 0; l < pack_size; ++l)
                cells.origin[l] = l < count && particles.is_particle(first + l) ? particles.block_key_of(first + l) : 0;
            find_cells<S, D>(base, cells);
            if (periodic)
                for (std::uint64_t& block : cells.block) block = wrapped_key(domain, block);
        });
}

template <class Kernel, std::floating_point S, int D, class State>
BlockPartition<D> partition_particles(const Particles<S, D, State>& particles, int threads = 0) {
    const auto room = std::make_unique_for_overwrite<std::byte[]>(particles.slots() * sort_room);
    return partition_particles<Kernel>(particles, threads, room.get());
}

/// For a foreign program's particles.
/// \throws particle_error for a position that is not finite or lies outside the domain, and for masses that are not
///         positive, where the view has masses (listed by index)
template <class Kernel, std::floating_point S, int D, class State>
BlockPartition<D> partition_particles(const ParticleView<S, D, StridedSpan<S>, State>& view, std::size_t count,
                                      const Domain<D>& domain, int threads = 0) {
    check(domain);
    if (is_periodic(domain))
        throw parameter_error(
            "The domain is periodic, which arrays of a foreign program cannot be: use firn's Particles or Simulation.");
    check_positions<S, D>(count, domain, [&](std::size_t i, int a) { return view.position.particle(i, a); });
    if (view.mass.data) check_masses<S>(count, [&](std::size_t i) { return view.mass.particle(i, 0); });
    const S per_cell = S(1 / domain.cell_size);
    const auto room = std::make_unique_for_overwrite<std::byte[]>(count * sort_room);
    return partition_by<D>(
        colours_along_axis<Kernel>, count, threads, room.get(), [](std::size_t) { return true; },
        [&](std::size_t first, std::size_t used, BlockCells& cells) {
            S base[D][pack_size] = {};
            std::fill_n(cells.origin, pack_size, block_key<D>({}));
            for (std::size_t l = 0; l < used; ++l)
                for (int a = 0; a < D; ++a)
                    base[a][l] =
                        base_node<Kernel>((view.position.particle(first + l, a) - S(domain.lower[a])) * per_cell);
            find_cells<S, D>(base, cells);
        });
}

/// Calls body(group, thread) for all groups, phase after phase; those of one phase share no node.
template <int D, class Body>
void for_groups_by_phase(const BlockPartition<D>& partition, int threads, const Body& body) {
    const std::vector<std::size_t>& ends = partition.phase_ends;
    std::vector<std::size_t> counts(ends.size());
    std::adjacent_difference(ends.begin(), ends.end(), counts.begin());
    parallel_phases(counts, threads, [&](std::size_t phase, std::size_t i, int thread) {
        body(partition.groups[partition.by_phase[ends[phase] - counts[phase] + i]], thread);
    });
}

/// Sorts firn's own particles and moves them into that order.
template <class Kernel, std::floating_point S, int D, class State>
BlockPartition<D> sort_particles(Particles<S, D, State>& particles, int threads = 0) {
    static_assert(D * D * sizeof(S) >= sort_room);
    const int workers = thread_count(threads);
    BlockPartition<D> partition;
    parallel_region(workers, [&] {
        partition = partition_particles<Kernel>(particles, workers, particles.room());
        particles.reorder(partition, workers);
    });
    return partition;
}

}  // namespace firn
