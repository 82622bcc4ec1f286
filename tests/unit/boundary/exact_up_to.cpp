/// \file Shapes that cap their distances: who compares distances refuses them where the cap would decide.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/boundary/boundary_list.hpp>
#include <firn/firn.hpp>
#include <firn/lagrangian.hpp>

using namespace firn;
using test_support::check_refused;
using test_support::holds;
using test_support::message;

namespace exact_up_to_tests {

namespace {

/// A ball whose distances end at `cap`. It says so if Says.
template <scalar S, int D, bool Says>
struct CappedBall {
    S radius = S(0.1), cap = S(0.05);
    using scalar_type = S;
    static constexpr int dimension = D;
    template <class T>
    using with_scalar = CappedBall<T, D, Says>;
    template <class T>
    with_scalar<T> lifted() const {
        return {T(radius), T(cap)};
    }
    static constexpr const char* name = "capped_ball";
    static constexpr auto parameters() { return std::tuple{parameter{"radius", "m", &CappedBall::radius}}; }
    FIRN_INLINE S signed_distance(const Vec<S, D>& x) const { return max(min(norm(x) - radius, cap), -cap); }
    double exact_up_to() const
        requires Says
    {
        return double(cap);
    }
};
template <scalar S, int D>
using Capped = CappedBall<S, D, true>;

constexpr double h = 1.0 / 32;

}  // namespace

TEST_CASE("a collider is refused on a grid for which its shape does not know enough; it says what would do",
          "[boundary][shape]") {
    using Ball = Collider<Capped<double, 2>>;
    Ball ball{.shape = {.cap = 3.5 * h}};
    CHECK_NOTHROW(ball.on_grid(h).check());  // the layer of 1.5 cells, and two cells
    ball.shape.cap = 3.4 * h;
    CHECK_NOTHROW(ball.check());  // on no grid
    check_refused<parameter_error>([&] { ball.on_grid(h); }, sentence("up to ", 3.4 * h, " m only"));
    check_refused<parameter_error>([&] { ball.on_grid(h); }, sentence("needs them up to ", 3.5 * h, " m"));
    ball.thickness_in_cells = 0.5;
    CHECK_NOTHROW(ball.on_grid(h));
    ball.thickness = h;
    CHECK_THROWS_AS(ball.on_grid(h), parameter_error);
    ball.cell_size = h;
    CHECK_THROWS_AS(ball.check(), parameter_error);
    ball = {.shape = {.cap = 0.05}};
    CHECK_THROWS_AS(Together(ball).on_grid(h), parameter_error);
    CHECK_THROWS_AS(BoundaryList<Ball>{{ball}}.on_grid(h), parameter_error);
    CHECK_THROWS_AS(GapContact{ball}.on_grid(h), parameter_error);
    CHECK_THROWS_AS((Collider<Complement<Capped<double, 2>>>{.shape = {ball.shape}}.on_grid(h)), parameter_error);

    // In a simulation, before a particle has moved.
    const Domain<2> domain{{0, 0}, {1, 1}, h};
    Simulation simulation(domain, FixedCorotated<double>{}, ball);
    simulation.add(sample_box<2>({0.6, 0.6}, {0.8, 0.8}, {.spacing = h / 2}), 1000);
    check_refused<parameter_error>([&] { simulation.step(); }, sentence("Store distances up to ", 3.5 * h, " m"));
    CHECK(simulation.steps() == 0);
    simulation.boundary.shape.cap = 0.2;
    CHECK_NOTHROW(simulation.step());
}

TEST_CASE("the cap of a boundary is the least of its parts, counted from the layer", "[boundary][shape]") {
    const auto ball = [](double cap) {
        return Collider<Capped<double, 2>>{.shape = {.cap = cap}, .thickness = 0.01, .thickness_in_cells = 0};
    };
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const auto walls = Walls<double, 2>::all({0, 0}, {1, 1}, {});
    CHECK(exact_up_to(walls) == infinity);
    CHECK(exact_up_to(Collider<Sphere<double, 2>>{}) == infinity);
    CHECK(exact_up_to(ball(0.2)) == Approx(0.19));
    CHECK(exact_up_to(Together(walls, ball(0.2), ball(0.1))) == Approx(0.09));
    CHECK(exact_up_to(BoundaryList<Collider<Capped<double, 2>>>{{ball(0.3), ball(0.2)}}) == Approx(0.19));
    CHECK(exact_up_to(BoundaryList<Collider<Capped<double, 2>>>{}) == infinity);
    CHECK(exact_up_to(GapContact{Together(walls, ball(0.2))}) == Approx(0.19));
}

#ifndef FIRN_TEST_QUICK
TEST_CASE("what is known is enough: nodes are free or held as if nothing were capped", "[boundary][shape]") {
    // Beside another solid, contact looks at points up to two cells outside of it.
    const auto compare = [](const auto& capped, const auto& exact) {
        const Collider<Box<double, 2>> floor{.shape = {{0.4, 0.1}}, .friction = 0.2, .position = {0, -0.15}};
        const auto a = Together(capped, floor).on_grid(h), b = Together(exact, floor).on_grid(h);
        const Vec<double, 2> v{0.5, -1};
        int touched = 0;
        for (int i = -20; i <= 20; ++i)
            for (int j = -20; j <= 20; ++j) {
                const Vec<double, 2> x{i * h / 2, j * h / 2};
                REQUIRE(a.velocity(x, v) == b.velocity(x, v));
                const auto nearest = [&](const Vec<double, 2>& n) { return -dot(n, x) - 0.4 * h; };
                const ActByGap<2, decltype(nearest)> act{h, 1e-3, nearest};
                REQUIRE(velocity_by_gap<std::decay_t<decltype(a)>, 2>(a, x, v, act, AnySurface{}) ==
                        velocity_by_gap<std::decay_t<decltype(b)>, 2>(b, x, v, act, AnySurface{}));
                touched += !(a.velocity(x, v) == v);
            }
        CHECK(touched > 100);
    };
    compare(Collider<Capped<double, 2>>{.shape = {.cap = 3.5 * h}}, Collider<Capped<double, 2>>{.shape = {.cap = 10}});

    // A node in the ball and in a box, 1.6 cells from its face: contact looks 3.6 cells farther, where the cap of two
    // cells is no gap.
    const Collider<Box<double, 2>> box{.shape = {{4.5 * h, 1}}};
    const auto after = [&](double cap) {
        const Together both(Collider<Capped<double, 2>>{.shape = {.cap = cap}, .thickness_in_cells = 0}, box);
        const auto nearest = [](const Vec<double, 2>&) { return -2.2 * h; };
        Vec<double, 2> by_ball{-1, -1};  // a surface that does not act is not told
        velocity_by_gap<std::decay_t<decltype(both)>, 2>(both.on_grid(h), {2.9 * h, 0.0}, {-1, -1},
                                                         ActByGap<2, decltype(nearest)>{h, 1e-3, nearest},
                                                         [&](int part, const auto&, const auto& now) {
                                                             if (part == 0) by_ball = now;
                                                         });
        return by_ball;
    };
    // Without the gap, the normal at the node is taken there: the gradient of a cap is zero.
    const auto in_corner = [&](double cap) {
        const Together both(Collider<Capped<double, 2>>{.shape = {.cap = cap}, .thickness_in_cells = 0}, box);
        Vec<double, 2> by_ball{};
        velocity_among(both.on_grid(h), Vec<double, 2>{2.9 * h, 0.0}, Vec<double, 2>{-1, -1}, NoOthers{},
                       [&](int part, const auto&, const auto& now) {
                           if (part == 0) by_ball = now;
                       });
        return by_ball;
    };
    CHECK(in_corner(10) == Vec<double, 2>{0, -1});
    CHECK(in_corner(2 * h) == Vec<double, 2>{0, -1});
    CHECK(after(10) == Vec<double, 2>{-1, -1});
    CHECK(after(2 * h) == Vec<double, 2>{-1, -1});
}

TEST_CASE("points with a radius beyond the cap are refused; they would touch what is far away", "[lagrangian]") {
    ParticleSystem system(Collider<Capped<float, 3>>{.shape = {.cap = 0.06F}});
    system.collisions.emplace();
    const auto add = [&](double radius) {
        system.points.add({.position = {0.55, 0.55, 0.55}, .mass = 1, .radius = radius});
    };
    CHECK_NOTHROW(system.advance(0.01, 1e-3));  // no points
    add(0.05);
    CHECK_NOTHROW(system.advance(0.01, 1e-3));
    add(0.1);
    check_refused<parameter_error>([&] { system.advance(0.01, 1e-3); }, "A point has a radius of 0.1");
    check_refused<parameter_error>([&] { meet_surfaces(system.points, system.boundary); },
                                   sentence("knows distances up to ", double(0.06F), " m only"));
}

TEST_CASE("a cap that a shape does not tell is warned of, where contact compares distances with it", "[simulation]") {
    const auto warnings = [](const auto& boundary) {
        constexpr int D = 2;
        Simulation simulation(Domain<D>{{0, 0}, {1, 1}, h}, FixedCorotated<float>{}, boundary);
        std::vector<std::string> said;
        simulation.warn = [&](const std::string& text) { said.push_back(text); };
        simulation.add(sample_box<D>({0.7, 0.7}, {0.8, 0.8}, {.spacing = h / 2}), 1000);
        for (int i = 0; i < 3; ++i) simulation.step();
        std::erase_if(said, [](const std::string& text) { return !holds(text, "caps its distances"); });
        return said;
    };
    Collider<CappedBall<float, 2, false>> ball{.shape = {.cap = 0.05F}, .position = {0.3, 0.3}};
    const Collider<Sphere<float, 2>> whole{.position = {0.3, 0.3}};
    CHECK(warnings(whole).empty());
    for (const auto& said : {warnings(ball), warnings(GapContact{Together(whole, ball)})}) {
        REQUIRE(said.size() == 1);
        CHECK(holds(said[0], "a collider_capped_ball at (0.3, 0.3) m caps its distances at 0.05"));
        CHECK(holds(said[0], sentence("compares them up to ", 3.5 * h, " m")));
    }
    ball.shape.cap = float(0.3 * h);
    CHECK(warnings(ball).size() == 1);
    ball.shape.cap = float(3.6 * h);
    CHECK(warnings(ball).empty());
    ball = {.shape = {.cap = 0.05F}, .contact = Contact::none, .position = {0.3, 0.3}};
    CHECK(warnings(ball).empty());
    // Numbers, too.
    const auto grid = [](double cap, double declared) {
        DistanceNumbers<float, 2> numbers{{-0.2, -0.2}, 0.01, {41, 41}, {}};
        for (int i = 0; i < 41; ++i)
            for (int j = 0; j < 41; ++j)
                numbers.values.push_back(float(std::min(std::hypot(-0.2 + 0.01 * i, -0.2 + 0.01 * j) - 0.1, cap)));
        numbers.exact_up_to = declared;
        Collider<DistanceGrid<float, 2>> solid{.position = {0.3, 0.3}};
        solid.shape.numbers = std::make_shared<const DistanceNumbers<float, 2>>(numbers);
        return solid;
    };
    constexpr double undeclared = std::numeric_limits<double>::infinity();
    CHECK(warnings(grid(0.06, undeclared)).size() == 1);
    CHECK(warnings(grid(0.12, undeclared)).empty());
    CHECK(warnings(grid(1, undeclared)).empty());
    CHECK(warnings(grid(0.12, 0.12)).empty());
    CHECK_THROWS_AS(warnings(grid(0.06, 0.06)), parameter_error);
}
#endif

}  // namespace exact_up_to_tests
