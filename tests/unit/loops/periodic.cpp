// part: memory
// Periodic domains: what leaves at one end comes in at the other, and nothing tells where the ends are.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include <firn/firn.hpp>

using namespace firn;

namespace {

using test_support::fewer_if_slow;
constexpr double spacing = fewer_if_slow(1.0 / 64, 1.0 / 32), time_step = fewer_if_slow(5e-4, 1e-3);
constexpr int steps = fewer_if_slow(400, 140);

/// A strip that is periodic along the first axis (and in 3D along the last).
template <int D>
Domain<D> strip(int cells) {
    Domain<D> domain{Vec<double, D>::filled(0.25), Vec<double, D>::filled(0.25 + cells / 32.0), 1.0 / 32};
    domain.periodic[0] = domain.periodic[D - 1] = true;
    if (D == 2) domain.periodic[1] = false;
    return domain;
}

template <int D, class Kernel, class Execution>
using Elastic = Simulation<D, FixedCorotated<float>, Apic, MlsForce, Kernel, Execution>;

/// A ball that flies along and falls to the floor, `back` [m] before a place from where it soon comes to the end.
template <int D, class Kernel, class Execution>
auto falling_ball(int cells, double back, const Execution& execution) {
    Elastic<D, Kernel, Execution> simulation(strip<D>(cells), FixedCorotated<float>::from_young_poisson(2e4, 0.3),
                                             execution);
    Vec<double, D> centre = Vec<double, D>::filled(0.25 + cells / 32.0 - 0.25 - back), velocity{};
    centre[1] = 0.5;
    velocity[0] = 3;
    velocity[1] = -1;
    if (D == 3) velocity[D - 1] = -2;
    simulation.add(sample_sphere<D>(centre, 0.14, {.spacing = spacing}), 1000, velocity);
    simulation.fixed_time_step = time_step;
    simulation.most_steps_between_sorts = 1;
    return simulation;
}

/// Places in their blocks, by id.
template <class Simulation>
std::vector<float> places(const Simulation& simulation) {
    constexpr int D = Simulation::dimension;
    const auto& particles = simulation.particles();
    std::vector<float> all(particles.size() * D);
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot))
            for (int a = 0; a < D; ++a) all[particles.id(slot) * D + std::size_t(a)] = particles.place(slot)[a];
    return all;
}

template <int D, class Kernel, class Execution>
void ends_are_nowhere(int cells, const Execution& execution) {
    const double half = cells / 64.0;
    auto one = falling_ball<D, Kernel>(cells, half, execution), other = falling_ball<D, Kernel>(cells, 0, execution);
    bool across = false;
    for (int step = 0; step < steps; ++step) {
        one.step();
        other.step();
        const auto sums = other.totals();
        across = across || sums.first_moment[0] / sums.mass < 0.25 + half;
    }
    REQUIRE(across);  // after 0.25 m of 0.6 m (sanitized 0.42 m)
    REQUIRE(places(one) == places(other));
    const auto sums = other.totals();
    REQUIRE(sums.momentum[0] == Approx(3 * sums.mass).epsilon(1e-4));  // hundreds of steps, a few ε each
    if (D == 3) REQUIRE(sums.momentum[D - 1] == Approx(-2 * sums.mass).epsilon(1e-4));
    REQUIRE(sums.momentum[1] > -1 * sums.mass);  // the floor has pushed
}

}  // namespace

TEST_CASE("a ball moves across the ends of a periodic domain as anywhere else: to the bit where sums are integers") {
    const FixedPoint<std::int64_t> integers{3};
    SECTION("2D") { ends_are_nowhere<2, QuadraticBSpline>(32, integers); }
#ifndef FIRN_TEST_QUICK
    SECTION("2D, cubic") { ends_are_nowhere<2, CubicBSpline>(96, integers); }
#endif
    SECTION("3D") { ends_are_nowhere<3, QuadraticBSpline>(32, integers); }
}

TEST_CASE(
    "across the ends of a periodic domain floating-point sums differ by rounding only, and not with the threads") {
    // In another order than elsewhere: particles are sorted from the lower end on.
    auto one = falling_ball<2, QuadraticBSpline>(32, 0.5, Coloured{1});
    auto other = falling_ball<2, QuadraticBSpline>(32, 0, Coloured{1});
    auto threads = falling_ball<2, QuadraticBSpline>(32, 0, Coloured{3});
    for (int step = 0; step < steps; ++step) {
        one.step();
        other.step();
        threads.step();
    }
    REQUIRE(places(other) == places(threads));
    const auto a = one.totals(), b = other.totals();
    REQUIRE(a.kinetic_energy == Approx(b.kinetic_energy).epsilon(1e-4));
    REQUIRE(a.elastic_energy == Approx(b.elastic_energy).epsilon(1e-2));
    REQUIRE(a.first_moment[1] == Approx(b.first_moment[1]).epsilon(1e-5));
}

TEST_CASE("periodic domains of a wrong size are refused, and foreign arrays in them") {
    REQUIRE_THROWS_AS(Simulation<2>(strip<2>(40)), parameter_error);
    Domain<2> uneven = strip<2>(32);
    uneven.upper[0] += 0.01;
    REQUIRE_THROWS_AS(Simulation<2>(uneven), parameter_error);
    auto cubic = falling_ball<2, CubicBSpline>(32, 0, Coloured{1});
    REQUIRE_THROWS_AS(cubic.step(), parameter_error);

    std::vector<float> numbers(64, 0.5F);
    ForeignParticles<float, 2> view{};
    view.position = StridedSpan<float>::vectors<2>(numbers.data());
    REQUIRE_THROWS_AS(partition_particles<QuadraticBSpline>(view, 4, strip<2>(32)), parameter_error);
}
