/// \file The options and the result of filling a shape with particles, and a function that makes a lattice of points.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>
#include <firn/data/memory.hpp>
#include <firn/data/mesh.hpp>
#include <firn/data/random.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// How particles are arranged in a shape.
enum class Pattern {
    lattice,       ///< at the centres of cubes (in 2D: squares) of side `spacing`
    jittered,      ///< at lattice points that are moved at random by up to `jitter` spacings along each axis
    poisson_disk,  ///< at random, no two closer than about 0.8 spacings, without a preferred direction (Bridson 2007)
};

/// Options of how a shape is filled with particles. The same options give the same positions, bit for bit, with every
/// compiler.
struct SamplingOptions {
    /// Mean distance of particles [m]: there is one particle per spacing^D. Must be set, above 0.
    double spacing = 0;
    Pattern pattern = Pattern::lattice;         ///< how particles are arranged
    double jitter = 0.25;                       ///< largest random shift per axis [spacings], 0 to 0.5; for jittered
    std::uint64_t seed = 1;                     ///< seed of the random numbers; for jittered and poisson_disk
    std::uint64_t max_particles = 200'000'000;  ///< largest number of particles; a larger number is an error
};

/// The particles that fill a shape.
template <int D>
struct Samples {
    std::vector<Vec<double, D>> positions;  ///< position of each particle [m]
    double volume = 0;                      ///< volume of each particle, the same for all [m^D]
};

/// Returns the spacing [m] of a lattice with `particles_per_cell` particles in a grid cell of side `cell_size` [m].
/// \throws parameter_error  if an argument is not finite or not above 0
template <int D>
[[nodiscard]] double particle_spacing(double cell_size, double particles_per_cell) {
    if (!(cell_size > 0 && std::isfinite(cell_size) && particles_per_cell > 0 && std::isfinite(particles_per_cell))) {
        throw parameter_error(sentence("There is no spacing for ", particles_per_cell, " particles in a cell of ",
                                       cell_size, " m; both must be finite and above 0."));
    }
    return cell_size / (D == 2 ? std::sqrt(particles_per_cell) : std::cbrt(particles_per_cell));
}

/// Checks the options for filling a shape.
/// \throws parameter_error  if the spacing is not positive or not finite, or if the jitter does not lie in 0 to 0.5
inline void check(const SamplingOptions& options) {
    if (!(options.spacing > 0) || !std::isfinite(options.spacing)) {
        throw parameter_error(sentence("The particle spacing is ", options.spacing,
                                       " m; it must be given, finite and above 0. particle_spacing() finds it from the "
                                       "cell size and the particles per cell."));
    }
    if (!(options.jitter >= 0 && options.jitter <= 0.5)) {
        throw parameter_error(sentence("The jitter is ", options.jitter,
                                       " spacings; it must lie in 0 to 0.5, so that each particle stays in its cube."));
    }
}

namespace detail {

/// Checks that there are not too many objects of one kind, and that the objects fit into memory.
/// \param predicted  expected number of objects; may be infinite, but not NaN
/// \param what       name of the objects in the message
/// \param most       largest allowed number of objects
/// \param bytes      memory that one object needs [bytes]
/// \throws parameter_error  if `predicted` is above `most`
/// \throws memory_error     if the objects do not fit into memory
inline void check_count(double predicted, const char* what, double most, std::size_t bytes = 0) {
    require_memory(predicted * double(bytes), sentence("About ", predicted, " ", what), "Choose a larger spacing.");
    if (predicted <= most) return;
    throw parameter_error(sentence("This would make about ", predicted, " ", what, "; at most ", most,
                                   " are allowed. Choose a larger spacing, or raise the bound if memory allows."));
}

/// Returns a lattice point, moved at random: anchor + (index + ½ + jitter·u) spacing. Each component of u is a random
/// number in [−1, 1) that depends only on the seed and the counter. Fused multiply-adds are written out, so that no bit
/// of the result depends on which operations a compiler fuses.
template <int D>
Vec<double, D> lattice_point(const Vec<double, D>& anchor, double spacing, const std::array<std::int64_t, D>& index,
                             double jitter, std::uint64_t seed, std::uint64_t counter) {
    Vec<double, D> x{};
    for (int k = 0; k < D; ++k) {
        double cell = double(index[std::size_t(k)]) + 0.5;
        if (jitter > 0) {
            const double u = 2 * unit_interval(random_bits(seed, D * counter + std::uint64_t(k))) - 1;
            cell = std::fma(jitter, u, cell);
        }
        x[k] = std::fma(cell, spacing, anchor[k]);
    }
    return x;
}

/// Calls f(index, counter) for each point of a lattice, until f returns false. Along each axis, the point's index goes
/// from `begin` to before `end`; the first axis runs fastest. `counter` is 0 for the first point, 1 for the second, ….
template <int D, class F>
void for_lattice(const std::array<std::int64_t, D>& begin, const std::array<std::int64_t, D>& end, const F& f) {
    for (std::size_t k = 0; k < D; ++k) {
        if (begin[k] >= end[k]) return;
    }
    auto index = begin;
    for (std::uint64_t counter = 0;; ++counter) {
        if (!f(index, counter)) return;
        std::size_t k = 0;
        while (k < D && ++index[k] == end[k]) {
            index[k] = begin[k];
            ++k;
        }
        if (k == D) return;
    }
}

}  // namespace detail

/// Returns the points of a lattice with counts[0] × counts[1] (× counts[2]) points. The coordinate of a point along
/// axis k is lower[k] + (i + ½) spacing, i = 0 to counts[k] − 1, moved at random by up to `jitter` spacings. In the
/// returned list, the first axis runs fastest.
/// \param lower    lower corner of the lattice [m]
/// \param counts   number of points along each axis
/// \param spacing  distance between neighbouring points [m]
/// \param jitter   largest random shift [spacings], 0 to 0.5
/// \param seed     seed of the random shifts
/// \param first_n  number of points to return, from the first on; by default all
/// \throws parameter_error  if a count is below 1, if `spacing` or `jitter` is out of range, if `lower` is not finite,
///                          if the lattice has fewer than `first_n` points, or if there would be too many points
/// \throws memory_error     if the points do not fit into memory
template <int D>
std::vector<Vec<double, D>> lattice_points(const Vec<double, D>& lower, const std::array<std::int64_t, D>& counts,
                                           double spacing, double jitter = 0, std::uint64_t seed = 1,
                                           std::uint64_t first_n = std::numeric_limits<std::uint64_t>::max()) {
    const SamplingOptions options{.spacing = spacing, .jitter = jitter, .seed = seed};
    check(options);
    if (!detail::is_finite(lower)) {
        throw parameter_error(sentence("The lattice begins at ", detail::describe(lower), "; give finite metres."));
    }
    double total = 1;
    for (const auto count : counts) {
        if (count < 1) {
            throw parameter_error(sentence("A lattice needs 1 point or more along each axis; ", count, " given."));
        }
        total *= double(count);
    }
    constexpr auto all = std::numeric_limits<std::uint64_t>::max();
    if (first_n != all && double(first_n) > total) {
        throw parameter_error(sentence("The first ", first_n, " points are asked of a lattice of ", total, "."));
    }
    const double wanted = first_n == all ? total : double(first_n);
    detail::check_count(wanted, "particles", double(options.max_particles), sizeof(Vec<double, D>));
    std::vector<Vec<double, D>> points;
    points.reserve(std::size_t(wanted));
    if (first_n == 0) return points;
    detail::for_lattice<D>({}, counts, [&](const auto& index, std::uint64_t counter) {
        points.push_back(detail::lattice_point<D>(lower, spacing, index, jitter, seed, counter));
        return points.size() < std::size_t(wanted);
    });
    return points;
}

}  // namespace firn::inline FIRN_BUILD
