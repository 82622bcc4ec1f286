/// \file What walls do to a rigid body: firn lets bodies and matter push each other, and leaves what bodies meet
/// besides to the program.
#pragma once

#include <firn/rigid_body.hpp>

#include <algorithm>
#include <limits>

namespace example {

/// Stops the point x [m] of a body from moving into a wall with the unit normal n, by an impulse at this point.
/// Friction slows its sliding along the wall by an impulse of at most `friction` times that along n.
template <class C, int D = C::D>
void stop_at(firn::RigidBody<C>& body, const firn::Vec<double, D>& x, const firn::Vec<double, D>& n, double friction) {
    const firn::Vec<double, D> arm = x - body.collider.position;
    const auto velocity = [&] { return body.velocity() + firn::skew(body.angular_velocity()) * arm; };
    // Changes the point's speed along a direction by `change`, but with an impulse of at most `most`.
    const auto change_speed = [&](const firn::Vec<double, D>& direction, double change, double most) {
        firn::RigidBody<C> pushed = body;
        pushed.momentum = direction;
        pushed.angular_momentum = axial_product(arm, direction);
        const auto per_impulse = pushed.velocity() + firn::skew(pushed.angular_velocity()) * arm;
        const double impulse = std::min(change / dot(per_impulse, direction), most);
        body.momentum += pushed.momentum * impulse;
        body.angular_momentum = body.angular_momentum + pushed.angular_momentum * impulse;
        return impulse;
    };
    const double towards = -dot(velocity(), n);
    if (!(towards > 0)) return;
    const double pressed = change_speed(n, towards, std::numeric_limits<double>::infinity());
    const auto now = velocity();
    const auto along = now - n * dot(now, n);
    if (const double speed = norm(along); speed > 0) change_speed(along * (-1 / speed), speed, friction * pressed);
    body.place_velocities();
}

}  // namespace example
