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

template <class Items>
auto& named(Items& items, const std::string& name) {
    const auto found = std::ranges::find_if(items, [&](const auto& item) { return item.name == name; });
    REQUIRE(found != items.end());
    return found->values;
}
auto& table_of(auto& state, const char* name) { return named(state.tables, name); }
auto& field_of(auto& state, const char* name) { return named(state.fields, name); }
auto& parameter_of(auto& state, const char* name) { return named(state.parameters, name); }

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
        for (std::uint32_t i = 0; i <= 12; ++i) {  // it tears from one side to the other
            system.points.pin(i, {0, 0, -0.1 - 0.1 * i});
            system.points.pin(156 + i, {0, 0, 0.1 + 0.1 * i});
        }
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
                            .direction = {1.0, -1.5},
                            .nozzle = 0.1,
                            .speed = 1.5,
                            .speed_spread = 0.5,
                            .cone = 0.4,
                            .rate = 400,
                            .lifespan = 0.4,
                            .lifespan_spread = 0.25,
                            .mass = 0.01,
                            .radius = 0.025,
                            .maximum = 60});
        system.add_emitter({.position = {0.8, 0.9},
                            .direction = {0, -1},
                            .nozzle = 0.1,
                            .speed = 2,
                            .rate = 150,
                            .start = 0.02,
                            .lifespan = 0.4,
                            .mass = 0.02,
                            .radius = 0.03,
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

std::size_t rows(const auto& state, const char* table, std::size_t columns) {
    return table_of(state, table).size() / columns;
}

void banner_has_torn(const State<float>& middle, const State<float>& end) {
    CHECK(rows(middle, "torn", 2) > 0);
    CHECK(rows(end, "torn", 2) > rows(middle, "torn", 2));
    CHECK(middle.size() == 167);
    CHECK(end.size() == 166);
    CHECK(end.facets.size() < middle.facets.size());
    CHECK(middle.facets.size() < 3 * 2 * 12 * 12);
}

void fountain_has_run(const State<double>& middle, const State<double>& end) {
    const auto next_id = [](const auto& state) { return parameter_of(state, "next_id")[0]; };
    CHECK(next_id(middle) > 60);
    CHECK(next_id(end) > next_id(middle) + 30);
    CHECK(next_id(middle) - double(middle.size()) > 5);  // so many have died
    CHECK(next_id(end) - double(end.size()) > next_id(middle) - double(middle.size()) + 30);
    CHECK(rows(middle, "impulses", 4) > 10);
    CHECK(rows(end, "impulses", 4) > 10);
}

/// The state half way.
template <class Scene>
auto middle_of(const Scene& scene) {
    auto system = scene.made(2);
    go(system, before);
    return state_of(system);
}

/// Whether a run that goes on from that, changed, ends elsewhere. What is stored but would not matter need not be.
template <class Scene>
class Altered {
public:
    using S = typename Scene::System::scalar_type;
    Altered(const Scene& scene) : scene_(scene), state_(middle_of(scene)), end_(end_of(state_)) {}

    template <class Change>
    bool ends_elsewhere(const Change& change) const {
        State<S> changed = state_;
        change(changed);
        return !states::same_bits(end_of(changed), end_);
    }

private:
    State<S> end_of(const State<S>& from) const {
        auto system = scene_.made(2);
        restore(system, from);
        go(system, after);
        return state_of(system.points, system.facets, system.time(), system.steps());
    }
    Scene scene_;
    State<S> state_, end_;
};

/// Restoring says why it does not, and leaves the system as it was.
template <class System, class S>
std::string refusal(System&& system, const State<S>& state) {
    const State<S> as_it_was = state_of(system);
    const std::string text = states::message<io_error>([&] { restore(system, state); });
    CHECK(same(state_of(system), as_it_was));
    return text;
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

TEST_CASE("Constraints that are ordered anew half way, when some are gone, keep that order after a restart",
          "[io][lagrangian]") {
    const auto made = [](int threads) {
        auto system = Banner{ConstraintUpdate::immediate}.made(threads);
        return system;
    };
    auto whole = made(1), continued = made(2);
    go(whole, 150);
    REQUIRE(!whole.torn().empty());
    whole.constraints.update = continued.constraints.update = ConstraintUpdate::coloured;
    go(whole, before - 150);
    restore(continued, state_of(whole));
    go(whole, after);
    go(continued, after);
    CHECK(same(state_of(continued), state_of(whole)));
}

TEST_CASE("A run can go on from before its first step, and from a state of a run that went on", "[io][lagrangian]") {
    const Fountain<Verlet> scene;
    auto whole = scene.made(1), second = scene.made(1), third = scene.made(2);
    restore(second, state_of(whole));
    go(second, 120);
    restore(third, state_of(second));
    go(whole, before);
    go(third, before - 120);
    CHECK(same(state_of(third), state_of(whole)));
}

TEST_CASE("Forces lose what tore and what lost a point, and stay where the program knows them", "[io][lagrangian]") {
    const auto net = cloth({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {12, 12});
    auto stopped = Banner{}.made(1), continued = Banner{}.made(1);
    auto &then = stopped.add_force(springs_of<float>(net, {.stiffness = 1})),
         &now = continued.add_force(springs_of<float>(net, {.stiffness = 1}));
    go(stopped, before);
    restore(continued, state_of(stopped));
    CHECK(then.size() < net.links.size() - 10);
    REQUIRE(now.size() == then.size());
    for (std::size_t k = 0; k < now.size(); ++k) CHECK(now.corners(k) == then.corners(k));
}

TEST_CASE("All that is stored of a system changes how it goes on", "[io][lagrangian]") {
    const auto infinite = std::bit_cast<std::int64_t>(std::numeric_limits<double>::infinity());
    const Altered<Banner> banner(Banner{});
    CHECK(!banner.ends_elsewhere([](auto&) {}));
    CHECK(banner.ends_elsewhere([](auto& state) { std::ranges::fill(field_of(state, "since"), 0.0f); }));
    CHECK(banner.ends_elsewhere([](auto& state) { field_of(state, "inverse_mass")[80] = 0; }));
    CHECK(banner.ends_elsewhere([](auto& state) { field_of(state, "radius")[80] = 0.1f; }));
    CHECK(banner.ends_elsewhere([&](auto& state) { std::ranges::fill(table_of(state, "end"), infinite); }));
    CHECK(banner.ends_elsewhere([](auto& state) { table_of(state, "torn").clear(); }));
    CHECK(banner.ends_elsewhere([](auto& state) { table_of(state, "constraint_colours").clear(); }));
    CHECK(banner.ends_elsewhere([](auto& state) {
        auto& gone = table_of(state, "constraints_gone");
        REQUIRE(gone[0] > 0);
        gone.insert(gone.begin(), 0);
        table_of(state, "constraint_colours").clear();
    }));
    CHECK(banner.ends_elsewhere([](auto& state) { parameter_of(state, "gravity")[1] = -9.8; }));
    CHECK(banner.ends_elsewhere([](auto& state) { parameter_of(state, "damping")[0] = 0; }));
    CHECK(banner.ends_elsewhere([](auto& state) { parameter_of(state, "iterations")[0] = 3; }));

    const Altered<Fountain<Verlet>> fountain(Fountain<Verlet>{});
    CHECK(!fountain.ends_elsewhere([](auto&) {}));
    CHECK(fountain.ends_elsewhere([](auto& state) {
        table_of(state, "emitted").clear();
        table_of(state, "emitters")[1] = 0;
    }));
    CHECK(fountain.ends_elsewhere([](auto& state) { table_of(state, "impulses").clear(); }));
    CHECK(fountain.ends_elsewhere([](auto& state) {  // the lengths of two steps before
        auto& values = table_of(state, "impulses");
        for (std::size_t k = 3; k < values.size(); k += 4) values[k] = 0;
    }));
    CHECK(fountain.ends_elsewhere([](auto& state) { std::ranges::fill(state.material, 1); }));
    CHECK(fountain.ends_elsewhere([](auto& state) { parameter_of(state, "next_id")[0] += 1; }));
    CHECK(fountain.ends_elsewhere([](auto& state) { parameter_of(state, "restitution")[0] = 0; }));
    CHECK(fountain.ends_elsewhere([](auto& state) { parameter_of(state, "1_position")[0] += 1e-9; }));
}

TEST_CASE("A state that is not of the same system is refused with what differs", "[io][lagrangian]") {
    using states::holds;
    const auto state = middle_of(Fountain<Verlet>{});
    const auto made = [] { return Fountain<Verlet>{}.made(1); };
    CHECK(holds(refusal(Fountain<SymplecticEuler>{}.made(1), state), "'verlet' for integrator"));
    const auto changed = [&](const auto& change) {
        auto other = state;
        change(other);
        return refusal(made(), other);
    };
    CHECK(holds(changed([](auto& s) { s.dimension = 3; }), "3 dimensions"));
    CHECK(holds(changed([](auto& s) { s.attributes[1].value = "walls"; }), "'walls' for boundary"));
    CHECK(holds(changed([](auto& s) { s.attributes[2].value = "float"; }), "'float' for precision"));
    CHECK(holds(changed([](auto& s) { s.attributes.clear(); }), "nothing for integrator"));

    const auto refused_by = [&](const auto& change) {
        auto system = made();
        change(system);
        return refusal(system, state);
    };
    CHECK(holds(refused_by([](auto& s) { s.step(1e-3); }), "has taken 1 steps"));
    CHECK(holds(refused_by([](auto& s) { s.remove_if([](std::size_t i) { return i == 12; }); }), "same points"));
    CHECK(holds(refused_by([](auto& s) { s.constraints.add({0, 7}, 1); }), "constraints added to it"));
    CHECK(holds(refused_by([](auto& s) { s.add_emitter({}); }), "2 emitters, this system has 3"));
    CHECK(holds(refused_by([](auto& s) { s.collisions.reset(); }), "let those of this system collide"));
    const std::array<std::array<std::uint32_t, 2>, 1> pair{{{0, 99}}};
    CHECK(holds(refused_by([&](auto& s) { s.collisions->exclude(pair); }), "point 99"));
    CHECK(holds(refused_by([](auto& s) { s.constraints.add({0, 99}, 1); }), "constraints added to it"));
    CHECK(holds(refused_by([](auto& s) {
                    Springs<double, 2> springs;
                    springs.add({0, 99});
                    s.add_force(springs);
                }),
                "Point 99"));
    auto slower = Fountain<Verlet>::System(made().boundary);
    slower.add(rope<2>({0.5, 0.3}, {0.95, 0.3}, 12), {});
    slower.constraints.add(rope<2>({0.5, 0.3}, {0.95, 0.3}, 12));
    slower.collisions.emplace();
    for (int k = 0; k < 2; ++k) slower.add_emitter({.rate = 1});
    CHECK(holds(refusal(slower, state), "Add the same emitters"));

    auto with_more_points = Banner{}.made(1);
    with_more_points.points.add({});
    CHECK(holds(refusal(with_more_points, middle_of(Banner{})), "Add the same points"));

    for (std::size_t k = 0; k < state.fields.size(); ++k)
        if (const std::string name = state.fields[k].name; name != "pinned")
            CHECK(holds(changed([&](auto& s) { s.fields.erase(s.fields.begin() + int(k)); }), name));
    for (std::size_t k = 0; k < state.tables.size(); ++k)
        CHECK(holds(changed([&](auto& s) { s.tables.erase(s.tables.begin() + int(k)); }), state.tables[k].name));
    for (std::size_t k = 0; k < state.parameters.size(); ++k)
        CHECK(holds(changed([&](auto& s) { s.parameters.erase(s.parameters.begin() + int(k)); }),
                    state.parameters[k].name));
}

TEST_CASE("What no run could have written is refused, whatever the numbers", "[io][lagrangian]") {
    const auto state = middle_of(Fountain<Verlet>{});
    const auto refused = [&](const auto& change) {
        auto other = state;
        change(other);
        return refusal(Fountain<Verlet>{}.made(1), other) != "(nothing thrown)";
    };
    const double infinite = std::numeric_limits<double>::infinity(), no_number = infinite - infinite;
    for (const char* name : {"position", "velocity", "mass", "inverse_mass", "radius", "since"}) {
        CAPTURE(name);
        CHECK(refused([&](auto& s) { field_of(s, name)[3] = no_number; }));
        CHECK(refused([&](auto& s) { field_of(s, name)[3] = infinite; }));
    }
    for (const char* name : {"mass", "inverse_mass", "radius", "since"})
        CHECK(refused([&](auto& s) { field_of(s, name)[3] = -1; }));
    CHECK(refused([](auto& s) { field_of(s, "mass")[3] = 0; }));
    CHECK(refused([](auto& s) { std::swap(s.id[3], s.id[4]); }));
    CHECK(refused([](auto& s) { s.id[3] = s.id[4]; }));
    CHECK(refused([](auto& s) { s.id[0] = -1; }));
    CHECK(refused([](auto& s) { s.id.back() = std::int64_t(parameter_of(s, "next_id")[0]); }));
    CHECK(refused([](auto& s) { s.facets[0] = std::int64_t(s.size()); }));
    CHECK(refused([&](auto& s) { s.time = no_number; }));
    for (const char* name : {"gravity", "damping", "iterations", "restitution", "next_id", "constraints", "impulses"}) {
        CAPTURE(name);
        CHECK(refused([&](auto& s) { parameter_of(s, name)[0] = no_number; }));
        CHECK(refused([&](auto& s) { parameter_of(s, name)[0] = infinite; }));
        CHECK(refused([&](auto& s) { parameter_of(s, name).push_back(0); }));
        if (std::string(name) != "gravity") CHECK(refused([&](auto& s) { parameter_of(s, name)[0] = -1; }));
    }
    for (const char* name : {"iterations", "next_id", "constraints"})
        CHECK(refused([&](auto& s) { parameter_of(s, name)[0] += 0.5; }));
    CHECK(refused([&](auto& s) { table_of(s, "end")[3] = std::bit_cast<std::int64_t>(no_number); }));
    CHECK(refused([&](auto& s) { table_of(s, "end").pop_back(); }));
    CHECK(refused([](auto& s) { table_of(s, "torn") = {0, std::int64_t(s.size())}; }));
    CHECK(refused([](auto& s) { table_of(s, "torn") = {-1, 0}; }));
    CHECK(refused([](auto& s) { table_of(s, "constraints_gone").clear(); }));  // some lost their points
    CHECK(refused([](auto& s) { std::ranges::reverse(table_of(s, "constraints_gone")); }));
    CHECK(refused([](auto& s) { table_of(s, "constraints_gone").push_back(1000); }));
    CHECK(refused([](auto& s) { table_of(s, "constraint_colours") = {0}; }));
    CHECK(refused([](auto& s) { table_of(s, "constraint_colours").assign(2, 0); }));
    for (const int by : {-1, 1}) {
        CHECK(refused([&](auto& s) { table_of(s, "emitters")[0] += by; }));
        CHECK(refused([&](auto& s) { table_of(s, "emitters")[1] += by; }));
    }
    CHECK(refused([](auto& s) { table_of(s, "emitters")[1] = -1; }));
    CHECK(refused([](auto& s) { table_of(s, "emitted")[0] = -1; }));
    CHECK(refused([](auto& s) { table_of(s, "emitted")[0] = table_of(s, "emitted")[2]; }));
    CHECK(refused([&](auto& s) { table_of(s, "emitted")[1] = std::bit_cast<std::int64_t>(no_number); }));
    CHECK(refused([](auto& s) { table_of(s, "impulses")[0] = -1; }));
    CHECK(refused([](auto& s) { table_of(s, "impulses")[0] = 0; }));
    CHECK(refused([](auto& s) { table_of(s, "impulses")[4] = table_of(s, "impulses")[0]; }));
    CHECK(refused([&](auto& s) { table_of(s, "impulses")[2] = std::bit_cast<std::int64_t>(infinite); }));
    CHECK(refused([](auto& s) { parameter_of(s, "impulses")[0] = 0; }));
    CHECK(refused([](auto& s) { parameter_of(s, "1_linear_velocity").pop_back(); }));
}

TEST_CASE("Any number of a state, made any other, is taken over or refused, and does no harm", "[io][lagrangian]") {
    const auto check = [](const auto& scene) {
        using S = typename std::remove_cvref_t<decltype(scene)>::System::scalar_type;
        const auto state = middle_of(scene);
        std::uint64_t drawn = 0;
        const auto draw = [&](std::uint64_t below) { return random_bits(7, drawn++) % below; };
        const std::int64_t n = std::int64_t(state.size());
        const std::int64_t whole[] = {-1,        0,          1,         2,         n - 1,         n,
                                      INT32_MAX, UINT32_MAX, INT64_MAX, INT64_MIN, 0x7ff8LL << 48};
        const double real[] = {-1, -0.0, 0.5, 1e-320, 1e30, 1e300, INFINITY, NAN};
        int taken_over = 0, refused = 0;
        for (int k = 0; k < test_support::fewer_if_sanitized(600, 200); ++k) {
            auto other = state;
            const auto change_whole = [&](auto& values) {
                if (values.empty()) return;
                auto& value = values[draw(values.size())];
                using Number = std::remove_cvref_t<decltype(value)>;
                const std::uint64_t how = draw(4);
                value = how == 0   ? Number(std::uint64_t(value) + draw(5) - 2)
                        : how == 1 ? Number(random_bits(8, drawn++))
                                   : Number(whole[draw(std::size(whole))]);
            };
            switch (draw(8)) {
                case 0: {
                    auto& values = other.fields[draw(other.fields.size())].values;
                    values[draw(values.size())] = S(real[draw(std::size(real))]);
                    break;
                }
                case 1: {
                    auto& values = other.parameters[draw(other.parameters.size())].values;
                    values[draw(values.size())] = S(real[draw(std::size(real))]);
                    break;
                }
                case 2:
                    change_whole(other.id);
                    break;
                case 3:
                    change_whole(other.facets);
                    break;
                case 4: {  // a row less, or one twice
                    auto& [name, columns, values] = other.tables[draw(other.tables.size())];
                    if (values.empty()) break;
                    const auto row = values.begin() + std::ptrdiff_t(draw(values.size() / columns)) * columns;
                    const std::vector<std::int64_t> copy(row, row + columns);
                    if (draw(2) == 0)
                        values.erase(row, row + columns);
                    else
                        values.insert(row, copy.begin(), copy.end());
                    break;
                }
                default:
                    change_whole(other.tables[draw(other.tables.size())].values);
            }
            auto system = scene.made(1);
            system.warn = [](const std::string&) {};
            const auto as_it_was = state_of(system);
            try {
                restore(system, other);
                ++taken_over;
                system.iterations = std::min(system.iterations, 8);
                try {
                    go(system, 3);
                } catch (const error&) {  // points that fly apart
                }
            } catch (const io_error& text) {
                ++refused;
                CHECK(same(state_of(system), as_it_was));
            }
        }
        CHECK(taken_over > 20);
        CHECK(refused > 60);
    };
    check(Banner{});
    check(Fountain<Verlet>{});
}

}  // namespace particle_system_restart_tests
