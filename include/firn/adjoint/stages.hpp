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
#include <firn/material/fixed_corotated.hpp>
#include <firn/material/hencky.hpp>
#include <firn/material/neo_hookean.hpp>
#include <firn/transfer/apic.hpp>
#include <firn/transfer/pic.hpp>

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

/// A material's state has at most so many numbers.
inline constexpr std::size_t most_numbers = 64;

/// Whether the stress of a material is the derivative of its energy_density() by F, which is all of its state, and is
/// linear in its parameters, which are numbers.
/// \see MaterialBack
template <class Material>
inline constexpr bool comes_from_energy = false;
template <class S>
inline constexpr bool comes_from_energy<FixedCorotated<S>> = true;
template <class S>
inline constexpr bool comes_from_energy<NeoHookean<S>> = true;
template <class S>
inline constexpr bool comes_from_energy<Hencky<S>> = true;

/// Whether a transfer keeps the affine field C as it is, or carries none.
template <class Transfer>
inline constexpr bool keeps_affine_field = false;
template <>
inline constexpr bool keeps_affine_field<Apic> = true;
template <>
inline constexpr bool keeps_affine_field<Pic> = true;

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
                               std::array<traced<P>, most_numbers>& numbers) {
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
                                const std::array<traced<P>, most_numbers>& numbers) {
    std::size_t next = 0;
    for (std::size_t f = 0; f < N; ++f)
        for (int k = 0; k < bars[f].components; ++k) bars[f].store(slots, k, adjoint_of(numbers[next++]));
}

/// Returns A : B, the sum of the products of all elements.
template <class P, int D>
FIRN_INLINE P contracted(const Mat<P, D>& A, const Mat<P, D>& B) {
    P sum = A.m[0] * B.m[0];
    unroll<D * D - 1>([&](auto k) FIRN_LAMBDA { sum = sum + A.m[k + 1] * B.m[k + 1]; });
    return sum;
}

/// The way back of the update of a material and of its stress, for one register of particles.
template <class Material, class P, int D, std::size_t N>
class MaterialBack {
    using T = traced<P>;
    using Field = BlockedSpan<value_type_t<P>>;
    using Lifted = with_scalar_t<Material, T>;
    static constexpr std::size_t parameters = [] {
        if constexpr (comes_from_energy<Material>)
            return std::tuple_size_v<decltype(Material::parameters())>;
        else
            return std::size_t(0);
    }();

public:
    /// \param material  with its parameters as inputs, the first nodes of the tape
    MaterialBack(const Material& plain, const Lifted& material, const std::array<Field, N>& fields,
                 const std::array<Field, N>& bars)
        : dual_(lift<dual<P>>(plain)), material_(material), fields_(fields), bars_(bars) {
        if constexpr (comes_from_energy<Material>) {
            of_parameters_.fill(P(0));
            for (std::size_t k = 0; k < parameters; ++k) {
                std::size_t next = 0;
                by_parameter_[k] = lift<P>(plain);
                for_numbers<P>(by_parameter_[k], [&](P& number) { number = P(next++ == k ? 1 : 0); });
            }
        }
    }
    /// Adds the derivatives by the parameters of all registers so far, where they are not on the tape.
    void add_to(std::span<double> sums) const {
        for (std::size_t k = 0; k < of_parameters_.size(); ++k) sums[k] += sum_of_lanes(of_parameters_[k]);
    }

    /// Replaces the adjoints of the new states by those of the old ones.
    /// \param stress_bar  adjoints of the stress: of the numbers that are stored
    /// \return  the adjoint of the velocity gradient
    Mat<P, D> operator()(const Slots& slots, const Mat<P, D>& velocity_gradient, const P& dt,
                         const P (&stress_bar)[symmetric_size<D>]) const {
        if constexpr (comes_from_energy<Material>)
            return by_energy(slots, velocity_gradient, dt, stress_bar);
        else
            return by_tape(slots, velocity_gradient, dt, stress_bar);
    }

private:
    [[gnu::noinline]] Mat<P, D> by_tape(const Slots& slots, const Mat<P, D>& velocity_gradient, const P& dt,
                                        const P (&stress_bar)[symmetric_size<D>]) const {
        using State = material_state_t<Lifted, D>;
        const Mat<T, D> L = inputs(velocity_gradient);
        std::array<T, most_numbers> numbers;
        const State old = state_inputs<State>(fields_, slots, numbers);
        State state;
        Mat<T, D> stress;
        if constexpr (has_returned_with_stress<Lifted, D>) {
            const auto after = updated_with_stress(material_, old, L, T(dt));
            state = after.state;
            stress = after.stress;
        } else {
            state = updated(material_, old, L, T(dt));
            stress = stress_of(material_, state, L);
        }
        const auto stored = stored_numbers(state);
        Tape<P>& tape = Tape<P>::mine();
        tape.begin();
        seed_stress(stress, stress_bar);
        unroll<int(N)>([&](auto f) FIRN_LAMBDA {
            const auto& own = std::get<f>(stored);
            for (std::size_t k = 0; k < own.size(); ++k) seed(own[k], bars_[f].template load<P>(slots, int(k)));
        });
        tape.back();
        store_adjoints(bars_, slots, numbers);
        return adjoint_of(L);
    }

    /// Where τ Fᵀ⁻¹ is the derivative of an energy by F, its own derivative is symmetric. So the product of the adjoint
    /// τ̄ with the derivative of τ is a directional derivative, along τ̄ F:  (dτ(τ̄F) − τ τ̄ + τ̄ τ) F⁻ᵀ.
    Mat<P, D> by_energy(const Slots& slots, const Mat<P, D>& velocity_gradient, const P& dt,
                        const P (&stress_bar)[symmetric_size<D>]) const {
        using State = material_state_t<with_scalar_t<Material, P>, D>;
        using Dual = dual<P>;
        const State old = load_state<State>(fields_, slots);
        const State now = followed(old, velocity_gradient, dt);
        const Mat<P, D>&F = now.F, &before = old.F, H = displacement_gradient(now.F);
        const Mat<P, D> bar = symmetric<P, D>([&](auto i, auto j) FIRN_LAMBDA {
            const P stored = stress_bar[symmetric_index<D>(i, j)];
            return int(i) == int(j) ? stored : P(0.5) * stored;
        });
        const Mat<P, D> along = bar * F;
        Mat<Dual, D> direction;
        unroll<D * D>([&](auto k) FIRN_LAMBDA { direction.m[k] = Dual{H.m[k], along.m[k]}; });
        const Mat<Dual, D> stress = dual_.kirchhoff_stress(DeformationGradient<Dual, D>::from_displacement(direction));
        Mat<P, D> tau, change;
        unroll<D * D>([&](auto k) FIRN_LAMBDA { tau.m[k] = stress.m[k].value, change.m[k] = stress.m[k].derivative; });
        Mat<P, D> of_new = (change - tau * bar + bar * tau) * inverse_transposed(F);
        unroll<D * D>([&](auto k) FIRN_LAMBDA { of_new.m[k] = of_new.m[k] + bars_[0].template load<P>(slots, k); });
        const Mat<P, D> of_old = of_new + transpose(velocity_gradient) * of_new * dt;
        unroll<D * D>([&](auto k) FIRN_LAMBDA { bars_[0].store(slots, k, of_old.m[k]); });
        add_parameters(now.F, bar);
        return of_new * transpose(before) * dt;
    }
    /// Adds the derivatives by the parameters. The stress is linear in them, so the derivative by one is the stress
    /// where it is 1 and the others are 0.
    template <class Gradient>
    FIRN_INLINE void add_parameters(const Gradient& F, const Mat<P, D>& bar) const {
        unroll<int(parameters)>([&](auto k) FIRN_LAMBDA {
            of_parameters_[k] = of_parameters_[k] + contracted(bar, by_parameter_[k].kirchhoff_stress(F));
        });
    }
    static void seed_stress(const Mat<T, D>& stress, const P (&stress_bar)[symmetric_size<D>]) {
        unroll<D>([&](auto i) FIRN_LAMBDA {
            unroll<D - i>([&](auto j)
                              FIRN_LAMBDA { seed(stress(i, i + j), stress_bar[symmetric_index<D>(i, i + j)]); });
        });
    }
    /// Returns (F⁻¹)ᵀ: the matrix of cofactors, divided by the determinant.
    static Mat<P, D> inverse_transposed(const Mat<P, D>& F) {
        const P per_determinant = P(1) / determinant(F);
        Mat<P, D> r;
        unroll<D>([&](auto i) FIRN_LAMBDA {
            unroll<D>([&](auto j) FIRN_LAMBDA {
                if constexpr (D == 2) {
                    r(i, j) = F(1 - i, 1 - j) * (int(i) == int(j) ? per_determinant : -per_determinant);
                } else {
                    constexpr int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
                    r(i, j) = (F(i1, j1) * F(i2, j2) - F(i1, j2) * F(i2, j1)) * per_determinant;
                }
            });
        });
        return r;
    }

    with_scalar_t<Material, dual<P>> dual_;
    std::array<with_scalar_t<Material, P>, parameters> by_parameter_;
    mutable std::array<P, parameters> of_parameters_;
    const Lifted& material_;
    const std::array<Field, N>&fields_, &bars_;
};

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
    static constexpr bool blended = blends_velocities<Transfer>;

public:
    /// \param records  of record_size() components;  \param records_before  of the same, for transfers that blend
    G2PBack(const View& view, const View& bar, const BlockPartition<D>& partition, const SparseGrid<S, D>& grid,
            const Material& material, double dt, const Transfer& transfer, BlockedSpan<S> records,
            BlockedSpan<S> records_before)
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
          records_before_(records_before) {}

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
                for (int lane = 0; lane < pack_size; lane += scalar_traits<P>::lanes) {
                    const std::size_t at = slot + std::size_t(lane);
                    pack.locate(lane, places.template position<P>(at), places.template block_in_arena<Kernel, P>(at, n),
                                n);
                }
                gather_from_arena(pack.weights, now.arena.node, n, of_pack);
                if constexpr (blended) gather_from_arena(pack.weights, before_forces->arena.node, n, before);
            },
            [&](const Slots& slots, std::size_t slot, int lane) {
                const G2PSums<P, D> sums_at = of_pack.lanes(lane);
                const Vec<P, D> offset = pack.offset(lane), place = load_vector<P, D>(view_.position, slots);
                const auto taken = take_from_grid<Kernel, Transfer, Force>(sums_at, offset, h, plain_transfer);
                G2PResult<P, D> result{load_vector<P, D>(bar_.velocity, slots), Mat<P, D>::zero(), {}};
                unroll<D * D>([&](auto k) FIRN_LAMBDA {
                    if constexpr (Transfer::affine) result.affine.m[k] = bar_.affine.template load<P>(slots, k);
                });
                P stress_bar[symmetric_size<D>];
                unroll<symmetric_size<D>>([&](auto k)
                                              FIRN_LAMBDA { stress_bar[k] = bar_.stress.template load<P>(slots, k); });
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
                Vec<P, D> offset_bar;
                const P2GRecord<P, D> record =
                    give_back_to_grid<Kernel, Transfer, Force>(sums_at, offset, h, result, offset_bar);

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
                    bar_.velocity.store(slots, a, own_bar.v[a]);
                });
                unroll<D * D>([&](auto k) FIRN_LAMBDA { bar_.affine.store(slots, k, P(0)); });
                unroll<symmetric_size<D>>([&](auto k) FIRN_LAMBDA { bar_.stress.store(slots, k, P(0)); });
            });
        material_back.add_to(sums.first(material.count()));
    }

private:
    static void store_record(const BlockedSpan<S>& to, const Slots& slots, const P2GRecord<P, D>& record,
                             bool gradients) {
        unroll<D>([&](auto k) FIRN_LAMBDA { to.store(slots, k, record.momentum.v[k]); });
        unroll<D * D>([&](auto k) FIRN_LAMBDA {
            to.store(slots, D + k, record.affine.m[k]);
            if (gradients) to.store(slots, D + D * D + k, record.gradient.m[k]);
        });
    }
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
    BlockedSpan<S> records_, records_before_;
};

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
/// \param bars  the adjoints of the nodes
template <class Kernel, class Transfer, class Force, std::floating_point S, int D, class View, class Bar>
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
        PackSums<Kernel, true, gradients, S, D> of_pack;
        const auto add = [](const BlockedSpan<S>& to, const Slots& slots, int k, const P& more)
                             FIRN_LAMBDA { to.store(slots, k, to.template load<P>(slots, k) + more); };
        for_registers<P>(
            places, group,
            [&](std::size_t slot) {
                for (int lane = 0; lane < pack_size; lane += scalar_traits<P>::lanes) {
                    const std::size_t at = slot + std::size_t(lane);
                    pack.locate(lane, places.template position<P>(at), places.template block_in_arena<Kernel, P>(at, n),
                                n);
                }
                gather_from_arena(pack.weights, nodes.arena.node, n, of_pack);
            },
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
                const G2PSums<P, D> sums = of_pack.lanes(lane);
                Mat<P, D> gradient_bar = Mat<P, D>::zero();
                if constexpr (gradients) gradient_bar = sums.gradient;
                Vec<P, D> offset_bar;
                const P2GParticle<P, D> of = give_back_to_particle<Kernel, Transfer, Force>(
                    particle, held, {of_pack.fourth(lane), sums.velocity, sums.moment, gradient_bar}, offset, P(h),
                    P(S(dt)), offset_bar);
                const WeightSlopes<Kernel, gradients, P, D> weights(
                    locate<Kernel>(places.template position<P>(slot)).fraction);
                const Vec<P, D> slope =
                    slope_of_sums<Kernel, gradients>(held, weights, nodes.arena.node, n, pack.weights.corner + lane);
                add(bar.mass, slots, 0, of.mass);
                add(bar.volume, slots, 0, of.volume);
                unroll<D>([&](auto a) FIRN_LAMBDA {
                    add(bar.position, slots, a, slope.v[a] + offset_bar.v[a]);
                    add(bar.velocity, slots, a, of.velocity.v[a]);
                });
                if constexpr (Transfer::affine)
                    unroll<D * D>([&](auto k) FIRN_LAMBDA { add(bar.affine, slots, k, of.affine.m[k]); });
                unroll<D>([&](auto i) FIRN_LAMBDA {
                    unroll<D - i>([&](auto j) FIRN_LAMBDA {  // of the numbers that are stored
                        constexpr int row = i, column = i + j;
                        const P both =
                            row == column ? of.stress(row, row) : of.stress(row, column) + of.stress(column, row);
                        add(bar.stress, slots, symmetric_index<D>(row, column), both);
                    });
                });
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

/// A boundary whose parts act at once, as in the grid update, for masses in another unit.
template <class Boundary, class P>
struct AllAtOnce {
    const Boundary& boundary;
    const P& unit_of_mass;  // [kg]

    template <class T, int D>
    Vec<T, D> velocity(const Vec<T, D>& x, const Vec<T, D>& v, const T& mass, const T& dt) const {
        return velocity_among(boundary, x, v, NoOthers{}, AnySurface{}, NodeInertia<T>{mass * T(unit_of_mass), dt});
    }
};

/// The way back of the grid update: replaces the adjoints of the node velocities by those of momenta and masses.
/// \param momenta  the momenta and masses of the nodes before the grid update
/// \param bars     the adjoints of the nodes
/// \param sums     for each block: the derivatives by the parameters of the acceleration, then of the boundary
template <std::floating_point S, int D, class Acceleration, class Lifted, class Boundary>
void update_grid_back(int threads, const SparseGrid<S, D>& grid, const S* momenta, S* bars, double dt,
                      const Acceleration& acceleration, const Boundary& here, const Lifted& lifted, OrderedSums& sums) {
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
                // Masses of nodes range down to the smallest numbers, whose inverse squares are infinite. So the mass
                // of each node is the unit of its momentum and mass.
                const auto filled = r[node_mass] >= P(std::numeric_limits<S>::min());
                const P unit = select(filled, r[node_mass], P(1)), per_unit = P(1) / unit;
                const Vec<P, D> place = places_of_nodes<P, D>(cast<S>(low), S(h), from);
                Vec<T, D> momentum, x;
                Vec<P, D> adjoint;
                unroll<D>([&](auto a) FIRN_LAMBDA {
                    momentum.v[a] = T::input(r[a] * per_unit);
                    x.v[a] = T(place.v[a]);
                    adjoint.v[a] = bar[a];
                });
                const T mass = T::input(r[node_mass] * per_unit);
                const auto velocity = [&](const auto& boundary) {
                    return node_velocity(momentum, mass, x, *field, T(P(S(dt))), boundary);
                };
                const Vec<T, D> v = reached ? velocity(AllAtOnce<Lifted, P>{**walls, unit}) : velocity(NoBoundary{});
                tape.begin();
                seed(v, adjoint);
                tape.back();
                field.add_to(sums.of(b).first(field.count()));
                if (reached) walls->add_to(sums.of(b).subspan(field.count()));
                unroll<D>([&](auto a) FIRN_LAMBDA { bar[a] = adjoint_of(momentum.v[a]) * per_unit; });
                bar[node_mass] = adjoint_of(mass) * per_unit;
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
        if constexpr (Stored<Value>::less_one) for_less_one<Value>([&](auto k) { numbers[k] -= 1; });
        member = Stored<Value>::made(numbers);
    });
}

}  // namespace firn::inline FIRN_BUILD::detail
