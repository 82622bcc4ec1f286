/// \file P2G together with before_p2g(), for transfers that blend the particles' velocities with those of the grid.
#pragma once

#include <firn/loops/transfer_passes.hpp>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Scatters the particles of a group twice: without forces to `plain`, with forces to `forced`, both through an arena.
/// The particles are read once, and both scatters use the same weights.
template <class Kernel, class Transfer, class Force, class View, class Grid, std::floating_point S, int D>
[[gnu::noinline]] void scatter_twice_to_arenas(const ParticleReader<View>& reader, const GroupPlaces<View>& places,
                                               const BlockPartition<D>& partition, const BlockGroup& group,
                                               const Grid& grid, S* plain, S* forced) {
    using Sums = FloatSums<S>;
    using Rows = ArenaRows<Sums, Kernel, S, D>;
    using P = native_pack<S>;
    constexpr int lanes = scalar_traits<P>::lanes;
    constexpr bool held = rows_fit<typename Rows::Row, lines_of_particle<Kernel, D>>;
    const ArenaBox<D> box = places.template box<Kernel>(group);
    if (box.strays) throw_strays();
    Arena<Kernel, S, D> plain_arena, forced_arena;
    plain_arena.clear(group, box);
    forced_arena.clear(group, box);
    const int n = plain_arena.n;
    PackProducts<Kernel, Force::weight_gradients, S, D> products;
    PackValues<Kernel, NoForceFor<Transfer>, S, D> plain_values;
    PackValues<Kernel, Force, S, D> forced_values;
    for (std::size_t slot = 0; slot < group.particles; slot += pack_size) {
        reader.template prefetch<Transfer>(group.first_slot + slot + pack_size);
        for (int lane = 0; lane < pack_size; lane += lanes) {
            const std::size_t at = slot + std::size_t(lane);
            const Place<P, D> place = locate<Kernel>(places.template position<P>(at));
            const auto record = [&](auto form) FIRN_LAMBDA {
                return reader.template record<Kernel, Transfer, decltype(form)>(places.slots(at), place.fraction);
            };
            products.fill(lane, place, places.template block_in_arena<Kernel, P>(at, n), n);
            plain_values.fill(lane, record(NoForceFor<Transfer>{}));
            forced_values.fill(lane, record(Force{}));
        }
        const int used = int(std::min<std::size_t>(pack_size, group.particles - slot));
        const auto scatter = [&](const auto& values, S* arena) FIRN_LAMBDA {
            values.template scatter<held>(
                products, 0, used, [&](std::ptrdiff_t corner) FIRN_LAMBDA { return Rows(arena, n, corner); },
                [](std::ptrdiff_t, int) {});
        };
        scatter(plain_values, plain_arena.node);
        scatter(forced_values, forced_arena.node);
    }
    const BlocksAround<D> around(grid, partition, group);
    add_arena<S, Sums>(plain_arena, plain, around, box);
    add_arena<S, Sums>(forced_arena, forced, around, box);
}

/// Does the work of scatter_coloured() twice: without forces to `plain`, with forces to `forced`. The sums have the
/// same bits.
template <class Kernel, class Transfer, class Force, class View, std::floating_point S, int D>
void scatter_twice(const ParticleSet<View>& set, const SparseGrid<S, D>& grid, double dt, int threads, S* plain,
                   S* forced, PhaseRange phases) {
    if (is_silent(set)) return;
    const Positions<View> positions(grid.domain());
    const ParticleReader<View> reader(set.view, grid.domain(), dt);
    for_groups_by_phase(
        set.partition, threads,
        [&](const BlockGroup& group, int) {
            const GroupPlaces<View> places(set.view, set.partition, group, positions);
            if (!is_spray<D>(group))
                return scatter_twice_to_arenas<Kernel, Transfer, Force>(reader, places, set.partition, group, grid,
                                                                        plain, forced);
            const FloatSums<S> sums;
            scatter_spray<Kernel, Transfer, NoForceFor<Transfer>>(reader, places, set.partition, group, grid, sums,
                                                                  plain);
            scatter_spray<Kernel, Transfer, Force>(reader, places, set.partition, group, grid, sums, forced);
        },
        phases);
}

}  // namespace detail

/// Particles to grid, after before_p2g(): does the work of both, with the same results and errors.
/// \param mirrors  the mirrored walls. \see mirrors_of
template <class Kernel, class Transfer, class Force, class Execution, std::floating_point S, int D,
          std::derived_from<Mirrors> M, class View>
void p2g_with_velocities(const Execution& execution, SparseGrid<S, D>& grid, const M& mirrors, double dt,
                         ParticleSets<View> sets) {
    before_p2g<Kernel, Transfer>(execution, grid, mirrors, sets);
    p2g<Kernel, Transfer, Force>(execution, grid, dt, sets);
}

/// As above, with the same bits. If the transfer blends velocities, the particles are read once.
template <class Kernel, class Transfer, class Force, std::floating_point S, int D, std::derived_from<Mirrors> M,
          class View>
    requires(blends_velocities<Transfer>)
void p2g_with_velocities(const Coloured& execution, SparseGrid<S, D>& grid, const M& mirrors, double dt,
                         ParticleSets<View> sets) {
    detail::check_p2g(grid, dt, sets);
    const int threads = thread_count(execution.threads);
    parallel_region(threads, [&] {
        grid.exchange(layer::before_forces, threads);  // so that there is this layer
        S *const plain = grid.nodes(0), *const forced = grid.layer(layer::before_forces);
        detail::scatter_by_bands(
            grid,
            [&](std::size_t begin, std::size_t end) {
                for (S* const numbers : {plain, forced})
                    detail::clear_blocks<D>(numbers, node_width, begin, end, threads);
            },
            [&](const ParticleSet<View>& set, PhaseRange phases) {
                detail::scatter_twice<Kernel, Transfer, Force>(set, grid, dt, threads, plain, forced, phases);
            },
            sets);
        detail::velocities_of_momenta(threads, grid, mirrors);
        grid.exchange(layer::before_forces, threads);
    });
}

/// As p2g_with_velocities() with all sets, for sets given one by one.
template <class Kernel, class Transfer, class Force, class Execution, std::floating_point S, int D,
          std::derived_from<Mirrors> M, class... Views>
void p2g_with_velocities(const Execution& execution, SparseGrid<S, D>& grid, const M& mirrors, double dt,
                         const ParticleSet<Views>&... sets) {
    detail::with_sets(
        [&](auto all) { p2g_with_velocities<Kernel, Transfer, Force>(execution, grid, mirrors, dt, all); }, sets...);
}

}  // namespace firn::inline FIRN_BUILD
