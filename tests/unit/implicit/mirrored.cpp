// quick: no
/// \file Mirrored walls in quasi-static and implicit steps: planes of symmetry, columns, reactions, explicit steps,
/// threads, refusals.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/firn.hpp>
#include <firn/implicit.hpp>

#include <map>

namespace implicit_mirrored_tests {
using namespace firn;

constexpr double density = 1000, g = 9.81;

template <class Simulation, class F>
void for_particles(const Simulation& simulation, const F& f) {
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) f(slot);
}
template <class Simulation>
auto positions(const Simulation& simulation) {
    std::vector<Vec<double, Simulation::dimension>> all(simulation.particles().size());
    for_particles(simulation, [&](std::size_t slot) {
        all[simulation.particles().id(slot)] = simulation.particles().exact_position(slot);
    });
    return all;
}
template <class Simulation>
auto impulse(const Simulation& simulation) {
    Vec<double, Simulation::dimension> sum{};
    for (const auto& part : simulation.reactions->parts) sum += part.impulse;
    return sum;
}

/// Walls through 0 along some axes, on planes of nodes.
template <int D>
Walls<double, D> mirrored_at_0(const Domain<D>& domain, std::initializer_list<int> axes, Contact contact) {
    auto walls = Walls<double, D>::all(Vec<double, D>::zero(), domain.upper, {Contact::none, 0});
    for (const int a : axes) walls.at_lower[std::size_t(a)].contact = contact;
    walls.nodes_behind = NodesBehind::mirrored;
    return walls;
}

/// A block on a floor: all of it, a half beside a plane of symmetry, or a quarter beside two. Its upper surface lies
/// close to a plane of nodes, so small nodes hang there.
template <int D, class... Policies>
auto on_floor(int planes_of_symmetry, const Policies&... policies) {
    const double h = 0.05;
    const double half = D == 2 ? 0.2 : 0.1;
    Vec<double, D> low = Vec<double, D>::filled(-half), high = Vec<double, D>::filled(half);
    low[1] = 0, high[1] = half + 0.025;
    if (planes_of_symmetry > 0) low[0] = 0;
    if (planes_of_symmetry > 1) low[D - 1] = 0;
    const Domain<D> domain(Vec<double, D>::filled(-0.6), Vec<double, D>::filled(0.6), h);
    auto planes = mirrored_at_0<D>(domain, {0, D - 1}, Contact::slip);
    if (planes_of_symmetry < 1) planes.at_lower[0].contact = Contact::none;
    if (planes_of_symmetry < 2) planes.at_lower[D - 1].contact = Contact::none;
    Simulation simulation(domain, NeoHookean<double>::from_young_poisson(1e5, 0.3),
                          Together(mirrored_at_0<D>(domain, {1}, Contact::stick), planes), policies...);
    simulation.warn = {};
    simulation.add(sample_box<D>(low, high, {.spacing = h / 2}), density);
    simulation.reactions.emplace();
    simulation.integration.newton.tolerance = 1e-13;
    simulation.integration.newton.forcing = 1e-6;
    return simulation;
}
/// Compares a part of a block with the whole one, particle by particle, after some steps.
template <class Part, class Whole>
void check_symmetry(Part& part, Whole& whole, int steps, double dt, int images) {
    constexpr int D = Part::dimension;
    constexpr bool has_inertia = decltype(part.integration)::has_inertia;
    const auto key = [](const Vec<double, D>& x) {
        std::array<int, std::size_t(D)> of{};
        for (int a = 0; a < D; ++a) of[std::size_t(a)] = int(std::lround(x[a] / 0.0125));
        return of;
    };
    std::map<std::array<int, std::size_t(D)>, std::size_t> of_whole;
    const auto begin = positions(part), whole_begin = positions(whole);
    for (std::size_t i = 0; i < whole_begin.size(); ++i) of_whole[key(whole_begin[i])] = i;
    for (int k = 0; k < steps; ++k) {
        part.advance(dt);
        whole.advance(dt);
    }
    CHECK(part.solution.small_nodes > 0);
    const auto end = positions(part), whole_end = positions(whole);
    double error = 0, largest = 0, aside = 0;
    for (std::size_t i = 0; i < begin.size(); ++i) {
        const std::size_t j = of_whole.at(key(begin[i]));
        error = std::max(error, norm(end[i] - whole_end[j]));
        largest = std::max(largest, norm(end[i] - begin[i]));
        aside = std::max(aside, std::abs(end[i][0] - begin[i][0]));
    }
    CHECK(largest > 1e-4);
    CHECK(aside > 1e-5);
    CHECK(error < 1e-10 * largest);
    // The floor bears its part, and the plane of symmetry pushes aside; in equilibrium, as much as the floor shears.
    const auto floor = part.reactions->parts[0].impulse, plane = part.reactions->parts[1].impulse;
    CHECK(impulse(part)[1] * images == Approx(impulse(whole)[1]).epsilon(1e-9));
    CHECK(std::abs(whole.reactions->parts[0].impulse[0]) < 1e-9 * floor[1]);
    CHECK(std::abs(plane[1]) < 1e-6 * floor[1]);  // in the edge of both, walls act one after the other
    CHECK(std::abs(plane[0]) > 1e-3 * floor[1]);
    if (!has_inertia) {
        CHECK(plane[0] == Approx(-floor[0]).epsilon(1e-8));
        CHECK(impulse(part)[1] == Approx(g * part.totals().mass).epsilon(1e-9));
    }
}

TEMPLATE_TEST_CASE("Half of a block beside a plane of symmetry moves as half of the whole one", "[implicit]",
                   QuadraticBSpline, CubicBSpline) {
    SECTION("in equilibrium") {
        auto half = on_floor<2>(1, QuasiStatic{}, TestType{}), whole = on_floor<2>(0, QuasiStatic{}, TestType{});
        check_symmetry(half, whole, 2, 1, 2);
    }
    SECTION("with inertia") {
        auto half = on_floor<2>(1, Implicit{}, Apic{}, TestType{}),
             whole = on_floor<2>(0, Implicit{}, Apic{}, TestType{});
        half.fixed_time_step = whole.fixed_time_step = 0.01;
        check_symmetry(half, whole, 5, 0.01, 2);
    }
}
TEST_CASE("So it does with averages of volumes", "[implicit]") {
    auto half = on_floor<2>(1, QuasiStatic{}, FBar{}), whole = on_floor<2>(0, QuasiStatic{}, FBar{});
    check_symmetry(half, whole, 2, 1, 2);
}
TEST_CASE("So it does by steps of two stages, of FLIP", "[implicit]") {
    auto half = on_floor<2>(1, TrBdf2{}, Flip<double>{1}), whole = on_floor<2>(0, TrBdf2{}, Flip<double>{1});
    half.fixed_time_step = whole.fixed_time_step = 0.01;
    check_symmetry(half, whole, 5, 0.01, 2);
}
TEST_CASE("A quarter of a block in an edge of planes of symmetry moves as a quarter of the whole one", "[implicit]") {
    auto quarter = on_floor<3>(2, QuasiStatic{}), whole = on_floor<3>(0, QuasiStatic{});
    check_symmetry(quarter, whole, 1, 1, 4);
}

/// A footing presses the ground down, half of it beside a plane of symmetry or all of it: a collider with friction,
/// from which matter may separate.
template <class Shape>
auto under_footing(const Shape& shape, double height, bool is_half) {
    const double h = 0.05;
    const Domain<2> domain({-0.8, -0.4}, {0.8, 0.6}, h);
    auto walls = Walls<double, 2>::all({is_half ? 0.0 : -0.4, 0}, {0.4, 0.6}, {Contact::slip, 0});
    walls.at_lower[1].contact = Contact::stick;
    walls.at_upper[1].contact = Contact::none;
    walls.nodes_behind = NodesBehind::mirrored;
    const Collider<Shape> footing{
        .shape = shape, .contact = Contact::separate, .friction = 0.3, .position = {0, height}};
    Simulation simulation(domain, NeoHookean<double>::from_young_poisson(1e5, 0.3), Together(walls, footing),
                          QuasiStatic{});
    simulation.warn = {};
    simulation.add(sample_box<2>({is_half ? 0.0 : -0.4, 0}, {0.4, 0.3}, {.spacing = h / 2}), density);
    std::get<1>(simulation.boundary.parts).linear_velocity = {0, -0.02};
    simulation.reactions.emplace();
    simulation.integration.newton.tolerance = 1e-9;
    simulation.advance(1);
    CHECK(simulation.solution.has_settled);
    CHECK(simulation.solution.halvings == 0);
    CHECK(impulse(simulation)[1] == Approx(g * simulation.totals().mass).epsilon(1e-7));
    CHECK(std::abs(impulse(simulation)[0]) < 1e-7 * impulse(simulation)[1]);
    const auto& parts = simulation.reactions->parts;
    CHECK(parts[1].impulse[1] < -10);
    return std::array{parts[0].impulse[1], parts[1].impulse[1]};
}
TEST_CASE("A collider acts beside a plane of symmetry as on both sides of it", "[implicit]") {
    const Box<double, 2> box{{0.13, 0.1}};
    const auto half = under_footing(box, 0.4, true), whole = under_footing(box, 0.4, false);
    for (std::size_t k = 0; k < 2; ++k) CHECK(2 * half[k] == Approx(whole[k]).epsilon(1e-7));
    // A round collider takes its normals one cell away from other solids, so this one is no plane of symmetry to it: on
    // the plane, it and the wall act in turn.
    const Sphere<double, 2> sphere{0.15};
    const auto beside = under_footing(sphere, 0.44, true), round = under_footing(sphere, 0.44, false);
    for (std::size_t k = 0; k < 2; ++k) CHECK(2 * beside[k] == Approx(round[k]).epsilon(0.03));
}

constexpr double young = 1e10;
/// A column of 4 cells between smooth walls, 1 m high.
template <class... Policies>
auto column(double h, NodesBehind behind, Contact floor, const Policies&... policies) {
    const Domain<2> domain({-4 * h, -4 * h}, {8 * h, 1 + 8 * h}, h);
    auto walls = Walls<double, 2>::all({0, 0}, {4 * h, domain.upper[1]}, {Contact::slip, 0});
    walls.at_lower[1].contact = floor;
    walls.at_upper[1].contact = Contact::none;
    walls.nodes_behind = behind;
    Simulation simulation(domain, Hencky<double>::from_young_poisson(young, 0), walls, policies...);
    simulation.warn = {};
    simulation.add(sample_box<2>({0, 0}, {4 * h, 1}, {.spacing = h / 2}), density);
    simulation.reactions.emplace();
    return simulation;
}

TEST_CASE("A column settles by ρ g H²/(2E) on a mirrored floor, to second order", "[implicit]") {
    // ρ g (H y − y²/2)/E at height y; of strains of 1e-6, a part as small again is not seen.
    const auto error = [](double h, NodesBehind behind, Contact floor) {
        auto simulation = column(h, behind, floor, QuasiStatic{});
        simulation.integration.newton.tolerance = 1e-11;
        const auto begin = positions(simulation);
        simulation.advance(1);
        const auto end = positions(simulation);
        double squared = 0, aside = 0;
        for (std::size_t i = 0; i < begin.size(); ++i) {
            const double y = begin[i][1], expected = -density * g * (y - y * y / 2) / young;
            squared += std::pow((end[i][1] - begin[i][1] - expected) / (density * g / 2 / young), 2);
            aside = std::max(aside, std::abs(end[i][0] - begin[i][0]));
        }
        CHECK(aside < 1e-9 / young * 1e9);
        CHECK(impulse(simulation)[1] == Approx(g * simulation.totals().mass).epsilon(1e-8));
        CHECK(std::abs(impulse(simulation)[0]) < 1e-8 * impulse(simulation)[1]);
        return std::sqrt(squared / double(begin.size()));
    };
    for (const Contact floor : {Contact::slip, Contact::stick}) {
        const double coarse = error(0.1, NodesBehind::mirrored, floor),
                     fine = error(0.05, NodesBehind::mirrored, floor);
        CAPTURE(coarse, fine, error(0.1, NodesBehind::held, floor), error(0.05, NodesBehind::held, floor));
        CHECK(coarse < 0.01);
        CHECK(fine < 0.3 * coarse);
        CHECK(fine > 0.1 * coarse);
        CHECK(error(0.05, NodesBehind::held, floor) > 5 * fine);
    }
}

/// A block in a corner of mirrored walls, strained and in motion.
template <class Time, class... Policies>
auto in_corner(double friction_of_lower, const Policies&... policies) {
    const double h = 0.05;
    const Domain<2> domain({-0.4, -0.4}, {0.8, 0.8}, h);
    auto walls = mirrored_at_0<2>(domain, {0, 1}, Contact::slip);
    walls.at_lower[1] = {Contact::stick, friction_of_lower};
    Simulation simulation(domain, NeoHookean<double>::from_young_poisson(1e5, 0.3), walls, Time{}, policies...);
    simulation.warn = {};
    simulation.add(sample_box<2>({0, 0}, {0.3, 0.2}, {.spacing = h / 2}), density, {-0.5, -1});
    auto& particles = simulation.edit_particles();
    for_particles(simulation, [&](std::size_t slot) {
        const Vec<double, 2> x = particles.exact_position(slot);
        auto state = particles.state(slot);
        state.F = DeformationGradient<double, 2>::from_displacement(
            Mat<double, 2>{{0.02 * std::cos(9 * x[0]), 0.01 * x[1], 0.01, -0.02 * std::cos(8 * x[1])}});
        particles.set_state(slot, state);
    });
    simulation.reactions.emplace();
    if constexpr (!Time::is_explicit) {
        simulation.integration.newton.tolerance = 1e-12;
        simulation.integration.small_nodes.threshold = 0;
    }
    return simulation;
}

TEMPLATE_TEST_CASE("In a short step implicit velocities and reactions are the explicit ones, to second order",
                   "[implicit]", Apic, Flip<double>) {
    // Returns the differences of velocities and of the walls' impulse, as parts of these.
    const auto difference = [](double dt) {
        auto solved = in_corner<Implicit>(0, TestType{});
        auto plain = in_corner<Explicit>(0, TestType{});
        solved.fixed_time_step = plain.fixed_time_step = dt;
        solved.step();
        plain.step();
        double squared = 0, size = 0;
        for_particles(plain, [&](std::size_t slot) {
            const auto v = plain.particles().velocity(slot);
            REQUIRE(solved.particles().id(slot) == plain.particles().id(slot));
            const auto error = solved.particles().velocity(slot) - v;
            squared += dot(error, error), size += dot(v, v);
        });
        return std::array{std::sqrt(squared / size), norm(impulse(solved) - impulse(plain)) / norm(impulse(plain))};
    };
    const auto coarse = difference(2e-4), fine = difference(1e-4);
    for (std::size_t k = 0; k < 2; ++k) {
        CAPTURE(k, coarse[k], fine[k]);
        CHECK(coarse[k] < 0.05);
        CHECK(coarse[k] / fine[k] == Approx(4).epsilon(0.1));
    }
}

TEST_CASE("Beside mirrored walls, steps have the same bits for any number of threads", "[implicit]") {
    std::vector<Vec<double, 2>> expected;
    Vec<double, 2> exerted{};
    for (const int threads : {1, 2, 3}) {
        auto simulation = in_corner<Implicit>(0, Coloured{threads});
        simulation.integration.small_nodes.threshold = 0.1;
        simulation.fixed_time_step = 0.01;
        simulation.advance(0.02);
        if (threads == 1) expected = positions(simulation), exerted = impulse(simulation);
        CHECK(positions(simulation) == expected);
        CHECK(impulse(simulation) == exerted);
    }
}

TEST_CASE("A mirrored floor bears a layer without ends, along a periodic axis", "[implicit]") {
    const double h = 0.05;
    Domain<2> domain({0, -8 * h}, {16 * h, 16 * h}, h);
    domain.periodic = {true, false};
    Simulation simulation(domain, Hencky<double>::from_young_poisson(1e6, 0.3),
                          mirrored_at_0<2>(domain, {1}, Contact::stick), QuasiStatic{});
    simulation.warn = {};
    simulation.add(sample_box<2>({0, 0}, {16 * h, 0.3}, {.spacing = h / 2}), density);
    simulation.reactions.emplace();
    simulation.integration.newton.tolerance = 1e-11;
    const auto begin = positions(simulation);
    simulation.advance(1);
    CHECK(impulse(simulation)[1] == Approx(g * simulation.totals().mass).epsilon(1e-9));
    const double modulus = 1e6 * 0.7 / (1.3 * 0.4);
    const auto end = positions(simulation);
    double worst = 0, aside = 0;
    for (std::size_t i = 0; i < begin.size(); ++i) {
        const double y = begin[i][1], expected = -density * g * (0.3 * y - y * y / 2) / modulus;
        worst = std::max(worst, std::abs(end[i][1] - begin[i][1] - expected));
        aside = std::max(aside, std::abs(end[i][0] - begin[i][0]));
    }
    CHECK(worst < 0.02 * density * g * 0.045 / modulus);
    CHECK(aside < 1e-9 * worst);
}

TEST_CASE("Mirrored walls with friction, or which matter may leave, are refused before anything changes",
          "[implicit]") {
    auto simulation = in_corner<Implicit>(0.3);  // friction has no meaning where matter sticks
    simulation.fixed_time_step = 1e-3;
    CHECK_NOTHROW(simulation.step());
    const auto before = positions(simulation);
    for (const Wall& wall : {Wall{Contact::slip, 0.3}, Wall{Contact::separate, 0}}) {
        simulation.boundary.at_lower[1] = wall;
        test_support::check_refused<parameter_error>([&] { simulation.step(); },
                                                     "The mirrored wall at 0 m along axis 1");
        CHECK(positions(simulation) == before);
        CHECK(simulation.steps() == 1);
    }
    simulation.boundary.at_lower[1] = {Contact::none, 0};
    CHECK_NOTHROW(simulation.step());
}

}  // namespace implicit_mirrored_tests
