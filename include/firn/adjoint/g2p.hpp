/// \file G2P backwards: from the adjoints of the new particles to those of the old ones, and of the node velocities.
///
/// G2P gathers from nodes, so the way back scatters, through the groups and colours of P2G.
#pragma once

#include <firn/adjoint/material.hpp>
#include <firn/adjoint/slopes.hpp>
#include <firn/loops/g2p.hpp>
#include <firn/transfer/apic.hpp>
#include <firn/transfer/fmpm.hpp>
#include <firn/transfer/pic.hpp>

#include <optional>

namespace firn::inline FIRN_BUILD::detail {

/// Records that were computed before they are scattered: of each particle p, then the columns of A and of G.
template <class View>
struct RecordView {
    using scalar_type = typename View::scalar_type;
    static constexpr int dimension = View::dimension;
    using Field = decltype(View::position);

    Field position, record;
};

/// Whether a transfer keeps the affine field C as it is, or carries none.
template <class Transfer>
inline constexpr bool keeps_affine_field = false;
template <>
inline constexpr bool keeps_affine_field<Apic> = true;
template <>
inline constexpr bool keeps_affine_field<Pic> = true;
template <>
inline constexpr bool keeps_affine_field<Fmpm> = true;

/// In place of a transfer, to get the whole affine field.
struct WholeField {
    template <class M>
    FIRN_INLINE static M affine_field(const M& C) {
        return C;
    }
};

/// The number of components of a record, apart from the mass.
template <class Force, int D>
inline constexpr int record_size = D + D * D + (Force::weight_gradients ? D * D : 0);

/// The way back scatters what was computed for each particle; it carries no affine field of its own.
struct RecordTransfer {
    static constexpr bool affine = false;
};

}  // namespace firn::inline FIRN_BUILD::detail

namespace firn::inline FIRN_BUILD {

/// Reads records that were computed before.
template <class View>
class ParticleReader<detail::RecordView<View>> {
public:
    using S = typename View::scalar_type;      ///< The scalar type: float or double.
    static constexpr int D = View::dimension;  ///< The dimension: 2 or 3.

    /// Makes a reader.
    ParticleReader(const detail::RecordView<View>& view, const Domain<D>&, double) : view_(view) {}
    /// Returns the records of one register of particles. They have no mass.
    template <class Kernel, class Transfer, class Force, class P>
    FIRN_INLINE P2GRecord<P, D> record(const Slots& slots, const Vec<P, D>&) const {
        P2GRecord<P, D> r;
        r.mass = P(0);
        unroll<D>([&](auto k) FIRN_LAMBDA { r.momentum.v[k] = view_.record.template load<P>(slots, k); });
        unroll<D * D>([&](auto k) FIRN_LAMBDA {
            r.affine.m[k] = view_.record.template load<P>(slots, D + k);
            if constexpr (Force::weight_gradients)
                r.gradient.m[k] = view_.record.template load<P>(slots, D + D * D + k);
        });
        return r;
    }
    /// Does nothing.
    template <class Transfer>
    FIRN_INLINE void prefetch(std::size_t) const {}

private:
    const detail::RecordView<View>& view_;
};

}  // namespace firn::inline FIRN_BUILD

namespace firn::inline FIRN_BUILD::detail {

/// The way back of take_from_grid(), which is linear in the sums: from the adjoints of velocity, affine field and
/// velocity gradient to those of the sums, as a record whose scatter gives the adjoints of the nodes.
/// \param offset_bar  receives the adjoint of the offset
template <class Kernel, class Transfer, class Force, class P, int D>
FIRN_INLINE P2GRecord<P, D> give_back_to_grid(const G2PSums<P, D>& sums, const Vec<P, D>& d, const P& h,
                                              const G2PResult<P, D>& bar, Vec<P, D>& offset_bar) {
    constexpr bool moment = g2p_needs_moment<Kernel, Transfer, Force>,
                   gradient = g2p_needs_gradient<Kernel, Transfer, Force>;
    P2GRecord<P, D> record{P(0), bar.velocity, Mat<P, D>::zero(), Mat<P, D>::zero()};
    offset_bar = Vec<P, D>::zero();
    if constexpr (!moment) {
        record.gradient = (bar.affine + bar.velocity_gradient) * (P(1) / h);
    } else {
        // C = (moment − velocity dᵀ) s, with a factor s for each axis that may depend on d.
        Mat<P, D> C_bar = bar.affine;
        if constexpr (gradient)
            record.gradient = bar.velocity_gradient * (P(1) / h);
        else
            C_bar += bar.velocity_gradient;
        unroll<D>([&](auto j) FIRN_LAMBDA {
            P scale;
            if constexpr (has_local_inertia<Kernel>) {
                const dual<P> slope = dual<P>(1) / (dual<P>{h, P(0)} * Kernel::inertia(dual<P>{d.v[j], P(1)}));
                scale = slope.value;
                unroll<D>([&](auto i) FIRN_LAMBDA {
                    offset_bar.v[j] = offset_bar.v[j] + C_bar(i, j) *
                                                            (sums.moment(i, j) - sums.velocity.v[i] * d.v[j]) *
                                                            slope.derivative;
                });
            } else {
                scale = h * inverse_inertia<Kernel>(h);
            }
            unroll<D>([&](auto i) FIRN_LAMBDA {
                const P of_moment = C_bar(i, j) * scale;
                record.affine(i, j) = of_moment;
                record.momentum.v[i] = record.momentum.v[i] - of_moment * d.v[j];
                offset_bar.v[j] = offset_bar.v[j] - of_moment * sums.velocity.v[i];
            });
        });
    }
    return record;
}

/// Stores records, without their masses.
template <class S, class P, int D>
FIRN_INLINE void store_record(const BlockedSpan<S>& to, const Slots& slots, const P2GRecord<P, D>& record,
                              bool gradients) {
    unroll<D>([&](auto k) FIRN_LAMBDA { to.store(slots, k, record.momentum.v[k]); });
    unroll<D * D>([&](auto k) FIRN_LAMBDA {
        to.store(slots, D + k, record.affine.m[k]);
        if (gradients) to.store(slots, D + D * D + k, record.gradient.m[k]);
    });
}

/// The way back of G2P for the particles of a set: reads the adjoints of the new particles from `bar` and writes those
/// of the old ones, and the records whose scatter gives the adjoints of the node velocities.
///
/// Of the stress, the affine field and, unless the transfer blends, the velocity nothing is left: they are new after a
/// step. The way back of P2G writes them. \see p2g_back
/// \tparam Volume  a volumetric policy. If it averages, the nodes hold the average rates in place of the masses
template <class Kernel, class Transfer, class Force, class Volume, class Material, std::floating_point S, int D,
          class State>
class G2PBack {
    static_assert(!Volume::averages_volume || !tells_plastic_volume<State>,
                  "firn: an Adjoint does not take PlasticVolume with FBar; give the model itself.");

    using P = native_pack<S>;
    using T = traced<P>;
    using View = ParticleView<S, D, BlockedSpan<S>, State>;
    using LiftedMaterial = with_scalar_t<Material, T>;
    using LiftedTransfer = with_scalar_t<Transfer, T>;
    static constexpr bool blended = blends_velocities<Transfer>;

public:
    /// \param records  of record_size() components;  \param records_before  of the same, for transfers that blend
    /// \param of_averages  receives the adjoints of the average rates of volume change, if the policy averages
    G2PBack(const View& view, const View& bar, const BlockPartition<D>& partition, const SparseGrid<S, D>& grid,
            const Material& material, double dt, const Transfer& transfer, BlockedSpan<S> records,
            BlockedSpan<S> records_before, BlockedSpan<S> of_averages)
        : view_(view),
          bar_(bar),
          partition_(partition),
          grid_(grid),
          positions_(grid.domain()),
          plain_(material),
          material_(lift<T>(material)),
          transfer_(lift<T>(transfer)),
          transfer_given_(transfer),
          h_(S(grid.domain().cell_size)),
          dt_(S(dt)),
          per_velocity_(positions_.per_velocity(dt, grid.domain().cell_size)),
          records_(records),
          records_before_(records_before),
          of_averages_(of_averages) {}

    /// Returns the number of parameters of the material.
    std::size_t of_material() const { return count_of_inputs<P>(material_); }
    /// Returns the number of parameters of the transfer.
    std::size_t of_transfer() const { return count_of_inputs<P>(transfer_); }

    /// Does the work for a group. \param sums  receives the derivatives by the parameters
    void operator()(std::size_t g, std::span<double> sums) const {
        const BlockGroup& group = partition_.groups[g];
        const GroupPlaces<View> places(view_, partition_, group, positions_);
        const FilledArena<Kernel, S, D> now(grid_.nodes(0), grid_, partition_, group, places);
        std::optional<FilledArena<Kernel, S, D>> before_forces;
        if constexpr (blended)
            before_forces.emplace(grid_.layer(layer::before_forces), grid_, partition_, group, places);
        PackPlaces<Kernel, g2p_needs_gradient<Kernel, Transfer, Force>, S, D> pack;
        TransferSums<Kernel, Transfer, Force, S, D> of_pack;
        PackSums<Kernel, false, false, S, D> before;
        Tape<P>& tape = Tape<P>::mine();
        tape.cut(1);
        const TracedPolicy<P, LiftedMaterial> material(material_);
        const TracedPolicy<P, LiftedTransfer> transfer(transfer_);
        const std::size_t start = tape.size();
        const MaterialBack<Material, P, D, std::tuple_size_v<decltype(view_.state)>> material_back(
            plain_, *material, view_.state, bar_.state);
        const auto plain_transfer = lift<P>(transfer_given_);
        const P h(h_);
        const int n = now.arena.n;
        for_registers<P>(
            places, group,
            [&](std::size_t slot) {
                now.locate(pack, places, slot);
                gather_from_arena(pack.weights, now.arena.node, n, of_pack);
                if constexpr (blended) gather_from_arena(pack.weights, before_forces->arena.node, n, before);
            },
            [&](const Slots& slots, std::size_t slot, int lane) {
                const G2PSums<P, D> sums_at = of_pack.lanes(lane);
                const Vec<P, D> offset = pack.offset(lane), place = load_vector<P, D>(view_.position, slots);
                auto taken = take_from_grid<Kernel, Transfer, Force>(sums_at, offset, h, plain_transfer);
                [[maybe_unused]] const Mat<P, D> own_gradient = taken.velocity_gradient;
                if constexpr (Volume::averages_volume)
                    taken.velocity_gradient = Volume::velocity_gradient(own_gradient, of_pack.fourth(lane));
                G2PResult<P, D> result{load_vector<P, D>(bar_.velocity, slots), Mat<P, D>::zero(), {}};
                unroll<D * D>([&](auto k) FIRN_LAMBDA {
                    if constexpr (Transfer::affine) result.affine.m[k] = bar_.affine.template load<P>(slots, k);
                });
                const StressBar<P, D> stress_bar = load_stress_bar<P, D>(bar_.stress, slots);
                tape.cut(start);
                result.velocity_gradient = material_back(slots, taken.velocity_gradient, P(dt_), stress_bar);
                if constexpr (!comes_from_energy<Material>) material.add_to(sums.first(material.count()));

                // The move: a particle that is kept inside the domain does not move with its velocity.
                Vec<P, D> place_bar = load_vector<P, D>(bar_.position, slots),
                          motion_bar = place_bar * P(per_velocity_);
                Vec<P, D> own_bar = Vec<P, D>::zero(), before_bar = own_bar, before_at = own_bar;
                const Vec<P, D> own = load_vector<P, D>(view_.velocity, slots);
                Vec<P, D> motion = taken.velocity;
                if constexpr (blended) {
                    before_at = before.lanes(lane).velocity;
                    motion = plain_transfer.blended(taken.velocity, before_at, own, taken.velocity_gradient).motion;
                }
                const Vec<P, D> block = places.blocks().template lower<P>(slot), lowest = positions_.lowest(block),
                                highest = positions_.highest(block);
                unroll<D>([&](auto a) FIRN_LAMBDA {
                    const P to = place.v[a] + motion.v[a] * P(per_velocity_);
                    const auto kept = (to < lowest.v[a]) | (highest.v[a] < to);
                    place_bar.v[a] = select(kept, P(0), place_bar.v[a]);
                    motion_bar.v[a] = select(kept, P(0), motion_bar.v[a]);
                });
                if constexpr (blended || !keeps_affine_field<Transfer>) {
                    tape.cut(start);
                    const Vec<T, D> velocity = inputs(taken.velocity), at_start = inputs(own),
                                    at_nodes = inputs(before_at);
                    const Mat<T, D> L = inputs(taken.velocity_gradient);
                    const auto after = blend(*transfer, velocity, at_nodes, at_start, L);
                    // The transfer is given the affine field from which it made its own; it is the velocity gradient
                    // unless the force form has another.
                    const Mat<T, D> C = inputs(whole_affine(sums_at, offset, h));
                    const Mat<T, D> affine = (*transfer).affine_field(C);
                    tape.begin();
                    seed(after.velocity, result.velocity);
                    seed(after.motion, motion_bar);
                    if constexpr (Transfer::affine) seed(affine, result.affine);
                    tape.back();
                    transfer.add_to(sums.subspan(material.count()));
                    result.velocity = adjoint_of(velocity);
                    result.velocity_gradient += adjoint_of(L);
                    result.affine = adjoint_of(C);
                    own_bar = blended ? adjoint_of(at_start) : own_bar;
                    before_bar = adjoint_of(at_nodes);
                } else {
                    result.velocity += motion_bar;
                }
                P average_bar = P(0);
                if constexpr (Volume::averages_volume) {
                    tape.cut(start);
                    const Mat<T, D> gradient = inputs(own_gradient);
                    const T average = T::input(of_pack.fourth(lane));
                    const Mat<T, D> averaged = Volume::velocity_gradient(gradient, average);
                    tape.begin();
                    seed(averaged, result.velocity_gradient);
                    tape.back();
                    result.velocity_gradient = adjoint_of(gradient);
                    average_bar = adjoint_of(average);
                    of_averages_.store(slots, 0, average_bar);
                }
                Vec<P, D> offset_bar;
                P2GRecord<P, D> record =
                    give_back_to_grid<Kernel, Transfer, Force>(sums_at, offset, h, result, offset_bar);
                record.mass = average_bar;  // the average is the sum of the nodes' fourth numbers

                const Vec<P, D> fraction = locate<Kernel>(places.template position<P>(slot)).fraction;
                constexpr bool gradients = Force::weight_gradients;
                const WeightSlopes<Kernel, gradients, P, D> weights(fraction);
                place_bar += offset_bar + slope_of_sums<Kernel, gradients>(record, weights, now.arena.node, n,
                                                                           pack.weights.corner + lane);
                store_record(records_, slots, record, gradients);
                if constexpr (blended) {
                    const P2GRecord<P, D> other{P(0), before_bar, Mat<P, D>::zero(), Mat<P, D>::zero()};
                    const WeightSlopes<Kernel, false, P, D> plain(fraction);
                    place_bar += slope_of_sums<Kernel, false>(other, plain, before_forces->arena.node, n,
                                                              pack.weights.corner + lane);
                    store_record(records_before_, slots, other, false);
                }
                unroll<D>([&](auto a) FIRN_LAMBDA {
                    bar_.position.store(slots, a, place_bar.v[a]);
                    if constexpr (blended) bar_.velocity.store(slots, a, own_bar.v[a]);
                });
            });
        material_back.add_to(sums.first(material.count()));
    }

private:
    /// Returns the affine field before the transfer has taken its part.
    FIRN_INLINE static Mat<P, D> whole_affine(const G2PSums<P, D>& sums, const Vec<P, D>& d, const P& h) {
        return take_from_grid<Kernel, Transfer, Force, P, D, WholeField>(sums, d, h, WholeField{}).affine;
    }
    template <class V, class M>
    static auto blend(const LiftedTransfer& transfer, const V& taken, const V& before, const V& own, const M& L) {
        if constexpr (blended)
            return transfer.blended(taken, before, own, L);
        else
            return ParticleVelocity<T, D>{taken, taken};
    }

    const View view_, bar_;
    const BlockPartition<D>& partition_;
    const SparseGrid<S, D>& grid_;
    Positions<View> positions_;
    const Material& plain_;
    LiftedMaterial material_;
    LiftedTransfer transfer_;
    Transfer transfer_given_;
    S h_, dt_, per_velocity_;
    BlockedSpan<S> records_, records_before_, of_averages_;
};

}  // namespace firn::inline FIRN_BUILD::detail
