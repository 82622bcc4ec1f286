/// \file Shapes from numbers, as far as numbers by hand tell: how far they reach.
#include "support/catch.hpp"
#include <firn/boundary/collider.hpp>
#include <firn/boundary/distance_grid.hpp>
#include <firn/boundary/shapes.hpp>

using namespace firn;

namespace distance_grid_tests {
namespace {

using Grid = DistanceGrid<double, 2, double>;

/// Of a disc of half a metre about the origin, at nodes a metre apart, times `sign`.
Grid disc(const Vec<double, 2>& lower, const std::array<int, 2>& nodes, double sign = 1) {
    DistanceNumbers<double, 2> numbers{lower, 1, nodes, {}};
    for (int i = 0; i < nodes[0]; ++i)
        for (int j = 0; j < nodes[1]; ++j)
            numbers.values.push_back(sign * (std::hypot(lower[0] + i, lower[1] + j) - 0.5));
    return {std::make_shared<const DistanceNumbers<double, 2>>(std::move(numbers))};
}

}  // namespace

TEST_CASE("a grid of distances extends to its farthest corner, wherever the origin lies in it", "[boundary][shape]") {
    CHECK(disc({-1, -2}, {6, 4}).extent() == Approx(std::hypot(4, 2)));  // to (4, 1)
    CHECK(disc({-5, -1}, {7, 5}).extent() == Approx(std::hypot(5, 3)));  // to (1, 3)
}

TEST_CASE("where the interpolant is steeper than a distance, reaches() misses no node all the same",
          "[boundary][shape]") {
    // On the diagonal of a cell at the origin it is 2t − (2 − √2) t² − ½: −0.003 at t = 0.27, but 0.49 at 0.6, though
    // the two are only 0.47 apart.
    const Vec<double, 2> corner{0.27, 0.27}, opposite{0.93, 0.93}, v{1, -2};
    const auto check = [&](const auto& shape) {
        const Collider<std::decay_t<decltype(shape)>> solid{.shape = shape, .contact = Contact::stick};
        CHECK(solid.velocity(corner, v) == Vec<double, 2>::zero());
        CHECK(solid.reaches(corner, opposite));
    };
    check(disc({-2, -2}, {5, 5}));
    check(Complement<Grid>{disc({-2, -2}, {5, 5}, -1)});
}

}  // namespace distance_grid_tests
