/// \file Fixed corotated elasticity. Stomakhin et al. 2012, "Energetically consistent invertible elasticity", §3;
/// Jiang et al. 2016, §6.3.
#pragma once

#include <firn/material/concept.hpp>
#include <firn/material/lame.hpp>
#include <firn/math/left_stretch.hpp>
#include <firn/math/stretch_bound.hpp>

namespace firn {

/// ψ = μ ‖F − R‖² + λ/2 (J − 1)² [J/m³], with F = V R: in terms of V = √(FFᵀ), no rotation is needed.
/// In 2D the same lines with 2 × 2 matrices: plane strain.
template <scalar S = float>
struct FixedCorotated {
    S mu = S(5e4 / 1.3);              ///< shear modulus [Pa]
    S lambda = S(3e4 / (1.3 * 0.4));  ///< first Lamé parameter [Pa]

    static constexpr const char* name = "fixed_corotated";
    static constexpr auto parameters() {
        return std::tuple{parameter{"mu", "Pa", &FixedCorotated::mu},
                          parameter{"lambda", "Pa", &FixedCorotated::lambda}};
    }

    /// \throws parameter_error unless E > 0 [Pa] and −1 < ν < ½
    static FixedCorotated from_young_poisson(double young, double poisson) {
        const Lame lame = lame_from_young_poisson(young, poisson);
        return from_lame(lame.mu, lame.lambda);
    }
    /// \throws parameter_error unless the moduli are those of a stable solid [Pa]
    static FixedCorotated from_lame(double mu, double lambda) {
        using T = value_type_t<S>;
        check_lame(double(T(mu)), double(T(lambda)));  // as they will be used: a float overflows at 3e38
        return {S(mu), S(lambda)};
    }

    /// \throws parameter_error unless the moduli are those of a stable solid
    void check() const
        requires std::floating_point<S>
    {
        check_lame(double(mu), double(lambda));
    }

    /// τ = 2μ (F − R) Fᵀ + λ (J − 1) J I = 2μ (FFᵀ − V) + λ (J − 1) J I  [Pa]
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const Mat<S, D>& F) const {
        const S J = named("J", determinant(F));
        return (F * transpose(F) - left_stretch(F)) * (mu + mu) + Mat<S, D>::diagonal(lambda * (J - S(1)) * J);
    }

    /// ψ = μ (tr FFᵀ − 2 tr V + D) + λ/2 (J − 1)²  [J/m³ of undeformed volume]
    template <int D>
    FIRN_INLINE S energy_density(const Mat<S, D>& F) const {
        const S change = determinant(F) - S(1);
        return mu * (squared_norm(F) - S(2) * trace(left_stretch(F)) + S(D)) + S(0.5) * lambda * change * change;
    }

    /// ρ0 c² ≤ 2μ σ_max² + λ J²: the acoustic tensor F F : ∂²ψ/∂F² for n ⊗ n, whose rotation part only lowers it;
    /// equal to λ + 2μ at rest.  [m/s]
    template <int D>
    FIRN_INLINE S wave_speed(const S& density, const Mat<S, D>& F) const {
        const S J = named("J", determinant(F));
        return sqrt(((mu + mu) * squared_stretch_bound(F) + lambda * J * J) / density);
    }
};

}  // namespace firn
