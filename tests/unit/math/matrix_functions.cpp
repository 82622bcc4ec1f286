/// \file The bounds that matrix_functions.hpp states, against Eigen's singular value decomposition in higher precision.
#include "support/catch.hpp"
#include "support/effort.hpp"
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
template <class T, int D>
Mat<T, D> narrow(const EigenMat<T, D>& a) {
    Mat<T, D> r;
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) r(i, j) = T(a(std::min(i, j), std::max(i, j)));
    return r;
}
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

/// The largest errors of logarithmic_strain() and stretched_to() [ε].
struct Worst {
    double strain = 0, by_b = 0;
};

/// Checks the functions for one F: with principal strains up to 0.4 to 10 ε, else as well as its singular values,
/// of which each has an error up to 10 ε σ₀, determine them.
template <class T, int D>
void check(const Mat<T, D>& F, Random& random, Worst& worst) {
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
    if (is_small && !inverted) worst.strain = std::max(worst.strain, off);

    if (inverted) return;
    // A change of the strain with the same directions, which must not be those of nearly equal stretches.
    Eigen::Matrix<Wide<T>, D, 1> by, exp_by;
    for (int i = 0; i < D; ++i) by[i] = strain[i] * Wide<T>(random.uniform(-1, 1));
    for (int i = 0; i < D; ++i) exp_by[i] = std::exp(by[i]);
    for (int i = 0; i + 1 < D; ++i)
        if (of.stretches[i] - of.stretches[i + 1] < Wide<T>(0.1) * of.stretches[0]) exp_by[i + 1] = exp_by[i];
    for (int i = 0; i < D; ++i) by[i] = std::log(exp_by[i]);
    if (ratio > 20) return;
    EigenMat<T, D> wide;
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) wide(i, j) = F(i, j);
    // What is added to F is rounded as F is, also if the result is much smaller.
    const double size = double(std::max(exp_by.maxCoeff(), Wide<T>(1)) * of.stretches[0]);
    REQUIRE(error<T, D>(strained_by(F, narrow<T, D>(of.with(by))), of.with(exp_by) * wide) <= 100 * size);

    // The same by the left Cauchy–Green tensor b.
    Eigen::Matrix<Wide<T>, D, 1> squared;
    for (int i = 0; i < D; ++i) squared[i] = exp_by[i] * exp_by[i] * of.stretches[i] * of.stretches[i];
    const Mat<T, D> b = detail::symmetric_product(F, transpose(F));
    const auto to = narrow<T, D>(of.with(squared));
    // An error of ε σ₀² of b or b′ changes a stretch σ by ε σ₀²/σ.
    const double ratio_after = std::sqrt(double(squared.maxCoeff() / squared.minCoeff()));
    const double off_by_b = error<T, D>(stretched_to(F, b, determinant(F), to), of.with(exp_by) * wide) / size;
    if (is_small) worst.by_b = std::max(worst.by_b, off_by_b);
    CAPTURE(off_by_b);
    REQUIRE(off_by_b <= 50 * (is_small ? 1 : std::max(ratio, ratio_after)));
}

TEMPLATE_TEST_CASE_SIG("logarithms and exponentials are those of the principal values, for every kind of matrix",
                       "[math]", ((class T, int D), T, D), (float, 2), (float, 3), (double, 2), (double, 3)) {
    Random random(1);
    Worst worst;
    for (int k = 0; k < test_support::fewer_if_quick(10'000, 2000); ++k) {
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
    CAPTURE(worst.strain, worst.by_b);
    CHECK(worst.strain <= 10);
    CHECK(worst.strain > 0.1);
    CHECK(worst.by_b > 0.1);
}

TEMPLATE_TEST_CASE_SIG("a lane of a matrix function is what a plain number gives", "[math]", ((class T, int D), T, D),
                       (float, 2), (float, 3), (double, 2), (double, 3)) {
    using P = native_pack<T>;
    Random random(4);
    for (int k = 0; k < 300; ++k) {
        const auto [F, plain] = test_support::MatricesInLanes<T, D>(random, k);
        const auto strain = logarithmic_strain(F);
        const auto strained = strained_by(F, strain * P(T(-0.5)));
        const auto b = detail::symmetric_product(F, transpose(F));
        const auto to = Mat<P, D>::identity() + b * P(T(0.25));
        const auto stretched = stretched_to(F, b, determinant(F), to);
        for (int lane = 0; lane < scalar_traits<P>::lanes; ++lane) {
            const Mat<T, D>& of_lane = plain[std::size_t(lane)];
            const auto of_plain = logarithmic_strain(of_lane);
            const auto strained_plain = strained_by(of_lane, of_plain * T(-0.5));
            const auto b_of_plain = detail::symmetric_product(of_lane, transpose(of_lane));
            const auto to_of_plain = Mat<T, D>::identity() + b_of_plain * T(0.25);
            const auto stretched_plain = stretched_to(of_lane, b_of_plain, determinant(of_lane), to_of_plain);
            for (int i = 0; i < D * D; ++i) {
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
                const double most = 2e3 * double(std::numeric_limits<T>::epsilon());
                if (determinant(of_lane) < T(0.1)) continue;
                REQUIRE(std::abs(double(strain.m[i][lane] - of_plain.m[i])) <= most);
                REQUIRE(std::abs(double(strained.m[i][lane] - strained_plain.m[i])) <= 10 * most);
                REQUIRE(std::abs(double(stretched.m[i][lane] - stretched_plain.m[i])) <= 10 * most);
#else
                REQUIRE(strain.m[i][lane] == of_plain.m[i]);
                REQUIRE(strained.m[i][lane] == strained_plain.m[i]);
                REQUIRE(stretched.m[i][lane] == stretched_plain.m[i]);
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

TEMPLATE_TEST_CASE("another strain makes inverted matter upright", "[math]", float, double) {
    using T = TestType;
    for (const double first : {-1.5, -0.7, -0.1, -1e-3, -1e-7, 1e-7}) {
        Mat<T, 3> F = Mat<T, 3>::identity();
        F(0, 0) = T(first);
        F(1, 1) = T(1.1);
        const Mat<T, 3> to = Mat<T, 3>::identity() * T(0.25);
        const Mat<T, 3> halved = stretched_to(F, detail::symmetric_product(F, transpose(F)), determinant(F), to);
        const Mat<T, 3> unstrained = strained_by(F, logarithmic_strain(F) * T(-1));
        CAPTURE(first);
        for (int k = 0; k < 3; ++k) {
            // Of an inverted F, the smallest principal stretch is the negative one.
            CHECK(principal_stretches(halved).stretches[k] == Approx(0.5).epsilon(1e-5));
            CHECK(principal_stretches(unstrained).stretches[k] == Approx(1).epsilon(1e-5));
        }
    }
}

TEST_CASE("a NaN is not hidden by a matrix function", "[math]") {
    Mat<float, 3> F = Mat<float, 3>::identity();
    F(1, 2) = std::numeric_limits<float>::quiet_NaN();
    const auto strain = logarithmic_strain(F);
    CHECK(std::isnan(trace(strain)));
    CHECK(std::isnan(trace(strained_by(Mat<float, 3>::identity(), strain))));
    CHECK(std::isnan(trace(stretched_to(Mat<float, 3>::identity(), Mat<float, 3>::identity(), 1.0F, strain))));
}

}  // namespace matrix_function_tests
