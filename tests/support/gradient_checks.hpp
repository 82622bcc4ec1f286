/// \file Checks of gradients, against difference quotients and against runs in dual numbers.
#pragma once

#include "support/catch.hpp"
#include "support/derivatives.hpp"
#include "support/tangent.hpp"

namespace derivatives {

/// Compares a derivative with differences of at(t), of which differences are taken for t of the order of `size`.
template <class Value>
void check_slope(double got, double size, const Value& at) {
    double least = std::numeric_limits<double>::infinity();
    for (const double relative : {1e-4, 1e-5, 1e-6}) {
        const double h = relative * std::abs(size);
        const double wanted = difference_quotient(at, h);
        least = std::min(least, std::abs(got - wanted) / std::abs(wanted));
    }
    CHECK(got != 0);
    CHECK(least < 1e-6);
}

/// Checks a run's gradient along random directions: all inputs of run.along together, then each kind of them alone.
template <class Simulation>
void check_derivatives(Run<Simulation> run, double allowed = 1e-6) {
    constexpr std::pair<double Along::*, const char*> inputs[] = {
        {&Along::position, "position"}, {&Along::velocity, "velocity"}, {&Along::affine, "affine"},
        {&Along::state, "state"},       {&Along::mass, "mass"},         {&Along::volume, "volume"},
        {&Along::material, "material"}, {&Along::transfer, "transfer"}, {&Along::gravity, "gravity"}};
    const Along all = run.along;
    CHECK(run.error() < allowed);
    for (const auto& [input, name] : inputs) {
        if (all.*input == 0) continue;
        run.along = {};
        run.along.*input = 1;
        CAPTURE(name);
        if (run.value(1e-3) != run.value(-1e-3)) CHECK(run.error() < allowed);
    }
}

/// Checks the gradient of a run of jelly with these policies.
template <int D, class... Policies>
void check_policies() {
    Run<SimulationWith<D, FixedCorotated<double>, Policies...>> run{jelly, walls_of_run<D>()};
    run.dt = 1e-3;
    check_derivatives(run);
}

}  // namespace derivatives

namespace tangent {

/// Checks that steps J and their way back are transposes of each other to rounding: |⟨u, J v⟩ − ⟨Jᵀu, v⟩| is at most
/// 1e-12 Σ|u_i (J v)_i|.
template <class Simulation, class Load = std::nullptr_t>
void check_transposed(const Simulation& simulation, int steps, int directions, const Load& load = {}) {
    for (const Compared& one : compare(simulation, steps, directions, load)) {
        CAPTURE(one.gradient, one.tangent, one.terms);
        CHECK(one.value_of_tangent == Approx(one.value).epsilon(1e-9));  // the same run
        if constexpr (has_returned<typename Simulation::material_type, Simulation::dimension>)
            CHECK(one.flowing >= 0.5);  // matter that could flow does
        CHECK(std::abs(one.gradient - one.tangent) <= 1e-12 * one.terms);
        CHECK(one.terms > 0);
    }
}

}  // namespace tangent
