// quick: no
/// \file Runs of implicit and quasi-static steps go on from a state to the bits of runs that were never stopped.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/firn.hpp>
#include <firn/implicit.hpp>
#include <firn/io/states.hpp>

namespace implicit_restart_tests {
using namespace firn;

template <class Time>
auto make(int threads) {
    const Domain<2> domain({0, 0}, {1.6, 1.6}, 0.1);
    const auto walls = Walls<double, 2>::all(domain.lower, domain.upper, {Contact::separate, 0.5});
    Simulation run(domain, NeoHookean<double>::from_young_poisson(1e5, 0.3), walls, WeightGradientForce{}, Time{},
                   Flip<double>{0.9}, Coloured{threads});
    run.warn = {};
    return run;
}

TEMPLATE_TEST_CASE("A solved run goes on from a state to the same bits, and asks for the same limits", "", QuasiStatic,
                   Implicit, TrBdf2) {
    auto whole = make<TestType>(1);
    whole.add(sample_box<2>({0.4, 0}, {1, 0.5}, {.spacing = 0.05}), 1000);
    whole.fixed_time_step = 0.02;
    for (int i = 0; i < 3; ++i) whole.step();
    const auto state = state_of(whole);
    auto continued = make<TestType>(2);
    restore(continued, state);
    CHECK(continued.fixed_time_step == whole.fixed_time_step);
    for (int i = 0; i < 3; ++i) whole.step(), continued.step();
    CHECK(continued.steps() == whole.steps());
    CHECK((state_of(continued) == state_of(whole)));
    auto other = make<TestType>(1);
    other.integration.newton.tolerance = 1e-5;
    CHECK_THROWS_AS(restore(other, state), io_error);
}

}  // namespace implicit_restart_tests
