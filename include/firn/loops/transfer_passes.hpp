/// \file Additional passes that some transfers need: FLIP, AFLIP and ASFLIP need before_p2g(), FMPM needs after_p2g().
/// For PIC and APIC these functions do nothing. A step is
///
///     before_p2g<Kernel, Transfer>(execution, grid, sets...);
///     p2g<Kernel, Transfer, Force>(execution, grid, dt, sets...);
///     after_p2g<Kernel>(execution, grid, transfer, memory, sets...);
///     grid_update(execution, grid, dt, acceleration, boundary);
///     g2p<Kernel, Transfer, Force>(execution, view, partition, grid, material, dt, transfer);  // for each set
#pragma once

#include <firn/data/particle_set.hpp>
#include <firn/force/none.hpp>
#include <firn/loops/gather.hpp>
#include <firn/loops/grid_update.hpp>
#include <firn/loops/layers.hpp>
#include <firn/loops/p2g.hpp>
#include <firn/stage/series.hpp>
#include <firn/transfer/concept.hpp>

#include <algorithm>
#include <concepts>

namespace firn::inline FIRN_BUILD {

/// Memory for after_p2g(). Pass the same object in every step, so that memory is not allocated again.
template <std::floating_point S>
struct TransferMemory {
    std::vector<aligned_vector<S>> velocities;  ///< Velocities of the particles, one array for each set.
};

namespace detail {

/// Returns a span of vectors in `memory`, with one vector for each slot of a set. The layout is that of the velocities
/// in the view. Enlarges `memory` if it is too small.
template <class View>
auto vectors_like(const View&, aligned_vector<typename View::scalar_type>& memory, std::size_t slots, int workers) {
    using S = typename View::scalar_type;
    constexpr int D = View::dimension;
    if (memory.size() < slots * std::size_t(D)) renew(memory, slots * std::size_t(D), workers);
    if constexpr (Positions<View>::in_cells)
        return BlockedSpan<S>{memory.data(), D};
    else
        return StridedSpan<S>::template vectors<D>(memory.data());
}

/// Interpolates the velocities of layer::last_of_series to every particle of a group: stores Σ N_i v_i as the
/// particle's velocity, with the weights N_i and the velocities v_i of the nodes around the particle.
template <class Kernel, class View, std::floating_point S, int D>
void gather_velocities(const ParticleSet<View>& set, const BlockGroup& group, const GroupPlaces<View>& places,
                       const SparseGrid<S, D>& grid) {
    gather_to_group<Kernel, false, false>(
        set.partition, group, places, grid, layer::last_of_series,
        [&](std::size_t slot, const auto& sums, const auto&) FIRN_LAMBDA {
            unroll<D>([&](auto a) FIRN_LAMBDA { set.view.velocity.store(places.slots(slot), a, sums.velocity.v[a]); });
        });
}

/// The force form of scattering velocities without forces.
template <class Transfer>
using NoForceFor = std::conditional_t<Transfer::affine, NoForce, NoForceNoField>;

/// Calls f(values, index) for every SIMD register of nodes. `values` points to the values of these nodes in the grid,
/// and `index` is the index of the first of these values among the values of all nodes.
template <std::floating_point S, int D, class F>
void for_nodes(SparseGrid<S, D>& grid, int threads, const F& f) {
    constexpr std::size_t per_block = std::size_t(block_nodes<D> * node_width);
    constexpr std::size_t step = std::size_t(scalar_traits<native_pack<S>>::lanes * node_width);
    parallel_for(
        grid.block_count(), threads,
        [&](std::size_t b, int) {
            for (std::size_t i = b * per_block; i < (b + 1) * per_block; i += step) f(grid.nodes(0) + i, i);
        },
        16);
}

/// Copies the numbers of all nodes to layer k of the grid.
template <std::floating_point S, int D>
void keep_in_layer(SparseGrid<S, D>& grid, std::size_t k, int threads) {
    grid.exchange(k, threads);
    for_nodes(grid, threads, [from = grid.layer(k)](S* node, std::size_t i) {
        std::copy_n(from + i, scalar_traits<native_pack<S>>::lanes * node_width, node);
    });
}

template <int D, class P>
FIRN_INLINE Vec<P, D> load_node_vectors(const value_type_t<P>* from, P (&r)[4]) {
    load_quads(from, r);
    Vec<P, D> v;
    unroll<D>([&](auto a) FIRN_LAMBDA { v.v[a] = r[a]; });
    return v;
}
template <int D, class P>
FIRN_INLINE void store_node_vectors(const Vec<P, D>& v, P (&r)[4], value_type_t<P>* to) {
    unroll<D>([&](auto a) FIRN_LAMBDA { r[a] = v.v[a]; });
    store_quads(r, to);
}

/// Interpolates the velocities of layer::last_of_series to the particles, and transfers their momenta to the nodes.
/// \param sets  the sets of particles; the velocities of their views are memory for the interpolated velocities
template <class Kernel, class Transfer, class Execution, std::floating_point S, int D, class View>
void there_and_back(const Execution& execution, SparseGrid<S, D>& grid, int threads, ParticleSets<View> sets) {
    const Positions<View> positions(grid.domain());
    for (const ParticleSet<View>& set : sets)
        parallel_for(set.partition.groups.size(), threads, [&](std::size_t g, int) {
            const BlockGroup& group = set.partition.groups[g];
            gather_velocities<Kernel>(set, group, GroupPlaces<View>(set.view, set.partition, group, positions), grid);
        });
    p2g<Kernel, Transfer, NoForceFor<Transfer>>(execution, grid, 0.0, sets);
}

/// Interpolates the velocities of layer::last_of_series to the particles of a group, and scatters their momenta to the
/// nodes, both through an arena and with the same weights.
template <class Kernel, class View, std::floating_point S, int D>
[[gnu::noinline]] void there_and_back_by_arenas(const ParticleSet<View>& set, const BlockGroup& group,
                                                const GroupPlaces<View>& places, SparseGrid<S, D>& grid) {
    using Sums = FloatSums<S>;
    using Rows = ArenaRows<Sums, Kernel, S, D>;
    using P = native_pack<S>;
    constexpr bool held = rows_fit<typename Rows::Row, lines_of_particle<Kernel, D>>;
    struct Pack : PackProducts<Kernel, false, S, D> {
        FIRN_INLINE void locate(int lane, const Vec<P, D>& position, const Vec<P, D>& block, int n) {
            this->fill(lane, firn::locate<Kernel>(position), block, n);
        }
    };
    const ArenaBox<D> box = places.template box<Kernel>(group);
    if (box.strays) throw_strays();
    NodesOfGroup<Kernel, S, D, 1> from(grid, set.partition, group, places, layer::last_of_series);
    Arena<Kernel, S, D> arena;
    arena.clear(group, box);
    Pack pack;
    PackSums<Kernel, false, false, S, D> sums;
    PackValues<Kernel, NoForceNoField, S, D> values;
    for (std::size_t slot = 0; slot < group.particles; slot += pack_size) {
        from.locate(pack, places, slot);
        from.template gather<0>(pack, sums);
        for (int lane = 0; lane < pack_size; lane += scalar_traits<P>::lanes) {
            P2GRecord<P, D> record{};
            record.mass = set.view.mass.template load_or_zero<P>(places.slots(slot + std::size_t(lane)), 0);
            record.momentum = sums.lanes(lane).velocity * record.mass;
            values.fill(lane, record);
        }
        values.template scatter<held>(
            pack, 0, int(std::min<std::size_t>(pack_size, group.particles - slot)),
            [&](std::ptrdiff_t corner) FIRN_LAMBDA { return Rows(arena.node, arena.n, corner); },
            [](std::ptrdiff_t, int) {});
    }
    add_arena<S, Sums>(arena, grid.nodes(0), BlocksAround<D>(grid, set.partition, group), box);
}

/// Does the work of there_and_back() for Coloured and transfers without an affine field, with the same bits: each group
/// of particles goes there and back at once.
template <class Kernel, class Transfer, std::floating_point S, int D, class View>
void there_and_back_by_groups(SparseGrid<S, D>& grid, int threads, ParticleSets<View> sets) {
    const auto clear_some = [&](std::size_t begin, std::size_t end) {
        clear_blocks<D>(grid.nodes(0), node_width, begin, end, threads);
    };
    const auto scatter = [&](const ParticleSet<View>& set, PhaseRange phases) {
        const Positions<View> positions(grid.domain());
        const ParticleReader<View> reader(set.view, grid.domain(), 0);
        for_groups_by_phase(
            set.partition, threads,
            [&](const BlockGroup& group, int) {
                const GroupPlaces<View> places(set.view, set.partition, group, positions);
                if (!is_spray<D>(group)) return there_and_back_by_arenas<Kernel>(set, group, places, grid);
                gather_velocities<Kernel>(set, group, places, grid);
                scatter_spray<Kernel, Transfer, NoForceNoField>(reader, places, set.partition, group, grid,
                                                                FloatSums<S>{}, grid.nodes(0));
            },
            phases);
    };
    scatter_by_bands(grid, clear_some, scatter, sets);
}

/// Watches a series without seeing anything. \see refine_momenta
struct SeesNoTerm {
    void operator()(int) const {}
};

/// Does the work of after_p2g() for a transfer of order 2 or more. v_j is velocity j = 1, 2, … in the series of FMPM.
///
/// Mirrored walls act on every term of the series. What they changed in the first term is given back to the momenta in
/// the end, so that grid_update() sees the full impulse of the walls: friction and reactions need it. As all terms are
/// symmetric about the walls, this changes nothing else.
/// \param seen  seen(j) is called for each term j < order, when layer::last_of_series holds v_j, and the nodes hold the
///              momenta and masses that make A v_j
template <class Kernel, class Execution, std::floating_point S, int D, class Transfer, std::derived_from<Mirrors> M,
          class View, class Seen = SeesNoTerm>
void refine_momenta(const Execution& execution, SparseGrid<S, D>& grid, const Transfer& transfer,
                    TransferMemory<S>& memory, const M& mirrors, int threads, ParticleSets<View> sets,
                    const Seen& seen = {}) {
    using P = native_pack<S>;
    memory.velocities.resize(std::max(memory.velocities.size(), sets.size()));
    std::vector<ParticleSet<View>> with_memory;  // the velocities of their particles are those of the series
    for (const ParticleSet<View>& set : sets) {
        View view = set.view;
        view.velocity = vectors_like(view, memory.velocities[with_memory.size()], set.partition.slots(), threads);
        with_memory.push_back({view, set.partition});
    }
    divide_by_masses(threads, grid);  // the nodes then hold v_1
    const bool is_mirrored = !mirrors.planes.empty();
    if (is_mirrored) {
        keep_in_layer(grid, layer::first_before_walls, threads);  // v_1 before walls act
        mirror_without_friction(threads, grid, mirrors);
    }
    keep_in_layer(grid, layer::first_of_series, threads);
    for (int j = 1; j < transfer.order; ++j) {
        grid.exchange(layer::last_of_series, threads);
        if constexpr (std::same_as<Execution, Coloured> && !Transfer::affine)
            there_and_back_by_groups<Kernel, Transfer>(grid, threads, ParticleSets<View>(with_memory));
        else
            there_and_back<Kernel, Transfer>(execution, grid, threads, ParticleSets<View>(with_memory));
        seen(j);
        velocities_of_momenta(threads, grid, mirrors);
        const S *const first = grid.layer(layer::first_of_series), *const last = grid.layer(layer::last_of_series);
        const bool is_last = j + 1 == transfer.order;
        for_nodes(grid, threads, [&](S* node, std::size_t i) {
            P r[4], of_first[4], of_last[4];
            const Vec<P, D> v_1 = load_node_vectors<D>(first + i, of_first);
            const Vec<P, D> v_j = load_node_vectors<D>(last + i, of_last);
            const Vec<P, D> v = Transfer::next(v_1, v_j, load_node_vectors<D>(node, r));
            store_node_vectors(is_last && !is_mirrored ? momentum_of_series(v, r[node_mass]) : v, r, node);
        });
    }
    if (is_mirrored)
        for_nodes(grid, threads,
                  [v_1 = grid.layer(layer::first_of_series), unmirrored = grid.layer(layer::first_before_walls)](
                      S* node, std::size_t i) {
                      P r[4], of_first[4], of_unmirrored[4];
                      const Vec<P, D> v = load_node_vectors<D>(node, r),
                                      first = load_node_vectors<D>(v_1 + i, of_first);
                      const Vec<P, D> before = load_node_vectors<D>(unmirrored + i, of_unmirrored);
                      r[node_mass] = of_unmirrored[node_mass];
                      store_node_vectors(momentum_of_series(v, before, first, r[node_mass]), r, node);
                  });
}

}  // namespace detail

/// Computes the velocities of the nodes before forces act, and stores them in layer 1 of the grid. Only transfers that
/// blend particle velocities with these node velocities need this function; for other transfers it does nothing.
/// \param mirrors  the mirrored walls. \see mirrors_of
template <class Kernel, class Transfer, class Execution, std::floating_point S, int D, std::derived_from<Mirrors> M,
          class View>
void before_p2g(const Execution& execution, SparseGrid<S, D>& grid, const M& mirrors, ParticleSets<View> sets) {
    if constexpr (blends_velocities<Transfer>) {
        const int threads = detail::threads_of(execution);
        parallel_region(threads, [&] {
            p2g<Kernel, Transfer, detail::NoForceFor<Transfer>>(execution, grid, 0.0, sets);
            detail::velocities_of_momenta(threads, grid, mirrors);
            grid.exchange(layer::before_forces, threads);
        });
    }
}
/// As before_p2g() with all sets, for sets given one by one.
template <class Kernel, class Transfer, class Execution, std::floating_point S, int D, std::derived_from<Mirrors> M,
          class... Views>
void before_p2g(const Execution& execution, SparseGrid<S, D>& grid, const M& mirrors,
                const ParticleSet<Views>&... sets) {
    detail::with_sets([&](auto all) { before_p2g<Kernel, Transfer>(execution, grid, mirrors, all); }, sets...);
}
/// As before_p2g() with `mirrors`, for boundaries without mirrored walls.
template <class Kernel, class Transfer, class Execution, std::floating_point S, int D, class... Views>
void before_p2g(const Execution& execution, SparseGrid<S, D>& grid, const ParticleSet<Views>&... sets) {
    before_p2g<Kernel, Transfer>(execution, grid, Mirrors{}, sets...);
}

/// Replaces the momenta of the nodes by m v, where m is the mass of a node and v its velocity from the series of FMPM.
/// Overwrites layers 1 and 2 of the grid. Only transfers that refine velocities need this function; for other transfers
/// it does nothing.
/// \param memory   memory for velocities; pass the same object in every step
/// \param mirrors  the mirrored walls. \see mirrors_of
/// \throws parameter_error  if the order of the transfer is less than 1
template <class Kernel, class Execution, std::floating_point S, int D, class Transfer, std::derived_from<Mirrors> M,
          class View>
void after_p2g(const Execution& execution, SparseGrid<S, D>& grid, const Transfer& transfer, TransferMemory<S>& memory,
               const M& mirrors, ParticleSets<View> sets) {
    if constexpr (refines_velocities<Transfer>) {
        if constexpr (requires { transfer.check(); }) transfer.check();
        if (transfer.order == 1) return;
        const int threads = detail::threads_of(execution);
        parallel_region(threads, [&] {
            detail::refine_momenta<Kernel>(execution, grid, transfer, memory, mirrors, threads, sets);
        });
    }
}
/// As after_p2g() with all sets, for sets given one by one.
template <class Kernel, class Execution, std::floating_point S, int D, class Transfer, std::derived_from<Mirrors> M,
          class... Views>
void after_p2g(const Execution& execution, SparseGrid<S, D>& grid, const Transfer& transfer, TransferMemory<S>& memory,
               const M& mirrors, const ParticleSet<Views>&... sets) {
    detail::with_sets([&](auto all) { after_p2g<Kernel>(execution, grid, transfer, memory, mirrors, all); }, sets...);
}
/// As after_p2g() with `mirrors`, for boundaries without mirrored walls.
template <class Kernel, class Execution, std::floating_point S, int D, class Transfer, class... Views>
void after_p2g(const Execution& execution, SparseGrid<S, D>& grid, const Transfer& transfer, TransferMemory<S>& memory,
               const ParticleSet<Views>&... sets) {
    after_p2g<Kernel>(execution, grid, transfer, memory, Mirrors{}, sets...);
}

}  // namespace firn::inline FIRN_BUILD
