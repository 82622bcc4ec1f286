// Several materials on one grid: the sums that nodes get, the same bits for any number of threads, states.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/temporary_folder.hpp"
#include <firn/firn.hpp>
#include <firn/io/states.hpp>

using namespace firn;

namespace materials_state_tests {
namespace {

template <int D>
Samples<D> ball(double x, double y) {
    Vec<double, D> centre = Vec<double, D>::filled(0.5);
    centre[0] = x;
    centre[1] = y;
    return sample_sphere<D>(centre, 0.15, {.spacing = 1.0 / 40});
}

template <int D>
Domain<D> box() {
    return {Vec<double, D>::zero(), Vec<double, D>::filled(1.0), 1.0 / 20};
}

/// Position and velocity of a set's particles, by id.
template <std::size_t I, class Simulation>
std::vector<typename Simulation::scalar_type> numbers(const Simulation& simulation) {
    constexpr int D = Simulation::dimension;
    const auto& particles = simulation.template set<I>().particles();
    std::vector<typename Simulation::scalar_type> all(2 * D * particles.size());
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        for (int a = 0; a < D; ++a) {
            all[2 * D * particles.id(slot) + std::size_t(a)] = particles.position(slot)[a];
            all[2 * D * particles.id(slot) + std::size_t(D + a)] = particles.velocity(slot)[a];
        }
    }
    return all;
}

template <int D>
using Elastic = Simulation<D, FixedCorotated<float>, Apic, MlsForce, QuadraticBSpline, FixedPoint<std::int64_t>>;
template <int D>
using TwoElastic = Simulation<D, Materials<FixedCorotated<float>, FixedCorotated<float>>, Apic, MlsForce,
                              QuadraticBSpline, FixedPoint<std::int64_t>>;

template <int D>
void two_sets_are_one() {
    const auto stuff = FixedCorotated<float>::from_young_poisson(1e4, 0.3);
    Elastic<D> one(box<D>(), stuff);
    TwoElastic<D> two(box<D>(), {stuff, stuff});
    const auto left = ball<D>(0.38, 0.5), right = ball<D>(0.62, 0.55);
    one.add(left, 1000, Vec<double, D>::filled(0.8));
    one.add(right, 1000, Vec<double, D>::filled(-0.8));
    two.template set<0>().add(left, 1000, Vec<double, D>::filled(0.8));
    two.template set<1>().add(right, 1000, Vec<double, D>::filled(-0.8));
    // Sorting rounds the places of particles that are now counted from another block: it has to come at the same steps.
    one.most_steps_between_sorts = two.most_steps_between_sorts = 1;
    REQUIRE(one.stable_time_step() == two.stable_time_step());
    for (int step = 0; step < test_support::fewer_if_slow(60, 12); ++step) {
        one.step();
        two.step();
    }
    REQUIRE(one.time() == two.time());
    auto parts = numbers<0>(two);
    const auto rest = numbers<1>(two);
    parts.insert(parts.end(), rest.begin(), rest.end());
    REQUIRE(parts == numbers<0>(one));
}

using Mixture = Simulation<2, Materials<FixedCorotated<double>, NeoHookean<double>>>;

Mixture mixture(int threads) {
    Mixture simulation(box<2>(), {FixedCorotated<double>::from_young_poisson(1e4, 0.3), NeoHookean<double>{3e3, 4e3}},
                       {threads});
    simulation.set<FixedCorotated<double>>().add(ball<2>(0.35, 0.5), 1000, {1.5, 0.0});
    simulation.set<NeoHookean<double>>().add(ball<2>(0.66, 0.52), 500, {-1.0, 0.5});
    simulation.fixed_time_step = 1e-3;
    simulation.gravity = {0.0, 0.0};
    return simulation;
}

template <std::size_t I>
Vec<double, 2> momentum(const Mixture& simulation) {
    const auto& particles = simulation.set<I>().particles();
    Vec<double, 2> sum{};
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) sum += particles.velocity(slot) * particles.mass(slot);
    return sum;
}

}  // namespace

TEST_CASE("two sets of one material move as one set does, to the bit, where sums are integers") {
    SECTION("2D") { two_sets_are_one<2>(); }
    SECTION("3D") { two_sets_are_one<3>(); }
}

TEST_CASE("two materials push each other: momentum passes from one to the other, and none is lost") {
    Mixture simulation = mixture(1);
    const Vec<double, 2> first = momentum<0>(simulation), second = momentum<1>(simulation);
    for (int step = 0; step < 150; ++step) simulation.step();
    const Vec<double, 2> passed = momentum<0>(simulation) - first;
    REQUIRE(passed[0] < -0.2 * first[0]);  // it met the other
    const Vec<double, 2> lost = passed + momentum<1>(simulation) - second;
    for (int a = 0; a < 2; ++a) REQUIRE(std::abs(lost[a]) < 1e-12 * first[0]);  // 150 steps of rounding
}

TEST_CASE("several materials: the same bits for any number of threads") {
    Mixture one = mixture(1);
    for (int step = 0; step < test_support::fewer_if_slow(100, 20); ++step) one.step();
    for (const int threads : test_support::other_threads) {
        Mixture many = mixture(threads);
        for (int step = 0; step < test_support::fewer_if_slow(100, 20); ++step) many.step();
        REQUIRE(numbers<0>(many) == numbers<0>(one));
        REQUIRE(numbers<1>(many) == numbers<1>(one));
    }
}

TEST_CASE("a material of which there are no particles yet changes nothing") {
    Mixture both(box<2>(), {FixedCorotated<double>::from_young_poisson(1e4, 0.3), {}});
    Simulation<2, FixedCorotated<double>> alone(box<2>(), FixedCorotated<double>::from_young_poisson(1e4, 0.3));
    both.set<0>().add(ball<2>(0.35, 0.5), 1000, {1.5, 0.0});
    alone.add(ball<2>(0.35, 0.5), 1000, {1.5, 0.0});
    for (int step = 0; step < 20; ++step) {
        both.step();
        alone.step();
    }
    REQUIRE(numbers<0>(both) == numbers<0>(alone));
}

TEST_CASE("a run of several materials goes on to the bit from the states of all of them") {
    const TemporaryFolder folder;
    Mixture whole = mixture(2);
    for (int step = 0; step < 40; ++step) whole.step();
    write_state(folder.path() / "elastic.hdf", state_of(whole.set<0>()));
    write_state(folder.path() / "neo_hookean.hdf", state_of(whole.set<NeoHookean<double>>()));
    for (int step = 0; step < 40; ++step) whole.step();

    Mixture continued(box<2>(), {whole.set<0>().material(), whole.set<1>().material()}, {3});
    continued.fixed_time_step = whole.fixed_time_step;
    continued.gravity = whole.gravity;
    restore(continued.set<0>(), read_state<double>(folder.path() / "elastic.hdf"));
    restore(continued.set<NeoHookean<double>>(), read_state<double>(folder.path() / "neo_hookean.hdf"));
    REQUIRE_THROWS_AS(restore(continued.set<0>(), read_state<double>(folder.path() / "neo_hookean.hdf")), io_error);
    for (int step = 0; step < 40; ++step) continued.step();
    REQUIRE(numbers<0>(continued) == numbers<0>(whole));
    REQUIRE(numbers<1>(continued) == numbers<1>(whole));
}

}  // namespace materials_state_tests
