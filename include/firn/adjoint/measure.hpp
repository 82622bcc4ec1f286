/// \file Particles as a measure sees them.
#pragma once

#include <firn/adjoint/material.hpp>

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

/// Returns the derivatives that a member of a state of derivatives has. Of F and J they are its numbers themselves.
template <class Value>
auto derivatives_of(const Value& member) {
    if constexpr (requires { member.m; }) {
        return std::to_array(member.m);  // not the numbers of a DeformationGradient, which are those of F − I
    } else {
        auto numbers = Stored<Value>::numbers(member);
        if constexpr (Stored<Value>::less_one) numbers[0] += 1;
        return numbers;
    }
}

/// Adds t times the derivatives of `by` to the numbers of a state.
template <class State, class By>
void shift_state(State& state, const By& by, double t) {
    constexpr auto members = State::fields();
    constexpr auto members_by = By::fields();
    unroll<int(std::tuple_size_v<decltype(members)>)>([&](auto f) {
        auto& member = state.*(std::get<f>(members).member);
        using Value = std::remove_cvref_t<decltype(member)>;
        auto numbers = Stored<Value>::numbers(member);
        const auto change = derivatives_of(by.*(std::get<f>(members_by).member));
        for (std::size_t k = 0; k < numbers.size(); ++k)
            numbers[k] += value_type_t<std::remove_cvref_t<decltype(numbers[k])>>(t * change[k]);
        member = Stored<Value>::made(numbers);
    });
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
