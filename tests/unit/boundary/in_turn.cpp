/// \file What surfaces near a rigid body do to a node, each in turn.
#include "support/catch.hpp"
#include <firn/boundary/in_turn.hpp>

#include <cmath>

using namespace firn;

namespace {

using V3 = Vec<double, 3>;
using Node = detail::NodeInTurn<3>;

constexpr double held_within = 0.01, time_step = 1e-3;  // [m], [s]

detail::SurfaceByGap<3> turned_surface(const V3& normal, const V3& velocity, double friction,
                                       Contact contact = Contact::separate, double gap = -0.001) {
    return {{true, gap, normal * (1 / norm(normal)), velocity, contact, friction}, gap, 0};
}

/// Returns what the last surface changes the velocity v of a node by. \param after  becomes the velocity of the node
template <class... Surfaces>
V3 change_by_last(const V3& v, V3& after, const Surfaces&... surfaces) {
    Node node(v, held_within, time_step);
    (node.add(surfaces), ...);
    after = node.velocity();
    V3 sum = v;
    for (std::size_t k = 0; k < node.size(); ++k) sum += node.change(k);
    CHECK(norm(sum - after) <= 1e-14 * (1 + norm(v)));
    return node.change(node.size() - 1);
}

}  // namespace

TEST_CASE("A surface that is alone acts on a node by the law of contact") {
    const V3 v{0.3, -2, 0.1}, of_solid{0, 0.5, 0.2}, n{0, 1, 0};
    for (const Contact contact : {Contact::separate, Contact::slip, Contact::stick})
        for (const double gap : {-0.001, 0.001, 0.02}) {
            V3 after{};
            change_by_last(v, after, turned_surface(n, of_solid, 0.1, contact, gap));
            const V3 expected =
                of_solid + velocity_after_contact(v - of_solid, n, contact, 0.1, gap, held_within, time_step);
            CHECK(norm(after - expected) <= 1e-15);
        }
}

TEST_CASE("Surfaces at right angles hold a node, and each rubs by Coulomb's law") {
    const double mu = 0.1;
    V3 after{};
    // Matter presses into an edge along z and slides along it: both rub against it with μ times their own push.
    change_by_last({-1, -2, 3}, after, turned_surface({1, 0, 0}, {}, mu), turned_surface({0, 1, 0}, {}, mu));
    CHECK(after[0] >= -1e-15);
    CHECK(after[1] >= -1e-15);
    CHECK(std::abs(after[0]) <= 0.1);  // what the other's friction leaves
    CHECK(after[2] == Approx(3 - mu * (1 + 2)).epsilon(0.02));
    change_by_last({-1, -2, 3}, after, turned_surface({1, 0, 0}, {}, 0), turned_surface({0, 1, 0}, {}, 0));
    CHECK(norm(after - V3{0, 0, 3}) <= 1e-15);
}

TEST_CASE("Between surfaces that close on each other matter follows the slower one") {
    V3 after{};
    const double pushed = norm(
        change_by_last({0, 0, 0}, after, turned_surface({0, 1, 0}, {}, 0), turned_surface({0, -1, 0}, {0, -2, 0}, 0)));
    CHECK(norm(after) <= 1e-15);
    CHECK(pushed <= 1e-15);  // and no force builds up from turn to turn
    change_by_last({0, 0, 0}, after, turned_surface({0, 1, 0}, {0, -1, 0}, 0),
                   turned_surface({0, -1, 0}, {0, -3, 0}, 0));
    CHECK(norm(after - V3{0, -1, 0}) <= 1e-15);
    // One that holds matter lets go where another pushes it off.
    change_by_last({0, 0, 0}, after, turned_surface({0, 1, 0}, {0, 1, 0}, 0, Contact::slip),
                   turned_surface({0, 1, 0}, {0, 3, 0}, 0));
    CHECK(norm(after - V3{0, 3, 0}) <= 1e-15);
}

TEST_CASE("What a body does to matter on a wall has no jump as the body turns round along the edge") {
    // Matter that a wall holds by friction; a solid that slides over it, nearly across the edge between both.
    const V3 v{-0.3, -0.5, 0}, down{0.87, -0.5, 0};
    const auto push = [&](double along, bool at_once) {
        const auto wall = turned_surface({0, 1, 0}, {}, 0.5), solid = turned_surface(down, {0, -0.2, along}, 0.5);
        V3 after{};
        if (!at_once) return change_by_last(v, after, wall, solid);
        NodeAtSurfaces<double, 3> node(v);
        node.add(0, wall.is), node.add(1, solid.is);
        V3 last{};
        node.velocity([&](int part, const V3& before, const V3& then) {
            if (part == 1) last = then - before;
        });
        return last;
    };
    constexpr double little = 1e-6;
    const double jump = norm(push(little, false) - push(-little, false));
    CHECK(jump <= 100 * little);
    CHECK(norm(push(0.1, false) - push(-0.1, false)) > 1e-3);            // it does turn round
    CHECK(norm(push(little, true) - push(-little, true)) > 100 * jump);  // and this is why surfaces act in turn
}
