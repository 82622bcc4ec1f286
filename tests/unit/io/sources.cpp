// Particles that come and go during a run: how many, where, and with ids that stay unique.
#include "support/catch.hpp"
#include "support/temporary_folder.hpp"
#include <firn/firn.hpp>
#include <firn/io/states.hpp>

#include <set>

using namespace firn;

namespace sources_tests {
namespace {

constexpr double spacing = 1.0 / 32;

/// A layer of 8 particles, 0.25 m wide, at y = 0.8 m.
Samples<2> layer() { return sample_box<2>({0.375, 0.8}, {0.625, 0.8 + spacing}, {.spacing = spacing}); }

Simulation<2> box(int threads = 1) {
    Simulation<2> simulation({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 16}, FixedCorotated<float>::from_young_poisson(1e3, 0.3),
                             {threads});
    simulation.gravity = {0.0, 0.0};
    simulation.fixed_time_step = 1e-3;
    return simulation;
}

template <class F>
void for_particles(const Simulation<2>& simulation, const F& f) {
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) f(particles, slot);
}

std::set<std::uint32_t> ids(const Simulation<2>& simulation) {
    std::set<std::uint32_t> all;
    for_particles(simulation, [&](const auto& particles, std::size_t slot) { all.insert(particles.id(slot)); });
    return all;
}

std::vector<float> numbers(const Simulation<2>& simulation) {
    std::vector<std::pair<std::uint32_t, float>> pairs;
    for_particles(simulation, [&](const auto& particles, std::size_t slot) {
        for (int a = 0; a < 2; ++a) {
            pairs.emplace_back(4 * particles.id(slot) + unsigned(a), particles.position(slot)[a]);
            pairs.emplace_back(4 * particles.id(slot) + 2 + unsigned(a), particles.velocity(slot)[a]);
        }
    });
    std::sort(pairs.begin(), pairs.end());
    std::vector<float> all;
    for (const auto& [key, value] : pairs) all.push_back(value);
    return all;
}

}  // namespace

TEST_CASE("a jet gives layers one spacing apart, whatever the time step") {
    for (const double dt : {1e-3, 1.7e-3}) {
        Simulation<2> simulation = box();
        simulation.fixed_time_step = dt;
        simulation.add_source(Source<2>::jet(layer(), spacing, 1000, {0.0, -2.0}));
        simulation.advance(0.1);
        // 2 m/s × 0.1 s = 6.4 spacings: layers at 0, 1, … 6
        REQUIRE(simulation.particles().size() == 7 * 8);
        REQUIRE(ids(simulation).size() == 7 * 8);
        for_particles(simulation, [&](const auto& particles, std::size_t slot) {
            const double born = double(particles.id(slot) / 8) * spacing / 2;  // [s]
            REQUIRE(double(particles.position(slot)[1]) == Approx(0.8 + spacing / 2 - 2 * (0.1 - born)).margin(2e-6));
        });
    }
}

TEST_CASE("a simulation without particles waits for its sources") {
    Simulation<2> simulation = box();
    simulation.fixed_time_step = 0;
    Source<2> source = Source<2>::jet(layer(), spacing, 1000, {0.0, -2.0});
    source.start = 0.05;
    simulation.add_source(source);
    simulation.step();
    REQUIRE(simulation.time() == Approx(0.05).epsilon(1e-12));
    simulation.advance(0.05);
    REQUIRE(simulation.particles().size() == 4 * 8);  // 0.05 s × 2 m/s = 3.2 spacings
}

TEST_CASE("particles are taken out at the end of their lifespan, and their ids are not given again") {
    Simulation<2> simulation = box();
    Source<2> source = Source<2>::jet(layer(), spacing, 1000, {0.0, -1.0});
    source.lifespan = 0.1;  // 3.2 spacings
    simulation.add_source(source);
    simulation.advance(0.5 + 1e-4);  // bursts 0 to 16, of which 13 to 16 are younger than 0.1 s
    REQUIRE(simulation.particles().size() == 4 * 8);
    REQUIRE(*ids(simulation).begin() == 13 * 8);
    REQUIRE(*ids(simulation).rbegin() == 17 * 8 - 1);
    REQUIRE(simulation.particles().next_id() == 17 * 8);
}

TEST_CASE("a sink takes out what is in it, and nothing else") {
    Simulation<2> simulation = box();
    simulation.add_source(Source<2>::jet(layer(), spacing, 1000, {0.0, -2.0}));
    simulation.add_sink({{0.0, 0.0}, {1.0, 0.5}});
    simulation.advance(0.3);
    // 0.8 + spacing/2 − 0.5 = 0.3156 m take 0.158 s: of bursts 0 to 19, those before 0.3 − 0.158 = 0.142 s are gone
    REQUIRE(simulation.particles().size() == 10 * 8);
    REQUIRE(*ids(simulation).begin() == 10 * 8);
    for_particles(simulation,
                  [](const auto& particles, std::size_t slot) { REQUIRE(particles.position(slot)[1] > 0.5F); });
}

/// A row of particles at y = 0.7 m that fall by 0.9 cells a step; their ways of one step are 0.7 to 0.64375 m, and so
/// on.
template <class Transfer>
auto falling(std::array<bool, 2> periodic = {}) {
    constexpr double h = 1.0 / 16;
    Simulation simulation(Domain<2>{{0.0, 0.0}, {1.0, 1.0}, h, periodic}, NoStress<float>{}, Transfer{}, NoBoundary{});
    simulation.gravity = {0.0, 0.0};
    simulation.fixed_time_step = 0.01;
    simulation.warn = nullptr;
    Samples<2> row{{}, spacing * spacing};
    for (int i = 0; i < 10; ++i) row.positions.push_back({(i + 0.5) / 10, 0.7});
    simulation.add(row, 1000, {0.0, -0.9 * h / 0.01});
    return simulation;
}

#if defined(FIRN_TEST_QUICK)
#define SINK_TRANSFERS Apic, Asflip<>
#else
#define SINK_TRANSFERS Apic, Pic, Flip<>, Asflip<>
#endif
TEMPLATE_TEST_CASE("a sink takes out what comes through it, however thin it is", "", SINK_TRANSFERS) {
    // The sink lies between two places of the particles, and is thinner than what float resolves of a step; or a plane.
    for (const double thickness : {1e-3, 1e-6, 0.0}) {
        for (const double at : {0.68, 0.55, 0.31}) {
            auto simulation = falling<TestType>();
            simulation.add_sink({{0.25, at}, {0.65, at + thickness}});
            for (int step = 0; step < 8; ++step) simulation.step();
            CHECK(simulation.particles().size() == 6);  // those at 0.05, 0.15, 0.65 to 0.95 m; 0.25 m is on the face
        }
    }
}

TEST_CASE("a sink takes out what clips its corner, and not what passes beside it") {
    const auto left = [](const Vec<double, 2>& lower, const Vec<double, 2>& upper) {
        Simulation simulation(Domain<2>{{0.0, 0.0}, {1.0, 1.0}, 1.0 / 16}, NoStress<double>{}, NoBoundary{});
        simulation.gravity = {0.0, 0.0};
        simulation.fixed_time_step = 0.01;
        simulation.warn = nullptr;
        simulation.add(Samples<2>{{{0.5, 0.5}}, spacing * spacing}, 1000, {4.0, 2.0});
        simulation.add_sink({lower, upper});
        simulation.add(Samples<2>{{{0.1, 0.9}}, spacing * spacing}, 1000);  // so that one is left
        simulation.step();
        return simulation.particles().size() == 2;
    };
    // The way leads from (0.5, 0.5) to (0.54, 0.52), through (0.52, 0.51).
    CHECK_FALSE(left({0.52 - 1e-6, 0.4}, {0.6, 0.51 + 1e-6}));
    CHECK(left({0.52 + 1e-6, 0.4}, {0.6, 0.51 - 1e-6}));
    CHECK_FALSE(left({0.4, 0.51 - 1e-6}, {0.52 + 1e-6, 0.6}));
    CHECK(left({0.4, 0.51 + 1e-6}, {0.52 - 1e-6, 0.6}));
    CHECK(left({0.5, 0.52}, {0.54 - 1e-6, 0.6}));  // the boxes of the way and the sink meet
    CHECK_FALSE(left({-1e300, 0.51}, {1e300, 0.51}));
    const double all = std::numeric_limits<double>::infinity();
    CHECK_FALSE(left({-all, 0.515}, {all, 0.516}));
}

TEST_CASE("a sink takes out what comes through it on the way through a periodic end") {
    // From 0.7 m, the particles reach y = 0.025 m after 12 steps, and then −0.03125, which is 0.96875 m.
    for (const double at : {0.01, 0.98}) {
        auto simulation = falling<Apic>({false, true});
        simulation.add_sink({{0.0, at}, {0.5, at + 1e-4}});
        for (int step = 0; step < 12; ++step) simulation.step();
        CHECK(simulation.particles().size() == 10);
        simulation.step();
        CHECK(simulation.particles().size() == 5);
    }
    auto simulation = falling<Apic>({false, true});
    simulation.add_sink({{0.0, 0.5}, {0.5, 0.5001}});
    simulation.add_sink({{0.5, 0.96}, {1.0, 0.961}});  // beside the way
    for (int step = 0; step < 13; ++step) simulation.step();
    CHECK(simulation.particles().size() == 5);
}

TEST_CASE("a sink takes out what a source sends through it within a step") {
    Simulation<2> simulation = box();
    simulation.fixed_time_step = 0.02;  // 1.28 spacings of the jet
    simulation.add_source(Source<2>::jet(layer(), spacing, 1000, {0.0, -2.0}));
    simulation.add_sink({{0.0, 0.8}, {1.0, 0.8001}});  // at 1/64 m below the nozzle
    simulation.warn = nullptr;
    for (int step = 0; step < 20; ++step) {
        simulation.step();
        for_particles(simulation,
                      [](const auto& particles, std::size_t slot) { REQUIRE(particles.position(slot)[1] > 0.8F); });
    }
    CHECK(simulation.particles().next_id() > 20 * 8);
}

TEST_CASE("remove_if takes out those that are named; the others go on as if alone") {
    Simulation<2> simulation = box(), alone = box();
    const auto here = sample_box<2>({0.1, 0.1}, {0.3, 0.3}, {.spacing = spacing});
    const auto there = sample_box<2>({0.6, 0.6}, {0.8, 0.8}, {.spacing = spacing});
    const Body first = simulation.add(here, 1000, {0.3, 0.1});
    simulation.add(there, 1000);
    alone.add(here, 1000, {0.3, 0.1});
    REQUIRE(simulation.remove_if([&](const Vec<double, 2>&, std::uint32_t id) { return id >= first.count; }) ==
            there.positions.size());
    for (int step = 0; step < 50; ++step) {
        simulation.step();
        alone.step();
    }
    REQUIRE(numbers(simulation) == numbers(alone));
    REQUIRE(simulation.remove_if([](const Vec<double, 2>&, std::uint32_t) { return true; }) == first.count);
    REQUIRE_THROWS_AS(simulation.step(), particle_error);  // nothing is left, and nothing will come
}

TEST_CASE("with sources: the same bits for any number of threads, and after a restart") {
    const auto with_source = [](int threads) {
        Simulation<2> simulation = box(threads);
        simulation.gravity = {0.0, -9.81};
        simulation.add(sample_box<2>({0.1, 0.05}, {0.9, 0.3}, {.spacing = spacing}), 1000);
        Source<2> source = Source<2>::jet(layer(), spacing, 1000, {0.3, -2.0});
        source.lifespan = 0.12;
        simulation.add_source(source);
        simulation.add_sink({{0.0, 0.0}, {0.2, 0.1}});
        return simulation;
    };
    Simulation<2> one = with_source(1), three = with_source(3);
    for (int step = 0; step < 150; ++step) {
        one.step();
        three.step();
    }
    REQUIRE(numbers(one) == numbers(three));

    const TemporaryFolder folder;
    write_state(folder.path() / "state.hdf", state_of(one));
    Simulation<2> continued = box(2);
    continued.gravity = one.gravity;
    Source<2> source = Source<2>::jet(layer(), spacing, 1000, {0.3, -2.0});
    source.lifespan = 0.12;
    continued.add_source(source);
    continued.add_sink({{0.0, 0.0}, {0.2, 0.1}});
    restore(continued, read_state<float>(folder.path() / "state.hdf"));
    for (int step = 0; step < 150; ++step) {
        one.step();
        continued.step();
    }
    REQUIRE(numbers(one) == numbers(continued));
    REQUIRE(ids(one) == ids(continued));
}

TEST_CASE("wrong sources and sinks are refused") {
    Simulation<2> simulation = box();
    REQUIRE_THROWS_AS(Source<2>::jet(layer(), spacing, 1000, {0.0, 0.0}), parameter_error);
    REQUIRE_THROWS_AS(Source<2>::jet(layer(), 0, 1000, {0.0, 1.0}), parameter_error);
    REQUIRE_THROWS_AS(simulation.add_source({.samples = {}, .rate = 1}), parameter_error);
    REQUIRE_THROWS_AS(simulation.add_source({.samples = layer(), .rate = -1}), parameter_error);
    REQUIRE_THROWS_AS(simulation.add_source({.samples = layer(), .lifespan = 0}), parameter_error);
    REQUIRE_THROWS_AS(simulation.add_sink({{0.5, 0.0}, {0.4, 1.0}}), parameter_error);

    const auto outside = sample_box<2>({0.4, 1.1}, {0.5, 1.1 + spacing}, {.spacing = spacing});
    simulation.add_source(Source<2>::jet(outside, spacing, 1000, {0.0, -1.0}));
    REQUIRE_THROWS_AS(simulation.step(), particle_error);
}

}  // namespace sources_tests
