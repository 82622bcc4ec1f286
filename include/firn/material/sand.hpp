/// \file Sand and other grains: Drucker–Prager plasticity.
#pragma once

#include <firn/material/friction_angle.hpp>
#include <firn/material/hencky.hpp>
#include <firn/math/trigonometric.hpp>

namespace firn::inline FIRN_BUILD {

/// Measurable properties of sand. Sand::from_properties() makes the material from these properties.
///
/// The sand of Klár et al. 2016 has a friction angle of 35° − 10° = 25° before any plastic flow. The angle grows by 9°
/// per unit of plastic strain, and this growth decays at the rate 0.2:
/// `{.friction_angle = degrees(35), .hardening = degrees(9), .hardening_decay = 0.2, .initial_loss = degrees(10)}`.
struct SandProperties {
    double young = 3.537e5;              ///< Young's modulus [Pa]
    double poisson = 0.3;                ///< Poisson's ratio [1]
    Angle friction_angle = degrees(35);  ///< h₀: friction angle φ after complete hardening
    Angle hardening = degrees(0);        ///< h₁: increase of φ per unit of plastic strain
    double hardening_decay = 0;          ///< h₂: rate at which the hardening decays with plastic strain [1]
    Angle initial_loss = degrees(0);     ///< h₃: before any plastic flow, φ is h₀ − h₃
};

/// Grains without cohesion: sand, gravel, rice. They flow down a slope, pile up, and fly apart under tension.
///
/// The elasticity is that of Hencky. There is plastic flow where the shear stress exceeds friction:
///
///     ‖dev τ‖ + α tr τ > 0
///     φ = h₀ + (h₁ q − h₃) e^{−h₂ q}
///
/// τ is the Kirchhoff stress, α = friction_slope(sin φ) the slope of the Drucker–Prager cone, φ the friction angle, and
/// q the plastic strain. h₀ to h₃ are the parameters from `friction_angle` to `initial_loss`. Plastic flow keeps the
/// volume (no dilatancy). In 2D the deviator is taken in two dimensions, so there is no plastic flow out of the plane.
///
/// Use Sand for dry grains; the friction angle is near the angle of repose, 30° to 40° for sand. For grains that stick
/// together, use Nacc.
///
/// Klár et al. 2016, "Drucker-Prager elastoplasticity for sand animation"; the volume correction is from Tampubolon et
/// al. 2017, "Multi-species simulation of porous sand and water mixtures", §4.3.
template <scalar S = float>
struct Sand {
    S mu = S(3.537e5 / 2.6);                       ///< shear modulus [Pa]
    S lambda = S(1.0611e5 / (1.3 * 0.4));          ///< first Lamé parameter [Pa]
    S friction_angle = S(0.61086523819801535192);  ///< h₀: friction angle φ after complete hardening [rad]
    S hardening = S(0);                            ///< h₁: increase of φ per unit of plastic strain [rad]
    S hardening_decay = S(0);                      ///< h₂: rate at which the hardening decays with plastic strain [1]
    S initial_loss = S(0);                         ///< h₃: before any plastic flow, φ is h₀ − h₃ [rad]

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
        DeformationGradient<S, D> F;  ///< elastic deformation gradient [1]
        S volume_gain = S(0);         ///< v_c: logarithm of the volume ratio gained while grains were apart [1]
        S plastic_strain = S(0);      ///< q: plastic strain so far [1]

        static constexpr auto fields() {
            return std::tuple{parameter{"deformation_gradient", "1", &state::F},
                              parameter{"volume_gain", "1", &state::volume_gain},
                              parameter{"plastic_strain", "1", &state::plastic_strain}};
        }
    };

    /// Makes the material from measurable properties.
    /// \throws parameter_error unless young > 0, −1 < poisson < ½, hardening ≥ 0, hardening_decay ≥ 0 (> 0 if there is
    /// hardening), and 0° ≤ φ < 90° for the friction angle φ before, during and after hardening
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
        Sand model;
        model.mu = elastic.mu;
        model.lambda = elastic.lambda;
        model.friction_angle = S(sand.friction_angle.in_radians());
        model.hardening = S(hardening);
        model.hardening_decay = S(sand.hardening_decay);
        model.initial_loss = S(sand.initial_loss.in_radians());
        check_angles(sand.friction_angle.in_radians(), hardening, sand.hardening_decay, sand.initial_loss.in_radians());
        return model;
    }
    /// Checks the parameters.
    /// \throws parameter_error unless μ > 0, λ + 2 μ/3 > 0, hardening ≥ 0, hardening_decay ≥ 0 (> 0 if there is
    /// hardening), initial_loss is finite, and 0 ≤ φ < π/2 for the friction angle φ before, during and after hardening
    void check() const
        requires std::floating_point<S>
    {
        check_lame_of_plastic(double(mu), double(lambda));
        if (!(hardening >= 0 && hardening_decay >= 0 && std::isfinite(hardening + hardening_decay + initial_loss)) ||
            (hardening > 0 && hardening_decay == 0))
            throw parameter_error(
                sentence("The friction of sand hardens by ", hardening, " rad with a decay of ", hardening_decay,
                         " from a loss of ", initial_loss,
                         " rad; all must be finite, the first two not negative, and with hardening the decay "
                         "must be positive."));
        check_angles(double(friction_angle), double(hardening), double(hardening_decay), double(initial_loss));
    }

    /// The elastic solid with the moduli of this sand.
    FIRN_INLINE Hencky<S> elastic() const { return {mu, lambda}; }
    /// Returns the slope α [1] of the Drucker–Prager cone after a plastic strain q [1].
    template <int D>
    FIRN_INLINE S slope(const S& plastic_strain) const {
        const S change = (hardening * plastic_strain - initial_loss) * exp(-(hardening_decay * plastic_strain));
        return named("slope", friction_slope<D>(sin(friction_angle + change)));
    }

    /// Kirchhoff stress τ [Pa], computed as in Hencky from the elastic F.
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& sand) const {
        return elastic().kirchhoff_stress(sand.F);
    }
    /// Elastic energy ψ [J/m³ of undeformed volume], computed as in Hencky from the elastic F.
    template <int D>
    FIRN_INLINE S energy_density(const state<D>& sand) const {
        return elastic().energy_density(sand.F);
    }
    /// Upper bound of the wave speed [m/s], computed as in Hencky from the elastic F. `density` is the density of the
    /// undeformed material [kg/m³].
    template <int D>
    FIRN_INLINE S wave_speed(const S& density, const state<D>& sand) const {
        return elastic().wave_speed(density, sand.F);
    }

    /// Returns the state after the plastic return mapping, and the Kirchhoff stress [Pa] in this state. Let ε = ln σ +
    /// v_c/D be the principal strains of the trial state, where σ are the singular values of F and v_c is
    /// `volume_gain`:
    ///
    ///     Σ ε > 0   the grains are apart: ε becomes 0 (the tip of the cone), and v_c becomes Σ ε
    ///     else      v_c becomes 0; and if δγ = ‖dev ε‖ + α (D λ + 2 μ)/(2 μ) Σ ε is positive, ‖dev ε‖ is reduced
    ///               by δγ
    ///
    /// α is slope(), the slope of the cone; μ and λ are the Lamé parameters. Sand that has gained volume at the tip
    /// bears pressure only after it has lost this volume again. Where v_c = 0, Σ ε ≤ 0 and δγ ≤ 0, the state is kept
    /// bit for bit.
    ///
    /// q grows by the strain that the step takes from F, δq of Klár et al. 2016: ‖ln σ‖ at the tip, δγ on the cone. The
    /// volume v_c that was gained in earlier steps is not taken again. At the tip, F is kept bit for bit where ‖ln σ‖
    /// is not beyond rounding.
    template <int D>
    FIRN_INLINE StateAndStress<state<D>, S, D> returned_with_stress(const state<D>& trial) const {
        const Mat<S, D> elastic_strain = logarithmic_strain(trial.F);
        const S gain = trial.volume_gain * S(1. / D);
        const Mat<S, D> strain = elastic_strain + Mat<S, D>::diagonal(gain);
        const S volumetric = named("volumetric", trace(strain));
        const Mat<S, D> deviator = strain - Mat<S, D>::diagonal(volumetric * S(1. / D));
        const S shear = named("shear", sqrt(squared_norm(deviator)));
        const S bulk = (S(D) * lambda + (mu + mu)) / (mu + mu);
        const S slip = named("slip", shear + slope<D>(trial.plastic_strain) * bulk * volumetric);

        const S opening = sqrt(squared_norm(elastic_strain));
        const auto at_tip = S(0) < volumetric;
        const auto opens = at_tip & (S(2 * detail::strain_rounding<S>) < opening);
        const auto on_cone = !at_tip;
        const auto slips = S(0) < slip;
        const S lost = select(slips, slip, S(0)) / select(S(0) < shear, shear, S(1));
        const Mat<S, D> change = select(at_tip, elastic_strain * S(-1), Mat<S, D>::diagonal(gain) - deviator * lost);
        const auto returns = opens | (on_cone & (slips | !(trial.volume_gain == S(0))));

        state<D> sand = trial;
        if (any(returns)) sand.F = select(returns, strained_by(trial.F, change), trial.F);
        sand.volume_gain = select(at_tip, select(opens, volumetric, trial.volume_gain), S(0));
        const auto flows = opens | (on_cone & slips & detail::differ(sand.F, trial.F));
        sand.plastic_strain = trial.plastic_strain + select(flows, select(at_tip, opening, slip), S(0));
        return {sand, elastic().stress_of_strain(elastic_strain + change)};
    }
    /// The state after the plastic return mapping.
    template <int D>
    FIRN_INLINE state<D> returned(const state<D>& trial) const {
        return returned_with_stress(trial).state;
    }

private:
    /// Checks the friction angle φ(q) = h₀ + (h₁ q − h₃) e^{−h₂ q} [rad] for all plastic strains q ≥ 0. φ starts at h₀
    /// − h₃ and ends at h₀. In between, φ has a maximum at q = 1/h₂ + h₃/h₁ if this q is positive.
    /// \throws parameter_error unless 0° ≤ φ < 90° for every plastic strain q
    static void check_angles(double h0, double h1, double h2, double h3) {
        check_friction_angle(radians(h0));
        check_friction_angle(radians(h0 - h3));
        if (h1 > 0 && h1 + h2 * h3 > 0) check_friction_angle(radians(h0 + h1 / h2 * std::exp(-1 - h2 * h3 / h1)));
    }
};

}  // namespace firn::inline FIRN_BUILD
