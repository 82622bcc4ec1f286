/// \file Sorting particles into blocks: a stable counting sort, parallel, the same order for any number of threads.
#pragma once

#include <firn/data/block_numbers.hpp>
#include <firn/data/block_partition.hpp>
#include <firn/data/check_particles.hpp>
#include <firn/data/particle_view.hpp>
#include <firn/exec/parallel.hpp>

#include <algorithm>

namespace firn {

/// Sorts particles by the block of their base node. Nothing is moved: the result is an order.
/// \param candidates  number of places to look at
/// \param is_particle is_particle(i): does place i hold a particle (or padding) ?
/// \param position    position(i, axis) [m]; finite and inside the domain
template <class Kernel, std::floating_point S, int D, class IsParticle, class Position>
BlockPartition<D> partition_particles(std::size_t candidates, const Domain<D>& domain, int threads,
                                      const IsParticle& is_particle, const Position& position) {
    threads = int(std::min<std::size_t>(std::size_t(thread_count(threads)), candidates / 4096 + 1));
    const S per_cell = S(1 / domain.cell_size);
    const auto first_of = [&](int t) { return candidates * std::size_t(t) / std::size_t(threads); };

    struct Met {  // by one thread
        BlockNumbers blocks;
        std::vector<std::size_t> counts;  // of particles, a block each; then the next slot of each
    };
    std::vector<Met> met{std::size_t(threads)};
    std::vector<std::uint32_t> number_of(candidates, no_particle);
    parallel_for(std::size_t(threads), threads, [&](std::size_t t, int) {
        for (std::size_t i = first_of(int(t)); i < first_of(int(t) + 1); ++i) {
            if (!is_particle(i)) continue;
            BlockCoordinate<D> block{};
            for (int a = 0; a < D; ++a)
                block[std::size_t(a)] = int(base_node<Kernel>((position(i, a) - S(domain.lower[a])) * per_cell)) >> 2;
            number_of[i] = met[t].blocks.number(block_key<D>(block));
            met[t].counts.resize(met[t].blocks.size());
            ++met[t].counts[number_of[i]];
        }
    });

    std::vector<std::uint64_t> keys;
    for (const Met& m : met) keys.insert(keys.end(), m.blocks.keys().begin(), m.blocks.keys().end());
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());

    BlockPartition<D> partition;
    partition.ranges.resize(keys.size());
    for (std::size_t r = 0; r < keys.size(); ++r) partition.ranges[r] = {block_of_key<D>(keys[r]), 0, 0};
    std::vector<std::vector<std::uint32_t>> range_of{std::size_t(threads)};
    for (std::size_t t = 0; t < std::size_t(threads); ++t)
        for (std::size_t n = 0; n < met[t].blocks.size(); ++n) {
            const auto range = std::lower_bound(keys.begin(), keys.end(), met[t].blocks.key(n)) - keys.begin();
            range_of[t].push_back(std::uint32_t(range));
            partition.ranges[std::size_t(range)].particles += met[t].counts[n];
        }
    std::size_t slots = 0;
    for (std::size_t r = 0; r < keys.size(); ++r) {
        BlockRange<D>& range = partition.ranges[r];
        range.first_slot = slots;
        slots += range.packs() * pack_size;
        partition.particles += range.particles;
        partition.colours[block_colour<D>(range.block)].push_back(std::uint32_t(r));
    }
    // Within a range, thread t's particles follow those of thread t − 1: the order of a serial stable sort.
    std::vector<std::size_t> next(keys.size());
    for (std::size_t r = 0; r < keys.size(); ++r) next[r] = partition.ranges[r].first_slot;
    for (std::size_t t = 0; t < std::size_t(threads); ++t)
        for (std::size_t n = 0; n < met[t].blocks.size(); ++n) {
            std::size_t& place = next[range_of[t][n]];
            const std::size_t begin = place;
            place += met[t].counts[n];
            met[t].counts[n] = begin;
        }
    partition.order.assign(slots, no_particle);
    parallel_for(std::size_t(threads), threads, [&](std::size_t t, int) {
        for (std::size_t i = first_of(int(t)); i < first_of(int(t) + 1); ++i)
            if (number_of[i] != no_particle) partition.order[met[t].counts[number_of[i]]++] = std::uint32_t(i);
    });
    return partition;
}

/// For a foreign program's particles.
/// \throws particle_error for a position that is not finite or lies outside the domain (listed by index)
template <class Kernel, std::floating_point S, int D, class State>
BlockPartition<D> partition_particles(const ParticleView<S, D, StridedSpan<S>, State>& view, std::size_t count,
                                      const Domain<D>& domain, int threads = 0) {
    check(domain);
    const auto position = [&](std::size_t i, int a) { return view.position.particle(i, a); };
    check_positions<S, D>(count, domain, position);
    return partition_particles<Kernel, S, D>(count, domain, threads, [](std::size_t) { return true; }, position);
}

}  // namespace firn
