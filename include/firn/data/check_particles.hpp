/// \file Checks, before the first step, that particles lie in the domain and have a mass.
#pragma once

#include <firn/data/domain.hpp>
#include <firn/data/field.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace firn {

namespace detail {
template <class Position>
std::string point_text(std::size_t i, int dimension, const Position& position) {
    double x[3];
    for (int a = 0; a < dimension; ++a) x[a] = double(position(i, a));
    return point_text(x, dimension);
}
}  // namespace detail

/// Checks that all particles lie in the domain.
/// \param count     number of indices i to check, including those of padding
/// \param position  position(i, axis) is a coordinate [m] of particle i
/// \param id_of     id_of(i) is the id of particle i, or no_particle if i is padding
/// \throws particle_error  if `count` is 0 or above 2³² − 2, or if a position is not finite or outside the domain; the
///                         message tells how many such positions there are, and names the three particles with the
///                         lowest ids
template <std::floating_point S, int D, class Position, class IdOf>
void check_positions(std::size_t count, const Domain<D>& domain, const Position& position, const IdOf& id_of) {
    if (count == 0) throw particle_error("There are no particles. Add at least one before simulating.");
    if (count >= 0xffffffffu)
        throw particle_error(
            sentence("There are ", count, " particles; up to ", 0xfffffffeu, " are possible in one set."));
    std::size_t particles = 0;
    std::vector<std::pair<std::uint32_t, std::size_t>> wrong;  // (id, index) of each particle outside
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t id = id_of(i);
        if (id == no_particle) continue;
        ++particles;
        bool inside = true;
        for (int a = 0; a < D; ++a) {
            const auto x = position(i, a);
            inside = inside && x >= S(domain.lower[a]) && x <= S(domain.upper[a]);
        }
        if (!inside) wrong.emplace_back(id, i);
    }
    if (wrong.empty()) return;
    std::string first;
    const auto few = wrong.begin() + std::ptrdiff_t(std::min<std::size_t>(wrong.size(), 3));
    std::partial_sort(wrong.begin(), few, wrong.end());
    for (auto one = wrong.begin(); one != few; ++one)
        first += sentence(first.empty() ? "" : ", ", one->first, " at ", detail::point_text(one->second, D, position));
    const auto lower = [&](std::size_t, int a) { return domain.lower[a]; };
    const auto upper = [&](std::size_t, int a) { return domain.upper[a]; };
    throw particle_error(sentence(wrong.size(), " of ", particles,
                                  " particles are not finite or lie outside the domain from ",
                                  detail::point_text(0, D, lower), " m to ", detail::point_text(0, D, upper),
                                  " m; the first: ", first, ". Move them inside, or enlarge the domain."));
}
/// Checks that all particles lie in the domain. The id of a particle is its index.
/// \param count     number of particles
/// \param position  position(i, axis) is a coordinate [m] of particle i
/// \throws particle_error  if `count` is 0 or above 2³² − 2, or if a position is not finite or outside the domain; the
///                         message tells how many such positions there are, and names the first three particles
template <std::floating_point S, int D, class Position>
void check_positions(std::size_t count, const Domain<D>& domain, const Position& position) {
    check_positions<S, D>(count, domain, position, [](std::size_t i) { return std::uint32_t(i); });
}

/// Checks that all masses are positive and finite.
/// \param count  number of particles
/// \param mass   mass(i) is the mass [kg] of particle i
/// \throws particle_error  if a mass is not positive or not finite; the message tells how many such masses there are,
///                         and names the first three particles
template <std::floating_point S, class Mass>
void check_masses(std::size_t count, const Mass& mass) {
    std::size_t wrong = 0;
    std::string first;
    for (std::size_t i = 0; i < count; ++i) {
        const S m = mass(i);
        if (m > 0 && m <= std::numeric_limits<S>::max()) continue;
        if (++wrong <= 3) first += sentence(wrong > 1 ? ", " : "", i, " of ", double(m), " kg");
    }
    if (wrong > 0)
        throw particle_error(sentence(wrong, " of ", count,
                                      " particles have no mass that is positive and finite; the "
                                      "first: ",
                                      first, ". Give each a mass, or take it out."));
}

}  // namespace firn
