/// \file A small simulation whose states the fuzzers damage, and which must answer for what it is restored from.
#pragma once

#include <firn/firn.hpp>
#include <firn/io/states.hpp>

namespace small_run {

using Run = firn::Simulation<2, firn::FixedCorotated<float>, firn::Apic, firn::MlsForce, firn::QuadraticBSpline,
                             firn::Coloured>;

inline Run empty() {
    return Run({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 16}, firn::FixedCorotated<float>::from_young_poisson(1e5F, 0.3F), {1});
}

/// Two bodies after some steps: a block of many particles and blocks of few.
inline Run begun() {
    Run run = empty();
    run.add(firn::sample_box<2>({0.25, 0.3}, {0.5, 0.5}, {.spacing = 1.0 / 32}), 1000, {1.0, -0.5});
    run.add(firn::sample_box<2>({0.7, 0.7}, {0.76, 0.76}, {.spacing = 1.0 / 32}), 500);
    for (int i = 0; i < 3; ++i) run.step();
    return run;
}

/// Restores a simulation from a state and goes one step on. False where a typed error refused either; anything else
/// that is thrown, or worse, is the caller's to see.
inline bool goes_on_from(const firn::State<float>& state) {
    try {
        Run run = empty();
        firn::restore(run, state);
        run.step();
    } catch (const firn::error&) {
        return false;
    }
    return true;
}

}  // namespace small_run
