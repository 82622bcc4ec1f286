// sanitized: no
/// \file The bounds that principal_axes.hpp states, measured against the matrices themselves in higher precision.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/random_numbers.hpp"
#include <firn/core/pack.hpp>
#include <firn/math/principal_axes.hpp>

#include <functional>
#include <limits>

using namespace firn;
using test_support::Random;

namespace principal_axes_tests {

template <class T, int D>
using Wide = Eigen::Matrix<long double, D, D>;

template <class T, int D>
Wide<T, D> wide(const Mat<T, D>& a) {
    Wide<T, D> r;
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) r(i, j) = a(i, j);
    return r;
}
template <class T, int D>
Mat<T, D> narrow(const Wide<T, D>& a) {
    Mat<T, D> r;
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) r(i, j) = T(a(i, j));
    return r;
}

struct Worst {
    double residual = 0, of_U = 0;
};

/// Checks that U is a rotation; returns U diag(values) Uᵀ.
template <class T, int D>
Wide<T, D> checked(const Mat<T, D>& directions, const Vec<T, D>& values, Worst& worst) {
    const double epsilon = double(std::numeric_limits<T>::epsilon());
    const Wide<T, D> U = wide(directions);
    const double of_U = double((U * U.transpose() - Wide<T, D>::Identity()).norm()) / epsilon;
    REQUIRE(of_U <= 10);
    REQUIRE(U.determinant() > 0.9L);
    worst.of_U = std::max(worst.of_U, of_U);
    Eigen::Matrix<long double, D, 1> principal;
    for (int i = 0; i < D; ++i) principal[i] = values[i];
    return U * principal.asDiagonal() * U.transpose();
}
template <class T, int D>
void check_axes(const Mat<T, D>& A, Worst& worst) {
    const auto axes = principal_axes(A);
    const Wide<T, D> a = wide(A), made = checked<T, D>(axes.directions, axes.values, worst);
    const double epsilon = double(std::numeric_limits<T>::epsilon());
    const double residual = double((a - made).norm() / std::max(a.norm(), 1e-300L)) / epsilon;
    CAPTURE(residual);
    REQUIRE(residual <= 10);
    for (int i = 0; i + 1 < D; ++i) REQUIRE(axes.values[i] >= axes.values[i + 1] - T(4 * epsilon * double(a.norm())));
    worst.residual = std::max(worst.residual, residual);
}
template <class T, int D>
void check_stretches(const Mat<T, D>& F, Worst& worst) {
    const auto own = principal_stretches(F);
    const Wide<T, D> f = wide(F), V = checked<T, D>(own.directions, own.stretches, worst);
    const double epsilon = double(std::numeric_limits<T>::epsilon());
    const double residual = double((V * V - f * f.transpose()).norm() / std::max(f.squaredNorm(), 1e-300L)) / epsilon;
    CAPTURE(residual, double(own.stretches[0]), double(own.stretches[D - 1]));
    REQUIRE(residual <= 20);
    const long double J = f.determinant();
    if (std::abs(J) > 100 * epsilon * std::pow(f.norm(), D)) REQUIRE((J < 0) == (own.stretches[D - 1] < 0));
    worst.residual = std::max(worst.residual, residual);
}
/// A symmetric matrix with these eigenvalues.
template <class T, int D>
Mat<T, D> with_values(Random& random, const std::function<double(int)>& value) {
    const Wide<double, D> U = wide(random.rotation<D>());
    Eigen::Matrix<long double, D, 1> a;
    for (int i = 0; i < D; ++i) a[i] = value(i);
    const Wide<double, D> A = U * a.asDiagonal() * U.transpose();
    return narrow<T, D>((A + A.transpose()) / 2);
}

constexpr int repetitions = test_support::fewer_if_quick(10'000, 2000);

TEMPLATE_TEST_CASE_SIG("A = U diag(a) Uᵀ for symmetric matrices with eigenvalues of every kind", "[math]",
                       ((class T, int D), T, D), (float, 2), (float, 3), (double, 2), (double, 3)) {
    Random random(1);
    Worst worst;
    for (int k = 0; k < repetitions; ++k) {
        const double x = random.uniform(-2, 2), size = std::pow(10, random.uniform(-4, 4));
        const double tiny = std::pow(10, random.uniform(-16, -1));
        const std::array<double, 3> gaussian{random.normal(), random.normal(), random.normal()};
        const auto of = [&](auto value) { check_axes(with_values<T, D>(random, value), worst); };
        of([&](int i) { return gaussian[std::size_t(i)]; });
        of([&](int i) { return size * gaussian[std::size_t(i)]; });
        of([&](int i) { return 1 + tiny * gaussian[std::size_t(i)]; });  // near I
        of([&](int i) { return i == 0 ? x : 1 + tiny * i; });            // two nearly equal
        of([&](int i) { return i == 0 ? x : 1; });                       // two equal
        of([&](int) { return x; });
        of([&](int i) { return i == 0 ? x : 0; });
        of([&](int i) { return i == 0 ? x : i == 1 ? -x : tiny; });  // ½ det C near 0
    }
    check_axes(Mat<T, D>::zero(), worst);
    check_axes(Mat<T, D>::identity(), worst);
    for (int axis = 0; axis < D; ++axis) {
        Mat<T, D> A = Mat<T, D>::identity();
        A(axis, axis) = T(3);
        check_axes(A, worst);
        A(axis, axis) = T(-3);
        check_axes(A, worst);
    }
    CAPTURE(worst.residual, worst.of_U);
    CHECK(worst.residual > 0.1);
}

TEMPLATE_TEST_CASE_SIG("V² = FFᵀ with the sign of det F, for stretches of every kind", "[math]",
                       ((class T, int D), T, D), (float, 2), (float, 3), (double, 2), (double, 3)) {
    Random random(2);
    Worst worst;
    for (int k = 0; k < repetitions; ++k) {
        for (const double spread : {1e-5, 0.02, 0.1, 0.5})
            check_stretches(
                cast<T>(random.rotation<D>() * (Mat<double, D>::identity() + random.gaussian<D>() * spread)), worst);
        const double x = random.uniform(0.7, 1.4), small = std::pow(10, random.uniform(-6, 0));
        const auto of = [&](auto stretch) {
            const Mat<double, D> V = with_values<double, D>(random, stretch);
            check_stretches(cast<T>(V * random.rotation<D>()), worst);
        };
        of([&](int) { return x; });
        of([&](int i) { return i == 0 ? x : 1; });
        of([&](int i) { return i == 0 ? small : x; });
        of([&](int i) { return i == 0 ? -small : x; });
        of([&](int i) { return i == 0 ? 1 : small; });
        const double size = std::pow(10, random.uniform(-5, 5));
        of([&](int i) { return size * (1 + 0.1 * i); });
    }
    CAPTURE(worst.residual, worst.of_U);
    CHECK(worst.residual > 0.1);
}

TEMPLATE_TEST_CASE_SIG("a lane of principal_axes() and principal_stretches() is what a plain number gives", "[math]",
                       ((class T, int D), T, D), (float, 2), (float, 3), (double, 2), (double, 3)) {
    using P = native_pack<T>;
    Random random(4);
    for (int k = 0; k < 500; ++k) {
        const auto [F, plain] = test_support::MatricesInLanes<T, D>(random, k);
        const auto axes = principal_axes(F * transpose(F));
        const auto own = principal_stretches(F);
        for (int lane = 0; lane < scalar_traits<P>::lanes; ++lane) {
            const Mat<T, D>& f = plain[std::size_t(lane)];
            const auto axes_of_plain = principal_axes(f * transpose(f));
            const auto own_of_plain = principal_stretches(f);
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
            const double most = 20 * double(std::numeric_limits<T>::epsilon());
            for (int i = 0; i < D; ++i) {
                REQUIRE(std::abs(double(axes.values[i][lane] - axes_of_plain.values[i])) <=
                        most * double(squared_norm(f)));
                // σ² is what FFᵀ determines.
                const double s = double(own.stretches[i][lane]), expected = double(own_of_plain.stretches[i]);
                REQUIRE(std::abs(s * std::abs(s) - expected * std::abs(expected)) <= most * double(squared_norm(f)));
            }
#else
            for (int i = 0; i < D; ++i) {
                REQUIRE(axes.values[i][lane] == axes_of_plain.values[i]);
                REQUIRE(own.stretches[i][lane] == own_of_plain.stretches[i]);
            }
            for (int i = 0; i < D * D; ++i) {
                REQUIRE(axes.directions.m[i][lane] == axes_of_plain.directions.m[i]);
                REQUIRE(own.directions.m[i][lane] == own_of_plain.directions.m[i]);
            }
#endif
        }
    }
}

TEMPLATE_TEST_CASE_SIG(
    "derivatives of principal stretches and of U diag(g(σ)) Uᵀ by dual numbers are difference quotients",
    "[math][dual]", ((int D), D), 2, 3) {
    Random random(5);
    const auto of = [](const auto& F) {
        const auto p = principal_stretches(F);
        auto g = p.stretches;
        for (int i = 0; i < D; ++i) g[i] = p.stretches[i] * p.stretches[i] * p.stretches[i];
        return std::pair(p.stretches, spectral(p.directions, g));
    };
    for (int k = 0; k < 300; ++k) {
        // Also those that are diagonal, where no rotation is made.
        const double y = random.uniform(0.7, 0.9), z = random.uniform(-0.6, 0.5);
        Mat<double, D> F = Mat<double, D>::zero();
        F(0, 0) = 1.2, F(1, 1) = y;
        if (D == 3) F(D - 1, D - 1) = z;
        if (k % 2) F = random.rotation<D>() * F * random.rotation<D>();
        const Mat<double, D> change = random.gaussian<D>();
        Mat<dual<double>, D> lifted{};
        for (int i = 0; i < D * D; ++i) lifted.m[i] = {F.m[i], change.m[i]};
        const auto got = of(lifted);
        constexpr double step = 1e-6;
        const auto ahead = of(F + change * step), behind = of(F - change * step);
        for (int i = 0; i < D; ++i)
            CHECK(got.first[i].derivative == Approx((ahead.first[i] - behind.first[i]) / (2 * step)).margin(1e-7));
        for (int i = 0; i < D * D; ++i)
            CHECK(got.second.m[i].derivative ==
                  Approx((ahead.second.m[i] - behind.second.m[i]) / (2 * step)).margin(1e-7));
    }
}

TEST_CASE("a NaN is not hidden by principal stretches", "[math]") {
    Mat<float, 3> F = Mat<float, 3>::identity();
    F(1, 2) = std::numeric_limits<float>::quiet_NaN();
    const auto own = principal_stretches(F);
    CHECK(std::isnan(own.stretches[0] + own.stretches[1] + own.stretches[2]));
    const auto axes = principal_axes(F);
    CHECK(std::isnan(axes.values[0] + axes.values[1] + axes.values[2]));
}

}  // namespace principal_axes_tests
