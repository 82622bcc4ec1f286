/// \file How many parallel regions of OpenMP's a call opens, and that what is the user's runs outside of them.
///
/// g++'s compiler opens a region by a call of GOMP_parallel: the one of this program counts and passes it on.
#include "support/catch.hpp"
#include "support/scenes.hpp"
#include <firn/firn.hpp>
#include <firn/io/simulation_state.hpp>
#include <firn/lagrangian.hpp>

#include <dlfcn.h>

#include <string>
#include <vector>

using namespace firn;

namespace {
std::atomic<int> opened = 0;
}  // namespace

extern "C" void GOMP_parallel(void (*body)(void*), void* data, unsigned threads, unsigned flags) {
    static const auto real =
        reinterpret_cast<void (*)(void (*)(void*), void*, unsigned, unsigned)>(::dlsym(RTLD_NEXT, "GOMP_parallel"));
    ++opened;
    real(body, data, threads, flags);
}

namespace {

/// Regions that the call of f opens.
template <class F>
int regions(const F& f) {
    firn::detail::helpers_may_be_left_out = false;  // no step goes alone
    const int before = opened;
    f();
    return opened - before;
}

/// Threads that a region of the user's gets here.
int threads_of_own_region() {
    std::atomic<int> threads = 0;
#pragma omp parallel num_threads(3)
    ++threads;
    return threads;
}

const auto jelly = FixedCorotated<float>::from_young_poisson(1e4, 0.3);
constexpr double dt = 1.0 / 8192;

template <class Simulation>
void add_cube(Simulation& simulation) {
    simulation.add(sample_box<3>({0.3, 0.3, 0.3}, {0.6, 0.6, 0.6}, {.spacing = 1.0 / 64}), 1000.0, {1.0, 0.0, 0.5});
    simulation.fixed_time_step = dt;
}

const Domain<3> unit_box{.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 1.0 / 32};

template <class Simulation>
void check_one_region(Simulation simulation) {
    add_cube(simulation);
    CHECK(regions([&] { simulation.step(); }) == 1);  // the first sort, and the first stress, included
    simulation.most_steps_between_sorts = 1;
    CHECK(regions([&] { simulation.step(); }) == 1);
    CHECK(regions([&] { simulation.advance(20 * dt); }) == 1);
    CHECK(simulation.steps() == 22);
    CHECK(regions([&] { state_of(simulation); }) == 1);
    CHECK(regions([&] { simulation.totals(); }) == 1);
}

ParticleSystem<3> net() {
    const auto sheet = cloth({0.0, 1.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 0.0, 1.0}, {64, 64});
    ParticleSystem<3> system;
    system.threads = 2;
    system.add(sheet, {.mass = 1e-3, .radius = 1e-3});
    system.constraints.add(sheet);
    system.add_force(aerodynamic_surface_of<float>(sheet, {.wind = {3, 0, 1}}));
    system.collisions.emplace();
    return system;
}

/// A force of a user's that opens a region of its own.
struct OwnLoop {
    int* least_threads;
    int* inside;

    void add_forces(const PointView<float, 3>& points, std::span<Vec<float, 3>> force, int) {
        *inside += omp_in_parallel();
        *least_threads = std::min(*least_threads, threads_of_own_region());
#pragma omp parallel for num_threads(2)
        for (std::size_t i = 0; i < points.size(); ++i) force[i][0] += 1e-3f;
    }
};

}  // namespace

TEST_CASE("A step opens one region, and so do all steps of advance()") {
    SECTION("floating point") { check_one_region(Simulation<3>(unit_box, jelly, {2})); }
    SECTION("atomic integers") {
        check_one_region(
            Simulation<3, FixedCorotated<float>, Apic, MlsForce, QuadraticBSpline, FixedPoint<>>(unit_box, jelly, {2}));
    }
    SECTION("a transfer that blends velocities") {
        check_one_region(Simulation<3, FixedCorotated<float>, Flip<>>(unit_box, jelly, {2}));
    }
    SECTION("a transfer of several passes, in integers") {
        Simulation<3, FixedCorotated<float>, Fmpm, MlsForce, QuadraticBSpline, ColouredFixedPoint<std::int32_t>>
            simulation(unit_box, jelly, {2});
        simulation.transfer.order = 3;
        check_one_region(simulation);
    }
}

TEST_CASE("A step on one thread opens no region") {
    Simulation<3> simulation(unit_box, jelly, {1});
    CHECK(regions([&] {
              add_cube(simulation);
              simulation.step();
              simulation.advance(5 * dt);
              state_of(simulation);
          }) == 0);
    Simulation<3, FixedCorotated<float>, Apic, MlsForce, QuadraticBSpline, detail::Serial> serial(unit_box, jelly);
    CHECK(regions([&] {
              add_cube(serial);
              serial.step();
          }) == 0);
}

TEST_CASE("A stage that is called alone opens one region; several in a region of the user's choice, that one") {
    Simulation<3> simulation(unit_box, jelly, {2});
    add_cube(simulation);
    simulation.step();
    auto& particles = simulation.edit_particles();
    BlockPartition<3> partition;
    CHECK(regions([&] { partition = sort_particles<QuadraticBSpline>(particles, 2); }) == 1);
    SparseGrid<float, 3> grid(unit_box);
    CHECK(regions([&] { grid.activate(partition, 2); }) <= 1);
    const Coloured how{2};
    const auto scatter = [&] { p2g<QuadraticBSpline, Apic, MlsForce>(how, particles.view(), partition, grid, dt); };
    const auto update = [&] { grid_update(how, grid, dt, Vec<float, 3>{0, -9.81f, 0}, NoBoundary{}); };
    const auto gather = [&] {
        g2p<QuadraticBSpline, Apic, MlsForce>(how, particles.view(), partition, grid, jelly, dt);
    };
    CHECK(regions(scatter) == 1);
    CHECK(regions(update) == 1);
    CHECK(regions(gather) == 1);
    CHECK(regions([&] { update_stress(how, particles.view(), partition, jelly, 1.0 / 32); }) == 1);
    CHECK(regions([&] {
              parallel_region(2, [&] {
                  scatter();
                  update();
                  gather();
              });
          }) == 1);
}

TEST_CASE("A step of points opens one region, and so do all steps of advance()") {
    ParticleSystem<3> system = net();
    CHECK(regions([&] { system.step(1e-3); }) == 1);
    CHECK(regions([&] { system.advance(0.1, 1e-3); }) == 1);
    CHECK(system.steps() == 101);
}

TEST_CASE("A warning is given outside any region, before its step; the steps around it share theirs") {
    std::vector<std::uint64_t> at;
    int inside = 0, least_threads = 3;
    const auto warn = [&](const auto& of) {
        return [&](const std::string& text) {
            CHECK(text.find("bound") != std::string::npos);
            at.push_back(of.steps());
            inside += omp_in_parallel();
            least_threads = std::min(least_threads, threads_of_own_region());
        };
    };
    SECTION("of a simulation") {
        Simulation<3> simulation(unit_box, jelly, {2});
        simulation.warn = warn(simulation);
        add_cube(simulation);
        simulation.advance(3 * dt);
        CHECK(at.empty());
        simulation.fixed_time_step = 1.5 * simulation.stable_time_step();
        CHECK(regions([&] { simulation.advance(4 * simulation.fixed_time_step); }) == 2 + 1);  // and the user's
        CHECK(at == std::vector<std::uint64_t>{3});
    }
    SECTION("of a particle system") {
        ParticleSystem<3> system = net();
        system.warn = warn(system);
        Springs<float, 3> springs;
        springs.add({0, 1}, {.rest = 0.01f, .stiffness = 1e4f});
        system.add_force(springs);
        CHECK(regions([&] { system.advance(3e-3, 1e-3); }) == 2 + 1);
        CHECK(at == std::vector<std::uint64_t>{0});
    }
    CHECK(inside == 0);
    CHECK(least_threads == 3);
}

TEST_CASE("What a warning throws ends the call before the step; so does what a step throws, outside any region") {
    Simulation<3> simulation(unit_box, jelly, {2});
    add_cube(simulation);
    simulation.advance(3 * dt);
    simulation.warn = [](const std::string&) { throw std::runtime_error("too long"); };
    simulation.fixed_time_step = 0.1;
    CHECK_THROWS_AS(simulation.step(), std::runtime_error);
    CHECK(simulation.steps() == 3);
    simulation.warn = nullptr;
    try {
        simulation.advance(10);
        FAIL("it must blow up");
    } catch (const particle_error&) {
        CHECK(omp_in_parallel() == 0);
        CHECK(threads_of_own_region() == 3);
    }
}

TEST_CASE("A force of the user's runs outside any region, and its own region has its threads") {
    int least_threads = 3, inside = 0;
    SECTION("on the points of a particle system") {
        ParticleSystem<3> system = net();
        system.add_force(OwnLoop{&least_threads, &inside});
        system.advance(3e-3, 1e-3);
    }
    SECTION("on the particles of a simulation") {
        Simulation<3, Materials<FixedCorotated<float>, NoStress<float>>> simulation(unit_box, {jelly, {}}, {2});
        const auto sheet = cloth({0.2, 0.7, 0.2}, {0.6, 0.0, 0.0}, {0.0, 0.0, 0.6}, {40, 40});
        const std::vector<double> masses(sheet.positions.size(), 1e-4);
        const Body body = simulation.set<NoStress<float>>().add(sheet, masses, {0.0, -1.0, 0.0});
        simulation.set<NoStress<float>>().add_force(body, OwnLoop{&least_threads, &inside});
        simulation.fixed_time_step = dt;
        simulation.advance(3 * dt);
    }
    CHECK(inside == 0);
    CHECK(least_threads == 3);
}
