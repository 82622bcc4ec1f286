/// \file What a transfer scheme is: which velocity field a particle carries to the grid, and what it takes back.
///
/// A particle's velocity field around itself is v + C (x − x_p). P2G gives the momentum m N (v + C (x_i − x_p)) to node
/// i. G2P interpolates the velocity v = Σ N v_i, and the affine field C = B D⁻¹ from the first moment
/// B = Σ N v_i (x_i − x_p)ᵀ.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/parameters.hpp>

namespace firn {

/// Has T `affine`, which says whether particles carry the affine field C?
template <class T>
concept has_affine_flag = requires {
    { T::affine } -> std::convertible_to<bool>;
};
/// Has T `affine_field(C)`? It returns the part of C [1/s] that a particle keeps.
template <class T, class S, int D>
concept has_affine_field = requires(const Mat<S, D> C) {
    { T::affine_field(C) } -> std::same_as<Mat<S, D>>;
};

/// A transfer scheme.
template <class T>
concept transfer = has_affine_flag<T> && has_affine_field<T, float, 3> && has_affine_field<T, double, 2>;

// Two more things that a scheme may do. A step then has more passes: exec/transfer_passes.hpp.

/// The velocities of a particle after a step.
template <class S, int D>
struct ParticleVelocity {
    Vec<S, D> velocity;  ///< the velocity that it keeps [m/s]
    Vec<S, D> motion;    ///< the velocity with which it moves in this step [m/s]
};

/// Has T `blended(after, before, own, gradient)`? It returns a ParticleVelocity. \see blends_velocities
template <class T, class S, int D>
concept has_blended = requires(const T t, const Vec<S, D> v, const Mat<S, D> gradient) {
    { t.blended(v, v, v, gradient) } -> std::same_as<ParticleVelocity<S, D>>;
};
/// Does the scheme blend the grid's velocity with the particle's own?
///
/// It then offers blended(Σ N v_i after the step, Σ N v_i before forces acted, the particle's velocity v_p before the
/// step, velocity gradient), the velocities in [m/s], the gradient in [1/s].
template <class T>
inline constexpr bool blends_velocities = has_blended<with_scalar_t<T, float>, float, 3>;

/// Checks a share (a ratio of blending) of a transfer.
/// \param scheme  name of the transfer, for the message
/// \param name    name of the share, for the message
/// \throws parameter_error unless the share is from 0 to 1
template <std::floating_point S>
void check_share(S share, const char* scheme, const char* name) {
    if (!(share >= S(0) && share <= S(1)))
        throw parameter_error(sentence("The ", name, " of ", scheme, " is ", share, "; it must be from 0 to 1."));
}

/// Does the scheme approximate the inverse of the mass matrix better than by the nodes' inverse masses? It then has
/// `order`, the number of terms of the series.
template <class T>
inline constexpr bool refines_velocities = requires(const T t) {
    { t.order } -> std::convertible_to<int>;
};

}  // namespace firn
