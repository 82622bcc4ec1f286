// release: -O0
/// \file What a simulation is told that is of no use: each is refused with its type of error and its name, and a good
/// call goes on to work.
#include "support/catch.hpp"
#include "support/message.hpp"
#include "support/not_finite.hpp"
#include <firn/firn.hpp>
#include <firn/lagrangian.hpp>

using namespace firn;
using test_support::check_refused;
using test_support::holds;
using test_support::infinity;
using test_support::message;
using test_support::not_a_number;

namespace {

using Plane = Simulation<2>;
using V = Vec<double, 2>;

Samples<2> some() { return sample_box<2>({0.3, 0.3}, {0.6, 0.6}, {.spacing = 1.0 / 32}); }
Plane plane() { return Plane({{0, 0}, {1, 1}, 1.0 / 16}); }

/// Nothing changes by the refusal: the simulation steps, as one that was never told.
template <class Error, class Act>
void refused(const Act& act, const std::string& part) {
    Plane simulation = plane();
    simulation.add(some(), 1000);
    check_refused<Error>([&] { act(simulation); }, part);
    CHECK(simulation.particles().size() == some().positions.size());
}

}  // namespace

TEST_CASE("domains without an extent, a cell, or a number") {
    const std::pair<Domain<2>, const char*> all[] = {
        {{{0, 0}, {1, 1}, 0}, "The cell size is 0 m"},
        {{{0, 0}, {1, 1}, -1}, "The cell size is -1 m"},
        {{{0, 0}, {1, 1}, not_a_number}, "The cell size is nan m"},
        {{{0, 0}, {1, 1}, infinity}, "The cell size is inf m"},
        {{{0, 1}, {1, 0}, 0.1}, "from 1 m to 0 m along axis 1"},
        {{{0, 0}, {0, 1}, 0.1}, "from 0 m to 0 m along axis 0"},
        {{{not_a_number, 0}, {1, 1}, 0.1}, "from nan m to 1 m along axis 0"},
        {{{0, -infinity}, {1, 1}, 0.1}, "from -inf m to 1 m along axis 1"},
        {{{-1e308, 0}, {1e308, 1}, 0.1}, "along axis 0"},
        {{{0, 0}, {1, 1}, 0.9}, "The domain has 1.11111111 cells"},
        {{{0, 0}, {1, 1}, 1e-9}, "The domain has 1e+09 cells"},
        {{{0, 0}, {1, 1}, 1e-300}, "cells"},
    };
    for (const auto& each : all) check_refused<parameter_error>([&] { Plane simulation(each.first); }, each.second);
}

TEST_CASE("bodies without mass, volume, particles, a place in the domain, or a finite velocity") {
    Samples<2> samples = some();
    for (const double density : {0.0, -1.0, not_a_number, infinity})
        refused<parameter_error>([&](Plane& p) { p.add(samples, density); }, sentence(density));
    for (const double volume : {0.0, -1.0, not_a_number, infinity, 1e-60})
        refused<parameter_error>([&](Plane& p) { p.add({samples.positions, volume}, 1000); }, sentence(volume));
    refused<parameter_error>([&](Plane& p) { p.add(samples, 1e300); }, "too large for the simulation's precision");
    for (const double speed : {not_a_number, infinity, 1e39})
        refused<parameter_error>([&](Plane& p) { p.add(samples, 1000, {0, speed}); }, "Component 1 of the velocity");
    refused<particle_error>([](Plane& p) { p.add({{}, 1}, 1000); }, "no particles");
    const std::size_t n = samples.positions.size();
    samples.positions[5] = {0.5, 1.5};
    samples.positions[7] = {not_a_number, 0.5};
    refused<particle_error>([&](Plane& p) { p.add(samples, 1000); },
                            sentence("2 of ", n, " particles are not finite or lie outside"));
    refused<particle_error>([&](Plane& p) { p.add(samples, 1000); }, "5 at (0.5, 1.5), 7 at (nan, 0.5)");
}

TEST_CASE("particles that are moved out of the domain by hand are listed by their ids") {
    Plane simulation = plane();
    simulation.add(some(), 1000);
    for (int i = 0; i < 3; ++i) simulation.step();  // slots are sorted, and some are padding
    auto& particles = simulation.edit_particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot) && particles.id(slot) % 20 == 11)
            particles.set_position(slot, {particles.id(slot) == 31 ? not_a_number : 2.0, 0.5});
    const std::string said = message<particle_error>([&] { simulation.step(); });
    CAPTURE(said);
    CHECK(holds(said, sentence("5 of ", some().positions.size(), " particles")));
    CHECK(holds(said, "the first: 11 at (2, 0.5), 31 at (nan, 0.5), 51 at (2, 0.5)."));
}

TEST_CASE("steps, times and fields that are of no use, before anything has moved") {
    for (const double dt : {-1e-3, not_a_number, infinity})
        refused<parameter_error>([&](Plane& p) { p.fixed_time_step = dt, p.step(); }, sentence(dt));
    for (const double duration : {-1.0, not_a_number, infinity})
        refused<parameter_error>([&](Plane& p) { p.advance(duration); }, sentence(duration));
    refused<parameter_error>(
        [](Plane& p) {
            p.advance(1e-3);
            p.fixed_time_step = 1e-30;  // would never end
            p.advance(1);
        },
        "too small to change the time");
    refused<parameter_error>([](Plane& p) { p.step(V{0.0, infinity}); }, "Component 1 of the acceleration");
    refused<parameter_error>([](Plane& p) { p.step(Damped<float, 2>{{}, -1}); }, "rate of damping");
    for (const float radius : {0.0F, -1.0F, float(not_a_number)})
        refused<parameter_error>([&](Plane& p) { p.step(Attraction<float, 2>{.radius = radius}); }, "radius");
    refused<parameter_error>([](Plane& p) { p.step(Attraction<float, 2>{.direction = {2, 0}}); }, "length 2");
    refused<parameter_error>([](Plane& p) { p.execution.threads = -3, p.step(); }, "-3 threads");
    refused<parameter_error>([](Plane& p) { p.execution.threads = 1 << 30, p.step(); }, "1073741824 threads");
}

TEST_CASE("a boundary that is of no use stops a step before anything has moved") {
    for (const double friction : {-1.0, not_a_number, infinity})
        refused<parameter_error>(
            [&](Plane& p) {
                p.boundary.at_upper[1].friction = friction;
                CHECK_THROWS_AS(p.step(), parameter_error);
                p.boundary.at_upper[1].friction = 0;
                CHECK_NOTHROW(p.step());
                p.boundary.at_upper[1].friction = friction;
                p.step();
            },
            "friction of a wall across axis 1");
    refused<parameter_error>([](Plane& p) { p.boundary.upper[0] = -1, p.step(); }, "The walls reach from 0 m to -1 m");
}

TEST_CASE("bodies that are not there, and forces that are none") {
    const Body beyond{0, 1000000}, wrapped{0xffffffffU, 2};
    const auto force = [](const V&, double) { return V{}; };
    for (const Body& body : {beyond, wrapped}) {
        refused<parameter_error>([&](Plane& p) { p.add_load(body, force); }, "There is no body");
        refused<parameter_error>([&](Plane& p) { p.add_force(body, Springs<float, 2>{}); }, "There is no body");
        refused<parameter_error>([&](Plane& p) { p.set_states(body, [](const V&, auto&) {}); }, "There is no body");
    }
    refused<parameter_error>([](Plane& p) { p.add_load(p.bodies()[0], std::function<V(const V&, double)>{}); },
                             "empty function");
    refused<parameter_error>(
        [](Plane& p) {
            Springs<float, 2> springs;
            springs.add({0, 100000}, {1, 1, 0});
            p.add_force(p.bodies()[0], std::move(springs));
            p.step();
        },
        "joins point 100000");
}

TEST_CASE("sources whose particles are none, or too many") {
    const Samples<2> one{{{0.5, 0.5}}, 1e-4};
    for (const double wrong : {0.0, -1.0, not_a_number, infinity}) {
        refused<parameter_error>([&](Plane& p) { p.add_source({.samples = one, .density = wrong}); }, "A source gives");
        refused<parameter_error>([&](Plane& p) { p.add_source({.samples = {one.positions, wrong}}); }, "A source give");
        refused<parameter_error>([&](Plane& p) { p.add_source({.samples = one, .rate = wrong}); }, "A source's rate");
    }
    refused<parameter_error>([&](Plane& p) { p.add_source({.samples = one, .velocity = {0, infinity}}); },
                             "at inf m/s");
    refused<parameter_error>(
        [&](Plane& p) {
            p.step();
            p.add_source({.samples = one, .rate = 1e300});
        },
        "more than can be counted");
    refused<parameter_error>(
        [&](Plane& p) {
            p.step();
            p.add_source({.samples = one, .rate = 1e15});  // skips what was due until now, at once
            p.step();
        },
        " bursts a second owes");
    refused<parameter_error>([](Plane& p) { p.add_sink({{not_a_number, 0.0}, {1.0, 1.0}}); }, "along axis 0");
}

TEST_CASE("a warning that has nowhere to go") {
    Plane simulation = plane();
    simulation.add(some(), 1000);
    simulation.warn = nullptr;
    simulation.fixed_time_step = 1.5 * simulation.stable_time_step();
    CHECK_NOTHROW(simulation.step());
}
