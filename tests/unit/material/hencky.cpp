/// \file Hencky elasticity and neo-Hookean elasticity against closed forms, and what holds for every model.
#include "support/csv.hpp"
#include "support/effort.hpp"
#include "support/materials.hpp"
#include <firn/material/hencky.hpp>
#include <firn/material/neo_hookean.hpp>

using namespace materials;

namespace hencky_tests {
namespace {

template <class S, int D>
ElasticState<double, D> strained(Random& random, double spread) {
    ElasticState<double, D> state;
    do state.F = random.rotation<D>() + random.gaussian<D>() * spread;
    while (determinant(state.F) < 0.1);
    return state;
}

template <template <class> class M, int D>
void check_model(std::uint64_t seed, double nearest) {
    Random random(seed);
    double closest = 0;
    for (int trial = 0; trial < 150; ++trial) {
        const M<double> model{random.uniform(0.1, 5), random.uniform(0, 5)};
        const ElasticState<double, D> state = strained<double, D>(random, trial % 3 ? 0.3 : 0.03);
        CAPTURE(trial);
        check_energy<M, D>(model, state, 5);
        check_turned<M, D>(model, state, random, 5);
        closest = std::max(closest, check_wave_speed<M, D>(model, state, random));
    }
    CHECK(closest > nearest);
    const auto state_of = [](int i) {
        Random of_state(std::uint64_t(400 + i));
        return strained<double, D>(of_state, 0.1);
    };
    check_nan<D>(M<float>{});
    check_lanes<float, D>(M<float>{}, state_of, 160);
    check_lanes<double, D>(M<double>{}, state_of, 80);
    for (int i = 0; i < 50; ++i) check_float<D>(M<float>{}, state_of(i), 20);

    // At rest, the pressure wave: √((λ + 2μ)/ρ).
    const M<double> model{3, 5};
    CHECK(wave_speed(model, 2.0, ElasticState<double, D>{}) == Approx(std::sqrt(11 / 2.)).epsilon(1e-14));
    CHECK(size_of(kirchhoff_stress(model, ElasticState<double, D>{})) == 0);
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("Hencky: stress from energy, objectivity, isotropy, wave speed, lanes, floats",
                       "[material][dual]", ((int D), D), FIRN_TEST_FIRST_1(3, 2)) {
    check_model<Hencky, D>(61, 0.8);
}
TEMPLATE_TEST_CASE_SIG("neo-Hookean: stress from energy, objectivity, isotropy, wave speed, lanes, floats",
                       "[material][dual]", ((int D), D), FIRN_TEST_FIRST_1(3, 2)) {
    check_model<NeoHookean, D>(62, 0.8);
}

TEMPLATE_TEST_CASE_SIG("Hencky in uniaxial strain and simple shear", "[material]", ((int D), D), 2, 3) {
    const Hencky<double> model{3, 5};
    for (const double s : {0.4, 0.99, 1.7}) {
        const Mat<double, D> tau = model.kirchhoff_stress(diagonal_of<D>({s}));
        Mat<double, D> expected = Mat<double, D>::diagonal(5 * std::log(s));
        expected(0, 0) += 6 * std::log(s);
        CHECK(size_of(tau - expected) <= 1e-14 * size_of(expected));
        CHECK(model.energy_density(diagonal_of<D>({s})) == Approx(5.5 * std::log(s) * std::log(s)).epsilon(1e-13));
    }
    for (const double k : {0.02, -0.8, 3.0}) {
        // Stretches e^{±asinh(k/2)} along directions at half the angle whose tangent is 2/k.
        const double e = std::asinh(k / 2), root = std::sqrt(4 + k * k);
        const Mat<double, D> tau = model.kirchhoff_stress(simple_shear<D>(k));
        CHECK(tau(0, 1) == Approx(6 * e * 2 / root).margin(1e-14));
        CHECK(tau(0, 0) == Approx(6 * e * k / root).margin(1e-14));
        CHECK(tau(1, 1) == Approx(-6 * e * k / root).margin(1e-14));
        CHECK(tau(D - 1, D - 1) == Approx(D == 3 ? 0 : tau(1, 1)).margin(1e-14));
    }
}

TEMPLATE_TEST_CASE("neo-Hookean: uniaxial strain of the reference table, and simple shear", "[material][reference]",
                   float, double) {
    using S = TestType;
    const double tolerance = sizeof(S) == 4 ? 1e-4 : 1e-12;
    const auto model = NeoHookean<S>::from_young_poisson(1e5, 0.3);
    int rows = 0;
    for (const csv::Row& row : csv::read("uniaxial_strain.csv")) {
        if (row.at("model") != "neo_hookean_log") continue;
        ++rows;
        const double s = csv::number(row, "lambda1"), along = csv::number(row, "tau11"),
                     across = csv::number(row, "tau22"), allowed = tolerance * std::abs(along);
        const auto flat = model.kirchhoff_stress(cast<S>(diagonal_of<2>({s})));
        const auto solid = model.kirchhoff_stress(cast<S>(diagonal_of<3>({s})));
        for (const S tau : {flat(0, 0), solid(0, 0)}) CHECK(std::abs(double(tau) - along) <= allowed);
        for (const S tau : {flat(1, 1), solid(1, 1), solid(2, 2)}) CHECK(std::abs(double(tau) - across) <= allowed);
    }
    CHECK(rows == 4);
    // J = 1: τ = μ (k², k; k, 0).
    const auto tau = model.kirchhoff_stress(cast<S>(simple_shear<3>(0.3)));
    CHECK(double(tau(0, 0)) == Approx(0.09 * double(model.mu)).epsilon(1e-5));
    CHECK(double(tau(0, 1)) == Approx(0.3 * double(model.mu)).epsilon(1e-5));
    CHECK(std::abs(double(tau(1, 1))) <= 1e-6 * double(model.mu));
}

TEMPLATE_TEST_CASE_SIG("neo-Hookean blown up along all axes: no slower than its shear waves", "[material]",
                       ((int D), D), 2, 3) {
    // Stretches of 4: of the shear wave ρ c² = μ 4². J = 4^D, and what a pressure wave adds, μ + λ (1 − ln J), is less
    // than nothing.
    const NeoHookean<double> model{1, 5};
    CHECK(model.wave_speed(2.0, Mat<double, D>::diagonal(4)) >= std::sqrt(16.0 / 2) * (1 - 1e-12));
}

TEST_CASE("Hencky crushed or inverted stays finite and pushes back; neo-Hookean inverted is NaN, not hidden",
          "[material]") {
    const Hencky<float> hencky;
    for (const float s : {0.0F, -1.0F, 1e-9F}) {
        Mat<float, 3> F = Mat<float, 3>::identity();
        F(0, 0) = s;
        const auto tau = hencky.kirchhoff_stress(F);
        for (const float t : tau.m) CHECK(std::isfinite(t));
        CHECK(tau(0, 0) < -1e5F);
        CHECK(std::isfinite(hencky.wave_speed(1000.0F, F)));
    }
    Mat<float, 3> F = Mat<float, 3>::identity();
    F(0, 0) = -1;
    CHECK(std::isnan(trace(NeoHookean<float>{}.kirchhoff_stress(F))));
    CHECK(std::isnan(NeoHookean<float>{}.wave_speed(1000.0F, F)));
}

TEST_CASE("moduli of Hencky and neo-Hookean solids: from Young and Poisson, or refused", "[material][error]") {
    CHECK(Hencky<double>::from_young_poisson(1e5, 0.3).mu == Approx(1e5 / 2.6));
    CHECK(NeoHookean<double>::from_young_poisson(1e5, 0.3).lambda == Approx(3e4 / 0.52));
    CHECK_THROWS_AS(Hencky<float>::from_young_poisson(0, 0.3), parameter_error);
    CHECK_THROWS_AS(Hencky<float>::from_young_poisson(1e39, 0.3), parameter_error);
    CHECK_THROWS_AS(NeoHookean<float>::from_young_poisson(1e5, 0.5), parameter_error);
    CHECK_THROWS_AS(NeoHookean<float>::from_young_poisson(1e39, 0.3), parameter_error);
}

}  // namespace hencky_tests
