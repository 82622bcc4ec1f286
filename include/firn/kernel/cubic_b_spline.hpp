/// \file Cubic B-spline: N(u) = ⅔ − u² + ½ |u|³ for |u| < 1, ⅙ (2 − |u|)³ for 1 ≤ |u| < 2, else 0.
/// Steffen, Kirby and Berzins 2008; Jiang et al. 2016, §4.
#pragma once

#include <firn/kernel/concept.hpp>

namespace firn {

/// The widest kernel: a particle touches 4^D nodes. Twice continuously differentiable.
struct CubicBSpline {
    static constexpr const char* name = "cubic_b_spline";
    static constexpr int support = 4;
    static constexpr double base_shift = 1;
    static constexpr double inverse_inertia = 3;
    /// The inner nodes are up to 1 away, the outer ones 1 and more: N(1), N(0), N(0), N(1).
    static constexpr std::array<double, 4> largest_weight{1.0 / 6, 2.0 / 3, 2.0 / 3, 1.0 / 6};
    static constexpr double largest_gradient = 2.0 / 3;  ///< at |u| = ⅔
    /// ω² = (1 − x)(16 + 13 x + x²)/15 c²/h² with x = cos θ, at worst at x = √15 − 4.
    static constexpr double courant_limit = 1.9251248585239016;

    /// Weights of the nodes base, …, base + 3; f in [1, 2).
    template <scalar S>
    FIRN_INLINE static std::array<S, 4> weights(const S& f) {
        const S left = S(2) - f, right = f - S(1);  // to the two nodes between which the particle is
        const S left_squared = left * left, right_squared = right * right;
        return {S(1.0 / 6) * left_squared * left, S(2.0 / 3) - right_squared * (S(1) - S(0.5) * right),
                S(2.0 / 3) - left_squared * (S(1) - S(0.5) * left), S(1.0 / 6) * right_squared * right};
    }

    /// Derivatives of the weights by x, per cell (divide by h for 1/m).
    template <scalar S>
    FIRN_INLINE static std::array<S, 4> gradients(const S& f) {
        const S left = S(2) - f, right = f - S(1);
        return {S(-0.5) * left * left, right * (S(1.5) * right - S(2)), left * (S(2) - S(1.5) * left),
                S(0.5) * right * right};
    }
};

static_assert(kernel<CubicBSpline>);

}  // namespace firn
