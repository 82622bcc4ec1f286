/// \file How matter meets a surface: stick, slip, or slip and let go, with Coulomb friction.
#pragma once

#include <firn/core/tensor.hpp>

namespace firn {

enum class Contact {
    stick,     ///< no motion at the surface
    slip,      ///< no motion through or away from the surface
    separate,  ///< no motion into the surface; free to leave
    none       ///< there is no surface
};

constexpr const char* name_of(Contact contact) {
    constexpr const char* names[] = {"stick", "slip", "separate", "none"};
    return names[int(contact)];
}

/// The velocity, relative to the surface, after contact. `normal` is of unit length and points into free space.
/// Friction takes at most μ times the normal impulse from the tangential velocity (Stomakhin et al. 2013, §8).
template <scalar S, int D>
FIRN_INLINE Vec<S, D> velocity_after_contact(const Vec<S, D>& v, const Vec<S, D>& normal, Contact contact,
                                             const S& friction) {
    if (contact == Contact::none) return v;
    if (contact == Contact::stick) return Vec<S, D>::zero();
    const S outward = named("outward", dot(v, normal));
    const S into = min(outward, S(0));
    const Vec<S, D> tangential = v - normal * outward;
    // Not zero, so that derivatives exist at rest: below 1e-15 m/s, friction stops and its absence keeps.
    const S speed = named("speed", sqrt(max(dot(tangential, tangential), S(1e-30))));
    const S kept = named("kept", max(speed + friction * into, S(0)) / speed);
    const Vec<S, D> after = tangential * kept;
    return contact == Contact::slip ? after : after + normal * max(outward, S(0));
}

}  // namespace firn
