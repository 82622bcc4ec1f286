/// \file A material written with Eigen for any of firn's scalars. It runs in SIMD lanes, in double, with dual numbers,
/// and as WGSL.
#pragma once

#include <firn/core/eigen.hpp>
#include <firn/material/concept.hpp>
#include <firn/math/elementary.hpp>

#include <Eigen/LU>

#include <cmath>

/// Compressible neo-Hookean: τ = μ (FFᵀ − I) + λ ln J I (Bonet and Wood 2008, §6.4.3).
template <firn::scalar S = float>
struct EigenNeoHookean {
    S mu = S(2e4);      ///< shear modulus [Pa]
    S lambda = S(3e4);  ///< first Lamé parameter [Pa]

    static constexpr const char* name = "eigen_neo_hookean";
    static constexpr auto parameters() {
        return std::tuple{firn::parameter{"mu", "Pa", &EigenNeoHookean::mu},
                          firn::parameter{"lambda", "Pa", &EigenNeoHookean::lambda}};
    }

    template <int D>
    Eigen::Matrix<S, D, D> kirchhoff_stress(const Eigen::Matrix<S, D, D>& F) const {
        const auto I = Eigen::Matrix<S, D, D>::Identity();
        return mu * (F * F.transpose() - I) + lambda * firn::log(F.determinant()) * I;
    }

    /// ρ0 c² ≤ μ σ_max² + μ + λ (1 − ln J): the acoustic tensor is μ (n·FFᵀn) I + (μ + λ (1 − ln J)) n nᵀ.  [m/s]
    template <int D>
    S wave_speed(const S& density, const Eigen::Matrix<S, D, D>& F) const {
        const S along = mu + lambda * (S(1) - firn::log(F.determinant()));
        using std::sqrt;
        return sqrt((mu * F.squaredNorm() + firn::max(along, S(0))) / density);
    }
};
