/// \file The domain: the box in which matter moves, divided into cells.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <limits>
#include <string>

namespace firn::inline FIRN_BUILD {

namespace detail {
// The default of Domain::upper. It is a constant, because g++ 12 stops with an internal error at Simulation({{0, 0},
// {1, 1}, 0.1}) if Domain itself calls Vec::filled().
template <int D>
inline constexpr auto ones = Vec<double, D>::filled(1.0);
}  // namespace detail

/// An axis-aligned box of any size, with cubic cells of any size (in 2D: squares). Nodes lie at `lower` plus multiples
/// of `cell_size`.
template <int D>
struct Domain {
    Vec<double, D> lower{};                  ///< the lower corner [m]
    Vec<double, D> upper = detail::ones<D>;  ///< the upper corner [m]
    double cell_size = 1.0 / 64;             ///< h, the edge length of a cell [m]

    /// For each axis, true if the axis is periodic: matter that leaves the domain at one end of the axis enters it at
    /// the other end. The number of cells along a periodic axis must be a multiple of 16 (with the cubic kernel: of
    /// 48). Boundaries are not repeated: a boundary near one end of the axis does not act at the other end. The walls
    /// at the ends of a periodic axis must be Contact::none, which is the default.
    std::array<bool, std::size_t(D)> periodic{};

    /// Returns the number of cells along an axis. If the extent of the domain is no multiple of h, the last cell
    /// extends beyond `upper`.
    int cells(int axis) const { return int(std::ceil((upper[axis] - lower[axis]) / cell_size - 1e-6)); }
};

/// Returns the extent of the domain along an axis [cells]: the largest value of type S that is not above the exact
/// extent.
template <std::floating_point S, int D>
S extent_in_cells(const Domain<D>& domain, int axis) {
    const double cells = (domain.upper[axis] - domain.lower[axis]) / domain.cell_size;
    const S rounded = S(cells);
    return double(rounded) > cells ? std::nextafter(rounded, S(0)) : rounded;
}

/// Returns between which coordinates a step keeps particles along an axis [cells from the domain's lower corner]: in
/// the domain, but along a periodic axis they may leave it by one extent.
template <std::floating_point S, int D>
std::array<S, 2> range_of_steps(const Domain<D>& domain, int axis) {
    const S extent = extent_in_cells<S>(domain, axis);
    return domain.periodic[std::size_t(axis)] ? std::array<S, 2>{-extent, 2 * extent} : std::array<S, 2>{0, extent};
}

/// Returns how far [m] a position may lie outside of the domain along an axis by rounding alone: four units in the last
/// place, in precision S, of the axis' corner that is farther from 0, but at most a thousandth of a cell.
template <std::floating_point S, int D>
double rounding_at_faces(const Domain<D>& domain, int axis) {
    const double farther = std::fmax(std::abs(domain.lower[axis]), std::abs(domain.upper[axis]));
    return std::fmin(4 * double(std::numeric_limits<S>::epsilon()) * farther, 1e-3 * domain.cell_size);
}
/// Returns the coordinate x [m] of a position. If x lies outside of the domain by no more than rounding_at_faces(),
/// returns the coordinate of the face.
template <std::floating_point S, int D>
double snapped_to_faces(const Domain<D>& domain, int axis, double x) {
    const double lower = domain.lower[axis], upper = domain.upper[axis];
    if (x >= lower && x <= upper) return x;
    const double rounding = rounding_at_faces<S>(domain, axis);
    return x < lower && x >= lower - rounding ? lower : x > upper && x <= upper + rounding ? upper : x;
}

/// Largest number of cells along an axis. Block coordinates have 21 bits per axis, which is enough for 2²⁰ blocks of
/// four cells on each side of the domain's lower corner.
inline constexpr double most_cells_per_axis = 4.0 * (1 << 20) - 16;

/// The number of cells along a periodic axis must be a multiple of this number. Then the pattern of the blocks' colours
/// continues without a break across the ends of the domain. \see block_colour
inline constexpr int periodic_multiple = 16;

/// Checks that a domain is valid.
/// \throws parameter_error  if the box is empty or not finite, if the cell size is not positive or not finite, if there
///                          are fewer than 2 or more than most_cells_per_axis cells along an axis, or if the number of
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

namespace detail {

/// Returns how far the numbers of type S are apart at x.
template <std::floating_point S>
double last_digit(double x) {
    const S above = std::abs(S(x));
    return double(std::nextafter(above, std::numeric_limits<S>::infinity()) - above);
}

/// Returns the coordinate of the domain's corners that is farthest from 0 [m].
template <int D>
double farthest_coordinate(const Domain<D>& domain) {
    double farthest = 0;
    for (int a = 0; a < D; ++a) farthest = std::max({farthest, std::abs(domain.lower[a]), std::abs(domain.upper[a])});
    return farthest;
}

/// Checks that numbers of type S have digits enough for the positions in a domain.
/// \param what  who gets the positions, for the message
/// \throws parameter_error  if the last digit of a position is above a thousandth of a cell
template <std::floating_point S, int D>
void require_digits(const Domain<D>& domain, const char* what) {
    const double farthest = farthest_coordinate(domain), fine = 1e-3 * domain.cell_size;
    if (!(last_digit<S>(farthest) > fine)) return;
    double extent = 0;
    for (int a = 0; a < D; ++a) extent = std::max(extent, domain.upper[a] - domain.lower[a]);
    const bool move = !(last_digit<S>(extent) > fine);
    throw parameter_error(sentence(
        what, " gets positions up to ", farthest, " m in a precision whose last digit there is ",
        last_digit<S>(farthest), " m; that must not be above a thousandth of a cell, ", fine, " m. Compute in double",
        move ? sentence(", or move the domain and all that is in it by minus ", point_text(domain.lower.v, D), " m.")
             : std::string(".")));
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
