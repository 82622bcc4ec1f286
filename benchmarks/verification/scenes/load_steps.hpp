/// \file Load steps: how scenes come to rest whose simulation is quasi-static, and what coming to rest costs.
#pragma once

#include <firn/firn.hpp>

#include <algorithm>
#include <ctime>
#include <memory>

namespace verification {

/// Whether a simulation finds equilibria by load steps. An explicit one needs damping and time.
template <class Simulation>
constexpr bool takes_load_steps = !Simulation::integration_type::is_explicit;

/// What it takes to bring matter to rest.
struct Effort {
    double seconds = 0;  ///< of processors
    long long steps = 0, newton_steps = 0, products = 0;
};

/// Measures what `act` takes, at most once for each simulation.
template <class Simulation, class Act>
Effort measured(Simulation& simulation, const Act& act) {
    const auto count = std::make_shared<Effort>();
    if constexpr (takes_load_steps<Simulation>)
        simulation.add_pass("count", "end g2p", [count](auto& run, const auto&) {
            count->newton_steps += run.solution.newton_steps;
            count->products += run.solution.products;
        });
    const auto steps = simulation.steps();
    const std::clock_t begin = std::clock();
    act();
    count->seconds = double(std::clock() - begin) / CLOCKS_PER_SEC;
    count->steps = static_cast<long long>(simulation.steps() - steps);
    return *count;
}

/// The part of a load that acts at a time [s], for loads of bodies: in load steps it grows from 0 to 1 in 1 s.
template <class Simulation>
double part_of_load(double time) {
    return takes_load_steps<Simulation> ? std::min(time, 1.0) : 1;
}
/// Takes as many load steps in 1 s. \param tolerance  forces that may be out of balance, as a part of the loads
template <class Simulation>
void load(Simulation& simulation, int steps, double tolerance = 1e-6) {
    simulation.integration.newton.tolerance = tolerance;
    simulation.fixed_time_step = 1.0 / steps;
    simulation.advance(1);
}
/// Takes load steps of 1 s each, in which gravity goes from where it is, or from 0 at the start, to `gravity`; and as
/// many `more` steps under the same gravity, in which the weights of nodes follow the matter.
/// \param tolerance  forces that may be out of balance, as a part of the loads
template <class Simulation>
void load(Simulation& simulation, const firn::Vec<double, Simulation::dimension>& gravity, int steps, int more,
          double tolerance = 1e-6) {
    using Vector = firn::Vec<double, Simulation::dimension>;
    simulation.integration.newton.tolerance = tolerance;
    const Vector before = simulation.steps() == 0 ? Vector::zero() : simulation.gravity;
    for (int k = 1; k <= steps + more; ++k) {
        const double part = std::min(double(k) / steps, 1.0);
        simulation.gravity = before + (gravity - before) * part;
        simulation.advance(1);
    }
}

}  // namespace verification
