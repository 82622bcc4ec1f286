/// \file Cloth and ropes: what links what, closed formulas of counts, masses, refusals.
#include "support/catch.hpp"
#include "support/message.hpp"
#include "support/not_finite.hpp"
#include "support/random_numbers.hpp"
#include <firn/lagrangian/cloth.hpp>
#include <firn/lagrangian/rope.hpp>

#include "../data/meshes.hpp"

#include <numeric>
#include <set>

using namespace firn;
using test_support::holds;
using test_support::message;
using test_support::not_a_number;

namespace cloth_tests {

namespace {

template <int D>
std::ptrdiff_t count(const Net<D>& net, LinkKind kind) {
    return std::count_if(net.links.begin(), net.links.end(), [&](const Link& link) { return link.kind == kind; });
}

template <int D>
bool links_are_unique(const Net<D>& net) {
    std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
    for (const auto& link : net.links)
        if (!pairs.insert(std::minmax(link.a, link.b)).second) return false;
    return true;
}

template <int D>
double least_length(const Net<D>& net) {
    double least = 1e300;
    for (const auto& link : net.links) least = std::min(least, rest_length(net, link));
    return least;
}

double sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

}  // namespace

TEST_CASE("A rectangle of m × n cells has the links and facets that the formulas say, each once") {
    struct Size {
        std::size_t m, n;
    };
    for (const auto [m, n] : {Size{1, 1}, {1, 4}, {2, 2}, {7, 5}}) {
        for (const auto diagonals : {Diagonals::alternating, Diagonals::parallel}) {
            CAPTURE(m, n);
            const auto net = cloth({1, 2, 3}, {2, 0, 0}, {0, 0, 1.5}, {m, n}, diagonals);
            CHECK(net.positions.size() == (m + 1) * (n + 1));
            CHECK(net.facets.size() == 2 * m * n);
            CHECK(count(net, LinkKind::stretch) == std::ptrdiff_t(m * (n + 1) + n * (m + 1)));
            CHECK(count(net, LinkKind::shear) == std::ptrdiff_t(2 * m * n));
            CHECK(count(net, LinkKind::bend) == std::ptrdiff_t((m - 1) * (n + 1) + (n - 1) * (m + 1)));
            CHECK(count(net, LinkKind::support) == 0);
            CHECK(links_are_unique(net));
            CHECK(least_length(net) == Approx(std::min(2.0 / double(m), 1.5 / double(n))).epsilon(1e-12));
            // Every cell's two triangles cover it: the areas add up, and all look along u × v = −y.
            const auto masses = facet_masses(net, 0.2);
            CHECK(sum(masses) == Approx(0.2 * 3).epsilon(1e-12));
            for (const auto& [a, b, c] : net.facets) {
                const auto normal = cross(net.positions[b] - net.positions[a], net.positions[c] - net.positions[a]);
                CHECK(normal[1] == Approx(-3.0 / double(m * n)).epsilon(1e-9));
            }
            // Euler's characteristic of a disc: every edge of a triangle is a link along an edge or a diagonal.
            std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
            for (const auto& f : net.facets)
                for (std::size_t k = 0; k < 3; ++k) edges.insert(std::minmax(f[k], f[(k + 1) % 3]));
            CHECK(long(net.positions.size()) - long(edges.size()) + long(net.facets.size()) == 1);
        }
    }
    const auto net = cloth({1, 2, 3}, {2, 0, 0}, {0, 0, 1.5}, {4, 3});
    CHECK(norm(net.positions[3 + 5 * 2] - Vec<double, 3>{1 + 2 * 0.75, 2, 3 + 1.0}) < 1e-14);
}

TEST_CASE("Alternating diagonals turn from cell to cell, parallel ones do not") {
    const auto diagonal = [](const Net<3>& net, std::size_t cell) {
        // The edge that both triangles of a cell have in common.
        std::set<std::uint32_t> first(net.facets[2 * cell].begin(), net.facets[2 * cell].end()), both;
        for (const auto point : net.facets[2 * cell + 1])
            if (first.contains(point)) both.insert(point);
        const auto along = net.positions[*both.rbegin()] - net.positions[*both.begin()];
        return along[0] * along[1] > 0;
    };
    const auto turning = cloth({0, 0, 0}, {3, 0, 0}, {0, 2, 0}, {3, 2});
    const auto same = cloth({0, 0, 0}, {3, 0, 0}, {0, 2, 0}, {3, 2}, Diagonals::parallel);
    for (std::size_t cell = 0; cell < 6; ++cell) {
        CHECK(diagonal(turning, cell) == ((cell % 3 + cell / 3) % 2 == 0));
        CHECK(diagonal(same, cell));
    }
}

TEST_CASE("Cloth that has no area, no cell, or is not finite is refused") {
    const Vec<double, 3> u{1, 0, 0}, v{0, 1, 0}, o{};
    CHECK(holds(message<parameter_error>([&] { return cloth(o, u, u * 3.0, {2, 2}); }), "must not be parallel"));
    CHECK_THROWS_AS(cloth(o, u, {0, not_a_number, 0}, {2, 2}), parameter_error);
    CHECK_THROWS_AS(cloth({0, 0, std::numeric_limits<double>::infinity()}, u, v, {2, 2}), parameter_error);
    CHECK(holds(message<parameter_error>([&] { return cloth(o, u, v, {0, 3}); }), "0 x 3 cells"));
    CHECK_THROWS_AS(cloth(o, u, v, {1u << 20, 1u << 20}), parameter_error);
}

TEST_CASE("The net of a mesh has its edges as stretch links, and a bend link over each shared edge") {
    // A closed surface of F triangles has 3F/2 edges, each shared by two. Of an octahedron the opposite corners of an
    // edge are the two ends of an axis for four edges each: 12 edges, 3 bend links.
    TriangleMesh octahedron{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
                            {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
    const auto eight = cloth(octahedron);
    CHECK(count(eight, LinkKind::stretch) == 12);
    CHECK(count(eight, LinkKind::bend) == 3);
    CHECK(links_are_unique(eight));

    const auto ball = test_meshes::sphere({0, 0, 0}, 0.5, 2);  // 320 triangles
    const auto net = cloth(ball);
    CHECK(net.positions.size() == 162);
    CHECK(net.facets.size() == 320);
    CHECK(count(net, LinkKind::stretch) == 480);
    CHECK(count(net, LinkKind::bend) == 480);
    CHECK(links_are_unique(net));
    CHECK(least_length(net) > 0);

    // Open: two triangles of the unit square share one edge. Of a tetrahedron all opposite corners are joined already.
    const TriangleMesh square{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}};
    const auto open = cloth(square);
    CHECK(count(open, LinkKind::stretch) == 5);
    REQUIRE(count(open, LinkKind::bend) == 1);
    CHECK(std::count(open.links.begin(), open.links.end(), Link{1, 3, LinkKind::bend}) == 1);
    CHECK(sum(facet_masses(open, 3)) == Approx(3).epsilon(1e-14));
    CHECK(facet_masses(open, 3)[0] == Approx(1.0).epsilon(1e-14));  // of both triangles
    CHECK(facet_masses(open, 3)[1] == Approx(0.5).epsilon(1e-14));
    const TriangleMesh tetrahedron{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                   {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
    CHECK(count(cloth(tetrahedron), LinkKind::bend) == 0);
    CHECK(count(cloth(tetrahedron), LinkKind::stretch) == 6);

    // Three sheets that share one edge: a bend link between every two of them.
    const TriangleMesh seam{{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}},
                            {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}}};
    CHECK(count(cloth(seam), LinkKind::bend) == 3);
}

TEST_CASE("A mesh that cannot be cloth is refused, and the triangle named") {
    TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}};
    const auto refusal = [&] { return message<mesh_error>([&] { return cloth(mesh); }); };
    SECTION("no area") {
        mesh.vertices[3] = {0.5, 0.5, 0};
        CHECK(holds(refusal(), "Triangle 1 (from 0) has no area"));
    }
    SECTION("wrong index") {
        mesh.triangles[1][2] = 4;
        CHECK(holds(refusal(), "Triangle 1 (from 0) names vertex 4"));
    }
    SECTION("a corner twice") {
        mesh.triangles[0][1] = 0;
        CHECK(holds(refusal(), "Triangle 0 (from 0) uses a vertex twice"));
    }
    SECTION("not finite") {
        mesh.vertices[2][1] = not_a_number;
        CHECK(holds(refusal(), "Vertex 2"));
    }
    SECTION("a loose vertex") {
        mesh.vertices.push_back({5, 5, 5});
        CHECK(holds(refusal(), "No triangle uses vertex 4"));
    }
    SECTION("folded onto itself") {
        mesh.vertices[3] = mesh.vertices[1];
        CHECK(holds(refusal(), "Triangles 0 and 1 (from 0) of the mesh lie on each other"));
    }
    SECTION("empty") {
        mesh.triangles.clear();
        CHECK(holds(refusal(), "no triangle"));
    }
}

TEST_CASE("Masses need a positive density, and every point a facet") {
    auto net = cloth({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 2});
    for (const double density : {0.0, -1.0, not_a_number}) CHECK_THROWS_AS(facet_masses(net, density), parameter_error);
    net.positions.push_back({9, 9, 9});
    CHECK(holds(message<parameter_error>([&] { facet_masses(net, 1); }), "Point 9 (from 0) belongs to no facet"));
    net.facets.push_back({0, 1, 10});
    CHECK(holds(message<parameter_error>([&] { facet_masses(net, 1); }), "names point 10, but the net has 10"));
}

TEMPLATE_TEST_CASE_SIG("A rope of n segments has n stretch and n − 1 bend links and its length's mass", "",
                       ((int D), D), 2, 3) {
    Vec<double, D> a{}, b{};
    a[0] = 1, b[0] = 4, b[1] = 4;  // 5 long
    for (const std::size_t n : {1, 2, 9}) {
        const auto net = rope<D>(a, b, n);
        CHECK(net.positions.size() == n + 1);
        CHECK(count(net, LinkKind::stretch) == std::ptrdiff_t(n));
        CHECK(count(net, LinkKind::bend) == std::ptrdiff_t(n) - 1);
        CHECK(net.facets.size() == (D == 2 ? n : 0));
        CHECK(links_are_unique(net));
        CHECK(net.positions.front() == a);
        CHECK(net.positions.back() == b);
        CHECK(least_length(net) == Approx(5.0 / double(n)).epsilon(1e-12));
        const auto masses = link_masses(net, 0.3);
        CHECK(sum(masses) == Approx(1.5).epsilon(1e-12));
        CHECK(masses.front() == Approx(0.75 / double(n)).epsilon(1e-12));
        if (D == 2) CHECK(facet_masses(net, 0.3) == masses);
        if constexpr (D == 2)  // on the right of (3, 4)
            for (const auto& [i, j] : net.facets) {
                const auto outwards = area_vector(std::array{net.positions[i], net.positions[j]});
                CHECK(norm(outwards - Vec<double, 2>{4, -3} * (1.0 / double(n))) < 1e-14);
            }
    }
    CHECK_THROWS_AS(rope<D>(a, a, 3), parameter_error);
    CHECK_THROWS_AS(rope<D>(a, b, 0), parameter_error);
    b[1] = not_a_number;
    CHECK_THROWS_AS(rope<D>(a, b, 3), parameter_error);
}

TEST_CASE("Two unit vectors stand upright on any unit vector, along an axis, too, and turn with it by the right hand") {
    std::vector<Vec<double, 3>> all{{1, 0, 0}, {0, -1, 0}, {0, 0, 1}};
    test_support::Random random(71);
    for (int i = 0; i < 100; ++i) all.push_back(random.direction<3>());
    for (const auto& n : all) {
        const auto [u, v] = perpendicular(n);
        CAPTURE(n[0], n[1], n[2]);
        CHECK(std::abs(norm(u) - 1) < 1e-14);
        CHECK(std::abs(dot(u, n)) < 1e-14);
        CHECK(norm(cross(n, u) - v) < 1e-14);
    }
}

}  // namespace cloth_tests
