/// \file What happens to one node between P2G and G2P.
#pragma once

#include <firn/core/tensor.hpp>

#include <limits>

namespace firn {

namespace detail {
/// A constant vector of another library as firn's; all else as it is.
template <int D, class Acceleration>
decltype(auto) own_acceleration(const Acceleration& acceleration) {
    if constexpr (holds_numbers<Acceleration, D, 1>)
        return Vec<double, D>(acceleration);
    else
        return (acceleration);
}
}  // namespace detail

/// The acceleration of a node: a constant vector; a field f(position), written for any scalar; or a field
/// f(position, velocity, dt), which is given the velocity before.
template <scalar S, int D, class Field>
FIRN_INLINE Vec<S, D> acceleration_at(const Field& field, const Vec<S, D>& position, const Vec<S, D>& velocity,
                                      const S& dt) {
    using V = Vec<S, D>;
    if constexpr (detail::takes<Field, V, V, S>)
        return detail::call(field, position, velocity, dt);
    else if constexpr (detail::takes<Field, V>)
        return detail::call(field, position);
    else
        return cast<S>(field);
}

/// The new velocity of a node: momentum over mass, accelerated for dt, then the boundary.
/// A node without mass has no velocity: zero. Neither has one whose mass is not a normal number: its inverse would not
/// be finite. (A force per mass [m/s²] is added to the velocity, not to the momentum: for nodes with very little mass
/// that is the more accurate order.)
/// \param acceleration  as acceleration_at() takes it
template <scalar S, int D, class Acceleration = Vec<S, D>, class Boundary>
FIRN_INLINE Vec<S, D> node_velocity(const Vec<S, D>& momentum, const S& mass, const Vec<S, D>& position,
                                    const Acceleration& acceleration, const S& dt, const Boundary& boundary) {
    const auto filled = mass >= S(std::numeric_limits<value_type_t<S>>::min());
    const S per_mass = named("per_mass", S(1) / select(filled, mass, S(1)));
    const Vec<S, D> before = momentum * per_mass;
    const Vec<S, D> v = before + acceleration_at(acceleration, position, before, dt) * dt;
    return select(filled, detail::in_own_terms(boundary.velocity(position, v)), Vec<S, D>::zero());
}

/// For nodes that no boundary reaches, and for passes in which none acts.
struct NoBoundary {
    static constexpr const char* name = "no_boundary";

    template <class S, int D>
    FIRN_INLINE Vec<S, D> velocity(const Vec<S, D>&, const Vec<S, D>& v) const {
        return v;
    }
    template <int D>
    bool reaches(const Vec<double, D>&, const Vec<double, D>&) const {
        return false;
    }
    template <class S, int D, class Seen>
    FIRN_INLINE void surfaces(const Vec<S, D>&, const Seen&) const {}
};

}  // namespace firn
