/// \file How matter meets a surface: stick, slip, or slip and separate, with Coulomb friction.
#pragma once

#include <firn/core/tensor.hpp>

namespace firn {

/// How matter moves at a surface, relative to the surface.
enum class Contact {
    stick,     ///< Matter does not move; the friction coefficient is not used.
    slip,      ///< Matter moves only along the surface, with friction; it neither enters nor leaves.
    separate,  ///< Matter does not enter, moves along the surface with friction, and may leave.
    none       ///< There is no contact: matter passes through.
};

/// The name of a contact: "stick", "slip", "separate" or "none".
constexpr const char* name_of(Contact contact) {
    constexpr const char* names[] = {"stick", "slip", "separate", "none"};
    return names[int(contact)];
}

/// Returns the velocity of matter after contact with a surface [m/s], relative to the surface.
///
/// With vₙ = v · n and vₜ = v − vₙ n, the tangential velocity becomes
///
///     vₜ max(0, 1 + μ min(vₙ, 0)/‖vₜ‖)
///
/// so friction takes at most μ times the normal impulse. The normal velocity becomes 0 for `slip` and max(vₙ, 0) for
/// `separate`. For `stick` the velocity becomes 0, for `none` it stays v. Stomakhin et al. 2013, "A material point
/// method for snow simulation", §8.
/// \param v         velocity before contact, relative to the surface [m/s]
/// \param normal    n: unit normal of the surface, into free space [1]
/// \param friction  Coulomb's coefficient μ [1]
template <scalar S, int D>
FIRN_INLINE Vec<S, D> velocity_after_contact(const Vec<S, D>& v, const Vec<S, D>& normal, Contact contact,
                                             const S& friction) {
    if (contact == Contact::none) return v;
    if (contact == Contact::stick) return Vec<S, D>::zero();
    const S outward = named("outward", dot(v, normal));
    const S into = min(outward, S(0));
    const Vec<S, D> tangential = v - normal * outward;
    // The speed is at least 1e-15 m/s, so that derivatives exist at rest. Below that speed friction stops the motion;
    // without friction the motion continues.
    const S speed = named("speed", sqrt(max(dot(tangential, tangential), S(1e-30))));
    const S kept = named("kept", max(speed + friction * into, S(0)) / speed);
    const Vec<S, D> after = tangential * kept;
    return contact == Contact::slip ? after : after + normal * max(outward, S(0));
}

}  // namespace firn
