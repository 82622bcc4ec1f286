/// \file Modified Cam clay: the lines of isotropic compression and swelling, drained and undrained triaxial paths in
/// closed form, the return mapping from anywhere, and what holds for every model.
#include "support/effort.hpp"
#include "support/materials.hpp"
#include "support/message.hpp"
#include <firn/material/modified_cam_clay.hpp>

#include "../../../benchmarks/verification/scenes/cam_clay_paths.hpp"

using namespace materials;
using namespace verification;

namespace modified_cam_clay_tests {
namespace {

/// Both elasticities: G = g p' and constant G; λ* = 0.1, κ* = 0.02.
ModifiedCamClayProperties coupled(double initial, double consolidation) {
    return {.critical_slope = 1.2, .initial_pressure = initial, .consolidation = consolidation};
}
ModifiedCamClayProperties constant(double initial, double consolidation) {
    return {.critical_slope = 1.2, .shear_modulus = 3e6, .initial_pressure = initial, .consolidation = consolidation};
}
const double lambda_star = 0.1, kappa_star = 0.02;

/// Checks a path for three lengths of step. No step moves the clay off the path; the strain at which it is there has an
/// error of first order, and none above 1e-6 when two runs are extrapolated to steps of no length.
template <class Run>
void check_path(const Run& run, double strain) {
    const Path coarse = run(strain, 500), middle = run(strain, 1000), fine = run(strain, 2000);
    CAPTURE(coarse.strain_error * 1e6, middle.strain_error * 1e6, fine.strain_error * 1e6, fine.ratio);
    for (const Path& path : {coarse, middle, fine}) {
        CHECK(path.path_error < 1e-10);
        CHECK(path.held_error < 1e-9);
    }
    CHECK(fine.ratio > 0.7);
    CHECK(fine.ratio < 0.99);
    CHECK(coarse.strain_error / middle.strain_error == Approx(2).epsilon(0.02));
    CHECK(middle.strain_error / fine.strain_error == Approx(2).epsilon(0.01));
    CHECK(std::abs(2 * fine.strain_error - middle.strain_error) < 1e-6);
}

/// A trial state somewhere: hardly to immensely strained, with any history.
template <int D>
Clay<D> somewhere(Random& random) {
    const double apart = std::pow(10, random.uniform(-5, -0.3)), scale = std::pow(10, random.uniform(-3, -0.3));
    const double common = std::exp(scale * random.uniform(-1, 1));
    Vec<double, D> stretches{};
    for (int i = 0; i < D; ++i) stretches[i] = common * std::exp(apart * random.uniform(-1, 1));
    Clay<D> clay;
    clay.F = with_singular_values<D>(random, stretches);
    clay.log_volume = std::pow(10, random.uniform(-3, -0.7)) * random.uniform(-1, 1);
    return clay;
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("Modified Cam clay on the lines of isotropic compression and swelling", "[material]",
                       ((int D), D), 2, 3) {
    for (const auto& properties : {coupled(1e4, 5e4), constant(1e4, 5e4)}) {
        const auto model = ModifiedCamClay<double>::from_properties(properties);
        CHECK(model.compression == Approx(lambda_star).epsilon(1e-15));
        CHECK(model.swelling == Approx(kappa_star).epsilon(1e-15));
        Clay<D> clay;
        double log_volume = 0, highest = 5e4, lowest_seen = 1e9;
        // Down to 250 kPa, back to 3 kPa and down again, in steps of any size: no step has an error.
        for (const double strain : {-0.01, -0.02, -0.03, -0.1, -0.05, 0.03, 0.03, 0.03, -0.02, -0.07, -0.03, -0.05}) {
            clay = after<D>(model, clay, Vec<double, D>::filled(strain / D));
            log_volume += strain;
            // On the swelling line from (p_c, its volume), or on the compression line beyond it.
            const double at_consolidation = -kappa_star * std::log(5e4 / 1e4) - lambda_star * std::log(highest / 5e4);
            double expected = highest * std::exp(-(log_volume - at_consolidation) / kappa_star);
            if (expected > highest)
                highest = expected = 5e4 * std::exp(-(log_volume + kappa_star * std::log(5.)) / lambda_star);
            const Invariants now = invariants(model, clay);
            CAPTURE(strain, log_volume);
            CHECK(now.p == Approx(expected).epsilon(1e-11));
            CHECK(now.pc == Approx(highest).epsilon(1e-11));
            CHECK(now.q <= 1e-8 * now.p);
            CHECK(model.consolidation_pressure(clay.log_volume) == Approx(now.pc).epsilon(1e-14));
            lowest_seen = std::min(lowest_seen, now.p);
        }
        CHECK(highest > 2e5);
        CHECK(lowest_seen < 1e4);
    }
}

TEST_CASE("Modified Cam clay in drained and undrained triaxial tests: the path, its strains, the error of the step",
          "[material]") {
    for (const auto& properties : {constant(1e5, 1e5), coupled(1e5, 1e5)}) {
        check_path([&](double strain, int steps) { return undrained(properties, strain, steps); }, 0.03);
        check_path([&](double strain, int steps) { return drained(properties, strain, steps); }, 0.1);
        const Path failed = drained(properties, 1.5, 500);
        CHECK(failed.ratio == Approx(1).epsilon(1e-4));  // q = M p', at a constant volume
        CHECK(std::abs(failed.dilation) < 1e-3);
    }
}

TEST_CASE("Overconsolidated modified Cam clay has a peak, dilates, and softens to the critical state", "[material]") {
    for (const auto& properties : {constant(1e4, 1e5), coupled(1e4, 1e5)}) {
        const auto model = ModifiedCamClay<double>::from_properties(properties);
        Clay<3> clay;
        double peak = 0, end = 0;
        for (int i = 0; i < 4000; ++i) {  // at a constant volume: q rises to where the critical state is
            clay = after<3>(model, clay, {-1e-4, 5e-5, 5e-5});
            const Invariants now = invariants(model, clay);
            peak = std::max(peak, now.q / now.p), end = now.q / now.p;
            CHECK(now.q * now.q + 1.44 * now.p * (now.p - now.pc) <= 1e-9 * now.pc * now.pc);
        }
        CHECK(peak > 1.5);
        CHECK(end == Approx(1.2).epsilon(1e-2));
        CHECK(clay.log_volume > 0.01);
    }
}

TEMPLATE_TEST_CASE_SIG("Modified Cam clay returns from everywhere, along the normal of the ellipse where it arrives",
                       "[material]", ((int D), D), 2, 3) {
    const int count = test_support::fewer_if_quick(100000, 5000);
    for (const double ratio : {1., 3., 100.}) {
        int kind = 0;
        for (auto properties : {coupled(1e4, 1e4 * ratio), constant(1e4, 1e4 * ratio), coupled(1e4, 1e4 * ratio),
                                constant(1e4, 1e4 * ratio)}) {
            if (++kind > 2) properties.critical_slope = 0.6, properties.compression = 0.3, properties.swelling = 0.2;
            const auto model = ModifiedCamClay<double>::from_properties(properties);
            const double M = model.critical_slope;
            Random random(91);
            int wet = 0, dry = 0, elastic = 0;
            bool all = true;
            for (int trial = 0; trial < count && all; ++trial) {
                const Clay<D> state = somewhere<D>(random);
                const auto both = model.returned_with_stress(state);
                const Clay<D> now = both.state;
                const auto [p, q, pc] = invariants(model, now);
                // Where the clay has softened to less than a millipascal, q is made of the last digits of F.
                const double size = std::max(pc, 1e-3 * model.initial_pressure);
                const double f = q * q + M * M * p * (p - pc);
                const auto [p0, q0, pc0] = invariants(model, state);
                const double compaction = state.log_volume - now.log_volume;
                if (q0 * q0 + M * M * p0 * (p0 - pc0) > 1e-9 * pc0 * std::max(pc0, q0)) {
                    all = all && std::abs(f) <= 1e-9 * size * size;
                    // The plastic strain is a positive multiple of ∂f/∂σ, compared by its parts.
                    const Mat<double, D> plastic = logarithmic_strain(state.F) - logarithmic_strain(now.F);
                    const double volumetric = -trace(plastic);
                    const double shear =
                        std::sqrt(2. / (6 - D)) * size_of(plastic + Mat<double, D>::diagonal(volumetric / D));
                    // Below p_c/1000 the direction is that at p_c/1000.
                    const bool apex = p < pc / 1000;
                    const double by_p = M * M * (apex ? -0.998 * pc : 2 * p - pc);
                    const double by_q = apex ? 2 * M * std::sqrt(0.001 * 0.999) * pc : 2 * q;
                    const double normal = std::hypot(by_p, by_q);
                    const double scale = 1e-9 + 1e-7 * std::hypot(volumetric, shear);
                    all = all && std::abs(volumetric - compaction) <= 1e-12;
                    if (pc > 1e-3 * model.initial_pressure) {
                        all = all && std::abs(volumetric * by_q - shear * by_p) <= normal * scale;
                        all = all && volumetric * by_p + shear * by_q >= -normal * 1e-12;
                    }
                    (compaction > 0 ? wet : dry) += 1;
                } else if (q0 * q0 + M * M * p0 * (p0 - pc0) <= 0) {
                    ++elastic;
                    all = all && same_bits(now, state);
                }
                all = all && std::isfinite(p) && std::isfinite(q) && p >= -1e-9 * size;
                all = all && size_of(both.stress - kirchhoff_stress(model, now)) <=
                                 1e-11 * (size_of(both.stress) / model.swelling + 3 * model.shear_modulus);
                if (all) continue;
                CAPTURE(ratio, trial, p, q, pc, p0, q0, pc0);
                CHECK(all);
            }
            for (const int n : {wet, dry, elastic}) CHECK(n > count / 200);
        }
    }
}

TEMPLATE_TEST_CASE_SIG("Modified Cam clay: stress from energy, objectivity, isotropy, wave speed, lanes, floats, NaN",
                       "[material][dual]", ((int D), D), FIRN_TEST_FIRST_1(3, 2)) {
    for (const auto& properties : {coupled(1e4, 5e4), constant(1e4, 5e4)}) {
        const auto model = ModifiedCamClay<double>::from_properties(properties);
        Random random(92);
        double closest = 0;
        const auto admitted = [&](Random& from, double spread) {
            Clay<D> clay;
            do clay.F = from.rotation<D>() + from.gaussian<D>() * spread;
            while (determinant(clay.F) < 0.8);
            clay.log_volume = from.uniform(-0.05, 0.02);
            return clay;
        };
        for (int trial = 0; trial < 100; ++trial) {
            const Clay<D> state = model.returned(admitted(random, trial % 2 ? 0.05 : 0.003));
            const double scale = model.initial_pressure / model.swelling + model.shear_modulus;
            CAPTURE(trial);
            check_energy<ModifiedCamClay, D>(model, state, scale);
            check_turned<ModifiedCamClay, D>(model, state, random, 10 * scale);
            closest = std::max(closest, check_wave_speed<ModifiedCamClay, D>(model, state, random));
        }
        CHECK(closest > 0.6);
        const auto state_of = [&](int i) {
            Random of_state(std::uint64_t(700 + i));
            return admitted(of_state, i % 2 ? 0.01 : 0.002);
        };
        const auto small = ModifiedCamClay<float>::from_properties(properties);
        check_nan<D>(small);
        check_lanes<float, D>(small, state_of, 320);
        check_lanes<double, D>(model, state_of, 80);
        for (int i = 0; i < 50; ++i) {
            CAPTURE(i);
            check_float<D>(small, model.returned(state_of(i)), 400);
        }
    }
}

TEST_CASE("Modified Cam clay that is pulled apart bears nothing, and bears pressure again when the gap has closed",
          "[material]") {
    for (const auto& properties : {coupled(1e4, 5e4), constant(1e4, 5e4)}) {
        const auto model = ModifiedCamClay<double>::from_properties(properties);
        Clay<3> clay;
        double last = 2e4;
        for (int i = 0; i < 100; ++i) {
            clay = after<3>(model, clay, {0.02, 0.02, 0.02});
            const Invariants now = invariants(model, clay);
            const double rounding = 1e-14 * model.shear_modulus;  // of G times the strain
            CHECK(now.p <= last + rounding);
            CHECK(now.p >= -rounding);
            CHECK(now.q <= 1e-6 * model.initial_pressure);
            CHECK(std::isfinite(wave_speed(model, 1000.0, clay)));
            last = now.p;
        }
        CHECK(std::abs(last) <= 1e-14 * model.shear_modulus + 1e-20);
        for (int i = 0; i < 100; ++i) clay = after<3>(model, clay, {-0.02, -0.02, -0.02});
        CHECK(invariants(model, clay).p == Approx(1e4).epsilon(1e-9));
    }
}

TEST_CASE("Modified Cam clay without volume, inverted or immensely stretched stays finite", "[material]") {
    for (const auto& properties : {coupled(1e4, 5e4), constant(1e4, 5e4)}) {
        const auto model = ModifiedCamClay<float>::from_properties(properties);
        for (const float first : {0.0F, -0.7F, -1.3F, 1e-9F, 1e3F}) {
            CAPTURE(first);
            ModifiedCamClay<float>::state<3> state;
            state.F(0, 0) = first;
            const auto now = model.returned(state);
            for (const double number : numbers_of(now)) CHECK(std::isfinite(number));
            for (const auto& of : {state, now}) {
                for (const float tau : kirchhoff_stress(model, of).m) CHECK(std::isfinite(tau));
                CHECK(std::isfinite(energy_density(model, of)));
                CHECK(std::isfinite(wave_speed(model, 1000.0F, of)));
            }
            if (first != 0) CHECK(determinant(now.F) > 0);
        }
    }
}

TEST_CASE("Modified Cam clay by the parameters of a textbook", "[material]") {
    // London clay as Schofield & Wroth give it: λ = 0.161, κ = 0.062, and N = Γ + λ − κ = 2.759 + 0.099.
    const ModifiedCamClayProperties london{.critical_slope = 0.888,
                                           .compression = 0.161,
                                           .swelling = 0.062,
                                           .specific_volume = 2.858,
                                           .initial_pressure = 5e4,
                                           .consolidation = 2e5};
    const auto model = ModifiedCamClay<double>::from_properties(london);
    const double volume = 2.858 - 0.161 * std::log(200.) + 0.062 * std::log(4.);
    CHECK(model.compression == Approx(0.161 / volume).epsilon(1e-14));
    CHECK(model.swelling == Approx(0.062 / volume).epsilon(1e-14));
    CHECK(model.shear_ratio == Approx(3 * 0.4 / (2 * 1.3 * model.swelling)).epsilon(1e-14));
    CHECK(model.shear_modulus == 0);
    // G/p' of a small shear of the start state.
    Clay<3> clay;
    clay.F(0, 1) = 1e-6;
    CHECK(kirchhoff_stress(model, clay)(0, 1) == Approx(model.shear_ratio * 5e4 * 1e-6).epsilon(1e-5));
    const auto stiff = ModifiedCamClay<double>::from_properties({.shear_modulus = 4e6});
    CHECK(kirchhoff_stress(stiff, clay)(0, 1) == Approx(4).epsilon(1e-5));
    CHECK(stiff.shear_ratio == 0);
    CHECK(ModifiedCamClay<double>::from_properties({.shear_ratio = 40}).shear_ratio == 40);
}

TEST_CASE("Modified Cam clay refuses parameters that are none", "[material][error]") {
    using test_support::message;
    const auto from = [](const ModifiedCamClayProperties& p) { return ModifiedCamClay<float>::from_properties(p); };
    const double nan = std::nan(""), infinity = INFINITY;
    const auto refuses = [&](const ModifiedCamClayProperties& p) {
        const std::string said = message<parameter_error>([&] { from(p); });
        CAPTURE(said);
        CHECK(said.size() > 40);
        CHECK(said.back() == '.');
    };
    for (const double wrong : {0.0, -1.0, nan, infinity}) {
        refuses({.critical_slope = wrong});
        refuses({.compression = wrong});
        refuses({.swelling = wrong});
        refuses({.void_ratio = wrong});
        refuses({.initial_pressure = wrong});
        refuses({.consolidation = wrong});
    }
    refuses({.swelling = 0.2});
    refuses({.compression = 2.1});
    refuses({.initial_pressure = 6e4});
    refuses({.specific_volume = 1.5});
    refuses({.specific_volume = nan});
    for (const double wrong : {-1.0, nan, infinity}) {
        refuses({.shear_modulus = wrong});
        refuses({.shear_ratio = wrong});
    }
    refuses({.shear_modulus = 1e6, .shear_ratio = 20});
    for (const double wrong : {-1.0, 0.5, nan}) refuses({.poisson = wrong});
    ModifiedCamClay<float> none;
    none.shear_ratio = 0;
    CHECK_THROWS_AS(none.check(), parameter_error);
    const ModifiedCamClay<float> defaults, same = from({});
    for_parameters(defaults, [&](const std::string& name, const char*, const float& value) {
        for_parameters(same, [&](const std::string& other, const char*, const float& made) {
            if (name == other) CHECK(value == Approx(made).epsilon(1e-6).margin(1e-12));
        });
    });
}

}  // namespace modified_cam_clay_tests
