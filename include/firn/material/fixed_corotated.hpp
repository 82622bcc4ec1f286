/// \file Fixed corotated elasticity: jelly and other soft solids.
#pragma once

#include <firn/material/concept.hpp>
#include <firn/material/lame.hpp>
#include <firn/math/left_stretch.hpp>
#include <firn/math/stretch_bound.hpp>

namespace firn::inline FIRN_BUILD {

/// An elastic solid that returns to its shape: jelly, rubber, soft tissue.
///
///     ψ = μ ‖F − R‖² + λ/2 (J − 1)²                [J/m³ of undeformed volume]
///     τ = 2μ (F − R) Fᵀ + λ (J − 1) J I             [Pa]
///
/// ψ is the elastic energy, τ the Kirchhoff stress, μ and λ are the Lamé parameters, and J = det F. F = V R is the
/// polar decomposition, where R is the rotation nearest to F. The code computes only V = √(FFᵀ), not R. In 2D the
/// formulas hold for 2 × 2 matrices; this is plane strain.
///
/// FixedCorotated is the usual choice for elastic bodies: energy and stress are finite for every F, so matter that is
/// crushed flat or turned inside out recovers. Use NeoHookean where the stress must grow without bound as the volume
/// goes to zero.
///
/// Stomakhin et al. 2012, "Energetically consistent invertible elasticity", §3; Jiang et al. 2016, "The Material Point
/// Method for Simulating Continuum Materials", §6.3.
template <scalar S = float>
struct FixedCorotated {
    S mu = S(5e4 / 1.3);              ///< shear modulus [Pa]
    S lambda = S(3e4 / (1.3 * 0.4));  ///< first Lamé parameter [Pa]

    static constexpr const char* name = "fixed_corotated";
    static constexpr auto parameters() {
        return std::tuple{parameter{"mu", "Pa", &FixedCorotated::mu},
                          parameter{"lambda", "Pa", &FixedCorotated::lambda}};
    }

    /// Makes the solid with Young's modulus E = `young` [Pa] and Poisson's ratio ν = `poisson` [1].
    /// \throws parameter_error unless E > 0 and −1 < ν < ½
    static FixedCorotated from_young_poisson(double young, double poisson) {
        const Lame lame = lame_from_young_poisson(young, poisson);
        return from_lame(lame.mu, lame.lambda);
    }
    /// Makes the solid with the Lamé parameters μ and λ [Pa].
    /// \throws parameter_error unless μ ≥ 0, λ + 2 μ/3 > 0, and μ and λ are finite
    static FixedCorotated from_lame(double mu, double lambda) {
        using T = value_type_t<S>;
        check_lame(double(T(mu)), double(T(lambda)));  // the values rounded to T: a float overflows at 3e38
        return {S(mu), S(lambda)};
    }

    /// Checks the parameters.
    /// \throws parameter_error unless μ ≥ 0, λ + 2 μ/3 > 0, and μ and λ are finite
    void check() const
        requires std::floating_point<S>
    {
        check_lame(double(mu), double(lambda));
    }

    /// Kirchhoff stress τ = 2μ (F − R) Fᵀ + λ (J − 1) J I = 2μ (FFᵀ − V) + λ (J − 1) J I [Pa]. J = det F, and F = V R
    /// is the polar decomposition.
    template <deformation_gradient_of<S> G>
    FIRN_INLINE matrix_of_t<G> kirchhoff_stress(const G& F) const {
        const S change = named("volume_change", volume_change(F));
        return (left_cauchy_green_change(F) - left_stretch_change(F)) * (mu + mu) +
               matrix_of_t<G>::diagonal(lambda * change * (S(1) + change));
    }

    /// Elastic energy ψ = μ (tr FFᵀ − 2 tr V + D) + λ/2 (J − 1)² [J/m³ of undeformed volume]. J = det F and V = √(FFᵀ);
    /// D is the number of dimensions.
    template <deformation_gradient_of<S> G>
    FIRN_INLINE S energy_density(const G& F) const {
        const S change = volume_change(F);
        return mu * (trace(left_cauchy_green_change(F)) - S(2) * trace(left_stretch_change(F))) +
               S(0.5) * lambda * change * change;
    }

    /// Upper bound c of the wave speed [m/s], for the density ρ0 of the undeformed material [kg/m³]:
    ///
    ///     ρ0 c² = 2μ σ_max² + λ J²
    ///
    /// J = det F, and σ_max is the largest principal stretch. The right-hand side is an upper bound of the eigenvalues
    /// of the acoustic tensor, (Fᵀn)_j (Fᵀn)_l ∂²ψ/∂F_ij∂F_kl, for every unit direction n. The rotation R in the stress
    /// depends on F, too; the term of the tensor that comes from R is negative and is left out. For F = I the bound is
    /// exact: ρ0 c² = λ + 2μ. The code uses squared_stretch_bound(F), which is at least σ_max², in place of σ_max².
    template <deformation_gradient_of<S> G>
    FIRN_INLINE S wave_speed(const S& density, const G& F) const {
        const S J = named("J", S(1) + volume_change(F));
        return sqrt(((mu + mu) * squared_stretch_bound(F) + lambda * J * J) / density);
    }
};

}  // namespace firn::inline FIRN_BUILD
