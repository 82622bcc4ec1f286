/// \file The stages of a step backwards: from the adjoints of what a stage computed to those of what it read.
///
/// G2P gathers from nodes, so the way back scatters; P2G scatters, so the way back gathers. Both go through the groups
/// and colours of the stage itself. The partial derivatives of the policies come from traced numbers, those of the
/// weights from dual numbers.
#pragma once

#include <firn/adjoint/inputs.hpp>
#include <firn/adjoint/slopes.hpp>
#include <firn/data/particles.hpp>
#include <firn/field/gravity.hpp>
#include <firn/loops/g2p.hpp>
#include <firn/loops/grid_update.hpp>
#include <firn/loops/p2g_with_velocities.hpp>

#include <optional>

namespace firn::inline FIRN_BUILD {

/// A particle as a measure sees it. \tparam T  a scalar: double, or one with derivatives
template <class T, int D, class State>
struct MeasuredParticle {
    std::uint32_t id;    ///< its id
    Vec<T, D> position,  ///< position [m]
        velocity;        ///< velocity [m/s]
    T mass,              ///< mass [kg]
        volume;          ///< initial volume [m^D]
    State state;         ///< state of the material
};

}  // namespace firn::inline FIRN_BUILD

namespace firn::inline FIRN_BUILD::detail {

/// Records that were computed before they are scattered: of each particle p, then the columns of A and of G.
template <class View>
struct RecordView {
    using scalar_type = typename View::scalar_type;
    static constexpr int dimension = View::dimension;
    using Field = decltype(View::position);

    Field position, record;
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

/// Calls f(slots, group-relative slot, places, pack, lane) for each register of a group, after sums(slot) for its pack.
template <class P, class Places, class ForPack, class ForRegister>
FIRN_INLINE void for_registers(const Places& places, const BlockGroup& group, const ForPack& for_pack,
                               const ForRegister& for_register) {
    for (std::size_t slot = 0; slot < group.packs() * pack_size; slot += pack_size) {
        for_pack(slot);
        for (int lane = 0; lane < pack_size; lane += scalar_traits<P>::lanes)
            for_register(places.slots(slot + std::size_t(lane)), slot + std::size_t(lane), lane);
    }
}

/// Returns the state of particles as inputs, from their stored numbers.
template <class State, class Field, std::size_t N, class P>
FIRN_INLINE State state_inputs(const std::array<Field, N>& fields, const Slots& slots,
                               std::array<traced<P>, 64>& numbers) {
    State state;
    constexpr auto members = State::fields();
    std::size_t next = 0;
    unroll<int(N)>([&](auto f) FIRN_LAMBDA {
        auto& member = state.*(std::get<f>(members).member);
        using Value = std::remove_cvref_t<decltype(member)>;
        std::array<traced<P>, std::size_t(component_count<Value>)> own;
        for (int k = 0; k < component_count<Value>; ++k)
            own[std::size_t(k)] = numbers[next++] = traced<P>::input(fields[f].template load<P>(slots, k));
        member = Stored<Value>::made(own);
    });
    return state;
}
/// Makes the results of a new state that are seeded: numbers() may make nodes, so it is called before the way back.
template <class State>
FIRN_INLINE auto stored_numbers(const State& state) {
    constexpr auto members = State::fields();
    return std::apply(
        [&](const auto&... f) FIRN_LAMBDA {
            return std::tuple{Stored<std::remove_cvref_t<decltype(state.*(f.member))>>::numbers(state.*(f.member))...};
        },
        members);
}
/// Writes the adjoints of inputs of a state.
template <class Field, std::size_t N, class P>
FIRN_INLINE void store_adjoints(const std::array<Field, N>& bars, const Slots& slots,
                                const std::array<traced<P>, 64>& numbers) {
    std::size_t next = 0;
    for (std::size_t f = 0; f < N; ++f)
        for (int k = 0; k < bars[f].components; ++k) bars[f].store(slots, k, adjoint_of(numbers[next++]));
}

/// The way back of G2P for the particles of a set: reads the adjoints of the new particles from `bar` and writes those
/// of the old ones, and the records whose scatter gives the adjoints of the node velocities.
///
/// Of the stress and the affine field nothing is left: both are new after a step. The way back of P2G adds to them.
template <class Kernel, class Transfer, class Force, class Material, std::floating_point S, int D, class State>
class G2PBack {
    using P = native_pack<S>;
    using T = traced<P>;
    using View = ParticleView<S, D, BlockedSpan<S>, State>;
    using LiftedMaterial = with_scalar_t<Material, T>;
    using LiftedTransfer = with_scalar_t<Transfer, T>;
    using LiftedState = material_state_t<LiftedMaterial, D>;
    static constexpr bool blended = blends_velocities<Transfer>;

public:
    /// \param records  of record_size() components;  \param records_before  of the same, for transfers that blend
    G2PBack(const View& view, const View& bar, const BlockPartition<D>& partition, const SparseGrid<S, D>& grid,
            const Material& material, double dt, const Transfer& transfer, BlockedSpan<S> records,
            BlockedSpan<S> records_before)
        : view_(view), bar_(bar), partition_(partition), grid_(grid), positions_(grid.domain()),
          material_(lift<T>(material)), transfer_(lift<T>(transfer)), h_(S(grid.domain().cell_size)), dt_(S(dt)),
          per_velocity_(positions_.per_velocity(dt, grid.domain().cell_size)), records_(records),
          records_before_(records_before) {}

    /// Returns the number of parameters of the material and of the transfer.
    std::size_t of_material() const { return count_of_inputs<P>(material_); }
    std::size_t of_transfer() const { return count_of_inputs<P>(transfer_); }

    /// Does the work for a group. \param sums  receives the derivatives by the parameters
    void operator()(std::size_t g, std::span<double> sums) const {
        const BlockGroup& group = partition_.groups[g];
        const GroupPlaces<View> places(view_, partition_, group, positions_);
        const FilledArena<Kernel, S, D> now(grid_.nodes(0), grid_, partition_, group, places);
        std::optional<FilledArena<Kernel, S, D>> before_forces;
        if constexpr (blended) before_forces.emplace(grid_.layer(layer::before_forces), grid_, partition_, group, places);
        PackPlaces<Kernel, g2p_needs_gradient<Kernel, Transfer, Force>, S, D> pack;
        TransferSums<Kernel, Transfer, Force, S, D> of_pack;
        PackSums<Kernel, false, false, S, D> before;
        Tape<P>& tape = Tape<P>::mine();
        tape.cut(1);
        const TracedPolicy<P, LiftedMaterial> material(material_);
        const TracedPolicy<P, LiftedTransfer> transfer(transfer_);
        const std::size_t start = tape.size();
        const int n = now.arena.n;
        for_registers<P>(
            places, group,
            [&](std::size_t slot) {
                for (int lane = 0; lane < pack_size; lane += scalar_traits<P>::lanes) {
                    const std::size_t at = slot + std::size_t(lane);
                    pack.locate(lane, places.template position<P>(at),
                                places.template block_in_arena<Kernel, P>(at, n), n);
                }
                gather_from_arena(pack.weights, now.arena.node, n, of_pack);
                if constexpr (blended) gather_from_arena(pack.weights, before_forces->arena.node, n, before);
            },
            [&](const Slots& slots, std::size_t slot, int lane) {
                tape.cut(start);
                Inputs in;
                const G2PSums<P, D> sums_at = of_pack.lanes(lane);
                Vec<P, D> before_at = Vec<P, D>::zero();
                if constexpr (blended) before_at = before.lanes(lane).velocity;
                back(in, slots, places.blocks().template lower<P>(slot), pack.offset(lane), sums_at, before_at, *material,
                     *transfer);
                material.add_to(sums.first(material.count()));
                transfer.add_to(sums.subspan(material.count()));
                const P2GRecord<P, D> record = in.record();
                const Vec<P, D> fraction = locate<Kernel>(places.template position<P>(slot)).fraction;
                constexpr bool gradients = Force::weight_gradients;
                const WeightSlopes<Kernel, gradients, P, D> weights(fraction);
                Vec<P, D> place = adjoint_of(in.place) + adjoint_of(in.offset) +
                                  slope_of_sums<Kernel, gradients>(record, weights, now.arena.node, n,
                                                                   pack.weights.corner + lane);
                store_record(records_, slots, record, gradients);
                if constexpr (blended) {
                    P2GRecord<P, D> other{P(0), adjoint_of(in.before), Mat<P, D>::zero(), Mat<P, D>::zero()};
                    const WeightSlopes<Kernel, false, P, D> plain(fraction);
                    place += slope_of_sums<Kernel, false>(other, plain, before_forces->arena.node, n,
                                                          pack.weights.corner + lane);
                    store_record(records_before_, slots, other, false);
                }
                unroll<D>([&](auto a) FIRN_LAMBDA {
                    bar_.position.store(slots, a, place.v[a]);
                    bar_.velocity.store(slots, a, blended ? adjoint_of(in.own.v[a]) : P(0));
                });
                unroll<D * D>([&](auto k) FIRN_LAMBDA { bar_.affine.store(slots, k, P(0)); });
                unroll<symmetric_size<D>>([&](auto k) FIRN_LAMBDA { bar_.stress.store(slots, k, P(0)); });
                store_adjoints(bar_.state, slots, in.state);
            });
    }

private:
    struct Inputs {
        Vec<T, D> velocity, offset, place, own, before;
        Mat<T, D> moment, gradient;
        std::array<T, 64> state;

        P2GRecord<P, D> record() const {
            return {P(0), adjoint_of(velocity), adjoint_of(moment), adjoint_of(gradient)};
        }
    };
    static void store_record(const BlockedSpan<S>& to, const Slots& slots, const P2GRecord<P, D>& record,
                             bool gradients) {
        unroll<D>([&](auto k) FIRN_LAMBDA { to.store(slots, k, record.momentum.v[k]); });
        unroll<D * D>([&](auto k) FIRN_LAMBDA {
            to.store(slots, D + k, record.affine.m[k]);
            if (gradients) to.store(slots, D + D * D + k, record.gradient.m[k]);
        });
    }

    /// Computes the new particles of one register as G2P does, and goes back.
    [[gnu::noinline]] void back(Inputs& in, const Slots& slots, const Vec<P, D>& block, const Vec<P, D>& offset,
                                const G2PSums<P, D>& sums_at, const Vec<P, D>& before_at,
                                const LiftedMaterial& material, const LiftedTransfer& transfer) const {
        Tape<P>& tape = Tape<P>::mine();
        in.velocity = inputs(sums_at.velocity);
        in.moment = in.gradient = Mat<T, D>::zero();
        if constexpr (g2p_needs_moment<Kernel, Transfer, Force>) in.moment = inputs(sums_at.moment);
        if constexpr (g2p_needs_gradient<Kernel, Transfer, Force>) in.gradient = inputs(sums_at.gradient);
        in.offset = inputs(offset);
        in.place = inputs(load_vector<P, D>(view_.position, slots));
        const LiftedState old = state_inputs<LiftedState>(view_.state, slots, in.state);

        const auto taken = take_from_grid<Kernel, Transfer, Force>(
            G2PSums<T, D>{in.velocity, in.moment, in.gradient}, in.offset, T(P(h_)), transfer);
        Mat<T, D> stress;
        LiftedState state;
        if constexpr (has_returned_with_stress<LiftedMaterial, D>) {
            const auto after = updated_with_stress(material, old, taken.velocity_gradient, T(P(dt_)));
            state = after.state;
            stress = after.stress;
        } else {
            state = updated(material, old, taken.velocity_gradient, T(P(dt_)));
            stress = stress_of(material, state, taken.velocity_gradient);
        }
        Vec<T, D> velocity = taken.velocity, motion = taken.velocity;
        if constexpr (blended) {
            in.own = inputs(load_vector<P, D>(view_.velocity, slots));
            in.before = inputs(before_at);
            const auto v = transfer.blended(taken.velocity, in.before, in.own, taken.velocity_gradient);
            velocity = v.velocity, motion = v.motion;
        }
        const auto constant = [](const Vec<P, D>& a) FIRN_LAMBDA {
            Vec<T, D> r;
            unroll<D>([&](auto k) FIRN_LAMBDA { r.v[k] = T(a.v[k]); });
            return r;
        };
        const auto move = moved_by(motion, T(P(per_velocity_)), in.place, constant(positions_.lowest(block)),
                                   constant(positions_.highest(block)));
        const auto stored = stored_numbers(state);

        tape.begin();
        seed(move.position, load_vector<P, D>(bar_.position, slots));
        seed(velocity, load_vector<P, D>(bar_.velocity, slots));
        if constexpr (Transfer::affine)
            unroll<D * D>([&](auto k)
                              FIRN_LAMBDA { seed(taken.affine.m[k], bar_.affine.template load<P>(slots, k)); });
        unroll<D>([&](auto i) FIRN_LAMBDA {
            unroll<D - i>([&](auto j) FIRN_LAMBDA {
                seed(stress(i, i + j), bar_.stress.template load<P>(slots, symmetric_index<D>(i, i + j)));
            });
        });
        unroll<int(std::tuple_size_v<std::remove_cvref_t<decltype(stored)>>)>([&](auto f) FIRN_LAMBDA {
            const auto& own = std::get<f>(stored);
            for (std::size_t k = 0; k < own.size(); ++k)
                seed(own[k], bar_.state[f].template load<P>(slots, int(k)));
        });
        tape.back();
    }

    const View view_, bar_;
    const BlockPartition<D>& partition_;
    const SparseGrid<S, D>& grid_;
    Positions<View> positions_;
    LiftedMaterial material_;
    LiftedTransfer transfer_;
    S h_, dt_, per_velocity_;
    BlockedSpan<S> records_, records_before_;
};

/// The way back of P2G for the particles of a set: adds to the adjoints of what P2G read, from the adjoints of the
/// momenta and masses of nodes.
/// \param bars  the adjoints of the nodes
template <class Kernel, class Transfer, class Force, std::floating_point S, int D, class View, class Bar>
void p2g_back(int threads, const View& view, const Bar& bar, const BlockPartition<D>& partition,
              const SparseGrid<S, D>& grid, const S* bars, double dt) {
    using P = native_pack<S>;
    using T = traced<P>;
    constexpr bool gradients = Force::weight_gradients;
    const Positions<View> positions(grid.domain());
    const S h = S(grid.domain().cell_size);
    parallel_for(partition.groups.size(), threads, [&](std::size_t g, int) {
        const BlockGroup& group = partition.groups[g];
        const GroupPlaces<View> places(view, partition, group, positions);
        const FilledArena<Kernel, S, D> nodes(bars, grid, partition, group, places);
        const int n = nodes.arena.n;
        PackPlaces<Kernel, gradients, S, D> pack;
        PackSums<Kernel, true, gradients, S, D> of_pack;
        Tape<P>& tape = Tape<P>::mine();
        const auto add = [](const BlockedSpan<S>& to, const Slots& slots, int k, const P& more)
                             FIRN_LAMBDA { to.store(slots, k, to.template load<P>(slots, k) + more); };
        for_registers<P>(
            places, group,
            [&](std::size_t slot) {
                for (int lane = 0; lane < pack_size; lane += scalar_traits<P>::lanes) {
                    const std::size_t at = slot + std::size_t(lane);
                    pack.locate(lane, places.template position<P>(at),
                                places.template block_in_arena<Kernel, P>(at, n), n);
                }
                gather_from_arena(pack.weights, nodes.arena.node, n, of_pack);
            },
            [&](const Slots& slots, std::size_t slot, int lane) {
                tape.cut(1);
                const T mass = T::input(view.mass.template load_or_zero<P>(slots, 0)),
                        volume = T::input(view.volume.template load_or_zero<P>(slots, 0));
                const Vec<T, D> velocity = inputs(load_vector<P, D>(view.velocity, slots)),
                                offset = inputs(pack.offset(lane));
                Mat<T, D> affine = Mat<T, D>::zero(), stress;
                if constexpr (Transfer::affine)
                    unroll<D * D>([&](auto k) FIRN_LAMBDA {
                        affine.m[k] = T::input(view.affine.template load<P>(slots, k));
                    });
                T tau[symmetric_size<D>];
                unroll<symmetric_size<D>>(
                    [&](auto k) FIRN_LAMBDA { tau[k] = T::input(view.stress.template load<P>(slots, k)); });
                unroll<D * D>([&](auto k) FIRN_LAMBDA { stress.m[k] = tau[symmetric_index<D>(k % D, k / D)]; });
                const P2GRecord<T, D> record = make_record<Kernel, Transfer, Force>(
                    P2GParticle<T, D>{mass, volume, velocity, affine, stress}, offset, T(P(h)), T(P(S(dt))));
                tape.begin();
                const G2PSums<P, D> sums = of_pack.lanes(lane);
                seed(record.momentum, sums.velocity);
                seed(record.affine, sums.moment);
                if constexpr (gradients) seed(record.gradient, sums.gradient);
                seed(record.mass, of_pack.fourth(lane));
                tape.back();

                P2GRecord<P, D> held{record.mass.value, {}, {}, Mat<P, D>::zero()};
                unroll<D>([&](auto k) FIRN_LAMBDA { held.momentum.v[k] = record.momentum.v[k].value; });
                unroll<D * D>([&](auto k) FIRN_LAMBDA {
                    held.affine.m[k] = record.affine.m[k].value;
                    if constexpr (gradients) held.gradient.m[k] = record.gradient.m[k].value;
                });
                const WeightSlopes<Kernel, gradients, P, D> weights(
                    locate<Kernel>(places.template position<P>(slot)).fraction);
                const Vec<P, D> slope = slope_of_sums<Kernel, gradients>(held, weights, nodes.arena.node, n,
                                                                         pack.weights.corner + lane);
                add(bar.mass, slots, 0, adjoint_of(mass));
                add(bar.volume, slots, 0, adjoint_of(volume));
                unroll<D>([&](auto a) FIRN_LAMBDA {
                    add(bar.position, slots, a, slope.v[a] + adjoint_of(offset.v[a]));
                    add(bar.velocity, slots, a, adjoint_of(velocity.v[a]));
                });
                if constexpr (Transfer::affine)
                    unroll<D * D>([&](auto k) FIRN_LAMBDA { add(bar.affine, slots, k, adjoint_of(affine.m[k])); });
                unroll<symmetric_size<D>>(
                    [&](auto k) FIRN_LAMBDA { add(bar.stress, slots, k, adjoint_of(tau[k])); });
            });
    });
}

/// The way back of update_stress(): adds to the adjoints of the states, and of C where the stress depends on it.
template <class Material, std::floating_point S, int D, class View>
void update_stress_back(int threads, const View& view, const View& bar, const BlockPartition<D>& partition,
                        const Material& material, OrderedSums& sums) {
    using P = native_pack<S>;
    using T = traced<P>;
    using Lifted = with_scalar_t<Material, T>;
    using LiftedState = material_state_t<Lifted, D>;
    const auto lifted = lift<T>(material);
    parallel_for(partition.slots() / pack_size, threads, [&](std::size_t pack, int) {
        Tape<P>& tape = Tape<P>::mine();
        tape.cut(1);
        const TracedPolicy<P, Lifted> policy(lifted);
        const std::size_t start = tape.size();
        for (std::size_t lane = 0; lane < pack_size; lane += scalar_traits<P>::lanes) {
            const std::size_t slot = pack * pack_size + lane;
            const Slots slots{slot, partition.order.data() + slot};
            tape.cut(start);
            std::array<T, 64> numbers;
            const LiftedState state = state_inputs<LiftedState>(view.state, slots, numbers);
            Mat<T, D> C;
            unroll<D * D>([&](auto k) FIRN_LAMBDA { C.m[k] = T::input(view.affine.template load<P>(slots, k)); });
            const Mat<T, D> stress = stress_of(*policy, state, C);
            tape.begin();
            unroll<D>([&](auto i) FIRN_LAMBDA {
                unroll<D - i>([&](auto j) FIRN_LAMBDA {
                    seed(stress(i, i + j), bar.stress.template load<P>(slots, symmetric_index<D>(i, i + j)));
                });
            });
            tape.back();
            policy.add_to(sums.of(pack));
            std::size_t next = 0;
            for (const BlockedSpan<S>& field : bar.state)
                for (int k = 0; k < field.components; ++k)
                    field.store(slots, k, field.template load<P>(slots, k) + adjoint_of(numbers[next++]));
            unroll<D * D>([&](auto k) FIRN_LAMBDA {
                bar.affine.store(slots, k, bar.affine.template load<P>(slots, k) + adjoint_of(C.m[k]));
            });
        }
    });
}

/// A boundary whose parts act at once, as in the grid update.
template <class Boundary>
struct AllAtOnce {
    const Boundary& boundary;

    template <class T, int D>
    Vec<T, D> velocity(const Vec<T, D>& x, const Vec<T, D>& v, const T& mass, const T& dt) const {
        return velocity_among(boundary, x, v, NoOthers{}, AnySurface{}, NodeInertia<T>{mass, dt});
    }
};

/// The way back of the grid update: replaces the adjoints of the node velocities by those of momenta and masses.
/// \param momenta  the momenta and masses of the nodes before the grid update
/// \param bars     the adjoints of the nodes
/// \param sums     for each block: the derivatives by the parameters of the acceleration, then of the boundary
template <std::floating_point S, int D, class Acceleration, class Lifted, class Boundary>
void update_grid_back(int threads, const SparseGrid<S, D>& grid, const S* momenta, S* bars, double dt,
                      const Acceleration& acceleration, const Boundary& here, const Lifted& lifted,
                      OrderedSums& sums) {
    using P = native_pack<S>;
    using T = traced<P>;
    constexpr int lanes = scalar_traits<P>::lanes;
    const double h = grid.domain().cell_size;
    parallel_for(
        grid.block_count(), threads,
        [&](std::size_t b, int) {
            Vec<double, D> low, high;
            for (int a = 0; a < D; ++a) {
                low[a] = h * double(block_size * grid.block_along(b, a));
                high[a] = low[a] + h * (block_size - 1);
            }
            Tape<P>& tape = Tape<P>::mine();
            tape.cut(1);
            const TracedPolicy<P, Acceleration> field(acceleration);
            const bool reached = here.reaches(low, high);
            std::optional<TracedPolicy<P, Lifted>> walls;
            if (reached) walls.emplace(lifted);
            const std::size_t start = tape.size(), first_node = b * std::size_t(block_nodes<D> * node_width);
            for (int from = 0; from < block_nodes<D>; from += lanes) {
                P r[4], bar[4];
                load_quads(momenta + first_node + from * node_width, r);
                load_quads(bars + first_node + from * node_width, bar);
                if (!any(r[node_mass] > P(0))) continue;
                tape.cut(start);
                const Vec<P, D> place = places_of_nodes<P, D>(cast<S>(low), S(h), from);
                Vec<T, D> momentum, x;
                Vec<P, D> adjoint;
                unroll<D>([&](auto a) FIRN_LAMBDA {
                    momentum.v[a] = T::input(r[a]);
                    x.v[a] = T(place.v[a]);
                    adjoint.v[a] = bar[a];
                });
                const T mass = T::input(r[node_mass]);
                const auto velocity = [&](const auto& boundary) {
                    return node_velocity(momentum, mass, x, *field, T(P(S(dt))), boundary);
                };
                const Vec<T, D> v = reached ? velocity(AllAtOnce<Lifted>{**walls}) : velocity(NoBoundary{});
                tape.begin();
                seed(v, adjoint);
                tape.back();
                field.add_to(sums.of(b).first(field.count()));
                if (reached) walls->add_to(sums.of(b).subspan(field.count()));
                unroll<D>([&](auto a) FIRN_LAMBDA { bar[a] = adjoint_of(momentum.v[a]); });
                bar[node_mass] = adjoint_of(mass);
                store_quads(bar, bars + first_node + from * node_width);
            }
        },
        4);
}

/// An acceleration as a field of traced numbers: of a vector, Gravity.
template <class P, int D, class Acceleration>
auto traced_acceleration(const Acceleration& acceleration, const Vec<double, D>& corner) {
    if constexpr (is_uniform<Acceleration>)
        return lift<traced<P>>(Gravity<value_type_t<P>, D>{cast<value_type_t<P>>(acceleration)});
    else
        return lifted_acceleration<traced<P>>(acceleration, corner);
}

/// Returns a particle as a measure sees it. \param input  input(x) makes a number of the measure's scalar from x
template <class T, int D, class State, class Particles, class Input>
MeasuredParticle<T, D, State> measured(const Particles& particles, std::size_t slot, const Input& input) {
    const auto vector = [&](const Vec<double, D>& from) {
        Vec<T, D> r;
        for (int a = 0; a < D; ++a) r[a] = input(from[a]);
        return r;
    };
    MeasuredParticle<T, D, State> particle{};
    particle.id = particles.id(slot);
    particle.position = vector(particles.exact_position(slot));
    particle.velocity = vector(cast<double>(particles.velocity(slot)));
    particle.mass = input(double(particles.mass(slot)));
    particle.volume = input(double(particles.volume(slot)));
    const auto stored = stored_numbers(particles.state(slot));
    constexpr auto members = State::fields();
    unroll<int(std::tuple_size_v<decltype(members)>)>([&](auto f) {
        auto& member = particle.state.*(std::get<f>(members).member);
        using Value = std::remove_cvref_t<decltype(member)>;
        std::array<T, std::size_t(component_count<Value>)> numbers;
        for (std::size_t k = 0; k < numbers.size(); ++k) numbers[k] = input(double(std::get<f>(stored)[k]));
        member = Stored<Value>::made(numbers);
    });
    return particle;
}

/// Writes stored adjoints of a state to a state of derivatives. Of F and J, the derivatives themselves are its numbers.
template <class Field, std::size_t N, class State>
void write_state(const std::array<Field, N>& fields, std::size_t slot, State& to) {
    constexpr auto members = State::fields();
    unroll<int(N)>([&](auto f) {
        auto& member = to.*(std::get<f>(members).member);
        using Value = std::remove_cvref_t<decltype(member)>;
        std::array<double, std::size_t(component_count<Value>)> numbers;
        for (std::size_t k = 0; k < numbers.size(); ++k) numbers[k] = double(*fields[f].at(slot, int(k)));
        if constexpr (Stored<Value>::less_one)
            for_less_one<Value>([&](auto k) { numbers[k] -= 1; });
        member = Stored<Value>::made(numbers);
    });
}

}  // namespace firn::inline FIRN_BUILD::detail
