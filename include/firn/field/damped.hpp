/// \file An acceleration field that adds viscous damping, in proportion to mass, to another acceleration field.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/names.hpp>
#include <firn/field/gravity.hpp>

#include <cmath>

namespace firn::inline FIRN_BUILD {

namespace detail {
struct named_damped {
    static constexpr const char* name = "damped";
};
}  // namespace detail

/// An acceleration field that adds viscous damping, in proportion to mass, to another acceleration field.
///
///     dv/dt = f(x) − c v       computed as the acceleration (f − c v) / (1 + c dt)       [m/s²]
///
/// f is the other acceleration field, v a node's velocity, c the rate of damping, dt the time step. The damping is
/// implicit in v, so it does not limit the time step. Where f is zero, a node's velocity is multiplied by 1 / (1 + c
/// dt) in each step; elsewhere the velocity tends to f/c. Use Damped to bring matter to rest, for example under
/// gravity, or as a crude drag.
///
/// Damping also acts on nodes at a boundary, so the forces that Simulation::reactions returns are smaller by the force
/// of the damping. To measure the load on a floor, make one step with rate 0.
///
/// A step that is given an acceleration takes it in place of Simulation::gravity. So give Damped the gravity, too:
/// Damped<float, 2>{.field = {{0, -9.81F}}, .rate = 10}. Without it nothing falls, and the simulation warns once.
/// \tparam Field  the type of the other acceleration field, which is called with a position only
template <scalar S, int D, template <class, int> class Field = Gravity>
struct Damped {
    Field<S, D> field{};  ///< f: the acceleration field to which damping is added
    S rate = S(0);        ///< c: rate of damping [1/s]

    /// The type of this field with scalar type T.
    template <class T>
    using with_scalar = Damped<T, D, Field>;

    static constexpr const char* name = detail::joined_names<detail::named_damped, Field<S, D>>::text;
    static constexpr auto parameters() {
        return std::tuple{parameter{"field", "", &Damped::field}, parameter{"rate", "1/s", &Damped::rate}};
    }

    /// Checks the rate. Also checks the other acceleration field, if that field has a check().
    /// \throws parameter_error unless the rate is finite and not negative; or if field.check() throws it
    void check() const
        requires std::floating_point<S>
    {
        if (!(rate >= 0) || !std::isfinite(rate))
            throw parameter_error(
                sentence("The rate of damping is ", rate, " /s; it must be finite and not negative."));
        if constexpr (requires { field.check(); }) field.check();
    }
    /// Returns the field converted to scalar type T. A simulation calls this function once per step, before any node
    /// changes.
    /// \throws parameter_error if check() throws it
    template <class T>
    with_scalar<T> lifted() const {
        if constexpr (std::floating_point<S>) check();
        return {lift<T>(field), T(rate)};
    }

    /// Returns the field for positions that are measured from `corner` [m].
    Damped measured_from(const Vec<double, D>& corner) const
        requires requires(const Field<S, D> f) { f.measured_from(corner); }
    {
        return {field.measured_from(corner), rate};
    }

    /// Returns the acceleration [m/s²] at position x [m] of a node with velocity v [m/s], for a time step dt [s].
    FIRN_INLINE Vec<S, D> operator()(const Vec<S, D>& x, const Vec<S, D>& v, const S& dt) const {
        return (field(x) - v * rate) * (S(1) / (S(1) + rate * dt));
    }
};

}  // namespace firn::inline FIRN_BUILD
