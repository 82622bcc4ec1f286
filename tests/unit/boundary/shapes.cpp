/// \file Signed distances and normals of shapes, against what is known without them: points on the surface, and which
/// points are inside. See surfaces.hpp.
#include "support/catch.hpp"
#include <firn/core/pack.hpp>

#include "surfaces.hpp"

using namespace firn;
using namespace surfaces;

#define EVERY_SHAPE                                                                                      \
    Ball<2>, Ball<3>, Cuboid<2>, Cuboid<3>, Rounded<2>, Rounded<3>, Slope<2>, Slope<3>, Hollow<Ball<3>>, \
        Hollow<Cuboid<2>>, Hollow<Torus<3>>, Torus<2>, Torus<3>

TEMPLATE_TEST_CASE("the distance is that of the nearest point of the surface, negative inside", "[boundary][shape]",
                   EVERY_SHAPE) {
    constexpr int D = shape_facts<typename TestType::Shape>::dimension;
    const auto shape = TestType::shape();
    Random random(40);
    std::vector<Vec<double, D>> surface;
    for (int i = 0; i < 4000; ++i) surface.push_back(TestType::point(random));
    for (const auto& p : surface) REQUIRE(std::abs(shape.signed_distance(p)) <= 1e-14);
    int inside = 0;
    for (int trial = 0; trial < 300; ++trial) {
        const Vec<double, D> x =
            trial % 2 == 0 ? random.vector<D>(-0.7, 0.7) : TestType::point(random) + random.vector<D>(-0.1, 0.1);
        const double distance = shape.signed_distance(x);
        const Vec<double, D> normal = normal_of(shape, x), foot = x - normal * distance;
        CAPTURE(trial, distance);
        CHECK((distance < 0) == TestType::is_inside(x));
        inside += distance < 0;
        // No point of the surface is nearer, and there is one at the distance, against the normal.
        double nearest = 10;
        for (const auto& p : surface) nearest = std::min(nearest, norm(p - x));
        CHECK(nearest >= std::abs(distance) - 1e-14);
        CHECK(TestType::is_inside(foot - normal * 1e-9));
        CHECK_FALSE(TestType::is_inside(foot + normal * 1e-9));
    }
    CHECK(inside > 10);
    CHECK(inside < 290);
}

TEMPLATE_TEST_CASE("the normal is of unit length and the gradient of the distance", "[boundary][shape]", EVERY_SHAPE) {
    constexpr int D = shape_facts<typename TestType::Shape>::dimension;
    const auto shape = TestType::shape();
    Random random(41);
    int compared = 0;
    for (int trial = 0; trial < 300; ++trial) {
        const Vec<double, D> x = random.vector<D>(-0.7, 0.7), normal = normal_of(shape, x);
        Vec<double, D> gradient{};
        for (int a = 0; a < D; ++a) {
            Vec<double, D> step = Vec<double, D>::zero();
            step[a] = 1e-6;
            gradient[a] = (shape.signed_distance(x + step) - shape.signed_distance(x - step)) / 2e-6;
        }
        CAPTURE(trial);
        CHECK(std::abs(norm(normal) - 1) <= 1e-14);
        if (std::abs(norm(gradient) - 1) > 1e-6) continue;  // at a kink, where two points are the nearest
        CHECK(norm(gradient - normal) <= 1e-5);
        ++compared;
    }
    CHECK(compared > 290);
}

TEMPLATE_TEST_CASE("the normal of a distance alone, by dual numbers, is that of the formula", "[boundary][shape]",
                   Ball<2>, Ball<3>, Cuboid<2>, Cuboid<3>, Rounded<2>, Rounded<3>, Slope<3>) {
    using Shape = typename TestType::Shape;
    constexpr int D = shape_facts<Shape>::dimension;
    Random random(42);
    const auto formula = TestType::shape();
    for (int trial = 0; trial < 100; ++trial) {
        const Vec<double, D> x = random.vector<D>(-0.7, 0.7);
        Vec<double, D> gradient{};
        for (int a = 0; a < D; ++a) {
            Vec<dual<double>, D> along{};
            for (int i = 0; i < D; ++i) along[i] = {x[i], i == a ? 1.0 : 0.0};
            gradient[a] = lift<dual<double>>(formula).signed_distance(along).derivative;
        }
        CAPTURE(trial);
        CHECK(norm(gradient - formula.normal(x)) <= 1e-12);
    }
}

TEMPLATE_TEST_CASE_SIG("where the nearest point is not unique there still is a unit normal", "[boundary][shape]",
                       ((int D), D), 2, 3) {
    const Vec<float, D> centre = Vec<float, D>::zero();
    CHECK(std::abs(norm(Sphere<float, D>{}.normal(centre)) - 1) <= 1e-6F);
    CHECK(std::abs(norm(Capsule<float, D>{}.normal(centre)) - 1) <= 1e-6F);
    CHECK(std::abs(norm(Box<float, D>{}.normal(centre)) - 1) <= 1e-6F);
    CHECK(std::abs(norm(normal_of(Ring<float, D>{}, centre)) - 1) <= 1e-6F);  // 0/0 in its derivative
    CHECK(Sphere<float, D>{}.normal(centre)[1] == 1);
    CHECK(Capsule<float, D>{}.normal(centre)[1] == 1);
}

TEST_CASE("shapes that cannot be are refused", "[boundary][shape][error]") {
    const double not_a_number = std::numeric_limits<double>::quiet_NaN(),
                 infinity = std::numeric_limits<double>::infinity();
    for (const double length : {0.0, -0.1, not_a_number, infinity}) {
        CAPTURE(length);
        CHECK_THROWS_AS((Sphere<double, 3>{length}.check()), parameter_error);
        CHECK_THROWS_AS((Box<double, 2>{{0.1, length}}.check()), parameter_error);
        CHECK_THROWS_AS((Capsule<double, 3>{length, 0.1}.check()), parameter_error);
        CHECK_THROWS_AS((Capsule<double, 3>{0.1, length}.check()), parameter_error);
        CHECK_THROWS_AS((Complement<Sphere<double, 3>>{{length}}.check()), parameter_error);
        CHECK_THROWS_AS((HalfSpace<double, 2>{{length, 0.1}}.check()), parameter_error);
    }
    CHECK_NOTHROW((HalfSpace<double, 2>{{0.6, 0.8}}.check()));
    CHECK_NOTHROW((HalfSpace<float, 3>{{0.48F, 0.64F, 0.6F}}.check()));
    CHECK_THROWS_AS((HalfSpace<double, 2>{{0.6, 0.81}}.check()), parameter_error);
}
