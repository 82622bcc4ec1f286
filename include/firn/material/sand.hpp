/// \file Sand and other grains: Drucker–Prager plasticity.
#pragma once

#include <firn/material/friction_angle.hpp>
#include <firn/material/hencky.hpp>
#include <firn/math/trigonometric.hpp>

namespace firn {

/// Sand by measurable properties, for Sand::from_properties().
///
/// The sand of Klár et al. 2016 begins at 35° − 10° and hardens by 9° per unit of plastic strain with a decay of 0.2:
/// `{.friction_angle = degrees(35), .hardening = degrees(9), .hardening_decay = 0.2, .initial_loss = degrees(10)}`.
struct SandProperties {
    double young = 3.537e5;              ///< Young's modulus [Pa]
    double poisson = 0.3;                ///< Poisson's ratio [1]
    Angle friction_angle = degrees(35);  ///< h₀: friction angle φ after all hardening
    Angle hardening = degrees(0);        ///< h₁: increase of φ per unit of plastic strain
    double hardening_decay = 0;          ///< h₂: decay of the hardening with plastic strain [1]
    Angle initial_loss = degrees(0);     ///< h₃: by how much φ is smaller before any flow
};

/// Grains without cohesion: sand, gravel, grain. They flow down a slope, pile up, and fly apart under tension.
///
/// Hencky elasticity, with plastic flow where the shear stress exceeds friction:
///
///     ‖dev τ‖ + α tr τ > 0
///     φ = h₀ + (h₁ q − h₃) e^{−h₂ q}
///
/// α = friction_slope(sin φ) is the slope of the Drucker–Prager cone, φ the friction angle, q the plastic strain. The
/// flow keeps the volume (no dilation). In 2D the deviator is that of two dimensions: no plastic flow out of the plane.
///
/// Take it for dry grains; the friction angle is near the angle of repose, 30° to 40° for sand. For grains that stick
/// together, take Nacc.
///
/// Klár et al. 2016, "Drucker-Prager elastoplasticity for sand animation"; the volume correction of Tampubolon et al.
/// 2017, "Multi-species simulation of porous sand and water mixtures", §4.3.
template <scalar S = float>
struct Sand {
    S mu = S(3.537e5 / 2.6);                       ///< shear modulus [Pa]
    S lambda = S(1.0611e5 / (1.3 * 0.4));          ///< first Lamé parameter [Pa]
    S friction_angle = S(0.61086523819801535192);  ///< h₀: friction angle after all hardening [rad]
    S hardening = S(0);                            ///< h₁: increase per unit of plastic strain [rad]
    S hardening_decay = S(0);                      ///< h₂: decay of the hardening [1]
    S initial_loss = S(0);                         ///< h₃: by how much the angle is smaller before any flow [rad]

    static constexpr const char* name = "sand";
    static constexpr auto parameters() {
        return std::tuple{parameter{"mu", "Pa", &Sand::mu},
                          parameter{"lambda", "Pa", &Sand::lambda},
                          parameter{"friction_angle", "rad", &Sand::friction_angle},
                          parameter{"hardening", "rad", &Sand::hardening},
                          parameter{"hardening_decay", "1", &Sand::hardening_decay},
                          parameter{"initial_loss", "rad", &Sand::initial_loss}};
    }

    /// The state of a particle.
    template <int D>
    struct state {
        Mat<S, D> F = Mat<S, D>::identity();  ///< elastic deformation gradient [1]
        S volume_gain = S(0);                 ///< v_c: logarithm of the volume gained while grains were apart [1]
        S plastic_strain = S(0);              ///< q: plastic strain so far [1]

        static constexpr auto fields() {
            return std::tuple{parameter{"deformation_gradient", "1", &state::F},
                              parameter{"volume_gain", "1", &state::volume_gain},
                              parameter{"plastic_strain", "1", &state::plastic_strain}};
        }
    };

    /// The sand of these properties.
    /// \throws parameter_error unless E > 0, −1 < ν < ½, h₁, h₂ ≥ 0, h₂ > 0 if h₁ > 0, and 0° ≤ φ < 90° before, during
    /// and after hardening
    static Sand from_properties(const SandProperties& sand) {
        const Hencky<S> elastic = Hencky<S>::from_young_poisson(sand.young, sand.poisson);
        const double hardening = sand.hardening.in_radians();
        if (!(hardening >= 0 && std::isfinite(hardening)) ||
            !(sand.hardening_decay >= 0 && std::isfinite(sand.hardening_decay)) ||
            (hardening > 0 && sand.hardening_decay == 0))
            throw parameter_error(
                sentence("The friction of sand hardens by ", sand.hardening.in_degrees(), " degrees with a decay of ",
                         sand.hardening_decay,
                         "; both must be finite and not negative, and with hardening the decay must be "
                         "positive, or the angle would grow without bound."));
        const double most = hardening > 0 ? hardening / sand.hardening_decay / std::numbers::e : 0;
        Sand model;
        model.mu = elastic.mu;
        model.lambda = elastic.lambda;
        check_friction_angle(sand.friction_angle - sand.initial_loss);
        check_friction_angle(sand.friction_angle + radians(most));
        model.friction_angle = S(check_friction_angle(sand.friction_angle).in_radians());
        model.hardening = S(hardening);
        model.hardening_decay = S(sand.hardening_decay);
        model.initial_loss = S(sand.initial_loss.in_radians());
        return model;
    }
    /// Checks the parameters.
    /// \throws parameter_error unless the moduli are those of a stable solid with μ > 0, 0 ≤ h₀ < π/2, h₁, h₂ ≥ 0,
    /// h₂ > 0 if h₁ > 0, and h₃ is finite
    void check() const
        requires std::floating_point<S>
    {
        check_lame_of_plastic(double(mu), double(lambda));
        check_friction_angle(radians(double(friction_angle)));
        if (!(hardening >= 0 && hardening_decay >= 0 && std::isfinite(hardening + hardening_decay + initial_loss)) ||
            (hardening > 0 && hardening_decay == 0))
            throw parameter_error(
                sentence("The friction of sand hardens by ", hardening, " rad with a decay of ", hardening_decay,
                         " from a loss of ", initial_loss,
                         " rad; all must be finite, the first two not negative, and with hardening the decay "
                         "must be positive."));
    }

    /// The elastic solid of the same moduli.
    FIRN_INLINE Hencky<S> elastic() const { return {mu, lambda}; }
    /// The slope α of the cone after a plastic strain q [1].
    template <int D>
    FIRN_INLINE S slope(const S& plastic_strain) const {
        const S change = (hardening * plastic_strain - initial_loss) * exp(-(hardening_decay * plastic_strain));
        return named("slope", friction_slope<D>(sin(friction_angle + change)));
    }

    /// Kirchhoff stress τ [Pa] of the elastic part.
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& sand) const {
        return elastic().kirchhoff_stress(sand.F);
    }
    /// Elastic energy ψ [J/m³ of undeformed volume].
    template <int D>
    FIRN_INLINE S energy_density(const state<D>& sand) const {
        return elastic().energy_density(sand.F);
    }
    /// Upper bound of the wave speed [m/s] at an undeformed density [kg/m³], as Hencky's.
    template <int D>
    FIRN_INLINE S wave_speed(const S& density, const state<D>& sand) const {
        return elastic().wave_speed(density, sand.F);
    }

    /// The plastic return mapping and the stress after it. With ε = ln σ + v_c/D of the trial state:
    ///
    ///     Σ ε > 0   the grains are apart: to the tip of the cone, ε = 0, and v_c = Σ ε
    ///     else      if δγ = ‖dev ε‖ + α (D λ + 2 μ)/(2 μ) Σ ε is positive, ‖dev ε‖ falls by δγ, onto the cone; v_c = 0
    ///
    /// The volume v_c gained at the tip must close before the sand bears pressure again. Where v_c = 0 and δγ ≤ 0, the
    /// state is kept to the bit.
    template <int D>
    FIRN_INLINE StateAndStress<state<D>, S, D> returned_with_stress(const state<D>& trial) const {
        const HenckyStrain<S, D> hencky = hencky_strain(trial.F);
        const Vec<S, D> strain = hencky.strain + Vec<S, D>::filled(trial.volume_gain * S(1. / D));
        const S volumetric = named("volumetric", sum_of(strain));
        const Vec<S, D> deviator = strain - Vec<S, D>::filled(volumetric * S(1. / D));
        const S shear = named("shear", norm(deviator));
        const S bulk = (S(D) * lambda + (mu + mu)) / (mu + mu);
        const S slip = named("slip", shear + slope<D>(trial.plastic_strain) * bulk * volumetric);

        const auto at_tip = S(0) < volumetric;
        const auto slips = S(0) < slip;
        const S kept = S(1) - select(slips, slip, S(0)) / select(S(0) < shear, shear, S(1));
        const Vec<S, D> on_cone = deviator * kept + Vec<S, D>::filled(volumetric * S(1. / D));
        const Vec<S, D> after = select(at_tip, Vec<S, D>::zero(), on_cone);
        const auto returns = at_tip | slips | !(trial.volume_gain == S(0));

        state<D> sand;
        sand.F = select(returns, returned_to(trial.F, hencky, after), trial.F);
        sand.volume_gain = select(at_tip, volumetric, S(0));
        sand.plastic_strain = trial.plastic_strain + select(at_tip, norm(strain), select(slips, slip, S(0)));
        return {sand, elastic().stress_of_strain(
                          HenckyStrain<S, D>{hencky.directions, select(returns, after, hencky.strain)})};
    }
    /// The state after the plastic return mapping.
    template <int D>
    FIRN_INLINE state<D> returned(const state<D>& trial) const {
        return returned_with_stress(trial).state;
    }
};

}  // namespace firn
