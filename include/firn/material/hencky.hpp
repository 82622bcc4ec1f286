/// \file Hencky elasticity: an energy that is quadratic in the logarithmic strain.
#pragma once

#include <firn/material/concept.hpp>
#include <firn/material/lame.hpp>
#include <firn/math/exp_log.hpp>
#include <firn/math/matrix_functions.hpp>
#include <firn/math/stretch_bound.hpp>

namespace firn::inline FIRN_BUILD {

/// An elastic solid whose stress is linear in the logarithmic strain.
///
///     ψ = μ Σ εᵢ² + λ/2 (Σ εᵢ)²      [J/m³ of undeformed volume]
///     τᵢ = 2μ εᵢ + λ Σ ε              [Pa], along the principal directions
///
/// ψ is the elastic energy, τᵢ are the principal Kirchhoff stresses, μ and λ the Lamé parameters. εᵢ = ln σᵢ are the
/// principal strains, where σᵢ are the principal stretches of F. In 2D there are two stretches; this is plane strain.
///
/// Sand and VonMises use this elasticity, because their return mappings are exact in logarithmic strain. Use Hencky
/// alone for comparison with these two; FixedCorotated costs less.
///
/// Xu, Sin, Zhu and Barbič 2015, "Nonlinear material design using principal stretches"; Klár et al. 2016,
/// "Drucker-Prager elastoplasticity for sand animation", §6.
template <scalar S = float>
struct Hencky {
    S mu = S(5e4 / 1.3);              ///< shear modulus [Pa]
    S lambda = S(3e4 / (1.3 * 0.4));  ///< first Lamé parameter [Pa]

    static constexpr const char* name = "hencky";
    static constexpr auto parameters() {
        return std::tuple{parameter{"mu", "Pa", &Hencky::mu}, parameter{"lambda", "Pa", &Hencky::lambda}};
    }

    /// Makes the solid with Young's modulus E = `young` [Pa] and Poisson's ratio ν = `poisson` [1].
    /// \throws parameter_error unless E > 0 and −1 < ν < ½
    static Hencky from_young_poisson(double young, double poisson) {
        const Lame lame = lame_in<value_type_t<S>>(young, poisson);
        return {S(lame.mu), S(lame.lambda)};
    }

    /// Checks the parameters.
    /// \throws parameter_error unless μ ≥ 0, λ + 2 μ/3 > 0, and μ and λ are finite
    void check() const
        requires std::floating_point<S>
    {
        check_lame(double(mu), double(lambda));
    }

    /// Kirchhoff stress τ [Pa], for the deformation gradient F.
    template <deformation_gradient_of<S> G>
    FIRN_INLINE matrix_of_t<G> kirchhoff_stress(const G& F) const {
        return stress_of_strain(logarithmic_strain(F));
    }
    /// Kirchhoff stress τ [Pa], for a logarithmic strain instead of F.
    template <int D>
    FIRN_INLINE Mat<S, D> stress_of_strain(const Mat<S, D>& strain) const {
        return strain * (mu + mu) + Mat<S, D>::diagonal(lambda * trace(strain));
    }
    /// Elastic energy ψ [J/m³ of undeformed volume], for the deformation gradient F.
    template <deformation_gradient_of<S> G>
    FIRN_INLINE S energy_density(const G& F) const {
        const matrix_of_t<G> strain = logarithmic_strain(F);
        const S volumetric = trace(strain);
        return mu * squared_norm(strain) + S(0.5) * lambda * volumetric * volumetric;
    }

    /// Upper bound c of the wave speed [m/s], for the density ρ0 of the undeformed material [kg/m³]:
    ///
    ///     ρ0 c² = λ + 2μ (1 + Δ) − min(0, τ_min),       Δ = ε_max − ε_min
    ///
    /// ε_max and ε_min are the largest and the smallest principal strain, τ_min is the smallest principal stress. For a
    /// pressure wave along principal axis i, ρ0 c² is λ + 2μ − τᵢ. For a shear wave along this axis, ρ0 c² is at most μ
    /// 2Δ / (1 − e^{−2Δ}) ≤ μ (1 + 2Δ). In place of ε_max and ε_min, the code uses the bounds ε_max ≤ ½ ln
    /// squared_stretch_bound(F) and ε_min ≥ ln J − (D − 1) ε_max, where J = det F and D is the number of dimensions.
    /// Both bounds are exact for F = I.
    template <deformation_gradient_of<S> G>
    FIRN_INLINE S wave_speed(const S& density, const G& F) const {
        const S volumetric = log(max(determinant(F), S(detail::least_volume_ratio)));
        const S highest = S(0.5) * log(max(squared_stretch_bound(F), S(detail::least_square_of_stretch)));
        const S lowest = volumetric - S(dimension_of<G> - 1) * highest;
        const S spread = max(highest - lowest, S(0));
        const S compression = max(-((mu + mu) * lowest + lambda * volumetric), S(0));
        return sqrt((lambda + (mu + mu) * (S(1) + spread) + compression) / density);
    }
};

}  // namespace firn::inline FIRN_BUILD
