/// \file Refusing particles that no simulation can use, before the first step.
#pragma once

#include <firn/data/domain.hpp>

#include <cmath>
#include <cstddef>
#include <string>

namespace firn {

namespace detail {
template <class Position>
std::string point_text(std::size_t i, int dimension, const Position& position) {
    std::string text = "(";
    for (int a = 0; a < dimension; ++a) text += sentence(a ? ", " : "", double(position(i, a)));
    return text + ")";
}
}  // namespace detail

/// \param position  position(i, axis) [m]
/// \throws particle_error if there is no particle, or naming how many and the first few that are not finite or outside
template <std::floating_point S, int D, class Position>
void check_positions(std::size_t count, const Domain<D>& domain, const Position& position) {
    if (count == 0) throw particle_error("There are no particles. Add at least one before simulating.");
    if (count >= 0xffffffffu)
        throw particle_error(
            sentence("There are ", count, " particles; up to ", 0xfffffffeu, " are possible in one set."));
    std::size_t wrong = 0;
    std::string first;
    for (std::size_t i = 0; i < count; ++i) {
        bool inside = true;
        for (int a = 0; a < D; ++a)
            inside = inside && position(i, a) >= S(domain.lower[a]) && position(i, a) <= S(domain.upper[a]);
        if (inside) continue;
        if (++wrong <= 3) first += sentence(wrong > 1 ? ", " : "", i, " at ", detail::point_text(i, D, position));
    }
    if (wrong == 0) return;
    const auto lower = [&](std::size_t, int a) { return domain.lower[a]; };
    const auto upper = [&](std::size_t, int a) { return domain.upper[a]; };
    throw particle_error(sentence(wrong, " of ", count, " particles are not finite or lie outside the domain from ",
                                  detail::point_text(0, D, lower), " m to ", detail::point_text(0, D, upper),
                                  " m; the first: ", first, ". Move them inside, or enlarge the domain."));
}

}  // namespace firn
