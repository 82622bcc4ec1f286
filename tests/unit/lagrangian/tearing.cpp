// part: arithmetic
/// \file Links tear: each at its own factor, springs as constraints, shear and bend links with what supports them.
#include "support/catch.hpp"
#include "support/message.hpp"
#include "support/not_finite.hpp"
#include "support/point_systems.hpp"

using namespace firn;
using namespace point_systems;
using test_support::check_refused;
using test_support::infinity;
using test_support::not_a_number;

namespace tearing_tests {
namespace {

using System2 = ParticleSystem<2, double>;

/// A row of points at x = 0, 1, 2, … without gravity.
System2 row_of(int points) {
    System2 system;
    system.gravity = {};
    system.iterations = 0;
    system.warn = nullptr;
    for (int i = 0; i < points; ++i) system.points.add({.position = {double(i), 0.0}});
    return system;
}

/// Two links in a row and a bend link over both.
Net<2> row_net() { return {{{0, 0}, {1, 0}, {2, 0}}, {{0, 1}, {1, 2}, {0, 2, LinkKind::bend}}, {{0, 1}, {1, 2}}}; }

std::set<Torn> pairs(const System2& system) {
    std::set<Torn> all;
    for (Torn ends : system.torn()) all.insert({std::min(ends[0], ends[1]), std::max(ends[0], ends[1])});
    return all;
}

/// Two flags of springs in the wind and two ropes of constraints, all of different strengths, are pulled apart.
struct Flags {
    using System = ParticleSystem<3, float, Verlet>;

    System made(int threads) const {
        System system;
        system.threads = threads;
        system.damping = 0.1;
        system.warn = nullptr;
        for (int flag = 0; flag < 2; ++flag) {
            const auto net = cloth({2.0 * flag, 0, 0}, {1, 0, 0}, {0, 0, 1}, {10, 10});
            const std::size_t first = system.add(net, {.mass = 0.002, .radius = 0.02}, {0.1, 0, 0.2});
            for (std::uint32_t i = 0; i <= 10; ++i) {
                system.points.pin(std::uint32_t(first) + i, {0, 0, -0.1 - 0.1 * i});
                system.points.pin(std::uint32_t(first) + 110 + i, {0, 0, 0.1 + 0.1 * i});
            }
            SpringsOfKinds kinds;
            kinds[std::size_t(LinkKind::stretch)] = {.stiffness = 20, .damping = 0.01, .tear_factor = 1.2 + 0.3 * flag};
            kinds[std::size_t(LinkKind::shear)] = {.stiffness = 10, .damping = 0.01, .tear_factor = 1.6};
            kinds[std::size_t(LinkKind::bend)] = {.stiffness = 2};
            system.add_force(springs_of<float>(net, kinds, first));
            system.add_force(aerodynamic_surface_of(net, AerodynamicDrag<float, 3>{.wind = {1, 4, 0.5F}}, first));
        }
        system.points.end[30] = 0.1;
        system.points.end[52] = 0.6;
        for (const double factor : {1.2, 1.6}) {
            const auto line = rope<3>({-factor, 0, 0}, {-factor, 0, 1}, 8);
            const auto first = std::uint32_t(system.add(line, {.mass = 0.002}));
            system.points.pin(first);
            system.points.pin(first + 8, {0, 0, 2 - factor});
            system.constraints.add(line, ConstraintOptions{.compliance = 1e-2, .tear_factor = factor}, first);
        }
        return system;
    }
};

}  // namespace

TEMPLATE_TEST_CASE_SIG("a link tears when it is longer than its own factor allows, not before", "[lagrangian]",
                       ((class S, int D), S, D), (double, 2), (float, 3)) {
    const S longest = S(1.5) * 2, longer = std::nextafter(longest, S(9));
    for (const double of_all : {1.1, 4.0, infinity}) {  // its own factor comes before that of all others
        for (const S length : {longest, longer}) {
            CAPTURE(of_all, length);
            ParticleSystem<D, S> system;
            system.points.add({});
            system.points.add({});
            system.points.position[1][0] = length;
            for (const std::uint32_t i : {0, 1}) system.points.pin(i);
            const bool is_torn = length > longest;
            auto other = system;
            system.constraints.tear_factor = of_all;
            system.constraints.add({0, 1}, 2, {.tear_factor = 1.5});
            system.step(1e-3);
            CHECK(system.constraints.size() == (is_torn ? 0 : 1));
            CHECK(system.torn().size() == (is_torn ? 1 : 0));

            auto& springs = other.add_force(Springs<S, D>{});
            springs.law.tear_factor = of_all;
            springs.add({1, 0}, {2, 1, 0}, LinkKind::stretch, 1.5);
            other.step(1e-3);
            CHECK(springs.size() == (is_torn ? 0 : 1));
            CHECK(other.torn().size() == (is_torn ? 1 : 0));
        }
    }
}

TEST_CASE("a weight hangs on a spring that tears only if the weight is heavier than the factor says", "[lagrangian]") {
    const double stiffness = 50, length = 0.4, factor = 1.25, heaviest = stiffness * length * (factor - 1) / 9.81;
    for (const double part : {0.99, 1.01}) {
        System2 system;
        system.damping = 20;  // it comes to rest without a swing
        system.points.add({});
        system.points.add({.position = {0, -length}, .mass = part * heaviest});
        system.points.pin(0);
        auto& spring =
            system.add_force(springs_of<double>(Net<2>{{{0, 0}, {0, -length}}, {{0, 1}}, {}},
                                                SpringOptions{.stiffness = stiffness, .tear_factor = factor}));
        system.advance(4, 1e-3);
        CHECK(spring.size() == (part < 1 ? 1 : 0));
        if (part < 1) CHECK(-system.points.position[1][1] / length == Approx(1 + 0.99 * (factor - 1)).epsilon(1e-6));
    }
}

TEST_CASE("every net tears at its own factor, and a net without one at that of all", "[lagrangian]") {
    for (const bool are_springs : {false, true}) {
        System2 system = row_of(0);
        const auto pair = row_net();
        auto& springs = system.add_force(Springs<double, 2>{});
        springs.law.tear_factor = 1.2;
        const std::optional<double> factors[] = {1.1, 1.3, std::nullopt, infinity};
        for (std::uint32_t k = 0; k < 4; ++k) {
            const std::size_t first = system.add(pair, {});
            for (std::uint32_t i = 0; i < 3; ++i) system.points.pin(std::uint32_t(first) + i, {0.1 * i, 0.0});
            if (are_springs) {
                for (const Link& link : pair.links)
                    springs.add({link.a + std::uint32_t(first), link.b + std::uint32_t(first)},
                                {rest_length(pair, link), 1, 0}, link.kind, factors[k]);
            } else {
                system.constraints.add(pair, ConstraintOptions{.tear_factor = factors[k]}, first);
            }
        }
        system.constraints.tear_factor = 1.2;
        std::size_t left[4] = {}, tore_at[4] = {};
        for (int i = 1; i <= 50; ++i) {  // the links are 1 + 0.01 i long
            system.step(0.1);
            for (std::uint32_t k = 0; k < 4; ++k) {
                left[k] = 0;
                for (std::size_t e = 0; e < springs.size(); ++e) left[k] += springs.corners(e)[0] / 3 == k;
                for (const auto& each : system.constraints.all()) left[k] += each.ends[0] / 3 == k;
                CHECK((left[k] == 0 || left[k] == 3));
                if (left[k] == 0 && tore_at[k] == 0) tore_at[k] = std::size_t(i);
            }
        }
        CHECK(std::abs(int(tore_at[0]) - 11) <= 1);
        CHECK(std::abs(int(tore_at[1]) - 31) <= 1);
        CHECK(std::abs(int(tore_at[2]) - 21) <= 1);
        CHECK(left[3] == 3);
        CHECK(system.facets.size() == 2);
        CHECK(system.torn().size() == 9);
    }
}

TEST_CASE("a weaker kind tears alone, and a stronger one goes with what supports it", "[lagrangian]") {
    // 4 × 4 cells, stretched to 1.25 along x: the links along x are 1.25 times as long, the diagonals 1.13 times.
    const auto net = cloth({0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {4, 4});
    const auto count = [&](LinkKind kind) { return std::ranges::count(net.links, kind, &Link::kind); };
    for (const bool is_shear_stronger : {true, false}) {
        for (const bool are_springs : {true, false}) {
            CAPTURE(is_shear_stronger, are_springs);
            ParticleSystem<3> system;
            system.iterations = 0;
            system.warn = nullptr;
            system.add(net, {});
            for (std::uint32_t i = 0; i < system.points.size(); ++i) {
                system.points.position[i][0] *= 1.25F;
                system.points.pin(i);
            }
            const double stretch = is_shear_stronger ? 1.2 : 2, shear = is_shear_stronger ? 3 : 1.1;
            std::size_t left = 0;
            if (are_springs) {
                SpringsOfKinds of;
                of[0] = {.stiffness = 1, .tear_factor = stretch};
                of[1] = {.stiffness = 1, .tear_factor = shear};
                of[2] = {.stiffness = 1};
                auto& springs = system.add_force(springs_of<float>(net, of));
                system.step(1e-3);
                left = springs.size();
            } else {
                ConstraintsOfKinds of;
                of[0].tear_factor = stretch;
                of[1].tear_factor = shear;
                system.constraints.add(net, of);
                system.step(1e-3);
                left = system.constraints.size();
            }
            if (is_shear_stronger) {
                // The 20 links along x tear. With them go all diagonals, and the bend links along x.
                CHECK(left == net.links.size() - 20 - std::size_t(count(LinkKind::shear)) - 15);
            } else {
                CHECK(left == net.links.size() - std::size_t(count(LinkKind::shear)));
            }
            CHECK(system.facets.empty());
            CHECK(system.torn().size() == net.links.size() - left);
        }
    }
}

TEST_CASE("what joins both ends of a torn link goes with it, whether that is a spring, a constraint or a facet",
          "[lagrangian]") {
    for (const bool tears_spring : {true, false}) {
        System2 system = row_of(0);
        const auto net = row_net();
        system.add(net, {});
        for (const std::uint32_t i : {0, 1, 2}) system.points.pin(i);
        system.points.position[2][0] = 2.6;  // 1.6 from point 1, and 1.3 times as far from point 0 as at rest
        SpringsOfKinds springs_of_kinds;
        ConstraintsOfKinds constraints_of_kinds;
        if (tears_spring) springs_of_kinds[0] = {.stiffness = 1, .tear_factor = 1.5};  // bend links are constraints
        constraints_of_kinds[0].kept = !tears_spring;
        constraints_of_kinds[0].tear_factor = 1.5;
        constraints_of_kinds[2].kept = tears_spring;
        if (!tears_spring) springs_of_kinds[2] = {.stiffness = 1};  // and the other way round
        system.constraints.add(net, constraints_of_kinds);
        auto& springs = system.add_force(springs_of<double>(net, springs_of_kinds));
        auto& more = system.add_force(springs_of<double>(net, SpringOptions{.stiffness = 1}));
        auto& air = system.add_force(aerodynamic_surface_of(net, AerodynamicDrag<double, 2>{}));
        if (tears_spring) system.constraints.add({2, 1}, 1);
        // This one begins where a link tears, but it never had a support to lose.
        system.points.add({.position = {9, 9}});
        system.constraints.add({2, 3}, 12.7, {}, LinkKind::bend);
        system.step(1e-3);
        CHECK(pairs(system) == std::set<Torn>{{0, 2}, {1, 2}});
        CHECK(system.torn().size() == 2);
        CHECK(springs.size() == (tears_spring ? 1 : 0));
        CHECK(system.constraints.size() == (tears_spring ? 1 : 2));
        CHECK(more.size() == 1);
        CHECK(air.size() == 1);
        CHECK(system.facets == std::vector<Facet<2>>{{0, 1}});
    }
}

TEST_CASE("links are cut by hand, and a removed point takes the links that it supported", "[lagrangian]") {
    System2 system = row_of(0);
    system.add(rope<2>({0, 0}, {6, 0}, 6), {});
    const auto net = rope<2>({0, 0}, {6, 0}, 6);
    system.constraints.add(net);
    auto& springs = system.add_force(springs_of<double>(net, SpringOptions{.stiffness = 1}));
    system.tear(std::vector<Torn>{{3, 2}, {2, 3}});
    // The link 2–3, and the bend links over its two ends.
    CHECK(pairs(system) == std::set<Torn>{{1, 3}, {2, 3}, {2, 4}});
    CHECK(system.torn().size() == 3);
    CHECK(springs.size() == net.links.size() - 3);
    CHECK(system.constraints.size() == net.links.size() - 3);
    CHECK(system.facets.size() == 5);
    system.step(1e-3);
    CHECK(system.torn().size() == 3);

    CHECK(system.remove_if([](std::size_t i) { return i == 5; }) == 1);
    // Of 3–4–5–6 the link 3–4 is left.
    CHECK(springs.size() == 4);
    CHECK(system.constraints.size() == 4);
    system.step(1e-3);
    check_refused<parameter_error>([&] { system.tear(std::vector<Torn>{{1, 2}, {0, 6}}); }, "joins points 0 and 6");
    check_refused<parameter_error>([&] { system.tear(std::vector<Torn>{{1, 1}}); }, "joins points 1 and 1");
    CHECK(springs.size() == 4);
}

TEST_CASE("springs and constraints that tear go on to the same bits, on any number of threads", "[lagrangian][io]") {
    const Flags flags;
    const auto middle = state_after(flags, 300, 1), end = state_after(flags, 600, 1);
    CHECK(same(state_after(flags, 600, 3), end));
    auto continued = flags.made(4);
    restore(continued, middle);
    CHECK(same(state_of(continued), middle));
    go(continued, 300);
    CHECK(same(state_of(continued), end));
    CHECK(!table_of(middle, "torn").empty());
    CHECK(table_of(end, "torn").size() > table_of(middle, "torn").size());
    CHECK(table_of(end, "constraints_gone").size() > table_of(middle, "constraints_gone").size());
    CHECK(end.facets.size() < middle.facets.size());
    CHECK(end.size() < middle.size());

    auto changed = middle;
    table_of(changed, "torn").clear();
    auto whole = flags.made(2);
    restore(whole, changed);
    go(whole, 300);
    CHECK(!same(state_of(whole), end));
}

TEST_CASE("tear factors that no link can have are refused", "[lagrangian]") {
    const auto net = row_net();
    for (const double wrong : {1.0, 0.5, -2.0, not_a_number}) {
        System2 system = row_of(3);
        const std::string part = "above 1";
        check_refused<parameter_error>([&] { system.constraints.add(net, {.tear_factor = wrong}); }, part);
        check_refused<parameter_error>([&] { system.constraints.add({0, 1}, 1, {.tear_factor = wrong}); }, part);
        CHECK(system.constraints.size() == 0);
        check_refused<parameter_error>(
            [&] { springs_of<double>(net, SpringOptions{.stiffness = 1, .tear_factor = wrong}); }, part);
        Springs<double, 2> springs;
        check_refused<parameter_error>([&] { springs.add({0, 1}, {1, 1, 0}, LinkKind::bend, wrong); }, part);
        CHECK(springs.size() == 0);
        system.constraints.add({0, 1}, 1);
        system.constraints.tear_factor = wrong;
        check_refused<parameter_error>([&] { system.step(1e-3); }, part);
        system.constraints.tear_factor = infinity;
        system.step(1e-3);
        system.add_force(std::move(springs)).law.tear_factor = wrong;
        check_refused<parameter_error>([&] { system.step(1e-3); }, part);
    }
    // A spring that is 0 m long at rest is longer than any factor of that, and does not tear.
    System2 system = row_of(2);
    auto& springs = system.add_force(Springs<double, 2>{});
    springs.add({0, 1}, {0, 1, 0}, LinkKind::stretch, 2.0);
    system.step(1e-3);
    CHECK(springs.size() == 1);
}

}  // namespace tearing_tests
