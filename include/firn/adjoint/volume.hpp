/// \file The average of the rates of volume change backwards. \see FBar
#pragma once

#include <firn/adjoint/g2p.hpp>
#include <firn/loops/volume_passes.hpp>

#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// Replaces the adjoints of the average rates of nodes, in place of their masses, by those of the sums from which they
/// come: Σ N V0 θ, in place of the first component of their momenta, and Σ N V0, in place of their masses.
/// \param averages  the averages, in place of the masses;  \param volumes  the sums Σ N V0, in place of the masses
template <std::floating_point S, int D>
void average_rates_back(int threads, const S* averages, const S* volumes, SparseGrid<S, D>& bars) {
    using P = native_pack<S>;
    using T = traced<P>;
    for_nodes(bars, threads, [&](S* node, std::size_t index) {
        P average[4], volume[4], bar[4];
        load_quads(averages + index, average);
        load_quads(volumes + index, volume);
        load_quads(node, bar);
        const P unit = own_unit(volume[node_mass]), per_unit = P(1) / unit;
        Tape<P>& tape = Tape<P>::mine();
        tape.cut(1);
        const T of_volume = T::input(volume[node_mass] * per_unit),
                of_rates = T::input(average[node_mass] * of_volume.value);
        const T result = average_rate(of_rates, of_volume);
        tape.begin();
        seed(result, bar[node_mass]);
        tape.back();
        bar[0] = adjoint_of(of_rates) * per_unit;
        bar[node_mass] = adjoint_of(of_volume) * per_unit;
        store_quads(bar, node);
    });
}

/// The way back of the gather of rates and of the scatter of the sums: adds to the records of particles, whose scatter
/// gives the adjoints of node velocities, and to the adjoints of positions and volumes.
/// \param grid  the node velocities;  \param bars  the adjoints of the sums. \see average_rates_back
template <class Kernel, class Transfer, class Force, std::floating_point S, int D, class View, class Bar>
void gather_rates_back(int threads, const View& view, const Bar& bar, const BlockPartition<D>& partition,
                       const SparseGrid<S, D>& grid, const S* bars, const BlockedSpan<S>& records) {
    using P = native_pack<S>;
    using T = traced<P>;
    constexpr bool gradients = Force::weight_gradients;
    const Positions<View> positions(grid.domain());
    const P h(S(grid.domain().cell_size));
    parallel_for(partition.groups.size(), threads, [&](std::size_t g, int) {
        const BlockGroup& group = partition.groups[g];
        const GroupPlaces<View> places(view, partition, group, positions);
        const FilledArena<Kernel, S, D> velocities(grid.nodes(0), grid, partition, group, places),
            adjoints(bars, grid, partition, group, places);
        const int n = velocities.arena.n;
        PackPlaces<Kernel, g2p_needs_gradient<Kernel, Transfer, Force>, S, D> pack;
        TransferSums<Kernel, Transfer, Force, S, D> of_pack;
        for_registers<P>(
            places, group,
            [&](std::size_t slot) {
                velocities.locate(pack, places, slot);
                gather_from_arena(pack.weights, velocities.arena.node, n, of_pack);
            },
            [&](const Slots& slots, std::size_t slot, int lane) {
                const G2PSums<P, D> sums = of_pack.lanes(lane);
                const Vec<P, D> offset = pack.offset(lane);
                const P rate = trace(take_from_grid<Kernel, Transfer, Force>(sums, offset, h).velocity_gradient);
                Tape<P>& tape = Tape<P>::mine();
                tape.cut(1);
                const T of_rate = T::input(rate), of_volume = T::input(view.volume.template load_or_zero<P>(slots, 0));
                const P2GRecord<T, D> traced_record = volume_record<D>(of_rate, of_volume);
                P2GRecord<P, D> held = volume_record<D>(rate, of_volume.value);

                const Vec<P, D> fraction = locate<Kernel>(places.template position<P>(slot)).fraction;
                const typename P::integer* const corner = pack.weights.corner + lane;
                const WeightSlopes<Kernel, false, P, D> plain(fraction);
                SumsAround<P, D> around;
                Vec<P, D> place_bar =
                    slope_of_sums<Kernel, false>(held, plain, adjoints.arena.node, n, corner, &around);
                tape.begin();
                seed(traced_record.momentum, around.of_nodes.velocity);
                seed(traced_record.mass, around.fourth);
                tape.back();

                G2PResult<P, D> result{Vec<P, D>::zero(), Mat<P, D>::zero(), Mat<P, D>::zero()};
                result.velocity_gradient = Mat<P, D>::diagonal(adjoint_of(of_rate));
                Vec<P, D> offset_bar;
                P2GRecord<P, D> record =
                    give_back_to_grid<Kernel, Transfer, Force>(sums, offset, h, result, offset_bar);
                const WeightSlopes<Kernel, gradients, P, D> weights(fraction);
                place_bar +=
                    offset_bar + slope_of_sums<Kernel, gradients>(record, weights, velocities.arena.node, n, corner);
                unroll<D>([&](auto a) FIRN_LAMBDA { add_at(bar.position, slots, a, place_bar.v[a]); });
                add_at(bar.volume, slots, 0, adjoint_of(of_volume));
                unroll<D>([&](auto k) FIRN_LAMBDA { add_at(records, slots, k, record.momentum.v[k]); });
                unroll<D * D>([&](auto k) FIRN_LAMBDA {
                    add_at(records, slots, D + k, record.affine.m[k]);
                    if constexpr (gradients) add_at(records, slots, D + D * D + k, record.gradient.m[k]);
                });
            });
    });
}

/// The way back of average_volume() for set k, whose nodes hold the averages.
/// \param of_averages  adjoints of the averages that the particles took
/// \param bars         memory for the adjoints of nodes
template <class Kernel, class Transfer, class Force, class Execution, std::floating_point S, int D, class View,
          class Bar>
void average_volume_back(const Execution& execution, const SparseGrid<S, D>& grid, const Mirrors& mirrors,
                         const View& view, const Bar& bar, const BlockPartition<D>& partition,
                         const BlockedSpan<S>& of_averages, SparseGrid<S, D>& bars, const BlockedSpan<S>& records) {
    using Volumes = RateView<MotionView<S, D, BlockedSpan<S>>>;
    const int threads = threads_of(execution);
    p2g<Kernel, RateTransfer, NoForceNoField>(execution, bars, 0.0,
                                              ParticleSets<Volumes>(std::vector<ParticleSet<Volumes>>{
                                                  {{view.position, of_averages, of_averages, false}, partition}}));
    average_rates_back(threads, grid.nodes(0), grid.layer(layer::of_volumes<Transfer>), bars);
    mirror_rates(threads, bars, mirrors);
    gather_rates_back<Kernel, Transfer, Force>(threads, view, bar, partition, grid, bars.nodes(0), records);
}

}  // namespace firn::inline FIRN_BUILD::detail
