/// \file Modified Cam clay: soft soils by the parameters of a textbook.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/repeat.hpp>
#include <firn/material/concept.hpp>
#include <firn/math/exp_log.hpp>
#include <firn/math/matrix_functions.hpp>

#include <array>
#include <cmath>

namespace firn::inline FIRN_BUILD {

/// Parameters of modified Cam clay as textbooks give them. ModifiedCamClay::from_properties() makes the material from
/// them. The start state is that of a new particle (F = I): an isotropic effective stress `initial_pressure`.
///
/// The shear stiffness is given in one of three ways. With `shear_modulus` > 0 it is constant. With `shear_ratio` > 0
/// it is proportional to the pressure. If both are 0, it is proportional to the pressure, and follows from `poisson`.
struct ModifiedCamClayProperties {
    double critical_slope = 1;  ///< M: q over p′ in the critical state [1]; 6 sin φ/(3 − sin φ) in triaxial compression
    double compression = 0.2;   ///< λ: slope of the normal compression line in the plane of v = 1 + e and ln p' [1]
    double swelling = 0.04;     ///< κ: slope of the swelling lines in this plane [1]
    double void_ratio = 1;      ///< e₀ in the start state [1]; without effect if `specific_volume` is given
    /// N, in place of e₀: the specific volume v = 1 + e on the normal compression line at p' = 1 kPa [1]. 0: not given.
    /// e₀ is then that of the start state on the textbook's lines: 1 + e₀ = N − λ ln(p_c/1 kPa) + κ ln(p_c/p'₀).
    double specific_volume = 0;
    double shear_modulus = 0;       ///< G, if it is constant [Pa]; 0: not given
    double shear_ratio = 0;         ///< g = G/p', if G is proportional to p' [1]; 0: not given
    double poisson = 0.3;           ///< ν, for g = 3 (1 − 2 ν)/(2 (1 + ν) κ*) if neither G nor g is given [1]
    double initial_pressure = 1e4;  ///< p'₀: the effective pressure in the start state [Pa]
    double consolidation = 5e4;     ///< p_c in the start state: the largest pressure that the clay has borne [Pa]
};

/// Modified Cam clay: a soil that is soft or stiff by its pressure and its history, without cohesion. It hardens as it
/// is compacted, softens as it dilates, and at large shear ends in the critical state q = M p', where it keeps its
/// volume.
///
/// p' = −tr σ/D is the effective pressure, q = √((6 − D)/2) ‖dev σ‖ the shear stress, σ the Cauchy stress. The lines of
/// isotropic compression and swelling are straight in the plane of ln v and ln p' (Butterfield 1979): v/v₀ = J = det F
/// of all deformation. Their slopes are λ* = λ/(1 + e₀), the `compression`, and κ* = κ/(1 + e₀), the `swelling`.
///
///     yields where     q² + M² p' (p' − p_c) > 0,            p_c = p_c0 exp(−v_p/(λ* − κ*))
///     elastic          p' = p'₀ exp(−ε_v/κ* + g k ‖dev ε‖²),  k = 1/κ* − 1
///                      dev τ = 2 (G + g p_K) dev ε,           p_K = J p'
///
/// ε is the logarithmic elastic strain, ε_v = tr ε; v_p is the logarithm of the plastic volume ratio. τ = J σ is the
/// Kirchhoff stress. One of the `shear_modulus` G and the `shear_ratio` g is 0. With g, the shear modulus of σ is g p'.
/// With G, that of τ is constant, and that of σ is G/J. The stress is the derivative of an energy, so elastic cycles
/// neither give nor take work (Houlsby, Amorosi & Rojas 2005, "Elastic moduli of soils dependent on pressure: a
/// hyperelastic formulation"; the exponent k belongs to a pressure p' per present area).
///
/// The flow is associated, and the return mapping is implicit: Roscoe & Burland 1968; Borja & Lee 1990, "Cam-clay
/// plasticity, part I: Implicit integration of elasto-plastic constitutive relations". In 2D p' and q are those of the
/// plane, so that q = |σ₁ − σ₂|, and there is no plastic flow out of the plane.
///
/// **New matter is under pressure.** This elasticity has no state without stress, so F = I is at the `initial_pressure`
/// p'₀ > 0. A body without a load swells by κ* ln(p'₀/p') until p' is what its weight and its load need; if nothing
/// holds it, it flies apart with up to about √(2 κ* p'₀/ρ), 1 m/s from 50 kPa. So give it a pressure as its weight will
/// cause, or less; set_at_rest() gives each particle the stress of its depth, and as a PerParticle of "consolidation"
/// it has a consolidation of its own. The clay bears no tension: p' of a particle that is pulled apart falls to 0
/// without a jump, and it bears pressure again when the gap has closed. p_K and p_c count as at most e³⁰ times their
/// first value, so that the stress of crushed or inverted matter is finite.
///
/// Use ModifiedCamClay for the consolidation, the bearing capacity and the failure of clay whose λ, κ, M and p_c are
/// known. For matter with cohesion, or for soil whose parameters are not known, use Nacc.
template <scalar S = float>
struct ModifiedCamClay {
    S critical_slope = S(1);                ///< M: q over p′ in the critical state [1]
    S compression = S(0.1);                 ///< slope λ* of the normal compression line, ln v over ln p′ [1]
    S swelling = S(0.02);                   ///< slope κ* of the swelling lines, ln v over ln p′ [1]
    S shear_modulus = S(0);                 ///< G, if it is constant [Pa]; else 0
    S shear_ratio = S(1.2 / (2.6 * 0.02));  ///< g = G over p′, if G is proportional to the pressure [1]; else 0
    S initial_pressure = S(1e4);            ///< p′₀: effective pressure where F = I [Pa]
    S consolidation = S(5e4);               ///< p_c0: consolidation pressure before any plastic flow [Pa]

    static constexpr const char* name = "modified_cam_clay";
    static constexpr auto parameters() {
        return std::tuple{parameter{"critical_slope", "1", &ModifiedCamClay::critical_slope},
                          parameter{"compression", "1", &ModifiedCamClay::compression},
                          parameter{"swelling", "1", &ModifiedCamClay::swelling},
                          parameter{"shear_modulus", "Pa", &ModifiedCamClay::shear_modulus},
                          parameter{"shear_ratio", "1", &ModifiedCamClay::shear_ratio},
                          parameter{"initial_pressure", "Pa", &ModifiedCamClay::initial_pressure},
                          parameter{"consolidation", "Pa", &ModifiedCamClay::consolidation}};
    }

    /// The state of a particle.
    template <int D>
    struct state {
        DeformationGradient<S, D> F;  ///< elastic deformation gradient [1]
        S log_volume = S(0);          ///< v_p: logarithm of the plastic volume ratio [1]

        static constexpr auto fields() {
            return std::tuple{parameter{"deformation_gradient", "1", &state::F},
                              parameter{"plastic_log_volume", "1", &state::log_volume}};
        }
    };

    /// Makes the material from the parameters of a textbook.
    /// \throws parameter_error unless M > 0, 0 < κ < λ < 1 + e₀, e₀ > 0, 0 < initial_pressure ≤ consolidation, at most
    /// one of shear_modulus and shear_ratio is given and positive, and −1 < poisson < ½
    static ModifiedCamClay from_properties(const ModifiedCamClayProperties& clay) {
        check_pressures(clay.initial_pressure, clay.consolidation);
        check_slopes(clay.critical_slope, clay.compression, clay.swelling);
        double volume = 1 + clay.void_ratio;
        if (clay.specific_volume != 0) {
            constexpr double unit = 1e3;  // the pressure at which textbooks give N [Pa]
            volume = clay.specific_volume - clay.compression * std::log(clay.consolidation / unit) +
                     clay.swelling * std::log(clay.consolidation / clay.initial_pressure);
        }
        if (!(volume > 1) || !std::isfinite(volume))
            throw parameter_error(sentence("The void ratio of Cam clay in the start state is ", volume - 1,
                                           "; it must be positive and finite. It is void_ratio, or follows from "
                                           "specific_volume, which is N at 1 kPa."));
        if (!(clay.compression < volume))
            throw parameter_error(sentence("The slope λ of Cam clay is ", clay.compression,
                                           "; it must be less than the specific volume 1 + e₀ = ", volume, "."));
        if (!(clay.shear_modulus >= 0 && clay.shear_ratio >= 0) || (clay.shear_modulus > 0 && clay.shear_ratio > 0))
            throw parameter_error(sentence("The shear modulus of Cam clay is ", clay.shear_modulus,
                                           " Pa and its ratio to the pressure ", clay.shear_ratio,
                                           "; give one of the two, positive, or leave both at 0 for poisson."));
        if (!(clay.poisson > -1 && clay.poisson < 0.5))
            throw parameter_error(sentence("Poisson's ratio of Cam clay is ", clay.poisson,
                                           "; it must lie between −1 and ½, both excluded."));
        const double swell = clay.swelling / volume;
        const double of_poisson = 3 * (1 - 2 * clay.poisson) / (2 * (1 + clay.poisson) * swell);
        const bool given = clay.shear_modulus > 0 || clay.shear_ratio > 0;
        ModifiedCamClay model;
        model.critical_slope = S(clay.critical_slope);
        model.compression = S(clay.compression / volume);
        model.swelling = S(swell);
        model.shear_modulus = S(clay.shear_modulus);
        model.shear_ratio = S(given ? clay.shear_ratio : of_poisson);
        model.initial_pressure = S(clay.initial_pressure);
        model.consolidation = S(clay.consolidation);
        if constexpr (std::floating_point<S>) model.check();
        return model;
    }
    /// Checks the parameters.
    /// \throws parameter_error unless M > 0, 0 < κ* < λ* < 1, 0 < initial_pressure ≤ consolidation, one of
    /// shear_modulus and shear_ratio is positive and the other 0, and all are finite
    void check() const
        requires std::floating_point<S>
    {
        check_pressures(double(initial_pressure), double(consolidation));
        check_slopes(double(critical_slope), double(compression), double(swelling));
        if (!(compression < 1))
            throw parameter_error(
                sentence("The slope λ* of Cam clay is ", compression, "; it must be less than 1. It is λ/(1 + e₀)."));
        if (!(shear_modulus >= 0 && shear_ratio >= 0) || !std::isfinite(shear_modulus + shear_ratio) ||
            (shear_modulus > 0) == (shear_ratio > 0))
            throw parameter_error(sentence("Cam clay has shear_modulus = ", shear_modulus,
                                           " Pa and shear_ratio = ", shear_ratio,
                                           "; one of the two must be positive and finite, and the other 0."));
    }

    /// Returns the consolidation pressure p_c [Pa] of a state; it counts as at most e³⁰ p_c0.
    /// \param log_volume  the state's `log_volume` v_p [1]
    FIRN_INLINE S consolidation_pressure(const S& log_volume) const {
        return consolidation * exp(limited(-(log_volume / (compression - swelling)), highest_exponent));
    }

    /// Kirchhoff stress τ = −p_K I + 2 (G + g p_K) dev ε [Pa].
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& clay) const {
        const Strain<D> strain(clay.F);
        return stress_of(strain.deviator, pressure(clay.log_volume, strain.volumetric, strain.square));
    }
    /// Elastic energy ψ = p_K/k + G ‖dev ε‖² [J/m³ of undeformed volume]; k = 1/κ* − 1. Its zero is the state without
    /// pressure.
    template <int D>
    FIRN_INLINE S energy_density(const state<D>& clay) const {
        const Strain<D> strain(clay.F);
        return pressure(clay.log_volume, strain.volumetric, strain.square) / stiffness() +
               shear_modulus * strain.square;
    }
    /// Upper bound c of the wave speed [m/s], for the density ρ0 of the undeformed material [kg/m³]:
    ///
    ///     ρ0 c² = k p_K (1 + d)² + 2μ (1 − 1/D + Δ + m ‖dev ε‖) + p_K
    ///
    /// Here μ = G + g p_K is the shear modulus, m = √(1 − 1/D), d = 2 g m ‖dev ε‖, Δ = √2 ‖dev ε‖. The tangent is
    /// k p_K a aᵀ + 2μ (I − 1 1ᵀ/D) in principal axes, with a = 1 − 2 g dev ε. So the bound is that of Hencky, where Δ
    /// bounds the difference of two principal strains and the last two terms bound the compression −τ_min; the terms
    /// with d bound how much a differs from 1. The code takes an upper bound of ‖dev ε‖, which follows from the ratios
    /// of the principal values of b = FFᵀ, with e = dev b and x² ≤ sinh² x:
    ///
    ///     ‖dev ε‖² ≤ (tr b tr b⁻¹ − D²)/(4 D) = ‖e‖²/(4 J²) in 2D, (‖e‖² tr b/3 − 3 det e)/(4 J²) in 3D
    template <int D>
    FIRN_INLINE S wave_speed(const S& density, const state<D>& clay) const {
        const S own = volume_change(clay.F);
        const S J = max(S(1) + own, S(detail::least_volume_ratio));
        const S log_J = log(J, max(own, S(-1)));
        const Mat<S, D> E = left_cauchy_green_change(clay.F);
        const S mean = trace(E) * S(1. / D);
        const Mat<S, D> e = E - Mat<S, D>::diagonal(mean);
        S spread = squared_norm(e);
        if constexpr (D == 3) spread = spread + mean * spread - S(3) * determinant(e);
        const S square = max(limited(S(0.25) * spread / (J * J), 400), S(0));
        const S length = sqrt(square);
        const S p = pressure(clay.log_volume, log_J, square);
        const S mu = shear_modulus + shear_ratio * p;
        constexpr double most = D == 2 ? 0.70710678118654752440 : 0.81649658092772603273;
        const S longer = S(1) + S(2 * most) * shear_ratio * length;
        const S bulk = stiffness() * p * longer * longer;
        return sqrt((bulk + (mu + mu) * (S(1 - 1. / D) + S(1.41421356237309504880 + most) * length) + p) / density);
    }

    /// Returns the state after the plastic return mapping, and the Kirchhoff stress [Pa] in this state. A state that
    /// yields flows to the ellipse of the new p_c, along the ellipse's normal there. A particle that does not yield
    /// beyond rounding keeps its state bit for bit. Inverted matter (det F < 0) is crushed, and becomes upright.
    ///
    /// One number decides the return: t = q/(M p') of the new state. On the ellipse p'/p_c = 1/(1 + t²). With L =
    /// ln(1 + t²), s = ‖dev ε‖/√((6 − D)/2), s₀ and ℓ = ln(p'/p_c) of the trial state without the part of p' by shear,
    ///
    ///     −Δv_p = (ℓ + (6 − D)/2 g k s² + L)/a,               a = 1/κ* + 1/(λ* − κ*)
    ///     s = M t/((6 − D) g),    or with G:  s = c t exp(−(1 − κ*/λ*) L)
    ///     normal flow:  M (1 − t²)(s₀ − s) = 2 t (−Δv_p)
    ///
    /// The last equation gives t. On the wet side of the critical state t lies between 0 and 1, on the dry side z = 1/t
    /// does; either equation in z is positive at the trial's end and negative at z = 1. Newton's method solves it
    /// within this bracket. Since only logarithms of pressures occur, a trial state may lie at any distance.
    ///
    /// Near p' = 0 the normal turns to −p', so that a shear strain of rounding would dilate the clay without bound and
    /// take its p_c. So where p' < p_c/1000 the direction of flow is that at p_c/1000. Where p' < 4e-18 p_c after that,
    /// the clay is apart, and keeps no shear at all.
    template <int D>
    FIRN_INLINE StateAndStress<state<D>, S, D> returned_with_stress(const state<D>& trial) const {
        const Strain<D> strain(trial.F);
        const Trial own = trial_of<D>(strain, trial.log_volume);
        const auto yields = own.yields;
        StateAndStress<state<D>, S, D> after{trial, strain.deviator};
        S volumetric = strain.volumetric;
        if (any(yields)) {
            const Returned flow = flow_of(own);
            const S lost = select(yields, flow.kept - S(1), S(0));
            const S compaction = select(yields, flow.compaction, S(0));
            const Mat<S, D> change = strain.deviator * lost + Mat<S, D>::diagonal(compaction * S(1. / D));
            after.state.F = select(yields, strained_by(trial.F, change), trial.F);
            after.state.log_volume = trial.log_volume - compaction;
            after.stress = strain.deviator + strain.deviator * lost;
            volumetric = volumetric + compaction;
        }
        after.stress =
            stress_of(after.stress, pressure(after.state.log_volume, volumetric, squared_norm(after.stress)));
        return after;
    }
    /// The state after the plastic return mapping.
    template <int D>
    FIRN_INLINE state<D> returned(const state<D>& trial) const {
        return returned_with_stress(trial).state;
    }

private:
    static constexpr double highest_exponent = 30;          // p_K and p_c count as at most e³⁰ times their first value
    static constexpr double steepest = 31.606961258558215;  // t where p' = p_c/1000; the flow is no steeper beyond it

    /// Returns x, but at most `highest`. NaN stays NaN.
    FIRN_INLINE static S limited(const S& x, double highest) { return select(S(highest) < x, S(highest), x); }
    /// k = 1/κ* − 1 [1]: −d ln p_K / dε_v.
    FIRN_INLINE S stiffness() const { return (S(1) - swelling) / swelling; }

    /// The logarithmic elastic strain in parts.
    template <int D>
    struct Strain {
        Mat<S, D> deviator;  ///< dev ε [1]
        S volumetric;        ///< tr ε [1]
        S square;            ///< ‖dev ε‖² [1]

        FIRN_INLINE explicit Strain(const DeformationGradient<S, D>& F) {
            const Mat<S, D> strain = logarithmic_strain(F);
            volumetric = named("volumetric", trace(strain));
            deviator = strain - Mat<S, D>::diagonal(volumetric * S(1. / D));
            square = named("square", squared_norm(deviator));
        }
    };
    /// Returns p_K = J p' [Pa]. \param square  ‖dev ε‖² [1]
    FIRN_INLINE S pressure(const S& log_volume, const S& volumetric, const S& square) const {
        const S exponent = log_volume + stiffness() * (shear_ratio * square - volumetric);
        return named("p", initial_pressure * exp(limited(exponent, highest_exponent)));
    }
    template <int D>
    FIRN_INLINE Mat<S, D> stress_of(const Mat<S, D>& deviator, const S& p) const {
        const S mu = shear_modulus + shear_ratio * p;
        return deviator * (mu + mu) - Mat<S, D>::diagonal(p);
    }

    /// What the return needs of a trial state, in the terms of returned_with_stress().
    struct Trial {
        mask_t<S> constant;  ///< whether G is constant
        mask_t<S> yields;    ///< whether the state lies outside of the ellipse beyond rounding
        S shear;             ///< s₀ [1]
        S level;             ///< ℓ [1]
        S size;              ///< e^ℓ with G [1]
        S per_t;             ///< c, or M/((6 − D) g): s/t at t = 0 [1]
        S coupling;          ///< (6 − D)/2 g k [1]
        S softness;          ///< 1/a [1]
        S fall;              ///< 1 − κ*/λ* with G, 0 with g [1]
    };
    template <int D>
    FIRN_INLINE Trial trial_of(const Strain<D>& strain, const S& log_volume) const {
        constexpr double rounding = detail::strain_rounding<S>;
        const S per_swelling = S(1) / swelling;
        const S plastic = compression - swelling;
        const S hardened = log_volume / plastic;  // −ln(p_c/p_c0)
        const S ratio = swelling / compression;
        const mask_t<S> constant = S(0) < shear_modulus;
        const S shear = named("shear", sqrt(strain.square * S(2. / (6 - D))));
        const S level =
            named("level", log(initial_pressure / consolidation) - strain.volumetric * per_swelling + hardened);
        const S coupling = S((6 - D) * 0.5) * shear_ratio * stiffness();
        // A state yields where x² + y² > x, with x = p'/p_c and y = q/(M p_c). Strains that are only rounding are left
        // out.
        const S outer = max(shear - S(2 * rounding), S(0)) * shear;
        const S x = exp(limited(level + coupling * outer, 30));
        S per_t = critical_slope / (S(6 - D) * select(constant, S(1), shear_ratio));
        S steepness = x / per_t;  // y/s
        if (any(constant)) {
            const S exponent = max(log_volume + strain.volumetric - hardened, S(-60));  // of J p_c/p_c0
            const S modulus = S(6 - D) * select(constant, shear_modulus, S(1));
            const S unlimited = modulus / (critical_slope * consolidation * exp(limited(exponent, 60)));
            steepness = select(constant, limited(unlimited, 1e15), steepness);
            per_t = select(constant, exp(limited(ratio * level, 60)) / unlimited, per_t);
        }
        const mask_t<S> yields = x + S(rounding) * per_swelling * x < x * x + steepness * steepness * outer;
        return {
            constant, yields, shear, level, x, per_t, coupling, ratio * plastic, select(constant, S(1) - ratio, S(0))};
    }

    /// The equation of the return at one z, and what belongs to this z, with derivatives by z.
    struct Flow {
        S value, slope;                 ///< M (1 − z²)(s₀ − s) − 2 z |Δv_p|
        S t, t_by_z;                    ///< t
        S ratio, ratio_by_z;            ///< s/t
        S compaction, compaction_by_z;  ///< −Δv_p
    };
    FIRN_INLINE Flow flow_at(const Trial& own, const mask_t<S>& wet, const S& z) const {
        const S round = S(1) + z * z;
        const S per_both = S(1) / (select(wet, S(1), z) * round);  // one division for 1/z and 1/(1 + z²)
        const S t = select(wet, z, per_both * round);
        const S t_by_z = select(wet, S(1), -(t * t));
        const S log_size = log(S(1) + t * t);
        const S log_by_z = S(2) * per_both * select(wet, z, S(-1));
        S ratio = own.per_t;
        if (any(own.constant)) ratio = ratio * exp(-(own.fall * log_size));
        const S ratio_by_z = -(own.fall * ratio * log_by_z);
        const S s = ratio * t;
        const S s_by_z = ratio * t_by_z + ratio_by_z * t;
        const S compaction = (own.level + own.coupling * s * s + log_size) * own.softness;
        const S compaction_by_z = (S(2) * own.coupling * s * s_by_z + log_by_z) * own.softness;

        const S sign = select(wet, S(1), S(-1));
        const mask_t<S> turns = wet | (S(1 / steepest) < z);
        const S held = select(turns, z, S(1 / steepest));
        const S side = critical_slope * (S(1) - held * held);
        const S value = side * (own.shear - s) - S(2) * held * sign * compaction;
        const S by_direction = select(turns, z * critical_slope * (own.shear - s) + sign * compaction, S(0));
        const S slope = -(S(2) * (by_direction + held * sign * compaction_by_z) + side * s_by_z);
        return {value, slope, t, t_by_z, ratio, ratio_by_z, compaction, compaction_by_z};
    }

    /// Where Newton's method starts, and where it has no work.
    struct Start {
        S z,              ///< z
            lowest;       ///< a z at which the equation is not negative
        mask_t<S> apart;  ///< whether the clay comes apart: s = 0, with the steepest flow
    };
    static constexpr double steep = 0.5 * (steepest - 1 / steepest);  // −Δv_p/Δs of the steepest flow, per M
    FIRN_INLINE Start start_of(const Trial& own, const mask_t<S>& wet) const {
        const S pull = critical_slope * own.shear / own.softness;  // a M s₀
        const S gap = max(-own.level, S(0));
        const S trial_t = sqrt(max(S(1) / max(own.size, S(1e-35)) - S(1), S(0)));  // with G: where p' is the trial's

        // Wet: the lowest of some estimates, each of which is close where one term of the equation is small.
        const S lowest = select(own.constant, min(trial_t, S(1)), S(0));
        const S drag = critical_slope * own.per_t + S(2) * own.softness * max(own.level, S(0));
        const S linear = critical_slope * own.shear / max(drag, S(detail::least_square));
        const S estimate = min(min(linear, S(0.9)), lowest + sqrt(sqrt(pull)));
        Start start{max(lowest, estimate), lowest, S(1) < S(0)};

        // Dry: the largest of the lower bounds of z; from there Newton's method rises to the solution.
        const mask_t<S> dry = own.yields & !wet;
        if (any(dry)) {
            const S normal_t = S(1) + (gap + gap) / select(S(0) < pull, pull, S(1));
            const mask_t<S> turns = normal_t < S(steepest);
            const S log_held_t = S(0.5) * (gap - S(steep) * pull);  // of t with the steepest flow and s = 0
            const S of_constant = select(turns, min(trial_t, normal_t), exp(limited(log_held_t, 20)));
            const S coupling = select(own.constant, S(1), own.coupling);
            const S of_coupled = min(sqrt(gap / coupling), own.shear) / own.per_t;
            const S t = select(own.constant, of_constant, select(turns, min(normal_t, of_coupled), of_coupled));
            start.z = select(dry, S(1) / max(t, S(1)), start.z);
            start.lowest = select(dry, S(0), start.lowest);
            const mask_t<S> flat = own.constant & (S(20) < log_held_t);
            start.apart = dry & flat & !turns;
        }
        return start;
    }
    struct Returned {
        S kept;        ///< what is left of dev ε, as a part of it [1]
        S compaction;  ///< −Δv_p [1]
    };
    FIRN_INLINE Returned flow_of(const Trial& own) const {
        const S coupled_level = own.level + own.coupling * own.per_t * own.per_t;
        const mask_t<S> wet =
            S(-0.69314718055994530942) < select(own.constant, own.level, coupled_level);  // −Δv_p > 0 at t = 1
        const Start start = start_of(own, wet);
        const mask_t<S> solves = own.yields & !start.apart;

        // Of z and its bracket; and t, s/t and −Δv_p after the last step, whose derivatives are those of the solution.
        using Numbers = std::array<Vec<S, 3>, 2>;
        constexpr double near = sizeof(value_type_t<S>) == 4 ? 3e-4 : 1e-9;
        const Numbers first{Vec<S, 3>{start.z, start.lowest, S(1)}, Vec<S, 3>{S(1), S(1), S(0)}};
        const Numbers found = repeat_while<16>(first, [&](Numbers& numbers) FIRN_LAMBDA {
            Vec<S, 3>& bracket = numbers[0];
            const S z = bracket.v[0];
            const Flow flow = flow_at(own, wet, z);
            const mask_t<S> below = S(0) < flow.value;
            const S low = select(below, z, bracket.v[1]);
            const S high = select(below, bracket.v[2], z);
            const mask_t<S> falls = flow.slope < S(0);
            const S step = -(flow.value / select(falls, flow.slope, S(-1)));
            const S newton = z + step;
            const mask_t<S> above = low <= newton;
            const mask_t<S> inside = falls & above & (newton <= high);
            const S next = select(inside, newton, S(0.5) * (low + high));
            const mask_t<S> moves = S(near) * z < abs(next - z);
            const mask_t<S> goes_on = solves & moves;
            bracket = {select(goes_on, next, z), select(goes_on, low, bracket.v[1]),
                       select(goes_on, high, bracket.v[2])};
            numbers[1] = {flow.t + flow.t_by_z * step, flow.ratio + flow.ratio_by_z * step,
                          flow.compaction + flow.compaction_by_z * step};
            return goes_on;
        });
        const S t = found[1].v[0];
        const S ratio = found[1].v[1];
        const S compaction = found[1].v[2];
        // s/s₀ is s by s₀, and near t = 0, where both are 0, it comes from the equation.
        const mask_t<S> round = t < S(0.5);
        const S side = select(round, critical_slope * (S(1) - t * t) * ratio, S(0));
        const S whole = select(round, max(side + S(2) * compaction, S(detail::least_square)), S(1));
        const S some = select(S(0) < own.shear, own.shear, S(1));
        const S kept = select(round, side / whole, ratio * t / some);
        return {select(start.apart, S(0), kept),
                select(start.apart, -(S(steep) * critical_slope * own.shear), compaction)};
    }

    static void check_pressures(double initial, double highest) {
        if (!(initial > 0) || !std::isfinite(initial))
            throw parameter_error(sentence("The initial pressure of Cam clay is ", initial,
                                           " Pa; it must be positive and finite, because this elasticity has no state "
                                           "without stress. Take what the weight of the clay causes."));
        if (!(highest >= initial) || !std::isfinite(highest))
            throw parameter_error(sentence("The consolidation pressure of Cam clay is ", highest,
                                           " Pa; it must be finite, and at least the initial pressure, ", initial,
                                           " Pa."));
    }
    static void check_slopes(double M, double lambda, double kappa) {
        if (!(M > 0) || !std::isfinite(M))
            throw parameter_error(
                sentence("The critical slope M of Cam clay is ", M,
                         "; it must be positive and finite. A friction angle of 25 degrees gives 1."));
        if (!(kappa > 0 && kappa < lambda) || !std::isfinite(lambda))
            throw parameter_error(sentence("The slopes of Cam clay are λ = ", lambda, " and κ = ", kappa,
                                           "; both must be positive and finite, and κ less than λ."));
    }
};

}  // namespace firn::inline FIRN_BUILD
