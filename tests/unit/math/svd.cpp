// sanitized: no
/// \file The bounds that svd.hpp states, measured against the matrices themselves and against Eigen.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/random_numbers.hpp"
#include <firn/core/pack.hpp>
#include <firn/math/svd.hpp>

#include <limits>

using namespace firn;
using test_support::Random;

namespace {

template <class T, int D>
Mat<long double, D> wide(const Mat<T, D>& a) {
    Mat<long double, D> r{};
    for (int k = 0; k < D * D; ++k) r.m[k] = a.m[k];
    return r;
}
template <int D>
long double size_of(const Mat<long double, D>& a) {
    long double sum = 0;
    for (const long double x : a.m) sum += x * x;
    return std::sqrt(sum);
}
template <int D>
Mat<double, D> with_singular_values(Random& random, const std::array<double, 3>& s) {
    Mat<double, D> F = random.rotation<D>();
    for (int j = 0; j < D; ++j)
        for (int i = 0; i < D; ++i) F(i, j) *= s[std::size_t(j)];
    return F * random.rotation<D>();
}

struct Worst {
    double residual = 0, of_U = 0, of_V = 0;
};

/// What the docstring promises; and that left_singular() gives the same σ and U diag(σ) Uᵀ = V of the polar
/// decomposition.
template <class T, int D>
void require_svd(const Mat<T, D>& F, Worst& worst) {
    const double epsilon = double(std::numeric_limits<T>::epsilon());
    const Svd<T, D> f = svd(F);
    const auto U = wide(f.U), V = wide(f.V);
    long double largest = 0;
    for (const T& x : F.m) largest = std::max(largest, std::abs((long double)(x)));
    if (largest == 0) largest = 1;
    Mat<long double, D> scaled = wide(F), Sigma = Mat<long double, D>::zero();
    for (auto& x : scaled.m) x /= largest;
    for (int i = 0; i < D; ++i) Sigma(i, i) = f.values[i] / largest;
    const auto identity = Mat<long double, D>::identity();
    const double residual =
        double(size_of(scaled - U * Sigma * transpose(V)) / std::max(size_of(scaled), 1e-300L)) / epsilon;
    const double of_U = double(size_of(U * transpose(U) - identity)) / epsilon;
    const double of_V = double(size_of(V * transpose(V) - identity)) / epsilon;
    INFO("residual " << residual << ", U " << of_U << ", V " << of_V << ", sigma " << f.values[0] << " "
                     << f.values[D - 1]);
    REQUIRE(residual <= 10);
    REQUIRE(of_U <= 10);
    REQUIRE(of_V <= (D == 2 ? 10 : 20));
    REQUIRE(determinant(f.U) > T(0.9));
    REQUIRE(determinant(f.V) > T(0.9));
    for (int i = 0; i + 1 < D; ++i)
        REQUIRE(f.values[i] - std::abs(f.values[i + 1]) >=
                T(-4 * epsilon) * f.values[i] - T(epsilon * 1e-3) * f.values[0]);
    worst.residual = std::max(worst.residual, residual);
    worst.of_U = std::max(worst.of_U, of_U);
    worst.of_V = std::max(worst.of_V, of_V);

    const auto left = left_singular(F);
    for (int i = 0; i < D; ++i)
        REQUIRE(std::abs(double(left.values[i] * left.scale - f.values[i])) <= 8 * epsilon * double(f.values[0]));
}

template <class T, int D>
void require_eigen(const Mat<T, D>& F) {
    const Eigen::Matrix<double, D, 1> expected =
        Eigen::JacobiSVD<Eigen::Matrix<double, D, D>>(as_eigen(cast<double>(F))).singularValues();
    const auto f = svd(F);
    const double sign = determinant(cast<double>(F)) < 0 ? -1 : 1;
    for (int i = 0; i < D; ++i)
        REQUIRE(std::abs(double(f.values[i]) - (i == D - 1 ? sign : 1) * expected[i]) <=
                10 * double(std::numeric_limits<T>::epsilon()) * expected[0]);
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("F = U Σ Vᵀ with rotations, for random matrices, half of them inverted, and near rotations",
                       "[math]", ((class T, int D), T, D), (float, 2), (float, 3), (double, 2), (double, 3)) {
    Random random(1);
    Worst worst;
    for (int k = 0; k < test_support::fewer_if_quick(20000, 4000); ++k) {
        const double spread = k % 3 == 0 ? 1 : k % 3 == 1 ? 0.05 : 1e-5;
        const Mat<T, D> F =
            k % 3 == 0 ? cast<T>(random.gaussian<D>()) : cast<T>(random.rotation<D>() + random.gaussian<D>() * spread);
        require_svd(F, worst);
        if (k % 3 == 0) require_eigen(F);
    }
    UNSCOPED_INFO("worst: " << worst.residual << ", " << worst.of_U << ", " << worst.of_V);
}

TEMPLATE_TEST_CASE_SIG("F = U Σ Vᵀ with equal singular values, opposite ones, none, and tiny ones", "[math]",
                       ((class T, int D), T, D), (float, 2), (float, 3), (double, 2), (double, 3)) {
    Random random(2);
    Worst worst;
    for (int k = 0; k < 1000; ++k) {
        const double x = random.uniform(0, 1);
        const double small = std::pow(10, -random.uniform(0, sizeof(T) == 4 ? 20 : 160));
        for (const std::array<double, 3>& s : std::initializer_list<std::array<double, 3>>{{1, 1, 1},
                                                                                           {1, 1, -1},
                                                                                           {1, -1, 1},
                                                                                           {1, x, x},
                                                                                           {1, 1, x},
                                                                                           {1, x, -x},
                                                                                           {1, 0, 0},
                                                                                           {1, x, 0},
                                                                                           {1, x, 1e-6 * x},
                                                                                           {1, small, -small},
                                                                                           {1, small, small * x},
                                                                                           {1, x, small},
                                                                                           {1, 1 - 1e-6, x}})
            require_svd(cast<T>(with_singular_values<D>(random, s)), worst);
    }
    require_svd(Mat<T, D>::zero(), worst);
    for (int k = 0; k < D * D; ++k)
        for (const double value : {1.0, -1.0, 1e-3}) {
            Mat<T, D> F = Mat<T, D>::zero();
            F.m[k] = T(value);
            require_svd(F, worst);
            F = Mat<T, D>::identity();
            F.m[k] = T(-value);
            require_svd(F, worst);
        }
}

TEMPLATE_TEST_CASE_SIG("F = U Σ Vᵀ for every size of F", "[math]", ((class T, int D), T, D), (float, 2), (float, 3),
                       (double, 2), (double, 3)) {
    Random random(3);
    Worst worst;
    const double decades = sizeof(T) == 4 ? 36 : 300;
    for (int k = 0; k < 5000; ++k) {
        const double size = std::pow(10, random.uniform(-decades, decades));
        require_svd(cast<T>(random.gaussian<D>() * size), worst);
        require_svd(cast<T>(random.rotation<D>() * size), worst);
    }
}

TEMPLATE_TEST_CASE_SIG("a lane of svd() and left_singular() is what a plain number gives", "[math]",
                       ((class T, int D), T, D), (float, 2), (float, 3), (double, 2), (double, 3)) {
    using P = native_pack<T>;
    Random random(4);
    for (int k = 0; k < 500; ++k) {
        const auto [F, plain] = test_support::MatricesInLanes<T, D>(random, k);
        const auto f = svd(F);
        for (int lane = 0; lane < scalar_traits<P>::lanes; ++lane) {
            const auto expected = svd(plain[std::size_t(lane)]);
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
            for (int i = 0; i < D; ++i)
                REQUIRE(std::abs(double(f.values[i][lane] - expected.values[i])) <=
                        20 * double(std::numeric_limits<T>::epsilon()) * double(expected.values[0]));
#else
            for (int i = 0; i < D; ++i) REQUIRE(f.values[i][lane] == expected.values[i]);
            for (int i = 0; i < D * D; ++i) {
                REQUIRE(f.U.m[i][lane] == expected.U.m[i]);
                REQUIRE(f.V.m[i][lane] == expected.V.m[i]);
            }
#endif
        }
    }
}

TEST_CASE("a NaN in F is not hidden by svd()", "[math]") {
    Mat<float, 3> F = Mat<float, 3>::identity();
    F(1, 2) = std::numeric_limits<float>::quiet_NaN();
    const auto f = svd(F);
    CHECK(std::isnan(f.values[0] + f.values[1] + f.values[2]));
    Mat<float, 2> G = Mat<float, 2>::identity();
    G(1, 0) = std::numeric_limits<float>::quiet_NaN();
    CHECK(std::isnan(svd(G).values[0] + svd(G).values[1]));
}
