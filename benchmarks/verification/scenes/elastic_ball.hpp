/// \file An elastic ball under pressure on its surface: the displacement of the surface for each Legendre polynomial.
#pragma once

namespace verification {

/// Returns the radial displacement of the surface of an elastic ball [R p/E] under the radial tension p Pₙ(cos θ), over
/// Pₙ(cos θ) (Lurie 1964, Three-dimensional problems of the theory of elasticity; linear elasticity).
/// \param n  degree of the Legendre polynomial, not 1: that one needs a body force
inline double displacement_of_ball(int n, double poisson) {
    const double of = n == 0 ? 0 : n * (n * n + 2.0 * n - 1 + 2 * poisson) / (n - 1);
    const double bracket = (n + 1) * (n - 2 + 4 * poisson) - of;
    return -(1 + poisson) / 2 * bracket / (n * n + n + 1 + poisson * (2 * n + 1));
}

}  // namespace verification
