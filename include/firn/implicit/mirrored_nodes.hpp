/// \file The nodes beside mirrored walls in an implicit step: those behind a wall follow those in front of it, as a
/// linear function. \see NodesBehind::mirrored
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/stage/mirror_planes.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <ranges>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Checks that the mirrored walls are linear constraints, each for itself.
/// \throws parameter_error  if one lets matter separate, or acts with friction; or if two are fewer than 3 cells apart
template <int D>
[[gnu::cold]] void check_linear_mirrors(const Mirrors& mirrors, const Domain<D>& domain) {
    for (const MirrorPlane& plane : mirrors.planes) {
        const double position = domain.lower[plane.axis] + plane.node * domain.cell_size;
        if (plane.contact != Contact::stick && (plane.contact != Contact::slip || plane.friction > 0))
            throw parameter_error(sentence(
                "The mirrored wall at ", position, " m along axis ", plane.axis, " has the contact ",
                name_of(plane.contact), " and the friction ", plane.friction,
                ". Implicit and quasi-static steps take mirrored walls with Contact::stick, or with Contact::slip and "
                "without friction. Choose one of these, or set nodes_behind to NodesBehind::held."));
        for (const MirrorPlane& other : mirrors.planes) {
            const int apart = std::abs(other.node - plane.node);
            const bool is_same = apart == 0 && other.inward == plane.inward && other.contact == plane.contact;
            if (other.axis == plane.axis && apart < 3 && !is_same)
                throw parameter_error(sentence(
                    "Two mirrored walls across axis ", plane.axis, ", at ", position, " m, are ", apart,
                    " cells apart; implicit and quasi-static steps need at least 3. Take smaller cells, or set "
                    "nodes_behind to NodesBehind::held."));
        }
    }
}

}  // namespace detail

/// The nodes beside the mirrored walls of a grid. Displacements of the nodes are even or odd about a wall, component by
/// component: all are odd at a wall with Contact::stick, and at one with Contact::slip the normal one is. So a node
/// behind a wall follows its mirror image in front of it, and a node on the wall keeps its even components alone. At an
/// edge, nodes are mirrored at one wall after the other.
template <std::floating_point S, int D>
class MirroredNodes {
public:
    /// There are no mirrored walls.
    MirroredNodes() = default;
    /// Finds the nodes beside the walls. \param mirrors  \see mirrors_of
    /// \param threads  number of threads; 0: thread_count() chooses
    /// \throws parameter_error  if a wall lets matter separate, or acts with friction; or if two walls across one axis
    ///                          are fewer than 3 cells apart
    MirroredNodes(const SparseGrid<S, D>& grid, const Mirrors& mirrors, int threads) {
        if (mirrors.planes.empty()) return;
        detail::check_linear_mirrors(mirrors, grid.domain());
        std::vector<Found> of_blocks(grid.block_count());
        parallel_for(
            grid.block_count(), thread_count(threads),
            [&](std::size_t b, int) { find(grid, mirrors, b, of_blocks[b]); }, 16);
        for (const Found& found : of_blocks) {
            nodes_.insert(nodes_.end(), found.nodes.begin(), found.nodes.end());
            masters_.insert(masters_.end(), found.masters.begin(), found.masters.end());
            images_.insert(images_.end(), found.images.begin(), found.images.end());
            signs_.insert(signs_.end(), found.signs.begin(), found.signs.end());
            on_.insert(on_.end(), found.on.begin(), found.on.end());
        }
        for (std::size_t i = 0; i < nodes_.size(); ++i) by_master_.emplace_back(masters_[i], std::uint32_t(i));
        std::sort(by_master_.begin(), by_master_.end());
        for (std::size_t k = 0; k < by_master_.size(); ++k)
            if (k == 0 || by_master_[k].first != by_master_[k - 1].first) firsts_.push_back(k);
        firsts_.push_back(by_master_.size());
    }

    /// How a node follows its mirror image: bit a of a number says that it lies behind a wall across axis a, so that
    /// the image lies two nodes away; bit 3 + a that it lies that far below; bit 6 + a that component a is odd. 0: it
    /// does not.
    using Image = std::uint16_t;

    /// Indices of the nodes that follow others, ascending. Node k of block b has the index b × block_nodes<D> + k.
    const std::vector<std::uint32_t>& nodes() const { return nodes_; }
    /// Indices of the nodes that they follow, in the same order.
    const std::vector<std::uint32_t>& masters() const { return masters_; }
    /// How they follow them, in the same order.
    const std::vector<Image>& images() const { return images_; }
    /// Whether a node follows another one. \param node  its index
    bool follows(std::uint32_t node) const { return std::ranges::binary_search(nodes_, node); }
    /// Returns 1 for each component in which a wall lets a node move, 0 for each other one. \param node  its index
    Vec<S, D> even(std::uint32_t node) const {
        const auto found = std::ranges::lower_bound(on_, node, {}, &OnWall::node);
        return found != on_.end() && found->node == node ? found->even : Vec<S, D>::filled(S(1));
    }
    /// Calls f(index of a node, P) for all nodes on walls, with the projection P onto their even components, in the
    /// order of the nodes.
    template <class F>
    void for_on_walls(const F& f) const {
        for (const OnWall& one : on_) f(std::size_t(one.node), projection(one.even));
    }
    /// Returns the projection onto the components that are 1, not 0, in a vector.
    static Mat<S, D> projection(const Vec<S, D>& even) {
        Mat<S, D> P = Mat<S, D>::zero();
        for (int a = 0; a < D; ++a) P(a, a) = even[a];
        return P;
    }

    /// Makes displacements even or odd about the walls: nodes on walls keep their even components, and nodes behind
    /// them follow those in front. \param numbers  those of all nodes
    void extend(S* numbers, int threads) const {
        project(numbers, threads);
        for_each(nodes_.size(), threads, [&](std::size_t i) {
            const S* const from = numbers + masters_[i] * std::size_t(node_width);
            S* const to = numbers + nodes_[i] * std::size_t(node_width);
            for (int a = 0; a < D; ++a) to[a] = signs_[i][a] * from[a];
        });
    }
    /// Moves the forces on nodes behind walls to those that they follow: the transpose of extend(). Nodes on walls keep
    /// the even components. \param numbers  those of all nodes
    void fold(S* numbers, int threads) const {
        for_masters(threads, [&](std::uint32_t master, const auto& followers) {
            S* const to = numbers + master * std::size_t(node_width);
            for (const auto& [same, i] : followers) {
                S* const from = numbers + nodes_[i] * std::size_t(node_width);
                for (int a = 0; a < D; ++a) to[a] += signs_[i][a] * std::exchange(from[a], S(0));
            }
        });
        project(numbers, threads);
    }
    /// Moves the blocks of nodes behind walls to those that they follow, each for itself.
    /// \param blocks  D × D numbers of each node
    void fold_blocks(S* blocks, int threads) const {
        for_masters(threads, [&](std::uint32_t master, const auto& followers) {
            for (const auto& [same, i] : followers)
                for (int b = 0, k = 0; b < D; ++b)
                    for (int a = 0; a < D; ++a, ++k)
                        blocks[master * std::size_t(D * D) + std::size_t(k)] +=
                            signs_[i][a] * signs_[i][b] *
                            std::exchange(blocks[nodes_[i] * std::size_t(D * D) + std::size_t(k)], S(0));
        });
    }
    /// Changes the volumes of the nodes, their numbers at node_mass, to those that they would have if the matter's
    /// mirror image stood behind the walls. \see scatter_volumes
    void mirror_volumes(S* numbers, int threads) const {
        const auto volume = [numbers](std::uint32_t node) -> S& {
            return numbers[node * std::size_t(node_width) + std::size_t(node_mass)];
        };
        for_masters(threads, [&](std::uint32_t master, const auto& followers) {
            for (const auto& [same, i] : followers) volume(master) += volume(nodes_[i]);
        });
        for (const OnWall& one : on_) volume(one.node) *= one.images;
        for_each(nodes_.size(), threads, [&](std::size_t i) { volume(nodes_[i]) = volume(masters_[i]); });
    }

private:
    struct OnWall {
        std::uint32_t node;
        S images;  ///< number of the images of matter in which the node takes part
        Vec<S, D> even;
    };
    struct Found {
        std::vector<std::uint32_t> nodes, masters;
        std::vector<Image> images;
        std::vector<Vec<S, D>> signs;
        std::vector<OnWall> on;
    };
    /// What the walls across one axis do to the nodes with one index along it.
    struct Along {
        bool is_on = false, is_behind = false;
        int front = 0;  ///< where the mirror image lies [nodes]
        Vec<S, D> even = Vec<S, D>::filled(S(1));
    };

    static void find(const SparseGrid<S, D>& grid, const Mirrors& mirrors, std::size_t b, Found& found) {
        std::array<std::array<Along, std::size_t(block_size)>, std::size_t(D)> along{};
        bool is_beside = false;
        for (const MirrorPlane& plane : mirrors.planes)
            for (const int side : {0, -1}) {
                const auto axis = std::size_t(plane.axis);
                int node = plane.node + side * plane.inward;
                if (grid.domain().periodic[axis]) node = modulo(node, grid.domain().cells(plane.axis));
                if (node >> 2 != grid.block_along(b, plane.axis)) continue;
                Along& here = along[axis][std::size_t(node & (block_size - 1))];
                (side == 0 ? here.is_on : here.is_behind) = true;
                here.front = 2 * plane.inward;
                here.even = Vec<S, D>::filled(S(plane.contact == Contact::stick ? 0 : 1));
                here.even[plane.axis] = S(0);
                is_beside = true;
            }
        if (!is_beside) return;
        for (int i = 0; i < block_nodes<D>; ++i) {
            const auto node = std::uint32_t(b * std::size_t(block_nodes<D>)) + std::uint32_t(i);
            OnWall on{node, S(1), Vec<S, D>::filled(S(1))};
            Vec<S, D> sign = on.even, even = on.even;
            Image image = 0;
            bool is_on = false;
            BlockCoordinate<D> block = grid.block(b);
            std::uint32_t within = 0;
            for (int a = 0; a < D; ++a) {
                int place = place_in_block<D>(i, a);
                const Along& here = along[std::size_t(a)][std::size_t(place)];
                for (int c = 0; c < D; ++c) even[c] *= here.even[c];
                if (here.is_on) {
                    is_on = true;
                    on.images *= S(2);
                }
                if (here.is_behind) {
                    image |= Image((here.front > 0 ? 1 : 9) << a);
                    place += here.front;
                    for (int c = 0; c < D; ++c) sign[c] *= S(2) * here.even[c] - S(1);
                }
                block[std::size_t(a)] += place >> 2;
                within = within * block_size + std::uint32_t(place & (block_size - 1));
            }
            on.even = even;
            for (int c = 0; c < D; ++c)
                if (sign[c] < S(0)) image |= Image(64 << c);
            if (image != 0) {
                const std::uint32_t of_master = grid.find(wrapped(grid.domain(), block));
                if (of_master == no_block) {  // matter is behind the wall alone: the wall holds it
                    is_on = true;
                    on.images = S(1);
                } else {
                    is_on = false;
                    found.nodes.push_back(node);
                    found.masters.push_back(of_master * std::uint32_t(block_nodes<D>) + within);
                    found.images.push_back(image);
                    found.signs.push_back(sign);
                }
            }
            if (is_on) found.on.push_back(on);
        }
    }

    template <class F>
    static void for_each(std::size_t n, int threads, const F& f) {
        if (n > 0) parallel_for(n, thread_count(threads), [&](std::size_t i, int) { f(i); }, 256);
    }
    /// Calls f(master, its pairs of by_master_) for each node that others follow.
    template <class F>
    void for_masters(int threads, const F& f) const {
        if (nodes_.empty()) return;
        for_each(firsts_.size() - 1, threads, [&](std::size_t k) {
            const auto begin = by_master_.begin();
            f(begin[std::ptrdiff_t(firsts_[k])].first,
              std::ranges::subrange(begin + std::ptrdiff_t(firsts_[k]), begin + std::ptrdiff_t(firsts_[k + 1])));
        });
    }
    void project(S* numbers, int threads) const {
        for_each(on_.size(), threads, [&](std::size_t i) {
            for (int a = 0; a < D; ++a)
                numbers[on_[i].node * std::size_t(node_width) + std::size_t(a)] *= on_[i].even[a];
        });
    }

    std::vector<std::uint32_t> nodes_, masters_;  // nodes_[i] follows masters_[i], and signs_[i] says how
    std::vector<Image> images_;
    std::vector<Vec<S, D>> signs_;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> by_master_;  // (master, i), sorted
    std::vector<std::size_t> firsts_;                                 // where the pairs of each master begin
    std::vector<OnWall> on_;                                          // sorted by nodes
};

}  // namespace firn::inline FIRN_BUILD
