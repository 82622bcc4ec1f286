// quick: no
// sanitized: no
/// \file The narrowest and the widest kernel give the same bits for any number of threads. (The quadratic one:
/// determinism/.)
#include "support/by_definition.hpp"
#include "support/catch.hpp"
#include "support/effort.hpp"

using namespace firn;
using by_definition::Case;

TEMPLATE_TEST_CASE(
    "Steps with linear and cubic weights have the same bits for 1, 2, 3, 4 and 7 threads, and stay stable", "",
    (Case<float, 3, Apic, WeightGradientForce, Linear>), (Case<double, 2, Apic, WeightGradientForce, Linear>),
    (Case<float, 3, Apic, MlsForce, CubicBSpline>), (Case<double, 2, Pic, MlsForce, CubicBSpline>)) {
    using S = typename TestType::S;
    constexpr int D = TestType::D;
    const auto run = [](int threads) {
        Domain<D> domain;
        domain.cell_size = D == 2 ? 1.0 / 32 : 1.0 / 16;
        using Simulated = Simulation<D, FixedCorotated<S>, typename TestType::Transfer, typename TestType::Force,
                                     typename TestType::Kernel>;
        Simulated simulation(domain, FixedCorotated<S>::from_young_poisson(S(1e5), S(0.3)), Coloured{threads});
        scenes::add_two_blocks<D>(simulation, 0.3, domain.cell_size / 2);
        // Spray: cubes of sparse blocks. (A lone particle with linear weights is not stable at any step.)
        if (has_inertia<typename TestType::Kernel>)
            simulation.add(sample_box<D>(Vec<double, D>::filled(0.05), Vec<double, D>::filled(0.95), {.spacing = 0.15}),
                           1000);
        for (int i = 0; i < test_support::fewer_if_slow(60, 20); ++i) simulation.step();
        CHECK(simulation.report().signal_speed < 30);  // 12 m/s of waves, and what fell
        return scenes::hash(simulation);
    };
    const std::uint64_t one = run(1);
    for (const int threads : test_support::other_threads) CHECK(run(threads) == one);
}
