/// \file Sorting particles into blocks: a stable counting sort, parallel, the same order for any number of threads.
#pragma once

#include <firn/data/block_partition.hpp>
#include <firn/data/check_particles.hpp>
#include <firn/data/particle_view.hpp>
#include <firn/exec/parallel.hpp>

#include <algorithm>

namespace firn {

namespace detail {

/// Numbers the keys that one thread meets, in the order in which it meets them.
class KeyNumbers {
public:
    std::uint32_t number(std::uint64_t key) {
        if (key == last_key_ && !keys.empty()) return last_number_;
        if (2 * (keys.size() + 1) > table_.size()) grow();
        std::size_t i = std::size_t((key * 0x9e3779b97f4a7c15ull) >> 32);
        for (;; ++i) {
            std::uint32_t& entry = table_[i & (table_.size() - 1)];
            if (entry == no_particle) {
                entry = std::uint32_t(keys.size());
                keys.push_back(key);
                counts.push_back(0);
            }
            if (keys[entry] == key) {
                last_key_ = key;
                return last_number_ = entry;
            }
        }
    }

    std::vector<std::uint64_t> keys;
    std::vector<std::size_t> counts;

private:
    void grow() {
        table_.assign(table_.empty() ? 256 : 2 * table_.size(), no_particle);
        for (std::uint32_t n = 0; n < keys.size(); ++n) {
            std::size_t i = std::size_t((keys[n] * 0x9e3779b97f4a7c15ull) >> 32);
            while (table_[i & (table_.size() - 1)] != no_particle) ++i;
            table_[i & (table_.size() - 1)] = n;
        }
    }
    std::vector<std::uint32_t> table_;
    std::uint64_t last_key_ = ~std::uint64_t(0);
    std::uint32_t last_number_ = 0;
};

}  // namespace detail

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

    std::vector<detail::KeyNumbers> numbers{std::size_t(threads)};
    std::vector<std::uint32_t> number_of(candidates, no_particle);
    parallel_for(std::size_t(threads), threads, [&](std::size_t t, int) {
        for (std::size_t i = first_of(int(t)); i < first_of(int(t) + 1); ++i) {
            if (!is_particle(i)) continue;
            BlockCoordinate<D> block{};
            for (int a = 0; a < D; ++a)
                block[std::size_t(a)] = int(base_node<Kernel>((position(i, a) - S(domain.lower[a])) * per_cell)) >> 2;
            ++numbers[t].counts[number_of[i] = numbers[t].number(block_key<D>(block))];
        }
    });

    std::vector<std::uint64_t> keys;
    for (const auto& n : numbers) keys.insert(keys.end(), n.keys.begin(), n.keys.end());
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());

    BlockPartition<D> partition;
    partition.ranges.resize(keys.size());
    for (std::size_t r = 0; r < keys.size(); ++r) partition.ranges[r] = {block_of_key<D>(keys[r]), 0, 0};
    std::vector<std::vector<std::uint32_t>> range_of{std::size_t(threads)};
    for (std::size_t t = 0; t < std::size_t(threads); ++t)
        for (std::size_t n = 0; n < numbers[t].keys.size(); ++n) {
            const auto range = std::lower_bound(keys.begin(), keys.end(), numbers[t].keys[n]) - keys.begin();
            range_of[t].push_back(std::uint32_t(range));
            partition.ranges[std::size_t(range)].particles += numbers[t].counts[n];
        }
    std::size_t slots = 0;
    for (std::size_t r = 0; r < keys.size(); ++r) {
        BlockRange<D>& range = partition.ranges[r];
        range.first_slot = slots;
        slots += range.packs() * pack_size;
        partition.particles += range.particles;
        int colour = 0;
        for (int coordinate : range.block) colour = 2 * colour + (coordinate & 1);
        partition.colours[std::size_t(colour)].push_back(std::uint32_t(r));
    }
    // Within a range, thread t's particles follow those of thread t − 1: the order of a serial stable sort.
    std::vector<std::size_t> next(keys.size());
    for (std::size_t r = 0; r < keys.size(); ++r) next[r] = partition.ranges[r].first_slot;
    for (std::size_t t = 0; t < std::size_t(threads); ++t)
        for (std::size_t n = 0; n < numbers[t].keys.size(); ++n) {
            std::size_t& place = next[range_of[t][n]];
            const std::size_t begin = place;
            place += numbers[t].counts[n];
            numbers[t].counts[n] = begin;
        }
    partition.order.assign(slots, no_particle);
    parallel_for(std::size_t(threads), threads, [&](std::size_t t, int) {
        for (std::size_t i = first_of(int(t)); i < first_of(int(t) + 1); ++i)
            if (number_of[i] != no_particle) partition.order[numbers[t].counts[number_of[i]]++] = std::uint32_t(i);
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
