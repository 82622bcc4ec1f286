/// \file Metal and clay: von Mises plasticity with linear hardening.
#pragma once

#include <firn/material/hencky.hpp>

namespace firn::inline FIRN_BUILD {

/// Measurable properties of a plastic solid. VonMises::from_properties() makes the material from these properties. The
/// defaults are those of a soft clay.
struct VonMisesProperties {
    double young = 1e6;         ///< Young's modulus [Pa]
    double poisson = 0.4;       ///< Poisson's ratio [1]
    double yield_stress = 2e4;  ///< yield stress σ_Y in uniaxial tension [Pa]
    double hardening = 0;       ///< hardening modulus H = dσ_Y/dα [Pa]; α: equivalent plastic strain
};

/// A solid that flows under shear and keeps its volume: metal, clay, plasticine.
///
/// The elasticity is that of Hencky. There is plastic flow where
///
///     ‖dev τ‖ > √⅔ (σ_Y + H α)
///
/// τ is the Kirchhoff stress, σ_Y the `yield_stress`, H the `hardening`, and α the equivalent plastic strain. H > 0
/// hardens the solid as it flows, H = 0 is perfect plasticity. In 2D the deviator is taken in two dimensions, so there
/// is no plastic flow out of the plane. This agrees with plane strain if the elastic strain is much smaller than the
/// plastic strain.
///
/// Use VonMises where the strength does not depend on pressure. Where the strength depends on pressure, use Sand or
/// Nacc.
///
/// The radial return is exact in logarithmic strain: Simo and Hughes 1998, "Computational Inelasticity", §3.3 and §9.2.
template <scalar S = float>
struct VonMises {
    S mu = S(1e6 / 2.8);              ///< shear modulus [Pa]
    S lambda = S(4e5 / (1.4 * 0.2));  ///< first Lamé parameter [Pa]
    S yield_stress = S(2e4);          ///< yield stress σ_Y in uniaxial tension [Pa]
    S hardening = S(0);               ///< hardening modulus H [Pa]

    static constexpr const char* name = "von_mises";
    static constexpr auto parameters() {
        return std::tuple{parameter{"mu", "Pa", &VonMises::mu}, parameter{"lambda", "Pa", &VonMises::lambda},
                          parameter{"yield_stress", "Pa", &VonMises::yield_stress},
                          parameter{"hardening", "Pa", &VonMises::hardening}};
    }

    /// The state of a particle.
    template <int D>
    struct state {
        DeformationGradient<S, D> F;  ///< elastic deformation gradient [1]
        S plastic_strain = S(0);      ///< equivalent plastic strain α [1]

        static constexpr auto fields() {
            return std::tuple{parameter{"deformation_gradient", "1", &state::F},
                              parameter{"plastic_strain", "1", &state::plastic_strain}};
        }
    };

    /// Makes the material from measurable properties.
    /// \throws parameter_error unless young > 0, −1 < poisson < ½, yield_stress > 0 and hardening ≥ 0
    static VonMises from_properties(const VonMisesProperties& solid) {
        const Hencky<S> elastic = Hencky<S>::from_young_poisson(solid.young, solid.poisson);
        check_flow(solid.yield_stress, solid.hardening);
        return {elastic.mu, elastic.lambda, S(solid.yield_stress), S(solid.hardening)};
    }
    /// Checks the parameters.
    /// \throws parameter_error unless μ > 0, λ + 2 μ/3 > 0, yield_stress > 0 and hardening ≥ 0
    void check() const
        requires std::floating_point<S>
    {
        check_lame_of_plastic(double(mu), double(lambda));
        check_flow(double(yield_stress), double(hardening));
    }

    /// The elastic solid with the moduli of this plastic solid.
    FIRN_INLINE Hencky<S> elastic() const { return {mu, lambda}; }

    /// Kirchhoff stress τ [Pa], computed as in Hencky from the elastic F.
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& solid) const {
        return elastic().kirchhoff_stress(solid.F);
    }
    /// Elastic energy ψ [J/m³ of undeformed volume], computed as in Hencky from the elastic F.
    template <int D>
    FIRN_INLINE S energy_density(const state<D>& solid) const {
        return elastic().energy_density(solid.F);
    }
    /// Upper bound of the wave speed [m/s], computed as in Hencky from the elastic F. `density` is the density of the
    /// undeformed material [kg/m³].
    template <int D>
    FIRN_INLINE S wave_speed(const S& density, const state<D>& solid) const {
        return elastic().wave_speed(density, solid.F);
    }

    /// An upper bound of the stretch of a particle since it was made [1]: its elastic stretch times e^α. A plastic
    /// strain that keeps the volume stretches no direction by more than e^α.
    template <int D>
    FIRN_INLINE S stretch_bound(const state<D>& solid) const {
        return sqrt(squared_stretch_bound(solid.F)) * exp(solid.plastic_strain);
    }

    /// Returns the state after the plastic return mapping, and the Kirchhoff stress [Pa] in this state. Let ε be the
    /// logarithmic strain and α the plastic strain of the trial state, and f = 2μ ‖dev ε‖ − √⅔ (σ_Y + H α), where σ_Y
    /// is the `yield_stress` and H the `hardening`. Where f > 0, the strains ε′ and α′ of the new state are
    ///
    ///     dev ε′ = dev ε (1 − Δγ/‖dev ε‖)         α′ = α + √⅔ Δγ         Δγ = f / (2μ + ⅔ H)
    ///
    /// Plastic flow keeps the volume. Where f ≤ 0 up to rounding, the state is kept bit for bit. An inverted F (det F <
    /// 0) becomes upright; it has the strain that logarithmic_strain() gives it.
    template <int D>
    FIRN_INLINE StateAndStress<state<D>, S, D> returned_with_stress(const state<D>& trial) const {
        constexpr double root_two_thirds = 0.81649658092772603273;
        const Mat<S, D> strain = logarithmic_strain(trial.F);
        const Mat<S, D> deviator = strain - Mat<S, D>::diagonal(trace(strain) * S(1. / D));
        const S shear = named("shear", sqrt(squared_norm(deviator)));
        const S radius = S(root_two_thirds) * (yield_stress + hardening * trial.plastic_strain);
        const S excess = named("excess", (mu + mu) * shear - radius);
        const auto yields = (mu + mu) * S(detail::strain_rounding<S>) < excess;
        const S slip = select(yields, excess, S(0)) / (mu + mu + S(2. / 3) * hardening);

        const Mat<S, D> change = deviator * -(slip / select(yields, shear, S(1)));
        state<D> solid = trial;
        if (any(yields)) solid.F = select(yields, strained_by(trial.F, change), trial.F);
        solid.plastic_strain = trial.plastic_strain + S(root_two_thirds) * slip;
        return {solid, elastic().stress_of_strain(strain + change)};
    }
    /// The state after the plastic return mapping.
    template <int D>
    FIRN_INLINE state<D> returned(const state<D>& trial) const {
        return returned_with_stress(trial).state;
    }

private:
    static void check_flow(double yield, double harder) {
        if (!(yield > 0) || !std::isfinite(yield))
            throw parameter_error(sentence("The yield stress is ", yield,
                                           " Pa; it must be positive and finite. For a solid that never yields, take "
                                           "Hencky."));
        if (!(harder >= 0) || !std::isfinite(harder))
            throw parameter_error(
                sentence("The hardening modulus is ", harder, " Pa; it must be finite and not negative."));
    }
};

}  // namespace firn::inline FIRN_BUILD
