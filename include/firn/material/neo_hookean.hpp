/// \file Compressible neo-Hookean elasticity: rubber.
#pragma once

#include <firn/material/concept.hpp>
#include <firn/material/lame.hpp>
#include <firn/math/exp_log.hpp>
#include <firn/math/stretch_bound.hpp>

namespace firn::inline FIRN_BUILD {

/// An elastic solid for large strains: rubber.
///
///     ψ = μ/2 (tr FFᵀ − D) − μ ln J + λ/2 ln² J     [J/m³ of undeformed volume]
///     τ = μ (FFᵀ − I) + λ ln J I                     [Pa]
///
/// ψ is the elastic energy, τ the Kirchhoff stress, μ and λ are the Lamé parameters, and J = det F. In 2D the formulas
/// hold for 2 × 2 matrices; this is plane strain.
///
/// Use NeoHookean for comparison with finite elements and with closed-form solutions, and where the stress must grow
/// without bound as the volume goes to zero. J must stay positive: otherwise stress and wave speed are NaN, and the
/// step throws a particle_error. FixedCorotated has no such limit.
///
/// Bonet and Wood 2008, "Nonlinear Continuum Mechanics for Finite Element Analysis", §6.4.3.
template <scalar S = float>
struct NeoHookean {
    S mu = S(5e4 / 1.3);              ///< shear modulus [Pa]
    S lambda = S(3e4 / (1.3 * 0.4));  ///< first Lamé parameter [Pa]

    static constexpr const char* name = "neo_hookean";
    static constexpr auto parameters() {
        return std::tuple{parameter{"mu", "Pa", &NeoHookean::mu}, parameter{"lambda", "Pa", &NeoHookean::lambda}};
    }

    /// Makes the solid with Young's modulus E = `young` [Pa] and Poisson's ratio ν = `poisson` [1].
    /// \throws parameter_error unless E > 0 and −1 < ν < ½
    static NeoHookean from_young_poisson(double young, double poisson) {
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

    /// Kirchhoff stress τ = μ (FFᵀ − I) + λ ln J I [Pa], with J = det F.
    template <deformation_gradient_of<S> G>
    FIRN_INLINE matrix_of_t<G> kirchhoff_stress(const G& F) const {
        return left_cauchy_green_change(F) * mu + matrix_of_t<G>::diagonal(lambda * log_J(F));
    }

    /// Elastic energy ψ = μ/2 (tr FFᵀ − D) − μ ln J + λ/2 ln² J [J/m³ of undeformed volume], with J = det F.
    template <deformation_gradient_of<S> G>
    FIRN_INLINE S energy_density(const G& F) const {
        const S volumetric = log_J(F);
        return S(0.5) * mu * trace(left_cauchy_green_change(F)) - mu * volumetric +
               S(0.5) * lambda * volumetric * volumetric;
    }

    /// Upper bound c of the wave speed [m/s], for the density ρ0 of the undeformed material [kg/m³]:
    ///
    ///     ρ0 c² = μ (σ_max² + 1) + λ (1 − ln J)
    ///
    /// J = det F, and σ_max is the largest principal stretch; the code uses squared_stretch_bound(F), which is at least
    /// σ_max², in place of σ_max². The bound follows from the acoustic tensor. For the unit direction n, this tensor is
    /// μ (n·FFᵀn) I + (μ + λ (1 − ln J)) n ⊗ n. Where the factor of n ⊗ n is negative, the bound is that of the shear
    /// wave, ρ0 c² = μ σ_max².
    template <deformation_gradient_of<S> G>
    FIRN_INLINE S wave_speed(const S& density, const G& F) const {
        const S shear = mu * squared_stretch_bound(F);
        const S along = mu + lambda * (S(1) - log_J(F));
        return sqrt((shear + max(along, S(0))) / density);
    }

private:
    /// Returns ln J [1]. \param F  the deformation gradient
    template <class G>
    FIRN_INLINE static S log_J(const G& F) {
        const S change = volume_change(F);
        return log(S(1) + change, change);
    }
};

}  // namespace firn::inline FIRN_BUILD
