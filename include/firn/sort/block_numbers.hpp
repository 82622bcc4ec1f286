/// \file Gives blocks an index, in the order in which the blocks' keys first occur.
#pragma once

#include <firn/core/requirements.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Gives keys of blocks the indices 0, 1, 2, … in the order in which the keys first occur, by a hash table with open
/// addressing.
class BlockNumbers {
public:
    /// Returns how many keys have been given an index.
    std::size_t size() const { return keys_.size(); }
    /// Returns the key that has the index `number`.
    std::uint64_t key(std::size_t number) const { return keys_[number]; }
    /// Returns all keys, in the order of their indices.
    const std::vector<std::uint64_t>& keys() const { return keys_; }

    /// Returns the index of a key. A key that has no index yet gets the next free index.
    std::uint32_t number(std::uint64_t key) {
        if (!keys_.empty() && keys_[last_] == key) return last_;
        if (2 * (keys_.size() + 1) > table_.size()) grow();
        std::uint32_t& entry = table_[place(key)];
        if (entry == none) {
            entry = std::uint32_t(keys_.size());
            keys_.push_back(key);
        }
        return last_ = entry;
    }

    static constexpr std::uint32_t none = 0xffffffffu;  ///< Stands for the index of a key that has none.

    /// Returns the index of a key; `none` if it has none.
    std::uint32_t find(std::uint64_t key) const { return table_.empty() ? none : table_[place(key)]; }
    /// Forgets all keys.
    void clear() {
        keys_.clear();
        std::fill(table_.begin(), table_.end(), none);
        last_ = 0;
    }

private:
    /// Returns the index in table_ of the entry of a key, or of the free entry where a new key must be written. The
    /// multiplier is 2⁶⁴ divided by the golden ratio (Knuth, vol. 3, §6.4).
    std::size_t place(std::uint64_t key) const {
        const std::size_t last = table_.size() - 1;  // a mask: the size of the table, a power of two, less one
        std::size_t i = std::size_t((key * 0x9e3779b97f4a7c15ull) >> 32) & last;
        while (table_[i] != none && keys_[table_[i]] != key) i = (i + 1) & last;
        return i;
    }
    void grow() {
        table_.assign(table_.empty() ? 256 : 2 * table_.size(), none);
        for (std::uint32_t n = 0; n < keys_.size(); ++n) table_[place(keys_[n])] = n;
    }

    std::vector<std::uint64_t> keys_;
    std::vector<std::uint32_t> table_;
    std::uint32_t last_ = 0;  // last result of number(); particles that are neighbours in memory mostly share a block
};

}  // namespace firn::inline FIRN_BUILD
