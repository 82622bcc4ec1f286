/// \file Sand: Hencky elasticity under a cone of Drucker and Prager, without dilation of its flow. Klár et al. 2016,
/// "Drucker-Prager elastoplasticity for sand animation"; the volume correction of Tampubolon et al. 2017,
/// "Multi-species simulation of porous sand and water mixtures", §4.3.
#pragma once

#include <firn/material/friction_angle.hpp>
#include <firn/material/hencky.hpp>
#include <firn/math/trigonometric.hpp>

namespace firn {

/// Sand in terms that can be measured. Klár et al. harden from 35° − 10° by 9° a unit of plastic strain with a decay of
/// 0.2: `{.friction_angle = degrees(35), .hardening = degrees(9), .hardening_decay = 0.2, .initial_loss =
/// degrees(10)}`.
struct SandProperties {
    double young = 3.537e5;              ///< Young's modulus [Pa]
    double poisson = 0.3;                ///< Poisson's ratio [1]
    Angle friction_angle = degrees(35);  ///< φ, after all hardening
    Angle hardening = degrees(0);        ///< h₁, for a unit of plastic strain
    double hardening_decay = 0;          ///< h₂ [1]
    Angle initial_loss = degrees(0);     ///< h₃, what φ lacks before any flow
};

/// Yields where ‖dev τ‖ + α tr τ > 0, α from the friction angle φ = h₀ + (h₁ q − h₃) e^{−h₂ q} (friction_slope()).
/// In 2D the deviator is that of two dimensions: no plastic flow out of the plane.
template <scalar S = float>
struct Sand {
    S mu = S(3.537e5 / 2.6);                       ///< shear modulus [Pa]
    S lambda = S(1.0611e5 / (1.3 * 0.4));          ///< first Lamé parameter [Pa]
    S friction_angle = S(0.61086523819801535192);  ///< h₀ [rad]
    S hardening = S(0);                            ///< h₁ [rad]
    S hardening_decay = S(0);                      ///< h₂ [1]
    S initial_loss = S(0);                         ///< h₃ [rad]

    static constexpr const char* name = "sand";
    static constexpr auto parameters() {
        return std::tuple{parameter{"mu", "Pa", &Sand::mu},
                          parameter{"lambda", "Pa", &Sand::lambda},
                          parameter{"friction_angle", "rad", &Sand::friction_angle},
                          parameter{"hardening", "rad", &Sand::hardening},
                          parameter{"hardening_decay", "1", &Sand::hardening_decay},
                          parameter{"initial_loss", "rad", &Sand::initial_loss}};
    }

    template <int D>
    struct state {
        Mat<S, D> F = Mat<S, D>::identity();  ///< elastic deformation gradient [1]
        S volume_gain = S(0);                 ///< v_c, logarithm of the volume that opened under no stress [1]
        S plastic_strain = S(0);              ///< q, what has flowed [1]

        static constexpr auto fields() {
            return std::tuple{parameter{"deformation_gradient", "1", &state::F},
                              parameter{"volume_gain", "1", &state::volume_gain},
                              parameter{"plastic_strain", "1", &state::plastic_strain}};
        }
    };

    /// \throws parameter_error unless E > 0, −1 < ν < ½, φ lies between 0° and 90° from the first to the last, and
    /// h₁, h₂ ≥ 0
    static Sand from_properties(const SandProperties& sand) {
        const Hencky<S> elastic = Hencky<S>::from_young_poisson(sand.young, sand.poisson);
        const double hardening = sand.hardening.in_radians();
        if (!(hardening >= 0 && std::isfinite(hardening)) ||
            !(sand.hardening_decay >= 0 && std::isfinite(sand.hardening_decay)) ||
            (hardening > 0 && sand.hardening_decay == 0))
            throw parameter_error(
                sentence("The friction of sand hardens by ", sand.hardening.in_degrees(), " degrees with a decay of ",
                         sand.hardening_decay,
                         "; both must be finite and not negative, and what hardens must decay, as the "
                         "angle would grow without a bound."));
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
    /// \throws parameter_error unless the moduli are those of a stable solid, 0 ≤ h₀ < π/2, h₁, h₂ ≥ 0, h₃ is finite,
    /// and what hardens decays
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
                         " rad; all must be finite, the first two not negative, and what hardens must "
                         "decay."));
    }

    FIRN_INLINE Hencky<S> elastic() const { return {mu, lambda}; }
    /// α after a plastic strain q. [1]
    template <int D>
    FIRN_INLINE S slope(const S& plastic_strain) const {
        const S change = (hardening * plastic_strain - initial_loss) * exp(-(hardening_decay * plastic_strain));
        return named("slope", friction_slope<D>(sin(friction_angle + change)));
    }

    /// τ [Pa]
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& sand) const {
        return elastic().kirchhoff_stress(sand.F);
    }
    /// ψ [J/m³ of undeformed volume]
    template <int D>
    FIRN_INLINE S energy_density(const state<D>& sand) const {
        return elastic().energy_density(sand.F);
    }
    /// [m/s]
    template <int D>
    FIRN_INLINE S wave_speed(const S& density, const state<D>& sand) const {
        return elastic().wave_speed(density, sand.F);
    }

    /// With ε = ln σ + v_c/D of the trial: to ε = 0 where Σ ε > 0, the tip of the cone, and v_c = Σ ε; else along the
    /// deviator onto the cone, by δγ = ‖dev ε‖ + α (D λ + 2 μ)/(2 μ) Σ ε if that is positive, and v_c = 0. What opened
    /// at the tip must close before sand bears pressure again. Nothing changes, to the bit, where v_c = 0 and δγ ≤ 0.
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
    template <int D>
    FIRN_INLINE state<D> returned(const state<D>& trial) const {
        return returned_with_stress(trial).state;
    }
};

}  // namespace firn
