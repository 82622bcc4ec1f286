/// \file Shapes from numbers, as far as numbers by hand tell: how far they reach, what is beyond, and caps.
#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/boundary/collider.hpp>
#include <firn/boundary/distance_grid.hpp>
#include <firn/boundary/shapes.hpp>

using namespace firn;
using test_support::Random;

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

TEST_CASE("where distances go on beyond the grid, reaches() misses no node", "[boundary][shape]") {
    // Values at the end of the grid that differ: at the node of a block's middle, the distance is up to √2 times that
    // at the block's node nearest to the solid, plus their distance. Some solids reach the end of the grid.
    Random random(1);
    const auto check = [&](const auto& shape, double size, int& touched, int& skipped) {
        Collider<std::decay_t<decltype(shape)>> solid{.shape = shape, .contact = Contact::stick};
        solid.rotation = rotor(radians(random.uniform(0, 6)));
        const Vec<double, 2> v{1, -2};
        for (int trial = 0; trial < 300; ++trial) {
            solid.thickness = random.uniform(0, 2.5 * size);
            const Vec<double, 2> middle = random.vector<2>(-8, 8) * size, half = random.vector<2>(0, 2) * size;
            const bool reaches = solid.reaches(middle - half, middle + half);
            skipped += !reaches;
            for (int i = 0; i < 36; ++i) {
                const Vec<double, 2> x =
                    middle + Vec<double, 2>{half[0] * (i % 6 - 2.5) / 2.5, half[1] * (i / 6 - 2.5) / 2.5};
                if (solid.velocity(x, v) == v) continue;
                ++touched;
                REQUIRE(reaches);
            }
        }
    };
    int touched = 0, skipped = 0, touched_complement = 0, skipped_complement = 0;
    for (int trial = 0; trial < 40; ++trial) {
        // The distance from a disc somewhere, in the grid or across its end.
        const Vec<double, 2> centre = random.vector<2>(-3, 3);
        const double radius = random.uniform(0.5, 3);
        DistanceNumbers<double, 2> numbers{{-3, -2}, 0.5, {13, 9}, {}};
        for (int i = 0; i < 13; ++i)
            for (int j = 0; j < 9; ++j)
                numbers.values.push_back(norm(Vec<double, 2>{-3 + 0.5 * i, -2 + 0.5 * j} - centre) - radius);
        const Grid shape{std::make_shared<const DistanceNumbers<double, 2>>(std::move(numbers))};
        check(shape, 1, touched, skipped);
        check(Complement<Grid>{shape}, 0.3, touched_complement, skipped_complement);
    }
    CHECK(touched > 10000);
    CHECK(skipped > 3000);
    CHECK(touched_complement > 10000);
    CHECK(skipped_complement > 100);
}

TEST_CASE("where a solid reaches the end of its grid, reaches() misses no node beyond", "[boundary][shape]") {
    // Below y = 0. Beyond x = 1, its distance is y + x − 1 for y < 0: it changes by √2 times the way along (1, 1).
    DistanceNumbers<double, 2> numbers{{-1, -2}, 0.05, {41, 81}, {}};
    for (int i = 0; i < 41; ++i)
        for (int j = 0; j < 81; ++j) numbers.values.push_back(-2 + 0.05 * j);
    const Grid shape{std::make_shared<const DistanceNumbers<double, 2>>(std::move(numbers))};
    const auto check = [](const auto& solid, const Vec<double, 2>& node, const Vec<double, 2>& opposite) {
        REQUIRE(solid.velocity(node, {1, -2}) == Vec<double, 2>::zero());
        Vec<double, 2> lower = node, upper = node;
        for (int a = 0; a < 2; ++a)
            lower[a] = std::min(lower[a], opposite[a]), upper[a] = std::max(upper[a], opposite[a]);
        CHECK(solid.reaches(lower, upper));
    };
    check(Collider<Grid>{.shape = shape, .contact = Contact::stick, .thickness = 0.01}, {1.5, -0.5}, {2.9, 0.9});
    Grid moved = shape;  // the middle between the two is its origin
    moved.origin = {2.2, 0.2};
    check(Collider<Grid>{.shape = moved, .contact = Contact::stick, .thickness = 0.01}, {-0.7, -0.7}, {0.7, 0.7});
    check(Collider<Complement<Grid>>{.shape = {shape}, .contact = Contact::stick, .thickness = 0.01}, {1.5, -0.5},
          {0.5, -1.5});
}

TEST_CASE("beyond the grid, the distance and the normal are those of the surface next to it", "[boundary][shape]") {
    // Of a disc, they are nearly right; the sum of two ways would be 3.09 at (4, 3), and the normal (1, 0) at (4, 1).
    DistanceNumbers<double, 2> numbers{{-2, -2}, 0.0625, {65, 65}, {}};
    for (int i = 0; i < 65; ++i)
        for (int j = 0; j < 65; ++j) numbers.values.push_back(std::hypot(-2 + 0.0625 * i, -2 + 0.0625 * j) - 1);
    const Grid shape{std::make_shared<const DistanceNumbers<double, 2>>(std::move(numbers))};
    const auto near = [&](const Vec<double, 2>& x, double error) {
        CAPTURE(x[0], x[1]);
        CHECK(std::abs(shape.signed_distance(x) - (norm(x) - 1)) < error * norm(x));
        CHECK(norm(shape.normal(x) - x * (1 / norm(x))) < 4 * error);
    };
    near({2.1, 1}, 0.005);
    near({2.5, 2.3}, 0.005);
    near({4, 1}, 0.02);
    near({4, 3}, 0.02);
    near({-1, -8}, 0.02);
    // A solid that reaches the end of the grid ends there.
    const Grid all = disc({-0.1, -0.1}, {2, 2});
    CHECK(all.signed_distance({-0.6, 0}) == Approx(all.signed_distance({-0.1, 0}) + 0.5));
    CHECK(all.normal({-0.6, 0})[0] == Approx(-1));
}

TEST_CASE("a grid of distances that are capped says so; a cap that is no distance is refused", "[boundary][shape]") {
    DistanceNumbers<double, 2> numbers = *disc({-1, -1}, {3, 3}).numbers;
    const auto with = [&](double cap) {
        numbers.exact_up_to = cap;
        return Collider<Grid>{.shape = {std::make_shared<const DistanceNumbers<double, 2>>(numbers)}};
    };
    CHECK(Collider<Grid>{.shape = disc({-1, -1}, {3, 3})}.exact_up_to() == std::numeric_limits<double>::infinity());
    CHECK(with(0.25).exact_up_to() == 0.25);
    CHECK(Collider<Complement<Grid>>{.shape = {with(0.25).shape}}.exact_up_to() == 0.25);
    for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
        CHECK_THROWS_AS(with(bad).check(), parameter_error);
    CHECK_THROWS_AS(Collider<Grid>{}.check(), parameter_error);  // no numbers
    CHECK_NOTHROW(Collider<Grid>{}.on_grid(1));
}

}  // namespace distance_grid_tests
