// sanitized: -O1
/// \file The simulation as a user meets it: what it promises about motion, walls, time steps and wrong input.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/scenes.hpp"

using namespace firn;

namespace {

template <int D>
Domain<D> unit_box(double h) {
    return {Vec<double, D>::zero(), Vec<double, D>::filled(1.0), h};
}

template <class Simulation, class F>
void for_particles(const Simulation& simulation, const F& f) {
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) f(slot);
}

}  // namespace

TEMPLATE_TEST_CASE("Free fall is that of symplectic Euler, y0 + v0 t − ½ g t (t + dt), to rounding", "", float,
                   double) {
    using S = TestType;
    Simulation<3, FixedCorotated<S>> simulation(unit_box<3>(1.0 / 32), FixedCorotated<S>::from_young_poisson(1e3, 0.3));
    simulation.fixed_time_step = 4e-4;
    simulation.add(sample_box<3>({0.45, 0.6, 0.45}, {0.55, 0.7, 0.55}, {.spacing = 1.0 / 64}), 1.0, {0.1, 0.5, -0.2});
    std::vector<double> before(simulation.particles().size());
    for_particles(simulation, [&](std::size_t slot) {
        before[simulation.particles().id(slot)] = double(simulation.particles().position(slot)[1]);
    });
    const int steps = test_support::fewer_if_slow(500, 100);
    for (int i = 0; i < steps; ++i) simulation.step();
    const double t = steps * 4e-4, expected = 0.5 * t - 0.5 * 9.81 * t * (t + 4e-4);
    double worst = 0;
    for_particles(simulation, [&](std::size_t slot) {
        const auto x = simulation.particles().position(slot);
        worst = std::max(worst, std::abs(double(x[1]) - before[simulation.particles().id(slot)] - expected));
    });
    // As many sums of a position near 0.5 and a velocity near 2, each rounded to half a unit in the last place.
    CHECK(worst < steps * 0.5 * (sizeof(S) == 4 ? 0x1p-24 : 0x1p-53));
    CHECK(simulation.time() == Approx(t).epsilon(1e-12));
    CHECK(simulation.steps() == std::uint64_t(steps));
}

TEST_CASE("Particles are sorted every so many steps that the user allows, and once before the first") {
    Simulation<2> simulation(unit_box<2>(1.0 / 64), FixedCorotated<float>::from_young_poisson(1e3, 0.3));
    simulation.add(sample_box<2>({0.4, 0.4}, {0.6, 0.6}, {.spacing = 1.0 / 128}), 1.0);
    simulation.most_steps_between_sorts = 3;
    std::vector<std::uint64_t> sorted_before;                          // numbers of steps
    const std::uint32_t* order = simulation.partition().order.data();  // a new array at each sort
    for (std::uint64_t step = 0; step < 8; ++step) {
        simulation.step();
        if (simulation.partition().order.data() != order) sorted_before.push_back(step);
        order = simulation.partition().order.data();
    }
    CHECK(sorted_before == std::vector<std::uint64_t>{3, 6});

    simulation.edit_particles();  // sorted as they are edited, but due again with the 9th step
    order = simulation.partition().order.data();
    simulation.step();
    CHECK(simulation.partition().order.data() == order);
    simulation.step();
    CHECK(simulation.partition().order.data() != order);
}

TEST_CASE("No particle drifts farther from the block it was sorted into than the colours allow") {
    Simulation<2> simulation(unit_box<2>(1.0 / 64), FixedCorotated<float>::from_young_poisson(1e5, 0.3));
    scenes::add_two_blocks<2>(simulation, 0.3, test_support::fewer_if_slow(1.0 / 128, 1.0 / 48));
    std::size_t beyond_block = 0, sorted = 0;
    aligned_vector<std::uint32_t> order;
    for (int i = 0; i < 300; ++i) {
        simulation.step();
        sorted += std::size_t(simulation.partition().order != order);
        order = simulation.partition().order;
        if (simulation.report().sort_needed) continue;  // the next step begins with it
        for (const auto& range : simulation.partition().ranges)
            for (std::size_t slot = range.first_slot; slot < range.first_slot + range.particles; ++slot)
                for (int a = 0; a < 2; ++a) {
                    const double cells = double(simulation.particles().position(slot)[a]) * 64;
                    const int from_block = int(std::floor(cells - 0.5)) - block_size * range.block[std::size_t(a)];
                    REQUIRE(from_block >= -allowed_drift);
                    REQUIRE(from_block < block_size + allowed_drift);
                    beyond_block += std::size_t(from_block < 0 || from_block >= block_size);
                }
    }
    CHECK(beyond_block > 0);  // they drift,
    CHECK(sorted > 3);        // and are sorted again,
    CHECK(sorted < 100);      // but not at every step
}

TEST_CASE("A force field acts where it is, and replaces gravity") {
    Simulation<2, FixedCorotated<double>> simulation(unit_box<2>(1.0 / 32),
                                                     FixedCorotated<double>::from_young_poisson(1e3, 0.3));
    simulation.fixed_time_step = 4e-4;
    simulation.add(sample_box<2>({0.2, 0.4}, {0.3, 0.5}, {.spacing = 1.0 / 64}), 1.0);
    const Body right = simulation.add(sample_box<2>({0.7, 0.4}, {0.8, 0.5}, {.spacing = 1.0 / 64}), 1.0);
    const auto field = [](const auto& x) {
        using P = std::remove_cvref_t<decltype(x[0])>;
        return Vec<P, 2>{select(x[0] < P(0.5), P(1), P(-2)), P(0)};
    };
    for (int i = 0; i < 125; ++i) simulation.step(field);
    for_particles(simulation, [&](std::size_t slot) {
        const auto v = simulation.particles().velocity(slot);
        CHECK(v[0] == Approx(simulation.particles().id(slot) < right.first ? 0.05 : -0.1).epsilon(1e-9));
        CHECK(std::abs(v[1]) < 1e-12);
    });
}

TEST_CASE("advance ends at the time that was asked for") {
    Simulation<2> simulation(unit_box<2>(1.0 / 32), FixedCorotated<float>::from_young_poisson(1e3, 0.3));
    simulation.add(sample_box<2>({0.4, 0.4}, {0.6, 0.6}, {.spacing = 1.0 / 64}), 1.0);
    simulation.advance(0.0123);
    CHECK(simulation.time() == 0.0123);
    const auto steps = simulation.steps();
    simulation.advance(0.0);
    CHECK(simulation.steps() == steps);
    REQUIRE_THROWS_AS(simulation.advance(-1.0), parameter_error);
    REQUIRE_THROWS_AS(simulation.advance(std::nan("")), parameter_error);
}

TEST_CASE("Particles stay in the box, whatever its walls and however they are thrown") {
    const std::vector all{Contact::separate, Contact::slip, Contact::stick};
    for (const Contact contact : test_support::fewer_if_quick(all, {Contact::separate})) {
        Simulation<2> simulation({{-0.3, 0.1}, {0.43, 0.77}, 0.03},
                                 FixedCorotated<float>::from_young_poisson(1e4, 0.3));
        simulation.boundary = Walls<float, 2>::all({-0.3f, 0.1f}, {0.43f, 0.77f}, {contact, 0.2});
        simulation.add(sample_sphere<2>({0.0, 0.4}, 0.15, {.spacing = 0.015}), 10.0, {6.0, 4.0});
        simulation.advance(0.3);
        float lowest = 1, highest = 0;
        for_particles(simulation, [&](std::size_t slot) {
            const auto x = simulation.particles().position(slot);
            CHECK((x[0] >= -0.3f && x[0] <= 0.43f && x[1] >= 0.1f && x[1] <= 0.77f));
            lowest = std::min(lowest, x[1]);
            highest = std::max(highest, x[1]);
        });
        CHECK(highest - lowest > 0.1f);  // still a body, not crushed into a corner
    }
}

TEST_CASE("A body at rest on a wall with friction stays; without, it slides down the tilted gravity") {
    for (const double friction : {0.0, 0.9}) {
        Simulation<2, FixedCorotated<double>> simulation(unit_box<2>(1.0 / 32),
                                                         FixedCorotated<double>::from_young_poisson(1e5, 0.3));
        simulation.boundary = Walls<double, 2>::all({0.0, 0.0}, {1.0, 1.0}, {Contact::separate, friction});
        simulation.add(sample_box<2>({0.2, 0.0}, {0.5, 0.15}, {.spacing = 1.0 / 64}), 100.0);
        simulation.gravity = {3.0, -9.0};  // slides for μ < 1/3
        simulation.advance(0.2);
        double velocity = 0;
        for_particles(simulation, [&](std::size_t slot) { velocity += simulation.particles().velocity(slot)[0]; });
        velocity /= double(simulation.particles().size());
        if (friction == 0)
            CHECK(velocity == Approx(3.0 * 0.2).epsilon(1e-3));
        else
            CHECK(std::abs(velocity) < 0.02);
    }
}

TEST_CASE("The bound of the time step is stable, and three times it is not") {
    const auto fastest_after = [](auto&& set_time_step) {
        Simulation<3> simulation(unit_box<3>(1.0 / 16), FixedCorotated<float>::from_young_poisson(1e4, 0.4));
        simulation.warn = [](const std::string&) {};
        scenes::add_two_blocks<3>(simulation, 0.25, 1.0 / 32);
        float fastest = 0;
        for (int i = 0; i < test_support::fewer_if_slow(400, 150); ++i) {
            set_time_step(simulation);
            simulation.step();
        }
        for_particles(simulation, [&](std::size_t slot) {
            fastest = std::max(fastest, norm(simulation.particles().velocity(slot)));
        });
        return fastest;
    };
    // The blocks meet at ±1.6 m/s and nothing feeds them.
    CHECK(fastest_after([](auto& simulation) { simulation.fixed_time_step = simulation.stable_time_step(); }) < 4.0f);
    const auto thrice_the_first_bound = [](auto& simulation) {
        if (simulation.steps() == 0) simulation.fixed_time_step = 3 * simulation.stable_time_step();
    };
    REQUIRE_THROWS_AS(fastest_after(thrice_the_first_bound), particle_error);
}

TEST_CASE("A fixed time step above the bound is warned of, with the factor") {
    Simulation<2> simulation(unit_box<2>(1.0 / 16), FixedCorotated<float>::from_young_poisson(1e4, 0.3));
    simulation.add(sample_box<2>({0.4, 0.4}, {0.6, 0.6}, {.spacing = 1.0 / 32}), 1.0);
    std::vector<std::string> warnings;
    simulation.warn = [&](const std::string& text) { warnings.push_back(text); };
    simulation.fixed_time_step = 0.9 * simulation.stable_time_step();
    simulation.step();
    CHECK(warnings.empty());
    simulation.fixed_time_step = 1.5 * simulation.stable_time_step();
    simulation.step();
    REQUIRE(warnings.size() == 1);
    CHECK(warnings[0].find("is 1.5") != std::string::npos);
}

TEST_CASE("A run that blows up stops with the particle, its place and the likely cause") {
    Simulation<3> simulation(unit_box<3>(1.0 / 16), FixedCorotated<float>::from_young_poisson(1e4, 0.3));
    simulation.warn = [](const std::string&) {};
    scenes::add_two_blocks<3>(simulation, 0.25, 1.0 / 32);
    simulation.fixed_time_step = 100 * simulation.stable_time_step();
    const auto run = [&] {
        for (int i = 0; i < 200; ++i) simulation.step();
    };
    try {
        run();
        FAIL("nothing was thrown");
    } catch (const particle_error& error) {
        const std::string text = error.what();
        CAPTURE(text);
        CHECK(text.find("particle 0 at (") != std::string::npos);
        CHECK(text.find("velocity (") != std::string::npos);
        CHECK(text.find("bound of the time step") != std::string::npos);
    }
    REQUIRE_THROWS_AS(simulation.step(), particle_error);  // and does not go on from what is broken
}

TEST_CASE("Bodies that cannot be simulated are refused, and nothing is added") {
    Simulation<2> simulation(unit_box<2>(1.0 / 16));
    const auto box = sample_box<2>({0.4, 0.4}, {0.6, 0.6}, {.spacing = 1.0 / 32});
    const double nan = std::nan("");
    REQUIRE_THROWS_AS(simulation.add(box, 0.0), parameter_error);
    REQUIRE_THROWS_AS(simulation.add(box, -1.0), parameter_error);
    REQUIRE_THROWS_AS(simulation.add(box, nan), parameter_error);
    REQUIRE_THROWS_AS(simulation.add(box, 1.0, {nan, 0.0}), parameter_error);
    REQUIRE_THROWS_AS(simulation.add(box, 1e-45), parameter_error);  // no mass is left of it in float
    REQUIRE_THROWS_AS(simulation.add(Samples<2>{{}, 1.0}, 1.0), particle_error);
    REQUIRE_THROWS_AS(simulation.add(Samples<2>{{{0.5, 0.5}}, 0.0}, 1.0), parameter_error);
    REQUIRE_THROWS_AS(simulation.add(Samples<2>{{{0.5, 0.5}, {0.5, 1.5}}, 1.0}, 1.0), particle_error);
    REQUIRE_THROWS_AS(simulation.add(Samples<2>{{{0.5, nan}}, 1.0}, 1.0), particle_error);
    CHECK(simulation.particles().size() == 0);
    REQUIRE_THROWS_AS(simulation.step(), particle_error);  // there are none
    simulation.add(box, 1.0);
    simulation.fixed_time_step = -1e-4;
    REQUIRE_THROWS_AS(simulation.step(), parameter_error);
    simulation.fixed_time_step = 0;
    CHECK_NOTHROW(simulation.step());
    simulation.edit_particles().set_position(0, {std::numeric_limits<float>::quiet_NaN(), 0.5f});
    REQUIRE_THROWS_AS(simulation.step(), particle_error);
}

TEST_CASE("The three executions agree on a collision", "[slow]") {
    const auto run = [](auto execution) {
        Simulation<3, FixedCorotated<double>, Apic, MlsForce, QuadraticBSpline, decltype(execution)> simulation(
            unit_box<3>(1.0 / 16), FixedCorotated<double>::from_young_poisson(1e5, 0.3), execution);
        simulation.fixed_time_step = 4e-4;
        scenes::add_two_blocks<3>(simulation, 0.25, 1.0 / 32);
        for (int i = 0; i < test_support::fewer_if_slow(250, 120); ++i) simulation.step();  // they touch after 110
        std::vector<Vec<double, 3>> positions(simulation.particles().size());
        for_particles(simulation, [&](std::size_t slot) {
            positions[simulation.particles().id(slot)] = simulation.particles().position(slot);
        });
        return positions;
    };
    const auto serial = run(detail::Serial{}), coloured = run(Coloured{2}), fixed = run(FixedPoint<std::int32_t>{2}),
               wide = run(FixedPoint<std::int64_t>{2});
    double of_coloured = 0, of_fixed = 0, of_wide = 0;
    for (std::size_t p = 0; p < serial.size(); ++p) {
        of_coloured = std::max(of_coloured, norm(coloured[p] - serial[p]));
        of_fixed = std::max(of_fixed, norm(fixed[p] - serial[p]));
        of_wide = std::max(of_wide, norm(wide[p] - serial[p]));
    }
    CHECK(of_coloured < 1e-12);
    CHECK(of_wide < 1e-8);
    CHECK(of_fixed < 1e-5);
}

TEST_CASE("In the far corner of 4096^3 cells a slow body moves to the bit as it does near the origin") {
    const double speed = 1e-4, dt = 1e-3;  // cells a step; h = 1 m
    const int steps = test_support::fewer_if_slow(500, 150);
    const auto run = [&](double corner) {
        Simulation<3> simulation({{0.0, 0.0, 0.0}, {4096.0, 4096.0, 4096.0}, 1.0},
                                 FixedCorotated<float>::from_young_poisson(1e3, 0.3));
        simulation.gravity = {};
        simulation.fixed_time_step = dt;
        const auto low = Vec<double, 3>::filled(corner);
        simulation.add(sample_box<3>(low, low + Vec<double, 3>::filled(4.0), {.spacing = 0.5}), 1.0,
                       {speed / dt, -speed / dt, speed / dt});
        std::vector<Vec<double, 3>> at_first(simulation.particles().size()), moved(at_first.size());
        for_particles(simulation, [&](std::size_t slot) {
            at_first[simulation.particles().id(slot)] = simulation.particles().exact_position(slot);
        });
        for (int i = 0; i < steps; ++i) simulation.step();
        for_particles(simulation, [&](std::size_t slot) {
            const std::uint32_t id = simulation.particles().id(slot);
            moved[id] = simulation.particles().exact_position(slot) - at_first[id];
        });
        CHECK(simulation.particles().bytes() + simulation.grid().bytes() < 1'000'000);
        return moved;
    };
    const auto near = run(8.0), far = run(4080.0);
    for (std::size_t i = 0; i < near.size(); ++i)
        for (int a = 0; a < 3; ++a) {
            CHECK(near[i][a] == far[i][a]);
            // A step of 1e-4 is rounded to the resolution of a place, 2^-21 beyond 4 and 2^-22 below: by 0.24 % at
            // most.
            CHECK(std::abs(std::abs(far[i][a]) - steps * speed) < steps * 0x1p-22 * 1.01);
        }
}

TEST_CASE("A load pushes the particles of its body: momentum grows by force times time, whatever the threads") {
    const auto pushed = [](int threads) {
        Simulation<2, FixedCorotated<double>> simulation(
            unit_box<2>(1.0 / 32), FixedCorotated<double>::from_young_poisson(1e5, 0.3), {threads});
        simulation.gravity = {0.0, 0.0};
        simulation.fixed_time_step = 2e-4;
        const Body end = simulation.add(sample_box<2>({0.5, 0.4}, {0.515625, 0.5}, {.spacing = 1.0 / 64}), 1000);
        simulation.add(sample_box<2>({0.3, 0.4}, {0.5, 0.5}, {.spacing = 1.0 / 64}), 1000);
        // 50 Pa, growing within 1 s, on the right end, 0.1 m high in the plane: 5 N/m at last
        simulation.add_load(
            end, [end](const Vec<double, 2>&, double time) { return Vec<double, 2>{5 * time / end.count, 0.0}; });
        for (int step = 0; step < 500; ++step) simulation.step();
        return simulation;
    };
    auto one = pushed(1);
    const auto sums = one.totals();
    // Σ dt F(t) over 500 steps of 2e-4 s: 5 dt² 500 · 499/2
    CHECK(sums.momentum[0] == Approx(5 * 2e-4 * 2e-4 * 500 * 499 / 2).epsilon(1e-9));
    CHECK(std::abs(sums.momentum[1]) < 1e-12);
    CHECK(sums.elastic_energy > 0);
    const auto three = pushed(3).totals();
    CHECK(three.momentum[0] == sums.momentum[0]);
    CHECK(three.elastic_energy == sums.elastic_energy);
}

TEST_CASE("A load has a name for ever: its impulse is among the reactions, and it can be removed") {
    Simulation simulation(unit_box<2>(1.0 / 16), Materials{FixedCorotated<double>::from_young_poisson(1e5, 0.3),
                                                           FixedCorotated<double>::from_young_poisson(1e4, 0.3)});
    simulation.gravity = {};
    simulation.fixed_time_step = 1e-4;
    auto first = simulation.set<0>();
    auto second = simulation.set<1>();
    const Body left = first.add(sample_box<2>({0.125, 0.25}, {0.375, 0.5}, {.spacing = 1.0 / 32}), 1000);
    const Body right = second.add(sample_box<2>({0.625, 0.25}, {0.875, 0.5}, {.spacing = 1.0 / 32}), 1000);
    const auto constant = [](double x, double y) {
        return [=](const Vec<double, 2>&, double) { return Vec<double, 2>{x, y}; };
    };
    const LoadId a = first.add_load(left, constant(0.01, 0)), b = second.add_load(right, constant(0, 0.02)),
                 c = second.add_load(right, constant(0, 0.03));
    simulation.reactions.emplace();
    CHECK_THROWS_AS(simulation.reactions->of(a), parameter_error);
    simulation.step();
    // 64 particles each, around (0.25, 0.375) m and (0.75, 0.375) m
    CHECK(norm(simulation.reactions->of(a).impulse - Vec<double, 2>{64e-6, 0}) < 1e-18);
    CHECK(simulation.reactions->of(a).angular_impulse == Approx(-0.375 * 64e-6).epsilon(1e-9));
    CHECK(norm(simulation.reactions->of(b).impulse - Vec<double, 2>{0, 128e-6}) < 1e-18);
    CHECK(simulation.reactions->of(c).angular_impulse == Approx(0.75 * 192e-6).epsilon(1e-9));
    CHECK(simulation.reactions->loads.size() == 3);

    second.remove_load(b);
    simulation.reactions->about = Vec<double, 2>{0.75, 0};
    const auto before = second.totals().momentum;
    simulation.step();
    CHECK(second.totals().momentum[1] - before[1] == Approx(192e-6).epsilon(1e-9));
    CHECK(simulation.reactions->of(c).impulse[1] == Approx(192e-6).epsilon(1e-9));
    CHECK(std::abs(simulation.reactions->of(c).angular_impulse) < 1e-15);
    CHECK_THROWS_AS(simulation.reactions->of(b), parameter_error);
    CHECK_THROWS_AS(second.remove_load(b), parameter_error);
    CHECK_THROWS_AS(second.remove_load(a), parameter_error);
    CHECK(second.add_load(right, constant(0, 1)) == LoadId{1, 2});  // no name is given twice
    first.remove_load(a);
    simulation.step();
    CHECK(simulation.reactions->loads.size() == 2);
}
