/// \file A grid that holds only the blocks of nodes around matter. Its cost is that of the matter, not of the domain.
#pragma once

#include <firn/core/optimised.hpp>
#include <firn/data/block_partition.hpp>
#include <firn/data/fixed_point_scale.hpp>
#include <firn/data/memory.hpp>

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <type_traits>

namespace firn {

/// Numbers a node: momentum (after the grid update: velocity) in the first D, mass in the last.
inline constexpr int node_width = 4;
inline constexpr int node_mass = 3;

/// In place of a block's number: the grid does not hold it.
inline constexpr std::uint32_t no_block = 0xffffffffu;

template <std::floating_point S, int D>
class SparseGrid {
public:
    static constexpr int neighbour_count = D == 2 ? 9 : 27;

    explicit SparseGrid(const Domain<D>& domain) : domain_(domain) {
        detail::tell_unoptimised<FIRN_TELLS_UNOPTIMISED>();
        check(domain);
    }

    const Domain<D>& domain() const { return domain_; }
    std::size_t block_count() const { return blocks_.size(); }
    BlockCoordinate<D> block(std::size_t b) const { return block_of_key<D>(blocks_[b]); }

    /// Nodes of block b: block_nodes<D> × node_width numbers, last axis fastest.
    S* nodes(std::size_t b) { return nodes_.data() + b * std::size_t(block_nodes<D> * node_width); }
    const S* nodes(std::size_t b) const { return nodes_.data() + b * std::size_t(block_nodes<D> * node_width); }

    /// The 3^D blocks around range r of a partition that the grid was activated for, last axis fastest.
    const std::uint32_t* neighbours(const BlockPartition<D>& partition, std::size_t r) const {
        return neighbours_.data() + (partition.first_row + r) * neighbour_count;
    }

    /// \throws usage_error  unless the grid was activated for a partition of so many ranges
    void require_active(const BlockPartition<D>& partition) const {
        if ((partition.first_row + partition.ranges.size()) * neighbour_count > neighbours_.size())
            throw usage_error(sentence("The grid has no nodes for a partition of ", partition.ranges.size(),
                                       " ranges. Call activate() after particles were sorted, for all sets at once."));
    }

    /// Makes room for every node that particles of the partition can reach before they are sorted again: the blocks of
    /// the partition and their neighbours, in the order of their keys. Contents are lost.
    /// \param threads  0: as many as thread_count() says
    void activate(const BlockPartition<D>& partition, int threads = 0) {
        const BlockPartition<D>* const one[] = {&partition};
        make_room(one, thread_count(threads));
    }
    /// The same for several sets of particles on one grid. Their rows of neighbours follow one another.
    void activate(std::span<BlockPartition<D>* const> partitions, int threads = 0) {
        std::size_t row = 0;
        for (BlockPartition<D>* partition : partitions) {
            partition->first_row = row;
            row += partition->ranges.size();
        }
        make_room(std::vector<const BlockPartition<D>*>(partitions.begin(), partitions.end()), thread_count(threads));
    }

    /// Memory for a T each node, kept from step to step: what it holds is left from its last use.
    /// \param threads  0: as many as thread_count() says
    template <class T>
    T* scratch(int threads = 0) {
        static_assert(std::is_trivially_copyable_v<T> && alignof(T) <= 64);
        const std::size_t bytes = blocks_.size() * std::size_t(block_nodes<D>) * sizeof(T);
        if (scratch_.size() < bytes) renew(scratch_, bytes, thread_count(threads));
        return reinterpret_cast<T*>(scratch_.data());
    }

    /// Of the last fixed-point sums: tried first the next time. It saves time, and never changes a result.
    std::optional<FixedPointScale<S>> last_scale;

    /// Exchanges the numbers of all nodes with those of layer k = 1, 2, …: further numbers of the same nodes, which are
    /// there from the first exchange on, unset. What a layer holds is lost when the grid is activated anew.
    /// \param threads  0: as many as thread_count() says
    void exchange(std::size_t k, int threads = 0) {
        if (layers_.size() < k) layers_.resize(k);
        aligned_vector<S>& layer = layers_[k - 1];
        if (layer.size() != nodes_.size()) renew(layer, nodes_.size(), thread_count(threads));
        layer.swap(nodes_);
    }
    /// The numbers of layer k, block after block as those of nodes(0); null if nothing was exchanged.
    const S* layer(std::size_t k) const {
        return k > layers_.size() || layers_[k - 1].empty() ? nullptr : layers_[k - 1].data();
    }

    /// Number of a block, or no_block.
    std::uint32_t find(const BlockCoordinate<D>& block) const {
        const std::uint64_t key = block_key<D>(block);
        const auto found = std::lower_bound(blocks_.begin(), blocks_.end(), key);
        return found != blocks_.end() && *found == key ? std::uint32_t(found - blocks_.begin()) : no_block;
    }

    /// The numbers of a node by its index from the lower corner (ghost nodes: −1, …), or null where there is no matter.
    const S* find_node(const std::array<int, std::size_t(D)>& node) const {
        BlockCoordinate<D> block{};
        std::size_t within = 0;
        for (std::size_t a = 0; a < std::size_t(D); ++a) {
            block[a] = node[a] >> 2;
            within = within * block_size + std::size_t(node[a] & 3);
        }
        const std::uint32_t b = find(block);
        return b == no_block ? nullptr : nodes(b) + within * node_width;
    }

    /// Bytes in use.
    std::size_t bytes() const {
        std::size_t numbers = nodes_.capacity();
        for (const auto& layer : layers_) numbers += layer.capacity();
        return numbers * sizeof(S) + neighbours_.capacity() * sizeof(std::uint32_t) +
               blocks_.capacity() * sizeof(std::uint64_t) + scratch_.capacity();
    }

private:
    void make_room(std::span<const BlockPartition<D>* const> partitions, int workers) {
        blocks_.clear();
        for (const BlockPartition<D>* partition : partitions)
            for (const std::uint32_t r : partition->by_block)
                blocks_.push_back(block_key<D>(partition->ranges[r].block));
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
        const std::size_t numbers = blocks_.size() * std::size_t(block_nodes<D> * node_width);
        if (numbers > nodes_.capacity()) {
            const std::size_t room = numbers + numbers / 8;  // for matter that spreads out
            require_memory(
                double(room) * sizeof(S),
                sentence("A grid of ", blocks_.size(), " blocks of ", block_nodes<D>, " nodes around matter"),
                "Take larger cells, or fewer particles that lie far apart.");
            nodes_ = {};  // before there is more: nothing of it is needed
        }
        if (numbers != nodes_.size()) renew(nodes_, numbers, workers);
        for (auto& layer : layers_) layer.clear();
    }

    static void sort_each_once(std::vector<std::uint64_t>& keys) {
        std::sort(keys.begin(), keys.end());
        keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    }

    /// Of the ranges from..to in the order of their blocks. Neighbours along the last axis are neighbours in the list;
    /// the others are found by walking along it.
    void find_neighbours(const BlockPartition<D>& partition, std::size_t from, std::size_t to) {
        if (is_periodic(domain_)) return look_up_neighbours(partition, from, to);
        constexpr std::size_t lines = neighbour_count / 3;
        std::array<std::uint64_t, lines> beside{};  // what leads to the key of each line's first neighbour
        for (std::size_t line = 0; line < lines; ++line) {
            beside[line] -= 1;
            std::uint64_t rest = line;
            for (int a = D - 2; a >= 0; --a, rest /= 3) beside[line] += (rest % 3 - 1) << 21 * (D - 1 - a);
        }
        const auto key_of = [&](std::size_t k) { return block_key<D>(partition.ranges[partition.by_block[k]].block); };
        std::array<std::size_t, lines> first{};  // its number
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

    /// Where they lie across the ends of the domain.
    void look_up_neighbours(const BlockPartition<D>& partition, std::size_t from, std::size_t to) {
        for (std::size_t r = from; r < to; ++r)
            for (int n = 0; n < neighbour_count; ++n) {
                BlockCoordinate<D> block = partition.ranges[r].block;
                for (int a = D - 1, rest = n; a >= 0; --a, rest /= 3) block[std::size_t(a)] += rest % 3 - 1;
                neighbours_[(partition.first_row + r) * neighbour_count + std::size_t(n)] =
                    find(wrapped(domain_, block));
            }
    }

    /// All keys of a sorted list, and those one step below and above: sorted, each once.
    static void grow(std::vector<std::uint64_t>& keys, std::uint64_t step, std::vector<std::uint64_t>& grown) {
        grown.resize(3 * keys.size());
        keys.push_back(~std::uint64_t(0));  // above all others, one step less, too
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

    Domain<D> domain_;
    std::vector<std::uint64_t> blocks_;  // keys, sorted
    aligned_vector<std::uint32_t> neighbours_;
    aligned_vector<S> nodes_;
    std::vector<aligned_vector<S>> layers_;
    aligned_vector<std::byte> scratch_;
};

}  // namespace firn
