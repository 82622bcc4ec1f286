#include "small_run.hpp"

#include <firn/firn.hpp>
#include <firn/io/states.hpp>

namespace small_run {
namespace {

using Run = firn::Simulation<2, firn::FixedCorotated<float>, firn::Apic, firn::MlsForce, firn::QuadraticBSpline,
                             firn::Coloured>;

Run empty() {
    return Run({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 16}, firn::FixedCorotated<float>::from_young_poisson(1e5F, 0.3F), {1});
}

}  // namespace

firn::State<float> begun() {
    Run run = empty();
    run.add(firn::sample_box<2>({0.25, 0.3}, {0.5, 0.5}, {.spacing = 1.0 / 32}), 1000, {1.0, -0.5});
    run.add(firn::sample_box<2>({0.7, 0.7}, {0.76, 0.76}, {.spacing = 1.0 / 32}), 500);
    for (int i = 0; i < 3; ++i) run.step();
    return firn::state_of(run);
}

bool goes_on_from(const firn::State<float>& state) {
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
