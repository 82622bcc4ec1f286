/// \file firn/data/mesh.hpp: checks, volumes and placing of closed meshes.
#include "support/catch.hpp"
#include "support/message.hpp"
#include "support/not_finite.hpp"
#include <firn/data/mass_of_mesh.hpp>
#include <firn/data/mesh.hpp>

#include "meshes.hpp"

#include <limits>
#include <numbers>

using namespace firn;
using test_support::holds;
using test_support::message;
using test_support::not_a_number;
using namespace test_meshes;

TEST_CASE("Volume by the divergence theorem: a box exactly, its reverse negative, a sphere within its facets' error") {
    CHECK(signed_volume(unit_cube()) == Approx(1).epsilon(1e-15));
    CHECK(signed_volume(box({-1, 2, 3}, {1, 5, 7})) == Approx(24).epsilon(1e-15));
    CHECK(signed_volume(reversed(unit_cube())) == Approx(-1).epsilon(1e-15));
    // A small cube 1e6 of its sizes away: only its corners' own rounding (1e-10 of its size) is left.
    CHECK(signed_volume(translated(scaled(unit_cube(), 1e-3), {1e3, -1e3, 1e3})) == Approx(1e-9).epsilon(1e-9));
    // Inscribed facets lose a part of the volume that falls by 4 for each split (second order).
    const double exact = 4.0 / 3.0 * std::numbers::pi;
    const double coarse = exact - signed_volume(sphere({1, 2, 3}, 1, 2));
    const double fine = exact - signed_volume(sphere({1, 2, 3}, 1, 3));
    CHECK(fine > 0);
    CHECK(coarse / fine == Approx(4).epsilon(0.05));
}

TEST_CASE("Mass and inertia of a mesh: of a box those of the shape, wherever it lies; of a sphere's facets nearly") {
    const Box<double, 3> shape{{0.1, 0.3, 0.2}};
    const auto exact = mass_of(shape, 700);
    const auto far = mass_of(translated(box({-0.1, -0.3, -0.2}, {0.1, 0.3, 0.2}), {1e3, -2e3, 5e2}), 700);
    CHECK(far.mass == Approx(exact.mass).epsilon(1e-9));
    CHECK(norm(far.centre - Vec<double, 3>{1e3, -2e3, 5e2}) <= 1e-9);
    CHECK(squared_norm(far.inertia - exact.inertia) <= 1e-16 * squared_norm(exact.inertia));
    const auto ball = mass_of(sphere({1, 2, 3}, 0.5, 4), 700);
    const auto round = mass_of(Sphere<double, 3>{0.5}, 700);
    CHECK(ball.mass == Approx(round.mass).epsilon(3e-3));
    for (int a = 0; a < 3; ++a) CHECK(ball.inertia(a, a) == Approx(round.inertia(a, a)).epsilon(5e-3));
    CHECK(message<parameter_error>([] { mass_of(reversed(unit_cube()), 1); }).find("outwards") != std::string::npos);
    CHECK_THROWS_AS(mass_of(TriangleMesh{}, 1), parameter_error);
}

TEST_CASE("A closed mesh passes; a hole, a turned face and a doubled face are told apart and located") {
    REQUIRE_NOTHROW(check_closed(unit_cube()));
    REQUIRE_NOTHROW(check_closed(sphere({0, 0, 0}, 1, 2)));
    REQUIRE_NOTHROW(check_closed(joined(unit_cube(), unit_cube())));

    auto holed = unit_cube();
    holed.triangles.pop_back();  // 1, 7, 5
    const auto hole = message<mesh_error>([&] { check_closed(holed); });
    CHECK(holds(hole, "of its 18 edges 3 belong to one triangle only (a hole), 0 to two"));
    CHECK(holds(hole, "from vertex 1 (1, 0, 0) to vertex 5 (1, 0, 1)"));

    auto turned = unit_cube();
    std::swap(turned.triangles[0][0], turned.triangles[0][1]);
    CHECK(
        holds(message<mesh_error>([&] { check_closed(turned); }), "0 belong to one triangle only (a hole), 3 to two"));

    auto doubled = unit_cube();
    doubled.triangles.push_back(doubled.triangles[0]);
    const auto twice = message<mesh_error>([&] { check_closed(doubled); });
    CHECK(holds(twice, "opposite orientation, 3 to more than two"));
    CHECK(holds(twice, "Remove faces that are there twice"));
    CHECK(!holds(twice, "own"));
}

TEST_CASE("Bodies that share an edge: the advice is to separate their vertices, and it helps") {
    // Two cubes that touch along the edge x = y = 1, with that edge's vertices in common.
    auto mesh = joined(unit_cube(), box({1, 1, 0}, {2, 2, 1}));
    const auto separate = mesh;
    for (auto& corners : mesh.triangles)
        for (auto& index : corners)
            if (index == 8 || index == 12) index -= 5;  // (1, 1, 0) and (1, 1, 1), of the first cube 3 and 7
    const auto words = message<mesh_error>([&] { check_closed(mesh); });
    CHECK(
        holds(words, "0 belong to one triangle only (a hole), 0 to two triangles of opposite orientation, 1 to more"));
    CHECK(holds(words, "from vertex 3 (1, 1, 0) to vertex 7 (1, 1, 1)"));
    CHECK(holds(words, "do not merge their vertices: give each part its own"));
    CHECK(!holds(words, "merge vertices that"));
    CHECK(!holds(words, "Fill"));
    CHECK_NOTHROW(check_closed(separate));

    auto holed = unit_cube();
    holed.triangles.pop_back();
    const auto hole = message<mesh_error>([&] { check_closed(holed); });
    CHECK(holds(hole, "Fill the holes, and merge vertices that lie on one point."));
    CHECK(!holds(hole, "own"));
}

TEST_CASE("Meshes that are no surface are refused: empty, not finite, a wrong index, a vertex twice") {
    CHECK_THROWS_AS(check_mesh({}), mesh_error);
    auto mesh = unit_cube();
    SECTION("NaN") {
        mesh.vertices[3][1] = not_a_number;
        CHECK(holds(message<mesh_error>([&] { check_mesh(mesh); }), "Vertex 3 (from 0) of the mesh is (1, nan, 0)"));
    }
    SECTION("infinity") {
        mesh.vertices[7][0] = std::numeric_limits<double>::infinity();
        CHECK_THROWS_AS(signed_volume(mesh), mesh_error);
    }
    SECTION("index too high") {
        mesh.triangles[4][2] = 8;
        CHECK(holds(message<mesh_error>([&] { check_mesh(mesh); }),
                    "Triangle 4 (from 0) names vertex 8, but the mesh has 8"));
    }
    SECTION("negative index") {
        mesh.triangles[4][2] = -1;
        CHECK_THROWS_AS(bounding_box(mesh), mesh_error);
    }
    SECTION("a vertex twice") {
        mesh.triangles[4][2] = mesh.triangles[4][0];
        CHECK(holds(message<mesh_error>([&] { check_closed(mesh); }), "uses a vertex twice"));
    }
}

TEST_CASE("Placing keeps the shape: fitted box and size, volume scales by the cube, rotation keeps it") {
    const auto mesh = box({-1, 2, 3}, {1, 5, 7});
    const auto placed = fitted(mesh, {10, 20, 30}, 2);
    const auto bounds = bounding_box(placed);
    for (int k = 0; k < 3; ++k) CHECK((bounds.lower[k] + bounds.upper[k]) / 2 == Approx(10 * (k + 1)));
    CHECK(bounds.upper[2] - bounds.lower[2] == Approx(2));
    CHECK(bounds.upper[0] - bounds.lower[0] == Approx(1));
    CHECK(signed_volume(placed) == Approx(24.0 / 8));

    // A vertex that no triangle uses is not part of the shape.
    auto stray = mesh;
    stray.vertices.push_back({100, 100, 100});
    CHECK(bounding_box(stray).upper[0] == 1);

    const auto R = rotation({0, 3, 0}, std::numbers::pi / 2);
    const auto z_to_x = R * Vec<double, 3>{0, 0, 1};
    CHECK(z_to_x[0] == Approx(1));
    CHECK(std::abs(z_to_x[2]) < 1e-15);
    const Vec<double, 3> pivot{1, 2, 3};
    const auto turned = rotated(mesh, rotation({1, 2, -1}, 0.7), pivot);
    CHECK(signed_volume(turned) == Approx(24));
    CHECK(norm(turned.vertices[7] - pivot) == Approx(norm(mesh.vertices[7] - pivot)));
    CHECK(norm(turned.vertices[7] - mesh.vertices[7]) > 0.1);
}

TEST_CASE("Placing refuses what is no placing: zero, negative, NaN, mirrors, a mesh without size") {
    const auto mesh = unit_cube();
    CHECK_THROWS_AS(scaled(mesh, 0), parameter_error);
    CHECK_THROWS_AS(scaled(mesh, -1), parameter_error);
    CHECK_THROWS_AS(scaled(mesh, not_a_number), parameter_error);
    CHECK_THROWS_AS(translated(mesh, {0, not_a_number, 0}), parameter_error);
    CHECK_THROWS_AS(rotation({0, 0, 0}, 1), parameter_error);
    CHECK_THROWS_AS(rotation({1, 0, 0}, not_a_number), parameter_error);
    CHECK_THROWS_AS(rotated(mesh, Mat<double, 3>::rows(-1, 0, 0, 0, 1, 0, 0, 0, 1)), parameter_error);
    CHECK_THROWS_AS(rotated(mesh, Mat<double, 3>::identity() * 1.001), parameter_error);
    CHECK_THROWS_AS(fitted(mesh, {0, 0, 0}, 0), parameter_error);
    CHECK_THROWS_AS(fitted(mesh, {0, 0, not_a_number}, 1), parameter_error);
    auto point = mesh;
    for (auto& x : point.vertices) x = {1, 1, 1};
    CHECK_THROWS_AS(fitted(point, {0, 0, 0}, 1), mesh_error);
}
