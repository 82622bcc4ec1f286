/// \file Particles as a measure sees them.
#pragma once

#include <firn/adjoint/material.hpp>

#include <vector>

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

/// Calls f(number) for each number of a state of derivatives. Of F and J, the derivatives are their numbers themselves.
template <class State, class F>
void for_state(State& state, const F& f) {
    std::apply(
        [&](const auto&... field) {
            const auto go = [&](auto& member) {
                if constexpr (requires { member.m; })
                    for (auto& number : member.m) f(number);
                else if constexpr (requires { member.v; })
                    for (auto& number : member.v) f(number);
                else if constexpr (requires { member.excess; }) {
                    auto ratio = double(member);  // J itself
                    f(ratio);
                    if constexpr (!std::is_const_v<std::remove_reference_t<decltype(member)>>)
                        member.excess = ratio - 1;
                } else
                    f(member);
            };
            (go(state.*field.member), ...);
        },
        std::remove_const_t<State>::fields());
}

/// Adds t times the derivatives of `by` to the numbers of a state.
template <class State, class By>
void shift_state(State& state, const By& by, double t) {
    std::vector<double> change;
    for_state(by, [&](double number) { change.push_back(number); });
    std::size_t next = 0;
    std::apply(
        [&](const auto&... field) {
            const auto shift = [&](auto& member) {
                using Value = Stored<std::remove_cvref_t<decltype(member)>>;
                auto numbers = Value::numbers(member);
                for (auto& number : numbers) number = typename Value::Number(double(number) + t * change[next++]);
                member = Value::made(numbers);
            };
            (shift(state.*field.member), ...);
        },
        State::fields());
}

/// Writes stored adjoints of a state to a state of derivatives.
template <std::floating_point S, std::size_t N, class State>
void write_state(const std::array<BlockedSpan<S>, N>& fields, std::size_t slot, State& to) {
    std::size_t field = 0;
    int component = 0;
    for_state(to, [&](double& number) {
        number = double(*fields[field].at(slot, component));
        if (++component == fields[field].components) ++field, component = 0;
    });
}

}  // namespace firn::inline FIRN_BUILD::detail
