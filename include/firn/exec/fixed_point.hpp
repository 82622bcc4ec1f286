/// \file The scale that a fixed-point P2G uses: chosen, or given and checked.
#pragma once

#include <firn/core/error.hpp>
#include <firn/stage/fixed_point.hpp>

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

namespace firn {

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
}  // namespace detail

/// \throws overflow_error  if no scale, or not the given one, keeps every sum in range
template <class Kernel, int D, class Integer, std::floating_point S>
FixedPointScale<S> fixed_point_scale(const FixedPointLoad<S>& load, std::optional<double> momentum,
                                     std::optional<double> mass) {
    constexpr double integer_max = double(std::numeric_limits<Integer>::max() >> (sizeof(Integer) == 8 ? 1 : 0));
    const FixedPointBound<S> bound = fixed_point_bound<Kernel, D>(load);
    if (!std::isfinite(bound.momentum) || !std::isfinite(bound.mass))
        throw overflow_error(sentence(
            "The mass or the momentum that a node may receive is not finite (the largest that a particle has: ",
            load.mass, " kg, ", load.momentum,
            " kg m/s, its stress included). The simulation has blown up: reduce the time step, or look at the "
            "initial state."));
    if (double(bound.contributions) >= integer_max / 2)
        throw overflow_error(sentence("Up to ", bound.contributions,
                                      " particles may add to one node: too many for integers of ", 8 * sizeof(Integer),
                                      " bits. Use smaller cells, fewer particles a cell or 64-bit integers."));
    const FixedPointScale<S> largest = largest_scale(bound, integer_max);
    return {detail::chosen_scale(momentum, largest.momentum, "momentum", "kg m/s"),
            detail::chosen_scale(mass, largest.mass, "mass", "kg")};
}

}  // namespace firn
