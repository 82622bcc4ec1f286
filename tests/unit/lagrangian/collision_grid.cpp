/// \file What the collision grid promises: nobody within reach is missed, wherever points lie; the same order for any
/// number of threads; memory in proportion to the points; points that are nowhere refused.
#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/lagrangian/collision_grid.hpp>

#include <cmath>
#include <set>

using namespace firn;
using test_support::Random;

namespace collision_grid_tests {

namespace {

using Pair = std::pair<std::uint32_t, std::uint32_t>;

template <class S, int D>
PointMasses<S, D> points_at(const std::vector<Vec<double, D>>& positions, double radius) {
    PointMasses<S, D> points;
    for (const auto& x : positions) points.add({.position = x, .radius = radius});
    return points;
}

/// All pairs that the ranges hold and whose distance is at most `reach`, from both sides.
template <class S, int D>
std::multiset<Pair> found(const CollisionGrid<S, D>& grid, double reach) {
    std::multiset<Pair> pairs;
    typename CollisionGrid<S, D>::Neighbours neighbours(grid);
    for (std::size_t k = 0; k < grid.size(); ++k)
        for (const firn::detail::SortedRange& range : neighbours.of(k))
            for (std::size_t j = range.begin; j < range.end; ++j) {
                const auto along = grid.position(j) - grid.position(k);
                double square = 0;  // by the rounded coordinates
                for (int a = 0; a < D; ++a) {
                    const double by = double(grid.coordinates(a)[j]) - double(grid.coordinates(a)[k]);
                    square += by * by;
                }
                REQUIRE(std::abs(std::sqrt(square) - norm(along)) <= grid.error_of_distance());
                if (dot(along, along) <= reach * reach) pairs.insert({grid.place(k), grid.place(j)});
            }
    return pairs;
}

template <class S, int D>
std::multiset<Pair> by_definition(const PointMasses<S, D>& points, double reach) {
    std::multiset<Pair> pairs;
    for (std::uint32_t i = 0; i < points.size(); ++i)
        for (std::uint32_t j = 0; j < points.size(); ++j) {
            const auto along = points.position[j] - points.position[i];
            if (points.radius[i] > 0 && points.radius[j] > 0 && dot(along, along) <= reach * reach)
                pairs.insert({i, j});
        }
    return pairs;
}

template <int D>
std::vector<Vec<double, D>> cloud(std::size_t n, double size, std::uint64_t seed, const Vec<double, D>& at = {}) {
    Random random(seed);
    std::vector<Vec<double, D>> positions;
    for (std::size_t i = 0; i < n; ++i) positions.push_back(at + random.vector<D>(0, size));
    return positions;
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("collision grid: finds what a search of all pairs finds, each neighbour once", "[lagrangian]",
                       ((class S, int D), S, D), (float, 2), (float, 3), (double, 2), (double, 3)) {
    const double r = 0.04, reach = 2 * double(S(r));
    std::vector<Vec<double, D>> positions = cloud<D>(600, 1, 1);
    SECTION("in one cloud") {}
    SECTION("in clouds far apart, along a diagonal") {
        for (const double far : {1e3, -2e4}) {
            const auto more = cloud<D>(200, 0.5, 2, Vec<double, D>::filled(far));
            positions.insert(positions.end(), more.begin(), more.end());
        }
    }
    SECTION("with some so far out that no cell can be numbered") {
        for (const double far : {1e12, 1e30, -1e30}) {
            positions.push_back(Vec<double, D>::filled(far));
            positions.push_back(Vec<double, D>::filled(far));
        }
    }
    SECTION("in rows of cells that are full to their end: none is taken for the next row's") {
        positions.clear();
        for (int i = 0; i < 12; ++i)
            for (int j = 0; j < 12; ++j) {
                Vec<double, D> x{};
                x[0] = i * reach;
                x[D - 1] = j * reach;
                positions.push_back(x);
            }
    }
    PointMasses<S, D> points = points_at<S, D>(positions, r);
    for (std::size_t i = 0; i < points.size(); i += 7) points.radius[i] = 0;  // in no pair
    CollisionGrid<S, D> grid;
    grid.build(points);
    CHECK(found(grid, reach) == by_definition(points, reach));
}

TEST_CASE("collision grid: a reach longer than the diameters finds farther neighbours", "[lagrangian]") {
    const auto points = points_at<double, 2>(cloud<2>(300, 1, 3), 0.01);
    CollisionGrid<double, 2> grid;
    grid.build(points, 1, 0.1);
    CHECK(found(grid, 0.1) == by_definition(points, 0.1));
    CHECK_THROWS_AS(grid.build(points, 1, -1.0), parameter_error);
    CHECK_THROWS_AS(grid.build(points, 1, std::nan("")), parameter_error);
}

TEST_CASE("collision grid: the order is that of cells, then of places, for any number of threads", "[lagrangian]") {
    for (const double size : {1.0, 1000.0}) {  // with a table and without
        const auto points = points_at<float, 3>(cloud<3>(20000, size, 4), 0.02);
        std::vector<std::uint32_t> first;
        for (const int threads : {1, 2, 3, 4, 7}) {
            CollisionGrid<float, 3> grid;
            grid.build(points, threads);
            std::vector<std::uint32_t> order;
            for (std::size_t k = 0; k < grid.size(); ++k) order.push_back(grid.place(k));
            if (first.empty()) first = order;
            REQUIRE(order == first);
        }
        const auto cell = [&](std::uint32_t i, int a) {
            double lower = 1e9;
            for (const auto& x : points.position) lower = std::min(lower, x[a]);
            return std::floor((points.position[i][a] - lower) / (2 * double(0.02f) * (1 + 1e-6)));
        };
        for (const std::size_t k : {std::size_t(100), first.size() / 2, first.size() - 2}) {
            const std::uint32_t i = first[k], j = first[k + 1];
            CHECK(std::tuple(cell(i, 2), cell(i, 1), cell(i, 0), i) <
                  std::tuple(cell(j, 2), cell(j, 1), cell(j, 0), j));
        }
    }
}

TEST_CASE("collision grid: memory is in proportion to the points, however large the box", "[lagrangian]") {
    const std::size_t n = 10000;
    for (const double size : {0.1, 10.0, 1e4, 1e12}) {
        CollisionGrid<float, 3> grid;
        grid.build(points_at<float, 3>(cloud<3>(n, size, 5), 0.01));
        CHECK(grid.bytes() < 100 * n);
    }
}

TEST_CASE("collision grid: points that are nowhere are refused by id and position", "[lagrangian]") {
    PointMasses<double, 2> points = points_at<double, 2>(cloud<2>(9000, 1, 6), 0.1);
    points.remove_if([](std::size_t i) { return i < 10; });  // ids are no longer places
    CollisionGrid<double, 2> grid;
    const auto complaint = [&] {
        try {
            grid.build(points, 2);
        } catch (const particle_error& e) {
            return std::string(e.what());
        }
        return std::string("none");
    };
    CHECK(complaint() == "none");
    points.position[8000] = {{0.25, std::nan("")}};
    points.radius[8500] = -1;
    CHECK(complaint().find("2 of 8990 points") != std::string::npos);
    CHECK(complaint().find("point 8010 at (0.25, nan)") != std::string::npos);
    points.position[20] = {{std::numeric_limits<double>::infinity(), 1}};
    CHECK(complaint().find("3 of 8990 points cannot collide; the first is point 30 at (inf, 1)") != std::string::npos);
}

TEST_CASE("collision grid: no points, one point, all in one place", "[lagrangian]") {
    CollisionGrid<double, 3> grid;
    PointMasses<double, 3> points;
    grid.build(points);
    CHECK(grid.size() == 0);
    points.add({.radius = 0});
    grid.build(points);
    CHECK(grid.size() == 0);
    for (int i = 0; i < 5; ++i) points.add({.radius = 1e-300});
    grid.build(points);
    CHECK(found(grid, 0).size() == 25);
}

}  // namespace collision_grid_tests
