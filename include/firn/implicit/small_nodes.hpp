/// \file Nodes with little matter. Matter at an edge can hang on nodes that have next to no stiffness; a Newton step
/// then runs away. Such small nodes are no unknowns: they follow the large nodes beside them, as a linear function.
#pragma once

#include <firn/data/sparse_grid.hpp>
#include <firn/force/none.hpp>
#include <firn/implicit/linear_weights.hpp>
#include <firn/loops/p2g.hpp>
#include <firn/transfer/pic.hpp>

#include <limits>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Sets the present numbers of all nodes to zero, but for the one at node_mass: it becomes Σ N V0, the node's share of
/// the particles' undeformed volume [m^D].
/// \param threads  number of threads; 0: thread_count() chooses
template <class Kernel, std::floating_point S, int D, class View>
void scatter_volumes(SparseGrid<S, D>& grid, int threads, ParticleSets<View> sets) {
    std::vector<ParticleSet<View>> of_volumes;
    for (const ParticleSet<View>& set : sets) {
        View view = set.view;
        view.mass = view.volume;
        of_volumes.push_back({view, set.partition});
    }
    p2g<Kernel, Pic, detail::NoForceNoField>(Coloured{threads}, grid, 0, ParticleSets<View>(of_volumes));
    const int workers = thread_count(threads);
    parallel_for(
        grid.block_count(), workers,
        [&](std::size_t b, int) {
            for (int i = 0; i < block_nodes<D>; ++i) std::fill_n(grid.nodes(b) + i * node_width, D, S(0));
        },
        16);
}

/// Which nodes are small. \see SmallNodes
struct SmallNodeRule {
    /// Nodes with less than this part of the largest node's volume are small; 0: none is. Following stiffens edges, by
    /// a cell's share: a block on a floor, 8 and 32 cells wide, sinks by 0.6 and 0.1 % less, which is nearer to the
    /// limit of fine cells; Cook's membrane of 32 cells bends by 1.2 to 2.5 % less, which is farther from it. With
    /// 0.01, which leaves these bodies free but for corners, linear solves take 1.5 to 1.8 times as many iterations.
    double threshold = 0.1;
};

/// The small nodes of a grid, and the weights by which they follow large ones. A small node takes the value at its
/// place of the linear function that fits the displacements of the large nodes around the nearest large one best (least
/// squares); the next nearest nodes count only where these determine no linear function. A constant in its place would
/// be wrong: it does not turn with the body. A small node without a large one within `reach` nodes stays an unknown.
template <std::floating_point S, int D>
class SmallNodes {
public:
    /// How far a small node may lie from the nearest large one [cells].
    static constexpr int reach = 3;

    /// Finds the small nodes. The present numbers of the nodes must be those of scatter_volumes().
    /// \param threads  number of threads; 0: thread_count() chooses
    SmallNodes(const SparseGrid<S, D>& grid, const SmallNodeRule& rule, int threads) {
        const int workers = thread_count(threads);
        std::vector<S> largest(grid.block_count());
        parallel_for(
            grid.block_count(), workers,
            [&](std::size_t b, int) {
                for (int i = 0; i < block_nodes<D>; ++i) largest[b] = std::max(largest[b], volume(grid.nodes(b), i));
            },
            16);
        full_ = largest.empty() ? S(0) : *std::max_element(largest.begin(), largest.end());
        least_ = S(rule.threshold) * full_;
        std::vector<Found> of_blocks(grid.block_count());
        parallel_for(grid.block_count(), workers, [&](std::size_t b, int) { find(grid, b, of_blocks[b]); });
        for (const Found& found : of_blocks) append(found);
        transpose();
    }

    std::size_t count() const { return slaves_.size(); }  ///< Number of nodes that follow others.
    std::size_t alone() const { return alone_; }  ///< Number of small nodes that stay unknowns, far from large ones.
    S largest_volume() const { return full_; }    ///< Largest volume of a node [m^D].
    /// Indices of the nodes that follow others, ascending. Node k of block b has the index b × block_nodes<D> + k.
    const std::vector<std::uint32_t>& nodes() const { return slaves_; }

    /// Sets the numbers of small nodes to what follows from those of large ones. \param numbers  those of all nodes
    void extend(S* numbers, int threads) const {
        for_each(slaves_.size(), threads, [&](std::size_t i) {
            for (int a = 0; a < D; ++a) {
                S sum = S(0);
                for (std::size_t k = ends_[i]; k < ends_[i + 1]; ++k)
                    sum += weights_[k] * numbers[masters_[k] * std::size_t(node_width) + std::size_t(a)];
                numbers[slaves_[i] * std::size_t(node_width) + std::size_t(a)] = sum;
            }
        });
    }
    /// Adds the forces on small nodes to the large ones that they follow, and sets them to zero: the transpose of
    /// extend(). \param numbers  those of all nodes
    void fold(S* numbers, int threads) const {
        for_each(of_masters_.size(), threads, [&](std::size_t i) {
            for (int a = 0; a < D; ++a) {
                S& sum = numbers[of_masters_[i] * std::size_t(node_width) + std::size_t(a)];
                for (std::size_t k = back_ends_[i]; k < back_ends_[i + 1]; ++k)
                    sum += back_weights_[k] * numbers[followers_[k] * std::size_t(node_width) + std::size_t(a)];
            }
        });
        for_each(slaves_.size(), threads,
                 [&](std::size_t i) { std::fill_n(numbers + slaves_[i] * std::size_t(node_width), D, S(0)); });
    }
    /// Adds to the blocks of large nodes what the blocks of their followers are to them, each follower for itself.
    /// \param blocks  D × D numbers of each node
    void fold_blocks(S* blocks, int threads) const {
        constexpr std::size_t numbers = std::size_t(D * D);
        for_each(of_masters_.size(), threads, [&](std::size_t i) {
            for (std::size_t k = back_ends_[i]; k < back_ends_[i + 1]; ++k)
                for (std::size_t n = 0; n < numbers; ++n)
                    blocks[of_masters_[i] * numbers + n] +=
                        back_weights_[k] * back_weights_[k] * blocks[followers_[k] * numbers + n];
        });
    }

private:
    using Place = std::array<int, std::size_t(D)>;
    struct Found {
        std::vector<std::uint32_t> slaves, masters;
        std::vector<std::size_t> ends;
        std::vector<S> weights;
        std::size_t alone = 0;
    };

    template <class F>
    static void for_each(std::size_t n, int threads, const F& f) {
        parallel_for(n, thread_count(threads), [&](std::size_t i, int) { f(i); }, 256);
    }
    static S volume(const S* nodes, int i) { return nodes[i * node_width + node_mass]; }

    /// The grid indices of the blocks around a block: up to two blocks away along each axis.
    class Around {
    public:
        static constexpr int width = 5;
        Around(const SparseGrid<S, D>& grid, std::size_t b) {
            for (int k = 0; k < int(of_.size()); ++k) {
                BlockCoordinate<D> block = grid.block(b);
                for (int a = D - 1, rest = k; a >= 0; --a, rest /= width) block[std::size_t(a)] += rest % width - 2;
                of_[std::size_t(k)] = grid.find(wrapped(grid.domain(), block));
            }
        }
        /// Returns the index of a node, or no_block if the grid does not have it. \param node  counted from the block's
        std::uint32_t index(const Place& node) const {
            int block = 0, within = 0;
            for (std::size_t a = 0; a < std::size_t(D); ++a) {
                block = block * width + (node[a] >> 2) + 2;
                within = within * block_size + (node[a] & 3);
            }
            const std::uint32_t b = of_[std::size_t(block)];
            return b == no_block ? no_block : b * std::uint32_t(block_nodes<D>) + std::uint32_t(within);
        }

    private:
        std::array<std::uint32_t, std::size_t(D == 2 ? 25 : 125)> of_;
    };
    static_assert(block_size == 4 && reach + 2 <= 2 * block_size);

    /// Calls f(offset) for all offsets of up to n nodes along each axis.
    template <class F>
    static void for_offsets(int n, const F& f) {
        const int width = 2 * n + 1;
        const int all = D == 2 ? width * width : width * width * width;
        for (int k = 0; k < all; ++k) {
            Place offset{};
            for (int a = D - 1, rest = k; a >= 0; --a, rest /= width) offset[std::size_t(a)] = rest % width - n;
            f(offset);
        }
    }
    static Place sum(Place a, const Place& b) {
        for (std::size_t i = 0; i < std::size_t(D); ++i) a[i] += b[i];
        return a;
    }

    void find(const SparseGrid<S, D>& grid, std::size_t b, Found& found) const {
        const S* const nodes = grid.nodes(b);
        std::optional<Around> around;
        for (int i = 0; i < block_nodes<D>; ++i) {
            if (!(volume(nodes, i) > S(0)) || volume(nodes, i) >= least_) continue;
            if (!around) around.emplace(grid, b);
            Place here{};
            for (int a = 0; a < D; ++a) here[std::size_t(a)] = place_in_block<D>(i, a);
            find_masters(grid, *around, here, std::uint32_t(b * std::size_t(block_nodes<D>)) + std::uint32_t(i), found);
        }
    }
    void find_masters(const SparseGrid<S, D>& grid, const Around& around, const Place& here, std::uint32_t slave,
                      Found& found) const {
        const auto volume_at = [&](const Place& offset) {
            const std::uint32_t index = around.index(sum(here, offset));
            return index == no_block ? S(0) : volume(grid.nodes(0) + index * std::size_t(node_width), 0);
        };
        // The nearest large node; of several, the one with most matter.
        double best = std::numeric_limits<double>::infinity();
        Place nearest{};
        for_offsets(reach, [&](const Place& offset) {
            const S there = volume_at(offset);
            if (!(there >= least_)) return;
            double distance = -0.1 * double(there) / double(full_);
            for (const int along : offset) distance += along * along;
            if (distance < best) best = distance, nearest = offset;
        });
        if (best == std::numeric_limits<double>::infinity()) {
            ++found.alone;
            return;
        }
        std::vector<Place> masters;
        std::vector<double> weights;
        for (int width = 1; width <= 2 && weights.empty(); ++width) {
            masters.clear();
            for_offsets(width, [&](const Place& more) {
                const Place offset = sum(nearest, more);
                if (volume_at(offset) >= least_) masters.push_back(offset);
            });
            weights = linear_weights<D>(masters);
        }
        if (weights.empty()) masters = {nearest}, weights = {1};
        found.slaves.push_back(slave);
        for (std::size_t k = 0; k < masters.size(); ++k) {
            found.masters.push_back(around.index(sum(here, masters[k])));
            found.weights.push_back(S(weights[k]));
        }
        found.ends.push_back(found.masters.size());
    }

    void append(const Found& found) {
        const std::size_t before = masters_.size();
        slaves_.insert(slaves_.end(), found.slaves.begin(), found.slaves.end());
        masters_.insert(masters_.end(), found.masters.begin(), found.masters.end());
        weights_.insert(weights_.end(), found.weights.begin(), found.weights.end());
        for (const std::size_t end : found.ends) ends_.push_back(before + end);
        alone_ += found.alone;
    }
    /// Lists for each large node which small ones follow it, in their order.
    void transpose() {
        std::vector<std::pair<std::uint32_t, std::size_t>> by_master;
        std::vector<std::uint32_t> slave_of(masters_.size());
        for (std::size_t i = 0; i < slaves_.size(); ++i)
            for (std::size_t k = ends_[i]; k < ends_[i + 1]; ++k) {
                slave_of[k] = slaves_[i];
                by_master.emplace_back(masters_[k], k);
            }
        std::sort(by_master.begin(), by_master.end());
        for (const auto& [master, k] : by_master) {
            if (of_masters_.empty() || of_masters_.back() != master) {
                of_masters_.push_back(master);
                back_ends_.push_back(followers_.size());
            }
            followers_.push_back(slave_of[k]);
            back_weights_.push_back(weights_[k]);
            back_ends_.back() = followers_.size();
        }
    }

    S full_ = S(0), least_ = S(0);
    std::size_t alone_ = 0;
    std::vector<std::uint32_t> slaves_, masters_;        // masters_[ends_[i]] to [ends_[i + 1] − 1]: those of slave i
    std::vector<std::uint32_t> of_masters_, followers_;  // and the other way round
    std::vector<std::size_t> ends_{0}, back_ends_{0};
    std::vector<S> weights_, back_weights_;
};

}  // namespace firn::inline FIRN_BUILD
