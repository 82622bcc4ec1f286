/// \file Sorting numbers by key: stable, parallel, the same order for any number of threads.
#pragma once

#include <firn/data/aligned.hpp>
#include <firn/exec/parallel.hpp>

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <vector>

namespace firn {

template <std::unsigned_integral Key>
struct Keyed {
    Key key;
    std::uint32_t place;
};

/// Counting sorts by groups of bits, the lowest first. Keeps its memory for the next time.
template <std::unsigned_integral Key>
class RadixSort {
public:
    aligned_vector<Keyed<Key>> items;  ///< to be filled; then in order

    /// \param bits  all keys are below 2^bits
    void sort(int bits, int threads) {
        constexpr int most_bits = 12;  // counters that stay in a core's own cache
        const int passes = (bits + most_bits - 1) / most_bits;
        const std::size_t n = items.size(), parts = std::min<std::size_t>(std::size_t(threads), n / 4096 + 1);
        const auto first = [&](std::size_t part) { return n * part / parts; };
        other_.resize(n);
        for (int pass = 0, shift = 0; pass < passes; ++pass) {
            const int width = (bits - shift + passes - pass - 1) / (passes - pass);
            const std::size_t buckets = std::size_t(1) << width;
            const auto bucket = [&](const Keyed<Key>& item) { return std::size_t(item.key >> shift) & (buckets - 1); };
            next_.assign(parts * buckets, 0);
            parallel_for(parts, threads, [&](std::size_t part, int) {
                std::uint32_t* const count = next_.data() + part * buckets;
                for (std::size_t k = first(part), end = first(part + 1); k < end; ++k) ++count[bucket(items[k])];
            });
            std::uint32_t sum = 0;
            for (std::size_t b = 0; b < buckets; ++b)
                for (std::size_t part = 0; part < parts; ++part) {
                    std::uint32_t& at = next_[part * buckets + b];
                    const std::uint32_t count = at;
                    at = sum;
                    sum += count;
                }
            parallel_for(parts, threads, [&](std::size_t part, int) {
                std::uint32_t* const next = next_.data() + part * buckets;
                for (std::size_t k = first(part), end = first(part + 1); k < end; ++k)
                    other_[next[bucket(items[k])]++] = items[k];
            });
            items.swap(other_);
            shift += width;
        }
    }

private:
    aligned_vector<Keyed<Key>> other_;
    std::vector<std::uint32_t> next_;
};

}  // namespace firn
