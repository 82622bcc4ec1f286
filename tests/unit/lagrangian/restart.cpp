// part: arithmetic
/// \file A system of point masses that goes on from a state has the bits of one that was never stopped, whatever steps
/// have changed.
#include "support/catch.hpp"
#include "support/point_systems.hpp"

using namespace point_systems;

namespace restart_tests {
namespace {

constexpr int before = 200, after = 300;

/// \param check  of the states at the stop and at the end: that there is something to be lost on the way
template <class Scene, class Check>
void check_restart(const Scene& scene, int threads, int threads_after, const Check& check) {
    const auto state = state_after(scene, before, threads), end = state_after(scene, before + after);
    auto continued = scene.made(threads_after);
    restore(continued, state);
    CHECK(same(state_of(continued), state));
    go(continued, after);
    CHECK(same(state_of(continued), end));
    check(state, end);
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
    CHECK(rows(middle, "impulses", 4) > 5);
    CHECK(rows(end, "impulses", 4) > 10);
}

/// Whether a run that goes on from that, changed, ends elsewhere. What is stored but would not matter need not be.
template <class Scene>
class Altered {
public:
    using S = typename Scene::System::scalar_type;
    Altered(const Scene& scene) : scene_(scene), state_(state_after(scene, before)), end_(end_of(state_)) {}

    template <class Change>
    bool ends_elsewhere(const Change& change) const {
        State<S> changed = state_;
        change(changed);
        return !same(end_of(changed), end_);
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

}  // namespace

TEST_CASE("Torn cloth in the wind goes on to the same bits with other numbers of threads", "[lagrangian][slow]") {
    check_restart(Banner{}, 1, 3, banner_has_torn);
    check_restart(Banner{}, 4, 2, banner_has_torn);
    for (const auto update : {ConstraintUpdate::immediate, ConstraintUpdate::averaged})
        check_restart(Banner{update}, 1, 2, banner_has_torn);
}

TEST_CASE("Balls that are born, collide and die go on to the same bits with other numbers of threads",
          "[io][lagrangian]") {
    check_restart(Fountain<Verlet>{}, 4, 2, fountain_has_run);
#ifndef FIRN_TEST_QUICK
    check_restart(Fountain<Verlet>{}, 1, 3, fountain_has_run);
    check_restart(Fountain<SymplecticEuler>{}, 1, 3, fountain_has_run);
#endif
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

TEST_CASE("A run can go on from before its first step, and from a state of a run that went on", "[lagrangian]") {
    const Fountain<Verlet> scene;
    auto whole = scene.made(1), second = scene.made(1), third = scene.made(2);
    restore(second, state_of(whole));
    go(second, 120);
    restore(third, state_of(second));
    go(whole, before);
    go(third, before - 120);
    CHECK(same(state_of(third), state_of(whole)));
}

TEST_CASE("Forces lose what tore and what lost a point, and stay where the program knows them", "[lagrangian]") {
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

TEST_CASE("All that is stored of a system changes how it goes on", "[lagrangian][slow]") {
    const auto infinite = std::bit_cast<std::int64_t>(std::numeric_limits<double>::infinity());
    const Altered<Banner> banner(Banner{});
    CHECK(!banner.ends_elsewhere([](auto&) {}));
    CHECK(banner.ends_elsewhere([](auto& state) { std::ranges::fill(field_of(state, "since"), 0.0f); }));
    CHECK(banner.ends_elsewhere([](auto& state) { field_of(state, "inverse_mass")[80] = 0; }));
    CHECK(banner.ends_elsewhere([](auto& state) { field_of(state, "radius")[80] = 0.1f; }));
    CHECK(banner.ends_elsewhere([&](auto& state) { std::ranges::fill(table_of(state, "end"), infinite); }));
    CHECK(banner.ends_elsewhere([](auto& state) { table_of(state, "torn").clear(); }));
    CHECK(banner.ends_elsewhere([](auto& state) {  // by up to 1e-9 m, which no float shows
        for (auto& bits : table_of(state, "position")) {
            const std::int64_t other = bits + (1 << 22);
            if (float(std::bit_cast<double>(other)) == float(std::bit_cast<double>(bits))) bits = other;
        }
    }));
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
    CHECK(fountain.ends_elsewhere([](auto& state) { std::ranges::fill(state.body, 1); }));
    CHECK(fountain.ends_elsewhere([](auto& state) { parameter_of(state, "next_id")[0] += 1; }));
    CHECK(fountain.ends_elsewhere([](auto& state) { parameter_of(state, "restitution")[0] = 0; }));
    CHECK(fountain.ends_elsewhere([](auto& state) { parameter_of(state, "1_position")[0] += 1e-9; }));
}

}  // namespace restart_tests
