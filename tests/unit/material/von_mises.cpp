/// \file Plasticity of von Mises: a tension test in closed form, the return mapping against the yield surface, and what
/// holds for every model.
#include "support/effort.hpp"
#include "support/materials.hpp"
#include <firn/material/von_mises.hpp>

using namespace materials;

namespace von_mises_tests {
namespace {

template <int D>
using Solid = VonMises<double>::state<D>;
constexpr VonMisesProperties hardening_clay{.young = 1e6, .poisson = 0.4, .yield_stress = 2e4, .hardening = 5e4};

/// ‖dev τ‖ from the stress itself.
template <int D>
double shear_stress(const VonMises<double>& model, const Solid<D>& state) {
    Mat<double, D> tau = kirchhoff_stress(model, state);
    tau -= Mat<double, D>::diagonal(trace(tau) / D);
    return size_of(tau);
}
template <int D>
Solid<D> strained(Random& random, double spread) {
    Solid<D> state;
    do state.F = random.rotation<D>() + random.gaussian<D>() * spread;
    while (determinant(state.F) < 0.1);
    state.plastic_strain = random.uniform(0, 0.5);
    return state;
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("returned to the surface of von Mises, hardened by what has flowed; volume and axes are kept",
                       "[material]", ((int D), D), 2, 3) {
    const auto model = VonMises<double>::from_properties(hardening_clay);
    Random random(71);
    int yielded = 0, elastic = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        const Solid<D> state = strained<D>(random, trial % 2 ? 0.2 : 0.005);
        const Solid<D> after = model.returned(state);
        const auto radius = [&](double alpha) { return std::sqrt(2. / 3) * (2e4 + 5e4 * alpha); };
        const double before = shear_stress(model, state), now = shear_stress(model, after);
        if (before > radius(state.plastic_strain) + 1e-6) {
            ++yielded;
            CHECK(now == Approx(radius(after.plastic_strain)).epsilon(1e-11));
            // √⅔ Δα is the plastic strain in the deviator: (before − now) / 2μ = √(3/2) Δα.
            CHECK((before - now) / (2 * model.mu) ==
                  Approx(std::sqrt(1.5) * (after.plastic_strain - state.plastic_strain)).margin(1e-12));
            CHECK(determinant(after.F) == Approx(determinant(state.F)).epsilon(1e-13));
            CHECK(energy_density(model, after) < energy_density(model, state));
            const Mat<double, D> left = state.F * transpose(after.F), right = transpose(state.F) * after.F;
            CHECK(size_of(left - transpose(left)) <= 1e-14 * (1 + size_of(left)));
            CHECK(size_of(right - transpose(right)) <= 1e-14 * (1 + size_of(right)));
            CHECK(size_of(model.returned(after).F - after.F) <= 1e-14);
        } else {
            ++elastic;
            CHECK(same_bits(after, state));
        }
    }
    CHECK(yielded > 500);
    CHECK(elastic > 500);
}

TEST_CASE("tension at a constant volume: the stress difference is the yield stress, hardened", "[material]") {
    // Stretched by e^{0.5} along x, e^{−0.25} across, in steps: all but the elastic strain flows. In uniaxial tension
    // the deviator is (⅔, −⅓, −⅓) of the stress difference Y: Y = σ_Y + H α, and elastically 3 μ ε: α = ε − Y/(3μ).
    const auto model = VonMises<double>::from_properties(hardening_clay);
    Solid<3> state;
    const int steps = 50;
    for (int i = 0; i < steps; ++i) {
        Mat<double, 3> L = Mat<double, 3>::diagonal(std::expm1(-0.25 / steps));
        L(0, 0) = std::expm1(0.5 / steps);
        state = updated(model, state, L, 1.0);
    }
    const double Y = (2e4 + 5e4 * 0.5) / (1 + 5e4 / (3 * model.mu));
    const Mat<double, 3> tau = kirchhoff_stress(model, state);
    CHECK(tau(0, 0) - tau(1, 1) == Approx(Y).epsilon(1e-10));
    CHECK(state.plastic_strain == Approx(0.5 - Y / (3 * model.mu)).epsilon(1e-10));
    // In plane strain at a constant volume: τ₁ − τ₂ = 2/√3 σ_Y.
    const auto perfect = VonMises<double>::from_properties({});
    Solid<2> flat{diagonal_of<2>({1.5, 1 / 1.5})};
    const Mat<double, 2> of_flat = kirchhoff_stress(perfect, perfect.returned(flat));
    CHECK(of_flat(0, 0) - of_flat(1, 1) == Approx(2 / std::sqrt(3.) * 2e4).epsilon(1e-12));
}

TEMPLATE_TEST_CASE_SIG("von Mises: stress from energy, objectivity, isotropy, wave speed, lanes, floats, NaN",
                       "[material][dual]", ((int D), D), FIRN_TEST_FIRST_1(3, 2)) {
    const auto model = VonMises<double>::from_properties(hardening_clay);
    Random random(72);
    for (int trial = 0; trial < 50; ++trial) {
        const Solid<D> state = model.returned(strained<D>(random, 0.1));
        CAPTURE(trial);
        check_energy<VonMises, D>(model, state, model.mu);
        check_turned<VonMises, D>(model, state, random, model.mu);
        check_wave_speed<VonMises, D>(model, state, random);
    }
    const auto state_of = [](int i) {
        Random of_state(std::uint64_t(500 + i));
        return strained<D>(of_state, i % 2 ? 0.1 : 0.004);
    };
    const auto small = VonMises<float>::from_properties(hardening_clay);
    check_nan<D>(small);
    check_lanes<float, D>(small, state_of, 160);
    check_lanes<double, D>(model, state_of, 80);
    for (int i = 0; i < 50; ++i) check_float<D>(small, state_of(i), 40);
}

TEST_CASE("von Mises refuses properties that are none", "[material][error]") {
    const auto from = [](const VonMisesProperties& p) { return VonMises<float>::from_properties(p); };
    CHECK_THROWS_AS(from({.young = 0}), parameter_error);
    CHECK_THROWS_AS(from({.poisson = 0.5}), parameter_error);
    for (const double wrong : {0.0, -1.0, std::nan(""), double(INFINITY)})
        CHECK_THROWS_AS(from({.yield_stress = wrong}), parameter_error);
    for (const double wrong : {-1.0, std::nan(""), double(INFINITY)})
        CHECK_THROWS_AS(from({.hardening = wrong}), parameter_error);
    const VonMises<float> defaults, same = from({});
    CHECK(double(defaults.mu) == Approx(double(same.mu)).epsilon(1e-7));
    CHECK(double(defaults.lambda) == Approx(double(same.lambda)).epsilon(1e-7));
}

TEST_CASE("an inverted plastic solid becomes upright and keeps its volume", "[material]") {
    const auto model = VonMises<float>::from_properties(hardening_clay);
    for (const float first : {-0.01F, -0.7F, -1.3F}) {
        VonMises<float>::state<3> state;
        state.F(0, 0) = first;
        check_upright(model.returned(state).F, 0.005, 0.02);  // as if compressed to the volume 1e-6, or 1.3e-6
    }
}

}  // namespace von_mises_tests
