/// \file A contact that throws back.
#pragma once

#include <firn/boundary/contact.hpp>
#include <firn/core/error.hpp>

namespace firn {

/// \throws parameter_error  unless 0 ≤ e ≤ 1
inline void check_restitution(double restitution) {
    if (!(restitution >= 0 && restitution <= 1))
        throw parameter_error(sentence("The coefficient of restitution is ", restitution,
                                       "; it must be from 0 (no rebound) to 1 (no loss)."));
}

/// Points are put apart only as far as they overlap by more than this part of the sum of their radii: contacts then
/// last from step to step, and with them what holds a pile.
inline constexpr double contact_slack = 1e-3;

/// velocity_after_contact, with the outward speed `leaving` ≥ 0 [m/s] instead of none after a contact that separates:
/// −e times the outward speed at first, with Newton's coefficient of restitution e. Friction goes with the whole normal
/// impulse, that of leaving included. What leaves faster is not held back; stick and slip throw nothing.
template <scalar S, int D>
FIRN_INLINE Vec<S, D> velocity_after_impact(const Vec<S, D>& v, const Vec<S, D>& normal, Contact contact,
                                            const S& friction, const S& leaving) {
    if (contact != Contact::separate) return velocity_after_contact(v, normal, contact, friction);
    const Vec<S, D> target = normal * leaving;
    return velocity_after_contact(v - target, normal, contact, friction) + target;
}

}  // namespace firn
