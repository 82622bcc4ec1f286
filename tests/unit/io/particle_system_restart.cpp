/// \file A system of point masses goes on from a file; what does not fit is refused, and nothing that a file says can
/// do harm.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/point_systems.hpp"
#include <firn/io/state_reader.hpp>
#include <firn/io/state_writer.hpp>

#include "example_state.hpp"

using namespace point_systems;

namespace particle_system_restart_tests {
namespace {

constexpr int before = test_support::fewer_if_slow(200, 40), after = test_support::fewer_if_slow(300, 20);

/// Restoring says why it does not, and leaves the system as it was.
template <class System, class S>
std::string refusal(System&& system, const State<S>& state) {
    const State<S> as_it_was = state_of(system);
    const std::string text = states::message<io_error>([&] { restore(system, state); });
    CHECK(same(state_of(system), as_it_was));
    return text;
}

template <class Scene>
void check_restart(const Scene& scene, int threads, int threads_after) {
    using S = typename Scene::System::scalar_type;
    const states::Folder folder;
    const auto state = state_after(scene, before, threads);
    write_state(folder / "state.hdf", state);
    const auto read = read_state<S>(folder / "state.hdf");
    REQUIRE(same(read, state));
    auto continued = scene.made(threads_after);
    restore(continued, read);
    CHECK(continued.time() == state.time);
    CHECK(continued.steps() == std::uint64_t(before));
    go(continued, after);
    CHECK(same(state_of(continued), state_after(scene, before + after)));
}

}  // namespace

TEST_CASE("A system goes on from a file to the bits of one never stopped, with other numbers of threads", "[io]") {
    check_restart(Banner{}, 1, 3);
    check_restart(Fountain<Verlet>{}, 4, 2);
}

TEST_CASE("A state that is not of the same system is refused with what differs", "[io]") {
    using states::holds;
    const auto state = state_after(Fountain<Verlet>{}, before);
    const auto made = [] { return Fountain<Verlet>{}.made(1); };
    const auto changed = [&](const auto& change) {
        auto other = state;
        change(other);
        return refusal(made(), other);
    };
    CHECK(holds(changed([](auto& s) { s.dimension = 3; }), "3 dimensions"));
    CHECK(holds(changed([](auto& s) { s.attributes[0].value = "symplectic_euler"; }), "for integrator"));
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
    CHECK(holds(refused_by([](auto& s) { s.constraints.add({0, 7}, 1); }), "'24 averaged constraints"));
    CHECK(holds(refused_by([](auto& s) { s.add_emitter({}); }), "nothing where this run says 'emitter: rate 100"));
    CHECK(holds(refused_by([](auto& s) { s.collisions.reset(); }),
                "passes 4 and 2, remembered' where this run says nothing"));
    const std::array<std::array<std::uint32_t, 2>, 1> pair{{{0, 99}}};
    CHECK(holds(refused_by([&](auto& s) { s.collisions->exclude(pair); }), "point 99"));
    CHECK(holds(refused_by([](auto& s) { s.constraints.add({0, 99}, 1); }), "'24 averaged constraints"));
    CHECK(holds(refused_by([](auto& s) {
                    Springs<double, 2> springs;
                    springs.add({0, 99});
                    s.add_force(springs);
                }),
                "nothing where this run says 'force: "));
    auto slower = Fountain<Verlet>::System(made().boundary);
    slower.add(rope<2>({0.5, 0.3}, {0.95, 0.3}, 12), {});
    slower.constraints.update = ConstraintUpdate::averaged;
    slower.constraints.add(rope<2>({0.5, 0.3}, {0.95, 0.3}, 12));
    slower.collisions.emplace();
    slower.collisions->restitution = 0.3;
    slower.collisions->friction = 0.4;
    for (int k = 0; k < 2; ++k) slower.add_emitter({.rate = 1});
    CHECK(holds(refusal(slower, state), "where this run says 'emitter: rate 1 1/s"));

    auto with_more_points = Banner{}.made(1);
    with_more_points.points.add({});
    CHECK(holds(refusal(with_more_points, state_after(Banner{}, before)), "Add the same points"));

    for (std::size_t k = 0; k < state.fields.size(); ++k)
        if (const std::string name = state.fields[k].name; name != "pinned")
            CHECK(holds(changed([&](auto& s) { s.fields.erase(s.fields.begin() + int(k)); }), name));
    for (std::size_t k = 0; k < state.tables.size(); ++k)
        CHECK(holds(changed([&](auto& s) { s.tables.erase(s.tables.begin() + int(k)); }), state.tables[k].name));
    for (std::size_t k = 0; k < state.parameters.size(); ++k)
        CHECK(holds(changed([&](auto& s) { s.parameters.erase(s.parameters.begin() + int(k)); }),
                    state.parameters[k].name));
}

TEST_CASE("What no run could have written is refused, whatever the numbers", "[io]") {
    const auto state = state_after(Fountain<Verlet>{}, before);
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
    CHECK(refused([&](auto& s) { parameter_of(s, "1_position")[1] = no_number; }));
    CHECK(refused([](auto& s) { parameter_of(s, "1_rotation")[0] = 2; }));
}

TEST_CASE("Positions go on in double; states of an earlier firn have them rounded", "[io]") {
    auto system = Banner{}.made(1);
    go(system, before);
    const auto state = state_of(system);
    const auto restored = [&](const auto& change) {
        auto other = state;
        change(other);
        auto next = Banner{}.made(1);
        restore(next, other);
        return next;
    };
    CHECK(restored([](auto&) {}).points.position == system.points.position);
    const auto rounded = restored(
        [](auto& s) { std::erase_if(s.tables, [](const StateTable& each) { return each.name == "position"; }); });
    CHECK(rounded.points.position != system.points.position);
    for (std::size_t i = 0; i < system.points.size(); ++i)
        CHECK(rounded.points.position[i] == cast<double>(cast<float>(system.points.position[i])));

    const auto refused = [&](const auto& change) {
        auto other = state;
        change(other);
        return states::holds(refusal(Banner{}.made(1), other), "'position' is invalid");
    };
    CHECK(refused([](auto& s) { table_of(s, "position")[5] = std::bit_cast<std::int64_t>(0.3); }));
    CHECK(refused([](auto& s) { table_of(s, "position")[5] = std::bit_cast<std::int64_t>(std::nan("")); }));
    CHECK(refused([](auto& s) { table_of(s, "position").resize(3); }));
    CHECK(refused([](auto& s) { field_of(s, "position")[5] += 1; }));
    CHECK(std::ranges::none_of(state_after(Fountain<Verlet>{}, 1).tables,
                               [](const StateTable& each) { return each.name == "position"; }));
}

TEST_CASE("Any number of a state, made any other, is taken over or refused, and does no harm", "[io]") {
    const auto check = [](const auto& scene) {
        using S = typename std::remove_cvref_t<decltype(scene)>::System::scalar_type;
        const auto state = state_after(scene, before);
        std::uint64_t drawn = 0;
        const auto draw = [&](std::uint64_t below) { return random_bits(7, drawn++) % below; };
        const std::int64_t n = std::int64_t(state.size());
        const std::int64_t whole[] = {-1,        0,          1,         2,         n - 1,         n,
                                      INT32_MAX, UINT32_MAX, INT64_MAX, INT64_MIN, 0x7ff8LL << 48};
        const double real[] = {-1, -0.0, 0.5, 1e-320, 1e30, 1e300, INFINITY, NAN};
        int taken_over = 0, refused = 0;
        for (int k = 0; k < test_support::fewer_if_slow(600, 80); ++k) {
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
        CHECK(taken_over > 10);
        CHECK(refused > 20);
    };
    check(Banner{});
    check(Fountain<Verlet>{});
}

TEST_CASE("A system that has gone wrong is not written", "[io][lagrangian]") {
    ParticleSystem<2, double> system;
    system.points.add({.position = {0.0, 0.0}});
    system.points.add({.position = {1.0, 0.0}});
    system.points.velocity[1][0] = std::numeric_limits<double>::quiet_NaN();
    CHECK(test_support::holds(states::message<particle_error>([&] { state_of(system); }), "Point 1"));
}

}  // namespace particle_system_restart_tests
