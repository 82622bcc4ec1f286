/// \file firn's own particles of one material: a ParticleStore with functions that read and write the material's state.
#pragma once

#include <firn/data/particle_store.hpp>

namespace firn::inline FIRN_BUILD {

/// Particles of one material, with all data that the material, the transfers and the grid need of each particle.
///
/// Bytes per particle in float, 3D, for an elastic material: position x 12 and the index of its block 4, velocity v 12,
/// affine velocity matrix C 36, stress τ 24, deformation gradient F 36, mass m 4, initial volume V0 4, id 4; in sum 136
/// (and 1–3 % of padding if matter is dense). Sorting needs 36 bytes more as scratch memory, and the partition 4.
///
/// \tparam State  the material's state
template <std::floating_point S, int D, class State = ElasticState<S, D>>
class Particles : public ParticleStore<S, D> {
    using Store = ParticleStore<S, D>;

public:
    using View = ParticleView<S, D, BlockedSpan<S>, State>;  ///< arrays of these particles

    /// Makes an empty set of particles.
    /// \param domain  domain of the grid; particles may lie outside the domain
    explicit Particles(const Domain<D>& domain) : Store(domain, field_table<S, D, State>()) {}

    using Store::push_back;
    /// Appends a particle. The new particle gets the id that next_id() returned before this call. Particles must be
    /// sorted again before the next step.
    /// \param x       position [m]
    /// \param v       velocity [m/s]
    /// \param mass    mass [kg]
    /// \param volume  initial volume [m^D]
    /// \param state   the material's state
    /// \throws parameter_error  if all ids have been given out
    /// \throws memory_error     if there is no memory for more slots
    void push_back(const Vec<double, D>& x, const Vec<S, D>& v, S mass, S volume, const State& state = {}) {
        const std::size_t slot = Store::push_back(x);
        this->set_velocity(slot, v);
        this->set_mass(slot, mass);
        this->set_volume(slot, volume);
        set_state(slot, state);
    }

    /// Returns the material's state of the particle in a slot.
    State state(std::size_t slot) const {
        State state{};
        for_members(state, [&](std::size_t field, auto& member) {
            using Value = std::remove_cvref_t<decltype(member)>;
            const S* const from = this->numbers_of(field, slot);
            std::array<S, std::size_t(component_count<Value>)> numbers;
            for (std::size_t k = 0; k < numbers.size(); ++k) numbers[k] = from[k * pack_size];
            member = detail::Stored<Value>::made(numbers);
        });
        return state;
    }
    /// Sets the material's state of the particle in a slot.
    void set_state(std::size_t slot, const State& state) {
        for_members(state, [&](std::size_t field, const auto& member) {
            S* const to = this->numbers_of(field, slot);
            const auto numbers = detail::Stored<std::remove_cvref_t<decltype(member)>>::numbers(member);
            for (std::size_t k = 0; k < numbers.size(); ++k) to[k * pack_size] = numbers[k];
        });
    }

    /// Returns the addresses of the particles' arrays. The addresses are valid until particles are added or sorted.
    View view() {
        const auto motion = this->motion();
        View view{motion.position, motion.velocity, motion.affine, motion.stress, motion.mass, motion.volume, {}};
        for (std::size_t f = 0; f < state_field_count<State>; ++f)
            view.state[f] = this->span(Store::built_in_fields + f);
        return view;
    }

private:
    /// Calls f(field, member) for each member of a state that is a field; `field` is its index in the table.
    template <class OfState, class F>
    static void for_members(OfState& state, const F& f) {
        constexpr auto members = State::fields();
        unroll<int(state_field_count<State>)>(
            [&](auto k) { f(Store::built_in_fields + k, state.*(std::get<k>(members).member)); });
    }
};

}  // namespace firn::inline FIRN_BUILD
