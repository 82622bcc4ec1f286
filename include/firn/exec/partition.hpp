/// \file Sorting particles into blocks: a stable counting sort, parallel, the same order for any number of threads.
#pragma once

#include <firn/data/arrange.hpp>
#include <firn/data/block_numbers.hpp>
#include <firn/data/check_particles.hpp>
#include <firn/data/particles.hpp>
#include <firn/exec/parallel.hpp>

#include <algorithm>
#include <numeric>

namespace firn {

/// A block, and a cell in it: where a particle's base node is.
struct BlockCell {
    std::uint64_t block;  ///< its key
    std::uint8_t cell;    ///< its number in the block, last axis fastest
};

/// \param base  the base node, counted from the lower corner of the block whose key is `origin`
template <std::floating_point S, int D>
FIRN_INLINE BlockCell block_cell(const Vec<S, D>& base, std::uint64_t origin) {
    int cell = 0;
    unroll<D>([&](auto a) FIRN_LAMBDA {
        const int node = int(base.v[a]);
        origin += std::uint64_t(std::int64_t(node >> 2)) << 21 * (D - 1 - a);
        cell = cell * block_size + (node & (block_size - 1));
    });
    return {origin, std::uint8_t(cell)};
}

/// Sorts particles by block, then by cell, and gathers blocks into groups. Nothing is moved: the result is an order.
/// \param colours     of dense blocks along an axis. \see colours_along_axis
/// \param candidates  number of places to look at
/// \param is_particle is_particle(i): does place i hold a particle (or padding) ?
/// \param place_of    place_of(i) → BlockCell
template <int D, class IsParticle, class PlaceOf>
BlockPartition<D> partition_by(int colours, std::size_t candidates, int threads, const IsParticle& is_particle,
                               const PlaceOf& place_of) {
    threads = int(std::min<std::size_t>(std::size_t(thread_count(threads)), candidates / 4096 + 1));
    const auto first_of = [&](std::size_t t) { return candidates * t / std::size_t(threads); };

    struct Met {  // by one thread
        BlockNumbers blocks;
        std::vector<std::size_t> counts;  // of particles, a block each; then the next slot of each
        std::vector<std::uint32_t> range;
    };
    std::vector<Met> met{std::size_t(threads)};
    std::vector<std::uint32_t> number_of(candidates, no_particle);
    std::vector<std::uint8_t> cell_of(candidates);
    parallel_for(std::size_t(threads), threads, [&](std::size_t t, int) {
        Met& mine = met[t];
        for (std::size_t i = first_of(t), end = first_of(t + 1); i < end; ++i) {
            if (!is_particle(i)) continue;
            const BlockCell place = place_of(i);
            const std::uint32_t number = mine.blocks.number(place.block);
            if (number == mine.counts.size()) mine.counts.push_back(0);
            ++mine.counts[number];
            number_of[i] = number;
            cell_of[i] = place.cell;
        }
    });

    std::vector<std::uint64_t> keys;
    for (const Met& m : met) keys.insert(keys.end(), m.blocks.keys().begin(), m.blocks.keys().end());
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    std::vector<BlockRange<D>> sorted(keys.size());
    for (std::size_t k = 0; k < keys.size(); ++k) sorted[k] = {block_of_key<D>(keys[k]), 0, 0};
    for (Met& m : met)
        for (std::size_t n = 0; n < m.blocks.size(); ++n) {
            const auto k = std::lower_bound(keys.begin(), keys.end(), m.blocks.key(n)) - keys.begin();
            m.range.push_back(std::uint32_t(k));
            sorted[std::size_t(k)].particles += m.counts[n];
        }
    BlockPartition<D> partition = arrange<D>(sorted, colours);

    // Within a range, thread t's particles follow those of thread t − 1: the order of a serial stable sort.
    std::vector<std::size_t> next(keys.size());
    for (std::size_t r = 0; r < keys.size(); ++r) next[r] = partition.ranges[r].first_slot;
    for (Met& m : met)
        for (std::size_t n = 0; n < m.blocks.size(); ++n) {
            std::size_t& place = next[partition.by_block[m.range[n]]];
            const std::size_t begin = place;
            place += m.counts[n];
            m.counts[n] = begin;
        }
    std::vector<std::uint32_t> by_block(partition.order.size());
    parallel_for(std::size_t(threads), threads, [&](std::size_t t, int) {
        for (std::size_t i = first_of(t), end = first_of(t + 1); i < end; ++i)
            if (number_of[i] != no_particle) by_block[met[t].counts[number_of[i]]++] = std::uint32_t(i);
    });

    const auto sort_by_cell = [&](std::size_t r, int) {
        const BlockRange<D>& range = partition.ranges[r];
        const std::uint32_t* from = by_block.data() + range.first_slot;
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
template <class Kernel, std::floating_point S, int D, class State>
BlockPartition<D> partition_particles(const Particles<S, D, State>& particles, int threads = 0) {
    const Domain<D>& domain = particles.domain();
    const bool periodic = is_periodic(domain);
    for (int a = 0; a < D; ++a)
        if (block_period(domain, a) % colours_along_axis<Kernel> != 0)
            throw parameter_error(sentence("The domain has ", domain.cells(a), " cells along the periodic axis ", a,
                                           "; with a kernel of support ", Kernel::support,
                                           " their number must be a multiple of ",
                                           periodic_multiple * colours_along_axis<Kernel>, "."));
    return partition_by<D>(
        colours_along_axis<Kernel>, particles.slots(), threads, [&](std::size_t i) { return particles.is_particle(i); },
        [&](std::size_t i) {
            Vec<S, D> base = particles.place(i);
            for (int a = 0; a < D; ++a) base[a] = base_node<Kernel>(base[a]);
            BlockCell place = block_cell(base, particles.block_key_of(i));
            if (periodic) place.block = wrapped_key(domain, place.block);
            return place;
        });
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
    return partition_by<D>(
        colours_along_axis<Kernel>, count, threads, [](std::size_t) { return true; },
        [&](std::size_t i) {
            Vec<S, D> base{};
            for (int a = 0; a < D; ++a)
                base[a] = base_node<Kernel>((view.position.particle(i, a) - S(domain.lower[a])) * per_cell);
            return block_cell(base, block_key<D>({}));
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
    BlockPartition<D> partition = partition_particles<Kernel>(particles, threads);
    particles.reorder(partition, [&](std::size_t n, const auto& body) {
        parallel_for(n, thread_count(threads), [&](std::size_t i, int) { body(i); }, 64);
    });
    return partition;
}

}  // namespace firn
