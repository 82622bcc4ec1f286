/// \file The bounds that matrix_functions.hpp states, against Eigen's singular value decomposition in higher precision.
#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/core/pack.hpp>
#include <firn/math/matrix_functions.hpp>

#include <functional>
#include <limits>

using namespace firn;
using test_support::Random;

namespace matrix_function_tests {

/// In which scalar the expected values are computed.
template <class T>
using Wide = std::conditional_t<sizeof(T) == 4, double, long double>;
template <class T, int D>
using EigenMat = Eigen::Matrix<Wide<T>, D, D>;

template <class T, int D>
struct Directions {
    EigenMat<T, D> U;
    Eigen::Matrix<Wide<T>, D, 1> stretches;  ///< in descending order, without sign

    explicit Directions(const Mat<T, D>& F) {
        EigenMat<T, D> wide;
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) wide(i, j) = F(i, j);
        const Eigen::JacobiSVD<EigenMat<T, D>> svd(wide, Eigen::ComputeFullU);
        U = svd.matrixU(), stretches = svd.singularValues();
    }
    EigenMat<T, D> with(const Eigen::Matrix<Wide<T>, D, 1>& principal) const {
        return U * principal.asDiagonal() * U.transpose();
    }
};
/// Returns the largest |difference| between elements, in ε.
template <class T, int D>
double error(const Mat<T, D>& a, const EigenMat<T, D>& expected) {
    Wide<T> largest = 0;
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) largest = std::max(largest, std::abs(Wide<T>(a(i, j)) - expected(i, j)));
    return double(largest) / double(std::numeric_limits<T>::epsilon());
}
template <class T, int D>
Mat<T, D> stretched(Random& random, const std::function<double(int)>& stretch) {
    Mat<double, D> F = random.rotation<D>();
    for (int j = 0; j < D; ++j) {
        const double by = stretch(j);
        for (int i = 0; i < D; ++i) F(i, j) *= by;
    }
    return cast<T>(F * random.rotation<D>());
}

/// Checks both functions for one F: with principal strains up to 0.4 to 10 ε, else as well as its singular values,
/// of which each has an error up to 10 ε σ₀, determine them.
template <class T, int D>
void check(const Mat<T, D>& F, Random& random, double& worst) {
    const Directions<T, D> of(F);
    const bool inverted = determinant(cast<double>(F)) < 0;
    Eigen::Matrix<Wide<T>, D, 1> strain;
    for (int i = 0; i < D; ++i)
        strain[i] = std::log(inverted && i == D - 1 ? Wide<T>(1e-6) : std::max(of.stretches[i], Wide<T>(1e-6)));
    const bool is_small = strain.cwiseAbs().maxCoeff() < 0.4;
    const auto H = logarithmic_strain(F);
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < i; ++j) REQUIRE(H(i, j) == H(j, i));
    const double off = error<T, D>(H, of.with(strain));
    const double ratio = double(of.stretches[0] / std::max(of.stretches[D - 1], Wide<T>(1e-6)));
    CAPTURE(off, ratio, double(strain[0]), double(strain[D - 1]));
    // Near σ = 1e-6 an error of σ decides whether σ is replaced.
    if (of.stretches[D - 1] > 20 * std::numeric_limits<T>::epsilon() * of.stretches[0] || inverted)
        REQUIRE(off <= (is_small ? 10 : 20 * ratio * (1 + double(strain.cwiseAbs().maxCoeff()))));
    if (is_small && !inverted) worst = std::max(worst, off);

    // exp of a matrix with the same directions, which must not be those of nearly equal stretches
    Eigen::Matrix<Wide<T>, D, 1> by, exp_by;
    for (int i = 0; i < D; ++i) by[i] = std::log(of.stretches[i]) * Wide<T>(random.uniform(-1, 1));
    for (int i = 0; i + 1 < D; ++i)
        if (of.stretches[i] - of.stretches[i + 1] < Wide<T>(0.1) * of.stretches[0]) return;
    if (ratio > 20 || inverted) return;
    for (int i = 0; i < D; ++i) exp_by[i] = std::expm1(by[i]);
    const EigenMat<T, D> wide = of.with(by);
    Mat<T, D> A;
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) A(i, j) = T(wide(std::min(i, j), std::max(i, j)));
    REQUIRE(error<T, D>(exp_minus_one(F, A), of.with(exp_by)) <= 100 * double(exp_by.cwiseAbs().maxCoeff()));
}

TEMPLATE_TEST_CASE_SIG("logarithms and exponentials are those of the principal values, for every kind of matrix",
                       "[math]", ((class T, int D), T, D), (float, 2), (float, 3), (double, 2), (double, 3)) {
    Random random(1);
    double worst = 0;
    for (int k = 0; k < 10'000; ++k) {
        for (const double spread : {1e-5, 0.02, 0.1, 0.3})
            check<T, D>(cast<T>(random.rotation<D>() * (Mat<double, D>::identity() + random.gaussian<D>() * spread)),
                        random, worst);
        if (k % 10 != 0) continue;
        const double x = random.uniform(0.7, 1.4), e = random.uniform(-0.5, 0.5);
        check(stretched<T, D>(random, [&](int) { return x; }), random, worst);
        check(stretched<T, D>(random, [&](int i) { return i == 0 ? x : 1; }), random, worst);
        check(stretched<T, D>(random, [&](int i) { return i == 0 ? x : x + 1e-6; }), random, worst);
        check(stretched<T, D>(random, [&](int i) { return std::exp(i == 0 ? e : -e); }), random, worst);
        check(stretched<T, D>(random, [&](int i) { return i == 0 ? std::pow(10, random.uniform(-6, 0)) : x; }), random,
              worst);
        check(stretched<T, D>(random, [&](int i) { return i == 0 ? -x : 1.1 * x; }), random, worst);
        check(stretched<T, D>(random, [&](int i) { return std::pow(10, random.uniform(-3, 3)) * (i + 1); }), random,
              worst);
    }
    CAPTURE(worst);
    CHECK(worst <= 10);
    CHECK(worst > 0.1);
}

TEMPLATE_TEST_CASE_SIG("a lane of a matrix function is what a plain number gives", "[math]", ((class T, int D), T, D),
                       (float, 2), (float, 3), (double, 2), (double, 3)) {
    using P = native_pack<T>;
    Random random(4);
    for (int k = 0; k < 300; ++k) {
        const auto [F, plain] = test_support::MatricesInLanes<T, D>(random, k);
        const auto strain = logarithmic_strain(F);
        const auto factor = exp_minus_one(F, strain * P(T(-0.5)));
        for (int lane = 0; lane < scalar_traits<P>::lanes; ++lane) {
            const Mat<T, D>& of_lane = plain[std::size_t(lane)];
            const auto of_plain = logarithmic_strain(of_lane);
            const auto factor_of_plain = exp_minus_one(of_lane, of_plain * T(-0.5));
            for (int i = 0; i < D * D; ++i) {
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
                const double most = 2e3 * double(std::numeric_limits<T>::epsilon());
                if (determinant(of_lane) < T(0.1)) continue;
                REQUIRE(std::abs(double(strain.m[i][lane] - of_plain.m[i])) <= most);
                REQUIRE(std::abs(double(factor.m[i][lane] - factor_of_plain.m[i])) <= 10 * most);
#else
                REQUIRE(strain.m[i][lane] == of_plain.m[i]);
                REQUIRE(factor.m[i][lane] == factor_of_plain.m[i]);
#endif
            }
        }
    }
}

TEMPLATE_TEST_CASE_SIG("derivatives of the logarithmic strain by dual numbers are difference quotients", "[math][dual]",
                       ((int D), D), 2, 3) {
    Random random(5);
    for (int k = 0; k < 300; ++k) {
        // also at F = I, where eigenvectors have no derivatives
        const double spread = k % 3 == 0 ? 0 : k % 3 == 1 ? 0.1 : 0.4;
        const Mat<double, D> F = Mat<double, D>::identity() + random.gaussian<D>() * spread;
        if (determinant(F) < 0.3) continue;
        const Mat<double, D> change = random.gaussian<D>();
        Mat<dual<double>, D> lifted{};
        for (int i = 0; i < D * D; ++i) lifted.m[i] = {F.m[i], change.m[i]};
        constexpr double step = 1e-6;
        const auto got = logarithmic_strain(lifted);
        const auto ahead = logarithmic_strain(F + change * step), behind = logarithmic_strain(F - change * step);
        for (int i = 0; i < D * D; ++i)
            CHECK(got.m[i].derivative == Approx((ahead.m[i] - behind.m[i]) / (2 * step)).margin(1e-7));
    }
}

TEST_CASE("a NaN is not hidden by a matrix function", "[math]") {
    Mat<float, 3> F = Mat<float, 3>::identity();
    F(1, 2) = std::numeric_limits<float>::quiet_NaN();
    const auto strain = logarithmic_strain(F);
    CHECK(std::isnan(trace(strain)));
    CHECK(std::isnan(trace(exp_minus_one(Mat<float, 3>::identity(), strain))));
}

}  // namespace matrix_function_tests
