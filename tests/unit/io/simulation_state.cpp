/// \file A stored run goes on to the same bits as one that was never stopped; what does not fit is refused.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/scenes.hpp"
#include <firn/io/states.hpp>

#include "example_state.hpp"

using namespace firn;

namespace simulation_state_tests {
namespace {

template <int D, class S, class Execution>
using Run = Simulation<D, FixedCorotated<S>, Apic, MlsForce, QuadraticBSpline, Execution>;

template <int D, class S, class Execution>
Run<D, S, Execution> make_run(int threads) {
    return Run<D, S, Execution>({Vec<double, D>::zero(), Vec<double, D>::filled(1.0), 1.0 / 16},
                                FixedCorotated<S>::from_young_poisson(1e5, 0.3), {threads});
}

template <int D, class S, class Execution>
void check_continuation() {
    const int before = test_support::fewer_if_sanitized(137, 11), after = test_support::fewer_if_sanitized(200, 14);
    const states::Folder folder;
    auto whole = make_run<D, S, Execution>(1);
    scenes::add_two_blocks<D>(whole, 0.25, 1.0 / 32);
    for (int i = 0; i < before; ++i) whole.step();
    write_state(folder / "state.hdf", state_of(whole));
    const std::uint64_t at_state = scenes::hash(whole);
    for (int i = 0; i < after; ++i) whole.step();  // writing must not have changed anything, see below

    auto continued = make_run<D, S, Execution>(3);
    restore(continued, read_state<S>(folder / "state.hdf"));
    CHECK(scenes::hash(continued) == at_state);
    CHECK(continued.steps() == std::uint64_t(before));
    for (int i = 0; i < after; ++i) continued.step();
    CHECK(scenes::hash(continued) == scenes::hash(whole));
    CHECK(continued.time() == whole.time());

    auto unwritten = make_run<D, S, Execution>(2);
    scenes::add_two_blocks<D>(unwritten, 0.25, 1.0 / 32);
    for (int i = 0; i < before + after; ++i) unwritten.step();
    CHECK(scenes::hash(unwritten) == scenes::hash(whole));
}

}  // namespace

TEST_CASE("A run that goes on from a state has the bits of one that was never stopped: coloured, 3D, float") {
    check_continuation<3, float, Coloured>();
}
TEST_CASE("A run that goes on from a state has the bits of one that was never stopped: coloured, 2D, double") {
    check_continuation<2, double, Coloured>();
}
TEST_CASE("A run that goes on from a state has the bits of one that was never stopped: fixed point") {
    check_continuation<3, float, FixedPoint<std::int32_t>>();
}

TEST_CASE("A state says what it holds, in SI units, in the order of ids") {
    auto run = make_run<2, double, Coloured>(1);
    const Body first = run.add(sample_box<2>({0.2, 0.2}, {0.3, 0.3}, {.spacing = 1.0 / 32}), 100.0, {0.5, 0.25});
    const Body second = run.add(sample_box<2>({0.6, 0.2}, {0.7, 0.3}, {.spacing = 1.0 / 32}), 200.0);
    const auto state = state_of(run);
    REQUIRE(state.size() == first.count + second.count);
    CHECK(state.field("position").unit == "m");
    CHECK(state.field("velocity").values[0] == 0.5);
    CHECK(state.field("velocity").values[1] == 0.25);
    CHECK(state.field("deformation_gradient").values[3] == 1.0);
    CHECK(state.field("mass").values[0] == Approx(100.0 / 32 / 32));
    CHECK(state.field("mass").values.back() == Approx(200.0 / 32 / 32));
    CHECK(state.material.front() == 0);
    CHECK(state.material.back() == 1);
    for (std::size_t i = 0; i < state.size(); ++i) CHECK(state.id[i] == std::int64_t(i));
}

TEST_CASE("Where moving boundaries were is in a state to the bit, and comes back from it") {
    using Boundary = Together<Walls<float, 3>, Collider<Sphere<float, 3>>>;
    using Turning = Simulation<3, FixedCorotated<float>, Apic, MlsForce, QuadraticBSpline, Coloured, Boundary>;
    const auto walls = Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {Contact::slip, 0});
    const Collider<Sphere<float, 3>> ball{
        .shape = {0.123F}, .linear_velocity = {0.1, 0.2, 0.3}, .angular_velocity = {1.0, 2.0, 3.0}};
    const auto make = [&] {
        return Turning({{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}, 1.0 / 16}, FixedCorotated<float>{}, {}, {walls, ball});
    };
    auto run = make();
    run.add(sample_box<3>({0.2, 0.2, 0.2}, {0.3, 0.3, 0.3}, {.spacing = 1.0 / 32}), 1000);
    for (int i = 0; i < 7; ++i) run.boundary = advanced(run.boundary, 0.01);
    const states::Folder folder;
    write_state(folder / "state.hdf", state_of(run));
    const auto state = read_state<float>(folder / "state.hdf");
    CHECK(detail::parameter_values(state, "boundary", "1_shape_radius") == std::vector<double>{double(0.123F)});
    auto continued = make();
    restore(continued, state);
    restore_parameters(continued.boundary, state, "boundary");
    const auto &was = std::get<1>(run.boundary.parts), &is = std::get<1>(continued.boundary.parts);
    CHECK(is.position == was.position);
    CHECK(is.rotation == was.rotation);
    CHECK(is.position[0] == Approx(0.007));
    CHECK(is.shape.radius == 0.123F);
    CHECK_THROWS_AS(restore_parameters(continued.boundary, state, "material"), io_error);
}

TEST_CASE("A state of another run is refused with what differs, and the simulation is as it was") {
    auto run = make_run<2, double, Coloured>(1);
    scenes::add_two_blocks<2>(run, 0.25, 1.0 / 32);
    const auto state = state_of(run);
    const auto refused = [&](const State<double>& wrong, auto& target, const std::string& word) {
        const auto before = target.particles().size();
        try {
            restore(target, wrong);
            FAIL("nothing was thrown");
        } catch (const io_error& error) {
            CAPTURE(std::string(error.what()));
            CHECK(std::string(error.what()).find(word) != std::string::npos);
        }
        CHECK(target.particles().size() == before);
    };
    Simulation<2, FixedCorotated<double>, Pic> pic(run.domain());
    refused(state, pic, "'pic'");
    auto other_cells = Run<2, double, Coloured>({run.domain().lower, run.domain().upper, 1.0 / 20});
    refused(state, other_cells, "other cells");
    auto damaged = state;
    damaged.tables[0].values[3] = damaged.tables[0].values[4];
    refused(damaged, run, "order of particles");
    damaged = state;
    damaged.tables[1].values[0] = 1 << 30;
    refused(damaged, run, "blocks");
    damaged = state;
    damaged.tables.clear();
    refused(damaged, run, "slot");
}

}  // namespace simulation_state_tests
