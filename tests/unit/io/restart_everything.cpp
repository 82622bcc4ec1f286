/// \file A run on the grid with all that a program can add to it goes on from a state to the bits of one never stopped.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/io/states.hpp>
#include <firn/lagrangian/net_forces.hpp>

#include "example_state.hpp"

using namespace firn;

namespace restart_everything_tests {
namespace {

using Boundary = Together<Walls<float, 2>, Collider<Sphere<float, 2>>>;
using Run = Simulation<2, Materials<FixedCorotated<float>>, Apic, MlsForce, QuadraticBSpline, Coloured, Boundary>;
constexpr double spacing = 1.0 / 48;

/// A bar that a load bends, a block whose particles springs hold together until a sink takes some, a jet whose
/// particles live for a while, and a ball that moves and turns through them.
Run made(int threads) {
    const Collider<Sphere<float, 2>> ball{.shape = {0.07f},
                                          .friction = 0.3,
                                          .position = {0.35, 0.2},
                                          .linear_velocity = {0.9, 0.2},
                                          .angular_velocity = 7};
    Run run({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 24}, Materials(FixedCorotated<float>::from_young_poisson(2e5, 0.3)),
            {threads}, {Walls<float, 2>::all({0, 0}, {1, 1}, {Contact::separate, 0.2}), ball});
    run.gravity = {0.3, -9.81};
    run.most_steps_between_sorts = 50;  // due at the stop
    const Body bar = run.add(sample_box<2>({0.55, 0.05}, {0.65, 0.4}, {.spacing = spacing}), 1000);
    run.add_load(
        bar, [](const Vec<double, 2>& x, double time) { return Vec<double, 2>{20 * x[1] * std::sin(40 * time), 0.0}; });
    const auto samples = sample_box<2>({0.7, 0.3}, {0.95, 0.45}, {.spacing = spacing});
    const Body block = run.add(samples, 800, {-0.5, -1.0});
    Springs<float, 2> springs;
    for (std::uint32_t i = 0; i + 5 < block.count; ++i)
        springs.add({i, i + 5},
                    {float(norm(samples.positions[i + 5] - samples.positions[i])), 5.0f + 0.1f * float(i), 0.01f});
    run.add_force(block, springs);
    auto jet = Source<2>::jet(sample_box<2>({0.05, 0.8}, {0.25, 0.8 + spacing}, {.spacing = spacing}), spacing, 1000,
                              {0.8, -2.0});
    jet.lifespan = 0.05;
    run.add_source(jet);
    run.add_sink({{0.85, 0.0}, {1.0, 0.2}});
    return run;
}

}  // namespace

TEST_CASE("With loads, springs, a source, a sink and a moving ball: the same bits after a restart, 1 thread then 3",
          "[io]") {
    auto whole = made(2), stopped = made(1);
    const auto go = [](auto& run, std::uint64_t to) {
        while (run.steps() < to) run.step();
    };
    const std::uint64_t end = test_support::fewer_if_slow(500, 260);
    go(whole, end);
    const auto should_be = state_of(whole);
    const states::Folder folder;
    for (const std::uint64_t stop : {200, 207}) {  // particles are to be sorted then, and not
        CAPTURE(stop);
        go(stopped, stop);
        const auto state = state_of(stopped);
        write_state(folder / "state.hdf", state);
        auto continued = made(3);
        restore(continued, read_state<float>(folder / "state.hdf"));
        go(continued, end);
        const auto is = state_of(continued);
        CHECK(is.time == should_be.time);
        CHECK(is.tables == should_be.tables);
        CHECK(is.parameters == should_be.parameters);
        for (const auto& field : should_be.fields) {
            CAPTURE(field.name);
            const auto& values = is.field(field.name).values;
            REQUIRE(values.size() == field.values.size());
            CHECK(std::memcmp(values.data(), field.values.data(), values.size() * sizeof(float)) == 0);
        }
        // All of it happened before the stop and after it.
        const auto next_id = [](const auto& of) { return detail::parameter_values(of, "run", "next_id")[0]; };
        const auto block_left = [](const auto& of) { return std::ranges::count(of.body, 1); };
        CHECK(next_id(should_be) > next_id(state) + 20);
        CHECK(next_id(should_be) - double(should_be.size()) > next_id(state) - double(state.size()) + 20);
        CHECK(next_id(state) - double(state.size()) > 10);
        CHECK(block_left(state) < std::ptrdiff_t(stopped.bodies()[1].count));
        CHECK(block_left(should_be) < block_left(state));
    }
}

}  // namespace restart_everything_tests
