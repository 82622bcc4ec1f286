/// \file How matter meets a surface: stick, slip, or slip and separate, with Coulomb friction.
#pragma once

#include <firn/core/tensor.hpp>

#include <concepts>

namespace firn::inline FIRN_BUILD {

/// How matter may move at the surface of a solid, relative to this surface.
enum class Contact {
    stick,     ///< Matter does not move relative to the surface; friction is not used.
    slip,      ///< Matter moves along the surface, with friction; it can neither enter the solid nor leave the surface.
    separate,  ///< Matter moves along the surface, with friction; it can leave the surface, but not enter the solid.
    none       ///< There is no contact: matter passes through the surface.
};

/// The name of a contact: "stick", "slip", "separate" or "none".
constexpr const char* name_of(Contact contact) {
    constexpr const char* names[] = {"stick", "slip", "separate", "none"};
    return names[int(contact)];
}

/// Whether surfaces that have touched part no more.
constexpr bool holds(Contact contact) { return contact == Contact::slip || contact == Contact::stick; }
/// Whether a surface holds matter that is a gap away, up to the gap `reach` [the same unit].
template <std::floating_point S>
constexpr bool holds(Contact contact, const S& gap, const S& reach) {
    return holds(contact) && gap <= reach;
}

/// Returns the speed at which matter may approach a surface in a step [m/s].
/// \param gap  distance of the matter from the surface [m]; negative if they overlap;  \param dt  time step [s]
template <std::floating_point S>
S closing_speed(const S& gap, const S& dt) {
    return max(gap, S(0)) / dt;
}

/// Returns the velocity of matter after contact with a surface [m/s], relative to the surface.
///
/// With the normal velocity vₙ = v · n and the tangential velocity vₜ = v − vₙ n before contact, the tangential
/// velocity after contact is
///
///     vₜ max(0, 1 + μ min(vₙ, 0)/‖vₜ‖)
///
/// so the impulse of friction is at most μ times the normal impulse. The normal velocity becomes 0 for `slip` and
/// max(vₙ, 0) for `separate`. For `stick` both velocities become 0; for `none` the result is v. Stomakhin et al. 2013,
/// "A material point method for snow simulation", §8.
/// \param v         velocity before contact, relative to the surface [m/s]
/// \param normal    n: unit normal of the surface, which points into free space [1]
/// \param friction  Coulomb's friction coefficient μ [1]
template <scalar S, int D>
FIRN_INLINE Vec<S, D> velocity_after_contact(const Vec<S, D>& v, const Vec<S, D>& normal, Contact contact,
                                             const S& friction) {
    if (contact == Contact::none) return v;
    if (contact == Contact::stick) return Vec<S, D>::zero();
    const S outward = named("outward", dot(v, normal));
    const S into = min(outward, S(0));
    const Vec<S, D> tangential = v - normal * outward;
    // The tangential speed, but at least 1e-15 m/s, so that derivatives exist at rest. Friction stops matter that moves
    // more slowly; without friction this matter keeps its velocity.
    const S speed = named("speed", sqrt(max(dot(tangential, tangential), S(detail::least_square))));
    const S kept = named("kept", max(speed + friction * into, S(0)) / speed);
    const Vec<S, D> after = tangential * kept;
    return contact == Contact::slip ? after : after + normal * max(outward, S(0));
}

/// Returns the velocity of matter after contact with a surface that is a gap away [m/s], relative to the surface.
///
/// In a step, matter may approach the surface by the gap g, so the law of the velocity_after_contact() without a gap
/// acts on v + n max(g, 0)/dt, for `separate`. Before surfaces touch, `slip` and `stick` act like `separate`; if the
/// gap is at most `reach`, they hold.
/// \param gap    g: distance of the matter from the surface along the normal [m]; negative if they overlap
/// \param reach  for `slip` and `stick`: the gap up to which surfaces count as touching [m]
/// \param dt     time step [s]
template <std::floating_point S, int D>
Vec<S, D> velocity_after_contact(const Vec<S, D>& v, const Vec<S, D>& normal, Contact contact, const S& friction,
                                 const S& gap, const S& reach, const S& dt) {
    if (holds(contact, gap, reach)) return velocity_after_contact(v, normal, contact, friction);
    const S open = closing_speed(gap, dt);
    if (contact == Contact::none || dot(v, normal) + open >= S(0)) return v;
    const Vec<S, D> closing = normal * open;
    return velocity_after_contact(v + closing, normal, Contact::separate, friction) - closing;
}

}  // namespace firn::inline FIRN_BUILD
