/// \file The law at the nodes beside mirrored walls, and what is refused.
#include "support/catch.hpp"
#include <firn/firn.hpp>

#include <random>

using namespace firn;

namespace {

using Column = NodeColumn<double, 2>;

double energy(const Column& c, double behind, double on, double front) {
    return 0.5 * (behind * dot(c.behind, c.behind) + on * dot(c.on, c.on) + front * dot(c.front, c.front));
}

/// The impulse of the wall on the matter of a column, which had the given masses before the wall acted.
Vec<double, 2> impulse(const Column& before, const Column& after) {
    return (after.behind - before.behind) * before.mass_behind + (after.on - before.on) * before.mass_on +
           (after.front - before.front) * before.mass_front;
}

constexpr SurfaceWeights<double> quadratic{0.75, 0.25};

}  // namespace

TEST_CASE("A point on a node has the weights of the kernel's paper", "[mirror]") {
    const auto check = [](const SurfaceWeights<double>& weights, double on) {
        CHECK(weights.on == Approx(on));
        CHECK(weights.beside == Approx(1 - on).margin(1e-15));
    };
    check(surface_weights<Linear, double>(), 1);
    check(surface_weights<QuadraticBSpline, double>(), 0.75);
    check(surface_weights<CubicBSpline, double>(), 2. / 3);
}

TEST_CASE("Nodes before and behind a wall are mirror images after it has acted", "[mirror]") {
    // masses 1, 2, 3 behind, on and in front; axis 0 is across the wall
    const Column column{{1, 5}, {-2, 7}, {-4, 1}, 1, 2, 3};
    const Column slip = mirrored(column, 0, 1, Contact::slip, 0., quadratic);
    CHECK(slip.front[0] == Approx((3 * -4. - 1 * 1.) / 4));  // odd across the wall
    CHECK(slip.behind[0] == Approx(13. / 4));
    CHECK(slip.on[0] == 0);
    CHECK(slip.front[1] == Approx((3 * 1. + 1 * 5.) / 4));  // even along it
    CHECK(slip.behind[1] == Approx(2.));
    CHECK(slip.on[1] == Approx(7.));
    CHECK(impulse(column, slip)[1] == Approx(0).margin(1e-12));

    const Column stick = mirrored(column, 0, 1, Contact::stick, 0., quadratic);
    CHECK(stick.front[1] == Approx((3 * 1. - 1 * 5.) / 4));
    CHECK(stick.behind[1] == Approx(0.5));
    CHECK(stick.on[1] == 0);

    Column leaves = column;  // all of it moves away from a wall at the lower end: a wall that does not hold it
    leaves.behind[0] = 1, leaves.on[0] = 2, leaves.front[0] = 3;
    const Column left = mirrored(leaves, 0, 1, Contact::separate, 0.5, quadratic);
    CHECK(left.front[0] == 3);
    CHECK(left.on[0] == 2);
    CHECK(left.mass_front == 3);
    CHECK(mirrored(leaves, 0, -1, Contact::separate, 0.5, quadratic).on[0] == 0);  // into a wall at the upper end
}

TEST_CASE("A mirrored wall takes no more friction than μ times its impulse, and never adds energy", "[mirror]") {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> velocity(-1, 1), mass(0, 1);
    for (int i = 0; i < 100000; ++i) {
        const auto some = [&] { return Vec<double, 2>{velocity(random), velocity(random)}; };
        const auto heavy = [&] { return i % 3 == 0 ? 0.0 : std::pow(10, -6 * mass(random)); };
        const Column column{some(), some(), some(), heavy(), heavy(), heavy()};
        const double friction = mass(random);
        for (const Contact contact : {Contact::stick, Contact::slip, Contact::separate}) {
            const Column after = mirrored(column, 0, 1, contact, friction, quadratic);
            const double before = energy(column, column.mass_behind, column.mass_on, column.mass_front);
            const double now = energy(after, column.mass_behind, column.mass_on, column.mass_front);
            const Vec<double, 2> given = impulse(column, after);
            const double least = contact == Contact::separate ? -1e-12 : -1e9;
            if (now > before * (1 + 1e-12) + 1e-15 || given[0] < least ||
                (contact != Contact::stick && std::abs(given[1]) > friction * std::max(given[0], 0.) + 1e-12)) {
                CAPTURE(i, int(contact), before, now, given[0], given[1], friction);
                FAIL();
            }
        }
    }
}

TEST_CASE("Mirrored walls off the planes of nodes, or too near each other, are refused", "[mirror]") {
    Domain<2> domain{{0, 0}, {1, 1}, 1. / 16};
    auto walls = Walls<float, 2>::all({0, 0}, {1, 1}, {Contact::slip, 0});
    CHECK(mirrors_of<QuadraticBSpline>(walls, domain).planes.empty());
    walls.nodes_behind = NodesBehind::mirrored;
    walls.at_upper[1].contact = Contact::none;
    const Mirrors mirrors = mirrors_of<QuadraticBSpline>(Together(Collider<Sphere<float, 2>>{}, walls), domain);
    REQUIRE(mirrors.planes.size() == 3);
    CHECK(mirrors.planes[1].node == 16);
    CHECK(mirrors.planes[1].inward == -1);
    CHECK(mirrors.planes[1].part == 1);

    walls.upper = {0.97F, 1};
    CHECK_THROWS_AS(mirrors_of<QuadraticBSpline>(walls, domain), parameter_error);
    Simulation simulation(domain, FixedCorotated<float>{}, walls);
    simulation.warn = nullptr;
    simulation.add(sample_box<2>({0.2, 0.2}, {0.4, 0.4}, {.spacing = 1. / 32}), 1000);
    CHECK_THROWS_AS(simulation.step(), parameter_error);
    simulation.boundary.nodes_behind = NodesBehind::held;
    CHECK_NOTHROW(simulation.step());  // nothing was lost

    walls.upper = {2. / 16, 1};
    CHECK_THROWS_AS(mirrors_of<QuadraticBSpline>(walls, domain), parameter_error);

    SparseGrid<float, 2> grid(domain);
    CHECK_THROWS_AS(grid_update(detail::Serial{}, grid, 0.1, Vec<float, 2>::zero(), walls), usage_error);
}
