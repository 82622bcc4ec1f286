/// \file Non-associated Cam clay: closed forms, the ellipse of each case of the return mapping, hardening and
/// softening, and what holds for every model.
#include "support/effort.hpp"
#include "support/materials.hpp"
#include <firn/material/nacc.hpp>

using namespace materials;

namespace nacc_tests {
namespace {

template <int D>
using Clay = Nacc<double>::state<D>;

struct Invariants {
    double p, q, J;
};
/// By the definitions of Wolper et al. 2019, from the stress: p = −tr τ / D, q = √((6 − D)/2) ‖dev τ‖.
template <int D>
Invariants invariants(const Nacc<double>& model, const Clay<D>& state) {
    Mat<double, D> tau = kirchhoff_stress(model, state);
    const double p = -trace(tau) / D;
    tau += Mat<double, D>::diagonal(p);
    return {p, std::sqrt((6 - D) / 2.) * size_of(tau), determinant(state.F)};
}
template <int D>
double kappa(const Nacc<double>& model) {
    return model.lambda + 2 * model.mu / D;
}
template <int D>
double pressure_of_consolidation(const Nacc<double>& model, double log_volume) {
    const double alpha = model.first_log_volume + log_volume;
    return kappa<D>(model) * (1e-5 + std::sinh(std::min(2.0, model.hardening * std::max(-alpha, 0.0))));
}
template <int D>
double slope(double degrees) {  // M = 6 sin φ / (3 − sin φ), the textbook's, and 2 sin φ in the plane
    const double sine = std::sin(degrees * std::numbers::pi / 180);
    return D == 3 ? 6 * sine / (3 - sine) : 2 * sine;
}
template <int D>
Clay<D> strained(Random& random, double spread) {
    Clay<D> state;
    do state.F = random.rotation<D>() + random.gaussian<D>() * spread;
    while (determinant(state.F) < 0.2);
    state.log_volume = random.uniform(-0.1, 0.005);
    return state;
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("Cam clay in uniaxial strain and simple shear", "[material]", ((int D), D), 2, 3) {
    const auto model = Nacc<double>::from_properties({});
    const double mu = model.mu, k = kappa<D>(model);
    for (const double s : {0.8, 0.99, 1.1}) {
        // b = diag(s², 1, …), J = s.
        const double scale = std::pow(s, -2. / D), mean = (s * s + D - 1) / D;
        const Mat<double, D> tau = kirchhoff_stress(model, Clay<D>{diagonal_of<D>({s}), 0});
        CHECK(tau(0, 0) == Approx(mu * scale * (s * s - mean) + k / 2 * (s * s - 1)).epsilon(1e-12));
        CHECK(tau(1, 1) == Approx(mu * scale * (1 - mean) + k / 2 * (s * s - 1)).epsilon(1e-12));
        CHECK(energy_density(model, Clay<D>{diagonal_of<D>({s}), 0}) ==
              Approx(mu / 2 * D * (scale * mean - 1) + k / 2 * ((s * s - 1) / 2 - std::log(s))).epsilon(1e-9));
    }
    const double g = 0.2;
    const Mat<double, D> tau = kirchhoff_stress(model, Clay<D>{simple_shear<D>(g), 0});
    CHECK(tau(0, 1) == Approx(mu * g).epsilon(1e-12));
    CHECK(tau(0, 0) == Approx(mu * g * g * (1 - 1. / D)).epsilon(1e-10));
    // At rest: κ + (2 − 2/D) μ = λ + 2 μ along an axis.
    CHECK(kappa<D>(model) + (2 - 2. / D) * mu == Approx(model.lambda + 2 * mu).epsilon(1e-14));
}

TEMPLATE_TEST_CASE_SIG("each case of the return ends on the ellipse of the trial: crushed, torn, sheared", "[material]",
                       ((int D), D), 2, 3) {
    const auto model = Nacc<double>::from_properties({});
    const double M = slope<D>(45), beta = 0.5, k = kappa<D>(model);
    CHECK(model.critical_slope<D>() == Approx(M).epsilon(1e-14));
    // ‖dev τ‖ = q/√((6 − D)/2) and tr τ = −D p.
    CHECK(friction_slope<D>(model.friction_sine) * D * std::sqrt((6 - D) / 2.) == Approx(M).epsilon(1e-14));
    Random random(81);
    int crushed = 0, torn = 0, hardens = 0, softens = 0, elastic = 0;
    for (int trial = 0; trial < 4000; ++trial) {
        Clay<D> state = strained<D>(random, trial % 2 ? 0.1 : 0.01);
        state.F = state.F * (1 + random.uniform(-0.05, 0.02));
        const double p0 = pressure_of_consolidation<D>(model, state.log_volume);
        const auto [p, q, J] = invariants(model, state);
        const double y = q * q * (1 + 2 * beta) + M * M * (p + beta * p0) * (p - p0);
        const Clay<D> after = model.returned(state);
        const auto [p1, q1, J1] = invariants(model, after);
        const double change = after.log_volume - state.log_volume;
        CAPTURE(trial, p, q, p0);
        CHECK(q1 * q1 * (1 + 2 * beta) + M * M * (p1 + beta * p0) * (p1 - p0) <= 1e-11 * k * k);
        CHECK(energy_density(model, after) <= energy_density(model, state) + 1e-12 * k);  // nothing is gained
        const Mat<double, D> left = state.F * transpose(after.F), right = transpose(state.F) * after.F;
        CHECK(size_of(left - transpose(left)) <= 1e-13);
        CHECK(size_of(right - transpose(right)) <= 1e-13);
        if (p > p0 || p < -beta * p0) {
            (p > p0 ? crushed : torn) += 1;
            CHECK(p1 == Approx(p > p0 ? p0 : -beta * p0).margin(1e-12 * k));
            CHECK(q1 <= 1e-12 * k);
            CHECK(change == Approx(std::log(J / J1)).margin(1e-12));
            CHECK((p > p0) == (change < 0));
        } else if (y > 1e-9 * k * k) {
            CHECK(p1 == Approx(p).margin(1e-11 * k));
            CHECK(J1 == Approx(J).epsilon(1e-11));
            CHECK(q1 * q1 * (1 + 2 * beta) == Approx(-M * M * (p + beta * p0) * (p - p0)).margin(1e-11 * k * k));
            // Where the line from the trial to the middle of the ellipse meets it, by bisection.
            const double middle = (1 - beta) / 2 * p0;
            double inner = 0, outer = 1;
            for (int i = 0; i < 60; ++i) {
                const double r = (inner + outer) / 2, x = middle + r * (p - middle);
                const double f = r * r * q * q * (1 + 2 * beta) + M * M * (x + beta * p0) * (x - p0);
                (f > 0 ? outer : inner) = r;
            }
            const double met = middle + inner * (p - middle);
            CHECK(change == Approx(std::log(J / std::sqrt(1 - 2 * met / k))).margin(1e-11));
            (change < 0 ? hardens : softens) += 1;
            CHECK((change < 0) == (p > middle));
        } else if (y < -1e-9 * k * k) {
            ++elastic;
            CHECK(same_bits(after, state));
        }
        // A second return from the surface that has not shrunk changes nothing.
        if (change <= 0) CHECK(size_of(model.returned(after).F - after.F) <= 1e-6);
    }
    for (const int n : {crushed, torn, hardens, softens, elastic}) CHECK(n > 30);
}

TEST_CASE("the consolidation pressure is what was asked for, hardens with ξ and is bounded", "[material]") {
    const double k = 1e6 / (3 * (1 - 0.6));
    const auto model = Nacc<double>::from_properties({.consolidation = 3e4, .hardening = 5});
    CHECK(k * model.consolidation(0) == Approx(3e4 + 1e-5 * k).epsilon(1e-12));
    const double alpha = -std::asinh(3e4 / k) / 5;
    for (const double change : {-0.05, -0.2, 0.003})
        CHECK(model.consolidation(change) ==
              Approx(1e-5 + std::sinh(5 * std::max(0.0, -(alpha + change)))).epsilon(1e-8));
    CHECK(model.consolidation(1) == 1e-5);
    CHECK(model.consolidation(-100) == Approx(std::sinh(2.0) + 1e-5).epsilon(1e-8));
    CHECK(std::isfinite(double(Nacc<float>{}.consolidation(-1e30F))));
}

TEMPLATE_TEST_CASE_SIG("Cam clay: stress from energy, objectivity, isotropy, wave speed, lanes, floats, NaN",
                       "[material][dual]", ((int D), D), FIRN_TEST_FIRST_1(3, 2)) {
    const auto model = Nacc<double>::from_properties({});
    Random random(82);
    double closest = 0;
    for (int trial = 0; trial < 100; ++trial) {
        const Clay<D> state = strained<D>(random, trial % 2 ? 0.15 : 0.02);
        CAPTURE(trial);
        check_energy<Nacc, D>(model, state, model.mu);
        check_turned<Nacc, D>(model, state, random, model.mu);
        closest = std::max(closest, check_wave_speed<Nacc, D>(model, state, random));
    }
    CHECK(closest > 0.6);
    const auto state_of = [](int i) {
        Random of_state(std::uint64_t(600 + i));
        return strained<D>(of_state, i % 2 ? 0.1 : 0.01);
    };
    const auto small = Nacc<float>::from_properties({});
    check_nan<D>(small);
    check_lanes<float, D>(small, state_of, 320);
    check_lanes<double, D>(model, state_of, 80);
    for (int i = 0; i < 50; ++i) {
        CAPTURE(i);
        check_float<D>(small, state_of(i), 400);
    }
}

TEST_CASE("Cam clay without volume, inverted or immensely stretched stays finite", "[material]") {
    const Nacc<float> model;
    for (const float first : {0.0F, -0.7F, -1.3F, 1e-9F, 1e3F}) {
        Nacc<float>::state<3> state;
        state.F(0, 0) = first;
        const auto after = model.returned(state);
        for (const double number : numbers_of(after)) CHECK(std::isfinite(number));
        for (const float tau : kirchhoff_stress(model, after).m) CHECK(std::isfinite(tau));
        CHECK(std::isfinite(wave_speed(model, 1000.0F, after)));
        if (first == 0 || first > 1) continue;
        check_upright(after.F, 0.9, 1);  // crushed: inverted matter has no volume
    }
}

TEST_CASE("Cam clay refuses properties that are none", "[material][error]") {
    const auto from = [](const NaccProperties& p) { return Nacc<float>::from_properties(p); };
    CHECK_THROWS_AS(from({.young = 0}), parameter_error);
    CHECK_THROWS_AS(from({.poisson = 0.5}), parameter_error);
    CHECK_THROWS_AS(from({.friction_angle = degrees(90)}), parameter_error);
    for (const double wrong : {-1.0, std::nan(""), double(INFINITY)})
        CHECK_THROWS_AS(from({.cohesion = wrong}), parameter_error);
    for (const double wrong : {0.0, -1.0, std::nan(""), 5e5})
        CHECK_THROWS_AS(from({.consolidation = wrong}), parameter_error);
    for (const double wrong : {0.0, -1.0, std::nan(""), double(INFINITY)})
        CHECK_THROWS_AS(from({.hardening = wrong}), parameter_error);
    const Nacc<float> defaults, same = from({});
    CHECK(double(defaults.mu) == Approx(double(same.mu)).epsilon(1e-7));
    CHECK(double(defaults.lambda) == Approx(double(same.lambda)).epsilon(1e-7));
    CHECK(double(defaults.friction_sine) == Approx(double(same.friction_sine)).epsilon(1e-7));
    CHECK(double(defaults.first_log_volume) == Approx(double(same.first_log_volume)).epsilon(1e-6));
}

}  // namespace nacc_tests
