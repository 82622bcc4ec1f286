/// \file What programs that compare runs on a device with runs on the CPU share: simulations that both can do, and
/// comparisons of their particles.
#pragma once

#include <firn/io/simulation_state.hpp>
#include <firn/webgpu/on_gpu.hpp>

#include "checks.hpp"
#include "scene.hpp"

#include <cmath>

namespace checks {

/// Compares all that two states have.
template <class State>
void check_same_state(const std::string& name, const State& expected, const State& got) {
    check(got.time == expected.time && got.step == expected.step && got.last_time_step == expected.last_time_step,
          firn::sentence(name, "step ", expected.step), firn::sentence("step ", got.step, ", ", got.time, " s"));
    check(got.id == expected.id && got.body == expected.body, name + "ids and bodies");
    check(got.parameters == expected.parameters, name + "parameters, also those of a boundary that moves");
    for (std::size_t f = 0; f < expected.fields.size(); ++f) {
        // Devices leave out additions of 0, which make 0 of −0 on the CPU.
        const auto without_signed_zeros = [](auto values) {
            for (auto& x : values) x = x == 0 ? 0 : x;
            return values;
        };
        check_same_bits(name + got.fields[f].name, without_signed_zeros(got.fields[f].values),
                        without_signed_zeros(expected.fields[f].values));
    }
}

/// Compares all that two simulations have of their particles, and how far they are.
template <class A, class B>
void check_same_run(const std::string& name, A& a, B& b) {
    check_same_state(name, firn::state_of(a), firn::state_of(b));
}

/// Compares the totals of two sets of particles.
template <int D>
void check_same_totals(const std::string& name, const firn::Totals<D>& expected, const firn::Totals<D>& got) {
    check(got.particles == expected.particles && got.mass == expected.mass && got.momentum == expected.momentum &&
              got.angular_momentum == expected.angular_momentum && got.kinetic_energy == expected.kinetic_energy &&
              (got.elastic_energy == expected.elastic_energy || std::isnan(expected.elastic_energy)),
          name + "totals");
}

/// A simulation in the unit box that says no warnings.
template <int D, class Material, class... Policies>
auto made(const Material& material, double cell_size, double time_step, const Policies&... policies) {
    firn::Domain<D> domain;
    domain.cell_size = cell_size;
    firn::Simulation simulation(domain, material, scenes::Integers{}, policies...);
    simulation.fixed_time_step = time_step;
    simulation.warn = {};
    return simulation;
}

/// The same in steps at their bound.
template <class Simulation>
Simulation bounded(Simulation simulation) {
    simulation.fixed_time_step = 0;
    simulation.execution.float_steps = true;
    return simulation;
}

}  // namespace checks
