/// \file Hencky elasticity: quadratic in the logarithms of the principal stretches. Xu, Sin, Zhu and Barbič 2015,
/// "Nonlinear material design using principal stretches"; Klár et al. 2016, §6; the elasticity of the plastic models
/// whose return mapping is exact in these logarithms.
#pragma once

#include <firn/material/concept.hpp>
#include <firn/material/lame.hpp>
#include <firn/math/exp_log.hpp>
#include <firn/math/stretch_bound.hpp>
#include <firn/math/svd.hpp>

namespace firn {

/// Logarithmic strain εᵢ = ln σᵢ and the directions of the principal stretches.
template <class S, int D>
struct HenckyStrain {
    Mat<S, D> directions;  ///< U, a rotation; its columns
    Vec<S, D> strain;      ///< ε [1], falling
};
/// Stretches below 1e-6, negative ones included, count as 1e-6: matter that is inverted resists as if it were crushed.
template <scalar S, int D>
FIRN_INLINE HenckyStrain<S, D> hencky_strain(const Mat<S, D>& F) {
    const Principal<S, D> p = principal_stretches(F);
    HenckyStrain<S, D> hencky;
    hencky.directions = p.directions;
    unroll<D>([&](auto i) FIRN_LAMBDA { hencky.strain.v[i] = log(max(p.stretches.v[i], S(1e-6))); });
    return hencky;
}

/// Σ aᵢ
template <class S, int D>
FIRN_INLINE S sum_of(const Vec<S, D>& a) {
    S sum = a.v[0];
    unroll<D - 1>([&](auto i) FIRN_LAMBDA { sum = sum + a.v[i + 1]; });
    return sum;
}

/// F after a return mapping from strain ε to ε′ along the same directions: U diag(exp(ε′ − ε)) Uᵀ F.
template <scalar S, int D>
FIRN_INLINE Mat<S, D> returned_to(const Mat<S, D>& F, const HenckyStrain<S, D>& from, const Vec<S, D>& to) {
    Vec<S, D> ratio;
    unroll<D>([&](auto i) FIRN_LAMBDA { ratio.v[i] = exp(to.v[i] - from.strain.v[i]); });
    return spectral(from.directions, ratio) * F;
}

/// ψ = μ Σ εᵢ² + λ/2 (Σ εᵢ)² [J/m³], τᵢ = 2 μ εᵢ + λ Σ ε along the principal directions. In 2D the same with two
/// stretches: plane strain.
template <scalar S = float>
struct Hencky {
    S mu = S(5e4 / 1.3);              ///< shear modulus [Pa]
    S lambda = S(3e4 / (1.3 * 0.4));  ///< first Lamé parameter [Pa]

    static constexpr const char* name = "hencky";
    static constexpr auto parameters() {
        return std::tuple{parameter{"mu", "Pa", &Hencky::mu}, parameter{"lambda", "Pa", &Hencky::lambda}};
    }

    /// \throws parameter_error unless E > 0 [Pa] and −1 < ν < ½
    static Hencky from_young_poisson(double young, double poisson) {
        const Lame lame = lame_in<value_type_t<S>>(young, poisson);
        return {S(lame.mu), S(lame.lambda)};
    }

    /// \throws parameter_error unless the moduli are those of a stable solid
    void check() const
        requires std::floating_point<S>
    {
        check_lame(double(mu), double(lambda));
    }

    /// τ [Pa]
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const Mat<S, D>& F) const {
        return stress_of_strain(hencky_strain(F));
    }
    template <int D>
    FIRN_INLINE Mat<S, D> stress_of_strain(const HenckyStrain<S, D>& hencky) const {
        const S pressure = lambda * sum_of(hencky.strain);
        return spectral(hencky.directions, hencky.strain * (mu + mu) + Vec<S, D>::filled(pressure));
    }
    /// ψ [J/m³ of undeformed volume]
    template <int D>
    FIRN_INLINE S energy_density(const Mat<S, D>& F) const {
        const Vec<S, D> strain = hencky_strain(F).strain;
        const S volumetric = sum_of(strain);
        return mu * dot(strain, strain) + S(0.5) * lambda * volumetric * volumetric;
    }

    /// ρ0 c² ≤ λ + 2μ (1 + Δ) − min(0, τ_min), Δ = ε_max − ε_min: along a principal axis the pressure wave has
    /// λ + 2μ − τᵢ, the shear wave μ 2Δ / (1 − e^{−2Δ}) ≤ μ (1 + 2Δ). The largest strain is bounded by FFᵀ, the
    /// smallest then by ln J; both bounds are exact at rest.  [m/s]
    template <int D>
    FIRN_INLINE S wave_speed(const S& density, const Mat<S, D>& F) const {
        const S volumetric = log(max(determinant(F), S(1e-18)));
        const S highest = S(0.5) * log(max(squared_stretch_bound(F), S(1e-12)));
        const S lowest = volumetric - S(D - 1) * highest;
        const S spread = max(highest - lowest, S(0));
        const S compression = max(-((mu + mu) * lowest + lambda * volumetric), S(0));
        return sqrt((lambda + (mu + mu) * (S(1) + spread) + compression) / density);
    }
};

}  // namespace firn
