/// \file One node between P2G and G2P, and the offsets that sums are made with.
#include "support/catch.hpp"
#include <firn/boundary/walls.hpp>
#include <firn/kernel/cubic_b_spline.hpp>
#include <firn/kernel/linear.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/stage/grid_update.hpp>
#include <firn/stage/offset.hpp>
#include <firn/stage/time_step.hpp>

using namespace firn;

namespace {
using V = Vec<double, 2>;
const V gravity{0.0, -9.81};
}  // namespace

TEST_CASE("a node's velocity is momentum over mass, accelerated for dt", "[stage]") {
    const V v = node_velocity(V{3.0, -1.0}, 2.0, V{0.5, 0.5}, gravity, 0.1, NoBoundary{});
    CHECK(v[0] == Approx(1.5).epsilon(1e-15));
    CHECK(v[1] == Approx(-0.5 - 0.981).epsilon(1e-15));
}

TEST_CASE("a node without mass has no velocity, whatever its momentum and the forces", "[stage]") {
    for (const V& momentum : {V{0.0, 0.0}, V{1.0, 1.0}})
        CHECK(node_velocity(momentum, 0.0, V{0.5, 0.5}, gravity, 0.1, NoBoundary{}) == V::zero());
}

TEST_CASE("a node with the least mass keeps its velocity", "[stage]") {
    // The smallest normal float: 1/m is finite still, and m v / m is v.
    const float mass = std::numeric_limits<float>::min();
    const Vec<float, 2> v =
        node_velocity(Vec<float, 2>{2 * mass, 0.0f}, mass, {0.5f, 0.5f}, {0.0f, 0.0f}, 0.1f, NoBoundary{});
    CHECK(v[0] == Approx(2));
}

TEST_CASE("walls act after the forces: gravity does not pull a resting node through the floor", "[stage]") {
    const auto walls = Walls<double, 2>::all({0.0, 0.0}, {1.0, 1.0}, {Contact::separate, 0});
    const V v = node_velocity(V{1.0, 0.0}, 1.0, V{0.5, 0.0}, gravity, 0.1, walls);
    CHECK(v == V{1.0, 0.0});
    CHECK(node_velocity(V{1.0, 0.0}, 1.0, V{0.5, 0.5}, gravity, 0.1, walls)[1] < 0);
}

TEST_CASE("a node whose mass has no finite inverse has no velocity", "[stage]") {
    using F = Vec<float, 2>;
    const F v = node_velocity(F{0.0F, 1e-42F}, 1e-42F, F{0.5F, 0.5F}, F{0.0F, -9.81F}, 0.1F, NoBoundary{});
    CHECK(v[0] == 0);
    CHECK(v[1] == 0);
    const float least = std::numeric_limits<float>::min();
    CHECK(node_velocity(F{0.0F, least}, least, F{0.5F, 0.5F}, F{0.0F, 0.0F}, 0.1F, NoBoundary{})[1] == 1);
}

TEST_CASE("plus_times is a + b o for constant offsets and for numbers", "[stage]") {
    const V a{1.0, 2.0}, b{0.5, -3.0};
    CHECK(plus_times(a, b, std::integral_constant<int, -1>{}) == a - b);
    CHECK(plus_times(a, b, std::integral_constant<int, 0>{}) == a);
    CHECK(plus_times(a, b, std::integral_constant<int, 1>{}) == a + b);
    CHECK(plus_times(a, b, std::integral_constant<int, 2>{}) == a + b * 2.0);
    CHECK(plus_times(a, b, -1.0) == a - b);
    CHECK(times_minus(b, 0.5, a) == b * 0.5 - a);
}

TEST_CASE("the time step bound is the safety factor times h over the fastest signal", "[stage]") {
    CHECK(stable_time_step<QuadraticBSpline>(0.1, 20) == 0.6 * 0.005);
    CHECK(stable_time_step<CubicBSpline>(0.1, 20) == Approx(0.6 * 0.005 * 1.1788).epsilon(1e-4));
    CHECK(stable_time_step<Linear>(0.1, 20) == Approx(0.6 * 0.005 * 0.5 / 1.63299).epsilon(1e-5));
}
