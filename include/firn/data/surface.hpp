/// \file The surface of matter: a closed mesh around particles, with fields such as the velocity on its vertices, for
/// renderers and for other programs. In three dimensions.
///
/// Each particle is an ellipsoid with a kernel w whose integral is the particle's volume. The sum φ(x) = Σ wₚ(x) is
/// about 1 in matter, 1/2 on a plane that bounds it, and 0 outside; the surface is where φ has the value `level`. So it
/// encloses the volume of the particles.
///
/// A kernel is a ball, made as flat as the distribution of the particles around it (Yu, Turk, ACM Trans. Graph. 32
/// (2013)): in matter it stays a ball, on a surface it becomes flatter, and in a thin sheet, a strand and a drop it is
/// so small that these do not vanish. The paper also moves the kernels towards their neighbours, which shrinks bodies;
/// here the mesh is smoothed instead.
///
/// Where F is known, all this happens in the undeformed matter around the particle, and F deforms the result: stretched
/// matter has no holes. Only an elastic material knows F of the whole deformation; the F of sand, snow and other
/// plastic matter is that of the elastic part, and a fluid has none.
///
/// Where particles lie at random, φ falls below the level at some places within matter, too; such cavities are filled.
///
/// Triangles are found by marching cubes on the blocks of a sparse lattice. The mesh is closed: every edge belongs to
/// two triangles, which look outwards, and the triangles around a vertex form one fan. Where a face of a cell leaves
/// open what is joined, the corners that are outside are. \see marching_cubes.hpp
///
/// The result has the same bits on any number of threads, and for particles in any order.
///
/// For large clouds of fluids there is splashsurf (github.com/InteractiveComputerGraphics/splashsurf), a program of its
/// own with more ways to smooth, decimate and to keep to one part of a scene. It reads the PLY files of firn's states.
#pragma once

#include <firn/data/surface_extraction.hpp>
#include <firn/data/surface_options.hpp>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Checks the options of a surface.
/// \throws parameter_error  if one is out of range
inline void check_surface_options(const SurfaceOptions& options) {
    const auto require = [](bool right, const char* name, double value, const char* range) {
        if (!right) throw parameter_error(sentence("The surface's ", name, " is ", value, "; give ", range, "."));
    };
    require(options.cell_size >= 0 && std::isfinite(options.cell_size), "cell_size", options.cell_size,
            "finite metres above 0, or 0 for half a spacing");
    require(options.radius >= 1.2 && options.radius <= 10, "radius", options.radius, "1.2 to 10 spacings");
    require(options.level >= 0.05 && options.level <= 0.95, "level", options.level, "0.05 to 0.95");
    require(options.least_radius >= 0.5 && options.least_radius <= options.radius, "least_radius", options.least_radius,
            "0.5 spacings to the radius");
    require(options.largest_stretch >= 1 && options.largest_stretch <= 10, "largest_stretch", options.largest_stretch,
            "1 to 10");
    require(options.filled >= 0 && std::isfinite(options.filled), "filled", options.filled,
            "a finite number of particles' volumes from 0 on");
    require(options.smoothing >= 0 && options.smoothing <= 100, "smoothing", options.smoothing, "0 to 100 passes");
    static_cast<void>(thread_count(options.threads));
}

/// Checks the particles of a surface.
/// \throws parameter_error  if there are none, or if the numbers of an array are not those of the particles
/// \throws particle_error   if a position, a volume, an F or a field is not finite, or a volume is not above 0
inline void check_surface_particles(const SurfaceParticles& given) {
    const std::size_t n = given.positions.size();
    if (n == 0) throw parameter_error("There are no particles, so there is no surface. Give one or more.");
    if (n >= 0xffffffffU) throw parameter_error(sentence("There are ", n, " particles; give up to ", 0xfffffffeU, "."));
    if (given.volumes.size() != n && given.volumes.size() != 1)
        throw parameter_error(sentence("There are ", n, " particles and ", given.volumes.size(),
                                       " volumes; give one for each, or one for all."));
    if (!given.deformation_gradients.empty() && given.deformation_gradients.size() != n)
        throw parameter_error(sentence("There are ", n, " particles and ", given.deformation_gradients.size(),
                                       " deformation gradients; give one for each, or none."));
    for (std::size_t k = 0; k < given.volumes.size(); ++k)
        if (!(given.volumes[k] > 0) || !std::isfinite(given.volumes[k]))
            throw particle_error(sentence("Particle ", k, " (from 0) has a volume of ", given.volumes[k],
                                          " m³; a surface needs finite volumes above 0."));
    for (std::size_t k = 0; k < n; ++k) {
        if (!is_finite(given.positions[k]))
            throw particle_error(sentence("Particle ", k, " (from 0) is at ", describe(given.positions[k]),
                                          "; positions must be finite numbers. Mend or leave out such particles."));
        if (!given.deformation_gradients.empty() && !std::isfinite(squared_norm(given.deformation_gradients[k])))
            throw particle_error(sentence("The deformation gradient of particle ", k,
                                          " (from 0) has numbers that are not finite. Mend or leave out such "
                                          "particles."));
    }
    for (const auto& field : given.fields) {
        if (field.components < 1 || field.values.size() != n * std::size_t(field.components))
            throw parameter_error(sentence("The field '", field.name, "' has ", field.values.size(), " values of ",
                                           field.components, " components for ", n,
                                           " particles; give as many for "
                                           "each."));
        for (std::size_t k = 0; k < field.values.size(); ++k)
            if (!std::isfinite(field.values[k]))
                throw particle_error(sentence("The field '", field.name, "' of particle ",
                                              k / std::size_t(field.components), " (from 0) is ", field.values[k],
                                              "; a surface carries finite numbers. Leave the field out."));
    }
}

/// Returns the means of the fields at points, weighted by the kernels there. \param block_of  block near each point
inline std::vector<SurfaceField> fields_at(const std::vector<Vec<double, 3>>& points,
                                           const std::vector<std::uint32_t>& block_of, const SurfaceLattice& lattice,
                                           const Ellipsoids& ellipsoids, std::span<const SurfaceField> given) {
    std::vector<SurfaceField> fields;
    for (const auto& field : given)
        fields.push_back({field.name, field.unit, field.components,
                          std::vector<double>(points.size() * std::size_t(field.components))});
    if (fields.empty()) return fields;
    std::vector<std::size_t> first;  // of the points of each block; these lie together
    for (std::size_t v = 0; v < points.size(); ++v)
        if (v == 0 || block_of[v] != block_of[v - 1]) first.push_back(v);
    first.push_back(points.size());
    const int workers = thread_count(lattice.threads());
    std::vector<SurfaceLattice::Near> of_worker(std::size_t(std::max(workers, 1)));
    parallel_for(first.size() - 1, workers, [&](std::size_t run, int worker) {
        auto& near = of_worker[std::size_t(worker)];
        lattice.find_near(block_of[first[run]], near);
        for (std::size_t v = first[run]; v < first[run + 1]; ++v) {
            double total = 0;
            lattice.weights(near, points[v], [&](std::uint32_t ellipsoid, double w) {
                total += w;
                const std::size_t particle = ellipsoids.particle[ellipsoid];
                for (std::size_t f = 0; f < fields.size(); ++f) {
                    const auto n = std::size_t(fields[f].components);
                    for (std::size_t c = 0; c < n; ++c)
                        fields[f].values[n * v + c] += w * given[f].values[n * particle + c];
                }
            });
            for (auto& field : fields) {
                const auto n = std::size_t(field.components);
                for (std::size_t c = 0; c < n; ++c) field.values[n * v + c] /= total;
            }
        }
    });
    return fields;
}

}  // namespace detail

/// Returns the surface of particles. If no particle has neighbours and `separate` is false, it has no triangles.
///
/// A field on the surface is a mean of the particles' near a vertex, weighted by their kernels: it lies between their
/// values, and a field of gradient g is wrong there by |g| times a fraction of a spacing, since matter is on one side.
///
///     const std::vector<double> volume{spacing * spacing * spacing};
///     const auto surface = firn::surface_of({positions, volume});
///     firn::write_obj("water.obj", surface);
///
/// \throws parameter_error  if there are no particles, an array has another size, an option is out of range, or the
///                          particles lie too far apart for the cells
/// \throws particle_error   if a number of a particle is not finite, or a volume is not above 0
/// \throws memory_error     if the surface does not fit into memory, since the cells are too small
/// \see surface_of(set) in firn/simulation/surface.hpp
inline SurfaceMesh surface_of(const SurfaceParticles& particles, const SurfaceOptions& options = {}) {
    detail::check_surface_options(options);
    detail::check_surface_particles(particles);
    SurfaceMesh surface;
    parallel_region(thread_count(options.threads), [&] {
        std::vector<double> volumes(particles.volumes.begin(), particles.volumes.end());
        const auto middle = volumes.begin() + std::ptrdiff_t(volumes.size() / 2);
        std::nth_element(volumes.begin(), middle, volumes.end());
        const double cell = options.cell_size > 0 ? options.cell_size : 0.5 * std::cbrt(*middle);
        detail::Ellipsoids ellipsoids = detail::ellipsoids_of(particles, options);
        const detail::SurfaceLattice lattice(ellipsoids.all, cell, options.threads);
        std::vector<std::uint32_t> block_of;
        static_cast<TriangleMesh&>(surface) =
            detail::SurfaceExtraction<detail::SurfaceLattice>(lattice, options.level).mesh(block_of);
        detail::fill_cavities(surface, block_of, options.filled * *middle);
        surface.fields = detail::fields_at(surface.vertices, block_of, lattice, ellipsoids, particles.fields);
        const detail::TrianglesAround around(surface);
        detail::smooth(surface, around, options.smoothing, options.threads);
        surface.normals = detail::vertex_normals(surface, around, options.threads);
        surface.alone = std::move(ellipsoids.alone);
    });
    return surface;
}

}  // namespace firn::inline FIRN_BUILD
