/// \file The box in which matter moves, and its cells.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>

#include <array>
#include <cmath>

namespace firn {

namespace detail {
// A constant, not a call in Domain: g++ 12 stops with an internal error at Simulation({{0, 0}, {1, 1}, 0.1}).
template <int D>
inline constexpr auto ones = Vec<double, D>::filled(1.0);
}  // namespace detail

/// An axis-aligned box of any size, with cubic cells of any size. Nodes lie at multiples of `cell_size` from `lower`.
template <int D>
struct Domain {
    Vec<double, D> lower{};                  ///< the lower corner [m]
    Vec<double, D> upper = detail::ones<D>;  ///< the upper corner [m]
    double cell_size = 1.0 / 64;             ///< h [m]

    /// Periodic axes: matter that leaves at one end enters at the other. The number of cells along such an axis must be
    /// a multiple of 16 (of 48 with the cubic kernel). Boundaries do not repeat. Walls across a periodic axis must be
    /// Contact::none, as they are by default.
    std::array<bool, std::size_t(D)> periodic{};

    /// Number of cells along an axis. The last cell reaches beyond `upper` if the extent is no multiple of h.
    int cells(int axis) const { return int(std::ceil((upper[axis] - lower[axis]) / cell_size - 1e-6)); }
};

/// The extent along an axis [cells], rounded to S but never beyond `upper`.
template <std::floating_point S, int D>
S extent_in_cells(const Domain<D>& domain, int axis) {
    const double cells = (domain.upper[axis] - domain.lower[axis]) / domain.cell_size;
    const S rounded = S(cells);
    return double(rounded) > cells ? std::nextafter(rounded, S(0)) : rounded;
}

/// The most cells along an axis. Block coordinates have 21 bits per axis: 2²⁰ blocks of four cells in each direction
/// from the lower corner.
inline constexpr double most_cells_per_axis = 4.0 * (1 << 20) - 16;

/// The number of cells along a periodic axis is a multiple of this, so that colours of blocks continue across its ends.
inline constexpr int periodic_multiple = 16;

/// Checks a domain.
/// \throws parameter_error  if the box is empty or not finite, if it has too many or too few cells, or if the number of
///                          cells along a periodic axis is no multiple of periodic_multiple
template <int D>
void check(const Domain<D>& domain) {
    if (!(domain.cell_size > 0) || !std::isfinite(domain.cell_size))
        throw parameter_error(sentence("The cell size is ", domain.cell_size, " m; it must be positive and finite."));
    for (int a = 0; a < D; ++a) {
        const double extent = domain.upper[a] - domain.lower[a];
        if (!std::isfinite(domain.lower[a]) || !std::isfinite(domain.upper[a]) || !(extent > 0))
            throw parameter_error(sentence("The domain reaches from ", domain.lower[a], " m to ", domain.upper[a],
                                           " m along axis ", a, "; upper must be above lower and both finite."));
        const double cells = extent / domain.cell_size;
        if (!(cells >= 2 && cells <= most_cells_per_axis))
            throw parameter_error(sentence("The domain has ", cells, " cells of ", domain.cell_size, " m along axis ",
                                           a, "; from 2 to ", most_cells_per_axis, " are possible."));
        const int whole = domain.cells(a);
        if (domain.periodic[std::size_t(a)] && (whole % periodic_multiple != 0 || std::abs(cells - whole) > 1e-6))
            throw parameter_error(sentence("The domain has ", cells, " cells along the periodic axis ", a,
                                           "; their number must be a multiple of ", periodic_multiple, "."));
    }
}

}  // namespace firn
