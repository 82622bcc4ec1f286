/// \file Fills boxes, spheres (disks in 2D) and closed meshes with particles: lattice, jittered lattice, Poisson-disk.
///
/// The volume of a particle: spacing^D on a lattice, jittered or not, so that its density is right wherever it lies
/// (the total is off by what the shape's surface cuts through the lattice's cubes); the shape's volume divided by the
/// number of particles for Poisson-disk, so that the total is right.
#pragma once

#include <firn/data/inside.hpp>
#include <firn/data/poisson_disk.hpp>
#include <firn/data/samples.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace firn {

namespace detail {

/// x^D as a product, which is the same everywhere; std::pow need not be.
template <int D>
double power(double x) {
    return D == 2 ? x * x : x * x * x;
}

template <int D>
void check_particles(double volume, const SamplingOptions& options) {
    check_count(volume / power<D>(options.spacing), "particles", double(options.max_particles), sizeof(Vec<double, D>));
}

/// A shape as the patterns see it. `winding(x)` says how often it covers x; `volume` is the integral of that.
template <int D, class Winding>
struct Shape {
    const char* name;
    Bounds<D> bounds;
    Vec<double, D> anchor;              ///< of the lattice
    std::array<std::int64_t, D> begin;  ///< lattice indices that cover `bounds`
    std::array<std::int64_t, D> end;
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
    // The box is filled with a margin, then cut: no crowding along the surface, and parts that do not touch are filled.
    const double radius = poisson_radius<D>(options.spacing);
    const auto margin = Vec<double, D>::filled(2 * radius);
    // About 7 cells a particle in 3D (r/√3 and the density above), 3 in 2D.
    const auto points = poisson_disk_points<D>(shape.bounds.lower - margin, shape.bounds.upper + margin, radius,
                                               options.seed, 8 * double(options.max_particles));
    double covered = 0;
    for (const auto& x : points) {
        const int winding = shape.winding(x);
        covered += winding;
        if (winding >= 1) samples.positions.push_back(x);
    }
    // Where nothing overlaps, `covered` is the number of particles. Where parts overlap, `volume` counts the overlap
    // as often as the points do, so that their ratio is still what one particle stands for.
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

/// Lattice indices from 0 that cover an extent. The points tried are bounded too: a thin, slanted shape keeps few.
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

/// A box from lower to upper [m]. The lattice begins at `lower`; where the extent is no multiple of the spacing, the
/// last layer is the one whose centre still lies inside. Throws parameter_error where the box is empty, inverted or not
/// finite, for bad options, and where no particle falls inside.
template <int D>
Samples<D> sample_box(const Vec<double, D>& lower, const Vec<double, D>& upper, const SamplingOptions& options) {
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

/// A sphere, a disk in 2D [m]. The lattice is symmetric: a corner of its cubes lies on the centre. Throws
/// parameter_error for a radius not above 0, anything not finite, bad options, and where no particle falls inside.
template <int D>
Samples<D> sample_sphere(const Vec<double, D>& centre, double radius, const SamplingOptions& options) {
    static_assert(D == 2 || D == 3);
    check(options);
    if (!(radius > 0) || !std::isfinite(radius) || !detail::is_finite(centre)) {
        throw parameter_error(sentence("A sphere of radius ", radius, " m about ", detail::describe(centre),
                                       " cannot be filled; give a radius above 0 and a centre, all finite."));
    }
    const double volume = std::numbers::pi * detail::power<D>(radius) * (D == 2 ? 1.0 : 4.0 / 3.0);
    const auto winding = [&](const Vec<double, D>& x) {
        double squared = 0;  // fused, so that no compiler's choice of contraction decides about a particle
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

/// A closed mesh: where its winding number is ≥ 1 (InsideTest says what that means for one that intersects itself). The
/// lattice begins at the lower corner of its bounding box. Throws mesh_error for a mesh that InsideTest refuses,
/// parameter_error for bad options and where no particle falls inside.
inline Samples<3> sample_mesh(const TriangleMesh& mesh, const SamplingOptions& options) {
    check(options);
    const InsideTest inside(mesh);
    const auto winding = [&](const Vec<double, 3>& x) { return inside.winding_number(x); };
    const auto& box = inside.bounds();
    const double volume = std::abs(signed_volume(mesh));
    detail::check_particles<3>(volume, options);
    const auto counts = detail::lattice_counts<3>(box.upper - box.lower, options);
    return detail::fill<3>(detail::Shape<3, decltype(winding)>{"mesh", box, box.lower, {}, counts, volume, winding},
                           options);
}

}  // namespace firn
