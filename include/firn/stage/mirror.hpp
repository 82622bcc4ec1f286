/// \file Walls of full order: what happens at the nodes beside a wall after the grid update.
///
/// The nodes of the grid lie on the wall, and before and behind it. A column consists of three of them: one behind the
/// wall, one on it, one in front of it. Matter in front of the wall gives momentum to the node behind the wall, too.
/// This momentum is folded onto the node's mirror image in front of the wall; afterwards the node behind the wall gets
/// the mirror image of the velocity in front of it. So matter moves as if its mirror image stood behind the wall.
///
/// In terms of a finite-element method, the velocities of the nodes are restricted to fields that are symmetric (slip)
/// or antisymmetric (stick) about the wall, with lumped masses. So energy and the momentum along the wall are kept.
#pragma once

#include <firn/boundary/contact.hpp>
#include <firn/kernel/concept.hpp>

#include <limits>

namespace firn::inline FIRN_BUILD {

/// The weights that the nodes of a column have at the surface of the wall, where the column's middle node lies.
template <class S>
struct SurfaceWeights {
    S on,        ///< the weight of the node on the wall [1]
        beside;  ///< the sum of the weights of the nodes before and behind the wall [1]
};

/// Returns the weights at a point that coincides with a node: of this node, and of its two neighbours together.
template <class Kernel, scalar S>
FIRN_INLINE SurfaceWeights<S> surface_weights() {
    // The base node of a point on a node lies `centre_node` nodes below.
    const auto weights = Kernel::weights(S(double(centre_node<Kernel>)));
    const S on = weights[std::size_t(centre_node<Kernel>)];
    return {on, S(1) - on};
}

/// Three nodes in a line across a wall, behind it, on it and in front of it, after the grid update.
template <scalar S, int D>
struct NodeColumn {
    Vec<S, D> behind;  ///< velocity of the node behind the wall [m/s]
    Vec<S, D> on;      ///< velocity of the node on the wall [m/s]
    Vec<S, D> front;   ///< velocity of the node in front of the wall [m/s]
    S mass_behind;     ///< mass of the node behind the wall [kg]; 0 for a node without matter
    S mass_on;         ///< mass of the node on the wall [kg]; 0 for a node without matter
    S mass_front;      ///< mass of the node in front of the wall [kg]; 0 for a node without matter
};

/// Returns 1 / mass; 0 for a node without matter. \see node_velocity
template <scalar S>
FIRN_INLINE S inverse_mass(const S& mass) {
    const auto filled = mass >= S(std::numeric_limits<value_type_t<S>>::min());
    return select(filled, S(1) / select(filled, mass, S(1)), S(0));
}

/// Returns the impulse that a wall without friction would take from a column to make its normal velocity odd [N s]:
/// positive if the wall pushes. \see mirrored
/// \param direction  1 if the domain's matter lies above the wall along the axis, −1 if it lies below
/// \param per_mass   1/(m₊ + m₋) [1/kg]
template <scalar S, int D>
FIRN_INLINE S push_of_wall(const NodeColumn<S, D>& column, int axis, const S& direction, const S& per_mass) {
    return named("pushed", -direction * (column.mass_on * column.on.v[axis] +
                                         S(2) * column.mass_front * column.mass_behind * per_mass *
                                             (column.front.v[axis] + column.behind.v[axis])));
}

/// Returns the nodes of a column after a wall has acted on them.
///
/// m and v are the mass and a velocity component of a node; + marks the node in front of the wall, 0 the node on it,
/// − the node behind it. A component that is even about the wall becomes (m₊v₊ + m₋v₋)/(m₊ + m₋) in front of the wall
/// and behind it; a component that is odd becomes (m₊v₊ − m₋v₋)/(m₊ + m₋) in front of the wall, 0 on it, and the
/// opposite behind it. All components are odd at a wall with Contact::stick. At other walls the normal component is
/// odd, and the others are even.
///
/// This takes the impulse p = −(m₀v₀ + 2 m₊m₋(v₊ + v₋)/(m₊ + m₋)) from the wall, with the normal components v.
/// A wall with Contact::separate acts like this only if it pushes (p > 0). Otherwise matter is free to leave: the nodes
/// on and behind the wall only lose the part of their velocity that points into the wall, with friction.
///
/// Friction is an impulse q along the wall, at the surface: the node with weight w there gets the part w q. q is the
/// smaller one of μ p and the impulse that stops the surface, w₀v₀ + w₊v₊ = 0. This impulse never adds energy.
///
/// After the call, the nodes before and behind the wall both have the mass m₊ + m₋, unless matter leaves the wall.
/// \param axis      the axis across the wall
/// \param inward    1 if the domain's matter lies above the wall along the axis, −1 if it lies below
/// \param friction  Coulomb's friction coefficient μ [1]
/// \param weights   \see surface_weights
template <scalar S, int D>
FIRN_INLINE NodeColumn<S, D> mirrored(const NodeColumn<S, D>& column, int axis, int inward, Contact contact,
                                      const S& friction, const SurfaceWeights<S>& weights) {
    if (contact == Contact::none) return column;
    const S mass = named("mass_of_pair", column.mass_front + column.mass_behind);
    const S per_mass = named("per_mass_of_pair", inverse_mass(mass));
    const Vec<S, D> front = column.front * column.mass_front, behind = column.behind * column.mass_behind;
    const Vec<S, D> even = (front + behind) * per_mass, odd = (front - behind) * per_mass;
    NodeColumn<S, D> after{-odd, Vec<S, D>::zero(), odd, mass, column.mass_on, mass};
    if (contact == Contact::stick) return after;

    const S direction = S(double(inward));
    const S pushed = push_of_wall(column, axis, direction, per_mass);
    // Friction: the velocity of the surface, and what an impulse of 1 N s changes it by.
    Vec<S, D> on = column.on, beside = even;
    on.v[axis] = beside.v[axis] = S(0);
    const S per_mass_on = named("per_mass_on", inverse_mass(column.mass_on));
    const S moves_on = weights.on * per_mass_on, moves_beside = weights.beside * per_mass;
    const Vec<S, D> surface = on * weights.on + beside * weights.beside;
    const S speed = named("surface_speed", sqrt(max(dot(surface, surface), S(detail::least_square))));
    const S yields = named("yields", weights.on * moves_on + weights.beside * moves_beside);
    const auto moves = yields > S(0);
    const S stops = select(moves, speed / select(moves, yields, S(1)), S(0));
    const S impulse = named("friction_per_speed", min(friction * max(pushed, S(0)), stops) / speed);
    on = on - surface * (impulse * moves_on);
    beside = beside - surface * (impulse * moves_beside);

    after.on = on;
    after.front = after.behind = beside;
    after.front.v[axis] = odd.v[axis];
    after.behind.v[axis] = -odd.v[axis];
    if (contact == Contact::slip) return after;

    const auto pushes = pushed > S(0);
    Vec<S, D> normal = Vec<S, D>::zero();
    normal.v[axis] = direction;
    const auto leaving = [&](const Vec<S, D>& v)
                             FIRN_LAMBDA { return velocity_after_contact(v, normal, Contact::separate, friction); };
    return {select(pushes, after.behind, leaving(column.behind)),
            select(pushes, after.on, leaving(column.on)),
            select(pushes, after.front, column.front),
            select(pushes, mass, column.mass_behind),
            column.mass_on,
            select(pushes, mass, column.mass_front)};
}

/// Stands for the closing speed where a wall does not act: matter is out of its reach, or there is none.
inline constexpr double never_closing = 1e20;
/// Stands for the closing speed of matter that touches a wall which holds it (`slip`, `stick`): the wall acts whether
/// it pushes or pulls.
inline constexpr double held_by_wall = -1;

namespace detail {
/// Returns whether a wall may act on matter with this closing speed.
template <scalar S>
FIRN_INLINE auto is_in_reach(const S& closing) {
    return closing < S(0.5 * never_closing);
}
/// Returns whether a wall holds matter with this closing speed.
template <scalar S>
FIRN_INLINE auto is_held(const S& closing) {
    return closing < S(0);
}
}  // namespace detail

/// Returns the nodes of a column after a wall has acted that matter may approach: it meets its own mirror image.
///
/// With the gap g between matter and the wall, and u = g/dt, the wall acts on velocities that are larger by u along its
/// normal, for `separate`. If the wall does not push, the nodes are unchanged, to the bit.
/// \param closing  u ≥ 0 [m/s], held_by_wall or never_closing
template <scalar S, int D>
FIRN_INLINE NodeColumn<S, D> mirrored_by_gap(const NodeColumn<S, D>& column, int axis, int inward, Contact contact,
                                             const S& friction, const SurfaceWeights<S>& weights, const S& closing) {
    const auto reached = detail::is_in_reach(closing);
    const S direction = S(double(inward));
    const S shift = select(reached, max(closing, S(0)), S(0)) * direction;
    NodeColumn<S, D> shifted = column;
    for (Vec<S, D>* v : {&shifted.behind, &shifted.on, &shifted.front}) v->v[axis] = v->v[axis] + shift;
    const S per_mass = inverse_mass(column.mass_front + column.mass_behind);
    const auto acts = reached & (push_of_wall(shifted, axis, direction, per_mass) > S(0));
    NodeColumn<S, D> after = mirrored(shifted, axis, inward, Contact::separate, friction, weights);
    for (Vec<S, D>* v : {&after.behind, &after.on, &after.front}) v->v[axis] = v->v[axis] - shift;
    const auto choose = [](const auto& which, const NodeColumn<S, D>& a, const NodeColumn<S, D>& b) FIRN_LAMBDA {
        return NodeColumn<S, D>{select(which, a.behind, b.behind),   select(which, a.on, b.on),
                                select(which, a.front, b.front),     select(which, a.mass_behind, b.mass_behind),
                                select(which, a.mass_on, b.mass_on), select(which, a.mass_front, b.mass_front)};
    };
    after = choose(acts, after, column);
    if (!holds(contact)) return after;
    return choose(detail::is_held(closing), mirrored(column, axis, inward, contact, friction, weights), after);
}

}  // namespace firn::inline FIRN_BUILD
