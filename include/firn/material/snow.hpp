/// \file Snow: an elastic solid that can be crushed and broken, and hardens as it is compacted.
#pragma once

#include <firn/material/fixed_corotated.hpp>
#include <firn/math/exp_log.hpp>
#include <firn/math/isotropic_function.hpp>

namespace firn::inline FIRN_BUILD {

/// Measurable properties of snow. Snow::from_properties() makes the material from these properties. The defaults are
/// those of Stomakhin et al. 2013, table 2, for a density of 400 kg/m³.
struct SnowProperties {
    double young = 1.4e5;                  ///< Young's modulus before hardening [Pa]
    double poisson = 0.2;                  ///< Poisson's ratio [1]
    double critical_compression = 2.5e-2;  ///< θc: compression at which snow begins to be crushed [1]
    double critical_stretch = 7.5e-3;      ///< θs: stretch at which snow begins to break [1]
    double hardening = 10;                 ///< ξ: how fast snow stiffens as it is compacted [1]
};

/// Snow: an elastic solid that can be crushed and broken, and hardens as it is compacted.
///
/// The elasticity is that of FixedCorotated. The Lamé parameters μ and λ depend on the plastic volume ratio J_P; before
/// hardening (J_P = 1) they are μ0 and λ0:
///
///     μ = μ0 e^{ξ (1 − J_P)}         λ = λ0 e^{ξ (1 − J_P)}       [Pa]
///
/// ξ is the parameter `hardening`.
///
/// The singular values of the elastic F are clamped to [1 − θc, 1 + θs], where θc and θs are the critical compression
/// and stretch; the rest of the deformation is plastic and changes J_P. In 2D there are two singular values; this is
/// plane strain.
///
/// The exponent ξ (1 − J_P) is at most `largest_exponent`. At the default value, 4, snow is 55 times as stiff as before
/// hardening. The paper sets no such bound. Without the bound, moduli and wave speed can grow without limit, and the
/// time step becomes very small.
///
/// Use Snow for dry and wet snow: smaller θc and θs make the snow more powdery, larger values make it more chunky, a
/// larger ξ makes it more brittle.
///
/// Stomakhin et al. 2013, "A material point method for snow simulation", §5.
template <scalar S = float>
struct Snow {
    S mu = S(1.4e5 / 2.4);              ///< shear modulus before hardening, μ0 [Pa]
    S lambda = S(2.8e4 / (1.2 * 0.6));  ///< first Lamé parameter before hardening, λ0 [Pa]
    S lowest_stretch = S(1 - 2.5e-2);   ///< smallest elastic stretch, 1 − θc; θc: critical compression [1]
    S highest_stretch = S(1 + 7.5e-3);  ///< largest elastic stretch, 1 + θs; θs: critical stretch [1]
    S hardening = S(10);                ///< ξ: how fast snow stiffens as it is compacted [1]
    S largest_exponent = S(4);          ///< upper bound of the exponent ξ (1 − J_P) in μ and λ [1]

    static constexpr const char* name = "snow";
    static constexpr auto parameters() {
        return std::tuple{parameter{"mu", "Pa", &Snow::mu},
                          parameter{"lambda", "Pa", &Snow::lambda},
                          parameter{"lowest_stretch", "1", &Snow::lowest_stretch},
                          parameter{"highest_stretch", "1", &Snow::highest_stretch},
                          parameter{"hardening", "1", &Snow::hardening},
                          parameter{"largest_exponent", "1", &Snow::largest_exponent}};
    }

    /// The state of a particle.
    template <int D>
    struct state {
        DeformationGradient<S, D> F;  ///< elastic deformation gradient [1]
        S plastic_volume = S(1);      ///< plastic volume ratio J_P = det F_P [1]

        static constexpr auto fields() {
            return std::tuple{parameter{"deformation_gradient", "1", &state::F},
                              parameter{"plastic_volume", "1", &state::plastic_volume}};
        }
    };

    /// Makes the material from measurable properties.
    /// \throws parameter_error unless young > 0, −1 < poisson < ½, 0 < critical_compression < 1, critical_stretch > 0
    /// and hardening ≥ 0
    static Snow from_properties(const SnowProperties& snow) {
        const auto elastic = FixedCorotated<S>::from_young_poisson(snow.young, snow.poisson);
        if (!(snow.critical_compression > 0 && snow.critical_compression < 1) || !(snow.critical_stretch > 0) ||
            !std::isfinite(snow.critical_stretch))
            throw parameter_error(sentence("The critical compression of snow is ", snow.critical_compression,
                                           " and its critical stretch ", snow.critical_stretch,
                                           "; the first must lie between 0 and 1, both excluded, the second must be "
                                           "positive and finite. Snow of the paper has 0.025 and 0.0075."));
        if (!(snow.hardening >= 0) || !std::isfinite(snow.hardening))
            throw parameter_error(sentence("The hardening coefficient of snow is ", snow.hardening,
                                           "; it must be finite and not negative. Snow of the paper has 10."));
        Snow model;
        model.mu = elastic.mu;
        model.lambda = elastic.lambda;
        model.lowest_stretch = S(1 - snow.critical_compression);
        model.highest_stretch = S(1 + snow.critical_stretch);
        model.hardening = S(snow.hardening);
        return model;
    }
    /// Checks the parameters.
    /// \throws parameter_error unless μ0 ≥ 0, λ0 + 2 μ0/3 > 0, 0 < lowest_stretch ≤ 1 ≤ highest_stretch, and
    /// `hardening` and `largest_exponent` are finite and not negative
    void check() const
        requires std::floating_point<S>
    {
        check_lame(double(mu), double(lambda));
        if (!(lowest_stretch > 0 && lowest_stretch <= 1 && highest_stretch >= 1) || !std::isfinite(highest_stretch))
            throw parameter_error(sentence("The stretches of snow lie between ", lowest_stretch, " and ",
                                           highest_stretch,
                                           "; the first must be above 0 and at most 1, the second at least 1 and "
                                           "finite."));
        if (!(hardening >= 0 && largest_exponent >= 0) || !std::isfinite(hardening * largest_exponent))
            throw parameter_error(sentence("The hardening coefficient of snow is ", hardening,
                                           " and its largest exponent ", largest_exponent,
                                           "; both must be finite and not negative."));
    }

    /// Returns the elastic solid with the Lamé parameters μ and λ that the snow has at this plastic volume ratio J_P.
    FIRN_INLINE FixedCorotated<S> hardened(const S& plastic_volume) const {
        const S exponent = hardening * (S(1) - plastic_volume);
        const S factor = named("hardened", exp(min(exponent, largest_exponent)));
        return {mu * factor, lambda * factor};
    }

    /// Kirchhoff stress τ [Pa]: the stress of FixedCorotated with the Lamé parameters after hardening.
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>& snow) const {
        return hardened(snow.plastic_volume).kirchhoff_stress(snow.F);
    }
    /// Elastic energy ψ [J/m³ of undeformed volume]: the energy of FixedCorotated with the Lamé parameters after
    /// hardening.
    template <int D>
    FIRN_INLINE S energy_density(const state<D>& snow) const {
        return hardened(snow.plastic_volume).energy_density(snow.F);
    }
    /// Upper bound of the wave speed [m/s]: the bound of FixedCorotated with the Lamé parameters after hardening.
    /// `density` is the density of the undeformed material [kg/m³].
    template <int D>
    FIRN_INLINE S wave_speed(const S& density, const state<D>& snow) const {
        return hardened(snow.plastic_volume).wave_speed(density, snow.F);
    }

    /// Returns the state after the plastic return mapping. The singular values σ of F are clamped to the range between
    /// lowest_stretch and highest_stretch. With the clamped values σ′, F and the plastic volume ratio J_P become
    ///
    ///     F ← U diag(σ′/σ) Uᵀ F         J_P ← J_P Π σ/σ′
    ///
    /// U is a rotation; its columns are the directions of the σ in space. If all σ lie within the bounds up to
    /// rounding, the state is kept bit for bit. An inverted F (det F < 0) becomes an F with det F > 0. J_P is clamped
    /// to [0, 2^20].
    template <int D>
    FIRN_INLINE state<D> returned(const state<D>& trial) const {
        const StretchRange<S> squared = squared_stretch_range(trial.F);
        const auto holds_low = lowest_stretch * lowest_stretch < squared.lowest,
                   holds_high = squared.highest < highest_stretch * highest_stretch,
                   upright = S(0) < determinant(trial.F);
        const auto elastic = holds_low & holds_high & upright;
        const auto doubtful = !elastic;
        state<D> snow = trial;
        if (any(doubtful)) {
            const Principal<S, D> p = principal_stretches(trial.F);
            mask_t<S> yields = S(1) < S(0);
            const S rounding = S(detail::strain_rounding<S>);
            const auto change = [this](const S& sigma) FIRN_LAMBDA {  // of the stretches, relative
                const S divisor = select(abs(sigma) < S(1e-3), S(1e-3), sigma);
                return (max(min(sigma, highest_stretch), lowest_stretch) - divisor) / divisor;
            };
            S volume = trial.plastic_volume;
            unroll<D>([&](auto i) FIRN_LAMBDA {
                const S sigma = p.stretches.v[i];
                const auto too_low = sigma < lowest_stretch - rounding, too_high = highest_stretch + rounding < sigma;
                yields = yields | too_low | too_high;
                volume = volume / (S(1) + change(sigma));
            });
            const Mat<S, D>& whole = trial.F;
            const auto F = select(yields, increased(trial.F, isotropic_function(whole, p, change) * whole), trial.F);
            volume = select(yields, max(min(volume, S(0x1p20)), S(0)), trial.plastic_volume);
            snow.F = select(doubtful, F, trial.F);
            snow.plastic_volume = select(doubtful, volume, trial.plastic_volume);
        }
        return snow;
    }
};

}  // namespace firn::inline FIRN_BUILD
