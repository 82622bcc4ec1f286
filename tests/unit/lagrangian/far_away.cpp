// part: arithmetic
/// \file Systems of point masses move far from the origin as they do near it: positions are in double, and differences
/// of positions are formed in double before they are rounded to float.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include <firn/boundary/boundary_list.hpp>
#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/lagrangian/cloth.hpp>
#include <firn/lagrangian/particle_system.hpp>
#include <firn/lagrangian/rope.hpp>
#include <firn/material/fixed_corotated.hpp>

#include <algorithm>
#include <cmath>

using namespace firn;

namespace far_away_tests {

namespace {

using V = Vec<double, 2>;

/// The largest difference of the points' places, counted from two origins.
template <class One, class Other>
double difference(const One& one, const auto& origin, const Other& other, const auto& other_origin) {
    double largest = 0;
    REQUIRE(one.points.size() == other.points.size());
    for (std::size_t i = 0; i < one.points.size(); ++i)
        largest =
            std::max(largest, norm((one.points.position[i] - origin) - (other.points.position[i] - other_origin)));
    return largest;
}

/// A law whose forces are what it is told: positions from the first corner.
struct Told {
    using scalar_type = float;
    static constexpr int corners = 2;
    struct Element {};
    std::array<Vec<float, 2>, 2> forces(const Element&, const std::array<Vec<float, 2>, 2>& x,
                                        const std::array<Vec<float, 2>, 2>&) const {
        return {x[0], x[1]};
    }
};
/// The same, and where the first corner is.
struct ToldWhere {
    using scalar_type = float;
    static constexpr int corners = 2;
    struct Element {};
    std::array<Vec<float, 2>, 2> forces(const Element&, const std::array<Vec<float, 2>, 2>& x,
                                        const std::array<Vec<float, 2>, 2>&, const V& at) const {
        const Vec<float, 2> from{float(at[0] - 4e6), float(at[1])};
        return {from, x[1]};
    }
    float stiffness(const Element&, const std::array<Vec<float, 2>, 2>&, const V& at) const {
        return float(at[0] - 4e6);
    }
    float energy(const Element&, const std::array<Vec<float, 2>, 2>& x, const V& at) const {
        return float(at[0] - 4e6) + x[1][0];
    }
};
/// Of an element of one point: its position.
struct ToldPlace {
    using scalar_type = float;
    static constexpr int corners = 1;
    struct Element {};
    std::array<Vec<float, 2>, 1> forces(const Element&, const std::array<Vec<float, 2>, 1>& x,
                                        const std::array<Vec<float, 2>, 1>&) const {
        return {x[0]};
    }
};

}  // namespace

TEMPLATE_TEST_CASE("far away: a point goes its way in steps far below a float's last digit", "[lagrangian]", Verlet,
                   SymplecticEuler) {
    for (const double x : {0.0, 1.0, 100.0, 5e5, 4.6e6})
        for (const double v : {0.003, 0.1}) {
            ParticleSystem<2, float, TestType> system;
            system.gravity = {};
            system.points.add({.position = {x, -x}, .velocity = {v, 2 * v}});
            for (int i = 0; i < 10'000; ++i) system.step(1e-5);
            // A float's velocity, and 1e4 sums of a double near x.
            const double rounding = 1e4 * x * std::numeric_limits<double>::epsilon() / 2;
            CHECK(system.points.position[0][0] - x == Approx(0.1 * v).epsilon(1e-6).margin(rounding));
            CHECK(system.points.position[0][1] + x == Approx(0.2 * v).epsilon(1e-6).margin(rounding));
        }
}

TEST_CASE("far away: a tilted rope of constraints swings as it does near the origin", "[lagrangian]") {
    const auto rope_at = [](double x, ConstraintUpdate update, double compliance) {
        ParticleSystem<2, float> system;
        system.damping = 1;
        system.iterations = 30;
        system.constraints.update = update;
        system.warn = {};
        const auto net = rope<2>({x, x}, {x + 0.6, x - 0.8}, 20);
        system.add(net, {.mass = 0.05});
        system.points.pin(0);
        system.constraints.add(net, ConstraintOptions{.compliance = compliance});
        system.advance(0.5, 1e-3);
        return system;
    };
    for (const ConstraintUpdate update :
         {ConstraintUpdate::immediate, ConstraintUpdate::coloured, ConstraintUpdate::averaged})
        for (const double compliance : {0.0, 1e-5})
            for (const double x : test_support::fewer_if_quick(std::vector{1000.0, 1e6}, std::vector{1e6})) {
                CAPTURE(int(update), compliance, x);
                // Floats round the vectors of links, in 500 steps: 3e-8 of 0.05 m in 1e-3 s each time.
                CHECK(difference(rope_at(0, update, compliance), V{0, 0}, rope_at(x, update, compliance), V{x, x}) <
                      3e-4);
            }
}

TEST_CASE("far away: springs, membranes, anchors and the air pull as near the origin", "[lagrangian]") {
    const auto cloth_at = [](const Vec<double, 3>& x) {
        ParticleSystem<3, float> system;
        const auto net = cloth(x, {1, 0, 0}, {0, 0, 1}, {6, 6});
        system.add(net, {.mass = 0.01});
        system.add_force(springs_of<float>(net, SpringOptions{.stiffness = 50, .damping = 0.01}));
        system.add_force(membranes_of(net, FixedCorotated<float>::from_young_poisson(1e4, 0.3), 1e-3));
        system.add_force(aerodynamic_surface_of(net, AerodynamicDrag<float, 3>{.wind = {1.0f, 2.0f, 0.5f}}));
        Anchors<float, 3> anchors;
        for (const std::uint32_t i : {0U, 6U}) anchors.add({i}, {net.positions[i], 200, 0.1f});
        system.add_force(std::move(anchors));
        system.advance(0.5, 1e-3);
        return system;
    };
    const Vec<double, 3> near = Vec<double, 3>::zero();
    for (const double far : {1e3, 4.6e6}) {
        const Vec<double, 3> there{far, -far, far / 2};
        CHECK(difference(cloth_at(near), near, cloth_at(there), there) < 1e-4);
    }
}

TEST_CASE("far away: balls meet floors, colliders and each other as near the origin", "[lagrangian]") {
    using Ball = Collider<Sphere<float, 2>>;
    using Boundary = Together<Walls<float, 2>, BoundaryList<Ball>>;
    using System = ParticleSystem<2, float, Verlet, Boundary>;
    static_assert(detail::sees_exactly<Boundary, 2>);
    // In one system, whose other balls are `apart` away.
    const auto room_at = [](const V& x, double apart) {
        Ball hill{.shape = {0.5F}, .friction = 0.2};
        hill.position = x + V{0, 0.1};
        System system(
            Boundary(Walls<float, 2>::all({float(x[0] - 4), float(x[1])}, {float(x[0] + apart + 4), float(x[1] + 8)},
                                          {Contact::separate, 0.3}),
                     {{hill}}));
        system.restitution = 0.6;
        system.collisions.emplace();
        system.collisions->restitution = 0.6;
        system.collisions->friction = 0.1;
        for (int i = 0; i < 12; ++i)
            system.points.add({.position = x + V{0.3 * (i % 4) - 0.43, 1 + 0.35 * (i / 4) + 0.02 * i},
                               .mass = 1.0 + i,
                               .radius = 0.12});
        if (apart > 0) system.points.add({.position = x + V{apart, 2}, .radius = 0.12});
        for (int i = 0; i < 1500; ++i) system.step(1e-3);
        system.remove_if([](std::size_t i) { return i >= 12; });
        return system;
    };
    const System near = room_at({0, 0}, 0);
    const auto& highest = *std::ranges::max_element(near.points.position, {}, [](const V& x) { return x[1]; });
    CHECK(highest[1] < 1);  // they have fallen, and met
    for (const auto& [x, apart] : {std::pair{V{4096, 4096}, 0.0}, {V{-65536, 8192}, 0.0}, {V{0, 0}, 65536.0}}) {
        CAPTURE(x[0], apart);
        // Balls in contact differ by rounding, which contacts multiply: by 10 to 100 in 1.5 s.
        CHECK(difference(near, V{0, 0}, room_at(x, apart), x) < 2e-3);
    }
}

TEST_CASE("far away: a ball on a floor of float keeps its height when it bounces", "[lagrangian]") {
    for (const double y : {0.0, 4096.0, 1048576.0}) {
        ParticleSystem<2, float, Verlet, Walls<float, 2>> system(
            Walls<float, 2>::all({-1, float(y)}, {1, float(y + 8)}, {Contact::separate, 0}));
        system.restitution = 1;
        system.points.add({.position = {0, y + 1.05}, .radius = 0.05});
        double highest = 0;
        system.advance(20, 1e-3);  // of 22 bounces
        const double end = system.time() + 1;
        while (system.time() < end) {
            system.step(1e-3);
            highest = std::max(highest, system.points.position[0][1] - y - 0.05);
        }
        CHECK(highest == Approx(1).epsilon(1e-4));
    }
}

TEST_CASE("far away: links tear at their factor", "[lagrangian]") {
    for (const double x : {0.0, 4.6e6}) {
        ParticleSystem<2, float> system;
        system.gravity = {};
        system.iterations = 0;
        for (const double at : {0.0, 1.0, 2.0}) system.points.add({.position = {x + at, 0}});
        system.points.velocity[2][0] = 0.1F;
        system.constraints.tear_factor = 1.01;
        system.constraints.add({0, 1}, 1);
        system.constraints.add({1, 2}, 1);
        system.advance(0.099, 1e-3);
        CHECK(system.torn().empty());
        system.advance(0.003, 1e-3);
        CHECK(system.torn() == std::vector<Torn>{{1, 2}});
    }
}

TEST_CASE("laws get positions from the first corner, and its place if they ask for it", "[lagrangian]") {
    ParticleSystem<2, float> system;
    system.points.add({.position = {4e6 + 3, 7}});
    system.points.add({.position = {4e6 + 3.25, 7.5}});
    const auto forces_of = [&](auto law) {
        ElementForces<decltype(law), 2> force;
        typename decltype(force)::Corners corners{};
        for (std::size_t k = 0; k < corners.size(); ++k) corners[k] = std::uint32_t(k);
        force.add(corners);
        std::vector<Vec<float, 2>> sum(2, Vec<float, 2>::zero());
        force.add_forces(system.points.view(), sum, 1);
        return sum;
    };
    CHECK(forces_of(Told{}) == std::vector<Vec<float, 2>>{{0, 0}, {0.25F, 0.5F}});
    CHECK(forces_of(ToldWhere{}) == std::vector<Vec<float, 2>>{{3, 7}, {0.25F, 0.5F}});
    CHECK(forces_of(ToldPlace{})[0] == Vec<float, 2>{4000003, 7});

    ElementForces<ToldWhere, 2> force;
    force.add({0, 1});
    CHECK(force.energy(system.points.view()) == 3.25);
    std::vector<double> stiffness(2, 0), damping(2, 0);
    force.add_stiffness(system.points.view(), stiffness, damping, 1);
    CHECK(stiffness == std::vector<double>{3, 3});
    CHECK(damping == std::vector<double>{0, 0});
}

}  // namespace far_away_tests
