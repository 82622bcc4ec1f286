/// \file A spring and a damper side by side, between two points or from a point to a place.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>

#include <array>
#include <cmath>

namespace firn {

namespace detail {
/// \throws parameter_error  unless both are finite and not negative
inline void check_spring(double stiffness, double damping) {
    if (!(stiffness >= 0) || !std::isfinite(stiffness) || !(damping >= 0) || !std::isfinite(damping))
        throw parameter_error(sentence("A spring of stiffness ", stiffness, " N/m and damping ", damping,
                                       " N s/m: both must be finite and not negative."));
}
}  // namespace detail

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

    /// \throws parameter_error  unless all is finite and not negative
    static void check(const Element& spring)
        requires std::floating_point<S>
    {
        detail::check_spring(double(spring.stiffness), double(spring.damping));
        if (!(spring.rest >= 0) || !std::isfinite(spring.rest))
            throw parameter_error(
                sentence("A spring is ", spring.rest, " m long at rest; that must be finite and not negative."));
    }
};

/// A spring of no length and a damper that hold one point at a place: k_s (x₀ − x) − k_d v. A pin that gives way, for
/// particles that the grid moves; the place may be moved.
template <scalar S, int D>
struct Anchor {
    using scalar_type = S;
    static constexpr int corners = 1;
    struct Element {
        Vec<S, D> place{};   ///< x₀ [m]
        S stiffness = S(0);  ///< k_s [N/m]
        S damping = S(0);    ///< k_d [N s/m]
    };

    FIRN_INLINE std::array<Vec<S, D>, 1> forces(const Element& held, const std::array<Vec<S, D>, 1>& x,
                                                const std::array<Vec<S, D>, 1>& v) const {
        return {(held.place - x[0]) * held.stiffness - v[0] * held.damping};
    }

    /// ½ k_s |x₀ − x|² [J].
    FIRN_INLINE S energy(const Element& held, const std::array<Vec<S, D>, 1>& x) const {
        const Vec<S, D> away = held.place - x[0];
        return S(0.5) * held.stiffness * dot(away, away);
    }

    S stiffness(const Element& held, const std::array<Vec<S, D>, 1>&) const { return held.stiffness; }
    S damping(const Element& held) const { return held.damping; }

    /// \throws parameter_error  unless all is finite, stiffness and damping not negative
    static void check(const Element& held)
        requires std::floating_point<S>
    {
        detail::check_spring(double(held.stiffness), double(held.damping));
        for (int a = 0; a < D; ++a)
            if (!std::isfinite(held.place[a]))
                throw parameter_error(
                    sentence("Coordinate ", a, " of an anchor's place is ", held.place[a], " m; it must be finite."));
    }
};

}  // namespace firn
