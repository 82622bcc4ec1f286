/// \file A system of point masses that goes on from a stored state has the bits of one that was never stopped, whatever
/// steps have changed; what does not fit is refused, and nothing that a file says can do harm.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/io/particle_system_state.hpp>
#include <firn/io/state_reader.hpp>
#include <firn/io/state_writer.hpp>
#include <firn/lagrangian/cloth.hpp>
#include <firn/lagrangian/rope.hpp>

#include "example_state.hpp"

#include <functional>

using namespace firn;

namespace particle_system_restart_tests {
namespace {

constexpr int before = 200, after = 300;

/// Steps differ in length: Verlet goes by the one before.
template <class System>
void go(System& system, int steps) {
    for (int i = 0; i < steps; ++i) system.step(1e-3 * (1 + 0.25 * double(system.steps() * 7 % 5)));
}

template <class S>
bool same(const State<S>& a, const State<S>& b) {
    return states::same_bits(a, b) && a.tables == b.tables;
}

template <class S>
const StateTable& table_of(const State<S>& state, const char* name, int columns = 1) {
    return detail::table(state.tables, name, columns);
}
template <class S>
StateTable& table_of(State<S>& state, const std::string& name) {
    const auto found = std::ranges::find_if(state.tables, [&](const auto& table) { return table.name == name; });
    REQUIRE(found != state.tables.end());
    return *found;
}
template <class S>
std::vector<S>& field_of(State<S>& state, const std::string& name) {
    const auto found = std::ranges::find_if(state.fields, [&](const auto& field) { return field.name == name; });
    REQUIRE(found != state.fields.end());
    return found->values;
}
template <class S>
std::vector<double>& parameter_of(State<S>& state, const std::string& name) {
    const auto found = std::ranges::find_if(state.parameters, [&](const auto& one) { return one.name == name; });
    REQUIRE(found != state.parameters.end());
    return found->values;
}

/// Cloth in the wind, pulled apart between pins until it tears: constraints, springs, air on facets and points.
struct Banner {
    using System = ParticleSystem<3, float, Verlet>;
    ConstraintUpdate update = ConstraintUpdate::coloured;

    System made(int threads) const {
        System system;
        system.threads = threads;
        system.damping = 0.1;
        system.iterations = 4;
        system.warn = [](const std::string&) {};
        const auto net = cloth({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {12, 12});
        const std::size_t first = system.add(net, {.mass = 0.002, .radius = 0.02, .group = 1}, {0.1, 0, 0.2});
        for (const std::uint32_t corner : {0, 12}) system.points.pin(corner, {0, 0, -0.5});
        for (const std::uint32_t corner : {156, 168}) system.points.pin(corner, {0, 0, 0.9});
        for (const std::size_t k : {30, 31, 77}) system.points.end[k] = 0.05 + 0.006 * double(k);  // before and after
        ConstraintsOfKinds kinds;
        kinds[std::size_t(LinkKind::shear)] = {.compliance = 1e-4};
        kinds[std::size_t(LinkKind::bend)] = {.relaxation = 0.3};
        system.constraints.update = update;
        system.constraints.tear_factor = 1.3;
        system.constraints.add(net, kinds, first);
        system.add_force(springs_of<float>(net, {.stiffness = 10, .damping = 0.01}, first));
        system.add_force(aerodynamic_surface_of(net, AerodynamicDrag<float, 3>{.wind = {1.0f, 4.0f, 0.5f}}, first));
        system.add_force(DragOnPoints<float, 3>{{.wind = {1.0f, 4.0f, 0.5f}}});
        return system;
    }
};

/// Balls from two nozzles in a box, a ball that moves and turns through them, and a rope that they fall on.
template <class Integrator>
struct Fountain {
    using Boundary = Together<Walls<double, 2>, Collider<Sphere<double, 2>>>;
    using System = ParticleSystem<2, double, Integrator, Boundary>;

    System made(int threads) const {
        System system(Boundary(Walls<double, 2>::all({0, 0}, {1, 1}, {Contact::separate, 0.3}),
                               Collider<Sphere<double, 2>>{.shape = {0.08},
                                                           .friction = 0.5,
                                                           .position = {0.2, 0.12},
                                                           .linear_velocity = {0.7, 0.1},
                                                           .angular_velocity = 9}));
        system.threads = threads;
        system.restitution = 0.2;
        system.gravity = {0.5, -9.81};
        const auto net = rope<2>({0.5, 0.3}, {0.95, 0.3}, 12);
        system.add(net, {.mass = 0.01, .radius = 0.02});
        system.points.pin(0);
        system.points.pin(12);
        for (const std::size_t k : {4, 5, 9}) system.points.end[k] = 0.1 * double(k) - 0.25;
        system.constraints.update = ConstraintUpdate::averaged;
        system.constraints.add(net);
        system.collisions.emplace();
        system.collisions->restitution = 0.3;
        system.collisions->friction = 0.4;
        system.collisions->exclude(net.links);
        system.add_emitter({.position = {0.3, 0.8},
                            .direction = {1.0, -0.5},
                            .nozzle = 0.1,
                            .speed = 1.5,
                            .speed_spread = 0.5,
                            .cone = 0.4,
                            .rate = 300,
                            .lifespan = 0.35,
                            .lifespan_spread = 0.2,
                            .mass = 0.01,
                            .radius = 0.018,
                            .maximum = 50});
        system.add_emitter({.position = {0.8, 0.9},
                            .direction = {0, -1},
                            .nozzle = 0.1,
                            .rate = 80,
                            .start = 0.1,
                            .lifespan = 0.4,
                            .mass = 0.02,
                            .radius = 0.02,
                            .group = 4,
                            .seed = 5});
        return system;
    }
};

/// Is a run that is stopped, stored and made anew the same as one that is not?
/// \param check  of the states at the stop and at the end: that there is something to be lost on the way
template <class Scene, class Check>
void check_restart(const Scene& scene, int threads, int threads_after, const Check& check) {
    auto whole = scene.made(2);
    go(whole, before + after);

    const states::Folder folder;
    auto stopped = scene.made(threads);
    go(stopped, before);
    const auto state = state_of(stopped);
    write_state(folder / "state.hdf", state);
    using S = typename Scene::System::scalar_type;
    const auto read = read_state<S>(folder / "state.hdf");
    REQUIRE(same(read, state));

    auto continued = scene.made(threads_after);
    restore(continued, read);
    CHECK(same(state_of(continued), state));
    CHECK(continued.time() == stopped.time());
    CHECK(continued.steps() == std::uint64_t(before));
    go(continued, after);
    CHECK(same(state_of(continued), state_of(whole)));
    check(state, state_of(whole));
}

template <class S>
std::size_t rows(const State<S>& state, const char* name, int columns) {
    return table_of(state, name, columns).values.size() / std::size_t(columns);
}

void banner_has_torn(const State<float>& middle, const State<float>& end) {
    CHECK(rows(middle, "torn", 2) > 0);
    CHECK(rows(end, "torn", 2) > rows(middle, "torn", 2));
    CHECK(middle.size() == 168);
    CHECK(end.size() == 166);
    CHECK(end.facets.size() < middle.facets.size());
    CHECK(middle.facets.size() < 3 * 2 * 12 * 12);
}

void fountain_has_run(const State<double>& middle, const State<double>& end) {
    const auto next_id = [](const auto& state) { return detail::parameter_values(state, "system", "next_id")[0]; };
    CHECK(next_id(middle) > 60);
    CHECK(next_id(end) > next_id(middle) + 30);
    CHECK(next_id(middle) - double(middle.size()) > 5);  // so many have died
    CHECK(next_id(end) - double(end.size()) > next_id(middle) - double(middle.size()) + 30);
    CHECK(rows(middle, "impulses", 4) > 20);
    CHECK(rows(end, "impulses", 4) > 20);
}

/// The state half way, changed; does the run then end elsewhere?
template <class Scene, class Change>
bool matters(const Scene& scene, const Change& change) {
    using S = typename Scene::System::scalar_type;
    auto stopped = scene.made(2);
    go(stopped, before);
    State<S> state = state_of(stopped);
    change(state);
    go(stopped, after);
    auto continued = scene.made(2);
    restore(continued, state);
    go(continued, after);
    State<S> ends[2] = {state_of(stopped), state_of(continued)};
    for (State<S>& end : ends) end.tables.clear(), end.parameters.clear();
    return !states::same_bits(ends[0], ends[1]);
}

}  // namespace

TEST_CASE("Torn cloth in the wind goes on to the same bits with other numbers of threads", "[io][lagrangian]") {
    check_restart(Banner{}, 1, 3, banner_has_torn);
    check_restart(Banner{}, 4, 2, banner_has_torn);
    for (const auto update : {ConstraintUpdate::immediate, ConstraintUpdate::averaged})
        check_restart(Banner{update}, 1, 2, banner_has_torn);
}

TEST_CASE("Balls that are born, collide and die go on to the same bits with other numbers of threads",
          "[io][lagrangian]") {
    check_restart(Fountain<Verlet>{}, 1, 3, fountain_has_run);
    check_restart(Fountain<Verlet>{}, 4, 2, fountain_has_run);
    check_restart(Fountain<SymplecticEuler>{}, 1, 3, fountain_has_run);
}

}  // namespace particle_system_restart_tests
