/// \file The update of a material and its stress backwards, for one register of particles.
#pragma once

#include <firn/adjoint/inputs.hpp>
#include <firn/core/parallel.hpp>
#include <firn/data/particles.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/material/hencky.hpp>
#include <firn/material/neo_hookean.hpp>
#include <firn/material/surroundings.hpp>
#include <firn/math/inverse.hpp>

namespace firn::inline FIRN_BUILD::detail {

/// How many numbers a material's state has.
template <class State>
inline constexpr std::size_t state_size = std::apply(
    [](const auto&... field) {
        return (std::size_t(0) + ... +
                std::size_t(component_count<std::remove_cvref_t<decltype(std::declval<State>().*(field.member))>>));
    },
    State::fields());

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

/// Returns the state of particles as inputs, from their stored numbers.
template <class State, class Field, std::size_t N, class P>
FIRN_INLINE State state_inputs(const std::array<Field, N>& fields, const Slots& slots,
                               std::array<traced<P>, state_size<State>>& numbers) {
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
template <class Field, std::size_t N, class P, std::size_t Size>
FIRN_INLINE void store_adjoints(const std::array<Field, N>& bars, const Slots& slots,
                                const std::array<traced<P>, Size>& numbers) {
    std::size_t next = 0;
    for (std::size_t f = 0; f < N; ++f)
        for (int k = 0; k < bars[f].components; ++k) bars[f].store(slots, k, adjoint_of(numbers[next++]));
}

/// Adds to component k of the numbers of particles.
template <class Field, class P>
FIRN_INLINE void add_at(const Field& field, const Slots& slots, int k, const P& more) {
    field.store(slots, k, field.template load<P>(slots, k) + more);
}

/// The adjoints of stresses: of the numbers that are stored.
template <class P, int D>
using StressBar = std::array<P, std::size_t(symmetric_size<D>)>;
template <class P, int D, class Field>
FIRN_INLINE StressBar<P, D> load_stress_bar(const Field& field, const Slots& slots) {
    StressBar<P, D> bar;
    unroll<symmetric_size<D>>([&](auto k) FIRN_LAMBDA { bar[k] = field.template load<P>(slots, k); });
    return bar;
}
/// Sets the adjoints of a new stress.
template <class P, int D>
FIRN_INLINE void seed_stress(const Mat<traced<P>, D>& stress, const StressBar<P, D>& bar) {
    unroll<D>([&](auto i) FIRN_LAMBDA {
        unroll<D - i>([&](auto j) FIRN_LAMBDA { seed(stress(i, i + j), bar[symmetric_index<D>(i, i + j)]); });
    });
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
    static_assert(!asks_surroundings<Material, D>,
                  "firn: an Adjoint does not know the surroundings of particles, for which this material asks with a "
                  "function at().");

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
                         const StressBar<P, D>& stress_bar) const {
        if constexpr (comes_from_energy<Material>)
            return by_energy(slots, velocity_gradient, dt, stress_bar);
        else
            return by_tape(slots, velocity_gradient, dt, stress_bar);
    }

private:
    [[gnu::noinline]] Mat<P, D> by_tape(const Slots& slots, const Mat<P, D>& velocity_gradient, const P& dt,
                                        const StressBar<P, D>& stress_bar) const {
        using State = material_state_t<Lifted, D>;
        const Mat<T, D> L = inputs(velocity_gradient);
        std::array<T, state_size<State>> numbers;
        const State old = state_inputs<State>(fields_, slots, numbers);
        State state;
        Mat<T, D> stress;
        if constexpr (has_stress_with_state<Lifted, D>) {
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
        seed_stress<P, D>(stress, stress_bar);
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
                        const StressBar<P, D>& stress_bar) const {
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
        Mat<P, D> of_new = (change - tau * bar + bar * tau) * inverse_transposed<P, D>(F);
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

    with_scalar_t<Material, dual<P>> dual_;
    std::array<with_scalar_t<Material, P>, parameters> by_parameter_;
    mutable std::array<P, parameters> of_parameters_;
    const Lifted& material_;
    const std::array<Field, N>&fields_, &bars_;
};

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
            std::array<T, state_size<LiftedState>> numbers;
            const LiftedState state = state_inputs<LiftedState>(view.state, slots, numbers);
            Mat<T, D> C;
            unroll<D * D>([&](auto k) FIRN_LAMBDA { C.m[k] = T::input(view.affine.template load<P>(slots, k)); });
            const Mat<T, D> stress = stress_of(*policy, state, C);
            tape.begin();
            seed_stress<P, D>(stress, load_stress_bar<P, D>(bar.stress, slots));
            tape.back();
            policy.add_to(sums.of(pack));
            std::size_t next = 0;
            for (const BlockedSpan<S>& field : bar.state)
                for (int k = 0; k < field.components; ++k) add_at(field, slots, k, adjoint_of(numbers[next++]));
            unroll<D * D>([&](auto k) FIRN_LAMBDA { add_at(bar.affine, slots, k, adjoint_of(C.m[k])); });
        }
    });
}

}  // namespace firn::inline FIRN_BUILD::detail
