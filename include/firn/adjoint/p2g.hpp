/// \file P2G backwards: from the adjoints of the momenta and masses of nodes to those of the particles.
///
/// P2G scatters to nodes, so the way back gathers, through the groups of G2P.
#pragma once

#include <firn/adjoint/material.hpp>
#include <firn/adjoint/slopes.hpp>
#include <firn/core/parallel.hpp>
#include <firn/stage/p2g.hpp>

namespace firn::inline FIRN_BUILD::detail {

/// The way back of make_record(): from the adjoints of a record to those of what the particle gave. What a force form
/// makes of the impulse is a multiple of it, so its transpose is the form itself.
/// \param held  the record;  \param offset_bar  receives the adjoint of the offset
template <class Kernel, class Transfer, class Force, class P, int D>
FIRN_INLINE P2GParticle<P, D> give_back_to_particle(const P2GParticle<P, D>& particle, const P2GRecord<P, D>& held,
                                                    const P2GRecord<P, D>& bar, const Vec<P, D>& d, const P& h,
                                                    const P& dt, Vec<P, D>& offset_bar) {
    // p = m v − A d
    const Mat<P, D> A_bar = bar.affine - outer(bar.momentum, d);
    offset_bar = -(transpose(held.affine) * bar.momentum);
    P2GParticle<P, D> of;
    of.velocity = bar.momentum * particle.mass;
    of.mass = bar.mass + dot(bar.momentum, particle.velocity);
    of.affine = Mat<P, D>::zero();
    if constexpr (Transfer::affine) {
        of.affine = A_bar * (particle.mass * h);
        of.mass = of.mass + contracted(particle.affine, A_bar) * h;
    }
    const Mat<P, D> impulse_bar =
        Force::affine_part(A_bar, inverse_inertia<Kernel>(h), h) + Force::gradient_part(bar.gradient, h);
    of.stress = impulse_bar * (-(dt * particle.volume));
    of.volume = -(dt * contracted(particle.stress, impulse_bar));
    return of;
}

/// The way back of P2G for the particles of a set: adds to the adjoints of what P2G read, from the adjoints of the
/// momenta and masses of nodes.
/// \tparam first  whether this is the first P2G that goes back in a step: then the adjoints of affine fields, stresses
///                and, unless the transfer blends, velocities are written, not added to
/// \param bars  the adjoints of the nodes
template <class Kernel, class Transfer, class Force, bool first, std::floating_point S, int D, class View, class Bar>
void p2g_back(int threads, const View& view, const Bar& bar, const BlockPartition<D>& partition,
              const SparseGrid<S, D>& grid, const S* bars, double dt) {
    using P = native_pack<S>;
    constexpr bool gradients = Force::weight_gradients;
    const Positions<View> positions(grid.domain());
    const S h = S(grid.domain().cell_size);
    parallel_for(partition.groups.size(), threads, [&](std::size_t g, int) {
        const BlockGroup& group = partition.groups[g];
        const GroupPlaces<View> places(view, partition, group, positions);
        const FilledArena<Kernel, S, D> nodes(bars, grid, partition, group, places);
        const int n = nodes.arena.n;
        PackPlaces<Kernel, gradients, S, D> pack;
        const auto write = [&](const BlockedSpan<S>& to, const Slots& slots, int k, const P& number) FIRN_LAMBDA {
            if constexpr (first)
                to.store(slots, k, number);
            else
                add_at(to, slots, k, number);
        };
        for_registers<P>(
            places, group, [&](std::size_t slot) { nodes.locate(pack, places, slot); },
            [&](const Slots& slots, std::size_t slot, int lane) {
                P2GParticle<P, D> particle;
                particle.mass = view.mass.template load_or_zero<P>(slots, 0);
                particle.volume = view.volume.template load_or_zero<P>(slots, 0);
                particle.velocity = load_vector<P, D>(view.velocity, slots);
                particle.stress = load_symmetric<P, D>(view.stress, slots);
                particle.affine = Mat<P, D>::zero();
                if constexpr (Transfer::affine)
                    unroll<D * D>([&](auto k)
                                      FIRN_LAMBDA { particle.affine.m[k] = view.affine.template load<P>(slots, k); });
                const Vec<P, D> offset = pack.offset(lane);
                const P2GRecord<P, D> held = make_record<Kernel, Transfer, Force>(particle, offset, P(h), P(S(dt)));
                const WeightSlopes<Kernel, gradients, P, D> weights(
                    locate<Kernel>(places.template position<P>(slot)).fraction);
                SumsAround<P, D> sums;
                const Vec<P, D> slope = slope_of_sums<Kernel, gradients>(held, weights, nodes.arena.node, n,
                                                                         pack.weights.corner + lane, &sums);
                Vec<P, D> offset_bar;
                const P2GParticle<P, D> of = give_back_to_particle<Kernel, Transfer, Force>(
                    particle, held, {sums.fourth, sums.of_nodes.velocity, sums.of_nodes.moment, sums.of_nodes.gradient},
                    offset, P(h), P(S(dt)), offset_bar);
                add_at(bar.mass, slots, 0, of.mass);
                add_at(bar.volume, slots, 0, of.volume);
                unroll<D>([&](auto a) FIRN_LAMBDA {
                    add_at(bar.position, slots, a, slope.v[a] + offset_bar.v[a]);
                    if constexpr (blends_velocities<Transfer>)
                        add_at(bar.velocity, slots, a, of.velocity.v[a]);
                    else
                        write(bar.velocity, slots, a, of.velocity.v[a]);
                });
                if constexpr (Transfer::affine)
                    unroll<D * D>([&](auto k) FIRN_LAMBDA { write(bar.affine, slots, k, of.affine.m[k]); });
                unroll<D>([&](auto i) FIRN_LAMBDA {
                    unroll<D - i>([&](auto j) FIRN_LAMBDA {  // of the numbers that are stored
                        constexpr int row = i, column = i + j;
                        const P both =
                            row == column ? of.stress(row, row) : of.stress(row, column) + of.stress(column, row);
                        write(bar.stress, slots, symmetric_index<D>(row, column), both);
                    });
                });
            });
    });
}

}  // namespace firn::inline FIRN_BUILD::detail
