/// \file Boundaries that act by the gap of particles: the law at a node, what GapContact forwards, a boundary of a
/// user's own, a mirrored column, and bad input.
#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/boundary/boundary_list.hpp>
#include <firn/contact/coulomb.hpp>
#include <firn/firn.hpp>

namespace gap_contact_tests {

using namespace firn;
using test_support::Random;

namespace {

constexpr double h = 0.1, dt = 1e-3;

template <int D>
void check_law() {
    Random random(7);
    int pushed = 0, held = 0;
    for (int i = 0; i < 20000; ++i) {
        const auto v = random.vector<D>(-1, 1);
        const auto n = random.direction<D>();
        const double gap = random.uniform(-0.02, 0.04) * h, friction = i % 3 * 0.4, reach = boundary_reach * h;
        const auto contact = Contact(i % 4);
        const auto after = velocity_after_contact(v, n, contact, friction, gap, reach, dt);

        // What contact groups do.
        CoulombContact law;
        law.set_pair(0, 1, {.contact = contact, .friction = friction, .reach = boundary_reach});
        const Meeting<double, D> meeting{v, n, gap, 1.0, h, dt};
        REQUIRE(norm(law.relative_velocity(0, 1, meeting) - after) == 0);

        if (contact == Contact::none) {
            REQUIRE(norm(after - v) == 0);
        } else if (contact == Contact::separate) {
            const double before_push = dot(v, n) + std::max(gap, 0.0) / dt;
            if (before_push >= 0) {
                REQUIRE(norm(after - v) == 0);  // nothing in tension, nothing before the surfaces touch
                continue;
            }
            ++pushed;
            // Matter comes as near as the gap, and no nearer.
            REQUIRE(dot(after, n) * dt == Approx(-std::max(gap, 0.0)).margin(1e-12));
            const auto impulse = after - v;
            const double push = dot(impulse, n);
            REQUIRE(push > 0);
            REQUIRE(norm(impulse - n * push) <= friction * push + 1e-12);
            REQUIRE(dot(after, after) <= dot(v, v) + 1e-12);
        } else {
            ++held;
            REQUIRE(std::abs(dot(after, n)) < 1e-12);
            REQUIRE(dot(after, after) <= dot(v, v) + 1e-12);
            if (contact == Contact::stick) REQUIRE(norm(after) == 0);
        }
    }
    CHECK(pushed > 1000);
    CHECK(held > 5000);
    const auto up = direction_or_up(Vec<double, D>::zero());
    // Beyond the reach, `slip` and `stick` do not hold, but do not let matter through.
    for (const auto contact : {Contact::slip, Contact::stick}) {
        CHECK(dot(velocity_after_contact(up, up, contact, 0.0, 0.3 * h, boundary_reach * h, dt), up) == 1);
        const auto fast = up * -100.0;
        CHECK(dot(velocity_after_contact(fast, up, contact, 0.0, 0.3 * h, boundary_reach * h, dt), up) * dt ==
              Approx(-0.3 * h));
    }
}

/// Matter at a distance from a node, the same along each normal.
struct At {
    double distance;
    template <class N>
    double operator()(const N&) const {
        return distance;
    }
};

template <class B>
Vec<double, 2> velocity_of(const B& boundary, const Vec<double, 2>& x, const Vec<double, 2>& v, double distance) {
    const At at{distance};
    return velocity_by_gap<B, 2>(boundary, x, v, ActByGap<2, At>{h, dt, at}, AnySurface{});
}

struct Lid {  // of a user
    double height = 0.9;
    template <class S>
    Vec<S, 2> velocity(const Vec<S, 2>&, const Vec<S, 2>& v) const {
        return v;
    }
    template <class Act>
    Vec<double, 2> velocity_by_gap(const Vec<double, 2>& x, const Vec<double, 2>& v, const Act& act) const {
        if (x[1] < height) return v;
        return act(v, height - x[1], {0.0, -1.0}, {2.0, 0.0}, Contact::separate, 0.0);
    }
    bool reaches(const Vec<double, 2>&, const Vec<double, 2>& upper) const { return upper[1] >= height; }
};

}  // namespace

TEST_CASE("The law of boundaries by the gap: that of contact groups, impenetrable, free in tension") {
    check_law<2>();
    check_law<3>();
}

TEST_CASE("Walls by the gap act at the nodes on and behind a face, colliders in the solid and its layer") {
    const auto walls = Walls<double, 2>::all({0, 0}, {1, 1}, {Contact::separate, 0});
    const Vec<double, 2> down{1.0, -2.0};
    // On the floor; matter is 0.5 mm away, and would come 2 mm nearer.
    const auto after = velocity_of(walls, {0.5, 0.0}, down, 0.5e-3);
    CHECK(after[0] == 1);
    CHECK(after[1] == Approx(-0.5));
    CHECK(velocity_of(walls, {0.5, -h}, down, h + 0.5e-3)[1] == Approx(-0.5));  // behind the floor
    CHECK(velocity_of(walls, {0.5, 0.0}, down, 2.1e-3)[1] == -2);               // too far away
    CHECK(velocity_of(walls, {0.5, h}, down, -h)[1] == -2);                     // in front of the floor
    CHECK(velocity_of(walls, {0.5, 0.0}, down, 1e38)[1] == -2);                 // no matter
    CHECK(velocity_of(walls, {0.5, 0.0}, down, std::numeric_limits<double>::quiet_NaN())[1] == -2);
    // A face between planes of nodes acts on the nearer one, where it stands.
    const auto between = Walls<double, 2>::all({0.1, 0.1}, {1, 1}, {Contact::separate, 0}).on_grid(h);
    for (const double from_face : {0.4 * h, 0.0, -0.4 * h})
        CHECK(velocity_of(between, {0.5, 0.1 + from_face}, down, 0.5e-3 - from_face)[1] == Approx(-0.5));
    CHECK(velocity_of(between, {0.5, 0.1 + 0.6 * h}, down, -0.6 * h)[1] == -2);

    Collider<Sphere<double, 2>> ball{.shape = {0.2}, .thickness = 0.01, .position = {0.5, 0.5}};
    ball.linear_velocity = {0, 1};
    const auto here = ball.on_grid(h);
    const Vec<double, 2> x{0.5, 0.5 + 0.21 + 1.4 * h};  // in the layer, 1.4 h from the surface
    CHECK(velocity_of(here, x, down, -1.4 * h)[1] == Approx(1));
    CHECK(velocity_of(here, x, down, -1.4 * h + 1e-3)[1] == Approx(0).margin(1e-9));
    CHECK(velocity_of(here, x, down, -1.4 * h + 1)[1] == -2);
    CHECK(velocity_of(here, {0.5, 0.5 + 0.21 + 1.6 * h}, down, -1.6 * h)[1] == -2);
    CHECK(velocity_of(ball, x, down, -1.4 * h)[1] == -2);  // without a layer

    // In a notch of 60°, both planes act at once: matter approaches each by the gap. w · n = −g/dt with n = (±√¾, ½).
    BoundaryList<Collider<HalfSpace<double, 2>>> notch;
    for (const double side : {1.0, -1.0}) notch.all.push_back({.shape = {{side * std::sqrt(0.75), 0.5}}});
    const auto in_notch = velocity_of(notch.on_grid(h), {0.0, 0.0}, {0.0, -10.0}, 1e-3);
    CHECK(std::abs(in_notch[0]) <= 1e-12);
    CHECK(in_notch[1] == Approx(-2 * 1e-3 / dt));

    // A user's boundary may be one of the parts.
    const Together all(walls, here, Lid{});
    CHECK(velocity_of(all, x, down, -1.4 * h)[1] == Approx(1));
    CHECK(velocity_of(all, {0.5, 0.0}, down, 0)[1] == 0);
    const auto lifted = velocity_of(all, {0.5, 0.9}, {0, 3}, 0.0);
    CHECK(lifted[0] == 0);
    CHECK(lifted[1] == 0);
    std::vector<int> parts;
    const At at{0};
    velocity_by_gap<Together<Walls<double, 2>, Collider<Sphere<double, 2>>, Lid>, 2>(
        all, {0.5, 0.9}, {0, 3}, ActByGap<2, At>{h, dt, at}, [&](int part, const auto& before, const auto& now) {
            if (norm(now - before) > 0) parts.push_back(part);
        });
    CHECK(parts == std::vector<int>{2});
}

TEST_CASE("By the gap, nodes in and behind a thin solid act by the face that matter touches") {
    // A plate of 0.8 cells, moving to the left at 1 m/s; matter to the right of it, from its face to 1.5 cells from the
    // node. Of nodes behind the plate, the left face is nearer: matter would have to stay to the left of it.
    Collider<Box<double, 2>> plate{.shape = {{0.4 * h, 1}}};
    plate.linear_velocity = {-1, 0};
    const auto here = plate.on_grid(h);
    const auto after = [&](double node, double face, const Vec<double, 2>& v) {
        const auto nearest = [&](const Vec<double, 2>& n) {
            return std::min(n[0] * (face - node), n[0] * 1.5 * h) - std::abs(n[1]) * 1.5 * h;
        };
        const ActByGap<2, decltype(nearest)> act{h, dt, nearest};
        return velocity_by_gap(here, Vec<double, 2>{node, 0.0}, v, act, AnySurface{});
    };
    for (const double cells : {0.35, 0.1, -0.1, -0.35, -0.7, -1.05}) {
        CAPTURE(cells);
        const double face = 0.4 * h;
        CHECK(after(cells * h, face, {0, 3})[0] == 0);  // rests while the plate leaves
        CHECK(after(cells * h, face, {0, 3})[1] == 3);
        CHECK(after(cells * h, face, {-2, 3})[0] == Approx(-1));             // is pushed
        CHECK(after(cells * h, face + 0.5e-3, {-2, 3})[0] == Approx(-1.5));  // comes nearer by the gap
    }
}

/// The solid outside of a notch of 60°.
template <scalar S, int D>
struct Notch {
    S unused = S(1);
    static constexpr const char* name = "notch";
    static constexpr auto parameters() { return std::tuple{parameter{"unused", "1", &Notch::unused}}; }
    static Vec<S, D> face(int side) { return {side == 0 ? S(1) : S(-0.5), side == 0 ? S(0) : S(std::sqrt(0.75))}; }
    S signed_distance(const Vec<S, D>& x) const { return min(dot(face(0), x), dot(face(1), x)); }
};

TEST_CASE("By the gap, the other face of a notch is not taken for the one that matter touches") {
    const auto solid = Collider<Notch<double, 2>>{}.on_grid(h);
    // Behind the first face by 0.2 cells, before the second by 0.6. Matter overlaps the first face, not the second, but
    // its middle is nearer to the second.
    const Vec<double, 2> n = Notch<double, 2>::face(0), other = Notch<double, 2>::face(1);
    const Vec<double, 2> x = Vec<double, 2>{-0.2, (0.6 - 0.1) / std::sqrt(0.75)} * h;
    REQUIRE(dot(other, x) == Approx(0.6 * h));
    const auto nearest = [&](const Vec<double, 2>& along) {
        return dot(along, n) > 0.9 ? 0.0 : dot(along, n) < -0.9 ? -1.4 * h : -0.5 * h;
    };
    const ActByGap<2, decltype(nearest)> act{h, dt, nearest};
    const auto after = velocity_by_gap(solid, x, Vec<double, 2>{-1, 0}, act, AnySurface{});
    CHECK(after[0] == Approx(0).margin(1e-12));
    CHECK(after[1] == Approx(0).margin(1e-12));
}

TEST_CASE("GapContact forwards what a boundary knows") {
    auto walls = Walls<float, 2>::all({0, 0}, {1, 1}, {Contact::slip, 0.25});
    walls.nodes_behind = NodesBehind::mirrored;
    Collider<Sphere<float, 2>> ball{.position = {0.5, 0.25}};
    ball.linear_velocity = {0, 2};
    const Together both(walls, ball);
    const GapContact by_gap{both};
    static_assert(acts_by_gap<GapContact<Walls<float, 2>>> && !acts_by_gap<Walls<float, 2>>);
    static_assert(detail::boundary_fits<GapContact<Together<Walls<float, 2>, Lid>>, float, 2>::value);
    static_assert(!detail::boundary_fits<GapContact<Together<Walls<float, 2>, Lid>>, double, 2>::value);
    static_assert(!detail::boundary_fits<GapContact<Walls<float, 2>>, float, 3>::value);
    static_assert(has_surfaces<GapContact<Walls<float, 2>>, float, 2> && has_mirrors<GapContact<Walls<float, 2>>>);
    static_assert(!has_surfaces<GapContact<Lid>, float, 2> && !has_mirrors<GapContact<Lid>>);
    CHECK(by_gap.description() == "by the gap of particles: " + both.description());
    CHECK(part_count(by_gap) == 2);
    CHECK(part_centre<2>(by_gap, 1)[1] == 0.25);
    const Vec<double, 2> low{0.4, 0.2}, high{0.6, 0.3};
    CHECK(by_gap.reaches(low, high) == both.reaches(low, high));
    CHECK(largest_speed(by_gap, low, high) == largest_speed(both, low, high));
    CHECK(std::get<1>(advanced(by_gap, 0.5).boundary.parts).position[1] == 1.25);
    CHECK(std::get<1>(on_grid(by_gap, 0.5).boundary.parts).cell_size == 0.5);
    int planes = 0;
    by_gap.mirrors([&](auto&&...) { ++planes; });
    CHECK(planes == 4);
    std::string names;
    for_parameters(by_gap, [&](const std::string& name, const char*, const auto&) { names += name + " "; });
    CHECK(names.starts_with("by_gap_0_lower by_gap_0_upper by_gap_1_shape_radius by_gap_1_friction "));
    std::get<0>(walls.at_lower).friction = -1;
    CHECK_THROWS_AS(GapContact{walls}.check(), parameter_error);
}

TEST_CASE("A mirrored wall by the gap: matter comes as near as the gap; what does not push keeps its bits") {
    Random random(3);
    const auto weights = surface_weights<QuadraticBSpline, double>();
    const auto push = [](const NodeColumn<double, 2>& c, double u, double inward) {
        return -inward *
               (c.mass_on * (c.on[1] + inward * u) + 2 * c.mass_front * c.mass_behind / (c.mass_front + c.mass_behind) *
                                                         (c.front[1] + c.behind[1] + 2 * inward * u));
    };
    const auto energy = [](const NodeColumn<double, 2>& c) {
        return c.mass_on * dot(c.on, c.on) + c.mass_front * dot(c.front, c.front) +
               c.mass_behind * dot(c.behind, c.behind);
    };
    int acted = 0;
    for (int i = 0; i < 4000; ++i) {
        const NodeColumn<double, 2> column{random.vector<2>(-1, 1), random.vector<2>(-1, 1), random.vector<2>(-1, 1),
                                           random.uniform(0, 0.1),  random.uniform(0.1, 1),  random.uniform(0.1, 1)};
        const int inward = i % 2 == 0 ? 1 : -1;
        const double u = i % 5 == 0 ? 0.0 : random.uniform(0, 0.5);
        const auto after = mirrored_by_gap(column, 1, inward, Contact::separate, 0.3, weights, u);
        if (push(column, u, inward) <= 0) {
            REQUIRE(norm(after.on - column.on) + norm(after.front - column.front) +
                        norm(after.behind - column.behind) ==
                    0);
            REQUIRE(after.mass_front == column.mass_front);
            continue;
        }
        ++acted;
        REQUIRE(after.on[1] * inward == Approx(-u).margin(1e-12));
        REQUIRE(after.front[1] + after.behind[1] == Approx(-2 * u * inward).margin(1e-12));
        const auto same = mirrored_by_gap(column, 1, inward, Contact::separate, 0.3, weights, never_closing);
        REQUIRE(norm(same.on - column.on) + norm(same.front - column.front) == 0);
        const auto touching = mirrored_by_gap(column, 1, inward, Contact::slip, 0.3, weights, held_by_wall);
        const auto wall = mirrored(column, 1, inward, Contact::slip, 0.3, weights);
        REQUIRE(norm(touching.on - wall.on) + norm(touching.front - wall.front) + norm(touching.behind - wall.behind) ==
                0);
        if (u == 0) {  // both nodes beside the wall have m₊ + m₋ afterwards, half of which is the mirror image's
            auto folded = after;
            folded.mass_front = column.mass_front, folded.mass_behind = column.mass_behind;
            REQUIRE(energy(folded) <= energy(column) * (1 + 1e-12));
        }
    }
    CHECK(acted > 1000);
}

TEST_CASE("A boundary by the gap that is out of range is refused before a step") {
    auto walls = Walls<double, 2>::all({0, 0}, {1, 1}, {});
    Simulation simulation(Domain<2>{{0, 0}, {1, 1}, 1.0 / 16}, FixedCorotated<double>::from_young_poisson(1e5, 0.3),
                          GapContact{walls});
    simulation.add(sample_box<2>({0.4, 0.4}, {0.6, 0.6}, {.spacing = 1.0 / 32}), 1000);
    simulation.boundary.boundary.at_lower[1].friction = -1;
    CHECK_THROWS_AS(simulation.step(), parameter_error);
    simulation.boundary.boundary.at_lower[1].friction = 0;
    simulation.step();
    simulation.boundary.boundary.nodes_behind = NodesBehind::mirrored;
    simulation.boundary.boundary.lower[1] = 0.03;  // between nodes
    CHECK_THROWS_AS(simulation.step(), parameter_error);
    // By default, there are walls on all faces.
    SimulationWith<2, FixedCorotated<double>, GapContact<Walls<double, 2>>> with_default(
        Domain<2>{{0, 0}, {1, 2}, 1.0 / 16}, FixedCorotated<double>::from_young_poisson(1e5, 0.3));
    CHECK(with_default.boundary.boundary.upper[1] == 2);
}

}  // namespace gap_contact_tests
