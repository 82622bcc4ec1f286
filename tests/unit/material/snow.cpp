/// \file Snow against closed forms worked out here, its return mapping against singular values from Eigen, and what
/// holds for every model.
#include "support/effort.hpp"
#include "support/materials.hpp"
#include <firn/material/snow.hpp>

using namespace materials;

namespace snow_tests {
namespace {

template <int D>
using SnowState = Snow<double>::state<D>;

const Snow<double>& paper() {
    static const Snow<double> snow = Snow<double>::from_properties({});
    return snow;
}
template <int D>
SnowState<D> strained(Random& random, double spread) {
    SnowState<D> state;
    state.F = random.rotation<D>() + random.gaussian<D>() * spread;
    state.plastic_volume = random.uniform(0.8, 1.2);
    return state;
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("snow in uniaxial strain and simple shear, hardened and not, has the stress of the paper's (1)",
                       "[material]", ((int D), D), 2, 3) {
    // μ0 = E / 2.4, λ0 = 0.2 E / (1.2 · 0.6), E = 1.4e5; hardened by e^{10 (1 − J_P)}.
    for (const double plastic : {1.0, 0.9, 1.05}) {
        const double factor = std::exp(10 * (1 - plastic));
        const double mu = 1.4e5 / 2.4 * factor, lambda = 2.8e4 / 0.72 * factor;
        for (const double s : {0.98, 1.005, 0.7}) {
            // One stretch s: R = I, J = s, τ = 2μ (s² − s) + λ (s − 1) s along, λ (s − 1) s across.
            const SnowState<D> state{diagonal_of<D>({s}), plastic};
            const Mat<double, D> tau = kirchhoff_stress(paper(), state);
            Mat<double, D> expected = Mat<double, D>::diagonal(lambda * (s - 1) * s);
            expected(0, 0) += 2 * mu * (s * s - s);
            CHECK(size_of(tau - expected) <= 1e-12 * (mu + lambda));
            CHECK(energy_density(paper(), state) == Approx((mu + lambda / 2) * (s - 1) * (s - 1)).epsilon(1e-9));
        }
        for (const double k : {0.01, -0.3}) {
            // F turns by tan θ = k/2: V = F Rᵀ = (c + k s, s; s, c) with c = 2/√(4 + k²), s = k/√(4 + k²).
            const double c = 2 / std::sqrt(4 + k * k), s = k / std::sqrt(4 + k * k);
            const Mat<double, D> tau = kirchhoff_stress(paper(), SnowState<D>{simple_shear<D>(k), plastic});
            CHECK(tau(0, 0) == Approx(2 * mu * (1 + k * k - c - k * s)).margin(1e-12 * mu));
            CHECK(tau(0, 1) == Approx(2 * mu * (k - s)).margin(1e-12 * mu));
            CHECK(tau(1, 1) == Approx(2 * mu * (1 - c)).margin(1e-12 * mu));
        }
    }
}

TEMPLATE_TEST_CASE_SIG("snow: stress from energy, objectivity, isotropy and the bound of the wave speed",
                       "[material][dual]", ((int D), D), FIRN_TEST_FIRST_1(3, 2)) {
    Random random(31);
    double closest = 0;
    for (int trial = 0; trial < 100; ++trial) {
        const SnowState<D> state = strained<D>(random, 0.05);
        const double modulus = paper().hardened(state.plastic_volume).mu;
        CAPTURE(trial);
        check_energy<Snow, D>(paper(), state, modulus);
        check_turned<Snow, D>(paper(), state, random, modulus);
        closest = std::max(closest, check_wave_speed<Snow, D>(paper(), state, random));
    }
    CHECK(closest > 0.8);
}

TEMPLATE_TEST_CASE_SIG("returned snow has its singular values clamped, the directions of the trial, and the volume",
                       "[material]", ((int D), D), 2, 3) {
    Random random(32);
    int crushed = 0, torn = 0, elastic = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        SnowState<D> state = strained<D>(random, trial % 2 ? 0.02 : 0.002);
        if (determinant(state.F) <= 0) continue;
        const SnowState<D> after = paper().returned(state);
        const Vec<double, D> before = singular_values(state.F), now = singular_values(after.F);
        double volume = state.plastic_volume;
        bool inside = true;
        for (int i = 0; i < D; ++i) {
            const double clamped = std::min(std::max(before[i], 0.975), 1.0075);
            CHECK(now[i] == Approx(clamped).epsilon(1e-14));
            volume *= before[i] / clamped;
            inside = inside && clamped == before[i];
            crushed += before[i] < 0.975;
            torn += before[i] > 1.0075;
        }
        CHECK(after.plastic_volume == Approx(volume).epsilon(1e-13));
        CHECK(determinant(after.F) * after.plastic_volume ==
              Approx(determinant(state.F) * state.plastic_volume).epsilon(1e-13));
        if (inside) {
            ++elastic;
            CHECK(same_bits(after, state));
        }
        // F = U Σ Vᵀ becomes U Σ′ Vᵀ: F F′ᵀ and FᵀF′ stay symmetric.
        const Mat<double, D> left = state.F * transpose(after.F), right = transpose(state.F) * after.F;
        CHECK(size_of(left - transpose(left)) <= 1e-14);
        CHECK(size_of(right - transpose(right)) <= 1e-14);
        const SnowState<D> again = paper().returned(after);
        CHECK(size_of(again.F - after.F) <= 1e-14);
        CHECK(again.plastic_volume == Approx(after.plastic_volume).epsilon(1e-14));
    }
    CHECK(crushed > 100);
    CHECK(torn > 100);
    CHECK(elastic > 100);
}

TEST_CASE("snow in a flow: F follows it, then returns", "[material]") {
    // Along x at 3 /s for 0.01 s: 1.03, cut to 1.0075; J_P takes the rest.
    Mat<double, 3> L = Mat<double, 3>::zero();
    L(0, 0) = 3;
    const auto after = updated(paper(), SnowState<3>{}, L, 0.01);
    CHECK(after.F(0, 0) == Approx(1.0075).epsilon(1e-15));
    CHECK(after.F(1, 1) == Approx(1).epsilon(1e-15));
    CHECK(after.plastic_volume == Approx(1.03 / 1.0075).epsilon(1e-14));
    L(0, 0) = 0.5;
    CHECK(updated(paper(), SnowState<3>{}, L, 0.01).F(0, 0) == 1 + 0.5 * 0.01);
}

TEMPLATE_TEST_CASE_SIG("crushed snow hardens up to a bound, and nothing overflows", "[material]",
                       ((class S, int D), S, D), (float, 2), (float, 3), (double, 2), (double, 3)) {
    const auto snow = Snow<S>::from_properties({.hardening = 1000});
    typename Snow<S>::template state<D> state;
    state.plastic_volume = 0;
    const double fresh = double(snow.mu);
    CHECK(double(snow.hardened(S(0.9)).mu) == Approx(fresh * std::exp(4.0)).epsilon(1e-6));
    CHECK(std::isfinite(double(wave_speed(snow, S(400), state))));
    for (int step = 0; step < 200; ++step) {
        state = updated(snow, state, Mat<S, D>::diagonal(S(step < 100 ? -50 : 90)), S(0.01));
        for (const double number : numbers_of(state)) REQUIRE(std::isfinite(number));
        for (const S& tau : kirchhoff_stress(snow, state).m) REQUIRE(std::isfinite(double(tau)));
    }
    CHECK(double(state.plastic_volume) <= 0x1p20);
}

TEMPLATE_TEST_CASE_SIG("an inverted F, one without volume and zero leave a finite, upright state", "[material]",
                       ((class S, int D), S, D), (float, 2), (float, 3), (double, 2), (double, 3)) {
    const Snow<S> snow;
    typename Snow<S>::template state<D> state;
    state.F(0, 0) = S(-0.9);
    auto after = snow.returned(state);
    CHECK(double(determinant(after.F)) > 0.9);
    CHECK(after.plastic_volume == S(0));
    state.F(0, 0) = S(-1);  // within the bounds but for its sign
    CHECK(double(determinant(snow.returned(state).F)) > 0.9);
    for (const double first : {0.0, 1e-30}) {
        state.F = Mat<S, D>::identity();
        state.F(0, 0) = S(first);
        after = snow.returned(state);
        for (const double number : numbers_of(after)) CHECK(std::isfinite(number));
    }
    state.F = Mat<S, D>::zero();
    for (const double number : numbers_of(snow.returned(state))) CHECK(std::isfinite(number));
}

TEMPLATE_TEST_CASE_SIG("snow in lanes gives the bits of plain numbers, and floats are as near to doubles as they can",
                       "[material]", ((int D), D), FIRN_TEST_FIRST_1(3, 2)) {
    const auto state_of = [](int i) {
        Random random(std::uint64_t(100 + i));
        SnowState<D> state = strained<D>(random, i % 3 ? 0.03 : 0.001);
        if (i % 17 == 0) state.F = state.F * -1.0;
        return state;
    };
    check_nan<D>(Snow<float>{});
    check_lanes<float, D>(Snow<float>{}, state_of, 320);
    check_lanes<double, D>(Snow<double>{}, state_of, 160);
    for (int i = 1; i < 100; ++i) {
        SnowState<D> state = state_of(i);
        if (determinant(state.F) < 0.5) continue;
        CAPTURE(i);
        check_float<D>(Snow<float>{}, state, 40);
    }
}

TEST_CASE("snow refuses properties that are none", "[material][error]") {
    const auto from = [](const SnowProperties& p) { return Snow<float>::from_properties(p); };
    CHECK_THROWS_AS(from({.young = -1}), parameter_error);
    CHECK_THROWS_AS(from({.poisson = 0.5}), parameter_error);
    for (const double wrong : {0.0, 1.0, -0.1, std::nan("")})
        CHECK_THROWS_AS(from({.critical_compression = wrong}), parameter_error);
    for (const double wrong : {0.0, -0.1, std::nan(""), double(INFINITY)})
        CHECK_THROWS_AS(from({.critical_stretch = wrong}), parameter_error);
    for (const double wrong : {-1.0, std::nan(""), double(INFINITY)})
        CHECK_THROWS_AS(from({.hardening = wrong}), parameter_error);
    const Snow<float> defaults, same = from({});
    CHECK(defaults.mu == same.mu);
    CHECK(double(defaults.lambda) == Approx(double(same.lambda)).epsilon(1e-7));
    CHECK(defaults.lowest_stretch == same.lowest_stretch);
    CHECK(defaults.highest_stretch == same.highest_stretch);
}

}  // namespace snow_tests
