/// \file P2G over all particles, in floating point. \see Serial, Coloured
#pragma once

#include <firn/exec/execution.hpp>
#include <firn/exec/partition.hpp>
#include <firn/exec/scatter.hpp>

#include <algorithm>

namespace firn {

namespace detail {

/// Calls body(records, l, range) for every particle of the group: the one in lane l of `records`.
template <class Kernel, class Transfer, class Force, class View, class Body>
FIRN_INLINE void for_records(const GroupReader<View>& reader, const BlockGroup& group, const Body& body) {
    PackRecords<Kernel, Force, typename View::scalar_type, View::dimension> records;
    for (std::size_t slot = 0; slot < group.particles; slot += pack_size) {
        records.template fill<Transfer>(reader, slot);
        const int used = int(std::min<std::size_t>(pack_size, group.particles - slot));
        for (int l = 0; l < used; ++l) body(records, l, reader.range(slot + std::size_t(l)));
    }
}

/// Scatters a group straight to the grid's nodes.
/// \param sums  how a quad of numbers is added. \see FloatSums
template <class Kernel, class Transfer, class Force, class View, class Sums, std::floating_point S, int D>
void scatter_to_nodes(const GroupReader<View>& reader, const BlockGroup& group, const SparseGrid<S, D>& grid,
                      const Sums& sums, typename Sums::number* nodes) {
    for_records<Kernel, Transfer, Force>(
        reader, group, [&](const auto& records, int l, std::uint32_t range) FIRN_LAMBDA {
            const std::uint32_t* neighbours = grid.neighbours(range);
            records.scatter(l, [&](std::ptrdiff_t at, const auto& added) FIRN_LAMBDA {
                S numbers[16];
                added.store(numbers);
                unroll<Kernel::support>([&](auto k) FIRN_LAMBDA {
                    const std::size_t node = ArenaNodes<Kernel, D>::in_grid(neighbours, at / node_width + k);
                    sums.add(nodes + node * node_width, numbers + k * node_width);
                });
            });
        });
}

/// Scatters a group of one block to an arena of its nodes, then adds that to the grid.
template <class Kernel, class Transfer, class Force, class View, class Sums, std::floating_point S, int D>
void scatter_to_arena(const GroupReader<View>& reader, const BlockGroup& group, const SparseGrid<S, D>& grid,
                      const Sums& sums, typename Sums::number* nodes) {
    using Number = typename Sums::number;
    Arena<Kernel, Number, D> arena;
    std::fill(std::begin(arena.node), std::end(arena.node), Number(0));
    for_records<Kernel, Transfer, Force>(reader, group, [&](const auto& records, int l, std::uint32_t) FIRN_LAMBDA {
        records.scatter(
            l, [&](std::ptrdiff_t at, const auto& added) FIRN_LAMBDA { sums.add_row(arena.node + at, added); });
    });
    Arena<Kernel, Number, D>::for_runs(
        nodes, grid.neighbours(group.first_range), [&](int from, Number* to, auto count) FIRN_LAMBDA {
            unroll<count * node_width>([&](auto i) FIRN_LAMBDA { to[i] += arena.node[from + i]; });
        });
}

/// All groups, colour after colour: no two threads ever add to one node, and every node is added to in one order.
template <class Kernel, class Transfer, class Force, class View, class Sums, std::floating_point S, int D>
void scatter_coloured(const View& view, const BlockPartition<D>& partition, const SparseGrid<S, D>& grid, double dt,
                      int threads, const Sums& sums, typename Sums::number* nodes) {
    for_groups_by_colour(partition, threads, [&](const BlockGroup& group, int) {
        const GroupReader<View> reader(view, partition, group, grid.domain(), dt);
        if (group.ranges == 1)
            scatter_to_arena<Kernel, Transfer, Force>(reader, group, grid, sums, nodes);
        else
            scatter_to_nodes<Kernel, Transfer, Force>(reader, group, grid, sums, nodes);
    });
}

template <std::floating_point S>
struct FloatSums {
    using number = S;
    FIRN_INLINE void add(S* to, const S* numbers) const { (quad<S>::load(to) + quad<S>::load(numbers)).store(to); }
    template <class Row>
    FIRN_INLINE void add_row(S* to, const Row& added) const {
        (Row::load(to) + added).store(to);
    }
};

template <std::floating_point S, int D>
void clear(SparseGrid<S, D>& grid, int threads) {
    const auto clear_block = [&](std::size_t b, int) { std::fill_n(grid.nodes(b), block_nodes<D> * node_width, S(0)); };
    parallel_for(grid.block_count(), threads, clear_block, 64);
}

}  // namespace detail

/// Particles to grid: clears the grid, then adds mass and momentum of all particles, the impulse of the stress over
/// dt included. Needs: the grid activated for the partition, and no particle more than `allowed_drift` cells from the
/// block it was sorted into.
template <class Kernel, class Transfer, class Force, class View, int D>
void p2g(const Coloured& execution, const View& view, const BlockPartition<D>& partition,
         SparseGrid<typename View::scalar_type, D>& grid, double dt) {
    const int threads = thread_count(execution.threads);
    detail::clear(grid, threads);
    detail::scatter_coloured<Kernel, Transfer, Force>(view, partition, grid, dt, threads,
                                                      detail::FloatSums<typename View::scalar_type>{}, grid.nodes(0));
}

/// \copydoc p2g
template <class Kernel, class Transfer, class Force, class View, int D>
void p2g(const Serial&, const View& view, const BlockPartition<D>& partition,
         SparseGrid<typename View::scalar_type, D>& grid, double dt) {
    detail::clear(grid, 1);
    for (const BlockGroup& group : partition.groups)
        detail::scatter_to_nodes<Kernel, Transfer, Force>(GroupReader<View>(view, partition, group, grid.domain(), dt),
                                                          group, grid, detail::FloatSums<typename View::scalar_type>{},
                                                          grid.nodes(0));
}

}  // namespace firn
