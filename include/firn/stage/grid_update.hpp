/// \file The grid update of one node, between P2G and G2P: momentum becomes velocity, forces act, the boundary applies.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/core/parameters.hpp>
#include <firn/core/tensor.hpp>

#include <concepts>
#include <limits>
#include <tuple>

namespace firn::inline FIRN_BUILD {

namespace detail {
/// Converts the acceleration to firn's Vec if it is a constant vector of another library. Returns any other
/// acceleration unchanged.
template <int D, class Acceleration>
decltype(auto) own_acceleration(const Acceleration& acceleration) {
    if constexpr (holds_numbers<Acceleration, D, 1>)
        return Vec<double, D>(acceleration);
    else
        return (acceleration);
}
}  // namespace detail

/// Returns the acceleration of a node [m/s²].
/// \param field     a constant vector [m/s²]; or a callable field(position) or field(position, velocity, dt), for any
///                  scalar type
/// \param position  position of the node [m];  \param velocity  velocity of the node before the step [m/s]
/// \param dt        time step [s]
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

namespace detail {
/// The dimension of a vector; 0 for every other type.
template <class T>
inline constexpr int dimension_of_vector = 0;
template <class S, int D>
inline constexpr int dimension_of_vector<Vec<S, D>> = D;

/// Whether a Field can be called with these arguments, and returns an acceleration.
template <class Field, class V, class... Arguments>
concept returns_acceleration =
    takes<Field, Arguments...> && std::convertible_to<typename call_result<Field, Arguments...>::type, V>;

/// Whether an acceleration is a vector, of firn or of another library, and not a field.
template <class Acceleration, int D>
inline constexpr bool is_vector_acceleration =
    dimension_of_vector<Acceleration> > 0 || holds_numbers<Acceleration, D, 1>;

/// Returns true if an acceleration can act on nodes in D dimensions. If it cannot, the compilation stops with a
/// message.
/// \tparam P  the scalar type in which nodes are computed
template <class Acceleration, class P, int D>
consteval bool require_acceleration() {
    constexpr int of_vector = dimension_of_vector<Acceleration>;
    static_assert(of_vector == 0 || of_vector == D,
                  "firn: this acceleration has another dimension than the simulation and the grid.");
    using V = Vec<P, D>;
    using Field = with_scalar_t<Acceleration, P>;
    constexpr bool is_vector = is_vector_acceleration<Acceleration, D>;
    constexpr bool is_field = [] {
        if constexpr (is_vector)  // Eigen's vectors can be called, too
            return false;
        else if constexpr (takes<Field, V, V, P>)
            return returns_acceleration<Field, V, V, V, P>;
        else
            return returns_acceleration<Field, V, V>;
    }();
    static_assert(
        is_vector || is_field,
        "firn: an acceleration is a vector [m/s^2], a field such as firn::Gravity<float, 2>, or a function that firn "
        "calls with many nodes at once, for every scalar type: [](const auto& x) { … } or []<class P>(const "
        "firn::Vec<P, 2>& x) { return firn::Vec<P, 2>{…}; }, or the same with (x, v, dt). This one is of another "
        "dimension, or takes or returns another type, such as Vec<double, 2> or a number.");
    return is_field || (is_vector && (of_vector == 0 || of_vector == D));
}
}  // namespace detail

/// An acceleration field of a program's own, for positions that are measured from a corner: it gets the positions that
/// it knows.
template <class Field, int D>
struct FieldInMetres {
    Field field;            ///< the field
    Vec<double, D> corner;  ///< the position that positions are measured from [m]

    /// The type of this field with scalar type T.
    template <class T>
    using with_scalar = FieldInMetres<with_scalar_t<Field, T>, D>;

    static constexpr const char* name = [] {
        if constexpr (requires { Field::name; })
            return Field::name;
        else
            return "own_field";
    }();
    static constexpr auto parameters()
        requires has_parameters<Field>
    {
        return std::tuple{parameter{"own", "", &FieldInMetres::field}};
    }
    /// Returns the field converted to scalar type T.
    template <class T>
    with_scalar<T> lifted() const {
        return {lift<T>(field), corner};
    }

    /// Returns the acceleration [m/s²] at a position [m], measured from the corner.
    /// @{
    template <class S>
        requires detail::takes<Field, Vec<S, D>>
    FIRN_INLINE Vec<S, D> operator()(const Vec<S, D>& x) const {
        return detail::call(field, x + cast<S>(corner));
    }
    template <class S>
        requires detail::takes<Field, Vec<S, D>, Vec<S, D>, S>
    FIRN_INLINE Vec<S, D> operator()(const Vec<S, D>& x, const Vec<S, D>& v, const S& dt) const {
        return detail::call(field, x + cast<S>(corner), v, dt);
    }
    /// @}
};

namespace detail {
/// Whether an acceleration field gets positions in metres.
template <class Field>
inline constexpr bool is_field_in_metres = false;
template <class Field, int D>
inline constexpr bool is_field_in_metres<FieldInMetres<Field, D>> = true;
}  // namespace detail

/// Returns the square of the acceleration of a field that limits the time step [m²/s⁴]: that of matter at rest, or that
/// at its velocity if this is smaller. So a drag or a brake, which is strong only until it has acted, limits nothing.
/// \param field  as for acceleration_at
template <scalar S, int D, class Field>
FIRN_INLINE S squared_acceleration(const Field& field, const Vec<S, D>& position, const Vec<S, D>& velocity,
                                   const S& dt) {
    const Vec<S, D> at_rest = acceleration_at(field, position, Vec<S, D>::zero(), dt);
    S squared = dot(at_rest, at_rest);
    if constexpr (detail::takes<Field, Vec<S, D>, Vec<S, D>, S>) {
        const Vec<S, D> moving = acceleration_at(field, position, velocity, dt);
        squared = min(squared, dot(moving, moving));
    }
    return squared;
}

/// Returns the velocity of a node after a step: momentum divided by mass, plus acceleration times dt, then changed by
/// the boundary.
///
/// The velocity is zero for a node without mass, and for a node whose mass is below the smallest normal floating-point
/// number, because 1 / mass would not be finite. The acceleration is added to the velocity and not to the momentum,
/// because this is more accurate for nodes with very little mass.
/// \param momentum  momentum of the node [kg m/s];  \param mass  mass of the node [kg]
/// \param position  position of the node [m];  \param dt  time step [s]
/// \param acceleration  a vector or a field. \see acceleration_at
/// \param boundary      a boundary policy
template <scalar S, int D, class Acceleration = Vec<S, D>, class Boundary>
FIRN_INLINE Vec<S, D> node_velocity(const Vec<S, D>& momentum, const S& mass, const Vec<S, D>& position,
                                    const Acceleration& acceleration, const S& dt, const Boundary& boundary) {
    const auto filled = mass >= S(std::numeric_limits<value_type_t<S>>::min());
    const S positive = select(filled, mass, S(1));
    const S per_mass = named("per_mass", S(1) / positive);
    const Vec<S, D> before = momentum * per_mass;
    const Vec<S, D> v = before + acceleration_at(acceleration, position, before, dt) * dt;
    return select(filled, velocity_after(boundary, position, v, NodeInertia<S>{positive, dt}), Vec<S, D>::zero());
}

/// A boundary without effect, for nodes that no wall or collider affects, and for passes in which no boundary acts.
struct NoBoundary {
    static constexpr const char* name = "no_boundary";

    /// Returns this boundary.
    template <int D>
    NoBoundary measured_from(const Vec<double, D>&) const {
        return {};
    }
    /// Returns the velocity v unchanged.
    template <class S, int D>
    FIRN_INLINE Vec<S, D> velocity(const Vec<S, D>&, const Vec<S, D>& v) const {
        return v;
    }
    /// Returns false: this boundary affects no nodes in any box.
    template <int D>
    bool reaches(const Vec<double, D>&, const Vec<double, D>&) const {
        return false;
    }
    /// Does nothing: this boundary has no surface.
    template <class S, int D, class Seen>
    FIRN_INLINE void surfaces(const Vec<S, D>&, const Seen&) const {}
};

}  // namespace firn::inline FIRN_BUILD
