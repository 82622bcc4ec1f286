/// \file Reactions of the boundary as a measure sees them, and the derivatives of measures by them.
#pragma once

#include <firn/adjoint/inputs.hpp>
#include <firn/loops/reactions.hpp>

#include <vector>

namespace firn::inline FIRN_BUILD {

/// What a part of the boundary exerts on matter in a step, as a measure sees it. Matter exerts the opposite.
/// \tparam T  a scalar: double, or one with derivatives
template <class T, int D>
struct MeasuredReaction {
    Vec<T, D> impulse;            ///< Σ m Δv [N s]; the mean force of the step is impulse / dt
    Axial<T, D> angular_impulse;  ///< Σ (x − about) × m Δv [N m s]
};

namespace detail {

/// Returns a reaction as a measure sees it. \param number  number(x) makes a number of the measure's scalar from x
template <class T, int D, class Number>
MeasuredReaction<T, D> measured_reaction(const Reaction<D>& from, const Number& number) {
    MeasuredReaction<T, D> to;
    for (int a = 0; a < D; ++a) to.impulse[a] = number(from.impulse[a]);
    if constexpr (D == 2)
        to.angular_impulse = number(from.angular_impulse);
    else
        for (int a = 0; a < D; ++a) to.angular_impulse[a] = number(from.angular_impulse[a]);
    return to;
}

/// Returns the derivatives of f, which takes a MeasuredReaction, by the impulses of a reaction.
template <int D, class F>
Reaction<D> derivative_by(const Reaction<D>& reaction, const F& f) {
    using T = traced<double>;
    Tape<double>& tape = Tape<double>::mine();
    tape.cut(1);
    std::vector<T> numbers;
    const T result = f(measured_reaction<T>(reaction, [&](double x) { return numbers.emplace_back(T::input(x)); }));
    tape.begin();
    seed(result, 1.0);
    tape.back();
    Reaction<D> derivative{reaction.about, {}, {}};
    std::size_t next = 0;
    for_impulses(derivative, [&](double& of_impulse) { of_impulse = adjoint_of(numbers[next++]); });
    return derivative;
}

/// Returns the derivative of a measure by the impulse on matter at some nodes, from its derivatives by a reaction.
/// \param x  positions of the nodes [m];  \param corner  the point from which they are measured [m]
template <class P, int D>
FIRN_INLINE Vec<P, D> by_impulse(const Reaction<D>& derivative, const Vec<P, D>& x, const Vec<double, D>& corner) {
    using S = value_type_t<P>;
    const Vec<P, D> arm = x + cast<P>(cast<S>(corner - derivative.about));
    return cast<P>(cast<S>(derivative.impulse)) +
           skew(cast_axial<P, D>(cast_axial<S, D>(derivative.angular_impulse))) * arm;
}

}  // namespace detail
}  // namespace firn::inline FIRN_BUILD
