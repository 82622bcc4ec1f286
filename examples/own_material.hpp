/// \file A user-defined material in one small file. It runs in 2D and 3D, in float and double, in SIMD lanes and with
/// dual numbers, without further code.
#pragma once

#include <firn/material/concept.hpp>
#include <firn/math/elementary.hpp>
#include <firn/math/stretch_bound.hpp>

/// Soft tissue, which stiffens exponentially as it is strained: ψ = μ/(2k) (exp(k Q) − 1) + λ/2 (J − 1)² with
/// Q = tr FFᵀ − D − 2 ln J ≥ 0. After Demiray 1972, "A note on the elasticity of soft biological tissues".
template <firn::scalar S = float>
struct SoftTissue {
    S mu = S(4e5);          ///< shear modulus at rest [Pa]
    S lambda = S(6e5);      ///< first Lamé parameter at rest [Pa]
    S stiffening = S(0.5);  ///< k [1]

    static constexpr const char* name = "soft_tissue";
    static constexpr auto parameters() {
        return std::tuple{firn::parameter{"mu", "Pa", &SoftTissue::mu},
                          firn::parameter{"lambda", "Pa", &SoftTissue::lambda},
                          firn::parameter{"stiffening", "1", &SoftTissue::stiffening}};
    }

    /// τ = μ exp(k Q) (FFᵀ − I) + λ (J − 1) J I  [Pa]
    template <int D>
    firn::Mat<S, D> kirchhoff_stress(const firn::Mat<S, D>& F) const {
        using Matrix = firn::Mat<S, D>;
        const S J = determinant(F);
        return (F * transpose(F) - Matrix::identity()) * stiffened(F, J) + Matrix::diagonal(lambda * (J - S(1)) * J);
    }

    /// ψ  [J/m³ of undeformed volume]: without it, totals().elastic_energy is NaN, and all else works.
    template <int D>
    S energy_density(const firn::Mat<S, D>& F) const {
        const S J = determinant(F), change = J - S(1);
        return (stiffened(F, J) - mu) / (S(2) * stiffening) + S(0.5) * lambda * change * change;
    }

    /// ρ0 c² ≤ μ exp(k Q) (σ_max² + 1 + 2 k ‖FFᵀ − I‖²) + λ J²: the acoustic tensor's largest eigenvalue.  [m/s]
    template <int D>
    S wave_speed(const S& density, const firn::Mat<S, D>& F) const {
        const S J = determinant(F);
        const S strain = squared_norm(F * transpose(F) - firn::Mat<S, D>::identity());
        const S shape = firn::squared_stretch_bound(F) + S(1) + S(2) * stiffening * strain;
        return firn::sqrt((stiffened(F, J) * shape + lambda * J * J) / density);
    }

private:
    /// μ exp(k Q)
    template <int D>
    S stiffened(const firn::Mat<S, D>& F, const S& J) const {
        return mu * firn::exp(stiffening * (squared_norm(F) - S(D) - S(2) * firn::log(J)));
    }
};
