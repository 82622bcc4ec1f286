/// \file Bodies of sparse_grid.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/data/sparse_grid.hpp>

namespace firn::inline FIRN_BUILD {

template <std::floating_point S, int D>
void SparseGrid<S, D>::activate(std::span<BlockPartition<D>* const> partitions, int threads) {
    std::size_t row = 0;
    for (BlockPartition<D>* partition : partitions) {
        partition->first_row = row;
        row += partition->ranges.size();
    }
    make_room(std::vector<const BlockPartition<D>*>(partitions.begin(), partitions.end()), thread_count(threads));
}

template <std::floating_point S, int D>
void SparseGrid<S, D>::exchange(std::size_t k, int threads) {
    if (layers_.size() < k) layers_.resize(k);
    aligned_vector<S>& layer = layers_[k - 1];
    if (layer.size() != nodes_.size()) renew(layer, nodes_.size(), thread_count(threads));
    layer.swap(nodes_);
}

template <std::floating_point S, int D>
const S* SparseGrid<S, D>::find_node(const std::array<int, std::size_t(D)>& node) const {
    BlockCoordinate<D> block{};
    std::size_t within = 0;
    for (std::size_t a = 0; a < std::size_t(D); ++a) {
        block[a] = node[a] >> 2;
        within = within * block_size + std::size_t(node[a] & 3);
    }
    const std::uint32_t b = find(block);
    return b == no_block ? nullptr : nodes(b) + within * node_width;
}

template <std::floating_point S, int D>
std::size_t SparseGrid<S, D>::bytes() const {
    std::size_t numbers = nodes_.capacity();
    for (const auto& layer : layers_) numbers += layer.capacity();
    return numbers * sizeof(S) + neighbours_.capacity() * sizeof(std::uint32_t) +
           blocks_.capacity() * sizeof(std::uint64_t) + scratch_.capacity();
}

template <std::floating_point S, int D>
[[gnu::cold]] void SparseGrid<S, D>::make_room(std::span<const BlockPartition<D>* const> partitions, int workers) {
    blocks_.clear();
    for (const BlockPartition<D>* partition : partitions)
        for (const std::uint32_t r : partition->by_block) blocks_.push_back(block_key<D>(partition->ranges[r].block));
    if (partitions.size() > 1) sort_each_once(blocks_);
    std::vector<std::uint64_t> grown;
    for (int a = 0; a < D; ++a) {
        grow(blocks_, std::uint64_t(1) << 21 * (D - 1 - a), grown);
        blocks_.swap(grown);
    }
    if (is_periodic(domain_)) {
        for (std::uint64_t& key : blocks_) key = wrapped_key(domain_, key);
        sort_each_once(blocks_);
    }
    std::size_t rows = 0;
    for (const BlockPartition<D>* partition : partitions)
        rows = std::max(rows, partition->first_row + partition->ranges.size());
    renew(neighbours_, rows * neighbour_count, workers);
    for (const BlockPartition<D>* partition : partitions)
        detail::for_chunks(partition->ranges.size(), workers,
                           [&](std::size_t first, std::size_t last) { find_neighbours(*partition, first, last); });
    renew_nodes(blocks_.size(), workers);
}

template <std::floating_point S, int D>
void SparseGrid<S, D>::renew_nodes(std::size_t blocks, int workers) {
    const std::size_t numbers = blocks * std::size_t(block_nodes<D> * node_width);
    if (numbers > nodes_.capacity()) {
        const std::size_t room = numbers + numbers / 8;  // memory for more blocks, because matter may spread
        require_memory(double(room) * sizeof(S),
                       sentence("A grid of ", blocks, " blocks of ", block_nodes<D>, " nodes around matter"),
                       "Take larger cells, or fewer particles that lie far apart.");
        nodes_ = {};  // the old memory is freed first, because its numbers are not needed
    }
    if (numbers != nodes_.size()) renew(nodes_, numbers, workers);
    for (auto& layer : layers_) layer.clear();
}

template <std::floating_point S, int D>
void SparseGrid<S, D>::find_neighbours(const BlockPartition<D>& partition, std::size_t from, std::size_t to) {
    if (is_periodic(domain_)) return look_up_neighbours(partition, from, to);
    constexpr std::size_t lines = neighbour_count / 3;
    std::array<std::uint64_t, lines>
        beside{};  // for each line, the key of its first block minus the key of the middle block
    for (std::size_t line = 0; line < lines; ++line) {
        beside[line] -= 1;
        std::uint64_t rest = line;
        for (int a = D - 2; a >= 0; --a, rest /= 3) beside[line] += (rest % 3 - 1) << 21 * (D - 1 - a);
    }
    const auto key_of = [&](std::size_t k) { return block_key<D>(partition.ranges[partition.by_block[k]].block); };
    std::array<std::size_t, lines> first{};  // for each line, the index of its first block
    for (std::size_t line = 0; line < lines; ++line)
        first[line] = std::size_t(std::lower_bound(blocks_.begin(), blocks_.end(), key_of(from) + beside[line]) -
                                  blocks_.begin());
    for (std::size_t k = from; k < to; ++k) {
        const std::uint64_t key = key_of(k);
        std::uint32_t* row = neighbours_.data() + (partition.first_row + partition.by_block[k]) * neighbour_count;
        for (std::size_t line = 0; line < lines; ++line) {
            while (blocks_[first[line]] < key + beside[line]) ++first[line];
            for (std::uint32_t n = 0; n < 3; ++n) *row++ = std::uint32_t(first[line]) + n;
        }
    }
}

template <std::floating_point S, int D>
void SparseGrid<S, D>::look_up_neighbours(const BlockPartition<D>& partition, std::size_t from, std::size_t to) {
    for (std::size_t r = from; r < to; ++r)
        for (int n = 0; n < neighbour_count; ++n) {
            BlockCoordinate<D> block = partition.ranges[r].block;
            for (int a = D - 1, rest = n; a >= 0; --a, rest /= 3) block[std::size_t(a)] += rest % 3 - 1;
            neighbours_[(partition.first_row + r) * neighbour_count + std::size_t(n)] = find(wrapped(domain_, block));
        }
}

template <std::floating_point S, int D>
[[gnu::cold]] void SparseGrid<S, D>::grow(std::vector<std::uint64_t>& keys, std::uint64_t step,
                                          std::vector<std::uint64_t>& grown) {
    grown.resize(3 * keys.size());
    keys.push_back(~std::uint64_t(0));  // end mark: above all other keys, even if one step is subtracted
    std::size_t low = 0, middle = 0, high = 0, count = 0;
    while (high + 1 < keys.size()) {
        const std::uint64_t below = keys[low] - step, same = keys[middle], above = keys[high] + step;
        const std::uint64_t next = std::min(std::min(below, same), above);
        grown[count++] = next;
        low += below == next;
        middle += same == next;
        high += above == next;
    }
    grown.resize(count);
}

}  // namespace firn::inline FIRN_BUILD
