// part: arithmetic
// sanitized: -O1
/// \file firn/data/inside.hpp: the winding number is right where a ray meets edges and vertices, and for real meshes.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include <firn/data/inside.hpp>
#include <firn/data/random.hpp>
#include <firn/io/obj.hpp>

#include "meshes.hpp"

#include <limits>
#include <numbers>

using namespace firn;
using namespace test_meshes;

namespace inside_tests {
namespace {

/// Winding number as the surface's solid angle over 4π (van Oosterom & Strackee 1983, IEEE TBME 30, eq. 8).
double solid_angle_winding(const TriangleMesh& mesh, const Vec<double, 3>& x) {
    double sum = 0;
    for (const auto& [i, j, k] : mesh.triangles) {
        const auto a = mesh.vertices[std::size_t(i)] - x;
        const auto b = mesh.vertices[std::size_t(j)] - x;
        const auto c = mesh.vertices[std::size_t(k)] - x;
        const double la = norm(a), lb = norm(b), lc = norm(c);
        const double triple = dot(a, cross(b, c));
        sum += 2 * std::atan2(triple, la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
    return sum / (4 * std::numbers::pi);
}

/// How deep x lies behind the nearest facet's plane; positive inside a convex body [m].
double convex_depth(const TriangleMesh& mesh, const Vec<double, 3>& x) {
    double depth = std::numeric_limits<double>::infinity();
    for (const auto& [i, j, k] : mesh.triangles) {
        const auto a = mesh.vertices[std::size_t(i)];
        const auto normal = cross(mesh.vertices[std::size_t(j)] - a, mesh.vertices[std::size_t(k)] - a);
        depth = std::min(depth, dot(normal, a - x) / norm(normal));
    }
    return depth;
}

Vec<double, 3> random_point(const Bounds<3>& box, std::uint64_t seed, std::uint64_t i) {
    Vec<double, 3> x{};
    for (int k = 0; k < 3; ++k) {
        const double u = unit_interval(random_bits(seed, 3 * i + std::uint64_t(k)));
        x[k] = box.lower[k] + u * (box.upper[k] - box.lower[k]);
    }
    return x;
}

const std::string bunny_path = FIRN_TEST_EXAMPLES_DIR "/data/bunny.obj";

}  // namespace

TEST_CASE("Rays through edges, vertices and diagonals of a cube count once: every lattice point is right") {
    // Multiples of 1/4 hit all vertices, edges, face diagonals and faces. On the surface the half-open rule holds: the
    // lower faces belong to the cube, the upper ones do not.
    const InsideTest inside(unit_cube());
    for (int i = -2; i <= 6; ++i) {
        for (int j = -2; j <= 6; ++j) {
            for (int k = -2; k <= 6; ++k) {
                const bool expected = i >= 0 && i < 4 && j >= 0 && j < 4 && k >= 0 && k < 4;
                INFO(i << " " << j << " " << k << " quarters");
                CHECK(inside({i / 4.0, j / 4.0, k / 4.0}) == expected);
            }
        }
    }
}

TEST_CASE("Rays through the vertices and edges of a finely cut sphere count once") {
    const Vec<double, 3> centre{0.3, -0.2, 0.1};
    const auto mesh = sphere(centre, 1, test_support::fewer_if_quick(3, 2));
    const InsideTest inside(mesh);
    int wrong = 0, tested = 0;
    for (const auto& corners : mesh.triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            const auto a = mesh.vertices[std::size_t(corners[k])], b = mesh.vertices[std::size_t(corners[(k + 1) % 3])];
            for (auto x : {a, (a + b) * 0.5}) {
                for (const double height : {-0.97, -0.5, 0.02, 0.6}) {
                    x[2] = centre[2] + height;  // exactly above or below the vertex or the edge's middle
                    const double depth = convex_depth(mesh, x);
                    if (std::abs(depth) < 1e-9) continue;  // on the surface: some facets' edges are upright
                    wrong += inside.winding_number(x) != (depth > 0 ? 1 : 0);
                    ++tested;
                }
            }
        }
    }
    // Of 1280 triangles (or 320), 6 points, 4 heights.
    CHECK(tested > test_support::fewer_if_quick(30000, 7500) * 9 / 10);
    CHECK(wrong == 0);
}

TEST_CASE("The bunny: equal to the solid-angle winding number at 4000 random points") {
    const auto mesh = read_obj(bunny_path);
    const InsideTest inside(mesh);
    int wrong = 0, within = 0, near = 0;
    for (std::uint64_t i = 0; i < 4000; ++i) {
        const auto x = random_point(inside.bounds(), 7, i);
        const double winding = solid_angle_winding(mesh, x);
        near += std::abs(winding - std::round(winding)) > 1e-6;  // so near to the surface that it says nothing
        wrong += inside.winding_number(x) != int(std::lround(winding));
        within += inside(x);
    }
    CHECK(near == 0);
    CHECK(wrong == 0);
    const auto extent = inside.bounds().upper - inside.bounds().lower;
    const double share = signed_volume(mesh) / (extent[0] * extent[1] * extent[2]);
    // Monte Carlo volume, three standard deviations.
    CHECK(std::abs(within / 4000.0 - share) < 3 * std::sqrt(share * (1 - share) / 4000));
}

TEST_CASE("The bunny turned, small and away from the origin keeps its answers") {
    const auto mesh = read_obj(bunny_path);
    const auto R = rotation({1, 2, 3}, 0.9);
    const auto moved = translated(scaled(rotated(mesh, R), 1e-3), {5, 6, 7});
    const InsideTest here(mesh), there(moved);
    int wrong = 0;
    for (std::uint64_t i = 0; i < 20000; ++i) {
        const auto x = random_point(here.bounds(), 11, i);
        wrong += here(x) != there(R * x * 1e-3 + Vec<double, 3>{5, 6, 7});
    }
    CHECK(wrong == 0);
}

TEST_CASE("Two bodies that share a face: every point on it belongs to exactly one") {
    const InsideTest left(box({0, 0, 0}, {0.3, 1, 1})), right(box({0.3, 0, 0}, {1, 1, 1}));
    for (int j = 0; j < 20; ++j) {
        for (int k = 0; k < 20; ++k) {
            const Vec<double, 3> x{0.3, j / 20.0, k / 20.0};
            CHECK(left.winding_number(x) + right.winding_number(x) == 1);
        }
    }
}

TEST_CASE("Six tetrahedra that share a cube's diagonal: every point belongs to exactly one, on slanted faces too") {
    // Kuhn's split: one tetrahedron for each order in which a walk from (0,0,0) to (1,1,1) takes the axes.
    // All look outwards in one run and inwards in the other: the rule is the same.
    const bool outwards = GENERATE(true, false);
    int axes[] = {0, 1, 2};
    std::vector<InsideTest> parts;
    do {
        TriangleMesh mesh;
        Vec<double, 3> corner{0, 0, 0};
        mesh.vertices.push_back(corner);
        for (const int axis : axes) {
            corner[axis] = 1;
            mesh.vertices.push_back(corner);
        }
        mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
        parts.emplace_back((signed_volume(mesh) > 0) == outwards ? mesh : reversed(mesh));
    } while (std::next_permutation(axes, axes + 3));
    REQUIRE(parts.size() == 6);
    for (int i = 0; i <= 8; ++i) {
        for (int j = 0; j <= 8; ++j) {
            for (int k = 0; k <= 8; ++k) {
                const Vec<double, 3> x{i / 8.0, j / 8.0, k / 8.0};
                int owners = 0;
                for (const auto& inside : parts) owners += inside(x);
                CAPTURE(i, j, k);
                CHECK(owners == (i < 8 && j < 8 && k < 8 ? 1 : 0));
            }
        }
    }
}

TEST_CASE("A mesh that intersects itself is the union of its parts; one that looks inwards within is a hole") {
    const auto a = sphere({0, 0, 0}, 1, 3), b = sphere({1, 0, 0}, 1, 3);
    const InsideTest in_a(a), in_b(b), in_both(joined(a, b));
    int wrong = 0, overlap = 0;
    for (std::uint64_t i = 0; i < 20000; ++i) {
        const auto x = random_point(in_both.bounds(), 3, i);
        wrong += in_both(x) != (in_a(x) || in_b(x));
        wrong += in_both.winding_number(x) != in_a(x) + in_b(x);
        overlap += in_both.winding_number(x) == 2;
    }
    CHECK(wrong == 0);
    CHECK(overlap > 1000);

    const InsideTest shell(joined(a, reversed(sphere({0, 0, 0}, 0.5, 3))));
    CHECK(!shell({0, 0, 0}));
    CHECK(shell({0, 0.75, 0}));
    CHECK(!shell({0, 1.25, 0}));
}

TEST_CASE("A mesh turned inside out as a whole is taken as if it looked outwards") {
    const auto mesh = sphere({0, 0, 0}, 1, 2);
    const InsideTest outwards(mesh), inwards(reversed(mesh));
    for (std::uint64_t i = 0; i < 1000; ++i) {
        const auto x = random_point(outwards.bounds(), 5, i);
        CHECK(outwards(x) == inwards(x));
    }
}

TEST_CASE("Many slivers (a fan of 20,000) keep memory and answers") {
    TriangleMesh cone;
    constexpr int n = 20000;
    cone.vertices = {{0, 0, 0}, {0, 0, 1}};
    for (int i = 0; i < n; ++i) {
        const double angle = 2 * std::numbers::pi * i / n;
        cone.vertices.push_back({std::cos(angle), std::sin(angle), 0});
        const std::int32_t here = 2 + i, next = 2 + (i + 1) % n;
        cone.triangles.push_back({0, next, here});
        cone.triangles.push_back({1, here, next});
    }
    const InsideTest inside(cone);
    int wrong = 0;
    for (std::uint64_t i = 0; i < 200; ++i) {
        const auto x = random_point(inside.bounds(), 9, i);
        const double margin = 1 - x[2] - std::hypot(x[0], x[1]);
        if (std::abs(margin) > 1e-6) wrong += inside(x) != (margin > 0);
    }
    CHECK(wrong == 0);
}

TEST_CASE("Open, flat and lost meshes and points that are not finite are refused") {
    auto open = unit_cube();
    open.triangles.pop_back();
    CHECK_THROWS_AS(InsideTest(open), mesh_error);
    CHECK_THROWS_AS(InsideTest(TriangleMesh{}), mesh_error);
    CHECK_THROWS_AS(InsideTest(box({0, 0, 0}, {1, 1, 0})), mesh_error);
    CHECK_THROWS_AS(InsideTest(translated(scaled(unit_cube(), 1e-6), {1e3, 0, 0})), mesh_error);
    const InsideTest inside(unit_cube());
    CHECK_THROWS_AS(inside({0.5, std::numeric_limits<double>::quiet_NaN(), 0.5}), parameter_error);
    CHECK_THROWS_AS(inside({std::numeric_limits<double>::infinity(), 0, 0}), parameter_error);
    CHECK(!inside({1e300, 0.5, 0.5}));
}

}  // namespace inside_tests
