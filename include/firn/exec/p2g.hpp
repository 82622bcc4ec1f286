/// \file P2G over all particles, in floating point. \see Serial, Coloured
#pragma once

#include <firn/exec/execution.hpp>
#include <firn/exec/partition.hpp>
#include <firn/exec/scatter.hpp>

#include <algorithm>

namespace firn {

namespace detail {

/// Calls body(records, l, slot in the group) for every particle of the group: the one in lane l of `records`.
/// \param n  size of the arena
template <class Kernel, class Transfer, class Force, class View, class Body>
FIRN_INLINE void for_records(const ParticleReader<View>& reader, const GroupPlaces<View>& places,
                             const BlockGroup& group, int n, const Body& body) {
    PackRecords<Kernel, Force, typename View::scalar_type, View::dimension> records;
    for (std::size_t slot = 0; slot < group.particles; slot += pack_size) {
        records.template fill<Transfer>(reader, places, slot, n);
        const int used = int(std::min<std::size_t>(pack_size, group.particles - slot));
        for (int l = 0; l < used; ++l) body(records, l, slot + std::size_t(l));
    }
}

/// Scatters a group straight to the grid's nodes.
/// \param sums  how a quad of numbers is added. \see FloatSums
template <class Kernel, class Transfer, class Force, class View, class Sums, std::floating_point S, int D>
void scatter_to_nodes(const ParticleReader<View>& reader, const GroupPlaces<View>& places, const BlockGroup& group,
                      const SparseGrid<S, D>& grid, const Sums& sums, typename Sums::number* nodes) {
    constexpr int n = arena_size<Kernel>;
    for_records<Kernel, Transfer, Force>(
        reader, places, group, n, [&](const auto& records, int l, std::size_t slot) FIRN_LAMBDA {
            const std::uint32_t* neighbours = grid.neighbours(places.blocks().range(slot));
            records.template scatter<n>(l, [&](std::ptrdiff_t at, const auto& added) FIRN_LAMBDA {
                S numbers[16];
                added.store(numbers);
                unroll<Kernel::support>([&](auto k) FIRN_LAMBDA {
                    const std::size_t node = ArenaNodes<Kernel, D>::in_grid(neighbours, at / node_width + k);
                    sums.add(nodes + node * node_width, numbers + k * node_width);
                });
            });
        });
}

/// Scatters a group to an arena of the nodes around its cube of blocks, then adds that to the grid.
template <int Blocks, class Kernel, class Transfer, class Force, class View, class Sums, std::floating_point S, int D>
void scatter_to_arena(const ParticleReader<View>& reader, const GroupPlaces<View>& places,
                      const BlockPartition<D>& partition, const BlockGroup& group, const SparseGrid<S, D>& grid,
                      const Sums& sums, typename Sums::number* nodes) {
    using Number = typename Sums::number;
    using GroupArena = Arena<Kernel, Number, D, Blocks>;
    const ArenaBox<D> box = places.template box<Kernel>(group.packs());
    GroupArena arena;
    arena.clear(box);
    for_records<Kernel, Transfer, Force>(
        reader, places, group, GroupArena::n, [&](const auto& records, int l, std::size_t) FIRN_LAMBDA {
            records.template scatter<GroupArena::n>(
                l, [&](std::ptrdiff_t at, const auto& added) FIRN_LAMBDA { sums.add_row(arena.node + at, added); });
        });
    const BlocksAround<D, Blocks> around(grid, partition, group);
    GroupArena::for_runs(nodes, around.data(), box, [&](int from, Number* to, auto count) FIRN_LAMBDA {
        unroll<count>([&](auto k) FIRN_LAMBDA {
            constexpr int i = k * node_width;
            (quad<Number>::load(to + i) + quad<Number>::load(arena.node + from + i)).store(to + i);
        });
    });
}

/// All groups, colour after colour: no two threads ever add to one node, and every node is added to in one order.
template <class Kernel, class Transfer, class Force, class View, class Sums, std::floating_point S, int D>
void scatter_coloured(const View& view, const BlockPartition<D>& partition, const SparseGrid<S, D>& grid, double dt,
                      int threads, const Sums& sums, typename Sums::number* nodes) {
    const Positions<View> positions(grid.domain());
    const ParticleReader<View> reader(view, grid.domain(), dt);
    for_groups_by_colour(partition, threads, [&](const BlockGroup& group, int) {
        const GroupPlaces<View> places(view, partition, group, positions);
        if (group.sparse)
            scatter_to_arena<2, Kernel, Transfer, Force>(reader, places, partition, group, grid, sums, nodes);
        else
            scatter_to_arena<1, Kernel, Transfer, Force>(reader, places, partition, group, grid, sums, nodes);
    });
}

/// One group straight to the nodes, for a thread that is alone or adds atomically.
template <class Kernel, class Transfer, class Force, class View, class Sums, std::floating_point S, int D>
void scatter_group(const View& view, const BlockPartition<D>& partition, const BlockGroup& group,
                   const SparseGrid<S, D>& grid, double dt, const Sums& sums, typename Sums::number* nodes) {
    const Positions<View> positions(grid.domain());
    scatter_to_nodes<Kernel, Transfer, Force>(ParticleReader<View>(view, grid.domain(), dt),
                                              GroupPlaces<View>(view, partition, group, positions), group, grid, sums,
                                              nodes);
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
        detail::scatter_group<Kernel, Transfer, Force>(view, partition, group, grid, dt,
                                                       detail::FloatSums<typename View::scalar_type>{}, grid.nodes(0));
}

}  // namespace firn
