// A restart to the same bits refuses a state of a run that was shaped by something else, and shows what it is.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/firn.hpp>
#include <firn/io/particle_system_state.hpp>
#include <firn/io/states.hpp>
#include <firn/lagrangian.hpp>

#include "example_state.hpp"

#include <algorithm>
#include <memory>

using namespace firn;
using test_support::check_refused;
using test_support::message;

namespace settings_tests {
namespace {

template <class Boundary, class Law = OneField>
auto scene(const Boundary& boundary, const Law& law = {}, double young = 1e4) {
    Simulation run(Domain<2>{.lower = {0, 0}, .upper = {1, 1}, .cell_size = 1.0 / 16},
                   FixedCorotated<double>::from_young_poisson(young, 0.3), boundary, law);
    run.add(sample_box<2>({0.4, 0.4}, {0.6, 0.6}, {.spacing = 1.0 / 32}), 1000, {0.0, -1.0});
    run.step();
    return run;
}
auto walls(double friction) { return Walls<double, 2>::all({0, 0}, {1, 1}, {Contact::separate, friction}); }

std::shared_ptr<const DistanceNumbers<float, 2>> disc(double radius) {
    DistanceNumbers<float, 2> all{.lower = {-0.5, -0.5}, .spacing = 1.0 / 16, .nodes = {17, 17}, .values = {}};
    for (int i = 0; i < 17; ++i)
        for (int j = 0; j < 17; ++j) all.values.push_back(float(std::hypot(i / 16.0 - 0.5, j / 16.0 - 0.5) - radius));
    return std::make_shared<const DistanceNumbers<float, 2>>(all);
}
Collider<DistanceGrid<double, 2>> grid(double radius) { return {.shape = {disc(radius)}, .position = {0.5, 0.0}}; }

/// As restore() of a run into another one; what it says, or "taken".
template <class From, class Into>
std::string said(From from, Into into, Restart how = Restart::same_bits) {
    try {
        restore(into, state_of(from), how);
    } catch (const io_error& refused) {
        return refused.what();
    }
    for (int k = 0; k < 3; ++k) from.step(), into.step();
    CHECK((how != Restart::same_bits || state_of(from) == state_of(into)));
    return "taken";
}
void check_holds(const std::string& text, const std::string& part) {
    CAPTURE(text);
    CHECK(text.find(part) != std::string::npos);
}

/// A boundary with a table that no parameter names.
template <bool Told>
struct Terrain {
    std::shared_ptr<const std::vector<double>> heights;  // [m]
    static constexpr const char* name = "terrain";
    static constexpr auto parameters() { return std::tuple<>{}; }
    std::uint64_t digest() const
        requires Told
    {
        return Digest().add(*heights).value();
    }
    template <class S>
    Vec<S, 2> velocity(const Vec<S, 2>& x, const Vec<S, 2>& v) const {
        return select(x[1] < S((*heights)[0]), Vec<S, 2>::zero(), v);
    }
    bool reaches(const Vec<double, 2>& lower, const Vec<double, 2>&) const { return lower[1] < (*heights)[0]; }
};
template <bool Told>
Terrain<Told> terrain(double height) {
    return {std::make_shared<const std::vector<double>>(std::vector{height, 1.0})};
}

}  // namespace

TEST_CASE("a restart refuses another friction in the tenth digit, and shows all digits of both") {
    CHECK(said(scene(walls(1.0 / 3)), scene(walls(1.0 / 3))) == "taken");
    const std::string refused = said(scene(walls(1.0 / 3)), scene(walls(0.333333333)));
    check_holds(refused, "'boundary: lower face of axis 0: separate, friction 0.3333333333333333'");
    check_holds(refused, "where this run says 'boundary: lower face of axis 0: separate, friction 0.333333333'");
    // The same nine digits are the same parameters for another build.
    CHECK(said(scene(walls(1.0 / 3)), scene(walls(0.333333333)), Restart::other_build) == "taken");
    CHECK(said(scene(walls(1.0 / 3)), scene(walls(0.3)), Restart::other_build) != "taken");

    CoulombContact law{.friction = 0.3}, other{.friction = 0.3 + 1e-11};
    CHECK(said(scene(walls(0), law), scene(walls(0), law)) == "taken");
    check_holds(said(scene(walls(0), law), scene(walls(0), other)), "friction 0.30000000001, normals");
    law.set_pair(0, 1, {.friction = 0.6});
    other = CoulombContact{.friction = 0.3};
    other.set_pair(0, 1, {.friction = 0.6 + 1e-10});
    check_holds(said(scene(walls(0), law), scene(walls(0), other)), "0 and 1: separate, friction 0.6000000001");
}

TEST_CASE("a restart refuses other distances of a shape, however deep it lies in the boundary") {
    const auto each = [](const auto& made) {
        CHECK(said(scene(made(0.2)), scene(made(0.2))) == "taken");
        check_holds(said(scene(made(0.2)), scene(made(0.2 + 1e-6))), "distance_grid: digest ");
    };
    each([](double r) { return grid(r); });
    each([](double r) { return Together(walls(0.3), grid(r)); });
    each([](double r) { return BoundaryList<Collider<DistanceGrid<double, 2>>>{{grid(0.1), grid(r)}}; });
    each([](double r) { return GapContact{Together(walls(0.3), grid(r))}; });
    each([](double r) {
        return Collider<Complement<DistanceGrid<double, 2>>>{.shape = {{disc(r)}}, .position = {0.5, 0.5}};
    });
}

TEST_CASE("a restart refuses another number of boundaries in a list") {
    const auto list = [](std::size_t n) {
        return BoundaryList<Terrain<true>>{std::vector<Terrain<true>>(n, terrain<true>(0.1))};
    };
    CHECK(said(scene(list(2)), scene(list(2))) == "taken");
    check_holds(said(scene(list(2)), scene(list(3))),
                "'boundary: 2 in the list' where this run says 'boundary: 3 in the list'");
    // More than an attribute of a state can hold.
    CHECK(said(scene(list(2000)), scene(list(2000))) == "taken");
    CHECK(said(scene(list(2000)), scene(list(2001))) != "taken");
}

TEST_CASE("a run with many colliders, or many pairs of contact groups, is written, read and gone on from") {
    // 7,000 parameters, and descriptions of 45 kB and 80 kB.
    const auto folder = states::Folder();
    const auto through_a_file = [&](auto from, auto into) {
        write_state(folder / "many.hdf", state_of(from));
        restore(into, read_state<double>(folder / "many.hdf"));
        from.step(), into.step();
        return state_of(from) == state_of(into);
    };
    const auto discs = [shared = grid(0.01)](double friction_of_one) {
        BoundaryList<Collider<DistanceGrid<double, 2>>> all;
        for (int i = 0; i < 1000; ++i) {
            auto one = shared;
            one.position = {0.02 + 0.005 * (i % 190), 1.5 + 0.01 * (i / 190)};  // above the domain
            one.linear_velocity = {1e-3 * i, 0.5};
            one.friction = i == 700 ? friction_of_one : 0.25;
            all.all.push_back(one);
        }
        return all;
    };
    CHECK(through_a_file(scene(discs(0.25)), scene(discs(0.25))));
    const auto law = [](double friction_of_one) {
        CoulombContact all{.friction = 0.1};
        for (int b = 1; b < 60; ++b)
            for (int a = 0; a < b; ++a) all.set_pair(a, b, {.friction = a == 7 && b == 50 ? friction_of_one : 0.2});
        return all;
    };
    CHECK(through_a_file(scene(walls(0), law(0.2)), scene(walls(0), law(0.2))));

    // Of such lists, a message shows the items that differ.
    const std::string of_discs = said(scene(discs(0.25)), scene(discs(0.5))),
                      of_law = said(scene(walls(0), law(0.2)), scene(walls(0), law(0.5)));
    check_holds(of_discs,
                "says 'collider_distance_grid: separate, friction 0.25' for boundary_conditions; this run "
                "has 'collider_distance_grid: separate, friction 0.5'");
    check_holds(of_law, "says '7 and 50: separate, friction 0.2, reach 0.25' for contact_law");
    CHECK(of_discs.size() < 500);
    CHECK(of_law.size() < 500);
}

TEST_CASE("a restart tells data of one's own policies by their digest, and warns where it cannot tell") {
    CHECK(said(scene(terrain<true>(0.1)), scene(terrain<true>(0.1))) == "taken");
    check_holds(said(scene(terrain<true>(0.1)), scene(terrain<true>(0.1 + 1e-16))), "boundary, terrain: digest ");
    auto from = scene(terrain<false>(0.1)), into = scene(terrain<false>(0.1));
    std::vector<std::string> warnings;
    into.warn = [&](const std::string& text) { warnings.push_back(text); };
    restore(into, state_of(from));
    REQUIRE(warnings.size() == 1);
    check_holds(warnings[0], "the boundary has data, but neither parameters nor a function digest()");
    auto silent = scene(Together(walls(0.3), grid(0.2)));
    silent.warn = into.warn;
    auto same = scene(Together(walls(0.3), grid(0.2)));
    restore(silent, state_of(same));
    CHECK(warnings.size() == 1);
}

TEST_CASE("messages about the domain and the material show all digits of both") {
    auto other = scene(walls(0));
    Simulation moved(Domain<2>{.lower = {0, 0}, .upper = {1, std::nextafter(1.0, 2.0)}, .cell_size = 1.0 / 16},
                     FixedCorotated<double>::from_young_poisson(1e4, 0.3), walls(0));
    check_refused<io_error>([&] { restore(moved, state_of(other)); },
                            "upper = (1, 1), that of this run has (1, 1.0000000000000002)");
    const std::string refused = said(scene(walls(0)), scene(walls(0), OneField{}, std::nextafter(1e4, 2e4)));
    check_holds(refused, "mu = 3846.153846153846, that of this run has 3846.15384615384");
}

TEST_CASE("a restart compares sources and sinks that are there, and takes those that follow") {
    const auto with = [](double rate, double sink) {
        auto run = scene(walls(0));
        if (rate > 0) run.add_source({.samples = {{{0.2, 0.9}}, 1e-4}, .rate = rate});
        if (sink > 0) run.add_sink({{0, 0}, {sink, 0.1}});
        return run;
    };
    CHECK(said(with(1.0 / 3, 0.5), with(1.0 / 3, 0.5)) == "taken");
    check_holds(said(with(1.0 / 3, 0), with(0.333333333, 0)), "rate 0.333333333 1/s");
    check_holds(said(with(0, 0.1 + 0.2), with(0, 0.3)), "(0.30000000000000004, 0.1)");
    check_holds(said(with(0, 0), with(1, 0)), "'none' where this run says 'source 0: 1 particles");
    auto run = with(0, 0);  // sources may be added after restore()
    auto other = with(2, 0.5);
    restore(run, state_of(other));
}

TEST_CASE("a state of an earlier version, which says nothing of all this, is compared as before") {
    auto from = scene(Together(walls(1.0 / 3), grid(0.2))), into = scene(Together(walls(0.333333333), grid(0.3)));
    State<double> state = state_of(from);
    std::erase_if(state.attributes, [](const StateAttribute& a) { return a.name == "settings"; });
    restore(into, state);
    auto others = scene(Together(walls(0.3), grid(0.2)));
    CHECK_THROWS_AS(restore(others, state), io_error);  // in nine digits
}

TEST_CASE("a particle system refuses a state of other constraints, forces, emitters, collisions or friction") {
    struct Choice {
        double friction = 0.3, compliance = 1e-4, stiffness = 100, rate = 10, collisions = 0.1;
    };
    using System = ParticleSystem<3, double, Verlet, Walls<double, 3>>;
    const auto made = [](const Choice& choice) {
        System system(Walls<double, 3>::all({0, 0, 0}, {1, 1, 1}, {Contact::separate, choice.friction}));
        const auto net = cloth({0.3, 0.5, 0.3}, {0.4, 0, 0}, {0, 0, 0.4}, {3, 3});
        system.add(net, {.mass = 0.01, .radius = 0.01});
        system.constraints.add(net, ConstraintOptions{.compliance = choice.compliance});
        system.add_force(springs_of<double>(net, SpringOptions{.stiffness = choice.stiffness}));
        system.add_emitter({.position = {0.5, 0.9, 0.5}, .rate = choice.rate, .mass = 0.01, .radius = 0.01});
        system.collisions.emplace();
        system.collisions->friction = choice.collisions;
        return system;
    };
    System from = made({});
    for (int k = 0; k < 40; ++k) from.step(5e-3);
    const State<double> state = state_of(from);
    const auto says = [&](const Choice& choice) {
        System into = made(choice);
        const std::string text = message<io_error>([&] { restore(into, state); });
        for (int k = 0; k < 3 && text == "(nothing thrown)"; ++k) into.step(5e-3);
        return text;
    };
    CHECK(says({}) == "(nothing thrown)");
    check_holds(says({.friction = 0.3 + 1e-12}), "friction 0.30000000000099997'");
    check_holds(says({.compliance = 1e-4 + 1e-14}), " constraints: digest ");
    check_holds(says({.stiffness = 100 + 1e-10}), "'force: digest ");
    check_holds(says({.rate = 10 + 1e-9}), "rate 10.000000001 1/s");
    check_holds(says({.collisions = 0.1 + 1e-11}), "friction 0.10000000001,");
}

}  // namespace settings_tests
