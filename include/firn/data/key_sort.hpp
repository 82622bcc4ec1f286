/// \file Sorting by keys of 64 bits, in a time that grows as the length of the list.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace firn {

struct Keyed {
    std::uint64_t key;
    std::uint32_t number;
};

/// Sorts by key; what has the same key stays in its order. A radix sort from the lowest digit on (Knuth, vol. 3,
/// §5.2.5), of those bits alone in which keys differ.
/// \param key_of  key_of(item), a std::uint64_t
template <class Item, class KeyOf>
void sort_by_key(std::vector<Item>& list, const KeyOf& key_of) {
    constexpr int bits = 8;
    constexpr std::uint64_t digits = 1 << bits;
    std::uint64_t differ = 0;
    for (const Item& item : list) differ |= key_of(item) ^ key_of(list[0]);
    std::vector<Item> sorted(list.size());
    while (differ != 0) {
        const int shift = std::countr_zero(differ);
        const auto digit = [&](const Item& item) { return std::size_t(key_of(item) >> shift & (digits - 1)); };
        std::array<std::size_t, digits> place{};
        for (const Item& item : list) ++place[digit(item)];
        std::size_t before = 0;
        for (std::size_t& first : place) before += std::exchange(first, before);
        for (const Item& item : list) sorted[place[digit(item)]++] = item;
        list.swap(sorted);
        differ &= ~((digits - 1) << shift);
    }
}
inline void sort_by_key(std::vector<Keyed>& list) {
    sort_by_key(list, [](const Keyed& item) { return item.key; });
}

}  // namespace firn
