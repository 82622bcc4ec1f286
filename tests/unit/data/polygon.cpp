// part: arithmetic
// sanitized: -O1
/// \file firn/data/polygon.hpp: polygons are cut within themselves, and refused if and only if their edges meet.
#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/data/polygon.hpp>

#include <ctime>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

using namespace firn;
using detail::PolygonCutter;
using test_support::Random;
using Outcome = PolygonCutter::Outcome;

namespace polygon_tests {
namespace {

using Polygon = std::vector<Vec<double, 3>>;

/// What is wrong with the triangles: they must have the polygon's orientation and area, each edge of the polygon must
/// belong to one of them, and each other edge to two, in opposite directions. Together they then cover the polygon
/// once.
std::string fault_of(const Polygon& x, const PolygonCutter& cutter) {
    const auto count = std::uint32_t(x.size());
    if (cutter.triangles().size() != x.size() - 2) return "number of triangles";
    Vec<double, 3> normal{};
    for (std::size_t i = 1; i + 1 < x.size(); ++i) normal = normal + cross(x[i] - x[0], x[i + 1] - x[0]);
    const double area = norm(normal);
    double sum = 0;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const auto& t : cutter.triangles()) {
        const double part = dot(normal, cross(x[t[1]] - x[t[0]], x[t[2]] - x[t[0]])) / area;
        if (part < -1e-9 * area) return "a triangle turned over";
        sum += std::abs(part);
        for (std::size_t k = 0; k < 3; ++k)
            if (++edges[{t[k], t[(k + 1) % 3]}] > 1) return "an edge twice";
    }
    for (std::uint32_t i = 0; i < count; ++i)
        if (!edges.count({i, (i + 1) % count})) return "an edge of the polygon is missing";
    for (const auto& [edge, times] : edges) {
        const bool of_polygon = (edge.first + 1) % count == edge.second;
        if (of_polygon == (edges.count({edge.second, edge.first}) > 0)) return "an edge without partner";
    }
    return std::abs(sum - area) <= 1e-9 * area ? "" : "area";
}

using Point = std::array<std::int64_t, 2>;

/// The polygon in the plane through `at` that u and v span.
Polygon placed(const std::vector<Point>& ring, const Vec<double, 3>& at, const Vec<double, 3>& u,
               const Vec<double, 3>& v) {
    Polygon polygon;
    for (const auto& [x, y] : ring) polygon.push_back(at + u * double(x) + v * double(y));
    return polygon;
}

// Edges of points with small whole coordinates: every product is exact.
std::int64_t side(const Point& a, const Point& b, const Point& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}
bool holds_point(const Point& a, const Point& b, const Point& c) {
    for (std::size_t k = 0; k < 2; ++k)
        if (c[k] < std::min(a[k], b[k]) || c[k] > std::max(a[k], b[k])) return false;
    return side(a, b, c) == 0;
}
bool edges_meet(const std::vector<Point>& ring, std::size_t i, std::size_t j) {
    const std::size_t n = ring.size();
    const auto &a = ring[i], &b = ring[(i + 1) % n], &c = ring[j], &d = ring[(j + 1) % n];
    if ((i + 1) % n == j) return holds_point(a, b, d) || holds_point(c, d, a);
    if ((j + 1) % n == i) return holds_point(a, b, c) || holds_point(c, d, b);
    if (holds_point(a, b, c) || holds_point(a, b, d) || holds_point(c, d, a) || holds_point(c, d, b)) return true;
    return (side(a, b, c) > 0) != (side(a, b, d) > 0) && (side(c, d, a) > 0) != (side(c, d, b) > 0) &&
           side(a, b, c) != 0 && side(a, b, d) != 0 && side(c, d, a) != 0 && side(c, d, b) != 0;
}

const std::vector<Point> ell{{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
const std::vector<Point> comb{{0, 0}, {9, 0}, {9, 5}, {8, 1}, {7, 5}, {6, 1}, {5, 5}, {4, 1}, {3, 5}, {2, 1}, {1, 5}};
const std::vector<Point> spiral{{0, 0}, {7, 0}, {7, 7}, {1, 7}, {1, 2}, {5, 2}, {5, 5}, {3, 5},
                                {3, 4}, {4, 4}, {4, 3}, {2, 3}, {2, 6}, {6, 6}, {6, 1}, {0, 1}};
const std::vector<Point> dart{{0, 4}, {-1, 0}, {0, 3}, {1, 0}};
const std::vector<Point> subdivided{{0, 0}, {1, 0}, {2, 0}, {3, 0}, {3, 1}, {3, 2}, {2, 2}, {1, 2}, {0, 2}, {0, 1}};

}  // namespace

TEST_CASE("Concave polygons are cut within themselves: every place, unit of length, direction and first corner",
          "[data]") {
    PolygonCutter cutter;
    Random random(51);
    for (const auto& shape : {ell, comb, spiral, dart, subdivided}) {
        for (int trial = 0; trial < 60; ++trial) {
            auto ring = shape;
            std::rotate(ring.begin(), ring.begin() + trial % int(ring.size()), ring.end());
            if (trial % 2) std::reverse(ring.begin(), ring.end());
            // Sizes from 1e-250 to 1e250 m, up to 1e4 sizes from the origin; the first ones along the axes, exactly.
            const double size = trial < 6 ? 1 : std::pow(10, random.uniform(-250, 250));
            const auto normal =
                trial < 6 ? Vec<double, 3>{double(trial % 3 == 0), double(trial % 3 == 1), double(trial % 3 == 2)}
                          : random.direction<3>();
            auto u = cross(normal, Vec<double, 3>{normal[2], normal[0], normal[1]});
            u = u * (1 / norm(u));
            const auto v = cross(normal, u);
            const auto polygon = placed(ring, random.vector<3>(-1e4, 1e4) * size, u * size, v * size);
            CAPTURE(shape.size(), trial, size);
            REQUIRE(cutter.cut(polygon) == Outcome::cut);
            Polygon near;  // without overflow in the test's own products
            for (const auto& x : polygon) near.push_back((x - polygon[0]) * (1 / size));
            REQUIRE(fault_of(near, cutter).empty());
        }
    }
}

TEST_CASE("Random rings on a small lattice: cut if no edges meet, else refused with two that do", "[data]") {
    PolygonCutter cutter;
    Random random(7);
    const auto below = [&](std::int64_t count) { return std::int64_t(random.uniform(0, double(count))); };
    int cut = 0, met = 0;
    for (int trial = 0; trial < 30000; ++trial) {
        std::vector<Point> ring(std::size_t(5 + below(5)));
        const auto width = 3 + below(5);
        for (auto& x : ring) x = {below(width), below(width)};
        const std::size_t n = ring.size();
        bool neighbours = false, meets = false;
        std::int64_t area = 0;
        for (std::size_t i = 0; i < n; ++i) {
            neighbours |= ring[i] == ring[(i + 1) % n];
            area += side(ring[0], ring[i], ring[(i + 1) % n]);
            for (std::size_t j = i + 1; j < n; ++j) meets |= edges_meet(ring, i, j);
        }
        if (neighbours) continue;  // they are joined: see below
        const auto polygon = placed(ring, {0.5, -3, 1024}, {0, 0.25, 0}, {0, 0, 0.25});
        const auto outcome = cutter.cut(polygon);
        CAPTURE(trial);
        REQUIRE(outcome == (area == 0 ? Outcome::no_area : meets ? Outcome::meets_itself : Outcome::cut));
        if (outcome == Outcome::cut) REQUIRE(fault_of(polygon, cutter).empty());
        if (outcome == Outcome::meets_itself) REQUIRE(edges_meet(ring, cutter.meeting()[0], cutter.meeting()[2]));
        cut += outcome == Outcome::cut;
        met += outcome == Outcome::meets_itself;
    }
    CHECK(cut > 1000);
    CHECK(met > 15000);
}

TEST_CASE("Quadrangles: the shorter diagonal if both lie inside; bow ties and lines are refused", "[data]") {
    PolygonCutter cutter;
    const auto of = [&](const Polygon& polygon) {
        const auto outcome = cutter.cut(polygon);
        if (outcome == Outcome::cut) CHECK(fault_of(polygon, cutter).empty());
        return outcome;
    };
    CHECK(of({{0, 0, 0}, {3, 0, 0}, {2, 1, 0}, {0, 1, 0}}) == Outcome::cut);
    CHECK(cutter.triangles()[0] == std::array<std::uint32_t, 3>{0, 1, 2});
    CHECK(of({{3, 0, 0}, {2, 1, 0}, {0, 1, 0}, {0, 0, 0}}) == Outcome::cut);
    CHECK(cutter.triangles()[0] == std::array<std::uint32_t, 3>{0, 1, 3});
    // A corner in the middle of an edge: the diagonal that leaves no triangle without area.
    CHECK(of({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 9, 0}}) == Outcome::cut);
    CHECK(cutter.triangles()[0] == std::array<std::uint32_t, 3>{0, 1, 3});
    // A pole of a sphere: two corners at one place but for a rounding error.
    CHECK(of({{0, 0, 0}, {1, 0, 0}, {0.5, 1, 0}, {0.5 + 1e-16, 1 - 1e-16, 1e-16}}) == Outcome::cut);
    CHECK(of({{0, 0, 0}, {1, 0, 0}, {0.5 - 1e-16, 1 - 2e-16, 0}, {0.5 + 1e-16, 1, 0}}) == Outcome::cut);
    // A saddle: the corners lie in no plane.
    CHECK(cutter.cut(Polygon{{0, 0, 0}, {1, 0, 1}, {1, 1, 0}, {0, 1, 1}}) == Outcome::cut);

    CHECK(of({{0, 0, 0}, {1, 1, 0}, {2, 0, 0}, {0, 0.5, 0}}) == Outcome::meets_itself);
    CHECK(cutter.meeting() == std::array<std::uint32_t, 4>{0, 1, 2, 3});
    CHECK(of({{0, 0.5, 0}, {0, 0, 0}, {1, 1, 0}, {2, 0, 0}}) == Outcome::meets_itself);
    CHECK(cutter.meeting() == std::array<std::uint32_t, 4>{1, 2, 3, 0});
    CHECK(of({{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}}) == Outcome::no_area);
    CHECK(of({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}}) == Outcome::no_area);
    CHECK(of({{1, 2, 3}, {1, 2, 3}, {1, 2, 3}, {1, 2, 3}}) == Outcome::no_area);
}

TEST_CASE("Corners at one place are joined by triangles without area, at both ends of the list as well", "[data]") {
    PolygonCutter cutter;
    for (const double apart : {0.0, 1e-15}) {
        Polygon polygon;
        for (const auto& [x, y] : ell)
            for (int k = 0; k < 3; ++k) polygon.push_back({double(x) + k * apart, double(y) - k * apart, 1});
        for (std::size_t turn = 0; turn < polygon.size(); ++turn) {
            CAPTURE(apart, turn);
            REQUIRE(cutter.cut(polygon) == Outcome::cut);
            REQUIRE(fault_of(polygon, cutter).empty());
            std::rotate(polygon.begin(), polygon.begin() + 1, polygon.end());
        }
    }
    CHECK(cutter.cut(Polygon{{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 1, 0}}) == Outcome::cut);
    CHECK(cutter.cut(Polygon{{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {0, 0, 0}, {0, 0, 0}}) == Outcome::no_area);
    CHECK(cutter.cut(Polygon{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {1.5, 0, 0}}) == Outcome::no_area);
}

TEST_CASE("Ten times as many corners take no more than some ten times as long", "[data]") {
    const auto star = [](int count) {  // every other corner is concave
        Polygon polygon;
        Random random(3);
        for (int i = 0; i < count; ++i) {
            const double angle = 2 * std::numbers::pi * i / count, radius = 1 + random.uniform(0, 0.5);
            polygon.push_back({radius * std::cos(angle), radius * std::sin(angle), 0});
        }
        return polygon;
    };
    PolygonCutter cutter;
    const auto seconds = [&](int count) {
        const Polygon polygon = star(count);
        double least = std::numeric_limits<double>::infinity();
        for (int k = 0; k < 3; ++k) {
            const auto begin = std::clock();
            REQUIRE(cutter.cut(polygon) == Outcome::cut);
            least = std::min(least, double(std::clock() - begin) / CLOCKS_PER_SEC);
        }
        REQUIRE(fault_of(polygon, cutter).empty());
        return least;
    };
    CHECK(seconds(30000) < 40 * seconds(3000));  // n log n: 12.9; n²: 100
}

}  // namespace polygon_tests
