/// \file Triaxial tests of modified Cam clay on one material point, with their closed forms.
#pragma once

#include <firn/core/dual.hpp>
#include <firn/data/converted_state.hpp>
#include <firn/material/modified_cam_clay.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace verification {

using namespace firn;

template <int D>
using Clay = ModifiedCamClay<double>::state<D>;

/// The volume ratio of all deformation.
template <int D>
double volume(const Clay<D>& clay) {
    return determinant(clay.F) * std::exp(clay.log_volume);
}
struct Invariants {
    double p, q, pc;  // of the Cauchy stress [Pa], and the consolidation pressure
};
template <int D>
Invariants invariants(const ModifiedCamClay<double>& model, const Clay<D>& clay) {
    Mat<double, D> sigma = kirchhoff_stress(model, clay) * (1 / volume(clay));
    const double p = -trace(sigma) / D;
    sigma += Mat<double, D>::diagonal(p);
    return {p, std::sqrt((6 - D) / 2.) * std::sqrt(squared_norm(sigma)),
            model.consolidation * std::exp(-clay.log_volume / (model.compression - model.swelling))};
}
/// The state after a step that changes the logarithms of the lengths along the axes.
template <int D>
Clay<D> after(const ModifiedCamClay<double>& model, const Clay<D>& clay, const Vec<double, D>& strain) {
    Mat<double, D> gradient = Mat<double, D>::zero();
    for (int i = 0; i < D; ++i) gradient(i, i) = std::expm1(strain[i]);
    return updated(model, clay, gradient, 1.0);
}

/// ∫ f(x) dx from 0 to `end` by Simpson's rule.
template <class Function>
double integral(const Function& f, double end) {
    const int intervals = 20000;
    double sum = 0;
    for (int i = 0; i < intervals; ++i) {
        const double a = end * i / intervals, b = end * (i + 1) / intervals;
        sum += (b - a) / 6 * (f(a) + 4 * f((a + b) / 2) + f(b));
    }
    return sum;
}
/// The plastic shear strain of normally consolidated clay at η = q/p'. \param rate  d ln p_c/dη on the way there
template <class Rate>
double plastic_shear(const ModifiedCamClay<double>& model, double eta, const Rate& rate) {
    const double M = model.critical_slope;
    // The normal of the ellipse: dε_s = 2η/(M² − η²) (λ* − κ*) d ln p_c.
    const double all = integral([&](double x) { return 2 * x / (M * M - x * x) * rate(x); }, eta);
    return (model.compression - model.swelling) * all;
}
/// The elastic shear strain s of the energy.
inline double elastic_shear(const ModifiedCamClay<double>& model, const Invariants& now, double J) {
    return model.shear_ratio > 0 ? now.q / now.p / (3 * model.shear_ratio) : J * now.q / (3 * model.shear_modulus);
}

struct Path {
    double path_error;    ///< largest relative error of p' (undrained), or error of ln v (drained), at the path's η
    double strain_error;  ///< error of the shear strain at the end, with its sign
    double ratio;         ///< η/M at the end
    double dilation;      ///< −dε_v/dε_s in the last step
    double held_error;    ///< largest relative error of what the test holds: the volume, or the lateral stress
    std::vector<std::array<double, 3>> drawn{};  ///< p', q and the p' of the closed form, now and then [Pa]
};

/// Normally consolidated clay is sheared at a constant volume. The path is
///
///     p'/p'ᵢ = (M²/(M² + η²))^(1 − κ/λ) exp((1 − κ*) η²/(6 g λ*)),    without the exponential for constant G
///
/// The factor 1 − κ* belongs to g = G/p': the energy's derivative is p_K = J p', which grows by k = (1 − κ*)/κ* of the
/// elastic volume, so that shear raises ln p' by k η²/(6 g).
inline Path undrained(const ModifiedCamClayProperties& properties, double strain, int steps) {
    const auto model = ModifiedCamClay<double>::from_properties(properties);
    const double M = model.critical_slope, ratio = model.swelling / model.compression;
    const double by_shear =
        model.shear_ratio > 0 ? (1 - model.swelling) / (6 * model.shear_ratio * model.compression) : 0;
    Clay<3> clay;
    Path result{};
    for (int i = 0; i < steps; ++i) {
        const double axial = strain / steps;
        clay = after<3>(model, clay, {-axial, axial / 2, axial / 2});
        const Invariants now = invariants(model, clay);
        const double eta = now.q / now.p;
        const double expected = properties.initial_pressure * std::pow(M * M / (M * M + eta * eta), 1 - ratio) *
                                std::exp(by_shear * eta * eta);
        result.path_error = std::max(result.path_error, std::abs(now.p / expected - 1));
        if (i % std::max(1, steps / 50) == 0) result.drawn.push_back({now.p, now.q, expected});
    }
    result.held_error = std::abs(volume(clay) - 1);
    const Invariants end = invariants(model, clay);
    const double eta = end.q / end.p;
    // ln p_c = κ/λ ln(1 + η²/M²) + the exponential's argument.
    const double plastic =
        plastic_shear(model, eta, [&](double x) { return ratio * 2 * x / (M * M + x * x) + 2 * by_shear * x; });
    result.strain_error = strain - elastic_shear(model, end, 1) - plastic;
    result.ratio = eta / M;
    return result;
}

/// A drained triaxial test of normally consolidated clay: the lateral stress is kept by Newton's method on the lateral
/// strain. On the path p' = p'ᵢ 3/(3 − η),
///
///     ln v = −κ* (ln(p'/p'ᵢ) − k η²/(6 g)) − (λ* − κ*) ln(p'/p'ᵢ (1 + η²/M²)),    without k η²/(6 g) for constant G
inline Path drained(const ModifiedCamClayProperties& properties, double strain, int steps) {
    const auto model = ModifiedCamClay<double>::from_properties(properties);
    const double M = model.critical_slope, first = properties.initial_pressure;
    const double plastic = model.compression - model.swelling;
    Clay<3> clay;
    Path result{};
    double lateral_strain = 0, lateral = strain / steps / 3, shear = 0;
    Invariants now{};
    for (int i = 0; i < steps; ++i) {
        const double axial = -strain / steps;
        for (int pass = 0; pass < 30; ++pass) {
            using Dual = dual<double>;
            const auto lifted = lift<Dual>(model);
            auto next = detail::converted_state<ModifiedCamClay<Dual>::state<3>>(clay);
            Mat<Dual, 3> gradient = Mat<Dual, 3>::zero();
            gradient(0, 0) = Dual(std::expm1(axial));
            gradient(1, 1) = gradient(2, 2) = exp(Dual(lateral, 1)) - Dual(1);
            next = updated(lifted, next, gradient, Dual(1));
            const Dual J = determinant(next.F) * exp(next.log_volume);
            const Dual stress = kirchhoff_stress(lifted, next)(1, 1) / J;
            const double change = -(stress.value + first) / stress.derivative;
            lateral += change;
            if (std::abs(change) < 1e-15) break;
        }
        clay = after<3>(model, clay, {axial, lateral, lateral});
        lateral_strain += lateral;
        now = invariants(model, clay);
        result.held_error = std::max(result.held_error, std::abs((now.p - now.q / 3) / first - 1));
        const double eta = now.q / now.p, log_p = std::log(now.p / first);
        double elastic = log_p;
        if (model.shear_ratio > 0) elastic -= (1 / model.swelling - 1) * eta * eta / (6 * model.shear_ratio);
        const double expected = -model.swelling * elastic - plastic * (log_p + std::log1p(eta * eta / (M * M)));
        const double all = axial * (i + 1) + 2 * lateral_strain;
        result.path_error = std::max(result.path_error, std::abs(all - expected));
        result.dilation = (axial + 2 * lateral) / (2. / 3 * (lateral - axial));
        shear = 2. / 3 * (lateral_strain - axial * (i + 1));
    }
    const double eta = now.q / now.p;
    const double flowed = plastic_shear(model, eta, [&](double x) { return 1 / (3 - x) + 2 * x / (M * M + x * x); });
    result.strain_error = shear - elastic_shear(model, now, volume(clay)) - flowed;
    result.ratio = eta / M;
    return result;
}

}  // namespace verification
