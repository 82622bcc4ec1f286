#include "support/catch.hpp"
#include "support/effort.hpp"
#include <firn/math/jacobi.hpp>

#include <cmath>
#include <limits>
#include <random>

using firn::Mat;
using firn::Vec;

TEMPLATE_TEST_CASE("Jacobi: U is a rotation, the values are sorted and their product is det F", "", float, double) {
    using T = TestType;
    const T epsilon = std::numeric_limits<T>::epsilon();
    std::mt19937 engine(5);
    for (int k = 0; k < test_support::fewer_if_quick(20000, 4000); ++k) {
        Mat<T, 3> F{};
        for (T& entry : F.m) entry = T(double(engine()) * 0x1p-31 - 1);
        const auto f = firn::left_singular(F);
        REQUIRE(f.values[0] >= f.values[1]);
        REQUIRE(f.values[1] >= std::abs(f.values[2]) * (1 - 4 * epsilon));
        const Mat<T, 3> unit = f.vectors * transpose(f.vectors) - Mat<T, 3>::identity();
        REQUIRE(std::sqrt(squared_norm(unit)) <= 10 * epsilon);
        REQUIRE(determinant(f.vectors) > T(0.9));
        const T product = f.values[0] * f.values[1] * f.values[2] * f.scale * f.scale * f.scale;
        const T size = std::sqrt(squared_norm(F));
        REQUIRE(std::abs(product - determinant(F)) <= 20 * epsilon * size * size * size);
    }
}

TEST_CASE("Jacobi: hand-made singular values come back") {
    // F = diag(2, −3, 0.5): the smallest carries the sign of det F < 0.
    const auto f = firn::left_singular(Mat<double, 3>::rows(2, 0, 0, 0, -3, 0, 0, 0, 0.5));
    CHECK(f.scale == 3.0);
    CHECK(f.values[0] * f.scale == Approx(3));
    CHECK(f.values[1] * f.scale == Approx(2));
    CHECK(f.values[2] * f.scale == Approx(-0.5));
    CHECK(std::abs(f.vectors(1, 0)) == Approx(1));
    CHECK(std::abs(f.vectors(2, 2)) == Approx(1));
}

TEST_CASE("Jacobi: the sign of det F survives where the determinant itself is lost in rounding") {
    // Two singular values of 1e-6 in float: det F = ±1e-12 is 1e5 times less than ε ‖F‖³.
    const float c = 0.6f, s = 0.8f;
    for (const float sign : {1.0f, -1.0f}) {
        const Mat<float, 3> left = Mat<float, 3>::rows(c, -s, 0, s, c, 0, 0, 0, 1);
        Mat<float, 3> F = Mat<float, 3>::rows(1, 0, 0, 0, 1e-6, 0, 0, 0, sign * 1e-6f);
        F = left * F;  // columns stay exact to a rounding each, and far from each other in size
        const auto f = firn::left_singular(F);
        CHECK(f.values[1] * f.scale == Approx(1e-6f).epsilon(1e-3).margin(0));
        CHECK(f.values[2] * f.scale == Approx(sign * 1e-6f).epsilon(1e-3).margin(0));
    }
}

TEST_CASE("The cross product is right-handed") {
    const Vec<double, 3> x{{1, 0, 0}}, y{{0, 1, 0}}, z{{0, 0, 1}};
    CHECK(firn::cross(x, y) == z);
    CHECK(firn::cross(y, z) == x);
    CHECK(firn::cross(z, x) == y);
}
