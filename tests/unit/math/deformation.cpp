// sanitized: -O1
/// \file Strains of nearly undeformed matter are as exact as the differences to 1 from which they are computed.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include <firn/core/eigen.hpp>
#include <firn/core/pack.hpp>
#include <firn/math/left_stretch.hpp>
#include <firn/math/matrix_functions.hpp>
#include <firn/math/pow.hpp>

#include <Eigen/Dense>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

namespace deformation_tests {
namespace {

using namespace firn;

/// Numbers of 64 digits, in which E, J − 1 and the strains of small H lose nothing that a double could see.
using Exact = long double;
template <int D>
using ExactMat = Eigen::Matrix<Exact, D, D>;

struct Random {
    std::mt19937_64 engine{20260917};
    double uniform(double a, double b) { return a + (b - a) * double(engine() >> 11) * 0x1p-53; }
    template <class S, int D>
    Mat<S, D> displacement(double size) {
        Mat<S, D> H{};
        for (S& number : H.m) number = S(size * uniform(-1, 1));
        return H;
    }
};

template <class S, int D>
ExactMat<D> exact(const Mat<S, D>& a) {
    ExactMat<D> r;
    for (int k = 0; k < D * D; ++k) r.data()[k] = Exact(a.m[k]);
    return r;
}
/// U diag(f(σ² − 1)) Uᵀ for the principal stretches σ and directions U of FFᵀ = I + E.
template <int D, class F>
ExactMat<D> of_stretches(const ExactMat<D>& E, const F& f) {
    const Eigen::SelfAdjointEigenSolver<ExactMat<D>> axes(E);
    Eigen::Matrix<Exact, D, 1> values = axes.eigenvalues();
    for (int i = 0; i < D; ++i) values(i) = f(values(i));
    return axes.eigenvectors() * values.asDiagonal() * axes.eigenvectors().transpose();
}
template <class S, int D>
double distance(const Mat<S, D>& a, const ExactMat<D>& b) {
    return double((exact(a) - b).norm());
}

template <class S, int D>
void check_small_strains() {
    Random random;
    const double epsilon = std::numeric_limits<S>::epsilon();
    for (const double size : {1e-1, 1e-2, 1e-4, 1e-8, 1e-12})
        for (int k = 0; k < 300; ++k) {
            const Mat<S, D> H = random.displacement<S, D>(size);
            const auto F = DeformationGradient<S, D>::from_displacement(H);
            const ExactMat<D> one = ExactMat<D>::Identity(), h = exact(H), E = h + h.transpose() + h * h.transpose();
            const double allowed = 10 * epsilon * double(h.norm());
            CAPTURE(size, k);
            REQUIRE(distance(left_cauchy_green_change(F), E) <= allowed);
            const Exact volume = D == 2 ? h.trace() + h.determinant()
                                        : h.trace() + (h.trace() * h.trace() - (h * h).trace()) / 2 + h.determinant();
            REQUIRE(std::abs(double(Exact(volume_change(F)) - volume)) <= allowed);
            const auto stretch = of_stretches<D>(E, [](Exact e) { return e / (1 + std::sqrt(1 + e)); });
            REQUIRE(distance(left_stretch_change(F), stretch) <= allowed);
            const auto strain = of_stretches<D>(E, [](Exact e) { return std::log1p(e) / 2; });
            REQUIRE(distance(logarithmic_strain(F), strain) <= allowed);

            // A change of strain by A: (exp A) F = F + (exp A − I) F.
            const Mat<S, D> A = logarithmic_strain(F) * S(-0.5);
            const auto grown = of_stretches<D>(exact(A), [](Exact a) { return std::expm1(a); });
            REQUIRE(distance(displacement_gradient(strained_by(F, A)), ExactMat<D>(h + grown * (one + h))) <= allowed);
        }
}

}  // namespace

TEST_CASE("The error of a strain is relative to F - I, down to strains of 1e-12") {
    check_small_strains<float, 3>();
    check_small_strains<float, 2>();
    check_small_strains<double, 3>();
    check_small_strains<double, 2>();
}

TEMPLATE_TEST_CASE("V - I is that of left_stretch for every F: large, small, turned and inverted", "", float, double) {
    using T = TestType;
    Random random;
    for (int k = 0; k < test_support::fewer_if_quick(20000, 4000); ++k) {
        const double size = std::exp(random.uniform(-4, 4));
        const auto compare = [&](const auto& F) {
            const auto V = left_stretch(F), change = left_stretch_change(F);
            const double of_F = std::sqrt(double(squared_norm(F)));
            // V solves V² = FFᵀ, so its error is that of FFᵀ divided by 2 σ: compare V², as left_stretch.cpp does.
            using M = std::remove_cvref_t<decltype(V)>;
            const M other = M::identity() + change;
            const double residual = std::sqrt(double(squared_norm(other * other - V * V)));
            CAPTURE(k, of_F);
            REQUIRE(residual <= 200 * double(std::numeric_limits<T>::epsilon()) * std::max(of_F * of_F, 1.0));
        };
        compare(random.displacement<T, 3>(size));
        compare(random.displacement<T, 2>(size));
    }
}

TEST_CASE("A deformation gradient is read and set as a matrix, and keeps what the matrix cannot hold") {
    const auto H = Mat<float, 2>::rows(3e-8F, 1e-9F, 0, -2e-8F);
    auto F = DeformationGradient<float, 2>::from_displacement(H);
    CHECK(F(0, 0) == 1);
    CHECK(displacement_gradient(F)(0, 0) == 3e-8F);
    CHECK(displacement_gradient(F)(1, 1) == -2e-8F);

    F.m[0] = 1.25F;  // a number that is set is what counts
    CHECK(displacement_gradient(F)(0, 0) == 0.25F);
    CHECK(displacement_gradient(F)(1, 1) == -2e-8F);
    F(1, 1) -= 0.5F;
    CHECK(displacement_gradient(F)(1, 1) == -0.5F);
    F = Mat<float, 2>::identity();
    CHECK(squared_norm(displacement_gradient(F)) == 0);
    F = increased(F, H);
    CHECK(displacement_gradient(F)(0, 0) == 3e-8F);
    const auto doubled = select(true, increased(F, H), F);
    CHECK(displacement_gradient(doubled)(0, 0) == 6e-8F);
    CHECK(displacement_gradient(Mat<float, 2>(F))(0, 0) == 0);  // a matrix has no more than its numbers

    DeformationGradient<float, 3> of_eigen = Eigen::Matrix3f(2 * Eigen::Matrix3f::Identity());
    CHECK(displacement_gradient(of_eigen)(2, 2) == 1);
    F(0, 0) = std::numeric_limits<float>::quiet_NaN();
    CHECK(std::isnan(displacement_gradient(F)(0, 0)));
}

TEST_CASE("The derivative of a dual number in F counts wherever it was set") {
    using S = dual<double>;
    auto F = DeformationGradient<S, 3>::from_displacement(Mat<S, 3>::diagonal(S(1e-18)));
    F.m[0].derivative = 7;
    CHECK(displacement_gradient(F)(0, 0).derivative == 7);
    CHECK(displacement_gradient(F)(0, 0).value == 1e-18);
    CHECK(volume_change(F).derivative == 7);
    CHECK(displacement_gradient(DeformationGradient<S, 3>(Mat<S, 3>(F)))(0, 0).derivative == 7);
}

TEST_CASE("A volume ratio is read and set as a number, and keeps what the number cannot hold") {
    VolumeRatio<float> J;
    CHECK(float(J) == 1);
    J += 1e-8F;
    CHECK(J.excess == 1e-8F);
    J = 0.75F;
    CHECK(J.excess == -0.25F);
    J *= 2;
    CHECK(float(J) == 1.5F);
    J -= 0.5F;
    CHECK(J + 1 == 2);
    CHECK(select(false, VolumeRatio<float>(2), VolumeRatio<float>::from_excess(1e-9F)).excess == 1e-9F);
}

TEMPLATE_TEST_CASE("log and pow of a number near 1 lose nothing of its difference to 1", "", float, double) {
    using T = TestType;
    Random random;
    const double epsilon = std::numeric_limits<T>::epsilon();
    for (int k = 0; k < test_support::fewer_if_quick(20000, 4000); ++k) {
        const T less_one = T(std::exp(random.uniform(-40, -1.3)) * (k % 2 ? 1 : -1)), y = T(random.uniform(-15, 15));
        const Exact exact_log = std::log1p(Exact(less_one)), exact_pow = std::expm1(Exact(y) * exact_log);
        CAPTURE(less_one, y);
        REQUIRE(std::abs(double(Exact(log(T(1) + less_one, less_one)) - exact_log)) <=
                epsilon * double(std::abs(exact_log)));
        REQUIRE(std::abs(double(Exact(pow_less_one(less_one, y)) - exact_pow)) <=
                5 * epsilon * double(std::abs(exact_pow)));
    }
    const dual<T> x{T(0.1), T(1)};
    CHECK(double(log(T(1) + x, x).derivative) == Approx(1 / 1.1));
    CHECK(double(pow_less_one(x, dual<T>(T(-7))).derivative) == Approx(-7 * std::pow(1.1, -8)));
    CHECK(double(pow_less_one(T(-0.875), T(-15))) == Approx(std::pow(8.0, 15) - 1).epsilon(30 * epsilon));
}

TEST_CASE("Lanes of small strains have the bits of single numbers where nothing is fused") {
#if !defined(__FMA__) && !defined(__ARM_FEATURE_FMA)
    using P = native_pack<float>;
    Random random;
    Mat<P, 3> packed;
    std::vector<Mat<float, 3>> plain;
    for (int lane = 0; lane < scalar_traits<P>::lanes; ++lane) {
        plain.push_back(random.displacement<float, 3>(lane % 2 ? 1e-6 : 0.9));
        for (int k = 0; k < 9; ++k) packed.m[k].set(lane, plain.back().m[k]);
    }
    const auto F = DeformationGradient<P, 3>::from_displacement(packed);
    const auto V = left_stretch_change(F), E = left_cauchy_green_change(F);
    for (int lane = 0; lane < scalar_traits<P>::lanes; ++lane) {
        const auto one = DeformationGradient<float, 3>::from_displacement(plain[std::size_t(lane)]);
        for (int k = 0; k < 9; ++k) {
            CHECK(V.m[k][lane] == left_stretch_change(one).m[k]);
            CHECK(E.m[k][lane] == left_cauchy_green_change(one).m[k]);
        }
        CHECK(volume_change(F)[lane] == volume_change(one));
    }
#else
    SUCCEED("this build fuses multiplications and additions");
#endif
}

}  // namespace deformation_tests
