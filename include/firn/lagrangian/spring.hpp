/// \file A spring and a damper side by side between two points.
#pragma once

#include <firn/core/tensor.hpp>

#include <array>

namespace firn {

/// f₁ = f e, f₂ = −f₁ with e = (r₂ − r₁)/l, f = k_s (l − l₀) − k_d (v₁ − v₂)·e. Where both ends are at one place there
/// is no direction, and no force.
template <scalar S>
struct SpringDamper {
    using scalar_type = S;
    static constexpr int corners = 2;
    struct Element {
        S rest = S(1);       ///< l₀ [m]
        S stiffness = S(0);  ///< k_s [N/m]
        S damping = S(0);    ///< k_d [N s/m]
    };

    template <int D>
    FIRN_INLINE std::array<Vec<S, D>, 2> forces(const Element& spring, const std::array<Vec<S, D>, 2>& x,
                                                const std::array<Vec<S, D>, 2>& v) const {
        const Vec<S, D> along = x[1] - x[0];
        const S length = norm(along);
        const auto apart = S(0) < length;
        const S per_length = S(1) / select(apart, length, S(1));
        const S closing = dot(v[0] - v[1], along) * per_length;
        const S pull = spring.stiffness * (length - spring.rest) - spring.damping * closing;
        const Vec<S, D> f = along * select(apart, pull * per_length, S(0));
        return {f, -f};
    }

    /// ½ k_s (l − l₀)² [J].
    template <int D>
    FIRN_INLINE S energy(const Element& spring, const std::array<Vec<S, D>, 2>& x) const {
        const S longer = norm(x[1] - x[0]) - spring.rest;
        return S(0.5) * spring.stiffness * longer * longer;
    }

    // The largest eigenvalues of the matrices of stiffness [N/m] and damping [N s/m].
    template <int D>
    S stiffness(const Element& spring, const std::array<Vec<S, D>, 2>&) const {
        return S(2) * spring.stiffness;
    }
    S damping(const Element& spring) const { return S(2) * spring.damping; }
};

}  // namespace firn
