/// \file Which rank owns which part of space: cuts of the curve through all cubes of blocks.
#pragma once

#include <firn/data/curve.hpp>

#include <algorithm>
#include <span>
#include <vector>

namespace firn::inline FIRN_BUILD::mpi {

/// Cuts of the curve through all cubes of blocks into one interval for each rank. \see curve_key
template <int D>
struct Cuts {
    /// For each rank, the key of its first cube. Rank r owns the cubes with first[r] ≤ key < first[r + 1]; the last
    /// rank owns all that follow. The keys ascend, and first[0] is 0; a rank whose key is that of the next owns
    /// nothing.
    std::vector<std::uint64_t> first{};

    bool operator==(const Cuts&) const = default;

    /// Returns the rank that owns the cube with this key. \see curve_key
    int owner_of_key(std::uint64_t key) const {
        return int(std::upper_bound(first.begin(), first.end(), key) - first.begin()) - 1;
    }
    /// Returns the rank that owns a block, given by its coordinates.
    int owner(const BlockCoordinate<D>& block) const { return owner_of_key(curve_key<D>(cube_of<D>(block))); }
};

/// The weight of a cube: how much work its particles are.
struct CubeWeight {
    std::uint64_t key;     ///< key of the cube. \see curve_key
    std::uint64_t weight;  ///< its weight, for example its number of particles

    /// Compares the keys.
    bool operator<(const CubeWeight& other) const { return key < other.key; }
};

namespace detail {

/// For sorted cubes: finds the weight of all cubes below a key.
class WeightBelow {
public:
    explicit WeightBelow(std::span<const CubeWeight> sorted) : cubes_(sorted), sums_(sorted.size() + 1) {
        for (std::size_t i = 0; i < sorted.size(); ++i) sums_[i + 1] = sums_[i] + sorted[i].weight;
    }
    std::uint64_t operator()(std::uint64_t key) const {
        const auto end = std::lower_bound(cubes_.begin(), cubes_.end(), CubeWeight{key, 0});
        return sums_[std::size_t(end - cubes_.begin())];
    }
    std::uint64_t total() const { return sums_.back(); }

private:
    std::span<const CubeWeight> cubes_;
    std::vector<std::uint64_t> sums_;
};

}  // namespace detail

/// Returns cuts that give each of `ranks` ranks about the same weight: rank r begins at the lowest key below which the
/// cubes have at least r/ranks of the whole weight. The keys are found by bisection, all at once.
/// \param cubes  weights of cubes, sorted by key (a key may be there several times); on many ranks, those that this
///               rank knows of
/// \param sum    sum(numbers) replaces each number by its sum over all ranks
template <int D, class Sum>
Cuts<D> balanced_cuts(std::span<const CubeWeight> cubes, int ranks, const Sum& sum) {
    const detail::WeightBelow below(cubes);
    std::uint64_t total = below.total();
    sum(std::span<std::uint64_t>(&total, 1));
    const std::size_t count = std::size_t(ranks);
    std::vector<std::uint64_t> low(count, 0), high(count, std::uint64_t(1) << curve_key_bits<D>), middle(count);
    for (int bit = 0; bit <= curve_key_bits<D>; ++bit) {
        std::vector<std::uint64_t> weight(count);
        for (std::size_t r = 1; r < count; ++r) {
            middle[r] = low[r] + (high[r] - low[r]) / 2;
            weight[r] = below(middle[r]);
        }
        sum(std::span<std::uint64_t>(weight));
        for (std::size_t r = 1; r < count; ++r) {
            if (low[r] == high[r]) continue;
            // weight[r] ≥ total r / ranks, without a product that could overflow
            const std::uint64_t whole = total / count, rest = total % count;
            if (weight[r] >= whole * r + (rest * r + count - 1) / count)
                high[r] = middle[r];
            else
                low[r] = middle[r] + 1;
        }
    }
    low[0] = 0;
    return {std::move(low)};
}

}  // namespace firn::inline FIRN_BUILD::mpi
