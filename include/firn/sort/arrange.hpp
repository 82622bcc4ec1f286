/// \file Gives the blocks of particles their slots, and chooses the phases in which groups of blocks are scattered.
#pragma once

#include <firn/data/block_partition.hpp>
#include <firn/sort/radix_sort.hpp>

#include <algorithm>

namespace firn::inline FIRN_BUILD {

/// A phase should have at least about this many cubes (groups of sparse blocks). If phases have many more cubes, the
/// nodes of a phase leave the cache before the next phase uses them. If phases have fewer cubes, threads wait for each
/// other too often.
inline constexpr std::size_t cubes_of_phase = 64;

/// Chooses the phases in which cubes of sparse blocks are scattered. Cubes of the same phase may be scattered at the
/// same time, because they never scatter to a common node.
///
/// If each colour of cubes were one phase, each phase would pass through the whole grid. Instead, space is divided into
/// bands of cubes, and the phases go through one band after the other, so that the cache still contains most nodes. Of
/// two cubes that are neighbours along an axis, the one with the even coordinate always comes first, so that sums are
/// always formed in the same order. Therefore a cube with an odd coordinate belongs to the same band as the next cube.
template <int D>
class Waves {
public:
    /// Divides space into bands.
    /// \param cubes  coordinates of all cubes that contain particles, each once
    explicit Waves(const std::vector<BlockCoordinate<D>>& cubes) {
        shift_.fill(one_band);
        std::size_t bands = cubes.size() / (cubes_of_phase << D);  // upper limit of the number of bands
        for (std::size_t a = 0; a + 1 < D && bands > 1; ++a) {
            const auto [low, high] = std::minmax_element(
                cubes.begin(), cubes.end(), [a](const auto& one, const auto& other) { return one[a] < other[a]; });
            const auto count = [&, first = pair((*low)[a]), last = pair((*high)[a])] {
                return std::size_t((last >> shift_[a]) - (first >> shift_[a]) + 1);
            };
            for (shift_[a] = 0; count() > bands;) ++shift_[a];
            bands /= count();
        }
    }
    /// Returns the id of the phase in which a cube is scattered. The phases are scattered in increasing order of their
    /// ids. The arenas of two cubes of the same phase never overlap.
    std::uint64_t phase(const BlockCoordinate<D>& cube) const {
        BlockCoordinate<D> turn{};
        for (std::size_t a = 0; a < D; ++a) turn[a] = 2 * (pair(cube[a]) >> shift_[a]) + (cube[a] & 1);
        return block_key<D>(turn);
    }

private:
    static constexpr int one_band = 30;
    /// Returns the index, along an axis, of a pair of cubes: a cube with an odd coordinate and the next cube, which has
    /// an even coordinate. \param coordinate  coordinate of one of the two cubes
    static int pair(int coordinate) { return (coordinate + 1) >> 1; }

    std::array<int, std::size_t(D)> shift_;
};

/// Returns a partition, made from the number of particles in each block: chooses groups, slots and phases. The order of
/// particles is not known yet, so partition.order is no_particle in each slot.
/// \param sorted         one range for each block that has particles, sorted by the blocks' keys; first_slot is ignored
/// \param dense_colours  number of colours of dense blocks along an axis. \see colours_along_axis
/// \param threads        number of threads; 0: thread_count() chooses
template <int D>
[[gnu::cold]] BlockPartition<D> arrange(const std::vector<BlockRange<D>>& sorted, int dense_colours, int threads = 0) {
    BlockPartition<D> partition;
    partition.ranges.reserve(sorted.size());
    partition.by_block.resize(sorted.size());
    std::size_t slots = 0;
    // number_of(k) is the index in `sorted` of the k-th block of the group
    const auto add_group = [&](std::size_t blocks, bool sparse, const auto& number_of) {
        BlockGroup group{std::uint32_t(partition.ranges.size()), std::uint32_t(blocks), slots, 0, sparse};
        for (std::size_t k = 0; k < blocks; ++k) {
            const std::uint32_t number = number_of(k);
            partition.by_block[number] = std::uint32_t(partition.ranges.size());
            partition.ranges.push_back(sorted[number]);
            partition.ranges.back().first_slot = slots + group.particles;
            group.particles += sorted[number].particles;
        }
        slots += group.packs() * pack_size;
        partition.particles += group.particles;
        partition.groups.push_back(group);
        return std::uint32_t(partition.groups.size() - 1);
    };
    auto add_to_phase = [&, last = ~std::uint64_t(0)](std::uint64_t phase, std::uint32_t group) mutable {
        if (phase != last) partition.phase_ends.emplace_back();
        last = phase;
        partition.by_phase.push_back(group);
        partition.phase_ends.back() = partition.by_phase.size();
    };

    RadixSort<std::uint64_t> dense, sparse;  // dense: groups, with colours as keys; sparse: blocks, with cubes as keys
    for (std::uint32_t i = 0; i < sorted.size(); ++i) {
        BlockCoordinate<D> block = sorted[i].block;
        if (sorted[i].particles > sparse_particles) {
            dense.items.push_back(
                {block_colour<D>(block, dense_colours), add_group(1, false, [i](std::size_t) { return i; })});
        } else {
            for (int& coordinate : block) coordinate >>= 1;
            sparse.items.push_back({block_key<D>(block), i});
        }
    }
    dense.sort();
    for (const auto& group : dense.items) add_to_phase(group.key, group.number);

    sparse.sort();
    const auto& by_cube = sparse.items;
    std::vector<BlockCoordinate<D>> cubes;
    RadixSort<std::uint64_t> by_phase;  // for each cube, the index in by_cube of its first block; the keys are phases
    for (std::uint32_t i = 0; i < by_cube.size(); ++i)
        if (i == 0 || by_cube[i].key != by_cube[i - 1].key) {
            cubes.push_back(block_of_key<D>(by_cube[i].key));
            by_phase.items.push_back({0, i});
        }
    const Waves<D> waves(cubes);
    for (std::size_t c = 0; c < cubes.size(); ++c) by_phase.items[c].key = waves.phase(cubes[c]);
    by_phase.sort();
    for (const auto& cube : by_phase.items) {
        const std::size_t first = cube.number;
        std::size_t last = first;
        while (last < by_cube.size() && by_cube[last].key == by_cube[first].key) ++last;
        add_to_phase(cube.key, add_group(last - first, true, [&](std::size_t k) { return by_cube[first + k].number; }));
    }
    grow(partition.order, slots, no_particle, thread_count(threads));
    return partition;
}

}  // namespace firn::inline FIRN_BUILD
