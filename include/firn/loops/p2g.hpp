/// \file P2G of all particles, in floating point. \see Coloured
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/data/block_partition.hpp>
#include <firn/data/particle_set.hpp>
#include <firn/loops/bands.hpp>
#include <firn/loops/execution.hpp>
#include <firn/loops/scatter.hpp>
#include <firn/loops/spray.hpp>
#include <firn/stage/time_step.hpp>

#include <algorithm>
#include <numeric>
#include <span>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Calls body(group, thread) for every group of particles, one phase after the other. A phase is a list of groups that
/// share no node, so that several threads can work on these groups at the same time.
/// \param range  the phases whose groups body() gets
template <int D, class Body>
void for_groups_by_phase(const BlockPartition<D>& partition, int threads, const Body& body, PhaseRange range = {}) {
    const std::vector<std::size_t>& ends = partition.phase_ends;
    std::vector<std::size_t> counts(ends.size());
    std::adjacent_difference(ends.begin(), ends.end(), counts.begin());
    const std::size_t last = std::min(range.last, ends.size()), first = std::min(range.first, last);
    parallel_phases(std::span<const std::size_t>(counts).subspan(first, last - first), threads,
                    [&](std::size_t k, std::size_t i, int thread) {
                        const std::size_t phase = first + k;
                        body(partition.groups[partition.by_phase[ends[phase] - counts[phase] + i]], thread);
                    });
}

namespace detail {

/// Calls body(records, slot, used) for every pack of the group. `records` are the P2G records of the pack's particles.
/// `slot` is the first slot of the pack, counted from the group's first slot. Lanes 0 to used − 1 of `records` hold
/// particles.
/// \param n  number of nodes along each axis of the arena
template <class Kernel, class Transfer, class Force, class View, class Sums, class Body>
FIRN_INLINE void for_packs(const ParticleReader<View>& reader, const GroupPlaces<View>& places, const BlockGroup& group,
                           int n, Sums& sums, const Body& body) {
    PackRecords<Kernel, Force, typename View::scalar_type, View::dimension> records;
    for (std::size_t slot = 0; slot < group.particles; slot += pack_size) {
        reader.template prefetch<Transfer>(group.first_slot + slot + pack_size);
        records.template fill<Transfer>(reader, places, slot, n, sums);
        body(records, slot, int(std::min<std::size_t>(pack_size, group.particles - slot)));
    }
}

/// Adds the contributions of a group's particles directly to the nodes of the grid. The three scatter functions are not
/// inlined, so that the compiler can use all registers in each of them.
template <class Kernel, class Transfer, class Force, class View, class Sums, class Grid, int D>
[[gnu::noinline]] void scatter_to_nodes(const ParticleReader<View>& reader, const GroupPlaces<View>& places,
                                        const BlockPartition<D>& partition, const BlockGroup& group, const Grid& grid,
                                        Sums& sums, typename Sums::number* nodes) {
    using S = typename View::scalar_type;
    if (places.template has_strays<Kernel>(group)) throw_strays();
    for_packs<Kernel, Transfer, Force>(
        reader, places, group, arena_size<Kernel>, sums,
        [&](const auto& records, std::size_t slot, int used) FIRN_LAMBDA {
            const auto range_of = [&](int l) { return places.blocks().range(slot + std::size_t(l)); };
            const bool fits = sums.fits();
            for (int first = 0, last = 1; first < used; first = last++) {
                while (last < used && range_of(last) == range_of(first)) ++last;
                const std::uint32_t* neighbours = grid.neighbours(partition, range_of(first));
                const auto rows_at = [&](std::ptrdiff_t corner) FIRN_LAMBDA {
                    return GridRows<std::remove_const_t<Sums>, Kernel, S, D>(nodes, neighbours, corner);
                };
                const auto count = [&](std::ptrdiff_t corner, int particles) FIRN_LAMBDA {
                    RowsInGrid<Kernel, D> rows;
                    rows.find(neighbours, corner, [](auto) {});
                    sums.count(std::size_t(rows.first[0] / node_width), particles);
                };
                if (fits)
                    records.template scatter<Sums::costly>(first, last, rows_at, count);
                else
                    records.count(first, last, count);
            }
        });
}

/// Adds the values of an arena to the nodes of the grid.
template <std::floating_point S, class Sums, class GroupArena, int D>
FIRN_INLINE void add_arena(const GroupArena& arena, typename Sums::number* nodes, const BlocksAround<D>& around,
                           const ArenaBox<D>& box) {
    arena.for_runs(nodes, around, box, [&](int from, typename Sums::number* to, auto count) FIRN_LAMBDA {
        using Run = exact_row<S, count>;
        (Sums::template load<Run>(to) + Sums::template load<Run>(arena.node + from)).store(to);
    });
}

/// Adds the contributions of a group's particles to an arena (contiguous memory for the nodes around the group). Then
/// adds the values of the arena to the nodes of the grid.
template <class Kernel, class Transfer, class Force, class View, class Sums, class Grid, int D>
[[gnu::noinline]] void scatter_to_arena(const ParticleReader<View>& reader, const GroupPlaces<View>& places,
                                        const BlockPartition<D>& partition, const BlockGroup& group, const Grid& grid,
                                        Sums& sums, typename Sums::number* nodes) {
    using S = typename View::scalar_type;
    using Number = typename Sums::number;
    using GroupArena = Arena<Kernel, Number, D>;
    using Rows = ArenaRows<std::remove_const_t<Sums>, Kernel, S, D>;
    const ArenaBox<D> box = places.template box<Kernel>(group);
    if (box.strays) throw_strays();
    GroupArena arena;
    arena.clear(group, box);
    const int n = arena.n;  // a local copy: the compiler knows that writing to the arena does not change it
    typename Sums::template Counts<Kernel, D> counts(group, box);
    for_packs<Kernel, Transfer, Force>(
        reader, places, group, n, sums, [&](const auto& records, std::size_t, int used) FIRN_LAMBDA {
            const auto count = [&](std::ptrdiff_t corner, int particles) FIRN_LAMBDA { counts.add(corner, particles); };
            if (sums.fits())
                records.template scatter<rows_fit<typename Rows::Row, lines_of_particle<Kernel, D>>>(
                    0, used, [&](std::ptrdiff_t corner) FIRN_LAMBDA { return Rows(arena.node, n, corner); }, count);
            else
                records.count(0, used, count);
        });
    const BlocksAround<D> around(grid, partition, group);
    counts.add_to_grid(sums, around, box);
    add_arena<S, Sums>(arena, nodes, around, box);
}

/// Adds the contributions of a spray group (few particles in sparse blocks) to an arena. Then adds the values of the
/// arena to the nodes of the grid. So each node receives one sum from the group. The rounding of this sum does not
/// depend on the contributions of other groups to the node.
template <class Kernel, class Transfer, class Force, class View, class Sums, class Grid, int D>
[[gnu::noinline]] void scatter_spray(const ParticleReader<View>& reader, const GroupPlaces<View>& places,
                                     const BlockPartition<D>& partition, const BlockGroup& group, const Grid& grid,
                                     const Sums& sums, typename Sums::number* nodes) {
    using S = typename View::scalar_type;
    using Rows = ArenaRows<Sums, Kernel, S, D, exact_row<S, Kernel::support>>;
    SprayArena<Kernel, S, D> arena;
    if (places.template has_strays<Kernel>(group)) throw_strays();
    places.template for_corners<Kernel>(group, arena.n, [&](std::size_t corner) FIRN_LAMBDA { arena.reach(corner); });
    const BlocksAround<D> around(grid, partition, group);
    prefetch_next_spray(nodes, grid, partition, group);
    arena.clear(nodes, around);
    for_packs<Kernel, Transfer, Force>(
        reader, places, group, arena.n, sums, [&](const auto& records, std::size_t, int used) FIRN_LAMBDA {
            records.template scatter<Sums::costly>(
                0, used, [&](std::ptrdiff_t corner) FIRN_LAMBDA { return Rows(arena.node(), arena.n, corner); },
                [](std::ptrdiff_t, int) {});
        });
    arena.add_to_grid(nodes, around);
}

/// Whether a set contributes nothing: its view has a member `is_silent`, which is true.
template <class View>
bool is_silent(const ParticleSet<View>& set) {
    if constexpr (requires { set.view.is_silent; })
        return set.view.is_silent;
    else
        return false;
}

/// Adds the contributions of all groups of a set, one phase after the other (a phase is a list of groups that share no
/// node). No two threads add to one node at the same time, and the order of additions to a node is always the same.
/// \param grid   a SparseGrid, or an object that has its functions domain() and neighbours()
/// \param range  the phases whose groups are scattered
template <class Kernel, class Transfer, class Force, class View, class Sums, class Grid>
void scatter_coloured(const ParticleSet<View>& set, const Grid& grid, double dt, int threads, const Sums& sums,
                      typename Sums::number* nodes, PhaseRange range = {}) {
    if (is_silent(set)) return;
    const Positions<View> positions(grid.domain());
    const ParticleReader<View> reader(set.view, grid.domain(), dt);
    for_groups_by_phase(
        set.partition, threads,
        [&](const BlockGroup& group, int thread) {
            const GroupPlaces<View> places(set.view, set.partition, group, positions);
            auto&& mine = sums.of_thread(thread);  // MeasuredSums measures for each thread separately
            if (!is_spray<View::dimension>(group))
                scatter_to_arena<Kernel, Transfer, Force>(reader, places, set.partition, group, grid, mine, nodes);
            else if constexpr (std::floating_point<typename Sums::number>)
                scatter_spray<Kernel, Transfer, Force>(reader, places, set.partition, group, grid, mine, nodes);
            else  // integer sums do not depend on the order: no arena is needed
                scatter_to_nodes<Kernel, Transfer, Force>(reader, places, set.partition, group, grid, mine, nodes);
        },
        range);
}

/// Adds the contributions of one group directly to the nodes of the grid. If several threads do this at the same time,
/// the sums must be atomic.
template <class Kernel, class Transfer, class Force, class View, class Sums, class Grid>
void scatter_group(const ParticleSet<View>& set, const BlockGroup& group, const Grid& grid, double dt, const Sums& sums,
                   typename Sums::number* nodes) {
    if (is_silent(set)) return;
    const Positions<View> positions(grid.domain());
    scatter_to_nodes<Kernel, Transfer, Force>(ParticleReader<View>(set.view, grid.domain(), dt),
                                              GroupPlaces<View>(set.view, set.partition, group, positions),
                                              set.partition, group, grid, sums, nodes);
}

/// Checks the arguments of p2g().
/// \throws parameter_error  if `dt` [s] is negative or not finite
/// \throws usage_error      if the grid was not activated for the partitions of all sets
template <std::floating_point S, int D, class View>
void check_p2g(const SparseGrid<S, D>& grid, double dt, ParticleSets<View> sets) {
    check_step(dt);
    for (const ParticleSet<View>& set : sets) grid.require_active(set.partition);
}

}  // namespace detail

/// Particles to grid: sets all nodes to zero, then adds the masses and the momenta of all particles to the nodes around
/// them. The momenta include the impulses of the stresses over the time step.
///
/// The grid must be activated for the partitions of all sets. The base node of each particle may lie at most
/// `allowed_drift` cells outside the block into which the particle was sorted. The contributions of the sets are added
/// one set after the other. The sums have the same bits for any number of threads.
/// \param dt    time step [s]
/// \param sets  the sets of particles, each with its partition
/// \throws parameter_error  if `dt` is negative or not finite
/// \throws usage_error      if the grid was not activated; or if a particle is further from its block than allowed (the
///                          values of the grid are then undefined)
template <class Kernel, class Transfer, class Force, std::floating_point S, int D, class View>
void p2g(const Coloured& execution, SparseGrid<S, D>& grid, double dt, ParticleSets<View> sets) {
    detail::check_p2g(grid, dt, sets);
    const int threads = thread_count(execution.threads);
    parallel_region(threads, [&] {
        S* const nodes = grid.nodes(0);
        detail::scatter_by_bands(
            grid,
            [&](std::size_t begin, std::size_t end) {
                detail::clear_blocks<D>(nodes, node_width, begin, end, threads);
            },
            [&](const ParticleSet<View>& set, PhaseRange phases) {
                detail::scatter_coloured<Kernel, Transfer, Force>(set, grid, dt, threads, FloatSums<S>{}, nodes,
                                                                  phases);
            },
            sets);
    });
}

/// Particles to grid in one thread, one particle after the other: the reference of tests and benchmarks. This function
/// has the same requirements, and throws the same errors, as the p2g() that takes a Coloured.
template <class Kernel, class Transfer, class Force, std::floating_point S, int D, class View>
void p2g(const detail::Serial&, SparseGrid<S, D>& grid, double dt, ParticleSets<View> sets) {
    detail::check_p2g(grid, dt, sets);
    detail::clear(grid.nodes(0), node_width, grid, 1);
    for (const ParticleSet<View>& set : sets)
        for (const BlockGroup& group : set.partition.groups)
            detail::scatter_group<Kernel, Transfer, Force>(set, group, grid, dt, FloatSums<S>{}, grid.nodes(0));
}

/// As p2g() with all sets, for sets given one by one.
template <class Kernel, class Transfer, class Force, class Execution, std::floating_point S, int D, class... Views>
void p2g(const Execution& execution, SparseGrid<S, D>& grid, double dt, const ParticleSet<Views>&... sets) {
    detail::with_sets([&](auto all) { p2g<Kernel, Transfer, Force>(execution, grid, dt, all); }, sets...);
}

/// Particles to grid for one set of particles, with any execution.
/// \param dt  time step [s]
/// \throws parameter_error, usage_error, overflow_error  in the same cases as the p2g() of several sets
template <class Kernel, class Transfer, class Force, class Execution, class View, int N, std::floating_point S, int D>
void p2g(const Execution& execution, const View& view, const BlockPartition<N>& partition, SparseGrid<S, D>& grid,
         double dt) {
    if constexpr (detail::require_same_kind<View, N, S, D>())
        p2g<Kernel, Transfer, Force>(execution, grid, dt, ParticleSet<View>{view, partition});
}

}  // namespace firn::inline FIRN_BUILD
