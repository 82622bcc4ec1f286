/// \file Compressible neo-Hookean elasticity: rubber.
#pragma once

#include <firn/material/concept.hpp>
#include <firn/material/lame.hpp>
#include <firn/math/exp_log.hpp>
#include <firn/math/stretch_bound.hpp>

namespace firn {

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
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const Mat<S, D>& F) const {
        const S pressure = lambda * log(determinant(F)) - mu;
        return F * transpose(F) * mu + Mat<S, D>::diagonal(pressure);
    }

    /// Elastic energy ψ = μ/2 (tr FFᵀ − D) − μ ln J + λ/2 ln² J [J/m³ of undeformed volume], with J = det F.
    template <int D>
    FIRN_INLINE S energy_density(const Mat<S, D>& F) const {
        const S log_J = log(determinant(F));
        return S(0.5) * mu * (squared_norm(F) - S(D)) - mu * log_J + S(0.5) * lambda * log_J * log_J;
    }

    /// Upper bound c of the wave speed [m/s], for the density ρ0 of the undeformed material [kg/m³]:
    ///
    ///     ρ0 c² = μ (σ_max² + 1) + λ (1 − ln J)
    ///
    /// J = det F, and σ_max is the largest principal stretch; the code uses squared_stretch_bound(F), which is at least
    /// σ_max², in place of σ_max². The bound follows from the acoustic tensor. For the unit direction n, this tensor is
    /// μ (n·FFᵀn) I + (μ + λ (1 − ln J)) n ⊗ n. Where the factor of n ⊗ n is negative, the bound is that of the shear
    /// wave, ρ0 c² = μ σ_max².
    template <int D>
    FIRN_INLINE S wave_speed(const S& density, const Mat<S, D>& F) const {
        const S shear = mu * squared_stretch_bound(F);
        const S along = mu + lambda * (S(1) - log(determinant(F)));
        return sqrt((shear + max(along, S(0))) / density);
    }
};

}  // namespace firn
