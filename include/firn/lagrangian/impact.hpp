/// \file Contact with restitution (rebound).
#pragma once

#include <firn/boundary/contact.hpp>
#include <firn/core/error.hpp>

namespace firn {

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

/// Returns the velocity of a point after a contact with restitution, relative to the surface [m/s]. For
/// Contact::separate, the outward speed after the contact is at least `leaving`, and friction is limited by the total
/// normal impulse, including the impulse of restitution. For other values of `contact`, returns the result of
/// velocity_after_contact().
/// \param v         velocity of the point before the contact, relative to the surface [m/s]
/// \param normal    outward unit normal of the surface
/// \param contact   how matter moves at the surface
/// \param friction  Coulomb's μ [1]
/// \param leaving   e times the speed of approach [m/s], not negative; e is Newton's coefficient of restitution
template <scalar S, int D>
FIRN_INLINE Vec<S, D> velocity_after_impact(const Vec<S, D>& v, const Vec<S, D>& normal, Contact contact,
                                            const S& friction, const S& leaving) {
    if (contact != Contact::separate) return velocity_after_contact(v, normal, contact, friction);
    const Vec<S, D> target = normal * leaving;
    return velocity_after_contact(v - target, normal, contact, friction) + target;
}

}  // namespace firn
