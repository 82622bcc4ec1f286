// quick: -O1
// part: arithmetic
// sanitized: -O1
/// \file Signed distances from a mesh on a grid, and the collider that interpolates them: against every triangle in
/// turn, against the ball and the box that meshes stand for.
#include "support/catch.hpp"
#include "support/not_finite.hpp"
#include "support/random_numbers.hpp"
#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/core/strict.hpp>
#include <firn/data/mesh_distance.hpp>

#include "meshes.hpp"

using namespace firn;
using test_support::Random;

namespace {

/// The distance from a point to a triangle, by search over its barycentric coordinates: the distance is convex in them.
double by_search(const Vec<double, 3>& x, const detail::Corners& t) {
    const auto nearest = [](const auto& f) {
        double low = 0, high = 1;
        for (int i = 0; i < 60; ++i) {
            const double a = low + (high - low) / 3, b = high - (high - low) / 3;
            (f(a) < f(b) ? high : low) = f(a) < f(b) ? b : a;
        }
        return f((low + high) / 2);
    };
    return nearest([&](double u) {
        return nearest([&](double v) {
            const auto p = t[0] + (t[1] - t[0]) * u + (t[2] - t[0]) * (1 - u) * v;
            return norm(x - p);
        });
    });
}

/// ∞-norm over random points of the interpolant's error, where `exact` knows the distance.
template <class Shape, class Exact>
double largest_error(const Shape& shape, const Exact& exact) {
    Random random(62);
    double worst = 0;
    for (int i = 0; i < 4000; ++i) {
        const auto x = random.direction<3>() * random.uniform(0.2, 0.4);
        worst = std::max(worst, std::abs(shape.signed_distance(x) - exact(x)));
    }
    return worst;
}

}  // namespace

TEST_CASE("the distance to a triangle is the least over its points", "[data][mesh_distance]") {
    Random random(60);
    for (int trial = 0; trial < 200; ++trial) {
        detail::Corners t{random.vector<3>(-1, 1), random.vector<3>(-1, 1), random.vector<3>(-1, 1)};
        if (trial % 10 == 0) t[2] = t[0] + (t[1] - t[0]) * random.uniform(-1, 2);  // no area
        const auto x = random.vector<3>(-2, 2);
        CAPTURE(trial);
        CHECK(std::sqrt(detail::squared_distance_to_triangle(x, t)) == Approx(by_search(x, t)).epsilon(1e-7));
    }
}

TEST_CASE("the tree finds the distance of the nearest triangle", "[data][mesh_distance]") {
    const auto mesh = test_meshes::joined(test_meshes::sphere({0.2, 0.1, 0}, 0.3, 2), test_meshes::unit_cube());
    const firn::detail::NearestTriangle nearest(mesh);
    Random random(61);
    for (int trial = 0; trial < 500; ++trial) {
        const auto x = random.vector<3>(-1, 2);
        double least = 1e300;
        for (const auto& [i, j, k] : mesh.triangles)
            least = std::min(least, detail::squared_distance_to_triangle(
                                        x, {mesh.vertices[std::size_t(i)], mesh.vertices[std::size_t(j)],
                                            mesh.vertices[std::size_t(k)]}));
        CHECK(nearest.distance(x) == Approx(std::sqrt(least)).epsilon(1e-14));  // rounding of the tree's boxes
        CHECK(nearest.distance(x, 0.1) == Approx(std::min(std::sqrt(least), 0.1)).epsilon(1e-14));
        // Several points at once: near each other, as neighbouring nodes, and far apart.
        using P = native_pack<double>;
        const double apart = trial % 2 == 0 ? 0.01 : 1;
        Vec<double, 3> points[scalar_traits<P>::lanes];
        Vec<P, 3> in_lanes{};
        for (auto& point : points) point = x + random.vector<3>(-apart, apart);
        for (int a = 0; a < 3; ++a) in_lanes[a] = from_lanes<P>([&](int lane) { return points[lane][a]; });
        const P distances = nearest.distances(in_lanes);
        for (int lane = 0; lane < scalar_traits<P>::lanes; ++lane)
            CHECK(distances[lane] == Approx(nearest.distance(points[lane])).epsilon(1e-14));
    }
}

TEST_CASE("nodes have the distance of the mesh, with its sign, also beyond the band", "[data][mesh_distance]") {
    const auto mesh = test_meshes::box({-0.2, -0.3, -0.1}, {0.2, 0.3, 0.1});
    const auto numbers = mesh_distance<double>(mesh, {.spacing = 0.03, .band = 0.1});
    const Box<double, 3> box{{0.2, 0.3, 0.1}};
    std::size_t at = 0, inside = 0, beyond = 0;
    for (int i = 0; i < numbers->nodes[0]; ++i)
        for (int j = 0; j < numbers->nodes[1]; ++j)
            for (int k = 0; k < numbers->nodes[2]; ++k, ++at) {
                const auto x = numbers->lower + Vec<double, 3>{double(i), double(j), double(k)} * numbers->spacing;
                const double distance = box.signed_distance(x);
                REQUIRE(std::abs(numbers->values[at] - distance) <= 1e-12);
                inside += distance < 0;
                beyond += distance > 0.11;
                const bool at_end = i == 0 || j == 0 || k == 0 || i + 1 == numbers->nodes[0] ||
                                    j + 1 == numbers->nodes[1] || k + 1 == numbers->nodes[2];
                if (at_end) REQUIRE(numbers->values[at] >= 0.1 * (1 - 1e-12));
            }
    CHECK(at == numbers->values.size());
    CHECK(inside > 500);
    CHECK(beyond > 500);
    CHECK(numbers->exact_up_to == std::numeric_limits<double>::infinity());
    // A mesh turned inside out is the same solid.
    const auto turned = mesh_distance<double>(reversed(mesh), {.spacing = 0.03, .band = 0.1});
    REQUIRE(turned->values.size() == numbers->values.size());
    double difference = 0;
    for (std::size_t i = 0; i < numbers->values.size(); ++i)
        difference = std::max(difference, std::abs(turned->values[i] - numbers->values[i]));
    CHECK(difference <= 1e-15);
}

TEST_CASE("the interpolant's error falls with the square of the spacing", "[data][mesh_distance]") {
    // Of a ball with 20480 faces, 0.3 m: flat faces lie up to 6e-5 m within it.
    const auto mesh = test_meshes::sphere({0, 0, 0}, 0.3, 5);
    const Sphere<double, 3> ball{0.3};
    double error[3];
    int i = 0;
    for (const double spacing : {0.08, 0.04, 0.02}) {
        const DistanceGrid<double, 3, double> shape{mesh_distance<double>(mesh, {.spacing = spacing, .band = 0.16})};
        error[i++] = largest_error(shape, [&](const auto& x) { return ball.signed_distance(x); });
        Random random(63);
        for (int trial = 0; trial < 500; ++trial) {
            const auto x = random.direction<3>() * random.uniform(0.2, 0.4);
            CHECK(std::abs(norm(shape.normal(x)) - 1) <= 1e-14);
            CHECK(norm(shape.normal(x) - ball.normal(x)) <= 8 * spacing);
        }
    }
    CAPTURE(error[0], error[1], error[2]);
    // The second derivatives of the distance are 1/r along two axes, and r ≥ 0.12 in the cells looked at.
    CHECK(error[0] <= 0.08 * 0.08 / 8 * 2 / 0.12);
    CHECK(error[0] / error[1] > 3.2);
    CHECK(error[1] / error[2] > 3.2);
}

TEMPLATE_TEST_CASE("outside of its box, a grid's distance goes on; its normal points away", "[data][mesh_distance]",
                   float, double) {
    using S = TestType;
    const DistanceGrid<S, 3> shape{
        mesh_distance(test_meshes::box({-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1}), {.spacing = 0.05, .band = 0.1})};
    const double beyond = shape.signed_distance({S(0.9), S(0), S(0)});
    CHECK(beyond == Approx(0.8).epsilon(1e-5));
    CHECK(shape.normal({S(0.9), S(0), S(0)})[0] == Approx(1));
    CHECK(shape.signed_distance({S(-3), S(-3), S(0)}) == Approx(std::sqrt(2.0) * 2.9).epsilon(0.01));  // to an edge
    CHECK(norm(shape.normal({S(-3), S(-3), S(0)}) + Vec<S, 3>{1, 1, 0} * S(std::sqrt(0.5))) <= 1e-4);
    // What is no number gives no memory that is not the grid's.
    CHECK_FALSE(shape.signed_distance({S(std::nan("")), S(0), S(0)}) <= 0);
}

/// An octahedron: the corners of its bounding box are far from its faces.
TriangleMesh octahedron(double r) {
    TriangleMesh mesh{{{r, 0, 0}, {-r, 0, 0}, {0, r, 0}, {0, -r, 0}, {0, 0, r}, {0, 0, -r}}, {}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    return mesh;
}

TEST_CASE("outside of its box, a grid's distance is nearly that of the mesh, and its normal, too",
          "[data][mesh_distance]") {
    // The docstring of DistanceGrid has these figures: mean errors of 0.2 % and 3°, 1 % and 6°.
    const double spacing = 0.01;
    const Mat<double, 3> turn = rotation({1, 2, 3}, 0.7);
    for (const TriangleMesh& mesh : {octahedron(0.3), rotated(octahedron(0.3), turn),
                                     rotated(test_meshes::box({-0.3, -0.2, -0.25}, {0.3, 0.2, 0.25}), turn)}) {
        const DistanceGrid<double, 3, double> shape{mesh_distance<double>(mesh, {.spacing = spacing})};
        const firn::detail::NearestTriangle exact(mesh);
        const auto& grid = *shape.numbers;
        Vec<double, 3> upper{};
        for (int a = 0; a < 3; ++a) upper[a] = grid.lower[a] + (grid.nodes[std::size_t(a)] - 1) * spacing;
        for (const double far : {3.0, 10.0}) {
            Random random(66);
            double worst = 0, mean = 0, mean_angle = 0;
            int count = 0;
            while (count < 2000) {
                Vec<double, 3> x{}, p{};
                for (int a = 0; a < 3; ++a) {
                    x[a] = random.uniform(grid.lower[a] - far * spacing, upper[a] + far * spacing);
                    p[a] = std::clamp(x[a], grid.lower[a], upper[a]);
                }
                if (x == p) continue;
                ++count;
                const double distance = shape.signed_distance(x), truth = exact.distance(x);
                const double beyond = norm(x - p), at_box = exact.distance(p);
                // Between the two bounds; interpolation may be off by half of uncertainty().
                REQUIRE(distance >= std::hypot(beyond, at_box) - 0.5 * shape.uncertainty());
                REQUIRE(distance <= beyond + at_box + 0.5 * shape.uncertainty());
                Vec<double, 3> normal{};
                for (int a = 0; a < 3; ++a) {
                    Vec<double, 3> step{};
                    step[a] = 1e-6;
                    normal[a] = (exact.distance(x + step) - exact.distance(x - step)) / 2e-6;
                }
                worst = std::max(worst, std::abs(distance / truth - 1));
                mean += std::abs(distance / truth - 1) / 2000;
                mean_angle += std::acos(std::min(dot(shape.normal(x), normal), 1.0)) / 2000;
            }
            CAPTURE(far, worst, mean, mean_angle * 57.3);
            CHECK(worst < (far == 3 ? 0.04 : 0.09));
            CHECK(mean < (far == 3 ? 0.0025 : 0.0145));
            CHECK(mean_angle * 57.3 < (far == 3 ? 3.5 : 8));
        }
    }
}

TEST_CASE("a node far from a mesh is free for any spacing, and another solid's normal does not know of the mesh",
          "[data][mesh_distance]") {
    // Nodes outside of the band stored its width: with a spacing of half a cell or less, the whole box was solid.
    const double h = 1.0 / 64;
    using Solid = Collider<DistanceGrid<float, 3>>;
    const Collider<Sphere<float, 3>> ball{.shape = {.05F}, .position = {.22, .22, .22}};
    for (const double cells : {2.0, 1.0, 0.5, 0.25}) {
        CAPTURE(cells);
        const Solid solid{.shape = {mesh_distance(octahedron(0.3), {.spacing = cells * h})}};
        const Solid here = solid.on_grid(h);
        const Vec<float, 3> v{0.3F, -1, 0.2F};
        Random random(67);
        int free = 0;
        for (int trial = 0; trial < 2000; ++trial) {
            const Vec<double, 3> x = random.vector<3>(-0.4, 0.4);
            const double distance = (std::abs(x[0]) + std::abs(x[1]) + std::abs(x[2]) - 0.3) / std::sqrt(3.0);
            // The interpolant is off by up to spacing²/8 × curvature, at edges by up to a spacing.
            if (distance < (1.5 + cells) * h) continue;
            REQUIRE(here.velocity(cast<float>(x), v) == v);
            ++free;
        }
        CHECK(free > 500);
        const Vec<float, 3> x{.22F + .055F, .22F, .22F}, into{-1, 0, 0};  // beside the ball, 15 cells from the mesh
        CHECK(norm(Together(solid, ball).on_grid(h).velocity(x, into) - ball.on_grid(h).velocity(x, into)) < 1e-6F);
        CHECK(norm(Together(ball, solid).on_grid(h).velocity(x, into) - ball.on_grid(h).velocity(x, into)) < 1e-6F);
    }
}

TEST_CASE("lanes of a register look up what one number alone does", "[data][mesh_distance]") {
    const auto compare = [](auto of) {
        using S = decltype(of);
        using P = native_pack<S>;
        const DistanceGrid<S, 3> shape{mesh_distance(test_meshes::sphere({0, 0, 0}, 0.3, 2), {.spacing = 0.05})};
        const DistanceGrid<P, 3> in_lanes = shape.template lifted<P>();
        Random random(64);
        for (int trial = 0; trial < 100; ++trial) {
            Vec<P, 3> x{};
            for (int lane = 0; lane < scalar_traits<P>::lanes; ++lane)
                for (int a = 0; a < 3; ++a) x[a].set(lane, S(random.uniform(-0.6, 0.6)));
            const P distance = in_lanes.signed_distance(x);
            const Vec<P, 3> normal = in_lanes.normal(x);
            for (int lane = 0; lane < scalar_traits<P>::lanes; ++lane) {
                const Vec<S, 3> alone{x[0][lane], x[1][lane], x[2][lane]};
                const S tolerance =
#ifdef __FMA__  // contracted where the compiler likes
                    40 * std::numeric_limits<S>::epsilon();
#else
                    0;
#endif
                CHECK(std::abs(distance[lane] - shape.signed_distance(alone)) <= tolerance);
                for (int a = 0; a < 3; ++a) CHECK(std::abs(normal[a][lane] - shape.normal(alone)[a]) <= 10 * tolerance);
            }
        }
    };
    compare(0.0F);
    compare(0.0);
    // And a dual number's derivative is the gradient, inside and outside of the box.
    const DistanceGrid<double, 3, double> shape{
        mesh_distance<double>(test_meshes::sphere({0, 0, 0}, 0.3, 2), {.spacing = 0.05})};
    const auto with = shape.lifted<dual<double>>().signed_distance({dual<double>(0.21, 1), {0.1, 0.0}, {-0.2, 0.0}});
    const double quotient =
        (shape.signed_distance({0.21 + 1e-6, 0.1, -0.2}) - shape.signed_distance({0.21 - 1e-6, 0.1, -0.2})) / 2e-6;
    CHECK(with.derivative == Approx(quotient).epsilon(1e-6));
    const auto outside = shape.lifted<dual<double>>().signed_distance({dual<double>(0.61, 1), {0.1, 0.0}, {-0.2, 0.0}});
    const double quotient_outside =
        (shape.signed_distance({0.61 + 1e-6, 0.1, -0.2}) - shape.signed_distance({0.61 - 1e-6, 0.1, -0.2})) / 2e-6;
    CHECK(outside.derivative == Approx(quotient_outside).epsilon(1e-6));
    CHECK(shape.lifted<strict<double>>().signed_distance({0.21, 0.1, -0.2}).value ==
          Approx(shape.signed_distance({0.21, 0.1, -0.2})));
}

TEMPLATE_TEST_CASE("a mesh as a collider, turned and moving: what the ball it stands for does; no node is missed",
                   "[data][mesh_distance]", float, double) {
    using S = TestType;
    const double spacing = 0.02;
    Collider<DistanceGrid<S, 3>> of_mesh{
        .shape = {mesh_distance(test_meshes::sphere({0, 0, 0}, 0.3, 4), {.spacing = spacing})},
        .friction = 0.3,
        .position = {0.5, -0.2, 0.1},
        .rotation = rotor({1, 2, -1}, radians(0.8)),
        .linear_velocity = {0.3, 1, -0.4},
        .angular_velocity = {2, -1, 0.5}};
    Collider<Sphere<S, 3>> of_ball{.shape = {S(0.3)},
                                   .friction = 0.3,
                                   .position = of_mesh.position,
                                   .rotation = of_mesh.rotation,
                                   .linear_velocity = of_mesh.linear_velocity,
                                   .angular_velocity = of_mesh.angular_velocity};
    Random random(65);
    int touched = 0, skipped = 0;
    for (int trial = 0; trial < 1000; ++trial) {
        const auto at = of_mesh.position + random.direction<3>() * random.uniform(0.15, 0.5);
        const auto v = random.vector<3>(-3, 3);
        if (std::abs(norm(at - of_mesh.position) - 0.3) < 1e-3) continue;
        const auto mine = of_mesh.velocity(cast<S>(at), cast<S>(v)), its = of_ball.velocity(cast<S>(at), cast<S>(v));
        CAPTURE(trial);
        CHECK(norm(mine - its) <= 0.5);  // the normal's error times the speeds; compared closely below
        touched += !(mine == cast<S>(v));
        const auto half = Vec<double, 3>::filled(0.04);
        if (!of_mesh.reaches(at - half, at + half)) {
            ++skipped;
            for (int corner = 0; corner < 27; ++corner) {
                Vec<double, 3> x = at;
                for (int a = 0, rest = corner; a < 3; ++a, rest /= 3) x[a] += 0.04 * (rest % 3 - 1);
                CHECK(of_mesh.velocity(cast<S>(x), cast<S>(v)) == cast<S>(v));
            }
        }
    }
    CHECK(touched > 200);
    CHECK(skipped > 50);
}

TEST_CASE("meshes and grids that cannot be are refused, and memory is counted before it is taken",
          "[data][mesh_distance][error]") {
    const auto cube = test_meshes::unit_cube();
    const auto words_of = [](const TriangleMesh& mesh, const MeshDistanceOptions& options) {
        try {
            static_cast<void>(mesh_distance(mesh, options));
        } catch (const parameter_error& e) {
            return std::string(e.what());
        }
        return std::string("nothing");
    };
    using test_support::infinity;
    using test_support::not_a_number;
    for (const double bad : {0.0, -0.1, not_a_number, infinity})
        CHECK(words_of(cube, {.spacing = bad}).find("spacing") != std::string::npos);
    for (const double bad : {-1.0, 0.05, not_a_number})
        CHECK(words_of(cube, {.spacing = 0.1, .band = bad}).find("band") != std::string::npos);
    CHECK(words_of(cube, {.spacing = 1e-6}).find("bytes") != std::string::npos);
    CHECK(words_of(cube, {.spacing = 1e-300}).find("bytes") != std::string::npos);
    CHECK(words_of(cube, {.spacing = 0.1, .most_bytes = 1000}).find("bytes") != std::string::npos);

    CHECK_THROWS_AS(mesh_distance({}, {.spacing = 0.1}), mesh_error);
    auto open = cube;
    open.triangles.pop_back();
    CHECK_THROWS_AS(mesh_distance(open, {.spacing = 0.1}), mesh_error);
    auto twice = cube;
    twice.triangles[0] = {0, 0, 3};
    CHECK_THROWS_AS(mesh_distance(twice, {.spacing = 0.1}), mesh_error);
    CHECK_THROWS_AS(mesh_distance(test_meshes::box({0, 0, 0}, {1, 1, 0}), {.spacing = 0.1}), mesh_error);

    const Collider<DistanceGrid<float, 3>> without{};
    CHECK_THROWS_AS(without.check(), parameter_error);
    auto wrong = *mesh_distance(cube, {.spacing = 0.1});
    wrong.values.pop_back();
    const Collider<DistanceGrid<float, 3>> damaged{
        .shape = {std::make_shared<const DistanceNumbers<float, 3>>(std::move(wrong))}};
    CHECK_THROWS_AS(damaged.check(), parameter_error);
}
