/// \file Quadratic B-spline: N(u) = ¾ − u² for |u| < ½, ½ (3/2 − |u|)² for ½ ≤ |u| < 3/2, else 0.
/// Steffen, Kirby and Berzins 2008; Jiang et al. 2016, §4.
#pragma once

#include <firn/kernel/concept.hpp>

namespace firn {

struct QuadraticBSpline {
    static constexpr const char* name = "quadratic_b_spline";
    static constexpr int support = 3;
    static constexpr double base_shift = 0.5;
    static constexpr double inverse_inertia = 4;
    /// The middle node is never farther than ½, the outer ones never nearer: N(½), N(0), N(½).
    static constexpr std::array<double, 3> largest_weight{0.5, 0.75, 0.5};
    static constexpr double largest_gradient = 1;
    /// ω² = (2 − 2x)(2 + x)/3 c²/h² with x = cos θ, 1.5 at x = −½.
    static constexpr double courant_limit = 1.6329931618554521;

    /// Weights of the nodes base, base + 1, base + 2; f in [½, 3/2).
    template <scalar S>
    FIRN_INLINE static std::array<S, 3> weights(const S& f) {
        const S left = S(1.5) - f, middle = f - S(1), right = f - S(0.5);
        return {S(0.5) * left * left, S(0.75) - middle * middle, S(0.5) * right * right};
    }

    /// Derivatives of the weights by x, per cell (divide by h for 1/m).
    template <scalar S>
    FIRN_INLINE static std::array<S, 3> gradients(const S& f) {
        return {f - S(1.5), S(2) - (f + f), f - S(0.5)};
    }
};

static_assert(kernel<QuadraticBSpline>);

}  // namespace firn
