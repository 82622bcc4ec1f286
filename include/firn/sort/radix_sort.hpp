/// \file Sorts integers by keys. The sort is stable and parallel, and gives the same order for any number of threads.
#pragma once

#include <firn/data/aligned.hpp>

#include <algorithm>
#include <bit>
#include <concepts>
#include <cstdint>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// An item to sort: an integer (such as an index) and the key by which this integer is sorted.
template <std::unsigned_integral Key>
struct Keyed {
    Key key;               ///< the key by which the item is sorted
    std::uint32_t number;  ///< the integer that belongs to the key
};

/// A list of items, and a radix sort of this list by key. The sort consists of several passes. Each pass is a counting
/// sort by a group of bits, the lowest bits first (Knuth, vol. 3, §5.2.5). The object keeps its memory for the next
/// sort.
template <std::unsigned_integral Key>
class RadixSort {
public:
    aligned_vector<Keyed<Key>> items;  ///< the items to sort: set by the caller, sorted by sort()

    /// Sorts the items by key. Items with equal keys keep their order.
    /// \param differ   mask of the bits in which keys may differ; all other bits are the same in all keys
    /// \param workers  number of workers, at least 1
    [[gnu::noinline]] void sort(Key differ, int workers) {
        // The largest number of bits per pass. It is so small that the counters fit into a core's own cache and are not
        // many more than the items.
        const int most_bits = std::clamp(int(std::bit_width(items.size())), 4, 12);
        const std::size_t n = items.size(), parts = std::min<std::size_t>(std::size_t(workers), n / 4096 + 1);
        const auto first = [&](std::size_t part) { return n * part / parts; };
        renew(other_, n, workers);
        while (differ != 0) {
            const int shift = std::countr_zero(differ);
            const std::size_t buckets = std::size_t(1)
                                        << std::min(most_bits, int(std::bit_width(Key(differ >> shift))));
            const auto bucket = [&](const Keyed<Key>& item) { return std::size_t(item.key >> shift) & (buckets - 1); };
            next_.assign(parts * buckets, 0);
            parallel_for(parts, workers, [&](std::size_t part, int) {
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
            parallel_for(parts, workers, [&](std::size_t part, int) {
                std::uint32_t* const next = next_.data() + part * buckets;
                for (std::size_t k = first(part), end = first(part + 1); k < end; ++k)
                    other_[next[bucket(items[k])]++] = items[k];
            });
            items.swap(other_);
            differ &= Key(~(Key(buckets - 1) << shift));
        }
    }
    /// Sorts the items by key, on the calling thread alone. Items with equal keys keep their order.
    [[gnu::noinline]] void sort() {
        Key differ = 0;
        for (const Keyed<Key>& item : items) differ |= item.key ^ items[0].key;
        sort(differ, 1);
    }

private:
    aligned_vector<Keyed<Key>> other_;
    std::vector<std::uint32_t> next_;
};

}  // namespace firn::inline FIRN_BUILD
