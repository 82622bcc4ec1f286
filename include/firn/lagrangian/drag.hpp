/// \file Drag of air on a ball and on a facet.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>
#include <firn/lagrangian/net.hpp>

#include <array>
#include <cmath>
#include <numbers>

namespace firn::inline FIRN_BUILD {

namespace detail {
inline void check_air(double density, double coefficient) {
    if (!(density >= 0) || !std::isfinite(density) || !(coefficient >= 0) || !std::isfinite(coefficient))
        throw parameter_error(sentence("Air of density ", density, " kg/m³ and a drag coefficient of ", coefficient,
                                       ": both must be finite and not negative."));
}
}  // namespace detail

/// The drag −½ ρ c_d A |v| v [N] of air on a ball. Here ρ is the density of the air, c_d the drag coefficient, v the
/// ball's velocity relative to the wind, and A = π r² the cross-section of a ball of radius r. In 2D the ball is a disk
/// one metre thick, with A = 2 r.
template <scalar S, int D>
struct Drag {
    S density = S(1.2);       ///< Density ρ of the air [kg/m³].
    S coefficient = S(0.47);  ///< Drag coefficient c_d [1]; 0.47: smooth ball at Reynolds numbers of 1e4 to 1e5.
    Vec<S, D> wind{};         ///< Velocity of the air [m/s].

    /// Checks density and coefficient.
    /// \throws parameter_error  unless density and coefficient are finite and not negative
    void check() const
        requires std::floating_point<S>
    {
        detail::check_air(double(density), double(coefficient));
    }

    /// Returns the force [N] on a ball.
    /// \param velocity  velocity of the ball [m/s]
    /// \param radius    radius of the ball [m]
    FIRN_INLINE Vec<S, D> force(const Vec<S, D>& velocity, const S& radius) const {
        const Vec<S, D> v = velocity - wind;
        const S area = D == 3 ? S(std::numbers::pi) * radius * radius : S(2) * radius;
        return v * (S(-0.5) * density * coefficient * area * norm(v));
    }
};

/// The drag −½ ρ c_d A |v| (v·n) n [N] of air on a facet of area A and unit normal n. Here ρ is the density of the air,
/// c_d the drag coefficient, and v the mean velocity of the facet's corners relative to the wind. Each corner gets an
/// equal part of this force. The force on a facet without area is zero.
template <scalar S, int D>
struct AerodynamicDrag {
    using scalar_type = S;
    static constexpr int corners = D;  ///< Number of corners of a facet.
    /// The data of one facet. It is empty, because all facets have the same parameters.
    struct Element {};

    S density = S(1.2);    ///< Density ρ of the air [kg/m³].
    S coefficient = S(1);  ///< Drag coefficient c_d [1]; about 1.2 for a plate across the wind.
    Vec<S, D> wind{};      ///< Velocity of the air [m/s].

    /// Checks density and coefficient.
    /// \throws parameter_error  unless density and coefficient are finite and not negative
    void check() const
        requires std::floating_point<S>
    {
        detail::check_air(double(density), double(coefficient));
    }

    /// Returns the force [N] on each corner of a facet whose corners have positions x [m] and velocities v [m/s].
    FIRN_INLINE std::array<Vec<S, D>, D> forces(const Element&, const std::array<Vec<S, D>, D>& x,
                                                const std::array<Vec<S, D>, D>& v) const {
        const Vec<S, D> mean = mean_velocity(v), a = area_vector(x);
        const S area = norm(a);
        const auto there = S(0) < area;
        const S factor = S(-0.5 / D) * density * coefficient * norm(mean) * dot(mean, a);
        const Vec<S, D> each = a * select(there, factor / select(there, area, S(1)), S(0));
        std::array<Vec<S, D>, D> all;
        all.fill(each);
        return all;
    }

    /// Returns the largest singular value of the facet's damping matrix −∂f/∂v [N s/m], which bounds its eigenvalues:
    /// ½ ρ c_d A √(v² + 3 (v·n)²) / D. From the edge on it is that of the force; face on it is twice as much, because
    /// the force grows with the square of the speed.
    FIRN_INLINE S damping(const Element&, const std::array<Vec<S, D>, D>& x, const std::array<Vec<S, D>, D>& v) const {
        const Vec<S, D> mean = mean_velocity(v), a = area_vector(x);
        const S square = dot(a, a), along = dot(mean, a);  // A √(v² + 3 (v·n)²) = √(A² v² + 3 (v·A n)²)
        return S(0.5 / D) * density * coefficient * sqrt(square * dot(mean, mean) + S(3) * along * along);
    }

private:
    /// Returns the mean velocity of the corners relative to the wind.
    FIRN_INLINE Vec<S, D> mean_velocity(const std::array<Vec<S, D>, D>& v) const {
        Vec<S, D> mean = v[0];
        unroll<D - 1>([&](auto i) FIRN_LAMBDA { mean = mean + v[i + 1]; });
        return mean * S(1.0 / D) - wind;
    }
};

}  // namespace firn::inline FIRN_BUILD
