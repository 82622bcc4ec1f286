/// \file Contact with restitution.
#pragma once

#include <firn/boundary/contact.hpp>
#include <firn/core/error.hpp>

namespace firn {

/// Checks a coefficient of restitution e.
/// \throws parameter_error  unless 0 ≤ e ≤ 1
inline void check_restitution(double restitution) {
    if (!(restitution >= 0 && restitution <= 1))
        throw parameter_error(sentence("The coefficient of restitution is ", restitution,
                                       "; it must be from 0 (no rebound) to 1 (no loss)."));
}

/// The fraction of the sum of two radii by which points may overlap [1]. Only overlap beyond it is removed, so contacts
/// last from step to step, and so do the impulses that hold a pile.
inline constexpr double contact_slack = 1e-3;

/// The velocity [m/s] after a contact with restitution. It is velocity_after_contact(), except that a contact that
/// separates leaves with at least the outward speed `leaving` ≥ 0 [m/s]: −e times the outward speed before the contact,
/// where e is Newton's coefficient of restitution. Friction takes the whole normal impulse into account, restitution
/// included. Stick and slip have no restitution.
/// \param v  velocity relative to the surface [m/s]
/// \param normal  outward unit normal of the surface
/// \param friction  Coulomb's μ [1]
template <scalar S, int D>
FIRN_INLINE Vec<S, D> velocity_after_impact(const Vec<S, D>& v, const Vec<S, D>& normal, Contact contact,
                                            const S& friction, const S& leaving) {
    if (contact != Contact::separate) return velocity_after_contact(v, normal, contact, friction);
    const Vec<S, D> target = normal * leaving;
    return velocity_after_contact(v - target, normal, contact, friction) + target;
}

}  // namespace firn
