/// \file A material of a user's own, in one small file. It runs in 2D and 3D, in float and double, in SIMD lanes and
/// with dual numbers, without another line.
#pragma once

#include <firn/material/concept.hpp>
#include <firn/math/elementary.hpp>
#include <firn/math/stretch_bound.hpp>

/// Compressible neo-Hookean solid: ψ = μ/2 (tr FFᵀ − D) − μ ln J + λ/2 ln² J, τ = μ (FFᵀ − I) + λ ln J I.
/// Bonet and Wood 2008, "Nonlinear Continuum Mechanics for Finite Element Analysis", eq. (6.29).
template <firn::scalar S = float>
struct NeoHookean {
    S mu = S(4e5);      ///< shear modulus [Pa]
    S lambda = S(6e5);  ///< first Lamé parameter [Pa]

    static constexpr const char* name = "neo_hookean";
    static constexpr auto parameters() {
        return std::tuple{firn::parameter{"mu", "Pa", &NeoHookean::mu},
                          firn::parameter{"lambda", "Pa", &NeoHookean::lambda}};
    }

    /// τ [Pa]
    template <int D>
    firn::Mat<S, D> kirchhoff_stress(const firn::Mat<S, D>& F) const {
        const S pressure = lambda * firn::log(determinant(F)) - mu;
        return F * transpose(F) * mu + firn::Mat<S, D>::diagonal(pressure);
    }

    /// ρ0 c² ≤ μ (σ_max² + 1) + λ (1 − ln J): the acoustic tensor's largest eigenvalue.  [m/s]
    template <int D>
    S wave_speed(const S& density, const firn::Mat<S, D>& F) const {
        const S stiffness = mu * (firn::squared_stretch_bound(F) + S(1)) + lambda * (S(1) - firn::log(determinant(F)));
        return sqrt(firn::max(stiffness, mu) / density);
    }
};
