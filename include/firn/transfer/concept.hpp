/// \file What a transfer scheme is: which velocity field a particle carries to the grid, and what it takes back.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/parameters.hpp>

namespace firn {

// A particle's velocity field around itself is v + C (x − x_p). P2G gives m N (v + C (x_i − x_p)) to node i, G2P
// interpolates v = Σ N v_i and the affine field C = B D⁻¹ from the first moment B = Σ N v_i (x_i − x_p)ᵀ.

template <class T>
concept has_affine_flag = requires {
    { T::affine } -> std::convertible_to<bool>;  ///< does the scheme carry C ?
};
template <class T, class S, int D>
concept has_affine_field = requires(const Mat<S, D> C) {
    { T::affine_field(C) } -> std::same_as<Mat<S, D>>;  ///< what a particle keeps of it
};

template <class T>
concept transfer = has_affine_flag<T> && has_affine_field<T, float, 3> && has_affine_field<T, double, 2>;

// Two things a scheme may do besides. Steps then have passes more. \see exec/transfer_passes.hpp

/// Velocities of a particle after a step: the one that it keeps, and the one that has moved it.
template <class S, int D>
struct ParticleVelocity {
    Vec<S, D> velocity;  ///< [m/s]
    Vec<S, D> motion;    ///< [m/s]
};

template <class T, class S, int D>
concept has_blended = requires(const T t, const Vec<S, D> v, const Mat<S, D> gradient) {
    { t.blended(v, v, v, gradient) } -> std::same_as<ParticleVelocity<S, D>>;
};
/// Does the scheme blend what G2P takes with the particle's own velocity? It then offers
/// blended(Σ N v_i after the step, Σ N v_i before forces acted, v_p before, velocity gradient).
template <class T>
inline constexpr bool blends_velocities = has_blended<with_scalar_t<T, float>, float, 3>;

/// \throws parameter_error unless the share is from 0 to 1
template <std::floating_point S>
void check_share(S share, const char* scheme, const char* name) {
    if (!(share >= S(0) && share <= S(1)))
        throw parameter_error(sentence("The ", name, " of ", scheme, " is ", share, "; it must be from 0 to 1."));
}

/// Does the scheme take a better inverse of the mass matrix than the inverse masses of the nodes? It then says how many
/// terms of the series: `order`.
template <class T>
inline constexpr bool refines_velocities = requires(const T t) {
    { t.order } -> std::convertible_to<int>;
};

}  // namespace firn
