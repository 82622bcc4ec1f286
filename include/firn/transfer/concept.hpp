/// \file The concept of a transfer scheme. A transfer scheme decides which velocity field a particle carries to the
/// grid, and which velocity the particle takes from the grid.
///
/// The velocity field that a particle carries is v + C (x − x_p) at the position x near the particle. P2G adds the
/// momentum m N (v + C (x_i − x_p)) to node i. G2P interpolates the velocity v = Σ N v_i, and computes the affine field
/// C = B D⁻¹ from the first moment B = Σ N v_i (x_i − x_p)ᵀ. Here m, v and x_p are the particle's mass, velocity and
/// position, N is the particle's weight at node i, v_i and x_i are the node's velocity and position, and D = Σ N (x_i −
/// x_p)(x_i − x_p)ᵀ.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/parameters.hpp>

namespace firn::inline FIRN_BUILD {

/// Whether T has a constant `affine`. This constant is true if particles carry the affine field C.
template <class T>
concept has_affine_flag = requires {
    { T::affine } -> std::convertible_to<bool>;
};
/// Whether T has a function `affine_field(C)`, static or const. The function returns the part of the affine field C
/// [1/s] that a particle keeps after a step. It may use the parameters of T.
template <class T, class S, int D>
concept has_affine_field = requires(const T t, const Mat<S, D> C) {
    { t.affine_field(C) } -> std::same_as<Mat<S, D>>;
};

/// Whether T is a transfer scheme: T has a constant `affine` and a function `affine_field(C)`.
template <class T>
concept transfer = has_affine_flag<T> && has_affine_field<with_scalar_t<T, float>, float, 3> &&
                   has_affine_field<with_scalar_t<T, double>, double, 2>;

// A transfer scheme may also blend velocities or refine velocities. Both need more passes over the particles in each
// step, see loops/transfer_passes.hpp.

/// The velocities of a particle after a step.
template <class S, int D>
struct ParticleVelocity {
    Vec<S, D> velocity;  ///< the velocity that the particle keeps [m/s]
    Vec<S, D> motion;    ///< the velocity with which the particle moves in this step [m/s]
};

/// Whether T has a function `blended(after, before, own, gradient)`, which returns a ParticleVelocity. \see
/// blends_velocities
template <class T, class S, int D>
concept has_blended = requires(const T t, const Vec<S, D> v, const Mat<S, D> gradient) {
    { t.blended(v, v, v, gradient) } -> std::same_as<ParticleVelocity<S, D>>;
};
/// Whether the transfer scheme T blends the grid's velocity with the particle's own velocity.
///
/// Such a scheme has a function blended(after, before, own, gradient). `after` is the grid's velocity Σ N v_i at the
/// particle after the step, `before` the grid's velocity at the particle before forces acted, `own` the particle's
/// velocity before the step [m/s], and `gradient` the velocity gradient around the particle [1/s].
template <class T>
inline constexpr bool blends_velocities = has_blended<with_scalar_t<T, float>, float, 3>;

namespace detail {
struct has_blended_too {
    int blended;
};
template <class T>
struct with_two_blended : T, has_blended_too {};
/// Whether T has a member `blended` of any kind: a second one makes the name ambiguous.
template <class T>
concept has_member_blended = std::is_class_v<T> && !std::is_final_v<T> && !requires { &with_two_blended<T>::blended; };
}  // namespace detail

/// Checks that a share, such as the blending ratio of a transfer scheme, is from 0 to 1.
/// \param scheme  name of the transfer scheme, for the message
/// \param name    name of the share, for the message
/// \throws parameter_error unless the share is from 0 to 1
template <std::floating_point S>
void check_share(S share, const char* scheme, const char* name) {
    if (!(share >= S(0) && share <= S(1)))
        throw parameter_error(sentence("The ", name, " of ", scheme, " is ", share, "; it must be from 0 to 1."));
}

/// Whether the transfer scheme T approximates the inverse of the full mass matrix by a series. Other schemes use the
/// inverse of each node's mass. A scheme with a series has a member `order`, the number of terms of the series.
template <class T>
inline constexpr bool refines_velocities = requires(const T t) {
    { t.order } -> std::convertible_to<int>;
};

/// Returns true if T is a transfer scheme. If T is not, the compilation stops with a message.
template <class T>
consteval bool require_transfer() {
    static_assert(
        has_affine_flag<T>,
        "firn: a transfer says whether particles carry an affine field: static constexpr bool affine = true.");
    static_assert(
        has_affine_field<with_scalar_t<T, float>, float, 3> && has_affine_field<with_scalar_t<T, double>, double, 2>,
        "firn: a transfer offers `template <class T, int D> firn::Mat<T, D> affine_field(const firn::Mat<T, "
        "D>& C) const`, which returns what a particle keeps of C; see firn/transfer/concept.hpp.");
    static_assert(
        !detail::has_member_blended<T> || blends_velocities<T>,
        "firn: the function blended() of this transfer cannot be called: it offers `template <class T, int D> "
        "firn::ParticleVelocity<T, D> blended(after, before, own, gradient) const`, with three firn::Vec<T, "
        "D> and a firn::Mat<T, D>; see firn/transfer/concept.hpp.");
    static_assert(std::default_initializable<T>, "firn: a transfer has a value for each of its parameters by default.");
    return transfer<T>;
}

}  // namespace firn::inline FIRN_BUILD
