/// \file A spring and a damper in parallel, between two points or between a point and a fixed position.
#pragma once

#include <firn/core/digest.hpp>
#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>
#include <firn/lagrangian/tearing.hpp>

#include <array>
#include <cmath>
#include <limits>

namespace firn::inline FIRN_BUILD {

namespace detail {
/// Checks the stiffness [N/m] and damping [N s/m] of a spring.
/// \throws parameter_error  unless stiffness and damping are finite and not negative
inline void check_spring(double stiffness, double damping) {
    if (!(stiffness >= 0) || !std::isfinite(stiffness) || !(damping >= 0) || !std::isfinite(damping))
        throw parameter_error(sentence("A spring of stiffness ", stiffness, " N/m and damping ", damping,
                                       " N s/m: both must be finite and not negative."));
}
}  // namespace detail

/// The law of a spring and a damper between two points. The forces on the points are
///
///     f₁ = f e,  f₂ = −f₁,  with  f = k_s (l − l₀) − k_d (v₁ − v₂)·e,  l = |r₂ − r₁|,  e = (r₂ − r₁)/l
///
/// where r₁ and r₂ are the positions and v₁ and v₂ the velocities of the points, l is the length of the spring, l₀ the
/// length at rest, k_s the stiffness and k_d the damping. If l is 0, the direction e is undefined, and the forces are
/// zero.
template <scalar S>
struct SpringDamper {
    using scalar_type = S;
    static constexpr int corners = 2;  ///< Number of end points of a spring.
    /// The data of one spring.
    struct Element {
        S rest = S(1);       ///< Length at rest l₀ [m].
        S stiffness = S(0);  ///< Stiffness k_s [N/m].
        S damping = S(0);    ///< Damping k_d [N s/m].
    };
    /// Returns a digest of the data of a spring.
    static Digest digest(const Element& e)
        requires std::floating_point<S>
    {
        return Digest().add(e.rest).add(e.stiffness).add(e.damping);
    }

    /// A spring tears at the end of a step if it is longer than this factor times its length at rest. The factor must
    /// be above 1; infinite: springs never tear. It does not hold for springs with a tear factor of their own. A spring
    /// whose length at rest is 0 never tears. \see ParticleSystem::tear
    double tear_factor = std::numeric_limits<double>::infinity();

    /// Checks the tear factor.
    /// \throws parameter_error  unless the factor is above 1
    void check() const { detail::check_tear_factor(tear_factor); }

    /// Returns the force [N] on each of the two end points, which have positions x [m] and velocities v [m/s].
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

    /// Returns the elastic energy [J] of a spring with end points at x [m]: ½ k_s (l − l₀)², where l is the length.
    template <int D>
    FIRN_INLINE S energy(const Element& spring, const std::array<Vec<S, D>, 2>& x) const {
        const S longer = norm(x[1] - x[0]) - spring.rest;
        return S(0.5) * spring.stiffness * longer * longer;
    }

    /// Returns the largest eigenvalue of the spring's stiffness matrix [N/m], which is 2 k_s.
    template <int D>
    S stiffness(const Element& spring, const std::array<Vec<S, D>, 2>&) const {
        return S(2) * spring.stiffness;
    }
    /// Returns the largest eigenvalue of the spring's damping matrix [N s/m], which is 2 k_d.
    S damping(const Element& spring) const { return S(2) * spring.damping; }

    /// Checks the data of a spring.
    /// \throws parameter_error  unless length at rest, stiffness and damping are finite and not negative
    static void check(const Element& spring)
        requires std::floating_point<S>
    {
        detail::check_spring(double(spring.stiffness), double(spring.damping));
        if (!(spring.rest >= 0) || !std::isfinite(spring.rest))
            throw parameter_error(
                sentence("A spring is ", spring.rest, " m long at rest; it must be finite and not negative."));
    }
};

/// The law of an anchor: a spring of zero length at rest and a damper, which pull one point to a position x₀. The force
/// on a point at x with velocity v is k_s (x₀ − x) − k_d v, with the stiffness k_s and the damping k_d. Use an anchor
/// instead of a pin for particles that the grid moves. The position x₀ may be changed between steps.
template <scalar S, int D>
struct Anchor {
    using scalar_type = S;
    static constexpr int corners = 1;  ///< Number of points that an anchor pulls.
    /// The data of one anchor.
    struct Element {
        Vec<double, D> place{};  ///< Position x₀ to which the point is pulled [m].
        S stiffness = S(0);      ///< Stiffness k_s [N/m].
        S damping = S(0);        ///< Damping k_d [N s/m].
    };
    /// Returns a digest of the data of an anchor.
    static Digest digest(const Element& e)
        requires std::floating_point<S>
    {
        return Digest().add(e.place).add(e.stiffness).add(e.damping);
    }

    /// Returns the force [N] on the one point of an anchor, with position x[0] [m], counted from the position `at` [m],
    /// and velocity v[0] [m/s].
    FIRN_INLINE std::array<Vec<S, D>, 1> forces(const Element& held, const std::array<Vec<S, D>, 1>& x,
                                                const std::array<Vec<S, D>, 1>& v,
                                                const Vec<double, D>& at = {}) const {
        return {(cast<S>(held.place - at) - x[0]) * held.stiffness - v[0] * held.damping};
    }

    /// Returns the elastic energy [J] of an anchor whose point is at x [m], counted from the position `at` [m]:
    /// ½ k_s |x₀ − x|².
    FIRN_INLINE S energy(const Element& held, const std::array<Vec<S, D>, 1>& x, const Vec<double, D>& at = {}) const {
        const Vec<S, D> away = cast<S>(held.place - at) - x[0];
        return S(0.5) * held.stiffness * dot(away, away);
    }

    /// Returns the only eigenvalue of the anchor's stiffness matrix [N/m], which is the stiffness k_s.
    S stiffness(const Element& held, const std::array<Vec<S, D>, 1>&) const { return held.stiffness; }
    /// Returns the only eigenvalue of the anchor's damping matrix [N s/m], which is the damping k_d.
    S damping(const Element& held) const { return held.damping; }

    /// Checks the data of an anchor.
    /// \throws parameter_error  unless x₀, stiffness and damping are finite, and stiffness and damping are not negative
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

}  // namespace firn::inline FIRN_BUILD
