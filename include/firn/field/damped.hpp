/// \file Viscous damping in proportion to mass: a field that slows matter down.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/names.hpp>
#include <firn/field/gravity.hpp>

#include <cmath>

namespace firn {

namespace detail {
struct named_damped {
    static constexpr const char* name = "damped";
};
}  // namespace detail

/// dv/dt = f(x) − c v, implicit in v: (f − c v) / (1 + c dt). A node's velocity falls by the factor 1 / (1 + c dt) a
/// step where f is zero, and to f/c in time; no rate is too large for the step.
/// It takes its part of what a step gives to nodes at a boundary, too: Reactions are smaller by that. What a floor
/// bears is read from a step of rate 0.
/// \tparam Field  what else accelerates: a field that is called with a position
template <scalar S, int D, template <class, int> class Field = Gravity>
struct Damped {
    Field<S, D> field{};
    S rate = S(0);  ///< c [1/s]

    template <class T>
    using with_scalar = Damped<T, D, Field>;

    static constexpr const char* name = detail::joined_names<detail::named_damped, Field<S, D>>::text;
    static constexpr auto parameters() {
        return std::tuple{parameter{"field", "", &Damped::field}, parameter{"rate", "1/s", &Damped::rate}};
    }

    /// \throws parameter_error unless the rate is finite and not negative
    void check() const
        requires std::floating_point<S>
    {
        if (!(rate >= 0) || !std::isfinite(rate))
            throw parameter_error(
                sentence("The rate of damping is ", rate, " /s; it must be finite and not negative."));
    }
    /// Once a step, before any node is touched. \throws parameter_error, as check()
    template <class T>
    with_scalar<T> lifted() const {
        if constexpr (std::floating_point<S>) check();
        return {lift<T>(field), T(rate)};
    }

    FIRN_INLINE Vec<S, D> operator()(const Vec<S, D>& x, const Vec<S, D>& v, const S& dt) const {
        return (field(x) - v * rate) * (S(1) / (S(1) + rate * dt));
    }
};

}  // namespace firn
