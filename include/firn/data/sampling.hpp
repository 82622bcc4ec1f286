/// \file Fills boxes, spheres (in 2D: disks) and closed meshes with particles at points of a lattice, of a jittered
/// lattice or of a Poisson-disk pattern.
///
/// With Pattern::lattice and Pattern::jittered, the volume of a particle is spacing^D. The density is then right
/// everywhere, but the total volume has an error, because the surface of the shape cuts the cubes of the lattice. With
/// Pattern::poisson_disk, the volume of a particle is the shape's volume divided by the number of particles, so that
/// the total volume is right.
#pragma once

#include <firn/data/inside.hpp>
#include <firn/data/poisson_disk.hpp>
#include <firn/data/samples.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Returns x^D, computed as a product, so that the result has the same bits on every machine. A result of std::pow may
/// differ between machines.
template <int D>
double power(double x) {
    return D == 2 ? x * x : x * x * x;
}

template <int D>
void check_particles(double volume, const SamplingOptions& options) {
    check_count(volume / power<D>(options.spacing), "particles", double(options.max_particles), sizeof(Vec<double, D>));
}

/// A shape to be filled with particles. This description serves for all patterns. `winding(x)` returns how often the
/// shape covers the point x; `volume` is the integral of `winding` over space.
template <int D, class Winding>
struct Shape {
    const char* name;
    Bounds<D> bounds;
    Vec<double, D> anchor;  ///< lower corner of the lattice cube with index 0
    /// For each axis, the index of the first lattice cube. The cubes from `begin` to before `end` cover `bounds`.
    std::array<std::int64_t, D> begin;
    std::array<std::int64_t, D> end;  ///< for each axis, one past the index of the last lattice cube
    double volume;
    Winding winding;
};

template <int D, class Winding>
void fill_lattice(const Shape<D, Winding>& shape, const SamplingOptions& options, Samples<D>& samples) {
    const double jitter = options.pattern == Pattern::jittered ? options.jitter : 0;
    for_lattice<D>(shape.begin, shape.end, [&](const auto& index, std::uint64_t counter) {
        const auto x = lattice_point<D>(shape.anchor, options.spacing, index, jitter, options.seed, counter);
        if (shape.winding(x) >= 1) samples.positions.push_back(x);
        return true;
    });
    samples.volume = power<D>(options.spacing);
}

template <int D, class Winding>
void fill_poisson(const Shape<D, Winding>& shape, const SamplingOptions& options, Samples<D>& samples) {
    // The bounding box of the shape, enlarged by a margin, is filled, and points outside the shape are dropped. So
    // points do not concentrate along the shape's surface, and parts of the shape that do not touch are filled, too.
    const double radius = poisson_radius<D>(options.spacing);
    const auto margin = Vec<double, D>::filled(2 * radius);
    // The background grid, with cells of side r/√D, has about 9 cells per particle in 3D and 3 in 2D (poisson_density).
    const auto points = poisson_disk_points<D>(shape.bounds.lower - margin, shape.bounds.upper + margin, radius,
                                               options.seed, 16 * double(options.max_particles));
    double covered = 0;
    for (const auto& x : points) {
        const int winding = shape.winding(x);
        covered += winding;
        if (winding >= 1) samples.positions.push_back(x);
    }
    // If no parts of the shape overlap, `covered` is the number of particles. If parts overlap, `volume` and `covered`
    // count the overlap equally often, so their ratio is still the volume of one particle.
    samples.volume = covered > 0 ? shape.volume / covered : power<D>(options.spacing);
}

template <int D, class Winding>
Samples<D> fill(const Shape<D, Winding>& shape, const SamplingOptions& options) {
    Samples<D> samples;
    if (options.pattern == Pattern::poisson_disk) {
        fill_poisson(shape, options, samples);
    } else {
        fill_lattice(shape, options, samples);
    }
    if (samples.positions.empty()) {
        throw parameter_error(sentence("No particle falls inside the ", shape.name, " of ", shape.volume, " m^", D,
                                       " from ", describe(shape.bounds.lower), " to ", describe(shape.bounds.upper),
                                       " m: the spacing of ", options.spacing,
                                       " m is too large for it. Choose a smaller spacing."));
    }
    return samples;
}

/// Returns, for each axis, how many lattice cubes cover the extent [m]. Throws an error if there are too many cubes in
/// all. This can happen even if a thin, slanted shape contains only few lattice points, because each lattice point in
/// the bounding box must be tried.
template <int D>
std::array<std::int64_t, D> lattice_counts(const Vec<double, D>& extent, const SamplingOptions& options) {
    std::array<std::int64_t, D> counts{};
    double total = 1;
    for (int k = 0; k < D; ++k) {
        const double count = std::ceil(extent[k] / options.spacing);
        total *= count;
        check_count(total, "lattice points to try in the box around the shape",
                    std::min(16 * double(options.max_particles), 0x1p62));
        counts[std::size_t(k)] = std::int64_t(count);
    }
    return counts;
}

}  // namespace detail

/// Fills a box from `lower` to `upper` [m] with particles. The lattice begins at `lower`. If the extent along an axis
/// is no multiple of the spacing, lattice layers whose centres lie outside the box are left out.
/// \throws parameter_error  if the box is empty, inverted or not finite, if the options do not pass check(), if no
///                          particle falls inside the box, or if there would be more than max_particles particles
/// \throws memory_error     if the particles do not fit into memory
template <int D>
[[nodiscard]] Samples<D> sample_box(const Vec<double, D>& lower, const Vec<double, D>& upper,
                                    const SamplingOptions& options) {
    check(options);
    double volume = 1;
    for (int k = 0; k < D; ++k) {
        const double extent = upper[k] - lower[k];
        if (!(extent > 0) || !std::isfinite(extent)) {
            throw parameter_error(sentence("A box from ", detail::describe(lower), " to ", detail::describe(upper),
                                           " m cannot be filled; upper must be above lower along each axis and both "
                                           "finite."));
        }
        volume *= extent;
    }
    const auto winding = [&](const Vec<double, D>& x) {
        for (int k = 0; k < D; ++k) {
            if (!(x[k] >= lower[k] && x[k] <= upper[k])) return 0;
        }
        return 1;
    };
    detail::check_particles<D>(volume, options);
    const auto counts = detail::lattice_counts<D>(upper - lower, options);
    return detail::fill<D>(
        detail::Shape<D, decltype(winding)>{"box", {lower, upper}, lower, {}, counts, volume, winding}, options);
}

/// Fills a sphere (in 2D: a disk) with particles. The lattice is symmetric about the centre: a corner of lattice cubes
/// lies on the centre.
/// \param centre  centre of the sphere [m]
/// \param radius  radius of the sphere [m]
/// \throws parameter_error  if the radius is not above 0, if the radius or the centre is not finite, if the options do
///                          not pass check(), if no particle falls inside the sphere, or if there would be more than
///                          max_particles particles
/// \throws memory_error     if the particles do not fit into memory
template <int D>
[[nodiscard]] Samples<D> sample_sphere(const Vec<double, D>& centre, double radius, const SamplingOptions& options) {
    static_assert(D == 2 || D == 3);
    check(options);
    if (!(radius > 0) || !std::isfinite(radius) || !detail::is_finite(centre)) {
        throw parameter_error(sentence("A sphere of radius ", radius, " m about ", detail::describe(centre),
                                       " cannot be filled; give a radius above 0 and a centre, all finite."));
    }
    const double volume = std::numbers::pi * detail::power<D>(radius) * (D == 2 ? 1.0 : 4.0 / 3.0);
    const auto winding = [&](const Vec<double, D>& x) {
        double squared = 0;  // by std::fma, so that the result does not depend on which operations a compiler fuses
        for (int k = 0; k < D; ++k) squared = std::fma(x[k] - centre[k], x[k] - centre[k], squared);
        return squared <= radius * radius ? 1 : 0;
    };
    detail::check_particles<D>(volume, options);
    const auto reach = Vec<double, D>::filled(radius);
    const auto end = detail::lattice_counts<D>(reach, options);
    auto begin = end;
    for (auto& i : begin) i = -i;
    return detail::fill<D>(
        detail::Shape<D, decltype(winding)>{
            "sphere", {centre - reach, centre + reach}, centre, begin, end, volume, winding},
        options);
}

/// Fills a closed mesh with particles. They lie at those points of the pattern where the mesh's winding number is ≥ 1.
/// The lattice begins at the lower corner of the mesh's bounding box. The mesh may intersect itself; InsideTest defines
/// the inside of such a mesh.
/// \throws mesh_error       if the constructor of InsideTest does not accept the mesh
/// \throws parameter_error  if the options do not pass check(), if no particle falls inside the mesh, or if there would
///                          be more than max_particles particles
/// \throws memory_error     if the particles do not fit into memory
[[nodiscard]] inline Samples<3> sample_mesh(const TriangleMesh& mesh, const SamplingOptions& options) {
    check(options);
    const InsideTest inside(mesh);
    const auto winding = [&](const Vec<double, 3>& x) { return inside.winding_number(x); };
    const auto& box = inside.bounds();
    const double volume = inside.volume();
    detail::check_particles<3>(volume, options);
    const auto counts = detail::lattice_counts<3>(box.upper - box.lower, options);
    return detail::fill<3>(detail::Shape<3, decltype(winding)>{"mesh", box, box.lower, {}, counts, volume, winding},
                           options);
}

}  // namespace firn::inline FIRN_BUILD
