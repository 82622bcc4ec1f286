/// \file Sand against Mohr and Coulomb, its return mapping against the cone, the volume correction over a cycle, and
/// what holds for every model. Strains and stresses are taken from Eigen's singular values.
#include "support/effort.hpp"
#include "support/materials.hpp"
#include <firn/material/sand.hpp>

using namespace materials;

namespace sand_tests {
namespace {

template <int D>
using SandState = Sand<double>::state<D>;
constexpr double pi = std::numbers::pi;

/// Principal stresses by the definition of Hencky elasticity.
template <int D>
std::array<double, D> stresses(const Sand<double>& sand, const Mat<double, D>& F) {
    const Vec<double, D> s = singular_values(F);
    double volumetric = 0;
    for (int i = 0; i < D; ++i) volumetric += std::log(s[i]);
    std::array<double, D> tau{};
    for (int i = 0; i < D; ++i) tau[std::size_t(i)] = 2 * sand.mu * std::log(s[i]) + sand.lambda * volumetric;
    return tau;
}
/// ‖dev τ‖ + α tr τ, and ‖dev τ‖.
template <int D>
std::pair<double, double> yield(const Sand<double>& sand, const Mat<double, D>& F, double sine) {
    const auto tau = stresses<D>(sand, F);
    double trace = 0, square = 0;
    for (const double t : tau) trace += t;
    for (const double t : tau) square += (t - trace / D) * (t - trace / D);
    const double alpha = D == 3 ? std::sqrt(2. / 3) * 2 * sine / (3 - sine) : sine / std::sqrt(2.);
    return {std::sqrt(square) + alpha * trace, std::sqrt(square)};
}
template <int D>
SandState<D> strained(Random& random, double spread) {
    SandState<D> state;
    do state.F = random.rotation<D>() + random.gaussian<D>() * spread;
    while (determinant(state.F) < 0.05);
    return state;
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("returned sand lies in the cone, with the volume and the directions of the trial, or at its tip",
                       "[material]", ((int D), D), 2, 3) {
    const auto sand = Sand<double>::from_properties({});
    const double sine = std::sin(35 * pi / 180), modulus = sand.mu;
    Random random(41);
    int tips = 0, slips = 0, elastic = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        SandState<D> state = strained<D>(random, trial % 2 ? 0.1 : 0.01);
        state.F = state.F * (trial % 3 ? 0.97 : 1.0);
        const SandState<D> after = sand.returned(state);
        const double before = yield(sand, state.F, sine).first;
        const double volumetric = std::log(determinant(state.F));
        CHECK(yield(sand, after.F, sine).first <= 1e-13 * modulus);
        CHECK(energy_density(sand, after) <= energy_density(sand, state) * (1 + 1e-12));  // nothing is gained
        if (volumetric > 0) {
            ++tips;
            CHECK(size_of(after.F * transpose(after.F) - Mat<double, D>::identity()) <= 1e-13);
            CHECK(after.volume_gain == Approx(volumetric).margin(1e-14));
            CHECK(after.plastic_strain > 0);
        } else if (before > 1e-9 * modulus) {
            ++slips;
            CHECK(std::abs(yield(sand, after.F, sine).first) <= 1e-13 * modulus);
            CHECK(determinant(after.F) == Approx(determinant(state.F)).epsilon(1e-13));
            CHECK(after.volume_gain == 0);
            // δγ is how much shorter the deviator of the strain has become.
            const double shorter =
                (yield(sand, state.F, sine).second - yield(sand, after.F, sine).second) / (2 * modulus);
            CHECK(after.plastic_strain == Approx(shorter).margin(1e-13));
        } else if (before < -1e-9 * modulus) {
            ++elastic;
            CHECK(same_bits(after, state));
        }
        const Mat<double, D> left = state.F * transpose(after.F), right = transpose(state.F) * after.F;
        CHECK(size_of(left - transpose(left)) <= 1e-14);
        CHECK(size_of(right - transpose(right)) <= 1e-14);
        if (volumetric < 0) CHECK(size_of(sand.returned(after).F - after.F) <= 1e-14);
    }
    CHECK(tips > 100);
    CHECK(slips > 100);
    CHECK(elastic > 100);
}

TEST_CASE("sand fails where Mohr and Coulomb say: in 2D always, in 3D in triaxial compression", "[material]") {
    for (const double angle : {10.0, 35.0, 50.0}) {
        const auto sand = Sand<double>::from_properties({.friction_angle = degrees(angle)});
        const double sine = std::sin(angle * pi / 180);
        // Pressed hard along the first axis, stretched a little along the others: (p₁ − p₃) = (p₁ + p₃) sin φ.
        SandState<2> flat{diagonal_of<2>({0.8, 1.08})};
        const auto two = stresses<2>(sand, sand.returned(flat).F);
        CHECK(two[0] - two[1] == Approx(-sine * (two[0] + two[1])).epsilon(1e-12));
        SandState<3> solid{diagonal_of<3>({0.8, 1.08, 1.08})};
        const auto three = stresses<3>(sand, sand.returned(solid).F);
        CHECK(three[0] == Approx(three[1]).epsilon(1e-12));
        CHECK(three[0] - three[2] == Approx(-sine * (three[0] + three[2])).epsilon(1e-12));
    }
}

TEMPLATE_TEST_CASE_SIG("sand that has opened bears no pressure until it is closed again", "[material]", ((int D), D), 2,
                       3) {
    const auto sand = Sand<double>::from_properties({});
    SandState<D> state;
    const auto flow = [&](double rate) {  // of the logarithm of each stretch
        const double factor = std::expm1(rate);
        state = updated(sand, state, Mat<double, D>::diagonal(factor), 1.0);
    };
    for (int i = 0; i < 3; ++i) flow(0.01);
    CHECK(state.volume_gain == Approx(0.03 * D).epsilon(1e-12));
    CHECK(size_of(kirchhoff_stress(sand, state)) <= 1e-9);
    for (int i = 0; i < 2; ++i) flow(-0.01);
    CHECK(state.volume_gain == Approx(0.01 * D).epsilon(1e-12));
    CHECK(size_of(kirchhoff_stress(sand, state)) <= 1e-9);
    flow(-0.015);  // half a hundredth more than what was open
    CHECK(state.volume_gain == 0);
    const double pressure = (2 * sand.mu + D * sand.lambda) * 0.005;
    const Mat<double, D> tau = kirchhoff_stress(sand, state);
    CHECK(size_of(tau + Mat<double, D>::diagonal(pressure)) <= 1e-9 * pressure);
}

TEMPLATE_TEST_CASE_SIG("sand gathers as plastic strain how far its return mapping goes, at the tip as on the cone",
                       "[material]", ((int D), D), 2, 3) {
    // Klár et al. 2016: q grows by δγ on the cone and by ‖ε‖ at its tip, the length of the plastic Hencky strain of
    // the step. Volume that was gained before is plastic strain of earlier steps, and is not added again.
    const auto sand =
        Sand<double>::from_properties({.hardening = degrees(9), .hardening_decay = 0.2, .initial_loss = degrees(10)});
    Random random(43);
    int tips = 0, slips = 0, open_before = 0;
    for (int trial = 0; trial < 300; ++trial) {
        auto state = strained<D>(random, 0.2);
        state.volume_gain = trial % 3 == 0 ? random.uniform(0, 0.05) : 0;
        state.plastic_strain = random.uniform(0, 2);
        const auto after = sand.returned(state);
        const bool at_tip = after.volume_gain > 0;
        const Vec<double, D> from = singular_values(state.F), to = singular_values(after.F);
        double square = 0;
        for (int i = 0; i < D; ++i) {
            const double lost = at_tip ? 0 : state.volume_gain / D;  // on the cone: of the shape, not of the volume
            const double plastic = std::log(from[i]) + lost - std::log(to[i]);
            square += plastic * plastic;
        }
        CHECK(after.plastic_strain - state.plastic_strain == Approx(std::sqrt(square)).margin(1e-12));
        (at_tip ? tips : slips) += square > 1e-6;
        open_before += at_tip && state.volume_gain > 0;
    }
    CHECK((tips > 50 && slips > 50 && open_before > 20));
}

TEST_CASE("sand that hangs open for a thousand steps keeps its friction angle", "[material]") {
    // 15° at first, 35° once q is large. Sand opens by 3 % along each axis: q is √3 · 0.03, φ hardly moves.
    const auto sand = Sand<double>::from_properties(
        {.friction_angle = degrees(35), .hardening = degrees(9), .hardening_decay = 0.2, .initial_loss = degrees(20)});
    Sand<double>::state<3> state;
    for (int i = 0; i < 30; ++i) state = updated(sand, state, Mat<double, 3>::diagonal(std::expm1(0.001)), 1.0);
    CHECK(state.plastic_strain == Approx(0.03 * std::sqrt(3.)).epsilon(1e-10));
    const double slope = sand.slope<3>(state.plastic_strain);
    for (int i = 0; i < 1000; ++i) state = updated(sand, state, Mat<double, 3>::zero(), 1.0);
    CHECK(state.plastic_strain == Approx(0.03 * std::sqrt(3.)).epsilon(1e-10));
    CHECK(sand.slope<3>(state.plastic_strain) == slope);
}

TEST_CASE("sand hardens as in Klár et al. 2016, table 3: φ = 35° + (9° q − 10°) e^{−0.2 q}", "[material]") {
    const auto sand = Sand<double>::from_properties(
        {.friction_angle = degrees(35), .hardening = degrees(9), .hardening_decay = 0.2, .initial_loss = degrees(10)});
    for (const double q : {0.0, 0.3, 2.0, 8.0, 50.0}) {
        const double phi = (35 + (9 * q - 10) * std::exp(-0.2 * q)) * pi / 180;
        CHECK(sand.slope<3>(q) == Approx(std::sqrt(2. / 3) * 2 * std::sin(phi) / (3 - std::sin(phi))).epsilon(1e-13));
        CHECK(sand.slope<2>(q) == Approx(std::sin(phi) / std::sqrt(2.)).epsilon(1e-13));
    }
    CHECK(Sand<double>{}.slope<2>(7.0) == Approx(std::sin(35 * pi / 180) / std::sqrt(2.)).epsilon(1e-14));
}

TEMPLATE_TEST_CASE_SIG("sand: stress from energy, objectivity, isotropy and the bound of the wave speed",
                       "[material][dual]", ((int D), D), FIRN_TEST_FIRST_1(3, 2)) {
    Random random(42);
    const auto sand = Sand<double>::from_properties({});
    double closest = 0;
    for (int trial = 0; trial < 100; ++trial) {
        const SandState<D> state = strained<D>(random, trial % 2 ? 0.2 : 0.03);
        CAPTURE(trial);
        check_energy<Sand, D>(sand, state, sand.mu);
        check_turned<Sand, D>(sand, state, random, sand.mu);
        closest = std::max(closest, check_wave_speed<Sand, D>(sand, state, random));
    }
    CHECK(closest > 0.8);
}

TEMPLATE_TEST_CASE_SIG("sand in lanes gives the bits of plain numbers, and floats are as near to doubles as they can",
                       "[material]", ((int D), D), FIRN_TEST_FIRST_1(3, 2)) {
    const auto state_of = [](int i) {
        Random random(std::uint64_t(200 + i));
        SandState<D> state = strained<D>(random, i % 3 ? 0.05 : 0.005);
        if (i % 4 == 0) state.F = state.F * 0.9;
        if (i % 5 == 0) state.volume_gain = 0.03;
        state.plastic_strain = random.uniform(0, 2);
        return state;
    };
    const SandProperties hardening{
        .friction_angle = degrees(35), .hardening = degrees(9), .hardening_decay = 0.2, .initial_loss = degrees(10)};
    check_nan<D>(Sand<float>{});
    check_lanes<float, D>(Sand<float>::from_properties(hardening), state_of, 320);
    check_lanes<double, D>(Sand<double>::from_properties(hardening), state_of, 160);
    for (int i = 0; i < 100; ++i) {
        CAPTURE(i);
        check_float<D>(Sand<float>::from_properties(hardening), state_of(i), 40);
    }
}

TEMPLATE_TEST_CASE_SIG("sand without volume, inverted or immensely stretched stays finite", "[material]",
                       ((class S, int D), S, D), (float, 2), (float, 3), (double, 2), (double, 3)) {
    const Sand<S> sand;
    for (const double first : {0.0, -0.7, 1e-12, 1e12}) {
        typename Sand<S>::template state<D> state;
        state.F(0, 0) = S(first);
        const auto after = sand.returned(state);
        for (const double number : numbers_of(after)) CHECK(std::isfinite(number));
        for (const S& tau : kirchhoff_stress(sand, after).m) CHECK(std::isfinite(double(tau)));
        CHECK(std::isfinite(double(wave_speed(sand, S(1600), after))));
    }
}

TEST_CASE("sand refuses properties that are none", "[material][error]") {
    const auto from = [](const SandProperties& p) { return Sand<float>::from_properties(p); };
    CHECK_THROWS_AS(from({.young = 0}), parameter_error);
    CHECK_THROWS_AS(from({.poisson = 0.5}), parameter_error);
    for (const double wrong : {-1.0, 90.0, std::nan("")})
        CHECK_THROWS_AS(from({.friction_angle = degrees(wrong)}), parameter_error);
    CHECK_THROWS_AS(from({.friction_angle = degrees(5), .initial_loss = degrees(10)}), parameter_error);
    CHECK_THROWS_AS(from({.friction_angle = degrees(80), .hardening = degrees(90), .hardening_decay = 0.5}),
                    parameter_error);
    // The maximum of φ lies above h₀ + h₁/(h₂ e), which is 81.6°, where sand is stronger before any flow.
    CHECK_THROWS_AS(from({.friction_angle = degrees(60),
                          .hardening = degrees(58.7),
                          .hardening_decay = 1,
                          .initial_loss = degrees(-25)}),
                    parameter_error);
    CHECK_NOTHROW(from({.friction_angle = degrees(60), .hardening = degrees(58.7), .hardening_decay = 1}));
    Sand<float> by_hand;
    by_hand.check();
    by_hand.initial_loss = 0.7F;  // φ would begin below 0
    CHECK_THROWS_AS(by_hand.check(), parameter_error);
    by_hand = {};
    by_hand.hardening = 4, by_hand.hardening_decay = 1;  // φ would reach 119°
    CHECK_THROWS_AS(by_hand.check(), parameter_error);
    CHECK_THROWS_AS(from({.hardening = degrees(9)}), parameter_error);  // would grow without a bound
    CHECK_THROWS_AS(from({.hardening = degrees(-1), .hardening_decay = 1}), parameter_error);
    CHECK_THROWS_AS(from({.hardening = degrees(1), .hardening_decay = std::nan("")}), parameter_error);
    const Sand<float> defaults, same = from({});
    CHECK(double(defaults.mu) == Approx(double(same.mu)).epsilon(1e-7));
    CHECK(double(defaults.lambda) == Approx(double(same.lambda)).epsilon(1e-7));
    CHECK(defaults.friction_angle == same.friction_angle);
}

}  // namespace sand_tests
