/// \file firn/data/point_spacing.hpp: the spacing of clouds of points on lattices, jittered and at random.
#include "support/catch.hpp"
#include "support/message.hpp"
#include "support/not_finite.hpp"
#include <firn/data/point_spacing.hpp>
#include <firn/data/sampling.hpp>

using namespace firn;
using test_support::holds;
using test_support::message;

TEST_CASE("a lattice of cubes has its spacing", "[data]") {
    for (const double spacing : {1.0 / 30, 1.0 / 7, 0.5}) {
        const auto ball = sample_sphere<3>({1, 2, 3}, 1, {.spacing = spacing});
        CHECK(point_spacing<3>(ball.positions) == Approx(spacing).epsilon(1e-9));
        const auto disk = sample_sphere<2>({1, 2}, 1, {.spacing = spacing});
        CHECK(point_spacing<2>(disk.positions) == Approx(spacing).epsilon(1e-9));
    }
}

TEST_CASE("other clouds have the spacing of as many cubes", "[data]") {
    for (const auto pattern : {Pattern::jittered, Pattern::poisson_disk}) {
        const auto ball = sample_sphere<3>({}, 1, {.spacing = 0.1, .pattern = pattern, .jitter = 0.5});
        CHECK(point_spacing<3>(ball.positions) == Approx(std::cbrt(ball.volume)).epsilon(0.03));
    }
    // Packed spheres: cubes with points on their faces, too, four points in each.
    std::vector<Vec<double, 3>> packed;
    for (int i = 0; i < 11 * 11 * 11; ++i)
        for (const Vec<double, 3>& x : {Vec<double, 3>{0, 0, 0}, Vec<double, 3>{0.5, 0.5, 0},
                                        Vec<double, 3>{0.5, 0, 0.5}, Vec<double, 3>{0, 0.5, 0.5}})
            packed.push_back(x + Vec<double, 3>{double(i % 11), double(i / 11 % 11), double(i / 121)});
    CHECK(point_spacing<3>(packed) == Approx(std::cbrt(0.25)).epsilon(0.03));
}

TEST_CASE("clouds without a spacing are refused", "[data]") {
    using Points = std::vector<Vec<double, 3>>;
    const auto said = [](const Points& points) {
        return message<parameter_error>([&] { (void)point_spacing<3>(points); });
    };
    CHECK(holds(said(Points(7)), "A cloud of 7 points has no spacing; give 8 points or more"));
    CHECK(holds(said(Points(9)), "Half of the cloud's 9 points or more lie on other points"));
    Points broken = sample_box<3>({0, 0, 0}, {1, 1, 1}, {.spacing = 0.25}).positions;
    broken[5][1] = test_support::not_a_number;
    CHECK(holds(said(broken), "Point 5 (from 0) of the cloud is (0.375, nan, 0.125)"));
}
