// sanitized: -O1
#include "support/catch.hpp"
#include "support/effort.hpp"
#include <firn/core/eigen.hpp>
#include <firn/core/pack.hpp>
#include <firn/core/strict.hpp>
#include <firn/math/left_stretch.hpp>

#include <Eigen/Dense>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace left_stretch_tests {
namespace {

using firn::Mat;

template <int D>
using EigenMat = Eigen::Matrix<double, D, D>;

/// Seeded random matrices; the same numbers on every platform (no std::normal_distribution, which differs).
struct Random {
    std::mt19937_64 engine{20240917};
    double uniform() { return double(engine() >> 11) * 0x1p-53; }
    double gauss() { return std::sqrt(-2 * std::log(1 - uniform())) * std::cos(6.283185307179586 * uniform()); }
    template <int D>
    EigenMat<D> gaussian() {
        EigenMat<D> a;
        for (int k = 0; k < D * D; ++k) a.data()[k] = gauss();
        return a;
    }
    template <int D>
    EigenMat<D> rotation() {
        EigenMat<D> q = Eigen::HouseholderQR<EigenMat<D>>(gaussian<D>()).householderQ();
        if (q.determinant() < 0) q.col(0) *= -1;
        return q;
    }
    /// A matrix with these singular values, the last one signed.
    template <int D>
    EigenMat<D> with_singular_values(const Eigen::Matrix<double, D, 1>& s) {
        return rotation<D>() * s.asDiagonal() * rotation<D>();
    }
};

template <class T, int D>
Mat<T, D> rounded(const EigenMat<D>& a) {
    Mat<T, D> r{};
    for (int k = 0; k < D * D; ++k) r.m[k] = T(a.data()[k]);
    return r;
}
template <class T, int D>
EigenMat<D> widened(const Mat<T, D>& a) {
    EigenMat<D> r;
    for (int k = 0; k < D * D; ++k) r.data()[k] = double(a.m[k]);
    return r;
}
/// Scaled by 1/max|Fᵢⱼ|, in long double: no over- or underflow, and room for the residual of doubles.
template <class T, int D>
Eigen::Matrix<long double, D, D> scaled(const Mat<T, D>& a, long double factor) {
    Eigen::Matrix<long double, D, D> r;
    for (int k = 0; k < D * D; ++k) r.data()[k] = (long double)(a.m[k]) * factor;
    return r;
}

struct Quality {
    bool symmetric;
    double residual;  ///< ‖V² − FFᵀ‖ / (ε ‖F‖²)
    bool sign_right;  ///< of the smallest eigenvalue, where |σ| > 50 ε ‖F‖
};

template <class T, int D>
Quality quality(const Mat<T, D>& F, const Mat<T, D>& V) {
    const long double epsilon = std::numeric_limits<T>::epsilon();
    long double largest = 0;
    bool symmetric = true;
    for (int k = 0; k < D * D; ++k) {
        largest = std::max(largest, std::abs((long double)(F.m[k])));
        symmetric = symmetric && V(k / D, k % D) == V(k % D, k / D);
    }
    const auto f = scaled(F, largest > 0 ? 1 / largest : 1);
    const auto v = scaled(V, largest > 0 ? 1 / largest : 1);
    const long double residual = (v * v - f * f.transpose()).norm();
    const long double size = f.squaredNorm();

    Eigen::JacobiSVD<EigenMat<D>> svd(EigenMat<D>(f.template cast<double>()));
    const double smallest = svd.singularValues()(D - 1);
    const bool decided = smallest > 50 * double(epsilon) * double(std::sqrt(size));
    const bool sign_right = (v.determinant() < 0) == (f.determinant() < 0);
    return {symmetric, size > 0 ? double(residual / (epsilon * size)) : double(residual), !decided || sign_right};
}

/// What the docstrings promise, and that V is what the singular value decomposition gives where that is well posed.
template <class T, int D>
void require_left_stretch(const Mat<T, D>& F) {
    const Mat<T, D> V = firn::left_stretch(F);
    const Quality q = quality(F, V);
    INFO("F =\n" << widened(F) << "\nV =\n" << widened(V));
    REQUIRE(q.symmetric);
    REQUIRE(q.residual <= (D == 2 ? 10 : 100));  // false for NaN
    REQUIRE(q.sign_right);
}

template <class T>
void require_equal_to_svd(const Mat<T, 3>& F) {
    Eigen::JacobiSVD<EigenMat<3>> svd(widened(F), Eigen::ComputeFullU);
    Eigen::Vector3d s = svd.singularValues();
    if (widened(F).determinant() < 0) s(2) = -s(2);
    const EigenMat<3> expected = svd.matrixU() * s.asDiagonal() * svd.matrixU().transpose();
    const double error = (widened(firn::left_stretch(F)) - expected).norm() / s.norm();
    // What rounding F by ε does to V, and the SVD's own error, both amplified by σ₀ / (σ₁ + σ₂).
    const double allowed = 100 * double(std::numeric_limits<T>::epsilon()) * s(0) / (s(1) + s(2));
    INFO("F =\n" << widened(F) << "\nsigma = " << s.transpose());
    REQUIRE(error <= allowed);
}

/// How often a test repeats what it does: `all` times with --full, `few` with --ci, a quarter of that in the plain test
/// command.
constexpr int times(int all, int few) {
    return test_support::fewer_if_quick(test_support::fewer_if_plain(all, few), few / 4);
}

}  // namespace

TEMPLATE_TEST_CASE("V V = F F^T with the sign of det F, for random Gaussian F, half of them inverted", "", float,
                   double) {
    Random random;
    const int count = times(100000, 20000);
    int inverted = 0;
    for (int k = 0; k < count; ++k) {
        const EigenMat<3> a = random.gaussian<3>();
        inverted += a.determinant() < 0;
        require_left_stretch(rounded<TestType>(a));
        if (k % 10 == 0) {
            require_equal_to_svd(rounded<TestType>(a));
            require_left_stretch(rounded<TestType>(random.gaussian<2>()));
        }
    }
    REQUIRE(inverted > count / 100 * 49);
    REQUIRE(inverted < count / 100 * 51);
}

TEMPLATE_TEST_CASE("V holds for singular values down to 1e-6, equal ones and large stretch, both signs", "", float,
                   double) {
    Random random;
    for (int k = 0; k < times(40000, 8000); ++k) {
        const double lower = -6 * random.uniform();
        Eigen::Vector3d s(1, std::pow(10, lower), std::pow(10, lower - (6 + lower) * random.uniform()));
        if (k % 3 == 1) s(1) = s(0) * (1 - 1e-6 * random.uniform());
        if (k % 3 == 2) s(2) = s(1) * (1 - 1e-6 * random.uniform());
        if (k % 2 == 1) s(2) = -s(2);
        if (k % 5 == 0) s *= 1e3;
        require_left_stretch(rounded<TestType>(random.with_singular_values<3>(s)));
        if (k % 4 == 0) require_left_stretch(rounded<TestType>(random.with_singular_values<2>({s(0), s(2)})));
    }
}

TEMPLATE_TEST_CASE("V changes from the closed form to Jacobi rotations without a loss on either side", "", float,
                   double) {
    // The denominator over λ³ crosses 0.125 in this family: σ = (1, x, ±x) and (1, ½, −y).
    Random random;
    for (int k = 0; k < times(30000, 6000); ++k) {
        const double x = 0.02 + 0.3 * random.uniform();
        const double y = 0.5 * random.uniform();
        const double z = random.uniform();
        require_left_stretch(rounded<TestType>(random.with_singular_values<3>({1, x, x})));
        require_left_stretch(rounded<TestType>(random.with_singular_values<3>({1, 0.5, -y})));
        require_left_stretch(rounded<TestType>(random.with_singular_values<3>({1, z, -z * random.uniform()})));
    }
}

TEMPLATE_TEST_CASE("V where the quartic alone fails: F = 0, opposite singular values, rank one and two", "", float,
                   double) {
    using T = TestType;
    require_left_stretch(Mat<T, 3>::zero());
    require_left_stretch(Mat<T, 2>::zero());
    REQUIRE(firn::squared_norm(firn::left_stretch(Mat<T, 3>::zero())) == T(0));
    for (const T sign : {T(1), T(-1)}) {
        require_left_stretch(Mat<T, 3>::diagonal(sign));
        require_left_stretch(Mat<T, 2>::rows(1, 0, 0, sign));
        require_left_stretch(Mat<T, 3>::rows(1, 0, 0, 0, 1, 0, 0, 0, sign));
        require_left_stretch(Mat<T, 3>::rows(1, 0, 0, 0, 0.5, 0, 0, 0, sign * T(0.499)));
        require_left_stretch(Mat<T, 3>::rows(1, 0, 0, 0, 1e-3, 0, 0, 0, sign * T(1e-3)));
        require_left_stretch(Mat<T, 3>::rows(0, 0, sign, 0, 0, 0, 0, 0, 0));
        require_left_stretch(Mat<T, 3>::rows(1, 2, 3, 2 * sign, 4 * sign, 6 * sign, 3, 6, 9));
        require_left_stretch(Mat<T, 3>::rows(1, 2, 3, 4, 5, 6, 7, 8, 9));
        require_left_stretch(Mat<T, 2>::rows(1, 2, 2 * sign, 4 * sign));
        require_left_stretch(Mat<T, 2>::rows(3, 4, 4, -3));
    }
    Random random;
    for (int k = 0; k < times(5000, 1000); ++k) {
        const double x = random.uniform();
        require_left_stretch(rounded<T>(random.with_singular_values<3>({1, 0.5, -0.499})));
        require_left_stretch(rounded<T>(random.with_singular_values<3>({1, 1e-3, 1e-3})));
        require_left_stretch(rounded<T>(random.with_singular_values<3>({1, x, -x})));
        require_left_stretch(rounded<T>(random.with_singular_values<3>({1, 1, -1})));
        require_left_stretch(rounded<T>(random.with_singular_values<3>({1, x, 0})));
        require_left_stretch(rounded<T>(random.with_singular_values<3>({1, 0, 0})));
        require_left_stretch(rounded<T>(random.with_singular_values<2>({1, -1})));
        require_left_stretch(rounded<T>(random.with_singular_values<2>({1, 0})));
        require_left_stretch(rounded<T>(random.rotation<3>()));
    }
}

TEMPLATE_TEST_CASE("V holds for every size of F: squares that over- or underflow do no harm", "", float, double) {
    using T = TestType;
    constexpr bool single = sizeof(T) == 4;
    Random random;
    for (const double size : {1e-15, 1e15, single ? 1e-30 : 1e-100, single ? 1e30 : 1e100, single ? 1e37 : 1e300,
                              single ? 1e-36 : 1e-290, 1e-3, 3e3, 1e4}) {
        for (int k = 0; k < 300; ++k) {
            require_left_stretch(rounded<T>(EigenMat<3>(random.gaussian<3>() * size)));
            require_left_stretch(rounded<T>(EigenMat<2>(random.gaussian<2>() * size)));
        }
        require_left_stretch(Mat<T, 3>::rows(size, 0, 0, 0, 1 / size, 0, 0, 0, 0));
        require_left_stretch(Mat<T, 2>::rows(0, size, 1 / size, 0));
    }
    const double decades = single ? 36 : 300;
    for (int k = 0; k < times(20000, 4000); ++k) {
        const double size = std::pow(10, decades * (2 * random.uniform() - 1));
        require_left_stretch(rounded<T>(EigenMat<3>(random.gaussian<3>() * size)));
        require_left_stretch(rounded<T>(EigenMat<3>(random.rotation<3>() * size)));
        require_left_stretch(rounded<T>(EigenMat<2>(random.gaussian<2>() * size)));
    }
    const T tiny = std::numeric_limits<T>::denorm_min();
    for (const T f : firn::left_stretch(Mat<T, 3>::diagonal(tiny)).m) REQUIRE(std::isfinite(f));
    for (const T f : firn::left_stretch(Mat<T, 2>::diagonal(tiny)).m) REQUIRE(std::isfinite(f));
}

TEMPLATE_TEST_CASE("A lane of left_stretch is what the scalar gives, whatever its neighbours", "", float, double) {
    using T = TestType;
    using P = firn::native_pack<T>;
    constexpr int lanes = firn::scalar_traits<P>::lanes;
    Random random;
    for (int k = 0; k < 3000; ++k) {
        Mat<P, 3> F{};
        Mat<P, 2> G{};
        for (int lane = 0; lane < lanes; ++lane) {
            EigenMat<3> a = random.gaussian<3>();
            if (k % 3 == 0) a = random.rotation<3>() + 0.1 * a;                             // no rare lane
            if ((k + lane) % 7 == 0) a = random.with_singular_values<3>({1, 0.5, -0.499});  // some
            if ((k + lane) % 11 == 0) a.setZero();
            const EigenMat<2> b = random.gaussian<2>();
            for (int i = 0; i < 9; ++i) F.m[i].set(lane, T(a.data()[i]));
            for (int i = 0; i < 4; ++i) G.m[i].set(lane, (k + lane) % 5 == 0 ? T(0) : T(b.data()[i]));
        }
        const Mat<P, 3> V = firn::left_stretch(F);
        const Mat<P, 2> U = firn::left_stretch(G);
        for (int lane = 0; lane < lanes; ++lane) {
            Mat<T, 3> f{}, v{};
            for (int i = 0; i < 9; ++i) f.m[i] = F.m[i][lane], v.m[i] = V.m[i][lane];
            Mat<T, 2> g{}, u{};
            for (int i = 0; i < 4; ++i) g.m[i] = G.m[i][lane], u.m[i] = U.m[i][lane];
            const Mat<T, 3> expected = firn::left_stretch(f);
            const Mat<T, 2> expected2 = firn::left_stretch(g);
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
            // Fused differently, both within the bound of the residual.
            const Quality q = quality(f, v);
            REQUIRE((q.symmetric && q.sign_right && q.residual <= 100));
            const T epsilon = std::numeric_limits<T>::epsilon();
            REQUIRE(firn::squared_norm(u - expected2) <= 1000 * epsilon * epsilon * firn::squared_norm(expected2));
            if (k % 3 == 0 && (k + lane) % 7 != 0) {
                REQUIRE(firn::squared_norm(v - expected) <= 1000 * epsilon * epsilon * firn::squared_norm(expected));
            }
#else
            for (int i = 0; i < 9; ++i) REQUIRE(v.m[i] == expected.m[i]);
            for (int i = 0; i < 4; ++i) REQUIRE(u.m[i] == expected2.m[i]);
#endif
        }
    }
}

TEST_CASE("The derivative of V by dual numbers solves V dV + dV V = d(F F^T), in both paths") {
    using S = firn::dual<double>;
    Random random;
    int rare = 0;
    for (int k = 0; k < 3000; ++k) {
        // Closed form, Jacobi, equal singular values in either, and one that vanishes.
        const std::vector<Eigen::Vector3d> values{{1.2, 1, 0.8}, {1, 1, 1},       {1, 0.5, -0.28}, {1, 0.01, 0.01},
                                                  {1, 0.02, 0},  {1, 0.5, -0.45}, {1, 0.15, 0.13}};
        const Eigen::Vector3d s = values[std::size_t(k) % values.size()];
        const EigenMat<3> f = random.with_singular_values<3>(s);
        const EigenMat<3> change = random.gaussian<3>();
        Mat<S, 3> F{};
        for (int i = 0; i < 9; ++i) F.m[i] = {f.data()[i], change.data()[i]};
        const Mat<S, 3> V = firn::left_stretch(F);
        EigenMat<3> v, dv;
        for (int i = 0; i < 9; ++i) v.data()[i] = V.m[i].value, dv.data()[i] = V.m[i].derivative;
        const EigenMat<3> residual = v * dv + dv * v - change * f.transpose() - f * change.transpose();
        INFO("sigma = " << s.transpose() << "\ndV =\n" << dv);
        REQUIRE(dv == dv.transpose());
        // dV is of size ‖dF‖ σ₀ / (σ₁ + σ₂), and the error of V enters multiplied by it.
        REQUIRE(residual.norm() <= 1e-13 * std::max(1.0, 1 / (s(1) + s(2))) * change.norm());
        rare += s(1) < 0.1;
    }
    REQUIRE(rare > 500);
}

TEST_CASE("Where V has no derivative, the derivative is finite") {
    using S = firn::dual<double>;
    for (const auto& F : {Mat<double, 3>::zero(), Mat<double, 3>::rows(1, 0, 0, 0, 0.5, 0, 0, 0, -0.5)}) {
        Mat<S, 3> D{};
        for (int i = 0; i < 9; ++i) D.m[i] = {F.m[i], 1.0 + i};
        for (const S& entry : firn::left_stretch(D).m) {
            REQUIRE(std::isfinite(entry.value));
            REQUIRE(std::isfinite(entry.derivative));
        }
    }
}

TEMPLATE_TEST_CASE("The 2D polar rotation is proper, F = V R, and near to any F", "", float, double) {
    using T = TestType;
    Random random;
    for (int k = 0; k < times(20000, 4000); ++k) {
        const Mat<T, 2> F = rounded<T>(random.gaussian<2>());
        const EigenMat<2> R = widened(firn::polar_rotation(F));
        const double epsilon = std::numeric_limits<T>::epsilon();
        REQUIRE((R * R.transpose() - EigenMat<2>::Identity()).norm() <= 4 * epsilon);
        REQUIRE(R.determinant() > 0);
        const EigenMat<2> VR = widened(firn::left_stretch(F)) * R;
        REQUIRE((VR - widened(F)).norm() <= 10 * epsilon * widened(F).norm());
        // The nearest rotation maximises tr(Rᵀ F): turning it by ±1e-2 makes that smaller.
        const double best = (R.transpose() * widened(F)).trace();
        for (const double angle : {-1e-2, 1e-2}) {
            const EigenMat<2> turned = Eigen::Rotation2Dd(angle).toRotationMatrix() * R;
            REQUIRE((turned.transpose() * widened(F)).trace() <= best + 4 * epsilon * widened(F).norm());
        }
    }
    REQUIRE(firn::squared_norm(firn::polar_rotation(Mat<T, 2>::zero()) - Mat<T, 2>::identity()) == T(0));
}

TEMPLATE_TEST_CASE("A large rotation leaves V alone: V(F Q) = V(F), V(Q F) = Q V(F) Q^T", "", float, double) {
    using T = TestType;
    Random random;
    for (int k = 0; k < times(5000, 1000); ++k) {
        const EigenMat<3> F = random.rotation<3>() * Eigen::Vector3d(1.5, 1, 0.5).asDiagonal();
        const EigenMat<3> Q = random.rotation<3>();
        const auto V = [](const EigenMat<3>& a) -> EigenMat<3> { return widened(firn::left_stretch(rounded<T>(a))); };
        const double allowed = 20 * double(std::numeric_limits<T>::epsilon());
        REQUIRE((V(F * Q) - V(F)).norm() <= allowed);
        REQUIRE((V(Q * F) - Q * V(F) * Q.transpose()).norm() <= allowed);
    }
}

TEST_CASE("left_stretch needs no more of a scalar than every scalar has") {
    using S = firn::strict<double>;
    const auto V = firn::left_stretch(Mat<S, 3>::rows(1, 0.25, 0, 0, 1, 0, 0, 0, -1.5));
    const auto same = firn::left_stretch(Mat<double, 3>::rows(1, 0.25, 0, 0, 1, 0, 0, 0, -1.5));
    for (int k = 0; k < 9; ++k) REQUIRE(V.m[k].value == Approx(same.m[k]).margin(1e-14));
    const auto U = firn::left_stretch(Mat<S, 2>::rows(1, 0.25, 0, 1));
    REQUIRE(U(0, 1).value == U(1, 0).value);
}

TEST_CASE("A NaN in F is not hidden") {
    Mat<float, 3> F = Mat<float, 3>::identity();
    F(1, 2) = std::numeric_limits<float>::quiet_NaN();
    REQUIRE(std::isnan(firn::trace(firn::left_stretch(F))));
}

}  // namespace left_stretch_tests
