/// \file Contact with restitution (rebound).
#pragma once

#include <firn/boundary/contact.hpp>
#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>

#include <cstddef>

namespace firn::inline FIRN_BUILD {

/// Checks a coefficient of restitution.
/// \throws parameter_error  unless `restitution` is from 0 (no rebound) to 1 (no loss of energy)
inline void check_restitution(double restitution) {
    if (!(restitution >= 0 && restitution <= 1))
        throw parameter_error(sentence("The coefficient of restitution is ", restitution,
                                       "; it must be from 0 (no rebound) to 1 (no loss)."));
}

/// The overlap that two colliding points may keep, divided by the sum of their radii [1]. Only overlap above this limit
/// is removed. So points at rest stay in contact from step to step, and the impulses that support a pile are kept.
inline constexpr double contact_slack = 1e-3;

/// How the points of a system have come to their positions. Restitution needs it, because contact is found after points
/// have passed surfaces or each other.
/// \tparam Acceleration  callable as acceleration(i), returns the acceleration of the point with index i [m/s²]
template <class Acceleration>
struct Approach {
    double step = 0;  ///< Length of the last step in which points moved [s].
    /// Time by which the velocities lag behind the positions [s]; negative: the velocities are ahead.
    double lag = 0;
    Acceleration acceleration{};  ///< The acceleration of each point in the step.

    /// Returns whether anything is known: whether `step` or `lag` is not 0.
    bool is_known() const { return step != 0 || lag != 0; }
};

/// A function object that returns zero, for Approach::acceleration.
template <std::floating_point S, int D>
struct NoAcceleration {
    /// Returns zero.
    Vec<S, D> operator()(std::size_t) const { return Vec<S, D>::zero(); }
};

/// What follows from an impact.
template <scalar S>
struct Rebound {
    S leaving;  ///< Outward normal speed after the impact, at the time to which the given velocity belongs [m/s].
    S since;    ///< Time from the impact until the present position [s].
};

/// Returns how a point leaves a surface that it has passed since it last moved.
///
/// Let the normal coordinate of the point be −d now, V its rate now, and a its acceleration. On the parabola through
/// these, the point met the surface at the time τ ago, with the speed w = −(V − a τ). Thrown back there with the speed
/// e w, it has now the rate e w + a τ and the coordinate e w τ + a τ²/2. So a ball that falls and bounces keeps its
/// energy to rounding if e is 1, whatever the time step. If the coordinate is not positive, the point would meet the
/// surface again before now: it rests on the surface, and its speed is 0.
///
/// Where d is more than the way of the last step, the point was beyond the surface before, and τ is the length of the
/// step.
/// \param overlap       d [m], not negative
/// \param rate          normal component of the velocity [m/s], relative to the surface; negative: towards it
/// \param acceleration  a [m/s²], normal component
/// \param lag, step     see Approach [s]; the rate now is `rate` + a `lag`
/// \param restitution   Newton's coefficient of restitution e, from 0 to 1 [1]
template <scalar S>
FIRN_INLINE Rebound<S> rebound(const S& overlap, const S& rate, const S& acceleration, const S& lag, const S& step,
                               const S& restitution) {
    const S inward = -(rate + acceleration * lag);
    const S root = sqrt(max(inward * inward + S(2) * acceleration * overlap, S(0)));
    const auto comes = S(0) < inward + root;
    const S since = select(comes, min(S(2) * overlap / select(comes, inward + root, S(1)), step), S(0));
    const S out = restitution * max(inward + acceleration * since, S(0));
    const auto leaves = S(0) < out + acceleration * since * S(0.5);
    return {select(leaves, out + acceleration * (since - lag), S(0)), select(leaves, since, S(0))};
}

/// Returns the velocity of a point after a contact with restitution, relative to the surface [m/s]. For
/// Contact::separate, the outward speed after the contact is at least `leaving`, and friction is limited by the total
/// normal impulse, including the impulse of restitution. For other values of `contact`, returns the result of
/// velocity_after_contact().
/// \param v         velocity of the point before the contact, relative to the surface [m/s]
/// \param normal    outward unit normal of the surface
/// \param contact   how matter moves at the surface
/// \param friction  Coulomb's μ [1]
/// \param leaving   outward speed after the contact [m/s], such as Rebound::leaving
template <scalar S, int D>
FIRN_INLINE Vec<S, D> velocity_after_impact(const Vec<S, D>& v, const Vec<S, D>& normal, Contact contact,
                                            const S& friction, const S& leaving) {
    if (contact != Contact::separate) return velocity_after_contact(v, normal, contact, friction);
    const Vec<S, D> target = normal * leaving;
    return velocity_after_contact(v - target, normal, contact, friction) + target;
}

}  // namespace firn::inline FIRN_BUILD
