/// \file Several surfaces at one node: the projection onto what all allow, found by trying every set of surfaces; the
/// friction of each; the same bits in any order. The velocities of the corners are written down by hand.
#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/boundary/boundary_list.hpp>
#include <firn/boundary/collider.hpp>
#include <firn/boundary/distance_grid.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/boundary/walls.hpp>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <vector>

using namespace firn;
using test_support::Random;

namespace at_once_tests {

/// A surface, in double.
template <int D>
struct Plane {
    Vec<double, D> normal{}, velocity{};
    double friction = 0;
    Contact contact = Contact::separate;
    double bound() const { return dot(normal, velocity); }
};

/// A random normal; `steep` planes may be opposite, so that two that move can close on each other.
template <int D>
std::vector<Plane<D>> planes(Random& random, int count, double speed, double friction) {
    std::vector<Plane<D>> all{std::size_t(count)};
    for (auto& one : all)
        one = {random.direction<D>(), random.vector<D>(-speed, speed), random.uniform(0, 1) < 0.5 ? 0 : friction};
    return all;
}

template <class S, int D>
Vec<S, D> velocity(const std::vector<Plane<D>>& all, const std::vector<int>& order, const Vec<double, D>& v,
                   std::vector<Vec<double, D>>* shares = nullptr) {
    NodeAtSurfaces<S, D> node(cast<S>(v));
    for (const int k : order) {
        const auto& one = all[std::size_t(k)];
        node.add(k, {S(0) <= S(0), S(0), cast<S>(one.normal), cast<S>(one.velocity), one.contact, S(one.friction)});
    }
    if (!shares) return node.velocity(AnySurface{});
    shares->assign(all.size(), Vec<double, D>::zero());
    return node.velocity([&](int part, const Vec<S, D>& before, const Vec<S, D>& after) {
        (*shares)[std::size_t(part)] += cast<double>(after) - cast<double>(before);
    });
}
std::vector<int> numbers(std::size_t count) {
    std::vector<int> all(count);
    std::iota(all.begin(), all.end(), 0);
    return all;
}

/// The nearest velocity that no plane refuses, among those that up to D planes hold. False if there is none.
template <int D>
bool nearest_allowed(const std::vector<Plane<D>>& all, const Vec<double, D>& v, Vec<double, D>& nearest) {
    double least = 1e300;
    const auto take = [&](const Vec<double, D>& w) {
        for (const auto& one : all)
            if (!(dot(w, one.normal) >= one.bound() - 1e-9)) return;
        if (dot(w - v, w - v) < least) {
            least = dot(w - v, w - v);
            nearest = w;
        }
    };
    take(v);
    // w = v + Σ λₖ nₖ with w · nₖ = boundₖ: the normal equations of the planes of a set, by elimination.
    const int n = int(all.size());
    for (int set = 1; set < 1 << n; ++set) {
        std::vector<const Plane<D>*> held;
        for (int k = 0; k < n; ++k)
            if (set >> k & 1) held.push_back(&all[std::size_t(k)]);
        const int m = int(held.size());
        if (m > D) continue;
        double a[3][4] = {};
        for (int i = 0; i < m; ++i) {
            for (int j = 0; j < m; ++j) a[i][j] = dot(held[std::size_t(i)]->normal, held[std::size_t(j)]->normal);
            a[i][m] = held[std::size_t(i)]->bound() - dot(v, held[std::size_t(i)]->normal);
        }
        bool regular = true;
        for (int i = 0; i < m; ++i) {
            regular = regular && std::abs(a[i][i]) > 1e-9;
            for (int j = 0; regular && j < m; ++j)
                if (j != i) {
                    const double factor = a[j][i] / a[i][i];
                    for (int k = 0; k <= m; ++k) a[j][k] -= factor * a[i][k];
                }
        }
        if (!regular) continue;
        Vec<double, D> w = v;
        for (int i = 0; i < m; ++i) w += held[std::size_t(i)]->normal * (a[i][m] / a[i][i]);
        take(w);
    }
    return least < 1e300;
}

template <int D>
bool close_on_each_other(const std::vector<Plane<D>>& all) {
    for (const auto& a : all)
        for (const auto& b : all)
            if (dot(a.normal, b.normal) < -0.9 && a.bound() + b.bound() > 0) return true;
    return false;
}

}  // namespace at_once_tests

using namespace at_once_tests;

TEMPLATE_TEST_CASE_SIG("the velocity changes as little as possible so that no surface is entered",
                       "[boundary][at_once]", ((int D), D), 2, 3) {
    Random random(70);
    int held = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        const bool moves = trial % 2 == 1;
        const auto all = planes<D>(random, 2 + trial % 5, moves ? 1 : 0, 0);
        const auto v = random.vector<D>(-2, 2);
        Vec<double, D> right{};
        const bool possible = nearest_allowed(all, v, right);
        const auto w = velocity<double, D>(all, numbers(all.size()), v);
        CAPTURE(trial, norm(right));
        if (!moves) REQUIRE(possible);  // 0 is allowed
        const double fastest = std::max(norm(v), std::sqrt(double(D)));
        if (possible && !close_on_each_other(all) && norm(right) < 2) {
            CHECK(norm(w - right) <= 1e-7);  // what is right is known to 1e-9 across the planes
            held += norm(right - v) > 0;
        }
        CHECK(norm(w) <= 5 * fastest * (1 + 1e-12));  // whatever the surfaces do
        if (!moves) {                                 // in float, too, nothing is entered
            const auto of_float = velocity<float, D>(all, numbers(all.size()), v);
            for (const auto& one : all) CHECK(dot(cast<double>(of_float), one.normal) >= -2e-4);
        }
    }
    CHECK(held > 1000);
}

TEMPLATE_TEST_CASE_SIG("the order of surfaces changes no bit, with friction and motion, also where they close",
                       "[boundary][at_once]", ((class S, int D), S, D), (float, 2), (float, 3), (double, 3)) {
    Random random(71);
    constexpr Contact contacts[] = {Contact::separate, Contact::slip};
    for (int trial = 0; trial < 1000; ++trial) {
        auto all = planes<D>(random, 2 + trial % 5, trial % 3 == 0 ? 0 : 1, 0.4);
        for (auto& one : all) one.contact = contacts[int(random.uniform(0, 2))];
        if (trial % 7 == 0) all[1] = all[0];                     // the same twice
        if (trial % 7 == 1) all[1].normal = all[0].normal * -1;  // opposite
        const auto v = random.vector<D>(-2, 2);
        auto order = numbers(all.size());
        const auto first = velocity<S, D>(all, order, v);
        for (int i = 0; i < 4; ++i) {
            for (std::size_t k = order.size(); k > 1; --k)
                std::swap(order[k - 1], order[int(random.uniform(0, double(k)))]);
            const auto other = velocity<S, D>(all, order, v);
            CAPTURE(trial);
            CHECK(std::memcmp(&first, &other, sizeof first) == 0);
        }
    }
}

TEST_CASE("in an edge, each surface has the friction of its own push, whatever the order of axes",
          "[boundary][at_once]") {
    // Pushed with 1 and 2 m/s, 3 m/s along the edge, μ = 0.3: 3 − 0.3 (1 + 2).
    const auto walls = Walls<double, 3>::all({0, 0, 0}, {1, 1, 1}, {Contact::separate, 0.3});
    const Vec<double, 3> edge{0, 0, 0.5};
    for (const auto& v : {Vec<double, 3>{-1, -2, 3}, Vec<double, 3>{-2, -1, 3}}) {
        const auto after = walls.velocity(edge, v);
        CHECK(after[0] == 0);
        CHECK(after[1] == 0);
        CHECK(after[2] == Approx(2.1).epsilon(1e-14));
    }
    CHECK(walls.velocity(edge, {-1, -2, 0.5})[2] == 0);  // stopped
    CHECK(walls.velocity({0, 0, 0}, {-1, -2, -3}) == Vec<double, 3>::zero());
    CHECK(walls.velocity({0, 0, 0}, {-1, -2, 3})[2] == Approx(2.1));  // it leaves the third wall
    // Half-spaces at 60°: v = −e pushes each with λ, λ n₁ + λ n₂ = e, λ = 1/(2 sin 30°) = 1.
    BoundaryList<Collider<HalfSpace<double, 3>>> notch;
    for (const double side : {1.0, -1.0})
        notch.all.push_back({.shape = {{side * std::sqrt(0.75), 0.5, 0}}, .friction = 0.3});
    const auto after = notch.velocity(Vec<double, 3>{0, -0.1, 0}, Vec<double, 3>{0, -1, 3});
    CHECK(norm(after - Vec<double, 3>{0, 0, 2.4}) <= 1e-14);
    std::vector<Vec<double, 3>> shares(2);
    velocity_among(notch, Vec<double, 3>{0, -0.1, 0}, Vec<double, 3>{0, -1, 3}, NoOthers{},
                   [&](int k, const auto& from, const auto& to) { shares[std::size_t(k)] = to - from; });
    for (const double side : {1.0, -1.0})
        CHECK(norm(shares[side > 0 ? 0 : 1] - Vec<double, 3>{side * std::sqrt(0.75), 0.5, -0.3}) <= 1e-14);
}

TEST_CASE("friction of two belts along an edge, which run at different speeds", "[boundary][at_once]") {
    // It minimises ½ (s − s₀)² + a |s − p| + b |s − q|, here by trying.
    Random random(72);
    for (int trial = 0; trial < 200; ++trial) {
        std::vector<Plane<3>> belts(2);
        belts[0] = {{1, 0, 0}, {0, 0, random.uniform(-2, 2)}, random.uniform(0, 1)};
        belts[1] = {{0, 1, 0}, {0, 0, random.uniform(-2, 2)}, random.uniform(0, 1)};
        if (trial % 4 == 0) belts[1].velocity = belts[0].velocity;
        const Vec<double, 3> v = random.vector<3>(-2, 0) + Vec<double, 3>{0, 0, random.uniform(0, 4)};
        const double a = -v[0] * belts[0].friction, b = -v[1] * belts[1].friction;
        const double p = belts[0].velocity[2], q = belts[1].velocity[2];
        const auto cost = [&](double s) {
            return 0.5 * (s - v[2]) * (s - v[2]) + a * std::abs(s - p) + b * std::abs(s - q);
        };
        std::vector<Vec<double, 3>> shares;
        const auto after = velocity<double, 3>(belts, {0, 1}, v, &shares);
        CAPTURE(trial);
        CHECK(std::abs(after[0]) + std::abs(after[1]) <= 1e-15);
        for (const double away : {1e-3, 1e-2, 0.1, 1.0})
            for (const double sign : {-1.0, 1.0}) CHECK(cost(after[2]) <= cost(after[2] + sign * away) + 1e-12);
        CHECK(norm(shares[0] + shares[1] - (after - v)) <= 1e-14);
        CHECK(shares[0][0] == Approx(-v[0]));
        CHECK(shares[1][1] == Approx(-v[1]));
        CHECK(std::abs(shares[0][2]) <= a * (1 + 1e-12) + 1e-15);
        CHECK(std::abs(shares[1][2]) <= b * (1 + 1e-12) + 1e-15);
    }
}

TEST_CASE("friction that pushes matter into another solid is stopped by it", "[boundary][at_once]") {
    // A belt along x, 2 m/s, carries matter to a wall across x. Friction of 1 along (2, −3)/√13 leaves 0 against the
    // wall, and the wall's own friction takes μ of what it stops.
    std::vector<Plane<3>> all(2);
    all[0] = {{0, 1, 0}, {2, 0, 0}, 1};
    all[1] = {{-1, 0, 0}, {0, 0, 0}, 0.5};
    std::vector<Vec<double, 3>> shares;
    const auto after = velocity<double, 3>(all, {0, 1}, {0, -1, 3}, &shares);
    const double stopped = 2 / std::sqrt(13.0);
    CHECK(after[0] == Approx(0).margin(1e-14));
    CHECK(after[1] == Approx(0).margin(1e-14));
    CHECK(after[2] == Approx(3 - 3 / std::sqrt(13.0) - 0.5 * stopped));
    CHECK(shares[1][0] == Approx(-stopped));
    CHECK(norm(shares[0] + shares[1] - (after - Vec<double, 3>{0, -1, 3})) <= 1e-14);
}

TEMPLATE_TEST_CASE_SIG("the shares of surfaces are the whole change", "[boundary][at_once]", ((int D), D), 2, 3) {
    Random random(73);
    for (int trial = 0; trial < 1000; ++trial) {
        auto all = planes<D>(random, 2 + trial % 4, 1, 0.5);
        all[0].contact = Contact::slip;
        if (trial % 10 == 0) all[1].contact = Contact::stick;
        const auto v = random.vector<D>(-2, 2);
        std::vector<Vec<double, D>> shares;
        const auto after = velocity<double, D>(all, numbers(all.size()), v, &shares);
        auto sum = v;
        for (const auto& share : shares) sum += share;
        CAPTURE(trial);
        CHECK(norm(sum - after) <= 1e-12);
        CHECK(norm(velocity<double, D>(all, numbers(all.size()), v) - after) == 0);
        if (trial % 10 == 0) CHECK(norm(v + shares[1] - after) <= 1e-15);  // all of it is the share of what sticks
    }
}

TEST_CASE("between two presses matter goes with the slower one, and rests where they come from both sides",
          "[boundary][at_once]") {
    const auto squeezed = [](double from_below, double from_above, const Vec<double, 2>& v) {
        std::vector<Plane<2>> all(2);
        all[0] = {{0, 1}, {0, from_below}, 0};
        all[1] = {{0, -1}, {0, from_above}, 0};
        const auto after = velocity<double, 2>(all, {0, 1}, v);
        CHECK(norm(after - velocity<double, 2>(all, {1, 0}, v)) == 0);
        return after;
    };
    for (const double before : {-3.0, 0.0, 3.0}) {
        CHECK(squeezed(1, -2, {0.5, before}) == Vec<double, 2>{0.5, 0});
        CHECK(squeezed(0, -2, {0.5, before}) == Vec<double, 2>{0.5, 0});  // a floor is not entered
        CHECK(squeezed(3, 2, {0.5, before}) == Vec<double, 2>{0.5, 2});   // one follows the other
    }
    CHECK(squeezed(-1, 2, {0.5, 0.5}) == Vec<double, 2>{0.5, 0.5});  // they part
    // Two that hold what leaves them, and part: it stays where it is. One that pushes is followed.
    std::vector<Plane<2>> all(2);
    all[0] = {{0, 1}, {0, -1}, 0, Contact::slip};
    all[1] = {{0, -1}, {0, 1}, 0, Contact::slip};
    CHECK(velocity<double, 2>(all, {0, 1}, {0.5, 0.25}) == Vec<double, 2>{0.5, 0});
    all[1] = {{0, 1}, {0, 1}, 0, Contact::separate};
    CHECK(norm(velocity<double, 2>(all, {0, 1}, {0.5, 0.25}) - Vec<double, 2>{0.5, 1}) <= 1e-15);
}

namespace at_once_tests {
struct Doubles {  // of a user
    Vec<double, 2> velocity(const Vec<double, 2>&, const Vec<double, 2>& v) const { return v * 2.0; }
    bool reaches(const Vec<double, 2>&, const Vec<double, 2>&) const { return true; }
};
}  // namespace at_once_tests

TEST_CASE("a boundary of one's own acts after all surfaces, wherever it stands among the parts",
          "[boundary][at_once]") {
    const auto walls = Walls<double, 2>::all({0, 0}, {1, 1}, {Contact::separate, 0.5});
    Collider<HalfSpace<double, 2>> side{.shape = {{1, 0}}, .linear_velocity = {1, 0}};
    const Vec<double, 2> x{0, 0}, v{-2, -1};
    const auto expected = Together(walls, side).velocity(x, v) * 2.0;
    CHECK(expected == Vec<double, 2>{2, 0});
    CHECK(Together(Doubles{}, walls, side).velocity(x, v) == expected);
    CHECK(Together(walls, Doubles{}, side).velocity(x, v) == expected);
    CHECK(Together(Together(side, Doubles{}), walls).velocity(x, v) == expected);
    std::vector<int> told;
    velocity_among(Together(Doubles{}, walls, side), x, v, NoOthers{},
                   [&](int k, const auto&, const auto&) { told.push_back(k); });
    CHECK(told.back() == 0);
}

TEST_CASE("lanes of a register are what single nodes get, where some touch several surfaces and some none",
          "[boundary][at_once]") {
    using P = native_pack<double>;
    constexpr int lanes = scalar_traits<P>::lanes;
    Random random(74);
    const auto walls = Walls<double, 3>::all({0, 0, 0}, {1, 1, 1}, {Contact::separate, 0.3});
    Collider<Box<double, 3>> box{.shape = {{0.3, 0.3, 0.3}}, .friction = 0.5, .position = {1, 0.2, 0.5}};
    box.linear_velocity = {-0.5, 0.2, 0.1};
    const auto boundary = on_grid(Together(walls, box), 0.1);
    const auto in_lanes = lift<P>(boundary);
    for (int trial = 0; trial < 300; ++trial) {
        Vec<double, 3> at[lanes], with[lanes];
        Vec<P, 3> x{}, v{};
        for (int lane = 0; lane < lanes; ++lane) {
            at[lane] = random.vector<3>(-0.2, 1.2);
            with[lane] = random.vector<3>(-2, 2);
            for (int a = 0; a < 3; ++a) {
                x[a].set(lane, at[lane][a]);
                v[a].set(lane, with[lane][a]);
            }
        }
        const auto after = in_lanes.velocity(x, v);
        for (int lane = 0; lane < lanes; ++lane) {
            const auto alone = boundary.velocity(at[lane], with[lane]);
            for (int a = 0; a < 3; ++a) CHECK(after[a][lane] == Approx(alone[a]).margin(1e-11));
        }
    }
}

namespace at_once_tests {

/// A hollow cube, by nothing but its distance.
template <scalar S, int D>
struct HollowCube {
    S half = S(0.2);
    static constexpr auto parameters() { return std::tuple{parameter{"half", "m", &HollowCube::half}}; }
    S signed_distance(const Vec<S, D>& x) const {
        using firn::abs, firn::min;
        S distance = half - abs(x[0]);
        for (int a = 1; a < D; ++a) distance = min(distance, half - abs(x[a]));
        return distance;
    }
};

/// A shape's distances at the nodes of a grid, half a cell apart.
template <class Shape>
auto sampled(const Shape& shape, double h) {
    constexpr int D = shape_facts<Shape>::dimension;
    DistanceNumbers<double, D> grid;
    grid.spacing = h / 2;
    grid.lower = Vec<double, D>::filled(-14 * h);
    std::size_t count = 1;
    for (int& nodes : grid.nodes) count *= std::size_t(nodes = 57);
    for (std::size_t i = 0; i < count; ++i) {
        Vec<double, D> x{};
        std::size_t rest = i;
        for (int a = D - 1; a >= 0; --a, rest /= 57) x[a] = grid.lower[a] + double(rest % 57) * grid.spacing;
        grid.values.push_back(shape.signed_distance(x));
    }
    return DistanceGrid<double, D, double>{std::make_shared<DistanceNumbers<double, D>>(grid)};
}

}  // namespace at_once_tests

TEMPLATE_TEST_CASE_SIG("in the corners of a hollow all faces act: a box names them, a distance is looked at again",
                       "[boundary][at_once]", ((int D), D), 2, 3) {
    using V = Vec<double, D>;
    Random random(75);
    const double h = 0.02;
    BoundaryList<Collider<HalfSpace<double, D>>> planes;
    for (int a = 0; a < D; ++a)
        for (const double side : {1.0, -1.0}) {
            V n = V::zero();
            n[a] = -side;
            planes.all.push_back({.shape = {n}, .friction = 0.2, .position = n * -0.2});
        }
    const auto list = planes.on_grid(h);
    const auto box = Collider<Complement<Box<double, D>>>{.shape = {{V::filled(0.2)}}, .friction = 0.2}.on_grid(h);
    const auto own = Collider<HollowCube<double, D>>{.friction = 0.2}.on_grid(h);
    const auto grid =
        Collider<DistanceGrid<double, D, double>>{.shape = sampled(HollowCube<double, D>{}, h), .friction = 0.2}
            .on_grid(h);
    int corners = 0, wrong_own = 0, wrong_grid = 0;
    for (int trial = 0; trial < 4000; ++trial) {
        const V x = random.vector<D>(0.2 - 2.5 * h, 0.2 + 0.5 * h), v = random.vector<D>(-1, 1);
        const V right = list.velocity(x, v);
        CAPTURE(trial);
        CHECK(norm(box.velocity(x, v) - right) <= 1e-13);
        int faces = 0;
        for (int a = 0; a < D; ++a) faces += 0.2 - x[a] <= 1.5 * h;
        corners += faces > 1;
        wrong_own += norm(own.velocity(x, v) - right) > 1e-9;
        // Where the grid's distance is as it is there: not at the end of the layer, and not where faces are as near.
        bool clear = true;
        for (int a = 0; a < D; ++a) {
            clear = clear && std::abs(0.2 - x[a] - 1.5 * h) > 0.1 * h;
            for (int b = 0; b < a; ++b) clear = clear && std::abs(x[a] - x[b]) > 0.5 * h;
        }
        wrong_grid += clear && norm(grid.velocity(x, v) - right) > 1e-9;
    }
    CHECK(corners > 1000);
    CHECK(wrong_own <= (D == 2 ? 0 : corners / 50));  // in space some lie aside of where it looks
    CHECK(wrong_grid <= corners / (D == 2 ? 100 : 20));
}

TEST_CASE("planes beside others act where they stand, at any angle", "[boundary][at_once]") {
    Random random(77);
    const double h = 0.02;
    for (int trial = 0; trial < 1000; ++trial) {
        BoundaryList<Collider<HalfSpace<double, 2>>> list;
        for (int k = 0; k < 3; ++k)
            list.all.push_back({.shape = {random.direction<2>()}, .position = random.vector<2>(-0.05, 0.05)});
        const auto x = random.vector<2>(-0.1, 0.1);
        const auto here = list.on_grid(h);
        int acting = 0, near = 0;
        for_parts(here, NoOthers{}, [&](const auto& part, const auto& others, int) {
            part.acting_surfaces(x, Vec<double, 2>::zero(), others, [&](const auto& surface) {
                ++acting;
                CHECK(std::abs(surface.distance - part.shape.signed_distance(x - part.position)) <= 1e-15);
            });
            near += part.shape.signed_distance(x - part.position) <= 1.5 * h;
        });
        CHECK(acting == near);
    }
}

TEST_CASE("solids without corners have one normal at a node, as before", "[boundary][at_once]") {
    Random random(76);
    const double h = 0.02;
    const auto check = [&](const auto& shape) {
        const auto solid = Collider<DistanceGrid<double, 3, double>>{.shape = sampled(shape, h)}.on_grid(h);
        int touched = 0;
        for (int trial = 0; trial < 4000; ++trial) {
            const auto x = random.vector<3>(-0.25, 0.25), v = random.vector<3>(-1, 1);
            const double distance = solid.shape.signed_distance(x);
            if (!(distance <= 1.5 * h && distance > -2 * h)) continue;
            ++touched;
            const auto alone = velocity_after_contact(v, solid.shape.normal(x), Contact::separate, 0.0);
            CHECK(norm(solid.velocity(x, v) - alone) == 0);
        }
        CHECK(touched > 100);
    };
    check(Sphere<double, 3>{0.15});
    check(Box<double, 3>{{0.2, 0.15, 0.1}});
    check(Box<double, 3>{{0.2, 0.15, 0.01}});  // a plate of a cell
    check(Capsule<double, 3>{0.1, 0.05});
    check(Complement<Sphere<double, 3>>{{0.15}});  // a bowl
}
