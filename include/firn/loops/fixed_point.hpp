/// \file The scale (quanta per unit) of a fixed-point P2G. The scale is either computed, or given by the program and
/// checked.
#pragma once

#include <firn/core/error.hpp>
#include <firn/stage/fixed_point.hpp>

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

namespace firn::inline FIRN_BUILD {

namespace detail {
template <class S>
S chosen_scale(std::optional<double> given, S largest, const char* what, const char* unit) {
    if (!given) return largest;
    int exponent = 0;
    if (!(*given > 0) || !std::isfinite(*given) || std::frexp(*given, &exponent) != 0.5)
        throw parameter_error(sentence("The fixed-point scale of ", what, " is ", *given, " quanta per ", unit,
                                       "; it must be a power of two, or left out to be chosen."));
    if (*given > double(largest))
        throw overflow_error(sentence("With ", *given, " quanta per ", unit, " the sum of ", what,
                                      " at a node could exceed the range of the integers; at most ", largest,
                                      " are safe here. Give a smaller scale, leave it out, or use 64-bit integers."));
    return S(*given);
}

/// Checks that the largest possible sums at a node have enough quanta (integer steps) to be accurate. If particles are
/// very light, the sums can have too few quanta, because such particles need a larger scale (quanta per unit) than S
/// can represent. Too few quanta of momentum are accepted if one quantum changes the velocity of the heaviest particle
/// by a negligible amount (matter at rest).
/// \throws overflow_error  if the largest possible sum of mass or of momentum has too few quanta
template <class S>
void check_resolution(const FixedPointLoad<S>& load, const FixedPointBound<S>& bound, const FixedPointScale<S>& scale) {
    constexpr double fewest_quanta = 0x1p24, unseen_velocity = 1e-20;  // [m/s]
    const auto is_coarse = [](S most, S per_unit) {
        return most > 0 && double(most) * double(per_unit) < fewest_quanta;
    };
    const bool moves = 1 / (double(scale.momentum) * double(load.mass)) > unseen_velocity;
    if (is_coarse(bound.mass, scale.mass) || (is_coarse(bound.momentum, scale.momentum) && moves))
        throw overflow_error(
            sentence("Particles of at most ", load.mass, " kg and ", load.momentum,
                     " kg m/s are too light for fixed-point sums in ", sizeof(S) == 4 ? "float" : "double",
                     ", which has no scale above ", scale.momentum, " quanta. Use ",
                     sizeof(S) == 4 ? "double, Coloured, " : "Coloured ", "or units in which masses are larger."));
}
}  // namespace detail

/// Returns the two scales of fixed-point sums, in quanta (integer steps) per unit of momentum and of mass. Each scale
/// is the one that the program has given, or, if none is given, the largest with which no sum can overflow.
/// \param momentum  given scale of momentum [quanta per kg m/s];  \param mass  given scale of mass [quanta per kg]
/// \tparam Integer  std::int32_t or std::int64_t
/// \throws parameter_error  if a given scale is not a power of two
/// \throws overflow_error   if a sum could overflow with the given scale; if a sum could overflow with every scale; or
///                          if a sum has too few quanta even with the largest scale that S can represent (2^120 quanta
///                          per unit in float)
template <class Kernel, int D, class Integer, std::floating_point S>
FixedPointScale<S> fixed_point_scale(const FixedPointLoad<S>& load, std::optional<double> momentum,
                                     std::optional<double> mass) {
    constexpr double integer_max = double(std::numeric_limits<Integer>::max() >> (sizeof(Integer) == 8 ? 1 : 0));
    const FixedPointBound<S> bound = fixed_point_bound<Kernel, D>(load);
    if (!std::isfinite(bound.momentum) || !std::isfinite(bound.mass))
        throw overflow_error(sentence(
            "The mass or the momentum that a node can receive is not finite (the largest of a particle: ", load.mass,
            " kg, ", load.momentum,
            " kg m/s, its stress included). The simulation has blown up: reduce the time step, or look at the "
            "initial state."));
    if (double(bound.contributions) >= integer_max / 2)
        throw overflow_error(sentence("Up to ", bound.contributions,
                                      " particles may add to one node: too many for integers of ", 8 * sizeof(Integer),
                                      " bits. Use smaller cells, fewer particles a cell or 64-bit integers."));
    const FixedPointScale<S> largest = largest_scale(bound, integer_max);
    detail::check_resolution(load, bound, largest);
    return {detail::chosen_scale(momentum, largest.momentum, "momentum", "kg m/s"),
            detail::chosen_scale(mass, largest.mass, "mass", "kg")};
}

}  // namespace firn::inline FIRN_BUILD
