/// \file Bodies of block_sort.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/sort/block_sort.hpp>

namespace firn::inline FIRN_BUILD {

template <int D>
BlockPartition<D> BlockSort<D>::partition(int colours) {
    BlockPartition<D> partition = arrange<D>(blocks_in_order(), colours, threads_);
    place_by_block(partition);
    order_by_cell(partition);
    return partition;
}

template <int D>
std::vector<BlockRange<D>> BlockSort<D>::blocks_in_order() {
    RadixSort<std::uint64_t> by_key;
    for (Met& m : met_) {
        m.first = places_.size();
        for (const std::uint64_t key : m.blocks.keys())
            by_key.items.push_back({key, std::uint32_t(by_key.items.size())});
        places_.insert(places_.end(), m.counts.begin(), m.counts.end());
    }
    by_key.sort();
    const auto& blocks = by_key.items;
    std::vector<BlockRange<D>> sorted;
    block_of_.resize(blocks.size());
    for (std::size_t i = 0; i < blocks.size(); ++i) {
        if (i == 0 || blocks[i].key != blocks[i - 1].key) sorted.push_back({block_of_key<D>(blocks[i].key), 0, 0});
        sorted.back().particles += places_[blocks[i].number];
        block_of_[blocks[i].number] = std::uint32_t(sorted.size() - 1);
    }
    return sorted;
}

template <int D>
void BlockSort<D>::place_by_block(const BlockPartition<D>& partition) {
    first_place_.assign(partition.ranges.size(), 0);
    for (std::size_t r = 1; r < partition.ranges.size(); ++r)
        first_place_[r] = first_place_[r - 1] + partition.ranges[r - 1].particles;
    std::vector<std::size_t> next = first_place_;
    for (std::size_t n = 0; n < places_.size(); ++n) {
        std::size_t& place = next[partition.by_block[block_of_[n]]];
        const std::size_t begin = place;
        place += places_[n];
        places_[n] = begin;
    }
    parallel_for(std::size_t(threads_), threads_, [&](std::size_t t, int) {
        std::size_t* const place = places_.data() + met_[t].first;
        for (std::size_t i = first_of(t), end = first_of(t + 1); i < end; ++i)
            if (number_of_[i] != no_particle) by_block_[place[number_of_[i]]++] = std::uint32_t(i);
    });
}

template <int D>
void BlockSort<D>::order_by_cell(BlockPartition<D>& partition) const {
    const auto order_range = [&](std::size_t r, int) {
        const BlockRange<D>& range = partition.ranges[r];
        const std::uint32_t* from = by_block_ + first_place_[r];
        std::uint32_t* to = partition.order.data() + range.first_slot;
        std::uint32_t next[block_nodes<D> + 1] = {};
        for (std::size_t i = 0; i < range.particles; ++i) ++next[cell_of_[from[i]] + 1];
        for (int c = 0; c < block_nodes<D>; ++c) next[c + 1] += next[c];
        if (!ids_) {  // the ids are the indices, which are sorted already
            for (std::size_t i = 0; i < range.particles; ++i) to[next[cell_of_[from[i]]]++] = from[i];
            return;
        }
        std::uint32_t* const id_of = number_of_ + first_place_[r];  // ids of the particles listed in `to`
        std::uint32_t last_id[block_nodes<D>] = {};
        std::uint64_t disordered = 0;  // one bit per cell, set if the ids in the cell are not sorted
        for (std::size_t i = 0; i < range.particles; ++i) {
            const std::uint32_t place = from[i], id = ids_[place], cell = cell_of_[place], at = next[cell]++;
            to[at] = place;
            id_of[at] = id;
            disordered |= std::uint64_t(id < last_id[cell]) << cell;
            last_id[cell] = id;
        }
        for (; disordered != 0; disordered &= disordered - 1) {
            const int cell = std::countr_zero(disordered);
            const std::size_t begin = cell == 0 ? 0 : next[cell - 1], count = next[cell] - begin;
            if (count <= pack_size && range.particles >= pack_size) {
                // index of the first of sixteen particles that include the `count` particles from `begin` on
                const std::size_t first = std::min(begin, range.particles - pack_size);
                order_few(to + first, id_of + first, begin - first, count);
            } else {
                std::sort(to + begin, to + begin + count,
                          [this](auto one, auto other) { return ids_[one] < ids_[other]; });
            }
        }
    };
    parallel_for(partition.ranges.size(), threads_, order_range, 16);
}

}  // namespace firn::inline FIRN_BUILD
