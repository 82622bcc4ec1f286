/// \file One material point under uniaxial strain, F = diag(l, 1, 1), and the stress in closed form. The point is
/// driven through the functions of material/concept.hpp, as G2P drives a particle: F follows the flow, the model's
/// return mapping, the stress.
#pragma once

#include <firn/firn.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace verification {

/// Kirchhoff stress along and across the stretch [Pa].
struct Response {
    double along = 0, across = 0;
};

/// Stretches l on the way over turning points, in equal steps of ln l.
struct Path {
    std::vector<double> turns;
    int steps = 400;  ///< from one to the next

    /// visit(leg, l)
    template <class Visit>
    void each(const Visit& visit) const {
        for (std::size_t leg = 0; leg + 1 < turns.size(); ++leg)
            for (int i = 1; i <= steps; ++i)
                visit(leg, turns[leg] * std::pow(turns[leg + 1] / turns[leg], double(i) / steps));
    }
};

/// The responses of a model along a path. \param visit  visit(l, state), after each step
template <class Model, class Visit>
std::vector<Response> driven(const Model& model, const Path& path, const Visit& visit) {
    using S = firn::material_scalar_t<Model>;
    auto state = firn::initial_state<3>(model);
    const double dt = 1e-3;
    double before = path.turns[0];
    std::vector<Response> all;
    path.each([&](std::size_t, double l) {
        auto gradient = firn::Mat<S, 3>::zero();
        gradient(0, 0) = S((l / before - 1) / dt);
        state = firn::updated(model, state, gradient, S(dt));
        const firn::Mat<S, 3> tau = firn::kirchhoff_stress(model, state);
        all.push_back({double(tau(0, 0)), double(tau(1, 1))});
        visit(l, state);
        before = l;
    });
    return all;
}
template <class Model>
std::vector<Response> driven(const Model& model, const Path& path) {
    return driven(model, path, [](double, const auto&) {});
}

/// The responses of a particle within a body that a simulation stretches: velocities are given anew for every step, and
/// no forces act, so that they are those of F.
/// \tparam Policies  what differs from the defaults of a simulation
template <class... Policies, class Model>
std::vector<Response> simulated(const Model& model, const Path& path) {
    using S = firn::material_scalar_t<Model>;
    firn::SimulationWith<3, Model, firn::NoForce, Policies...> simulation({{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}, 0.1},
                                                                          model);
    simulation.gravity = {0.0, 0.0, 0.0};
    simulation.fixed_time_step = 1e-5;
    simulation.add(firn::sample_box<3>({0.3, 0.4, 0.4}, {0.7, 0.6, 0.6}, {.spacing = 0.05}), 1000);
    double before = path.turns[0];
    std::vector<Response> all;
    path.each([&](std::size_t, double l) {
        auto& particles = simulation.edit_particles();
        const double rate = (l / before - 1) / simulation.fixed_time_step;
        auto gradient = firn::Mat<S, 3>::zero();
        gradient(0, 0) = S(rate);
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            particles.set_velocity(slot, {S(rate * (particles.exact_position(slot)[0] - 0.5)), S(0), S(0)});
            particles.set_affine(slot, gradient);
        }
        simulation.step();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot) && particles.id(slot) == 0)
                all.push_back({double(particles.stress(slot)(0, 0)), double(particles.stress(slot)(1, 1))});
        before = l;
    });
    return all;
}

/// The closed form along a path: response(l), and turned(l), the form after a turn at l.
template <class Form>
std::vector<Response> closed(Form form, const Path& path) {
    std::vector<Response> all;
    std::size_t last = 0;
    double before = path.turns[0];
    path.each([&](std::size_t leg, double l) {
        if (leg != last) form = form.turned(before);
        last = leg;
        before = l;
        all.push_back(form.response(l));
    });
    return all;
}

/// Largest difference of a component, over the largest stress.
inline double largest_error(const std::vector<Response>& ours, const std::vector<Response>& exact) {
    double error = 0, size = 0;
    for (std::size_t i = 0; i < ours.size(); ++i) {
        for (const double off : {ours[i].along - exact[i].along, ours[i].across - exact[i].across})
            error = std::isnan(off) ? INFINITY : std::max(error, std::abs(off));
        size = std::max({size, std::abs(exact[i].along), std::abs(exact[i].across)});
    }
    return error / size;
}

/// Fixed corotated (Stomakhin et al. 2012): 2μ (l − 1) l + λ (l − 1) l, λ (l − 1) l.
struct FixedCorotatedForm {
    double mu, lambda;
    Response response(double l) const { return {(2 * mu + lambda) * (l - 1) * l, lambda * (l - 1) * l}; }
    FixedCorotatedForm turned(double) const { return *this; }
};

/// Neo-Hookean (Bonet and Wood 2008, §6.4.3): μ (l² − 1) + λ ln l, λ ln l.
struct NeoHookeanForm {
    double mu, lambda;
    Response response(double l) const { return {mu * (l * l - 1) + lambda * std::log(l), lambda * std::log(l)}; }
    NeoHookeanForm turned(double) const { return *this; }
};

/// Hencky: (2μ + λ) ln l, λ ln l.
struct HenckyForm {
    double mu, lambda;
    Response response(double l) const { return {(2 * mu + lambda) * std::log(l), lambda * std::log(l)}; }
    HenckyForm turned(double) const { return *this; }
};

/// Tait and Murnaghan: −p l, p = K/γ (l^−γ − 1) ≥ 0 (no tension); the same in all directions.
struct FluidForm {
    double bulk, gamma;
    Response response(double l) const {
        const double tau = -std::max(bulk / gamma * (std::pow(l, -gamma) - 1), 0.0) * l;
        return {tau, tau};
    }
    FluidForm turned(double) const { return *this; }
};

/// Snow (Stomakhin et al. 2013, §5): the elastic stretch s = l / J_P stays in [1 − θc, 1 + θs] and J_P takes the rest;
/// moduli grow by e^{ξ (1 − J_P)}.
struct SnowForm {
    double mu, lambda, lowest, highest, hardening, largest_exponent;
    double plastic_volume = 1;  ///< before this leg

    double elastic_stretch(double l) const { return std::clamp(l / plastic_volume, lowest, highest); }
    Response response(double l) const {
        const double s = elastic_stretch(l);
        const double factor = std::exp(std::min(hardening * (1 - l / s), largest_exponent));
        const auto [along, across] = FixedCorotatedForm{mu, lambda}.response(s);
        return {factor * along, factor * across};
    }
    SnowForm turned(double l) const {
        SnowForm next = *this;
        next.plastic_volume = l / elastic_stretch(l);
        return next;
    }
};

/// Stress from ln l and the elastic deviator e (√⅔, −1/√6, −1/√6).
inline Response hencky_response(double mu, double lambda, double volumetric, double e) {
    const double mean = (lambda + 2 * mu / 3) * volumetric;
    return {mean + 2 * mu * std::sqrt(2. / 3) * e, mean - 2 * mu / std::sqrt(6.) * e};
}

/// Von Mises with linear isotropic hardening (Simo and Hughes 1998, §3.3): past ‖s‖ = √⅔ (σ_Y + H α), the deviator goes
/// on with the share ⅔H / (2μ + ⅔H) of its elastic stiffness.
struct VonMisesForm {
    double mu, lambda, yield_stress, hardening;
    double plastic = 0, equivalent = 0;  ///< deviator and α before this leg

    struct Deviator {
        double elastic, slip;
    };
    Deviator deviator(double l) const {
        const double trial = std::sqrt(2. / 3) * std::log(l) - plastic;
        const double most = std::sqrt(2. / 3) * (yield_stress + hardening * equivalent) / (2 * mu);
        const double slip = std::max(std::abs(trial) - most, 0.0) / (1 + hardening / (3 * mu));
        return {std::copysign(std::abs(trial) - slip, trial), slip};
    }
    Response response(double l) const { return hencky_response(mu, lambda, std::log(l), deviator(l).elastic); }
    VonMisesForm turned(double l) const {
        VonMisesForm next = *this;
        const Deviator now = deviator(l);
        next.plastic = std::sqrt(2. / 3) * std::log(l) - now.elastic;
        next.equivalent += std::sqrt(2. / 3) * now.slip;
        return next;
    }
};

/// Sand (Klár et al. 2016; the volume as of Tampubolon et al. 2017): no stress for l ≥ 1, whatever was before; else the
/// volumetric strain is ln l, as flow does not dilate, and the elastic deviator at most α (3λ + 2μ)/(2μ) |ln l|,
/// α = √⅔ 2 sin φ / (3 − sin φ). Where α (3λ + 2μ)/(2μ) < √⅔, it slips from the start of a first compression, and the
/// stress ratio is constant.
struct SandForm {
    double mu, lambda, sine;
    double plastic = 0;  ///< deviator before this leg, when it was under pressure

    double alpha() const { return std::sqrt(2. / 3) * 2 * sine / (3 - sine); }
    double deviator(double l) const {
        const double most = alpha() * (3 * lambda + 2 * mu) / (2 * mu) * -std::log(l);
        return std::clamp(std::sqrt(2. / 3) * std::log(l) - plastic, -most, most);
    }
    Response response(double l) const {
        if (l >= 1) return {};
        return hencky_response(mu, lambda, std::log(l), deviator(l));
    }
    SandForm turned(double l) const {
        SandForm next = *this;
        next.plastic = l >= 1 ? 0 : std::sqrt(2. / 3) * std::log(l) - deviator(l);
        return next;
    }
    /// τ22/τ11 of first compression on the cone.
    double ratio() const { return (1 - std::sqrt(1.5) * alpha()) / (1 + std::sqrt(6.) * alpha()); }
};

/// Cam clay before it yields (Wolper et al. 2019, §4): p = κ/2 (1 − l²), s = μ l^−⅔ (l² − 1) (⅔, −⅓, −⅓), and the yield
/// function over κ².
struct NaccForm {
    double mu, kappa, slope, cohesion, consolidation;  ///< slope: M, consolidation: p₀ [Pa]

    double pressure(double l) const { return kappa / 2 * (1 - l * l); }
    double shear(double l) const { return mu * std::pow(l, -2. / 3) * (l * l - 1); }  ///< τ11 − τ22; |.| = q
    Response response(double l) const { return {-pressure(l) + 2 * shear(l) / 3, -pressure(l) - shear(l) / 3}; }
    NaccForm turned(double) const { return *this; }
    static double yield(double p, double q, double M, double beta, double p0) {
        return (1 + 2 * beta) * q * q + M * M * (p + beta * p0) * (p - p0);
    }
    /// Where it yields between l = 1 and `end`.
    double yields_at(double end) const {
        double inside = 1, outside = end;
        for (int i = 0; i < 100; ++i) {
            const double l = (inside + outside) / 2;
            (yield(pressure(l), shear(l), slope, cohesion, consolidation) < 0 ? inside : outside) = l;
        }
        return inside;
    }
};

// The closed form of a model.

inline FixedCorotatedForm form_of(const firn::FixedCorotated<double>& of) { return {of.mu, of.lambda}; }
inline NeoHookeanForm form_of(const firn::NeoHookean<double>& of) { return {of.mu, of.lambda}; }
inline HenckyForm form_of(const firn::Hencky<double>& of) { return {of.mu, of.lambda}; }
inline FluidForm form_of(const firn::Fluid<double>& of) { return {of.bulk, of.gamma}; }
inline SnowForm form_of(const firn::Snow<double>& of) {
    return {of.mu, of.lambda, of.lowest_stretch, of.highest_stretch, of.hardening, of.largest_exponent};
}
inline VonMisesForm form_of(const firn::VonMises<double>& of) {
    return {of.mu, of.lambda, of.yield_stress, of.hardening};
}
inline SandForm form_of(const firn::Sand<double>& of) { return {of.mu, of.lambda, std::sin(of.friction_angle)}; }
/// p₀ = κ (1e-5 + sinh(−ξ α)), M = 6 sin φ / (3 − sin φ).
inline NaccForm form_of(const firn::Nacc<double>& of) {
    const double kappa = of.lambda + 2 * of.mu / 3;
    return {of.mu, kappa, 6 * of.friction_sine / (3 - of.friction_sine), of.cohesion,
            kappa * (1e-5 + std::sinh(-of.hardening * of.first_log_volume))};
}

/// The models, and paths that take each through all it does.
struct UniaxialModels {
    firn::FixedCorotated<double> fixed_corotated = firn::FixedCorotated<double>::from_young_poisson(1e5, 0.3);
    firn::NeoHookean<double> neo_hookean = firn::NeoHookean<double>::from_young_poisson(1e5, 0.3);
    firn::Hencky<double> hencky = firn::Hencky<double>::from_young_poisson(1e5, 0.3);
    firn::Fluid<double> fluid = firn::Fluid<double>::from_properties({});
    firn::Snow<double> snow = firn::Snow<double>::from_properties({});
    firn::VonMises<double> von_mises = firn::VonMises<double>::from_properties({.hardening = 1e5});
    firn::Sand<double> sand = firn::Sand<double>::from_properties({.friction_angle = firn::degrees(20)});
    firn::Nacc<double> nacc = firn::Nacc<double>::from_properties({});

    Path of_solid{{1, 0.5, 2}};
    Path of_fluid{{1, 0.8, 1.1, 0.9}};         ///< compressed, parted, closed again
    Path of_snow{{1, 0.9, 0.95, 0.55, 0.65}};  ///< crushed, torn apart, crushed to the bound of hardening, torn
    Path of_metal{{1, 0.9, 1.1, 1}};           ///< yields, yields the other way, and again
    Path of_sand{{1, 1.02, 0.95, 0.99, 0.9}};  ///< opens, closes and slips, slips back, slips
};

/// After it has yielded, how far Cam clay is off p = κ/2 (1 − l²), over p₀, and off its ellipse, over p₀²; the ellipse
/// is that of before the step.
struct NaccErrors {
    double elastic = 0, pressure = 0, ellipse = 0, yields_at = 0;
};
template <class Model>
NaccErrors nacc_errors(const Model& model, const NaccForm& form, double end, int steps) {
    NaccErrors errors;
    double p0 = form.consolidation;
    driven(model, Path{{1, end}, steps}, [&](double l, const auto& state) {
        const auto tau = firn::kirchhoff_stress(model, state);
        const double p = -(double(tau(0, 0)) + 2 * double(tau(1, 1))) / 3;
        const double q = std::abs(double(tau(0, 0)) - double(tau(1, 1)));
        const double off = std::max(std::abs(p - form.pressure(l)), std::abs(q - std::abs(form.shear(l))));
        if (double(state.log_volume) == 0) {
            errors.elastic = std::max(errors.elastic, off / form.consolidation);
        } else {
            if (errors.yields_at == 0) errors.yields_at = l;
            errors.pressure = std::max(errors.pressure, std::abs(p - form.pressure(l)) / p0);
            errors.ellipse = std::max(errors.ellipse, NaccForm::yield(p, q, form.slope, form.cohesion, p0) / (p0 * p0));
        }
        p0 = form.kappa * double(model.consolidation(state.log_volume));
    });
    return errors;
}

}  // namespace verification
