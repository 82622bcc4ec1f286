/// \file Sets of nodes of one level of a multigrid, with a fast look-up by their places; and the coarse nodes by which
/// the nodes of a level move.
///
/// The coarse level has cells of twice the size. Its node I lies at 2 I − 3/2 [fine nodes], along each axis. There the
/// coarse quadratic B-spline is the sum of those of the fine nodes 2 I − 3 to 2 I with the weights (1, 3, 3, 1)/4, so a
/// fine node moves as the mean of its parents, with these weights: two along each axis.
#pragma once

#include <firn/data/block_partition.hpp>

#include <bit>
#include <cstdint>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Stands for a node that a NodeSet does not contain.
inline constexpr std::uint32_t no_node = 0xffffffffu;

/// The first one of the two coarse nodes by which a fine node moves, along one axis. The other one is the next.
constexpr int first_parent(int fine) { return (fine + 1) >> 1; }
/// The weight of a fine node's first or second parent, along one axis [1]. \param parent  0 or 1
constexpr double parent_weight(int fine, int parent) { return ((fine & 1) ^ parent) != 0 ? 0.75 : 0.25; }
/// Number of fine nodes along an axis that move by one coarse node.
inline constexpr int children_along_axis = 4;
/// The first one of the fine nodes that move by a coarse node, along one axis.
constexpr int first_child(int coarse) { return 2 * coarse - 3; }

/// A set of nodes of one level, in an order of their own: by blocks of 4^D nodes, and in blocks the last axis fastest.
/// Along a periodic axis, a node's place is one of 0 to period − 1.
template <int D>
class NodeSet {
public:
    using Place = std::array<int, std::size_t(D)>;  ///< Index of a node along each axis.
    using Marks = std::uint64_t;                    ///< One bit for each node of a block.

    /// Makes an empty set. \param periods  number of nodes along periodic axes; 0 along the others
    explicit NodeSet(const Place& periods) : periods_(periods) {
        for (const int period : periods) wraps_blocks_ = wraps_blocks_ && period % block_size == 0;
    }

    std::size_t size() const { return places_.size(); }             ///< Number of nodes.
    const Place& place(std::size_t i) const { return places_[i]; }  ///< The place of a node.
    const Place& periods() const { return periods_; }               ///< Number of nodes along periodic axes, or 0.

    /// Adds a node. finish() must follow.
    void mark(Place place) {
        wrap(place);
        const std::uint64_t key = key_of(place);
        if (marked_.empty() || marked_.back().first != key) marked_.emplace_back(key, 0);
        marked_.back().second |= Marks(1) << bit_of(place);
    }
    /// Adds the parents of all nodes of a finer set. finish() must follow.
    void mark_parents(const NodeSet& fine) {
        constexpr int width = block_size / 2 + 1 + 1;  // of the parents of a block
        for (std::size_t b = 0; b < fine.keys_.size(); ++b) {
            const BlockCoordinate<D> block = block_of_key<D>(fine.keys_[b]);
            Marks parents = 0;
            for (Marks rest = fine.marks_[b]; rest != 0; rest &= rest - 1) {
                const int bit = std::countr_zero(rest);
                for (int k = 0; k < 1 << D; ++k) {
                    int to = 0;
                    for (int a = 0; a < D; ++a)
                        to = to * width + first_parent(place_in_block<D>(bit, a)) + (k >> (D - 1 - a) & 1);
                    parents |= Marks(1) << to;
                }
            }
            for (; parents != 0; parents &= parents - 1) {
                int bit = std::countr_zero(parents);
                Place place{};
                for (int a = D - 1; a >= 0; --a, bit /= width)
                    place[std::size_t(a)] = block_size / 2 * block[std::size_t(a)] + bit % width;
                mark(place);
            }
        }
    }
    /// Numbers the nodes that were added.
    void finish() {
        std::sort(marked_.begin(), marked_.end());
        for (const auto& [key, marks] : marked_) {
            if (keys_.empty() || keys_.back() != key) {
                keys_.push_back(key);
                marks_.push_back(0);
            }
            marks_.back() |= marks;
        }
        marked_ = {};
        for (std::size_t b = 0; b < keys_.size(); ++b) {
            firsts_.push_back(std::uint32_t(places_.size()));
            const BlockCoordinate<D> block = block_of_key<D>(keys_[b]);
            for (Marks rest = marks_[b]; rest != 0; rest &= rest - 1) {
                Place place = block;
                for (int a = 0; a < D; ++a)
                    place[std::size_t(a)] =
                        block_size * place[std::size_t(a)] + place_in_block<D>(std::countr_zero(rest), a);
                places_.push_back(place);
            }
        }
    }

    /// Returns the index of a node, or no_node.
    std::uint32_t index(Place place) const {
        wrap(place);
        return index_in(find(key_of(place)), bit_of(place));
    }
    /// Sets to[…] to the indices of the nodes of a cube, or no_node, the last axis fastest.
    /// \param low  the place of the cube's first node;  \param width  number of its nodes along each axis, at most 9
    void indices(const Place& low, int width, std::uint32_t* to) const {
        int count = 1;
        for (int a = 0; a < D; ++a) count *= width;
        if (!wraps_blocks_) {
            for (int i = 0; i < count; ++i) to[i] = index(in_cube(low, width, i));
            return;
        }
        // The blocks that the cube touches, at most three along each axis.
        constexpr int most = 3;
        std::array<std::size_t, std::size_t(D == 2 ? 9 : 27)> blocks;
        BlockCoordinate<D> first{}, last{};
        for (std::size_t a = 0; a < std::size_t(D); ++a) {
            first[a] = low[a] >> 2;
            last[a] = ((low[a] + width - 1) >> 2) - first[a];
        }
        for (int i = 0; i < int(blocks.size()); ++i) {
            Place place{};
            bool is_touched = true;
            for (int a = D - 1, rest = i; a >= 0; --a, rest /= most) {
                const auto axis = std::size_t(a);
                is_touched = is_touched && rest % most <= last[axis];
                place[axis] = block_size * (first[axis] + rest % most);
            }
            if (!is_touched) continue;
            wrap(place);
            blocks[std::size_t(i)] = find(key_of(place));
        }
        for (int i = 0; i < count; ++i) {
            const Place place = in_cube(low, width, i);
            std::size_t block = 0;
            for (std::size_t a = 0; a < std::size_t(D); ++a)
                block = block * most + std::size_t((place[a] >> 2) - first[a]);
            to[i] = index_in(blocks[block], bit_of(place));
        }
    }

private:
    static constexpr std::size_t none = ~std::size_t(0);

    static Place in_cube(const Place& low, int width, int i) {
        Place place = low;
        for (int a = D - 1; a >= 0; --a, i /= width) place[std::size_t(a)] += i % width;
        return place;
    }
    void wrap(Place& place) const {
        for (std::size_t a = 0; a < std::size_t(D); ++a)
            if (periods_[a] > 0) place[a] = modulo(place[a], periods_[a]);
    }
    static std::uint64_t key_of(Place place) {
        for (int& along : place) along >>= 2;
        return block_key<D>(place);
    }
    static int bit_of(const Place& place) {
        int bit = 0;
        for (const int along : place) bit = block_size * bit + (along & (block_size - 1));
        return bit;
    }
    std::size_t find(std::uint64_t key) const {
        const auto found = std::lower_bound(keys_.begin(), keys_.end(), key);
        return found != keys_.end() && *found == key ? std::size_t(found - keys_.begin()) : none;
    }
    std::uint32_t index_in(std::size_t block, int bit) const {
        if (block == none || (marks_[block] >> bit & 1) == 0) return no_node;
        return firsts_[block] + std::uint32_t(std::popcount(marks_[block] & ((Marks(1) << bit) - 1)));
    }
    static_assert(block_size == 4 && block_nodes<D> <= 64);

    Place periods_;
    bool wraps_blocks_ = true;
    std::vector<std::pair<std::uint64_t, Marks>> marked_;
    std::vector<std::uint64_t> keys_;
    std::vector<Marks> marks_;
    std::vector<std::uint32_t> firsts_;
    std::vector<Place> places_;
};

}  // namespace firn::inline FIRN_BUILD
