// release: -O0
/// \file A run that blows up stops in the step in which a number first is not finite, names the particle and the
/// likely cause, and refuses to go on or to be written.
#include "support/catch.hpp"
#include "support/message.hpp"
#include "support/not_finite.hpp"
#include <firn/firn.hpp>
#include <firn/io/restart.hpp>

using namespace firn;
using test_support::holds;
using test_support::infinity;
using test_support::message;
using test_support::not_a_number;

namespace {

template <int D, class S, class Execution = Coloured>
using Elastic = Simulation<D, FixedCorotated<S>, Apic, MlsForce, QuadraticBSpline, Execution>;

/// A cube in free fall, the same for any dimension; strained by 5 % so that a step that is too large shakes it at once.
template <class Simulation>
Simulation cube(int threads) {
    constexpr int D = Simulation::dimension;
    using S = typename Simulation::scalar_type;
    Simulation simulation({Vec<double, D>::zero(), Vec<double, D>::filled(1), 1.0 / 16},
                          FixedCorotated<S>::from_young_poisson(1e5, 0.3), {threads});
    simulation.warn = [](const std::string&) {};
    const Body body = simulation.add(
        sample_box<D>(Vec<double, D>::filled(0.35), Vec<double, D>::filled(0.65), {.spacing = 1.0 / 32}), 1000);
    simulation.template set<0>().set_states(body, [](const auto&, auto& state) { state.F = state.F * S(1.05); });
    return simulation;
}

/// Steps until it throws. \return the steps that were done, and what was said
template <class Simulation, class Step>
std::pair<std::uint64_t, std::string> blown_up(Simulation& simulation, const Step& step) {
    for (int i = 0; i < 1000; ++i) {
        try {
            step(simulation);
        } catch (const particle_error& failure) {
            return {simulation.steps(), failure.what()};
        }
        const auto& particles = simulation.template set<0>().particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            REQUIRE(detail::is_finite(particles.exact_position(slot)));
            REQUIRE(detail::is_finite(particles.velocity(slot)));
            REQUIRE(std::isfinite(squared_norm(particles.state(slot).F)));
            REQUIRE(std::isfinite(squared_norm(particles.stress(slot))));
        }
    }
    return {simulation.steps(), "(nothing thrown)"};
}

/// What was said, the same for one thread and three; and the simulation is of no more use.
template <class Simulation, class Prepare, class Step>
std::string said_of(const Prepare& prepare, const Step& step) {
    std::pair<std::uint64_t, std::string> said[2];
    for (const int threads : {1, 3}) {
        Simulation simulation = cube<Simulation>(threads);
        prepare(simulation);
        said[threads / 2] = blown_up(simulation, step);
        CHECK_THROWS_AS(state_of(simulation), particle_error);
        CHECK_THROWS_AS(simulation.step(), particle_error);
        CHECK(holds(said[threads / 2].second, sentence("step ", simulation.steps())));
    }
    CHECK(said[0] == said[1]);
    CAPTURE(said[0].second);
    CHECK(holds(said[0].second, "article"));
    return said[0].second;
}

const auto nothing = [](auto&) {};
const auto plain_step = [](auto& simulation) { simulation.step(); };

}  // namespace

TEMPLATE_TEST_CASE("steps of 50 times the bound stop at the first number that is not finite, with the ratio", "",
                   (Elastic<2, double>), (Elastic<3, float>)) {
    const std::string said = said_of<TestType>(
        [](auto& simulation) { simulation.fixed_time_step = 50 * simulation.stable_time_step(); }, plain_step);
    CAPTURE(said);
    CHECK(holds(said, " particles "));
    CHECK(holds(said, "particle "));
    CHECK(holds(said, "m with velocity ("));
    CHECK(holds(said, "J = "));
    CHECK(holds(said, " times the bound of the time step"));
    CHECK(holds(said, "fixed_time_step"));
}

TEMPLATE_TEST_CASE("an acceleration that is not a number somewhere is named, in the step that it was given to", "",
                   (Elastic<2, double>), (Elastic<3, float>)) {
    // Above 0.5 m; nodes there are reached by particles from the second row below on.
    const auto field = [](const auto& x) {
        using P = std::remove_cvref_t<decltype(x[0])>;
        auto a = x * P(0);
        a[1] = select(x[1] > P(0.5), P(not_a_number), P(-9.81));
        return a;
    };
    const std::string said = said_of<TestType>(nothing, [&](auto& simulation) { simulation.step(field); });
    CAPTURE(said);
    CHECK(holds(said, "At step 0,"));
    CHECK(holds(said, "not finite: its"));
    CHECK(holds(said, "The acceleration at ("));
    CHECK(holds(said, "look at the field"));
    // The lowest id: they were added row by row along x, and 0.5 − 1.5/16 = 0.406 is where the kernel's reach ends.
    TestType simulation = cube<TestType>(1);
    std::uint32_t lowest = no_particle;
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot) && particles.exact_position(slot)[1] > 0.5 + 1.0 / 16 - 1.5 / 16)
            lowest = std::min(lowest, particles.id(slot));
    CHECK(holds(said, sentence("The first is particle ", lowest, " at (")));
}

TEMPLATE_TEST_CASE("gravity, or a field's parameter, that is not finite is refused by name, and nothing is spoiled", "",
                   (Elastic<2, double>), (Elastic<3, float>)) {
    using S = typename TestType::scalar_type;
    TestType simulation = cube<TestType>(1);
    simulation.gravity[1] = not_a_number;
    CHECK(holds(message<parameter_error>([&] { simulation.step(); }), "gravity"));
    simulation.gravity[1] = -9.81;
    Attraction<S, TestType::dimension> pull;
    pull.radius = S(infinity);
    CHECK(holds(message<parameter_error>([&] { simulation.step(pull); }), "radius"));
    CHECK(simulation.steps() == 0);
    CHECK_NOTHROW(simulation.step());
}

TEMPLATE_TEST_CASE("a load that is not finite is named before it reaches the grid", "", (Elastic<2, double>),
                   (Elastic<3, float>), (Elastic<3, float, FixedPoint<>>)) {
    constexpr int D = TestType::dimension;
    const std::string said = said_of<TestType>(
        [](auto& simulation) {
            simulation.template set<0>().add_load(simulation.bodies()[0], [](const Vec<double, D>&, double time) {
                return Vec<double, D>::filled(time > 0 ? infinity : 0.0);
            });
        },
        plain_step);
    CAPTURE(said);
    CHECK(holds(said, "At step 1,"));
    CHECK(holds(said, "a load gives"));
    CHECK(holds(said, "the first is particle 0."));
}

TEMPLATE_TEST_CASE("a state or a velocity set by hand that is not finite is named before any step", "",
                   (Elastic<2, double>), (Elastic<3, float>), (Elastic<3, float, FixedPoint<>>)) {
    using S = typename TestType::scalar_type;
    const std::string of_state = said_of<TestType>(
        [](auto& simulation) {
            std::uint32_t seen = 0;
            simulation.step();
            simulation.template set<0>().set_states(simulation.bodies()[0], [&](const auto&, auto& state) {
                if (++seen > 40) state.F(0, 1) = S(not_a_number);
            });
        },
        plain_step);
    CAPTURE(of_state);
    CHECK(holds(of_state, "Before step 1,"));
    CHECK(holds(of_state, "its deformation gradient"));
    CHECK(holds(of_state, "set_states()"));

    const std::string of_velocity = said_of<TestType>(
        [](auto& simulation) {
            auto& particles = simulation.template set<0>().edit_particles();
            for (std::size_t slot = 0; slot < particles.slots(); ++slot)
                if (particles.is_particle(slot) && (particles.id(slot) == 7 || particles.id(slot) == 60)) {
                    auto v = particles.velocity(slot);
                    v[1] = S(infinity);
                    particles.set_velocity(slot, v);
                }
        },
        plain_step);
    CAPTURE(of_velocity);
    CHECK(holds(of_velocity, "Before step 0,"));
    CHECK(holds(of_velocity, "2 of "));
    CHECK(holds(of_velocity, "particle 7 at ("));
    CHECK(holds(of_velocity, "its velocity; further ids: 60."));
}

TEST_CASE("sums in integers refuse what is not finite before anything is converted", "") {
    using Fixed = Elastic<3, float, FixedPoint<>>;
    const auto step = [](Fixed& simulation) { simulation.fixed_time_step = 1e38, simulation.step(); };
    Fixed simulation = cube<Fixed>(1);
    const std::string said = message<overflow_error>([&] { step(simulation); });
    CAPTURE(said);
    CHECK(holds(said, "At step 0,"));
    CHECK(holds(said, " times the bound"));
    CHECK(holds(said, "not finite"));
}

TEST_CASE("sums in integers refuse what is so light that float has no scale for it", "") {
    // Against floats, of the same particles: 5e-8 m apart where they are not refused.
    using Fixed = Elastic<3, float, FixedPoint<>>;
    using Float = Elastic<3, float, Coloured>;
    const auto end = [](auto simulation, double of_particle, double speed) {
        const double spacing = 1.0 / 32, density = of_particle / std::pow(spacing, 3);
        decltype(simulation) light(simulation.domain(), FixedCorotated<float>::from_young_poisson(100 * density, 0.3));
        light.add(sample_box<3>({0.4, 0.4, 0.4}, {0.6, 0.6, 0.6}, {.spacing = spacing}), density, {speed, 0.0, 0.0});
        light.fixed_time_step = 1e-3;
        for (int i = 0; i < 20; ++i) light.step();
        return light.totals();
    };
    for (const double kilograms : {1e-3, 1e-20, 1e-26, 1e-28, 1e-31, 1e-34})
        for (const double speed : {1.0, 1e-5, 1e-15, 0.0}) {
            CAPTURE(kilograms, speed);
            const auto right = end(cube<Float>(1), kilograms, speed);
            std::string said;
            try {
                const auto found = end(cube<Fixed>(1), kilograms, speed);
                CHECK(norm(found.first_moment * (1 / found.mass) - right.first_moment * (1 / right.mass)) <= 1e-6);
                CHECK(kilograms > 1e-30);
            } catch (const overflow_error& failure) {
                said = failure.what();
                CAPTURE(said);
                CHECK(holds(said, "are too light for fixed-point sums in float"));
                CHECK(holds(said, "Use double"));
                CHECK(kilograms < 1e-19);
            }
            if (kilograms == 1e-34) CHECK(!said.empty());
        }
    const auto in_double = [&] {
        Elastic<3, double, FixedPoint<>> light({Vec<double, 3>::zero(), Vec<double, 3>::filled(1), 1.0 / 16});
        light.add(sample_box<3>({0.4, 0.4, 0.4}, {0.6, 0.6, 0.6}, {.spacing = 1.0 / 32}), 1e-28);
        light.fixed_time_step = 1e-20;
        light.warn = nullptr;
        light.step();
    };
    CHECK_NOTHROW(in_double());
}

TEMPLATE_TEST_CASE("particles that leave the domain in a step are counted and listed", "", (Elastic<2, double>),
                   (Elastic<3, float>)) {
    using S = typename TestType::scalar_type;
    constexpr int D = TestType::dimension;
    for (const bool periodic : {false, true}) {
        const std::string said = said_of<TestType>(
            [&](TestType& simulation) {
                Domain<D> domain = simulation.domain();
                domain.periodic[0] = periodic;
                TestType open(domain, simulation.material(), simulation.execution);
                for (auto* faces : {&open.boundary.at_lower, &open.boundary.at_upper})
                    for (Wall& wall : *faces) wall.contact = Contact::none;
                open.warn = simulation.warn;
                open.add(
                    sample_box<D>(Vec<double, D>::filled(0.35), Vec<double, D>::filled(0.65), {.spacing = 1.0 / 32}),
                    1000);
                Vec<double, D> fast{};
                fast[0] = 1e9;
                const Body thrown =
                    open.add({{Vec<double, D>::filled(0.9), Vec<double, D>::filled(0.91)}, 1e-5}, 1000, fast);
                REQUIRE(thrown.count == 2);
                open.fixed_time_step = 1e-4;
                simulation = std::move(open);
            },
            plain_step);
        CAPTURE(said);
        CHECK(holds(said, "At step 0,"));
        CHECK(holds(said, "2 of "));
        CHECK(holds(said, "it has left the domain"));
        CHECK(holds(said, sentence("further ids: ", TestType::dimension == 2 ? 101 : 1001)));
        static_cast<void>(sizeof(S));
    }
}

TEST_CASE("with several materials the one with the wrong particle is named; a restored run goes on") {
    using Both = Simulation<2, Materials<FixedCorotated<double>, NeoHookean<double>>>;
    Both simulation({{0, 0}, {1, 1}, 1.0 / 16});
    simulation.warn = [](const std::string&) {};
    simulation.set<0>().add(sample_box<2>({0.2, 0.3}, {0.4, 0.5}, {.spacing = 1.0 / 32}), 1000);
    simulation.set<1>().add(sample_box<2>({0.6, 0.3}, {0.8, 0.5}, {.spacing = 1.0 / 32}), 1000, {{30, 0}});
    simulation.step();
    const auto first = state_of(simulation.set<0>()), second = state_of(simulation.set<1>());
    simulation.fixed_time_step = 20 * simulation.stable_time_step();
    const std::string said = blown_up(simulation, plain_step).second;
    CAPTURE(said);
    CHECK(holds(said, "of the material neo_hookean, "));
    CHECK_THROWS_AS(state_of(simulation.set<0>()), particle_error);
    simulation.fixed_time_step = 0;
    restore(simulation.set<0>(), first);
    CHECK_THROWS_AS(simulation.step(), particle_error);  // the other material is of no use yet
    restore(simulation.set<1>(), second);
    CHECK_NOTHROW(simulation.step());
    CHECK(simulation.steps() == 2);
}
