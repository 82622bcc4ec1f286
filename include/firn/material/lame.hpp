/// \file The Lamé parameters of an elastic solid, from Young's modulus and Poisson's ratio.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/scalar.hpp>

#include <cmath>

namespace firn::inline FIRN_BUILD {

/// The Lamé parameters of an isotropic elastic solid.
struct Lame {
    double mu;      ///< shear modulus [Pa]
    double lambda;  ///< first Lamé parameter [Pa]
};

/// Returns the Lamé parameters of a solid: μ = E / (2 (1 + ν)), λ = E ν / ((1 + ν)(1 − 2 ν)). The formulas also hold in
/// 2D (plane strain).
/// \param young    Young's modulus E [Pa]
/// \param poisson  Poisson's ratio ν [1]
/// \throws parameter_error unless E > 0 and −1 < ν < ½
inline Lame lame_from_young_poisson(double young, double poisson) {
    if (!(young > 0) || !std::isfinite(young))
        throw parameter_error(sentence("Young's modulus is ", young, " Pa; it must be positive and finite."));
    if (!(poisson > -1 && poisson < 0.5))
        throw parameter_error(sentence("Poisson's ratio is ", poisson,
                                       "; it must lie between −1 and ½, both excluded. An incompressible solid can be "
                                       "approached with 0.49 (and a smaller time step)."));
    return {young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))};
}

/// Checks that the Lamé parameters μ and λ [Pa] are those of a stable solid.
/// \throws parameter_error unless μ ≥ 0, λ + 2 μ/3 > 0, and μ and λ are finite
inline void check_lame(double mu, double lambda) {
    if (!(mu >= 0) || !std::isfinite(mu) || !std::isfinite(lambda) || !(lambda + 2 * mu / 3 > 0))
        throw parameter_error(sentence("Lamé parameters μ = ", mu, " Pa, λ = ", lambda,
                                       " Pa: μ must not be negative and the bulk modulus λ + 2μ/3 must be positive."));
}

/// Checks the Lamé parameters μ and λ [Pa] of a plastic solid. μ must be positive, because the return mapping divides
/// by μ.
/// \throws parameter_error unless μ > 0, λ + 2 μ/3 > 0, and μ and λ are finite
inline void check_lame_of_plastic(double mu, double lambda) {
    check_lame(mu, lambda);
    if (!(mu > 0))
        throw parameter_error("The shear modulus is 0 Pa; a plastic solid needs a positive one. A fluid is Fluid.");
}

/// Returns the Lamé parameters of a solid with Young's modulus E = `young` [Pa] and Poisson's ratio ν = `poisson` [1].
/// Both parameters are rounded to the type T.
/// \throws parameter_error unless E > 0 and −1 < ν < ½; or if check_lame() refuses the rounded parameters
template <std::floating_point T>
Lame lame_in(double young, double poisson) {
    const Lame exact = lame_from_young_poisson(young, poisson);
    const Lame lame{double(T(exact.mu)), double(T(exact.lambda))};  // a float overflows at 3e38
    check_lame(lame.mu, lame.lambda);
    return lame;
}

}  // namespace firn::inline FIRN_BUILD
