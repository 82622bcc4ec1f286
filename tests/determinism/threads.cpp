// quick: -O1
/// \file The same bits: for any number of threads, for any order of the particles in memory, in every build; and,
/// without FMA and contraction, on every machine.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/golden.hpp"

using namespace firn;

namespace {

template <class Run>
void check_threads(const Run& run, [[maybe_unused]] std::uint64_t stored) {
    const std::uint64_t one = run(1);
    for (const int threads : test_support::other_threads) CHECK(run(threads) == one);
#ifdef FIRN_TEST_PORTABLE
    CHECK(one == stored);
#endif
}

/// Random places in [0.1, 0.9)^D.
template <int D>
Samples<D> spray(std::uint64_t count) {
    Samples<D> samples;
    for (std::uint64_t i = 0; i < count; ++i) {
        samples.positions.emplace_back();
        for (int a = 0; a < D; ++a)
            samples.positions.back()[a] = 0.1 + 0.8 * scenes::noise(std::uint64_t(D) * i + std::uint64_t(a));
    }
    samples.volume = std::pow(1.0 / 64, D);
    return samples;
}

/// Dense matter, a mist of sparse blocks, and spray, in one another, every particle with a velocity of its own.
template <std::size_t I = 0, class Simulation>
void add_mixture(Simulation& simulation) {
    constexpr int D = Simulation::dimension;
    using V = Vec<double, D>;
    simulation.warn = {};
    simulation.most_steps_between_sorts = 8;
    const auto add = [&](const Samples<D>& samples) { simulation.template set<I>().add(samples, 1000); };
    add(sample_box<D>(V::filled(0.2), V::filled(D == 2 ? 0.45 : 0.36), {.spacing = 1.0 / 64}));
    add(sample_box<D>(V::filled(0.45), V::filled(0.8),
                      {.spacing = D == 2 ? 1.0 / 32 : 1.0 / 21, .pattern = Pattern::jittered, .jitter = 0.5}));
    add(spray<D>(D == 2 ? 100 : 250));
    auto& particles = simulation.template set<I>().edit_particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        Vec<double, D> v{};
        for (int a = 0; a < D; ++a)
            v[a] = 4 * scenes::noise(7 * std::uint64_t(particles.id(slot)) + std::uint64_t(a)) - 2;
        particles.set_velocity(slot, cast<typename Simulation::scalar_type>(v));
    }
}

/// Runs the mixture twice, once with its particles elsewhere in memory, at the start and on the way.
template <std::size_t I = 0, class Simulation>
void check_order(const Simulation& empty) {
    Simulation one = empty, other = empty;
    for (Simulation* simulation : {&one, &other}) add_mixture<I>(*simulation);
    for (const std::uint64_t seed : {1, 2}) {
        one.template set<I>().edit_particles();
        scenes::shuffle(other.template set<I>().edit_particles(), seed);
        const auto energy = [](const auto& simulation) { return simulation.template set<I>().totals().kinetic_energy; };
        CHECK(energy(one) == energy(other));
        if (seed == 1)
            for (const auto kind : {scenes::Kind::dense, scenes::Kind::cube, scenes::Kind::spray})
                CHECK(scenes::has(one.template set<I>().partition(), kind));
        for (int step = 0; step < 30; ++step) {
            one.step();
            other.step();
        }
        CHECK(scenes::hash(one.template set<I>().particles()) == scenes::hash(other.template set<I>().particles()));
        CHECK(one.time() == other.time());
    }
}

}  // namespace

TEST_CASE("The same bits wherever particles lie in memory, in every execution") {
    check_order(golden::simulation<3, float, Apic, MlsForce>(Coloured{2}));
    check_order(golden::simulation<2, double, Pic, WeightGradientForce>(Coloured{2}));
    check_order(golden::simulation<3, float, Apic, MlsForce>(FixedPoint<std::int32_t>{2}));
#ifndef FIRN_TEST_QUICK
    check_order(golden::simulation<3, float, Apic, MlsForce>(ColouredFixedPoint<std::int32_t>{1}));
#endif
}
#ifndef FIRN_TEST_QUICK
TEST_CASE("The same bits wherever particles of several materials lie in memory, on one thread, too") {
    const Domain<2> domain{{0.0, 0.0}, {1.0, 1.0}, 1.0 / 32};
    using Stiff = FixedCorotated<float>;
    using Soft = NeoHookean<float>;
    const Materials<Stiff, Soft> materials{Stiff::from_young_poisson(1e5, 0.3), Soft::from_young_poisson(1e4, 0.3)};
    Simulation<2, Materials<Stiff, Soft>, Apic, MlsForce, QuadraticBSpline, detail::Serial> simulation(domain,
                                                                                                       materials);
    add_mixture<0>(simulation);
    check_order<1>(simulation);
}
#endif

TEST_CASE("Coloured, 3D, float, APIC, MLS: the same bits for 1, 2, 3, 4 and 7 threads") {
    check_threads(golden::coloured_3d, golden::of_coloured_3d);
}
TEST_CASE("Coloured, 2D, double, PIC, weight gradients: the same bits for 1, 2, 3, 4 and 7 threads") {
    check_threads(golden::coloured_2d, golden::of_coloured_2d);
}
TEST_CASE("Fixed point, 3D, float, APIC, MLS: the same bits for 1, 2, 3, 4 and 7 threads") {
    check_threads(golden::fixed_point_3d, golden::of_fixed_point_3d);
}
TEST_CASE("Points that collide and keep distances, 3D, float, Verlet: the same bits for 1, 2, 3, 4 and 7 threads") {
    check_threads(golden::points_3d, golden::of_points_3d);
}
#ifndef FIRN_TEST_QUICK
TEST_CASE("Fixed point with 64 bits, 3D: the same bits for 1 and 7 threads") {
    const auto one = golden::hash_of_run<3, float, Apic, WeightGradientForce>(FixedPoint<std::int64_t>{1});
    CHECK(golden::hash_of_run<3, float, Apic, WeightGradientForce>(FixedPoint<std::int64_t>{7}) == one);
}
TEST_CASE("Coloured fixed point, 3D: the bits of the atomic one, for 1 and 7 threads") {
    const auto atomic = golden::fixed_point_3d(2);
    using Execution = ColouredFixedPoint<std::int32_t>;
    CHECK(golden::hash_of_run<3, float, Apic, MlsForce>(Execution{1}) == atomic);
    CHECK(golden::hash_of_run<3, float, Apic, MlsForce>(Execution{7}) == atomic);
}
#endif
