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

namespace firn::inline FIRN_BUILD {

namespace detail {
/// Returns how far a point lies outside of the domain, if the digits of its coordinates in a message would not show it:
/// " (1.5e-12 m outside along axis 0)"; else an empty text.
template <int D>
std::string slightly_outside_text(const Domain<D>& domain, const Vec<double, D>& x) {
    std::string text;
    for (int a = 0; a < D; ++a) {
        const double outside = std::fmax(domain.lower[a] - x[a], x[a] - domain.upper[a]);
        const double farther = std::fmax(std::abs(domain.lower[a]), std::abs(domain.upper[a]));
        if (outside > 0 && outside < 1e-6 * farther)
            text += sentence(text.empty() ? " (" : ", ", rounded_text(outside, 3), " m outside along axis ", a);
    }
    return text.empty() ? text : text + ")";
}
}  // namespace detail

/// Checks that all particles lie in the domain.
/// \tparam Rounding  float or double: positions may lie outside by rounding_at_faces<Rounding>(); void: not at all
/// \param count     number of indices i to check, including those of padding
/// \param position  position(i, axis) is a coordinate [m] of particle i
/// \param id_of     id_of(i) is the id of particle i, or no_particle if i is padding
/// \throws particle_error  if `count` is 0 or above 2³² − 2, or if a position is not finite or outside the domain; the
///                         message tells how many such positions there are, and names the three particles with the
///                         lowest ids
template <std::floating_point S, int D, class Rounding = void, class Position, class IdOf>
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
            auto x = position(i, a);
            if constexpr (std::floating_point<Rounding>)
                if (!(x >= S(domain.lower[a]) && x <= S(domain.upper[a]))) x = snapped_to_faces<Rounding>(domain, a, x);
            inside = inside && x >= S(domain.lower[a]) && x <= S(domain.upper[a]);
        }
        if (!inside) wrong.emplace_back(id, i);
    }
    if (wrong.empty()) return;
    std::string first;
    const auto few = wrong.begin() + std::ptrdiff_t(std::min<std::size_t>(wrong.size(), 3));
    std::partial_sort(wrong.begin(), few, wrong.end());
    for (auto one = wrong.begin(); one != few; ++one) {
        Vec<double, D> x{};
        for (int a = 0; a < D; ++a) x[a] = double(position(one->second, a));
        first += sentence(first.empty() ? "" : ", ", one->first, " at ", detail::point_text(x.v, D),
                          detail::slightly_outside_text(domain, x));
    }
    throw particle_error(
        sentence(wrong.size(), " of ", particles, " particles are not finite or lie outside the domain from ",
                 detail::point_text(domain.lower.v, D), " m to ", detail::point_text(domain.upper.v, D),
                 " m; the first: ", first, ". Move them inside, or enlarge the domain."));
}
/// Checks that all particles lie in the domain. The id of a particle is its index.
/// \param count     number of particles
/// \param position  position(i, axis) is a coordinate [m] of particle i
/// \throws particle_error  if `count` is 0 or above 2³² − 2, or if a position is not finite or outside the domain; the
///                         message tells how many such positions there are, and names the first three particles
template <std::floating_point S, int D, class Rounding = void, class Position>
void check_positions(std::size_t count, const Domain<D>& domain, const Position& position) {
    check_positions<S, D, Rounding>(count, domain, position, [](std::size_t i) { return std::uint32_t(i); });
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

}  // namespace firn::inline FIRN_BUILD
