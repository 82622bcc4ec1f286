/// \file A grid that holds only the blocks of nodes around matter. Its cost is that of the matter, not of the domain.
#pragma once

#include <firn/data/block_numbers.hpp>
#include <firn/data/block_partition.hpp>

namespace firn {

/// Numbers a node: momentum (after the grid update: velocity) in the first D, mass in the last.
inline constexpr int node_width = 4;
inline constexpr int node_mass = 3;

template <std::floating_point S, int D>
class SparseGrid {
public:
    static constexpr int neighbour_count = D == 2 ? 9 : 27;
    static constexpr std::uint32_t no_block = BlockNumbers::none;

    explicit SparseGrid(const Domain<D>& domain) : domain_(domain) { check(domain); }

    const Domain<D>& domain() const { return domain_; }
    std::size_t block_count() const { return blocks_.size(); }
    BlockCoordinate<D> block(std::size_t b) const { return block_of_key<D>(blocks_.key(b)); }

    /// Nodes of block b: block_nodes<D> × node_width numbers, last axis fastest.
    S* nodes(std::size_t b) { return nodes_.data() + b * std::size_t(block_nodes<D> * node_width); }
    const S* nodes(std::size_t b) const { return nodes_.data() + b * std::size_t(block_nodes<D> * node_width); }

    /// The 3^D blocks around range r of the partition, last axis fastest.
    const std::uint32_t* neighbours(std::size_t r) const { return neighbours_.data() + r * neighbour_count; }

    /// Makes room for every node that particles of the partition can reach before they are sorted again.
    /// Contents are lost.
    void activate(const BlockPartition<D>& partition) {
        blocks_.clear();
        neighbours_.resize(partition.ranges.size() * neighbour_count);
        for (std::size_t r = 0; r < partition.ranges.size(); ++r) {
            for (int n = 0; n < neighbour_count; ++n) {
                BlockCoordinate<D> block = partition.ranges[r].block;
                for (int a = D - 1, rest = n; a >= 0; --a, rest /= 3) block[std::size_t(a)] += rest % 3 - 1;
                neighbours_[r * neighbour_count + std::size_t(n)] = blocks_.number(block_key<D>(block));
            }
        }
        nodes_.resize(blocks_.size() * std::size_t(block_nodes<D> * node_width));
    }

    /// Number of a block, or no_block.
    std::uint32_t find(const BlockCoordinate<D>& block) const { return blocks_.find(block_key<D>(block)); }

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
        return nodes_.capacity() * sizeof(S) + neighbours_.capacity() * sizeof(std::uint32_t) + blocks_.bytes();
    }

private:
    Domain<D> domain_;
    BlockNumbers blocks_;
    std::vector<std::uint32_t> neighbours_;
    aligned_vector<S> nodes_;
};

}  // namespace firn
