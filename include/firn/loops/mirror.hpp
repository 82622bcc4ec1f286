/// \file The pass over the nodes beside mirrored walls, after the grid update. \see NodesBehind::mirrored
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/core/parallel.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/loops/ranks_of.hpp>
#include <firn/loops/reactions.hpp>
#include <firn/simd/transpose.hpp>
#include <firn/stage/mirror_planes.hpp>

#include <algorithm>
#include <concepts>
#include <cstring>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// The nodes of a block's columns across a wall, behind it, on it, and in front of it: copies of their numbers, and the
/// addresses of the first ones in the grid. All columns of a block are computed together, in SIMD lanes.
template <std::floating_point S, int D>
class BlockColumns {
    using P = native_pack<S>;
    static constexpr int lanes = scalar_traits<P>::lanes;

public:
    static constexpr int count = block_nodes<D> / block_size;  ///< Number of columns of a block.

    /// Copies the nodes of the columns whose middle nodes lie in block b.
    BlockColumns(SparseGrid<S, D>& grid, const MirrorPlane& plane, std::size_t b)
        : plane_(plane), apart_(1 << (2 * (D - 1 - plane.axis))) {
        BlockCoordinate<D> block = grid.block(b);
        const int along = block[std::size_t(plane.axis)];
        for (int side = 0; side < 3; ++side) {
            const int node = plane.node + (side - 1) * plane.inward;
            std::uint32_t of_node = std::uint32_t(b);
            if (node >> 2 != plane.node >> 2) {
                block[std::size_t(plane.axis)] = along + (node >> 2) - (plane.node >> 2);  // in the same copy
                of_node = grid.find(wrapped(grid.domain(), block));
            }
            if (of_node == no_block) continue;
            first_[side] = grid.nodes(of_node) + (node & 3) * apart_ * node_width;
            for (int c = 0; c < count; ++c)
                std::memcpy(before_[side] + c * node_width, first_[side] + place(c), node_width * sizeof(S));
        }
    }

    /// Returns a register of columns as they were copied. \param first  index of the first one
    NodeColumn<P, D> column(int first) const {
        P r[3][4];
        for (int side = 0; side < 3; ++side) load_quads(before_[side] + first * node_width, r[side]);
        NodeColumn<P, D> column;
        unroll<D>([&](auto a) FIRN_LAMBDA {
            column.behind.v[a] = r[0][a];
            column.on.v[a] = r[1][a];
            column.front.v[a] = r[2][a];
        });
        column.mass_behind = r[0][node_mass], column.mass_on = r[1][node_mass], column.mass_front = r[2][node_mass];
        return column;
    }
    /// Returns whether a register of columns has matter.
    static bool has_matter(const NodeColumn<P, D>& column) {
        return any(column.mass_behind + column.mass_on + column.mass_front > P(0));
    }
    /// Sets a register of columns, to be written by write(). \param first  index of the first one
    void set(int first, const NodeColumn<P, D>& now) {
        P r[3][4];
        for (int side = 0; side < 3; ++side) load_quads(before_[side] + first * node_width, r[side]);
        unroll<D>([&](auto a) FIRN_LAMBDA {
            r[0][a] = now.behind.v[a];
            r[1][a] = now.on.v[a];
            r[2][a] = now.front.v[a];
        });
        r[0][node_mass] = now.mass_behind, r[1][node_mass] = now.mass_on, r[2][node_mass] = now.mass_front;
        for (int side = 0; side < 3; ++side) store_quads(r[side], after_[side] + first * node_width);
    }
    /// Writes all columns to the grid. Each must have been set.
    void write() {
        for (int side = 0; side < 3; ++side)
            if (first_[side])
                for (int c = 0; c < count; ++c)
                    std::memcpy(first_[side] + place(c), after_[side] + c * node_width, node_width * sizeof(S));
    }
    /// Replaces the columns by f(column) or f(column, index of the first), for each register of columns with matter,
    /// and writes them to the grid.
    template <class F>
    void change(const F& f) {
        for (int first = 0; first < padded; first += lanes) {
            const NodeColumn<P, D> before = column(first);
            if (!has_matter(before))
                set(first, before);
            else if constexpr (std::invocable<const F&, const NodeColumn<P, D>&, int>)
                set(first, f(before, first));
            else
                set(first, f(before));
        }
        write();
    }

    /// Returns the address of the first node behind the wall; nullptr if the grid does not have it.
    const S* behind() const { return first_[0]; }
    /// Calls f(address, before, after) for each node of the columns, with its numbers before and after the wall acted.
    template <class F>
    void for_nodes(const F& f) const {
        for (int c = 0; c < count; ++c)
            for (int side = 0; side < 3; ++side)
                if (first_[side])
                    f(first_[side] + place(c), before_[side] + c * node_width, after_[side] + c * node_width);
    }

    static constexpr int padded = std::max(count, lanes);  ///< Number of columns, filled up to whole registers.

    /// Returns the index in its block of the node of column c that has index 0 along the axis.
    /// \param apart  the nodes of a column are so many nodes apart in a block
    static constexpr int node_of_column(int c, int apart) { return c / apart * apart * block_size + c % apart; }

private:
    /// Returns where column c lies: the distance of its numbers from those of the first column.
    int place(int c) const { return node_of_column(c, apart_) * node_width; }

    const MirrorPlane& plane_;
    int apart_;  // the nodes of a column are so many nodes apart in the block
    S* first_[3] = {};
    alignas(64) S before_[3][padded * node_width] = {}, after_[3][padded * node_width];
};

/// Adds the impulse of a wall on matter at the nodes of a block's columns.
/// \param masses  the mass of each node of the grid before any wall acted
template <std::floating_point S, int D>
[[gnu::cold]] void add_reaction(Reaction<D>& sum, const SparseGrid<S, D>& grid, const BlockColumns<S, D>& columns,
                                const S* masses) {
    columns.for_nodes([&](const S* node, const S* before, const S* after) {
        const auto index = std::size_t(node - grid.nodes(0)) / node_width;
        Vec<double, D> change{};
        for (int a = 0; a < D; ++a) change[a] = double(after[a]) - double(before[a]);
        const std::size_t block = index / std::size_t(block_nodes<D>);
        const Vec<double, D> x = node_position(grid, block, int(index % std::size_t(block_nodes<D>)));
        add_impulse(sum, x, double(masses[index]), change);
    });
}

/// Lets mirrored walls act on the nodes beside them, which hold velocities and masses. \see mirrored
/// \param mirrors        the walls, with closing speeds if they act by the gap of particles. \see MirrorsByGap
/// \param with_friction  false, in passes before forces act: walls act without friction. Of the walls that act by the
///                       gap, only those that hold matter act then: what may leave meets its mirror image like another
///                       contact group, once a step. So FLIP and FMPM receive the whole impulse
/// \param reactions      impulses of the walls on matter are added to it; nullptr if they are not wanted
template <std::floating_point S, int D, std::derived_from<Mirrors> M>
void mirror_nodes(int threads, const RankSums& ranks, SparseGrid<S, D>& grid, const M& mirrors, bool with_friction,
                  Reactions<D>* reactions = nullptr) {
    if (mirrors.planes.empty()) return;
    using P = native_pack<S>;
    const SurfaceWeights<P> weights{P(S(mirrors.weights.on)), P(S(mirrors.weights.beside))};
    const std::size_t blocks = grid.block_count();
    std::vector<Reaction<D>> of_blocks;
    std::size_t parts = 0;
    S* masses = nullptr;
    if (reactions) {
        parts = reactions->parts.size();
        of_blocks.resize(blocks * parts);
        for (std::size_t i = 0; i < of_blocks.size(); ++i) of_blocks[i].about = reactions->parts[i % parts].about;
        masses = grid.template scratch<S>(threads);
        const S* const nodes = grid.nodes(0);
        for (std::size_t i = 0; i < blocks * std::size_t(block_nodes<D>); ++i)
            masses[i] = nodes[i * node_width + node_mass];
    }
    for (std::size_t first = 0, last = 0; first < mirrors.planes.size(); first = last) {
        const MirrorPlane& of = mirrors.planes[first];
        last = mirrors.end_of_axis(first);
        // The rank that counts the block behind the wall counts the columns, in the sum of that block. No matter
        // reaches columns without this block.
        const auto add = [&](const BlockColumns<S, D>& columns, int part) {
            if (!columns.behind()) return;
            const auto behind =
                std::size_t(columns.behind() - grid.nodes(0)) / std::size_t(block_nodes<D> * node_width);
            if (ranks.counts(behind))
                add_reaction(of_blocks[behind * parts + std::size_t(part)], grid, columns, masses);
        };
        const auto act = [&](std::size_t b, int) {
            const int along = grid.block_along(b, of.axis);
            for (std::size_t p = first; p < last; ++p) {
                const MirrorPlane& plane = mirrors.planes[p];
                if (along != plane.node >> 2) continue;
                BlockColumns<S, D> columns(grid, plane, b);
                const P friction(with_friction ? S(plane.friction) : S(0));
                if constexpr (std::same_as<M, MirrorsByGap<S>>)
                    columns.change([&, closing = mirrors.of(p, b)](const NodeColumn<P, D>& column, int c) {
                        P speed;
                        for (int l = 0; l < scalar_traits<P>::lanes; ++l)
                            speed.set(l, closing[c + quad_of_lane<P>(l)]);  // the order of load_quads()
                        if (!with_friction) speed = select(is_held(speed), speed, P(S(never_closing)));
                        return mirrored_by_gap(column, plane.axis, plane.inward, plane.contact, friction, weights,
                                               speed);
                    });
                else
                    columns.change([&](const NodeColumn<P, D>& column) {
                        return mirrored(column, plane.axis, plane.inward, plane.contact, friction, weights);
                    });
                if (reactions) add(columns, plane.part);
            }
        };
        parallel_for(blocks, threads, act, 64);
    }
    if (reactions) {
        std::vector<Reaction<D>> of_walls(parts);
        sum_reactions<D>(ranks, of_blocks, of_walls);
        for (std::size_t k = 0; k < parts; ++k) reactions->parts[k] += of_walls[k];
    }
}

/// Lets mirrored walls act on the nodes beside them, in passes before forces act. \see mirror_nodes
template <std::floating_point S, int D, std::derived_from<Mirrors> M>
void mirror_without_friction(int threads, SparseGrid<S, D>& grid, const M& mirrors) {
    mirror_nodes(threads, one_rank<S, D>(), grid, mirrors, false);
}

}  // namespace detail
}  // namespace firn::inline FIRN_BUILD
