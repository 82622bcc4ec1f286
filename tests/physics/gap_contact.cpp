// quick: no
/// \file Walls and colliders that act by the gap of particles: when a block first feels them, how deep it sinks under
/// its weight, how it slides, and that it leaves them freely.
#include "support/catch.hpp"
#include <firn/firn.hpp>

#include <algorithm>
#include <numbers>

namespace gap_contact_physics {

using namespace firn;

namespace {

constexpr double h = 1.0 / 32, E = 1e6, density = 1000, g = 9.81;
using Elastic = FixedCorotated<double>;

template <int D>
Walls<double, D> box(Wall wall = {}) {
    return Walls<double, D>::all(Vec<double, D>::zero(), Vec<double, D>::filled(1), wall);
}
template <int D>
Domain<D> domain() {
    return {Vec<double, D>::zero(), Vec<double, D>::filled(1), h};
}
/// A block whose lower face has its middle at a point, turned about this point.
template <int D>
Samples<D> block(const Vec<double, D>& middle, double side, const Mat<double, D>& turn) {
    Vec<double, D> lower = Vec<double, D>::filled(-side / 2), upper = -lower;
    lower[1] = 0, upper[1] = side;
    auto samples = sample_box<D>(lower, upper, {.spacing = h / 2});
    for (auto& x : samples.positions) x = middle + turn * x;
    return samples;
}
template <class Simulation>
auto force_of(const Simulation& simulation) {
    auto sum = Vec<double, Simulation::dimension>::zero();
    for (const auto& part : simulation.reactions->parts) sum += part.impulse;
    return sum * (1 / simulation.last_time_step());
}

struct Fall {
    double first = 1;    ///< gap between block and surface when it first felt a force [cells]
    double tension = 0;  ///< the largest force that pulled it, over the largest that pushed it
    double impulse = 0;  ///< the boundary's impulse over the change of momentum, minus 1
    bool left = false;   ///< whether it left the surface
};
/// A block flies slowly at a surface with this unit normal, which it touches at `touch`.
template <int D, class Boundary, class... Policies>
Fall fall(const Boundary& boundary, const Vec<double, D>& touch, const Mat<double, D>& turn,
          const Policies&... policies) {
    const double away = 0.4 * h, speed = 0.1;
    const Vec<double, D> up = [&] {
        Vec<double, D> axis = Vec<double, D>::zero();
        axis[1] = 1;
        return turn * axis;
    }();
    Simulation simulation(domain<D>(), Elastic::from_young_poisson(E, 0.3), GapContact{boundary}, Coloured{1},
                          policies...);
    simulation.warn = {};
    simulation.gravity = Vec<double, D>::zero();
    simulation.add(block<D>(touch + up * away, 0.25, turn), density, up * -speed);
    simulation.reactions.emplace();
    const double before = dot(simulation.totals().momentum, up);
    Fall out;
    double most = 0, pull = 0, impulse = 0, step = 0;
    while (simulation.time() < 3 * away / speed) {
        simulation.step();
        const double force = dot(force_of(simulation), up);
        impulse += force * simulation.last_time_step();
        if (force != 0 && out.first == 1) {
            out.first = (away - speed * simulation.time()) / h;
            step = speed * simulation.last_time_step() / h;
        }
        most = std::max(most, force);
        pull = std::max(pull, -force);
        out.left = force == 0;
    }
    CAPTURE(step);
    out.tension = pull / most;
    out.impulse = impulse / (dot(simulation.totals().momentum, up) - before) - 1;
    return out;
}

template <int D, class Boundary, class... Policies>
void check_fall(const Boundary& boundary, const Vec<double, D>& touch, double bar = 0.05,
                const Mat<double, D>& turn = Mat<double, D>::identity(), const Policies&... policies) {
    const Fall one = fall<D>(boundary, touch, turn, policies...);
    CAPTURE(D, touch[1] / h, one.first);
    CHECK(std::abs(one.first) < bar);
    CHECK(one.tension == 0);
    CHECK(one.left);
    CHECK(std::abs(one.impulse) < 1e-9);
}

template <int D>
Vec<double, D> at(double height) {
    auto point = Vec<double, D>::filled(0.5);
    point[1] = height;
    return point;
}
template <int D>
auto half_space(double height) {
    Collider<HalfSpace<double, D>> floor;
    floor.position = at<D>(height);
    return floor;
}

/// How far the middle of a block sinks that is laid on a surface, beyond what elasticity says [cells], and how far what
/// it weighs and the boundary's force are apart, relative.
template <class Boundary>
double sinks(const Boundary& boundary, double height, double& misfit) {
    Simulation simulation(domain<2>(), Elastic::from_young_poisson(E, 0.3), GapContact{boundary}, Coloured{1}, Pic{});
    simulation.warn = {};
    simulation.gravity = {0, -g};
    const double side = 0.25;
    simulation.add(block<2>({0.5, height}, side, Mat<double, 2>::identity()), density);
    simulation.reactions.emplace();
    const auto middle = [&] { return simulation.totals().first_moment[1] / simulation.totals().mass; };
    const double start = middle();
    simulation.advance(0.5);
    simulation.step();
    misfit = force_of(simulation)[1] / (simulation.totals().mass * g) - 1;
    const double elastic = density * g * side * side / 3 * (1 - 0.3 * 0.3) / E;  // mean of ρ g (H y − y²/2) (1 − ν²)/E
    return (start - middle() - elastic) / h;
}

}  // namespace

TEST_CASE("A block feels walls by the gap when it touches them, and leaves them without traction") {
    auto walls = box<2>();
    for (const double cells : {0.0, 4.0, 4.3, 4.8}) {
        walls.lower[1] = cells * h;
        check_fall<2>(walls, at<2>(cells * h));
    }
    walls.lower[1] = 4 * h;
    check_fall<2>(walls, at<2>(4 * h), 0.05, Mat<double, 2>::identity(), Flip<double>{.ratio = 0.99});
    check_fall<2>(walls, at<2>(4 * h), 0.05, Mat<double, 2>::identity(), CubicBSpline{}, WeightGradientForce{});
    check_fall<3>(box<3>(), at<3>(0));
}

TEST_CASE("A block feels mirrored walls by the gap when it touches them, and leaves them without traction") {
    auto walls = box<2>();
    walls.nodes_behind = NodesBehind::mirrored;
    check_fall<2>(walls, at<2>(0));
    check_fall<2>(walls, at<2>(0), 0.05, Mat<double, 2>::identity(), Flip<double>{.ratio = 0.99});
    check_fall<2>(walls, at<2>(0), 0.05, Mat<double, 2>::identity(), Fmpm{.order = 3}, FBar{});
    auto in_3d = box<3>();
    in_3d.nodes_behind = NodesBehind::mirrored;
    check_fall<3>(in_3d, at<3>(0));
}

TEST_CASE("A block feels colliders by the gap when it touches them, and leaves them without traction") {
    for (const double cells : {4.0, 4.3, 4.8})
        check_fall<2>(Together(box<2>(), half_space<2>(cells * h)), at<2>(cells * h));
    check_fall<3>(half_space<3>(4.6 * h), at<3>(4.6 * h));
    // Round solids touch the block's face at one point.
    Collider<Sphere<double, 2>> ball{.shape = {8 * h}, .position = {0.5, 0.0}};
    Collider<Capsule<double, 3>> capsule{.shape = {0.3, 8 * h}, .position = {0.5, 0, 0.5}};
    capsule.rotation = rotor({0, 0, 1}, degrees(90));
    for (const double cells : {9.0, 9.4}) {
        ball.position[1] = capsule.position[1] = (cells - 8) * h;
        check_fall<2>(ball, at<2>(cells * h));
        check_fall<3>(capsule, at<3>(cells * h));
    }
    // A turned block on a turned half-space.
    const double angle = std::numbers::pi / 6;
    const Mat<double, 2> turn = matrix_of(rotor(radians(angle)));
    Collider<HalfSpace<double, 2>> slope = half_space<2>(0.4);
    slope.rotation = rotor(radians(angle));
    check_fall<2>(slope, at<2>(0.4), 0.15, turn);
}

TEST_CASE("A block comes to rest on the surface: it sinks as far as its elasticity says") {
    const double strain = density * g * 0.25 / E;
    const auto check = [&](const auto& boundary, double height, double bar) {
        double misfit = 1;
        const double cells = sinks(boundary, height, misfit);
        CAPTURE(height / h, cells / strain);
        CHECK(std::abs(cells) < bar * strain);
        CHECK(std::abs(misfit) < 2e-2);
    };
    auto walls = box<2>();
    check(walls, 0, 0.6);  // measured: 0.42 cells × the strain; mirrored 0.17
    walls.nodes_behind = NodesBehind::mirrored;
    check(walls, 0, 0.3);
    // The solid's layer of nodes that take part makes the block's lowest cells stiff.
    for (const double cells : {4.0, 4.25, 4.5, 4.75}) {
        auto floor = half_space<2>(cells * h);
        check(floor, cells * h, 1.2);
        floor.thickness_in_cells = 0.75;
        check(floor, cells * h, 1.0);
    }
}

TEST_CASE("A block slides on walls and colliders by the gap as Coulomb's law says") {
    const double angle = std::numbers::pi / 6, duration = 0.2;
    const auto check = [&](auto boundary, double height, double friction) {
        Simulation simulation(domain<2>(), Elastic::from_young_poisson(1e7, 0.3), GapContact{boundary}, Coloured{1});
        simulation.warn = {};
        simulation.gravity = Vec<double, 2>{std::sin(angle), -std::cos(angle)} * g;
        auto samples = sample_box<2>({0.2, height}, {0.5, height + 0.1}, {.spacing = h / 2});
        simulation.add(samples, density);
        simulation.reactions.emplace();
        Vec<double, 2> impulse{};
        while (simulation.time() < duration) {
            simulation.step();
            impulse += force_of(simulation) * simulation.last_time_step();
        }
        const auto totals = simulation.totals();
        const auto expected = g * (std::sin(angle) - friction * std::cos(angle)) * simulation.time();
        CAPTURE(friction, totals.momentum[0] / totals.mass, expected);
        CHECK(totals.momentum[0] / totals.mass == Approx(expected).epsilon(0.01));
        CHECK(norm(impulse + simulation.gravity * totals.mass * simulation.time() - totals.momentum) <
              1e-9 * norm(impulse));
    };
    for (const double friction : {0.0, 0.3}) {
        auto walls = box<2>({Contact::separate, friction});
        check(walls, 0, friction);
        walls.nodes_behind = NodesBehind::mirrored;
        check(walls, 0, friction);
        auto floor = half_space<2>(4.4 * h);
        floor.friction = friction;
        check(floor, 4.4 * h, friction);
    }
}

TEST_CASE("Contact groups meet by their law while a boundary acts by the gap") {
    // Two blocks, one on the other, on a floor: the floor bears both, the lower one the upper one.
    Simulation simulation(domain<2>(), Elastic::from_young_poisson(E, 0.3), GapContact{box<2>()},
                          CoulombContact{.friction = 0.3}, Coloured{1}, Pic{});
    simulation.warn = {};
    simulation.gravity = {0, -g};
    const auto lower = block<2>({0.5, 0.0}, 0.25, Mat<double, 2>::identity());
    const auto upper = block<2>({0.5, 0.25}, 0.25, Mat<double, 2>::identity());
    simulation.add(lower, density);
    simulation.set_contact_group(simulation.add(upper, density), 1);
    simulation.reactions.emplace();
    simulation.contact_impulses.emplace();
    simulation.advance(0.5);
    const double weight = 0.5 * simulation.totals().mass * g, from = simulation.time();
    double of_floor = 0, between = 0;
    while (simulation.time() < from + 0.3) {  // the blocks still swing
        simulation.step();
        of_floor += force_of(simulation)[1] * simulation.last_time_step();
        between += simulation.contact_impulses->on(1, 0)[1];
    }
    const double duration = simulation.time() - from;
    CHECK(of_floor / duration == Approx(2 * weight).epsilon(0.02));
    CHECK(between / duration == Approx(weight).epsilon(0.02));
}

}  // namespace gap_contact_physics
