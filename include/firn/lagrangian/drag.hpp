/// \file Drag of air on a ball and on a facet.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>
#include <firn/lagrangian/net.hpp>

#include <array>
#include <cmath>
#include <numbers>

namespace firn {

namespace detail {
inline void check_air(double density, double coefficient) {
    if (!(density >= 0) || !std::isfinite(density) || !(coefficient >= 0) || !std::isfinite(coefficient))
        throw parameter_error(sentence("Air of density ", density, " kg/m³ and a drag coefficient of ", coefficient,
                                       ": both must be finite and not negative."));
}
}  // namespace detail

/// The drag −½ ρ c_d A |v| v on a ball of radius r, where v is its velocity relative to the wind. A = π r²; in 2D, A =
/// 2 r for a disk one metre thick.
template <scalar S, int D>
struct Drag {
    S density = S(1.2);       ///< ρ, density of the air [kg/m³; kg/m² in 2D].
    S coefficient = S(0.47);  ///< c_d [1]; 0.47 is a smooth ball at Reynolds numbers of 1e4 to 1e5.
    Vec<S, D> wind{};         ///< Velocity of the air [m/s].

    /// Checks the numbers.
    /// \throws parameter_error  unless density and coefficient are finite and not negative
    void check() const
        requires std::floating_point<S>
    {
        detail::check_air(double(density), double(coefficient));
    }

    /// The force [N] on a ball of a velocity [m/s] and radius [m].
    FIRN_INLINE Vec<S, D> force(const Vec<S, D>& velocity, const S& radius) const {
        const Vec<S, D> v = velocity - wind;
        const S area = D == 3 ? S(std::numbers::pi) * radius * radius : S(2) * radius;
        return v * (S(-0.5) * density * coefficient * area * norm(v));
    }
};

/// The drag −½ ρ c_d A |v| (v·n) n on a facet of area A and unit normal n, an equal part on each corner. v is the mean
/// velocity of the corners relative to the wind. A facet without area feels no force.
template <scalar S, int D>
struct AerodynamicDrag {
    using scalar_type = S;
    static constexpr int corners = D;  ///< Points of a facet.
    /// A facet has no data of its own.
    struct Element {};

    S density = S(1.2);    ///< ρ, density of the air [kg/m³].
    S coefficient = S(1);  ///< c_d [1]; about 1.2 for a plate across the wind.
    Vec<S, D> wind{};      ///< Velocity of the air [m/s].

    /// Checks the numbers.
    /// \throws parameter_error  unless density and coefficient are finite and not negative
    void check() const
        requires std::floating_point<S>
    {
        detail::check_air(double(density), double(coefficient));
    }

    /// The forces [N] on the corners of a facet, at positions x [m] with velocities v [m/s].
    FIRN_INLINE std::array<Vec<S, D>, D> forces(const Element&, const std::array<Vec<S, D>, D>& x,
                                                const std::array<Vec<S, D>, D>& v) const {
        Vec<S, D> mean = v[0];
        unroll<D - 1>([&](auto i) FIRN_LAMBDA { mean = mean + v[i + 1]; });
        mean = mean * S(1.0 / D) - wind;
        const Vec<S, D> a = area_vector(x);
        const S area = norm(a);
        const auto there = S(0) < area;
        const S factor = S(-0.5 / D) * density * coefficient * norm(mean) * dot(mean, a);
        const Vec<S, D> each = a * select(there, factor / select(there, area, S(1)), S(0));
        std::array<Vec<S, D>, D> all;
        all.fill(each);
        return all;
    }
};

}  // namespace firn
