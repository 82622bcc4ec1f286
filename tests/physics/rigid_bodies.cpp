// quick: no
/// \file Rigid bodies and matter: momenta, energies, bits, drives.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/data/mesh_distance.hpp>
#include <firn/data/sampled_distance.hpp>
#include <firn/firn.hpp>
#include <firn/io/restart.hpp>
#include <firn/rigid_body.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

using namespace firn;

namespace {

template <class S, int D>
using Ball = RigidBody<Collider<Sphere<S, D>>>;
template <class S, int D, class... Body>
using Around = GapContact<Together<Walls<S, D>, Body...>>;
template <class S, int D, class... Body>
using Run = SimulationWith<D, FixedCorotated<S>, Around<S, D, Body...>>;

template <class S, int D>
Ball<S, D> ball(double radius, double density, double friction, const Vec<double, D>& at,
                const Vec<double, D>& velocity) {
    Collider<Sphere<S, D>> solid{
        .shape = {S(radius)}, .friction = friction, .position = at, .linear_velocity = velocity};
    return {solid, density};
}

/// A block of 0.3 m with its centre at 1 m in every direction, without gravity, in a domain of 2 m.
template <class S, int D, class... Body>
Run<S, D, Body...> floating(int threads, Contact walls, const Body&... body) {
    const Domain<D> domain{Vec<double, D>::zero(), Vec<double, D>::filled(2), 1.0 / 32};
    const auto all = Walls<S, D>::all(cast<S>(domain.lower), cast<S>(domain.upper), {walls, 0});
    Run<S, D, Body...> run(domain, FixedCorotated<S>::from_young_poisson(S(1e5), S(0.3)), Coloured{threads},
                           Around<S, D, Body...>{Together(all, body...)});
    run.gravity = Vec<double, D>::zero();
    run.add(sample_box<D>(Vec<double, D>::filled(0.85), Vec<double, D>::filled(1.15), {.spacing = 1.0 / 64}), 1000);
    return run;
}
template <std::size_t I = 0, class Simulation>
auto& body_of(Simulation& run) {
    return std::get<I + 1>(run.boundary.boundary.parts);
}

/// Momentum and angular momentum about the origin of matter and bodies.
template <int D>
struct Momenta {
    Vec<double, D> linear;
    Axial<double, D> angular;
};
template <class Simulation, std::size_t... I>
auto momenta(Simulation& run, std::index_sequence<I...>) {
    constexpr int D = Simulation::dimension;
    const auto totals = run.totals();
    Momenta<D> sum{totals.momentum, totals.angular_momentum};
    const auto add = [&](const auto& body) {
        sum.linear += body.momentum;
        sum.angular = sum.angular + body.angular_momentum + axial_product(body.collider.position, body.momentum);
    };
    (add(body_of<I>(run)), ...);
    return sum;
}

/// The kinetic energy of the nodes [J].
template <class S, int D>
double energy_of(const SparseGrid<S, D>& grid) {
    double sum = 0;
    for (std::size_t b = 0; b < grid.block_count(); ++b)
        for (int node = 0; node < block_nodes<D>; ++node) {
            const auto* const numbers = grid.nodes(b) + node * node_width;
            double square = 0;
            for (int a = 0; a < D; ++a) square += double(numbers[a]) * double(numbers[a]);
            sum += 0.5 * double(numbers[node_mass]) * square;
        }
    return sum;
}

/// Lets a ball meet a block in free space, and checks momenta and the energy of each step's contact.
template <int D>
void meet(double density, double friction, int steps) {
    CAPTURE(D, density, friction);
    auto at = Vec<double, D>::filled(1), velocity = Vec<double, D>::zero();
    at[0] = 1.05, at[1] = 1.29, velocity[1] = -2;
    auto run = floating<double, D>(1, Contact::none, ball<double, D>(0.12, density, friction, at, velocity));
    double before = 0, gain = -1, most = 0;
    run.add_pass("energy before", "grid update",
                 [&](auto& now, const auto&) { before = energy_of(now.grid()) + body_of(now).kinetic_energy(); });
    run.add_pass("energy after", "act by gap", [&](auto& now, const auto&) {
        const double after = energy_of(now.grid()) + body_of(now).kinetic_energy();
        gain = std::max(gain, (after - before) / before);
        most = std::max(most, (before - after) / before);
    });
    std::vector<std::string> warnings;
    run.warn = [&](const std::string& text) { warnings.push_back(text); };
    const auto start = momenta(run, std::index_sequence<0>{});
    const double scale = norm(body_of(run).momentum);
    for (int i = 0; i < steps; ++i) run.step();
    const auto end = momenta(run, std::index_sequence<0>{});
    const auto turned = end.angular - start.angular;
    CAPTURE(gain, most, warnings);
    CHECK(norm(end.linear - start.linear) <= 1e-12 * scale);
    CHECK(std::sqrt(squared_norm(skew(turned))) <= 1e-12 * scale);  // about 1 m away
    CHECK(gain <= 1e-12);
    CHECK(most > 1e-6);
    CHECK(body_of(run).velocity()[1] > -1.5);
    CHECK(warnings.empty());
}

}  // namespace

TEST_CASE("A rigid ball meets a block in free space: momenta are kept, and contact gains no energy") {
    for (const double friction : {0.0, 0.4})
        // A node of the block has up to 1 kg in 2D; the lightest of these balls has 0.05 kg.
        for (const double density : {1000.0, 100.0, 1.0}) meet<2>(density, friction, 300);
    meet<3>(1000, 0.4, 300);
    meet<3>(1, 0.4, 200);
}

TEMPLATE_TEST_CASE("A rigid ball on a block on the floor: gravity and walls alone change the momentum of both", "",
                   float, double) {
    using S = TestType;
    const Domain<3> domain{{0, 0, 0}, {1, 1, 1}, 1.0 / 16};
    auto body = ball<S, 3>(0.15, 2000, 0.3, {0.45, 0.46, 0.5}, {1.0, -1.0, 0.0});
    body.angular_momentum = {0.0, 0.0, 0.5};
    Run<S, 3, Ball<S, 3>> run(domain, FixedCorotated<S>::from_young_poisson(S(1e5), S(0.3)), Coloured{1},
                              Around<S, 3, Ball<S, 3>>{Together(
                                  Walls<S, 3>::all({S(0), S(0), S(0)}, {S(1), S(1), S(1)}, {Contact::slip, 0}), body)});
    run.add(sample_box<3>({0.2, 0.0, 0.2}, {0.8, 0.3, 0.8}, {.spacing = 1.0 / 32}), 1000);
    run.reactions.emplace();
    run.warn = {};
    run.fixed_time_step = 2e-4;
    const double scale = norm(body_of(run).momentum);
    double worst = 0, pushed = 0;
    for (int i = 0; i < 400; ++i) {
        const auto before = run.totals().momentum + body_of(run).momentum;
        run.step();
        const auto& of_walls = run.reactions->parts[0];
        const double mass = run.totals().mass + body_of(run).mass;
        const auto expected = before + run.gravity * (mass * 2e-4) + of_walls.impulse;
        worst = std::max(worst, norm(run.totals().momentum + body_of(run).momentum - expected) / scale);
        pushed += norm(run.reactions->parts[1].impulse);
    }
    CAPTURE(worst, pushed, scale);
    CHECK(worst <= (sizeof(S) == 4 ? 2e-7 : 1e-14));  // in one step
    CHECK(pushed > 0.3 * scale);
    CHECK(body_of(run).velocity()[1] > -1);                                    // it was stopped
    CHECK(body_of(run).angular_velocity()[2] < 0.5 / body.inertia[2] - 1e-3);  // and friction turned it
}

TEST_CASE("Two light balls squeeze a block: momenta are kept and both are stopped") {
    Vec<double, 2> left{0.72, 1.0}, right{1.28, 1.02}, there{1.5, 0.0};
    auto run = floating<double, 2>(1, Contact::none, ball<double, 2>(0.1, 20, 0.3, left, there),
                                   ball<double, 2>(0.1, 5, 0.3, right, -there));
    const auto start = momenta(run, std::index_sequence<0, 1>{});
    std::vector<std::string> warnings;
    run.warn = [&](const std::string& text) { warnings.push_back(text); };
    for (int i = 0; i < 300; ++i) run.step();
    const auto end = momenta(run, std::index_sequence<0, 1>{});
    CAPTURE(warnings);
    CHECK(norm(end.linear - start.linear) <= 1e-13);
    CHECK(std::abs(end.angular - start.angular) <= 1e-13);
    CHECK(body_of<0>(run).velocity()[0] < 0.5);
    CHECK(body_of<1>(run).velocity()[0] > -0.5);
    CHECK(warnings.empty());
}

TEST_CASE("A run with rigid bodies has the same bits on any number of threads, and after a restart") {
    const Vec<double, 3> at{1.05, 1.29, 1.0}, velocity{0.0, -2.0, 0.0};
    const auto made = [&](int threads) {
        auto run = floating<float, 3>(threads, Contact::separate, ball<float, 3>(0.12, 300, 0.4, at, velocity));
        run.gravity = {0.0, -9.81, 0.0};
        run.warn = {};
        return run;
    };
    auto one = made(1);
    for (int i = 0; i < 60; ++i) one.step();
    const auto half = state_of(one);
    for (int i = 0; i < 60; ++i) one.step();
    const auto end = state_of(one);
    const auto same = [&](auto& other) {
        const auto state = state_of(other);
        const auto &a = body_of(one), &b = body_of(other);
        bool equal = std::memcmp(&a.momentum, &b.momentum, sizeof a.momentum) == 0 &&
                     std::memcmp(&a.angular_momentum, &b.angular_momentum, sizeof a.angular_momentum) == 0 &&
                     std::memcmp(&a.collider.position, &b.collider.position, sizeof a.collider.position) == 0 &&
                     std::memcmp(&a.collider.rotation, &b.collider.rotation, sizeof a.collider.rotation) == 0;
        for (std::size_t f = 0; f < end.fields.size(); ++f)
            equal = equal && state.fields[f].values == end.fields[f].values;
        return equal;
    };
    CHECK(norm(body_of(one).angular_momentum) > 0);
    auto three = made(3);
    for (int i = 0; i < 120; ++i) three.step();
    CHECK(same(three));
    auto again = made(2);
    restore(again, half);
    for (int i = 0; i < 60; ++i) again.step();
    CHECK(same(again));
    auto copy = again;
    again.step();
    CHECK_FALSE(same(again));
    CHECK(same(copy));
}

TEST_CASE("A drive that keeps all velocities moves a body as a collider moves") {
    const Vec<double, 2> at{1.05, 1.29}, velocity{0.2, -1.0};
    auto kept = ball<double, 2>(0.12, 500, 0.4, at, velocity);
    kept.drive.keep(0, 0.2).keep(1, -1.0).keep(2, 3.0);
    kept.set_velocity(velocity, 3.0);
    auto given = kept.collider;
    auto one = floating<double, 2>(1, Contact::none, kept);
    auto other = floating<double, 2>(1, Contact::none, given);
    other.reactions.emplace();
    double least = 0;
    for (int i = 0; i < 200; ++i) {
        one.step(), other.step();
        const auto& reaction = other.reactions->parts[1];
        const auto& body = body_of(one);
        least = std::min(least, body.driven[1]);
        // The drive gives what matter takes.
        REQUIRE(std::abs(body.driven[1] - reaction.impulse[1] / other.last_time_step()) <= 1e-6);
        REQUIRE(std::abs(body.driven[2] - reaction.angular_impulse / other.last_time_step()) <= 1e-6);
    }
    CHECK(norm(body_of(one).collider.position - body_of(other).position) <= 1e-14);
    CHECK(norm(body_of(one).collider.rotation - body_of(other).rotation) <= 1e-14);
    CHECK(std::abs(one.totals().kinetic_energy - other.totals().kinetic_energy) <=
          1e-10 * other.totals().kinetic_energy);
    CHECK(least < -10);
}

TEST_CASE("Drives of a body that nothing touches follow their equations") {
    const Vec<double, 2> at{0.4, 1.6};
    auto body = ball<double, 2>(0.1, 500, 0.0, at, {});
    const double m = body.mass, k = 40 * m, c = 3 * m, dt = 1e-3;
    body.drive.hold(0, k, c);
    body.drive.position = {0.5, 0.0};
    body.drive.keep(1, 0.3, 2 * m);  // with at most 2 m/s² of acceleration
    body.drive.hold(2, 30 * body.inertia[0], 0);
    body.drive.rotation = rotor(degrees(20));
    auto run = floating<double, 2>(1, Contact::none, body);
    run.fixed_time_step = dt;
    double x = at[0], u = 0, angle = 0, spin = 0;
    for (int i = 0; i < 400; ++i) {
        run.step();
        // Implicit Euler of m x'' = k (0.5 − x) − c x', and of the spring that turns.
        u = (u + dt * k / m * (0.5 - x)) / (1 + dt * (c + dt * k) / m);
        x += dt * u;
        spin = (spin + dt * 30 * (degrees(20).in_radians() - angle)) / (1 + 30 * dt * dt);
        angle += dt * spin;
        const auto& now = body_of(run);
        REQUIRE(std::abs(now.collider.position[0] - x) <= 1e-13);
        REQUIRE(std::abs(turn_between(no_rotation<double, 2>(), now.collider.rotation) - angle) <= 1e-12);
        // The force is the largest until the velocity is reached, and then none.
        REQUIRE(std::abs(now.velocity()[1] - std::min(2 * dt * (i + 1), 0.3)) <= 1e-12);
    }
    CHECK(std::abs(body_of(run).driven[1]) <= 1e-9);
}

TEST_CASE("The velocities of bodies that press sand against walls are found in every step") {
    // Sand between ball and wall is rubbed by both, along the edge between them.
    constexpr double width = 0.5, h = width / 12;
    const auto walls = Walls<float, 3>::all({}, Vec<float, 3>::filled(float(width)), {Contact::separate, 0.5});
    for (const double speed : {0.0, 3.0}) {
        using Solid = Ball<float, 3>;
        SimulationWith<3, Sand<float>, Around<float, 3, Solid, Solid>> run(
            {{}, Vec<double, 3>::filled(width), h}, Sand<float>::from_properties({.young = 2e5F}), Coloured{2},
            {Together(walls, ball<float, 3>(0.08, 800, 0.5, {0.1, 0.33, 0.2}, {-0.5, -1, 0.1 * speed}),
                      ball<float, 3>(0.08, 800, 0.5, {0.3, 0.33, 0.1}, {0.1, -speed, -0.5}))});
        run.gravity = {0, -9.81, 0};
        run.add(sample_box<3>({}, {width, width / 2, width}, {.spacing = h / 2}), 1600);
        std::vector<std::string> warnings;
        run.warn = [&](const std::string& text) { warnings.push_back(text); };
        for (int step = 0; step < 200; ++step) run.step();
        CAPTURE(speed, warnings);
        CHECK(warnings.empty());
        CHECK(body_of<0>(run).velocity()[1] > -0.9);  // the sand has slowed it
    }
}

TEST_CASE("Bodies that slide through sand do not push it into walls") {
    constexpr double width = 0.5, h = width / 12;
    using Solid = RigidBody<Collider<Box<float, 3>>>;
    const auto brick = [&](const Vec<double, 3>& at, const Vec<double, 3>& velocity, Angle turn) {
        Collider<Box<float, 3>> solid{.shape = {{0.1F, 0.06F, 0.08F}}, .friction = 0.5};
        solid.position = at, solid.linear_velocity = velocity;
        solid.rotation = rotor(Vec<double, 3>{0.6, 0, 0.8}, turn);
        return Solid{solid, 800.0};
    };
    const auto walls = Walls<float, 3>::all({}, Vec<float, 3>::filled(float(width)), {Contact::separate, 0.5});
    // Around the walls the domain has room, so that sand in them would be seen.
    SimulationWith<3, Sand<float>, Around<float, 3, Solid, Solid>> run(
        {Vec<double, 3>::filled(-h), Vec<double, 3>::filled(width + h), h},
        Sand<float>::from_properties({.young = 2e5F}), Coloured{2},
        {Together(walls, brick({0.14, 0.36, 0.2}, {-1, -3, 0.3}, radians(0.7)),
                  brick({0.36, 0.36, 0.12}, {0.1, -3, -1}, radians(-0.5)))});
    run.gravity = {0, -9.81, 0};
    run.warn = {};  // of that room
    run.add(sample_box<3>({}, {width, width / 2, width}, {.spacing = h / 2}), 1600);
    double deepest = 0;
    for (int step = 0; step < 1000; ++step) run.step();
    const auto& particles = run.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        for (int a = 0; particles.is_particle(slot) && a < 3; ++a) {
            const double x = particles.exact_position(slot)[a];
            deepest = std::max({deepest, -x, x - width});
        }
    CHECK(deepest <= 1e-3 * h);
}

TEST_CASE("A rigid body refuses an acceleration that depends on the place") {
    auto run = floating<double, 2>(1, Contact::none, ball<double, 2>(0.1, 500, 0.0, {0.4, 1.6}, {}));
    test_support::check_refused<usage_error>([&] { run.step([]<class P>(const Vec<P, 2>& x) { return x * P(-1); }); },
                                             "the same everywhere");
}

namespace {
/// The same box by its distances, which lie 0.37 spacings beside its faces.
DistanceGrid<double, 2> grid_of(const Box<double, 2>& box, double spacing) {
    const auto around = Vec<double, 2>::filled(12.37 * spacing);
    return {sampled_distance<2>(
        box, {.lower = -box.half_extents - around, .upper = box.half_extents + around, .spacing = spacing})};
}
/// A rigid block slides down a slab of elastic matter, from rest: its acceleration over g (sin θ − μ cos θ), and its
/// speed at the end [m/s]. The block is let go when the weight of both is on the slab.
struct Slide {
    double acceleration, speed;
};
template <class Shape>
Slide slide(const Box<double, 2>& cuboid, const Shape& shape, Angle slope, double friction) {
    using Block = RigidBody<Collider<Shape>>;
    const double h = 1.0 / 40, top = 0.15, angle = slope.in_radians(), g = 9.81;
    const Domain<2> domain{{0, 0}, {2, 0.5}, h};
    auto walls = Walls<double, 2>::all(domain.lower, domain.upper, {Contact::slip, 0});
    walls.at_lower[1].contact = Contact::stick;
    walls.at_upper[1].contact = Contact::none;
    Collider<Shape> solid{.shape = shape, .friction = friction, .position = {0.4, top + cuboid.half_extents[1]}};
    Block block(solid, mass_of(cuboid, 1000.0));
    block.drive.keep(0, 0);
    Run<double, 2, Block> run(domain, FixedCorotated<double>::from_young_poisson(1e7, 0.3), Coloured{1},
                              Around<double, 2, Block>{Together(walls, block)});
    run.add(sample_box<2>({0, 0}, {2, top}, {.spacing = h / 2}), 1000);
    run.warn = {};
    while (run.time() < 0.3) {
        run.gravity = Vec<double, 2>{std::sin(angle), -std::cos(angle)} * (g * std::min(run.time() / 0.2, 1.0));
        run.step();
    }
    body_of(run).drive.release(0);
    run.advance(0.1);
    const double before = body_of(run).velocity()[0], start = run.time();
    run.advance(0.2);
    const double speed = body_of(run).velocity()[0];
    return {(speed - before) / ((run.time() - start) * g * (std::sin(angle) - friction * std::cos(angle))), speed};
}
}  // namespace

TEST_CASE("A rigid block slides down an incline of elastic matter by Coulomb's law") {
    const Box<double, 2> box{{0.2, 0.05}};
    CHECK(slide(box, box, degrees(30), 0.3).acceleration == Approx(1).epsilon(0.015));
    CHECK(slide(box, box, degrees(30), 0.0).acceleration == Approx(1).epsilon(0.015));
    // tan⁻¹ 0.3 is 16.7°.
    CHECK(slide(box, box, degrees(17.2), 0.3).acceleration == Approx(1).epsilon(0.015));
    CHECK(std::abs(slide(box, box, degrees(16.2), 0.3).speed) <= 2e-3);
    // A grid of distances rounds edges off within a spacing. When matter caught at them, these were 0, −0.01 and −0.23.
    const auto grid = grid_of(box, 1.0 / 80);
    CHECK(slide(box, grid, degrees(30), 0.0).acceleration == Approx(1).epsilon(0.08));
    CHECK(slide(box, grid, degrees(30), 0.3).acceleration == Approx(1).epsilon(0.04));
    CHECK(slide(box, grid, degrees(17.2), 0.3).acceleration == Approx(1).epsilon(0.02));
}

namespace {
/// How far a block falls without friction between two posts that are shorter than it, over a free fall.
/// \param beside  gap between post and block [cells]
template <class Shape>
double fall_between(const Shape& post, double width, double beside) {
    const double h = 0.01, side = 0.16;
    using Post = Collider<Shape>;
    Post left{.shape = post}, right = left;
    left.position = {0.32 - side / 2 - width / 2 - beside * h, 0.32};
    right.position = {0.32 + side / 2 + width / 2 + beside * h, 0.32};
    SimulationWith<2, FixedCorotated<double>, GapContact<Together<Post, Post>>> run(
        {{0, 0}, {0.64, 0.64}, h}, FixedCorotated<double>::from_young_poisson(1e5, 0.3), Coloured{1},
        GapContact{Together(left, right)});
    run.add(sample_box<2>({0.32 - side / 2, 0.32 - side / 2}, {0.32 + side / 2, 0.32 + side / 2}, {.spacing = h / 2}),
            1000);
    run.warn = {};
    const auto height = [&] { return run.totals().first_moment[1] / run.totals().mass; };
    const double before = height();
    run.advance(0.1);
    return (before - height()) / (0.5 * 9.81 * 0.01);
}

/// The part of its speed that a block keeps which slides over a plate, on to it past one edge and off it past another,
/// without friction.
/// \param plate  0.16 m × 0.12 m, in 3D × 0.2 m;  \param turn  from the axes to those of the plate
template <int D, class Shape>
double kept(const Shape& plate, const Rotor<double, D>& turn, double speed_across) {
    const double h = 0.02, speed = 0.5;
    Vec<double, D> corner = Vec<double, D>::filled(0.3), middle{-0.08, -0.06}, lower{-0.22, 0.0}, upper{-0.12, 0.06};
    corner[0] += 0.3 * h, corner[1] += 0.2 * h;
    Vec<double, D> along{1.0, 0.0}, way{speed, 0.0};
    if constexpr (D == 3) lower[2] = -0.05, upper[2] = 0.05, way[2] = speed_across;
    const Mat<double, D> R = matrix_of(turn);
    Collider<Shape> solid{.shape = plate};
    solid.rotation = turn;
    solid.position = corner + R * middle;
    SimulationWith<D, FixedCorotated<double>, GapContact<Collider<Shape>>> run(
        {Vec<double, D>::zero(), Vec<double, D>::filled(0.64), h}, FixedCorotated<double>::from_young_poisson(1e5, 0.3),
        Coloured{1}, GapContact{solid});
    run.warn = {};
    run.gravity = Vec<double, D>::zero();
    auto block = sample_box<D>(lower, upper, {.spacing = h / 2});
    for (auto& x : block.positions) x = corner + R * x;
    run.add(block, 1000, R * way);
    run.advance((D == 2 ? 0.25 : 0.09) / speed);
    return dot(run.totals().momentum, R * along) / run.totals().mass / speed;
}
}  // namespace

TEST_CASE("Matter does not catch at the edges of a box, nor at those of a grid of its distances") {
    const Box<double, 2> post{{0.03, 0.05}}, plate{{0.08, 0.06}};
    for (const double beside : {0.0, 0.25, 0.5, 1.0}) {
        CAPTURE(beside);
        CHECK(fall_between(post, 0.06, beside) == Approx(1).epsilon(0.02));
        CHECK(fall_between(grid_of(post, 0.005), 0.06, beside) == Approx(1).epsilon(0.02));  // 0.21, 0.45, 0.79, 1
        CHECK(fall_between(grid_of(post, 0.01), 0.06, beside) == Approx(1).epsilon(0.02));   // 0.24, 0.35, 0.80, 1
    }
    // Some speed is lost in the step in which the block reaches the node before the edge, to the edge's own normal.
    for (const double angle : {0.0, 0.3, 0.7}) {
        CAPTURE(angle);
        const auto turn = rotor(radians(angle));
        const double of_box = kept<2>(plate, turn, 0.0);
        CHECK(of_box > 0.94);
        CHECK(kept<2>(grid_of(plate, 0.01), turn, 0.0) > of_box - 0.02);
        CHECK(kept<2>(grid_of(plate, 0.02), turn, 0.0) > of_box - 0.02);
    }
    TriangleMesh mesh;
    for (int corner = 0; corner < 8; ++corner)
        mesh.vertices.push_back({corner & 1 ? 0.08 : -0.08, corner & 2 ? 0.06 : -0.06, corner & 4 ? 0.1 : -0.1});
    mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
    const DistanceGrid<double, 3> grid{mesh_distance(mesh, {.spacing = 0.01})};
    const Rotor<double, 3> turns[] = {no_rotation<double, 3>(), rotor({0, 1, 0}, degrees(35)),
                                      rotor({0.6, 0.8, 0.0}, degrees(20))};
    for (const auto& turn : turns) {  // before: 0.02, 0.09 and 0.08
        const double of_box = kept<3>(Box<double, 3>{{0.08, 0.06, 0.1}}, turn, 0.2);
        CHECK(of_box > 0.94);
        CHECK(kept<3>(grid, turn, 0.2) > of_box - 0.02);
    }
}
