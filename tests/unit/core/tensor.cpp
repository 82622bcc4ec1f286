/// \file Vec and Mat against Eigen, and their memory layout, which is Eigen's.
#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/core/eigen.hpp>

using namespace firn;
using test_support::Random;

TEMPLATE_TEST_CASE_SIG("operations are those of Eigen, 2D and 3D", "[core][tensor]", ((int D), D), 2, 3) {
    Random random(5);
    for (int trial = 0; trial < 20; ++trial) {
        const Mat<double, D> A = random.gaussian<D>(), B = random.gaussian<D>();
        const Vec<double, D> x = random.vector<D>(-1, 1), y = random.vector<D>(-1, 1);
        const Eigen::Matrix<double, D, D> a = as_eigen(A), b = as_eigen(B);
        const Eigen::Matrix<double, D, 1> u = as_eigen(x), v = as_eigen(y);
        const auto same = [](const auto& mine, const auto& expected) {
            return (as_eigen(mine) - expected).norm() <= 1e-14;
        };

        CHECK(same(A + B, a + b));
        CHECK(same(A - B, a - b));
        CHECK(same(A * B, a * b));
        CHECK(same(A * 2.5, 2.5 * a));
        CHECK(same(2.5 * A, 2.5 * a));
        CHECK(same(A * x, a * u));
        CHECK(same(transpose(A), a.transpose()));
        CHECK(same(outer(x, y), u * v.transpose()));
        CHECK(same(x + y, u + v));
        CHECK(same(x - y, u - v));
        CHECK(same(-x, -u));
        CHECK(same(x * 2.5, 2.5 * u));
        CHECK(same(A.column(1), a.col(1)));
        CHECK(dot(x, y) == Approx(u.dot(v)).margin(1e-15));
        CHECK(norm(x) == Approx(u.norm()));
        CHECK(trace(A) == Approx(a.trace()).margin(1e-15));
        CHECK(squared_norm(A) == Approx(a.squaredNorm()));
        CHECK(determinant(A) == Approx(a.determinant()).margin(1e-14));
        Mat<double, D> C = A;
        C += B;
        C -= A;
        CHECK(same(C, b));
        CHECK((as_eigen(from_eigen(a)) - a).norm() == 0);
        CHECK(from_eigen(u) == x);
    }
}

TEST_CASE("matrices are written by rows and stored by columns", "[core][tensor]") {
    const auto A = Mat<double, 2>::rows(1, 2, 3, 4);
    CHECK(A(0, 1) == 2);
    CHECK(A(1, 0) == 3);
    CHECK(A.m[1] == 3);
    CHECK(A.column(1) == Vec<double, 2>{2.0, 4.0});
    CHECK(determinant(A) == -2);
    CHECK(sizeof(Mat<float, 3>) == 9 * sizeof(float));
    CHECK(sizeof(Vec<double, 3>) == 3 * sizeof(double));
    CHECK(determinant(Mat<double, 3>::rows(2, 0, 1, 1, 3, 2, 0, 1, 4)) == 21);
}

TEST_CASE("identity, zero, filled, and other scalars", "[core][tensor]") {
    const auto I = Mat<double, 3>::identity();
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) CHECK(I(i, j) == (i == j ? 1 : 0));
    CHECK(squared_norm(Mat<double, 2>::zero()) == 0);
    CHECK(Vec<double, 2>::filled(3) == Vec<double, 2>{3.0, 3.0});
    CHECK(cast<float>(Vec<double, 2>{0.1, 2.0})[0] == 0.1f);
    CHECK(cast<double>(Mat<float, 2>::rows(1, 2, 3, 4))(1, 0) == 3);
    const Vec<double, 2> a{1.0, 2.0}, b{3.0, 4.0};
    CHECK(select(true, a, b) == a);
    CHECK(select(false, a, b) == b);
}
