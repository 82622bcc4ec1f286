/// \file Non-associated Cam clay: bread, mud, chocolate, soft rock that tears.
#pragma once

#include <firn/core/repeat.hpp>
#include <firn/material/friction_angle.hpp>
#include <firn/material/hencky.hpp>
#include <firn/math/exp_log.hpp>
#include <firn/math/matrix_functions.hpp>

namespace firn::inline FIRN_BUILD {

/// Measurable properties of Cam clay. Nacc::from_properties() makes the material from these properties.
struct NaccProperties {
    double young = 1e6;                  ///< Young's modulus [Pa]
    double poisson = 0.3;                ///< Poisson's ratio [1]
    Angle friction_angle = degrees(45);  ///< friction angle φ of the critical state
    double cohesion = 0.5;               ///< β: largest tension divided by the consolidation pressure p₀ [1]
    double consolidation = 2e4;          ///< p₀ before any plastic flow; a pressure above p₀ crushes the clay [Pa]
    double hardening = 3;                ///< ξ: how fast p₀ grows with compaction [1]
};

/// Non-associated Cam clay: a solid that hardens as it is compacted, and softens and tears as it is pulled apart.
///
/// The elastic energy ψ and the Kirchhoff stress τ are
///
///     ψ = μ/2 (tr b̂ − D) + κ/2 ((J² − 1)/2 − ln J)      [J/m³ of undeformed volume]
///     τ = μ dev b̂ + κ/2 (J² − 1) I                       [Pa]
///
/// Here J = det F, b̂ = J^{−2/D} FFᵀ, μ and λ are the Lamé parameters, and κ = λ + 2μ/D is the bulk modulus. In 2D this
/// is plane strain if strains are small.
///
/// The clay yields outside of an ellipse in the plane of the pressure p = −κ/2 (J² − 1) and the shear stress
/// q = √((6 − D)/2) ‖μ dev b̂‖:
///
///     (1 + 2β) q² + M² (p + β p₀)(p − p₀) > 0,      p₀ = κ (1e-5 + sinh(ξ max(−α, 0)))
///
/// p₀ is the consolidation pressure, β the `cohesion`, ξ the `hardening`, and α the logarithm of the plastic volume
/// ratio. M = critical_slope() is the ratio q/p of the critical state; it follows from the friction angle.
///
/// Use Nacc for bread, mud, chocolate and soft rock. A larger β lets the material bear more tension, a larger ξ makes
/// the material harden and soften faster. For metal, or clay that keeps its volume, use VonMises; for grains without
/// cohesion, use Sand.
///
/// Wolper et al. 2019, "CD-MPM: Continuum damage material point methods for dynamic fracture animation", §4; the
/// hardening depends on the plastic volume.
template <scalar S = float>
struct Nacc {
    S mu = S(1e6 / 2.6);                          ///< shear modulus [Pa]
    S lambda = S(3e5 / (1.3 * 0.4));              ///< first Lamé parameter [Pa]
    S friction_sine = S(0.70710678118654752440);  ///< sine of the friction angle φ [1]
    S cohesion = S(0.5);                          ///< β: largest tension divided by the consolidation pressure p₀ [1]
    S hardening = S(3);                           ///< ξ: how fast p₀ grows with compaction [1]
    S first_log_volume = S(-0.0079992322);        ///< α before any flow; α: logarithm of the plastic volume ratio [1]

    static constexpr const char* name = "nacc";
    static constexpr auto parameters() {
        return std::tuple{parameter{"mu", "Pa", &Nacc::mu},
                          parameter{"lambda", "Pa", &Nacc::lambda},
                          parameter{"friction_sine", "1", &Nacc::friction_sine},
                          parameter{"cohesion", "1", &Nacc::cohesion},
                          parameter{"hardening", "1", &Nacc::hardening},
                          parameter{"first_log_volume", "1", &Nacc::first_log_volume}};
    }

    /// The state of a particle.
    template <int D>
    struct state {
        DeformationGradient<S, D> F;  ///< elastic deformation gradient [1]
        S log_volume = S(0);          ///< change so far of α, the logarithm of the plastic volume ratio [1]

        static constexpr auto fields() {
            return std::tuple{parameter{"deformation_gradient", "1", &state::F},
                              parameter{"plastic_log_volume", "1", &state::log_volume}};
        }
    };

    /// Makes the material from measurable properties. The consolidation pressure p₀ is converted to `first_log_volume`
    /// with the bulk modulus κ of 3D, even if the material is used in 2D.
    /// \throws parameter_error unless young > 0, −1 < poisson < ½, 0 ≤ friction_angle < 90°, cohesion ≥ 0, hardening >
    /// 0, and 0 < consolidation < κ/2, where κ is the bulk modulus of 3D
    static Nacc from_properties(const NaccProperties& clay) {
        const Hencky<S> elastic = Hencky<S>::from_young_poisson(clay.young, clay.poisson);
        const double kappa = clay.young / (3 * (1 - 2 * clay.poisson));
        if (!(clay.cohesion >= 0) || !std::isfinite(clay.cohesion))
            throw parameter_error(
                sentence("The cohesion of Cam clay is ", clay.cohesion, "; it must be finite and not negative."));
        if (!(clay.hardening > 0) || !std::isfinite(clay.hardening))
            throw parameter_error(sentence("The hardening coefficient of Cam clay is ", clay.hardening,
                                           "; it must be positive and finite."));
        if (!(clay.consolidation > 0 && clay.consolidation < kappa / 2))
            throw parameter_error(sentence("The consolidation pressure of Cam clay is ", clay.consolidation,
                                           " Pa; it must be positive and less than half the bulk modulus, ", kappa / 2,
                                           " Pa, which is the highest pressure of this elasticity."));
        Nacc model;
        model.mu = elastic.mu;
        model.lambda = elastic.lambda;
        model.friction_sine = S(std::sin(check_friction_angle(clay.friction_angle).in_radians()));
        model.cohesion = S(clay.cohesion);
        model.hardening = S(clay.hardening);
        model.first_log_volume = S(-std::asinh(clay.consolidation / kappa) / clay.hardening);
        return model;
    }
    /// Checks the parameters.
    /// \throws parameter_error unless μ > 0, λ + 2 μ/3 > 0, 0 ≤ friction_sine < 1, cohesion ≥ 0, hardening > 0,
    /// first_log_volume ≤ 0, and all parameters are finite
    void check() const
        requires std::floating_point<S>
    {
        check_lame_of_plastic(double(mu), double(lambda));
        if (!(friction_sine >= 0 && friction_sine < 1) || !(cohesion >= 0) || !(hardening > 0) ||
            !(first_log_volume <= 0) || !std::isfinite(cohesion + hardening + first_log_volume))
            throw parameter_error(sentence("Cam clay has sin φ = ", friction_sine, ", cohesion ", cohesion,
                                           ", hardening ", hardening, " and first_log_volume ", first_log_volume,
                                           "; the sine must be at least 0 and below 1, the cohesion not negative, the "
                                           "hardening positive, first_log_volume not positive, and all finite."));
    }

    /// The bulk modulus κ = λ + 2μ/D [Pa]; D is the number of dimensions.
    template <int D>
    FIRN_INLINE S bulk() const {
        return lambda + S(2. / D) * mu;
    }
    /// M [1], the ratio of shear stress q to pressure p in the critical state: 6 sin φ / (3 − sin φ), in 2D 2 sin φ.
    /// The cone q = M p is that of friction_slope().
    template <int D>
    FIRN_INLINE S critical_slope() const {
        if constexpr (D == 3)
            return S(6) * friction_sine / (S(3) - friction_sine);
        else
            return friction_sine + friction_sine;
    }
    /// Returns the consolidation pressure p₀ of a state, divided by the bulk modulus κ [1]; the result is at most
    /// 1e-5 + sinh 2 ≈ 3.6. Where p₀ ≥ κ/2 the clay is never crushed, since the pressure is always below κ/2.
    /// \param log_volume  the state's `log_volume` [1]
    FIRN_INLINE S consolidation(const S& log_volume) const {
        const S x = min(S(2), hardening * max(-(first_log_volume + log_volume), S(0)));
        const S xx = x * x;  // the power series of sinh x is exact near x = 0 and has an error of 1e-9 at x = 2
        S sum = S(1);
        unroll<7>([&](auto k) FIRN_LAMBDA {
            constexpr int n = 14 - 2 * int(k);
            sum = S(1) + xx * sum * S(1. / (n * (n + 1)));
        });
        return named("consolidation", S(1e-5) + x * sum);
    }

    /// Kirchhoff stress τ = μ dev b̂ + κ/2 (J² − 1) I [Pa]. J = det F, b̂ = J^{−2/D} FFᵀ, and κ is bulk(). A J below
    /// 1e-18, also a negative one, is replaced by 1e-18.
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& clay) const {
        const Shape<D> shape(clay.F);
        return shape.deviator * mu - Mat<S, D>::diagonal(bulk<D>() * shape.pressure);
    }
    /// Elastic energy ψ = μ/2 (tr b̂ − D) + κ/2 ((J² − 1)/2 − ln J) [J/m³ of undeformed volume]. J = det F,
    /// b̂ = J^{−2/D} FFᵀ, and κ is bulk().
    template <int D>
    FIRN_INLINE S energy_density(const state<D>& clay) const {
        const Shape<D> shape(clay.F);
        const S volumetric = -(shape.pressure + shape.log_J);
        return S(0.5) * mu * S(D) * (shape.mean - S(1)) + S(0.5) * bulk<D>() * volumetric;
    }
    /// Upper bound c of the wave speed [m/s], for the density ρ0 of the undeformed material [kg/m³]:
    ///
    ///     ρ0 c² = μ J^{−2/D} (σ_max² + (1 + 2/D) tr b/D) + κ/2 (J² + 1)
    ///
    /// Here b = FFᵀ, J = det F, κ is bulk(), and σ_max is the largest principal stretch. The bound follows from the
    /// acoustic tensor. For the unit direction n, this tensor is
    ///
    ///     μ J^{−2/D} [(n·bn) I − 2/D (bn ⊗ n + n ⊗ bn) + (1 + 2/D)(tr b/D) n ⊗ n] + κ/2 (J² + 1) n ⊗ n
    template <int D>
    FIRN_INLINE S wave_speed(const S& density, const state<D>& clay) const {
        const S J = determinant(clay.F);
        const S shape = squared_stretch_bound(clay.F) + S((1 + 2. / D) / D) * squared_norm(clay.F);
        return sqrt((mu * isochoric<D>(J) * shape + S(0.5) * bulk<D>() * (J * J + S(1))) / density);
    }

    /// Returns the state after the plastic return mapping, and the Kirchhoff stress [Pa] in this state. The pressure p
    /// and the shear stress q of the trial state are compared with the yield ellipse, which lies between the pressures
    /// −β p₀ and p₀ (β: cohesion, p₀: consolidation pressure). There are three cases:
    ///
    ///     p > p₀                      the new pressure is p₀, without shear stress
    ///     p < −β p₀                   the new pressure is −β p₀, without shear stress
    ///     else, outside the ellipse   the shear stress is reduced until the state lies on the ellipse; J is kept
    ///
    /// α, the logarithm of the plastic volume ratio, changes by ln J − ln J×, where J = det F of the trial state. In
    /// the first two cases J× is the J that belongs to the new pressure. In the third case J× is the J that belongs to
    /// the pressure at the point where the line from (p, q) to the middle of the ellipse crosses the ellipse.
    ///
    /// A particle that does not yield beyond rounding keeps its state bit for bit. The ellipse is that of the trial
    /// state; if a particle softens, its new stress may lie outside of its new, smaller ellipse until the next step.
    ///
    /// Matter that is inverted (det F < 0) has no volume, so it is crushed, and becomes upright.
    ///
    /// In the third case, the new b̂ = J^{−2/D} FFᵀ is t I + s′/μ, where s′ is the reduced deviator of the stress and
    /// the scalar t follows from det b̂ = 1. The paper keeps the old t, which changes J a little.
    template <int D>
    FIRN_INLINE StateAndStress<state<D>, S, D> returned_with_stress(const state<D>& trial) const {
        const Shape<D> shape(trial.F);
        // From here on, all pressures and stresses are divided by the bulk modulus κ.
        const S p = shape.pressure;
        const S p0 = consolidation(trial.log_volume);
        const S lowest = -(cohesion * p0);
        const S M = critical_slope<D>();
        const S ratio = mu / bulk<D>();
        const S qq = named("qq", (S(1) + cohesion + cohesion) * S((6 - D) * 0.5) * ratio * ratio *
                                     squared_norm(shape.deviator));  // (1 + 2β) q²
        const S inside = named("inside", M * M * (p - lowest) * (p0 - p));
        const S rounding = S(detail::strain_rounding<S>);
        const auto crushed = p0 + rounding < p;
        const auto torn = p < lowest - rounding;
        const auto to_tip = crushed | torn;
        const auto yields = to_tip | (max(inside, S(0)) + rounding * rounding < qq);

        StateAndStress<state<D>, S, D> after{trial, shape.deviator};
        S pressure = p;
        if (any(yields)) {
            const S middle = S(0.5) * (p0 + lowest);
            const S away = qq + M * M * (p - middle) * (p - middle);
            const S along = M * S(0.5) * (p0 - lowest) / sqrt(select(S(0) < away, away, S(1)));
            const S met = select(crushed, p0, select(torn, lowest, middle + along * (p - middle)));
            const S log_met = S(0.5) * log(max(S(1) - met - met, S(detail::least_square_of_stretch)));

            const S kept = select(to_tip, S(0), sqrt(max(inside, S(0)) / select(S(0) < qq, qq, S(1))));
            const Mat<S, D> left = shape.deviator * kept;
            const Mat<S, D> on_ellipse = left + Mat<S, D>::diagonal(unit_mean(left, shape.mean));
            const S scale = exp(S(2. / D) * select(to_tip, log_met, shape.log_J));
            const auto F = stretched_to(trial.F, shape.b, shape.determinant, on_ellipse * scale);
            after.state.F = select(yields, F, trial.F);
            after.state.log_volume = select(yields, trial.log_volume + (shape.log_J - log_met), trial.log_volume);
            after.stress = select(yields, left, shape.deviator);
            pressure = select(to_tip, met, p);
        }
        after.stress = after.stress * mu - Mat<S, D>::diagonal(bulk<D>() * pressure);
        return after;
    }
    /// The state after the plastic return mapping.
    template <int D>
    FIRN_INLINE state<D> returned(const state<D>& trial) const {
        return returned_with_stress(trial).state;
    }

private:
    /// The parts of a deformation gradient that stress and yield surface need. A J below 1e-18 is replaced by 1e-18.
    template <int D>
    struct Shape {
        Mat<S, D> b;         ///< left Cauchy–Green tensor b = FFᵀ [1]
        Mat<S, D> deviator;  ///< dev b̂ [1], with b̂ = J^{−2/D} b
        S determinant;       ///< det F [1], not replaced
        S log_J;             ///< ln J [1]
        S mean;              ///< tr b̂/D [1]
        S pressure;          ///< −(J² − 1)/2 [1]: the pressure divided by the bulk modulus

        FIRN_INLINE explicit Shape(const DeformationGradient<S, D>& F) {
            const Mat<S, D> E = left_cauchy_green_change(F);
            b = left_cauchy_green(F);
            const S own = volume_change(F);
            determinant = S(1) + own;
            const S change = max(own, S(-1));
            const S J = named("J", max(determinant, S(detail::least_volume_ratio)));
            log_J = log(J, change);
            const S scale = exp(S(-2. / D) * log_J);
            const S mean_change = trace(E) * S(1. / D);
            mean = named("mean", scale + mean_change * scale);
            deviator = (E - Mat<S, D>::diagonal(mean_change)) * scale;
            pressure = named("p", S(-0.5) * change * (S(2) + change));
        }
    };
    /// Returns J^{−2/D}; J counts as at least least_volume_ratio.
    template <int D>
    FIRN_INLINE static S isochoric(const S& J) {
        return exp(S(-2. / D) * log(max(J, S(detail::least_volume_ratio))));
    }
    /// Returns the number t for which det(t I + e) = 1, where e is symmetric and tr e = 0. In 2D there is a formula. In
    /// 3D the equation is t³ − a t + det e − 1 = 0 with a = ½ ‖e‖². Newton's method solves it; it starts above the
    /// solution, where the left-hand side is convex.
    /// \param above  an upper bound of the solution t
    template <int D>
    FIRN_INLINE static S unit_mean(const Mat<S, D>& e, const S& above) {
        const S a = S(0.5) * squared_norm(e);
        if constexpr (D == 2) {
            return sqrt(S(1) + a);
        } else {
            constexpr int steps = sizeof(value_type_t<S>) == 4 ? 5 : 6;
            const S constant = determinant(e) - S(1);
            return repeat<steps>(min(above, S(1) + S(1.2) * sqrt(a)), [&](const S& t) FIRN_LAMBDA {
                const S slope = S(3) * t * t - a;
                return t - ((t * t - a) * t + constant) / max(slope, S(1e-6));
            });
        }
    }
};

}  // namespace firn::inline FIRN_BUILD
