/// \file Fixed corotated elasticity against numbers computed independently, against its own energy by dual numbers,
/// and the bound of its wave speed against the acoustic tensor.
#include "support/catch.hpp"
#include "support/csv.hpp"
#include "support/effort.hpp"
#include "support/not_finite.hpp"
#include "support/random_numbers.hpp"
#include <firn/material/fixed_corotated.hpp>

#include <limits>

using namespace firn;
using test_support::infinity;
using test_support::not_a_number;
using test_support::Random;

namespace {

template <class S, int D>
double largest(const Mat<S, D>& a) {
    double r = 0;
    for (const S& x : a.m) r = std::max(r, std::abs(double(x)));
    return r;
}
Mat<double, 3> matrix(const csv::Row& row, const std::string& name) {
    Mat<double, 3> m{};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) m(i, j) = csv::number(row, name + std::to_string(i) + std::to_string(j));
    return m;
}
template <int D>
double size_of(const Mat<double, D>& a) {
    return std::sqrt(squared_norm(a));
}
template <int D>
Mat<dual<double>, D> along(const Mat<double, D>& F, const Mat<double, D>& direction) {
    Mat<dual<double>, D> r{};
    for (int k = 0; k < D * D; ++k) r.m[k] = {F.m[k], direction.m[k]};
    return r;
}

/// ρ0 c² of the fastest plane wave along n: the largest eigenvalue of Q, where Q m = dτ n − (m·n) τ n for the change
/// dF = (m nᵀ) F. (Q m = (∂²ψ/∂F² : dF) Fᵀ n, and τ = P Fᵀ.)
template <int D>
double stiffest(const FixedCorotated<double>& model, const Mat<double, D>& F, const Vec<double, D>& n) {
    const auto lifted = lift<dual<double>>(model);
    Mat<double, D> Q{};
    for (int k = 0; k < D; ++k) {
        Vec<double, D> m = Vec<double, D>::zero();
        m[k] = 1;
        const Mat<dual<double>, D> tau = lifted.kirchhoff_stress(along(F, outer(m, n) * F));
        Mat<double, D> value{}, change{};
        for (int i = 0; i < D * D; ++i) {
            value.m[i] = tau.m[i].value;
            change.m[i] = tau.m[i].derivative;
        }
        const Vec<double, D> q = change * n - value * n * n[k];
        for (int i = 0; i < D; ++i) Q(i, k) = q[i];
    }
    const double size = size_of(Q);
    CHECK(size_of(Q - transpose(Q)) <= 1e-8 * (1 + size));  // a stress from an energy
    // Singular values are eigenvalues once all of them are positive.
    Q += Mat<double, D>::diagonal(size);
    return Eigen::JacobiSVD<Eigen::Matrix<double, D, D>>(as_eigen(Q)).singularValues()[0] - size;
}

}  // namespace

TEMPLATE_TEST_CASE("Kirchhoff stress and energy of the reference table: stretch, shear, an inverted element",
                   "[material][reference]", float, double) {
    using S = TestType;
    const double tolerance = sizeof(S) == 4 ? 1e-4 : 1e-12;  // stated with the table
    const auto model = FixedCorotated<S>::from_young_poisson(1e5, 0.3);
    for (const csv::Row& row : csv::read("kirchhoff_fixed_corotated.csv")) {
        INFO(row.at("name"));
        const Mat<S, 3> F = cast<S>(matrix(row, "F"));
        const Mat<double, 3> expected = matrix(row, "tau");
        CHECK(largest(cast<double>(model.kirchhoff_stress(F)) - expected) <= tolerance * largest(expected));
        CHECK(double(model.energy_density(F)) == Approx(csv::number(row, "psi")).epsilon(tolerance).margin(0));
    }
}

TEMPLATE_TEST_CASE("stress of uniaxial strain in closed form, 2D (plane strain) and 3D", "[material][reference]", float,
                   double) {
    using S = TestType;
    const double tolerance = sizeof(S) == 4 ? 1e-4 : 1e-12;
    const auto model = FixedCorotated<S>::from_young_poisson(1e5, 0.3);
    int rows = 0;
    for (const csv::Row& row : csv::read("uniaxial_strain.csv")) {
        if (row.at("model") != "fixed_corotated") continue;
        ++rows;
        const S stretch = S(csv::number(row, "lambda1"));
        CAPTURE(stretch);
        Mat<S, 2> F2 = Mat<S, 2>::identity();
        Mat<S, 3> F3 = Mat<S, 3>::identity();
        F2(0, 0) = F3(0, 0) = stretch;
        const auto tau2 = model.kirchhoff_stress(F2);
        const auto tau3 = model.kirchhoff_stress(F3);
        const double along_axis = csv::number(row, "tau11"), across = csv::number(row, "tau22");
        const double allowed = tolerance * std::max(std::abs(along_axis), std::abs(across));
        for (double tau : {double(tau2(0, 0)), double(tau3(0, 0))}) CHECK(std::abs(tau - along_axis) <= allowed);
        for (double tau : {double(tau2(1, 1)), double(tau3(1, 1)), double(tau3(2, 2))})
            CHECK(std::abs(tau - across) <= allowed);
    }
    CHECK(rows == 4);
}

TEMPLATE_TEST_CASE_SIG("the stress is the derivative of the energy, τ = ∂ψ/∂F Fᵀ, inverted elements included",
                       "[material][dual]", ((int D), D), FIRN_TEST_FIRST_1(3, 2)) {
    const FixedCorotated<double> model{3, 5};
    const auto lifted = lift<dual<double>>(model);
    Random random(20);
    int inverted = 0;
    for (int trial = 0; trial < 200; ++trial) {
        const Mat<double, D> F = random.deformation<D>(0.05);
        inverted += determinant(F) < 0;
        Mat<double, D> P{};
        for (int k = 0; k < D * D; ++k) {
            Mat<double, D> direction = Mat<double, D>::zero();
            direction.m[k] = 1;
            P.m[k] = lifted.energy_density(along(F, direction)).derivative;
        }
        const Mat<double, D> tau = model.kirchhoff_stress(F);
        CAPTURE(trial);
        CHECK(size_of(tau - P * transpose(F)) <= 1e-11 * (size_of(tau) + squared_norm(F) + 1));
    }
    CHECK(inverted > 50);
}

TEMPLATE_TEST_CASE_SIG("the stress turns with the body and does not see how it was turned before", "[material]",
                       ((int D), D), FIRN_TEST_FIRST_1(3, 2)) {
    const FixedCorotated<double> model{3, 5};
    Random random(21);
    for (int trial = 0; trial < 200; ++trial) {
        const Mat<double, D> F = random.deformation<D>(0.05), Q = random.rotation<D>();
        const Mat<double, D> tau = model.kirchhoff_stress(F);
        const double allowed = 1e-12 * (size_of(tau) + squared_norm(F) + 1);
        CAPTURE(trial);
        CHECK(size_of(model.kirchhoff_stress(Q * F) - Q * tau * transpose(Q)) <= allowed);
        CHECK(size_of(model.kirchhoff_stress(F * Q) - tau) <= allowed);  // isotropic
        CHECK(model.energy_density(Q * F) == Approx(model.energy_density(F)).epsilon(1e-12).margin(allowed));
    }
}

TEMPLATE_TEST_CASE_SIG("the stress is symmetric to the bit", "[material]", ((class S, int D), S, D), (float, 2),
                       (float, 3), (double, 2), (double, 3)) {
    const FixedCorotated<S> model{S(3), S(5)};
    Random random(22);
    for (int trial = 0; trial < 200; ++trial) {
        const Mat<S, D> tau = model.kirchhoff_stress(cast<S>(random.gaussian<D>()));
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < i; ++j) CHECK(tau(i, j) == tau(j, i));
    }
}

TEMPLATE_TEST_CASE_SIG("a body at rest, and a turned one, has no stress and no energy", "[material]",
                       ((class S, int D), S, D), (float, 2), (float, 3), (double, 2), (double, 3)) {
    const FixedCorotated<S> model{S(3), S(5)};
    const double epsilon = double(std::numeric_limits<S>::epsilon());
    CHECK(largest(model.kirchhoff_stress(Mat<S, D>::identity())) <= 16 * epsilon);
    Random random(23);
    for (int trial = 0; trial < 50; ++trial) {
        const Mat<S, D> R = cast<S>(random.rotation<D>());
        CHECK(largest(model.kirchhoff_stress(R)) <= 100 * epsilon);
        CHECK(std::abs(double(model.energy_density(R))) <= 100 * epsilon);
    }
}

TEMPLATE_TEST_CASE_SIG("the wave speed at rest is that of pressure waves, √((λ + 2μ)/ρ)", "[material]", ((int D), D), 2,
                       3) {
    const auto model = FixedCorotated<double>::from_young_poisson(1e5, 0.3);
    const double c = std::sqrt((model.lambda + 2 * model.mu) / 1200);
    CHECK(model.wave_speed(1200.0, Mat<double, D>::identity()) == Approx(c).epsilon(1e-14));
    Vec<double, D> n = Vec<double, D>::zero();
    n[0] = 1;
    CHECK(std::sqrt(stiffest(model, Mat<double, D>::identity(), n) / 1200) == Approx(c).epsilon(1e-9));
}

TEMPLATE_TEST_CASE_SIG("the wave speed bounds every plane wave in a deformed body that is not inverted",
                       "[material][dual]", ((int D), D), FIRN_TEST_FIRST_1(3, 2)) {
    // Checked against the largest eigenvalue of the acoustic tensor, by dual numbers through the stress.
    Random random(24);
    double closest = 0;
    for (int trial = 0; trial < 400; ++trial) {
        const FixedCorotated<double> model{random.uniform(0.1, 5), random.uniform(0, 5)};
        const double spread = random.uniform(0, 1);
        Mat<double, D> F = random.rotation<D>() + random.gaussian<D>() * spread;
        if (determinant(F) <= 0) F = random.upright_deformation<D>(0.02);
        const double bound = model.wave_speed(1.0, F);
        for (int direction = 0; direction < 8; ++direction) {
            const double speed_squared = stiffest(model, F, random.direction<D>());
            CAPTURE(trial, direction);
            CHECK(speed_squared <= bound * bound * (1 + 1e-9));
            closest = std::max(closest, speed_squared / (bound * bound));
        }
    }
    CHECK(closest > 0.9);  // a bound, and no lavish one
}

TEST_CASE("moduli from Young's modulus and Poisson's ratio", "[material]") {
    // E = 1e5 Pa, ν = 0.3: μ = E/2.6, λ = 3e4/0.52.
    const auto model = FixedCorotated<double>::from_young_poisson(1e5, 0.3);
    CHECK(model.mu == Approx(1e5 / 2.6).epsilon(1e-15));
    CHECK(model.lambda == Approx(3e4 / 0.52).epsilon(1e-14));
    const auto same = FixedCorotated<double>::from_lame(model.mu, model.lambda);
    CHECK(same.mu == model.mu);
    CHECK(same.lambda == model.lambda);
    CHECK(FixedCorotated<double>{}.mu == Approx(model.mu).epsilon(1e-15));  // the default
    CHECK(FixedCorotated<double>{}.lambda == Approx(model.lambda).epsilon(1e-14));
    CHECK(FixedCorotated<double>::from_young_poisson(1e5, -0.5).lambda < 0);  // an auxetic solid
    CHECK(FixedCorotated<float>::from_young_poisson(1e5, 0.4999).lambda > 1e8f);
}

TEMPLATE_TEST_CASE("impossible moduli are refused", "[material][error]", float, double) {
    using Model = FixedCorotated<TestType>;
    for (double young : {0.0, -1e5, not_a_number, infinity}) {
        CAPTURE(young);
        CHECK_THROWS_AS(Model::from_young_poisson(young, 0.3), parameter_error);
    }
    for (double poisson : {0.5, 0.7, -1.0, -2.0, not_a_number, infinity, -infinity}) {
        CAPTURE(poisson);
        CHECK_THROWS_AS(Model::from_young_poisson(1e5, poisson), parameter_error);
    }
    CHECK_THROWS_AS(Model::from_lame(-1, 5), parameter_error);
    CHECK_THROWS_AS(Model::from_lame(not_a_number, 5), parameter_error);
    CHECK_THROWS_AS(Model::from_lame(3, not_a_number), parameter_error);
    CHECK_THROWS_AS(Model::from_lame(3, infinity), parameter_error);
    CHECK_THROWS_AS(Model::from_lame(infinity, 5), parameter_error);
    CHECK_THROWS_AS(Model::from_lame(3, -2), parameter_error);  // bulk modulus 0
    CHECK_THROWS_AS(Model::from_lame(0, 0), parameter_error);
    CHECK_NOTHROW(Model::from_lame(0, 5));
    CHECK_NOTHROW(Model::from_lame(3, -1.9));
}

TEST_CASE("moduli that are infinite as a float are refused, though finite as a double", "[material][error]") {
    CHECK_THROWS_AS(FixedCorotated<float>::from_young_poisson(1e39, 0.3), parameter_error);
    CHECK_THROWS_AS(FixedCorotated<float>::from_lame(1, 1e39), parameter_error);
    CHECK_NOTHROW(FixedCorotated<double>::from_lame(1, 1e39));
}

TEST_CASE("the sentence of a refused modulus says what was given and what is allowed", "[material][error]") {
    try {
        FixedCorotated<float>::from_young_poisson(1e5, 0.5);
        FAIL("accepted");
    } catch (const parameter_error& error) {
        const std::string text = error.what();
        CHECK(text.find("0.5") != std::string::npos);
        CHECK(text.find("between") != std::string::npos);
    }
}
