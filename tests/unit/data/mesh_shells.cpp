// part: arithmetic
// sanitized: -O1
/// \file firn/data/mesh_shells.hpp: shells that face inwards are holes, or are turned, or are named; whatever needs the
/// inside of a mesh has the same volume.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/boundary/distance_grid.hpp>
#include <firn/data/mesh_distance.hpp>
#include <firn/data/sampling.hpp>
#include <firn/lagrangian/soft_body.hpp>

#include "meshes.hpp"

#include <numeric>

using namespace firn;
using namespace test_meshes;
using test_support::holds;
using test_support::message;

namespace mesh_shells_tests {
namespace {

TriangleMesh cube(double x, double side) { return box({x, 0, 0}, {x + side, side, side}); }
/// A cube of this side in the middle of the unit cube.
TriangleMesh inner(double side) {
    const auto near = Vec<double, 3>::filled(0.5 - side / 2), far = Vec<double, 3>::filled(0.5 + side / 2);
    return box(near, far);
}
TriangleMesh joined_all(const std::vector<TriangleMesh>& parts) {
    TriangleMesh mesh = parts[0];
    for (std::size_t i = 1; i < parts.size(); ++i) mesh = joined(mesh, parts[i]);
    return mesh;
}

/// The volume of the union less the holes, as each function has it, if the shells do not overlap.
void check_volume(const TriangleMesh& mesh, double volume) {
    CHECK(signed_volume(facing_outwards(mesh)) == Approx(volume).epsilon(1e-12));
    CHECK(InsideTest(mesh).volume() == Approx(volume).epsilon(1e-12));
    const auto samples = sample_mesh(mesh, {.spacing = 1.0 / 16});
    CHECK(double(samples.positions.size()) * samples.volume == Approx(volume).epsilon(1e-12));
    const auto volumes = mesh_body(mesh).volumes;
    CHECK(std::accumulate(volumes.begin(), volumes.end(), 0.0) == Approx(volume).epsilon(1e-12));
    // Nodes on the faces are at 0; so no more nodes are inside than cubes of the lattice, and each cube has one.
    const auto grid = mesh_distance<double>(mesh, {.spacing = 1.0 / 16});
    const auto inside = std::count_if(grid->values.begin(), grid->values.end(), [](double d) { return d < 0; });
    CHECK(double(inside) <= volume * 16 * 16 * 16);
    const DistanceGrid<double, 3, double> shape{grid};
    CHECK(std::all_of(samples.positions.begin(), samples.positions.end(),
                      [&](const auto& x) { return shape.signed_distance(x) < 0; }));
}

}  // namespace

TEST_CASE("A shell that faces inwards apart from the others is turned, whichever is the larger") {
    check_volume(joined(cube(0, 1), reversed(cube(2, 0.5))), 1.125);
    check_volume(joined(reversed(cube(0, 1)), cube(2, 0.5)), 1.125);
    check_volume(joined(cube(0, 1), reversed(cube(2, 1))), 2);
    check_volume(joined(reversed(cube(0, 1)), reversed(cube(2, 0.5))), 1.125);
    check_volume(joined_all({reversed(cube(4, 0.25)), cube(0, 1), reversed(cube(2, 0.5)), cube(3, 0.5)}),
                 1 + 2 * 0.125 + 0.25 * 0.25 * 0.25);
    // Beside each other on a common face.
    check_volume(joined(cube(0, 1), reversed(cube(1, 0.5))), 1.125);
}

TEST_CASE("A shell that faces inwards in a body is a hole; what lies in a shell that is turned is turned with it") {
    const auto hole = reversed(inner(0.5)), island = inner(0.25);
    const double hollow = 1 - 0.125, filled = hollow + 0.25 * 0.25 * 0.25;
    check_volume(joined(unit_cube(), hole), hollow);
    check_volume(joined(hole, unit_cube()), hollow);
    check_volume(reversed(joined(unit_cube(), hole)), hollow);
    check_volume(joined(joined(unit_cube(), hole), reversed(cube(2, 0.5))), hollow + 0.125);
    check_volume(joined(reversed(joined(unit_cube(), hole)), cube(2, 1)), hollow + 1);
    for (const auto& in_hole : {island, reversed(island)}) {
        check_volume(joined_all({unit_cube(), hole, in_hole}), filled);
        check_volume(joined_all({in_hole, hole, unit_cube()}), filled);
    }
    check_volume(reversed(joined_all({unit_cube(), hole, island})), filled);
    // A hole that reaches to the surface.
    check_volume(joined(unit_cube(), reversed(box({0.25, 0.25, 0.5}, {0.75, 0.75, 1}))), 1 - 0.125);
    // Two holes that overlap in a quarter of each: together they are one.
    const auto holes = joined_all({unit_cube(), reversed(box({0.125, 0.25, 0.25}, {0.625, 0.75, 0.75})),
                                   reversed(box({0.5, 0.25, 0.25}, {0.875, 0.75, 0.75}))});
    const auto samples = sample_mesh(holes, {.spacing = 1.0 / 16});
    CHECK(double(samples.positions.size()) * samples.volume == Approx(1 - 0.75 * 0.25).epsilon(1e-12));
}

TEST_CASE("Bodies that overlap stay as they are; a shell that faces inwards and crosses another is named") {
    const auto across = box({0.5, 0.25, 0.25}, {1.5, 0.75, 0.75});
    const auto overlapping = joined(unit_cube(), across);
    CHECK(facing_outwards(overlapping).triangles == overlapping.triangles);
    CHECK(signed_volume(facing_outwards(reversed(overlapping))) == Approx(1.25));
    const auto apart = translated(overlapping, {5, 0, 0});
    CHECK(signed_volume(facing_outwards(joined(overlapping, reversed(apart)))) == Approx(2.5));
    CHECK(signed_volume(facing_outwards(joined(reversed(overlapping), apart))) == Approx(2.5));
    const auto crossing = joined(unit_cube(), reversed(across));
    const auto words = message<mesh_error>([&] { InsideTest{crossing}; });
    CHECK(holds(words, "A shell of 12 triangles, from (0.5, 0.25, 0.25) to (1.5, 0.75, 0.75) m (triangle 12 from 0"));
    CHECK(holds(words, "faces inwards and lies partly inside and partly outside"));
    CHECK_THROWS_AS(mesh_body(crossing), mesh_error);
    CHECK_THROWS_AS(sample_mesh(crossing, {.spacing = 0.1}), mesh_error);
    CHECK_THROWS_AS(mesh_distance(crossing, {.spacing = 0.1}), mesh_error);
}

TEST_CASE("A surface that is inside out in part is named; its volumes cancel without a word otherwise") {
    // A column whose cross-section is an 8: the edges of its halves cross at x = 0, its right half faces inwards.
    const double width = GENERATE(0.6, 1.0, 1.4);
    TriangleMesh mesh;
    for (const double z : {0.0, 1.0})
        for (const auto& [x, y] : {std::pair{-1.0, -1.0}, {width, width}, {width, -width}, {-1.0, 1.0}})
            mesh.vertices.push_back({x, y, z});
    mesh.triangles = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}};
    for (std::int32_t i = 0; i < 4; ++i) {
        const std::int32_t j = (i + 1) % 4;
        mesh.triangles.push_back({i, j, j + 4});
        mesh.triangles.push_back({i, j + 4, i + 4});
    }
    REQUIRE_NOTHROW(check_closed(mesh));
    const auto words = message<mesh_error>([&] { InsideTest{mesh}; });
    CHECK((holds(words, "% of its surface is inside out") || (width == 1 && holds(words, "encloses no volume"))));
}

TEST_CASE("Small bodies far from each other have a volume; two surfaces at one place have none") {
    const auto grains = joined(scaled(unit_cube(), 1e-6), translated(scaled(reversed(unit_cube()), 1e-6), {1, 0, 0}));
    CHECK(InsideTest(grains).volume() == Approx(2e-18).epsilon(1e-9));
    const auto nothing = joined(unit_cube(), reversed(unit_cube()));
    CHECK(holds(message<mesh_error>([&] { InsideTest{nothing}; }), "encloses no volume (0 m"));
    CHECK(holds(message<mesh_error>([&] { return mesh_body(joined(reversed(unit_cube()), unit_cube())); }),
                "encloses no volume (0 m"));
    // A flat shell beside a body adds nothing and is no fault.
    CHECK(InsideTest(joined(unit_cube(), box({2, 0, 0}, {3, 1, 0}))).volume() == Approx(1));
}

TEST_CASE("Many balls, half of them reversed: all are filled") {
    TriangleMesh mesh = sphere({0, 0, 0}, 0.4, 1);
    const double volume = signed_volume(mesh);
    for (int i = 1; i < 64; ++i) {
        const auto ball = sphere({double(i % 4), double(i / 4 % 4), double(i / 16)}, 0.4, 1);
        mesh = joined(mesh, i % 2 ? reversed(ball) : ball);
    }
    const InsideTest inside(mesh);
    CHECK(inside.volume() == Approx(64 * volume).epsilon(1e-12));
    for (int i = 0; i < 64; ++i) CHECK(inside({double(i % 4), double(i / 4 % 4), double(i / 16)}));
}

}  // namespace mesh_shells_tests
