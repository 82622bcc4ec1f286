/// \file Soft bodies: counts of a lattice by closed formulas, its surface closed, volumes, support, refusals.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/data/sampling.hpp>
#include <firn/lagrangian/soft_body.hpp>

#include "../data/meshes.hpp"

#include <numeric>
#include <set>

using namespace firn;
using test_support::holds;
using test_support::message;

namespace soft_body_tests {

namespace {

template <int D>
long count(const Net<D>& net, LinkKind kind) {
    return std::count_if(net.links.begin(), net.links.end(), [&](const Link& link) { return link.kind == kind; });
}

template <int D>
bool links_are_unique_and_long(const Net<D>& net) {
    std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
    for (const auto& link : net.links)
        if (!pairs.insert(std::minmax(link.a, link.b)).second || !(rest_length(net, link) > 1e-9)) return false;
    return true;
}

double sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

/// V − E + F over the points that the surface uses: 2 for a sphere.
long euler_characteristic(const Net<3>& net) {
    std::set<std::uint32_t> points;
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const auto& f : net.facets)
        for (std::size_t k = 0; k < 3; ++k) points.insert(f[k]), edges.insert(std::minmax(f[k], f[(k + 1) % 3]));
    return long(points.size()) - long(edges.size()) + long(net.facets.size());
}

Samples<3> cubes(std::vector<Vec<double, 3>> centres) { return {std::move(centres), 1.0}; }

}  // namespace

TEST_CASE("A box of n1 × n2 × n3 cells has the links that the formulas say, each once, and a closed surface") {
    struct Size {
        long a, b, c;
    };
    for (const auto [a, b, c] : {Size{1, 1, 1}, {2, 1, 1}, {2, 3, 4}}) {
        CAPTURE(a, b, c);
        const double h = 0.1;
        const auto body = lattice_body(sample_box<3>(
            {1, 2, 3}, {1 + (double(a) + 0.25) * h, 2 + (double(b) + 0.25) * h, 3 + (double(c) + 0.25) * h},
            {.spacing = h}));
        const auto& net = body.net;
        CHECK(long(net.positions.size()) == (a + 1) * (b + 1) * (c + 1));
        const long edges = a * (b + 1) * (c + 1) + (a + 1) * b * (c + 1) + (a + 1) * (b + 1) * c;
        const long faces = a * b * (c + 1) + a * (b + 1) * c + (a + 1) * b * c;
        CHECK(count(net, LinkKind::stretch) == edges);
        CHECK(count(net, LinkKind::shear) == 2 * faces + 4 * a * b * c);
        CHECK(count(net, LinkKind::bend) ==
              (a - 1) * (b + 1) * (c + 1) + (a + 1) * (b - 1) * (c + 1) + (a + 1) * (b + 1) * (c - 1));
        CHECK(links_are_unique_and_long(net));
        CHECK(long(net.facets.size()) == 4 * (a * b + b * c + c * a));
        CHECK_NOTHROW(check_closed(surface_mesh(net)));
        CHECK(euler_characteristic(net) == 2);
        const double volume = double(a * b * c) * h * h * h;
        CHECK(signed_volume(surface_mesh(net)) == Approx(volume).epsilon(1e-9));
        CHECK(sum(body.volumes) == Approx(volume).epsilon(1e-9));
        CHECK(body.volumes[0] == Approx(h * h * h / 8).epsilon(1e-9));
        CHECK(sum(body.masses(500)) == Approx(500 * volume).epsilon(1e-9));
        CHECK(norm(net.positions[0] - Vec<double, 3>{1, 2, 3}) < 1e-12);
        CHECK(norm(net.positions[1] - Vec<double, 3>{1 + h, 2, 3}) < 1e-12);
    }
}

TEST_CASE("A rectangle of cells in the plane has an outline that runs round it once, the outside on its right") {
    const auto body = lattice_body(sample_box<2>({0, 0}, {0.3, 0.2}, {.spacing = 0.1}));
    CHECK(body.net.positions.size() == 12);
    CHECK(count(body.net, LinkKind::stretch) == 3 * 3 + 4 * 2);
    CHECK(count(body.net, LinkKind::shear) == 2 * 6);
    CHECK(count(body.net, LinkKind::bend) == 2 * 3 + 4 * 1);
    CHECK(body.net.facets.size() == 10);
    CHECK(sum(body.volumes) == Approx(0.06).epsilon(1e-12));
    double area = 0;  // Gauss: half of Σ x × Δx, positive counter-clockwise
    std::set<std::uint32_t> starts, ends;
    for (const auto& [a, b] : body.net.facets) {
        const auto &p = body.net.positions[a], &q = body.net.positions[b];
        area += (p[0] * q[1] - p[1] * q[0]) / 2;
        starts.insert(a), ends.insert(b);
    }
    CHECK(area == Approx(0.06).epsilon(1e-12));
    CHECK(starts.size() == 10);
    CHECK(starts == ends);
}

TEST_CASE("Lattices in a sphere and in a mesh have one closed surface without handles") {
    const auto ball = lattice_body(sample_sphere<3>({0, 1, 0}, 0.5, {.spacing = 0.11}));
    CHECK_NOTHROW(check_closed(surface_mesh(ball.net)));
    CHECK(euler_characteristic(ball.net) == 2);
    CHECK(sum(ball.volumes) == Approx(signed_volume(surface_mesh(ball.net))).epsilon(1e-9));
    const auto of_mesh = lattice_body(sample_mesh(test_meshes::sphere({0, 1, 0}, 0.5, 2), {.spacing = 0.07}));
    CHECK_NOTHROW(check_closed(surface_mesh(of_mesh.net)));
    CHECK(euler_characteristic(of_mesh.net) == 2);
    CHECK(links_are_unique_and_long(of_mesh.net));
}

TEST_CASE("Cells that touch along an edge only get one between them, so that the surface stays one without hinges") {
    // Two cells of a common edge, and a third that joins them by faces, far round.
    const auto body = lattice_body(cubes({{0, 0, 0}, {1, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}}));
    CHECK(sum(body.volumes) == Approx(6).epsilon(1e-12));
    CHECK_NOTHROW(check_closed(surface_mesh(body.net)));
    const auto flat = lattice_body(Samples<2>{{{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}, 1.0});
    CHECK(sum(flat.volumes) == Approx(8).epsilon(1e-12));  // a ring: nothing to fill
    CHECK(flat.net.facets.size() == 16);                   // outside and inside
    const auto hinge = lattice_body(Samples<2>{{{0, 0}, {1, 1}}, 1.0});
    CHECK(sum(hinge.volumes) == Approx(3).epsilon(1e-12));
    // What is filled in may touch others along an edge only, in its turn.
    const auto chain = lattice_body(cubes({{1, 1, 1}, {1, 2, 0}, {2, 0, 0}, {2, 0, 1}}));
    CHECK(sum(chain.volumes) == Approx(7).epsilon(1e-12));
    CHECK_NOTHROW(check_closed(surface_mesh(chain.net)));
}

TEST_CASE("Samples that are no lattice, lie there twice, or fall apart are refused") {
    CHECK_THROWS_AS(lattice_body(Samples<3>{}), parameter_error);
    CHECK(holds(message<parameter_error>([] { return lattice_body(cubes({{0, 0, 0}, {1.2, 0, 0}})); }),
                "Pattern::lattice"));
    CHECK(holds(message<parameter_error>([] { return lattice_body(cubes({{0, 0, 0}, {0, 0, 0}})); }), "Two samples"));
    CHECK(holds(message<parameter_error>([] { return lattice_body(cubes({{0, 0, 0}, {2, 0, 0}, {3, 0, 0}})); }),
                "of its 3 cells 2 are not joined"));
    CHECK_THROWS_AS(lattice_body(Samples<3>{{{0, 0, 0}}, -1.0}), parameter_error);
    const auto body = lattice_body(cubes({{0, 0, 0}}));
    CHECK_THROWS_AS(body.masses(0), parameter_error);
}

TEST_CASE("A closed mesh is held by links from every vertex to the other side") {
    const auto mesh = test_meshes::sphere({0, 0, 0}, 0.5, 2);  // 162 vertices, 480 edges
    const auto body = mesh_body(mesh);
    CHECK(body.net.positions == mesh.vertices);
    CHECK(body.net.facets.size() == 320);
    CHECK(links_are_unique_and_long(body.net));
    CHECK(count(body.net, LinkKind::stretch) == 480);
    CHECK(count(body.net, LinkKind::bend) == 480);
    // The straight ray of a vertex meets its antipode: a diameter, found from both ends. The slanted ones are chords
    // of 2r cos 35°, to the nearest vertex: shorter or longer by an edge at most (0.16).
    long diameters = 0;
    std::vector<int> held(162, 0);
    for (const auto& link : body.net.links) {
        if (link.kind != LinkKind::support) continue;
        ++held[link.a], ++held[link.b];
        const double length = rest_length(body.net, link);
        CHECK(length > std::cos(35 * 3.14159265 / 180) - 0.16);
        CHECK(length < 1 + 1e-9);
        if (length > 1 - 1e-9) ++diameters;
    }
    CHECK(diameters == 81);
    CHECK(*std::min_element(held.begin(), held.end()) >= 4);
    CHECK(sum(body.volumes) == Approx(signed_volume(mesh)).epsilon(1e-12));
    CHECK(*std::min_element(body.volumes.begin(), body.volumes.end()) > 0);
    // Turned inside out it is the same body.
    const auto turned = mesh_body(reversed(mesh));
    CHECK(signed_volume(surface_mesh(turned.net)) > 0);
    CHECK(turned.net.links.size() == body.net.links.size());
}

TEST_CASE("A mesh with a hole, or flat, is no soft body") {
    auto holed = test_meshes::unit_cube();
    holed.triangles.pop_back();
    CHECK(holds(message<mesh_error>([&] { return mesh_body(holed); }), "not a closed"));
    const TriangleMesh flat{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}};
    CHECK_THROWS_AS(mesh_body(flat), mesh_error);
}

}  // namespace soft_body_tests
