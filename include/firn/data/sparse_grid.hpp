/// \file A grid that stores only the blocks of nodes around matter. So the cost of the grid grows with the amount of
/// matter, not with the size of the domain.
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
#include <utility>

namespace firn::inline FIRN_BUILD {

/// How many numbers each node has. The first D of them are the components of the node's momentum (after the grid
/// update: of its velocity); the last is the node's mass.
inline constexpr int node_width = 4;
/// Index of the mass among the numbers of a node.
inline constexpr int node_mass = 3;

/// Value used instead of a block's index if the grid does not contain the block.
inline constexpr std::uint32_t no_block = 0xffffffffu;

/// A grid whose nodes lie in blocks of 4^D nodes. activate() chooses the blocks of the grid: those that contain the
/// particles of one or several sets, and the neighbours of these blocks.
template <std::floating_point S, int D>
class SparseGrid {
public:
    /// Number of blocks in the neighbourhood of a block, the block itself included: 3^D.
    static constexpr int neighbour_count = D == 2 ? 9 : 27;

    /// Makes a grid without blocks.
    /// \throws parameter_error  if the domain does not pass check()
    explicit SparseGrid(const Domain<D>& domain) : domain_(domain) {
        detail::tell_unoptimised<FIRN_TELLS_UNOPTIMISED>();
        check(domain);
        copy_stride_ = copy_stride(domain);
    }

    /// The domain of the grid.
    const Domain<D>& domain() const { return domain_; }
    /// Number of blocks that the grid contains.
    std::size_t block_count() const { return blocks_.size(); }
    /// Returns the coordinates of the block with index b; they are those of a copy if the block belongs to a contact
    /// group. The blocks of the grid are sorted by their keys.
    BlockCoordinate<D> block(std::size_t b) const { return block_of_key<D>(blocks_[b]); }

    /// Returns the coordinate, along an axis, of the block of the domain that block b is or is a copy of.
    int block_along(std::size_t b, int axis) const {
        const int along = int(blocks_[b] >> 21 * (D - 1 - axis) & 0x1fffff) - (1 << 20);
        return axis == 0 ? along_in_domain(along, copy_stride_) : along;
    }
    /// Returns the contact group whose sums the nodes of block b hold.
    int contact_group(std::size_t b) const {
        return group_of_copy(int(blocks_[b] >> 21 * (D - 1) & 0x1fffff) - (1 << 20), copy_stride_);
    }

    /// \name Nodes
    /// @{

    /// Returns the address of the numbers of all nodes of block b. The block has `block_nodes<D>` nodes, the last axis
    /// fastest, with node_width numbers each.
    S* nodes(std::size_t b) { return nodes_.data() + b * std::size_t(block_nodes<D> * node_width); }
    const S* nodes(std::size_t b) const { return nodes_.data() + b * std::size_t(block_nodes<D> * node_width); }

    /// @}

    /// Returns the grid indices of the 3^D blocks around the block of range r (the particles of one block), the last
    /// axis fastest. The block of range r itself is the middle one. activate() must have been called with the
    /// partition.
    const std::uint32_t* neighbours(const BlockPartition<D>& partition, std::size_t r) const {
        return neighbours_.data() + (partition.first_row + r) * neighbour_count;
    }

    /// Checks whether activate() can have been called for this partition: the grid's table of neighbours must have a
    /// row for each range (the particles of one block) of the partition.
    /// \throws usage_error  if the grid's table of neighbours has too few rows for the ranges of the partition
    void require_active(const BlockPartition<D>& partition) const {
        if ((partition.first_row + partition.ranges.size()) * neighbour_count > neighbours_.size())
            throw usage_error(sentence("The grid has no nodes for a partition of ", partition.ranges.size(),
                                       " ranges. Call activate() after particles were sorted, for all sets at once."));
    }

    /// Creates all nodes to which the particles of a partition can scatter before they are sorted again: the blocks of
    /// the partition and the neighbours of these blocks. The grid's blocks are sorted by their keys. All previous
    /// numbers of the nodes are lost.
    /// \param threads  number of threads; 0: thread_count() chooses
    /// \throws memory_error  if the nodes do not fit into memory
    void activate(const BlockPartition<D>& partition, int threads = 0) {
        const BlockPartition<D>* const one[] = {&partition};
        make_room(one, thread_count(threads));
    }
    /// Creates the nodes for several sets of particles on one grid, given by their partitions. The grid's table of
    /// neighbours has one row per range (the particles of one block), partition after partition. The member first_row
    /// of each partition is set to the index of the partition's first row.
    /// \param threads  number of threads; 0: thread_count() chooses
    /// \throws memory_error  if the nodes do not fit into memory
    void activate(std::span<BlockPartition<D>* const> partitions, int threads = 0);

    /// Adds `count` blocks of nodes behind those of the grid, for sums of the caller: the first of them is
    /// nodes(block_count()). They belong to no place, and no other function of the grid touches them. All numbers of
    /// the grid's nodes are lost. activate() removes these blocks.
    /// \param threads  number of threads; 0: thread_count() chooses
    /// \throws memory_error  if the nodes do not fit into memory
    void add_blocks_behind(std::size_t count, int threads = 0) {
        renew_nodes(blocks_.size() + count, thread_count(threads));
    }

    /// Returns the address of scratch memory for one T per node. The memory is reused from step to step, and contains
    /// whatever was written to it last.
    /// \param threads  number of threads; 0: thread_count() chooses
    template <class T>
    T* scratch(int threads = 0) {
        static_assert(std::is_trivially_copyable_v<T> && alignof(T) <= 64);
        const std::size_t bytes = blocks_.size() * std::size_t(block_nodes<D>) * sizeof(T);
        if (scratch_.size() < bytes) renew(scratch_, bytes, thread_count(threads));
        return reinterpret_cast<T*>(scratch_.data());
    }

    /// The scale that was used for the last fixed-point sums. The next sums try this scale first. That saves time and
    /// never changes a result.
    std::optional<FixedPointScale<S>> last_scale;

    /// Exchanges the numbers of all nodes with those of layer k = 1, 2, …. A layer is a further set of numbers for the
    /// same nodes. The first exchange with a layer creates this layer with uninitialised numbers. activate() empties
    /// all layers.
    /// \param threads  number of threads; 0: thread_count() chooses
    void exchange(std::size_t k, int threads = 0);
    /// Returns the address of the numbers of layer k, block after block in the order of nodes(0), or nullptr if
    /// exchange(k) was not called after the last activate().
    const S* layer(std::size_t k) const {
        return k > layers_.size() || layers_[k - 1].empty() ? nullptr : layers_[k - 1].data();
    }
    /// Returns the numbers of layer k, as above, to be changed.
    S* layer(std::size_t k) { return const_cast<S*>(std::as_const(*this).layer(k)); }

    /// Returns the index of a block, or no_block if the grid does not contain the block.
    std::uint32_t find(const BlockCoordinate<D>& block) const {
        const std::uint64_t key = block_key<D>(block);
        const auto found = std::lower_bound(blocks_.begin(), blocks_.end(), key);
        return found != blocks_.end() && *found == key ? std::uint32_t(found - blocks_.begin()) : no_block;
    }

    /// Returns the address of the numbers of a node, or nullptr if the grid does not contain the node's block.
    /// \param node  index of the node along each axis, counted from the domain's lower corner (ghost nodes: −1, …)
    const S* find_node(const std::array<int, std::size_t(D)>& node) const;

    /// Size of the memory that the grid has allocated [bytes].
    std::size_t bytes() const;

private:
    void make_room(std::span<const BlockPartition<D>* const> partitions, int workers);

    /// Makes room for the numbers of the nodes of `blocks` blocks. All numbers and all layers are lost.
    void renew_nodes(std::size_t blocks, int workers);

    static void sort_each_once(std::vector<std::uint64_t>& keys) {
        std::sort(keys.begin(), keys.end());
        keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    }

    /// Fills in the neighbours of the ranges by_block[from] to by_block[to − 1] in the table of neighbours. Three
    /// neighbours side by side along the last axis form a line; their indices are consecutive, because blocks are
    /// sorted by key. As the ranges are sorted by key, too, one walk along the list of blocks finds the first block of
    /// each line.
    void find_neighbours(const BlockPartition<D>& partition, std::size_t from, std::size_t to);

    /// Fills in the neighbours of the ranges from ≤ r < to if the domain is periodic. Neighbours may then lie at the
    /// other end of the domain.
    void look_up_neighbours(const BlockPartition<D>& partition, std::size_t from, std::size_t to);

    /// Sets `grown` to the sorted list of all given keys and of the keys one `step` below and above each of them. No
    /// key is listed twice.
    /// \param keys  sorted keys; an end mark is appended to them
    static void grow(std::vector<std::uint64_t>& keys, std::uint64_t step, std::vector<std::uint64_t>& grown);

    Domain<D> domain_;
    int copy_stride_;
    std::vector<std::uint64_t> blocks_;  // keys of the blocks, sorted
    aligned_vector<std::uint32_t> neighbours_;
    aligned_vector<S> nodes_;
    std::vector<aligned_vector<S>> layers_;
    aligned_vector<std::byte> scratch_;
};

/// Returns the position of a node [m], whichever copy of its block block b of the grid is.
/// \param node  index of the node in the block, the last axis fastest
template <std::floating_point S, int D>
Vec<double, D> node_position(const SparseGrid<S, D>& grid, std::size_t b, int node) {
    Vec<double, D> x{};
    for (int a = 0; a < D; ++a) x[a] = position_of_place(grid.domain(), grid.block(b), a, place_in_block<D>(node, a));
    return x;
}

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES
#include <firn/data/sparse_grid-inl.hpp>
#endif
