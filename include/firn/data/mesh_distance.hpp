/// \file Computes the signed distance from a closed triangle mesh at each node of a grid. With this grid, the mesh can
/// be the shape of a collider.
///
///     Collider<DistanceGrid<float, 3>> bunny{.shape = {mesh_distance(mesh, {.spacing = 0.01, .band = 0.03})}};
#pragma once

#include <firn/boundary/distance_grid.hpp>
#include <firn/data/inside.hpp>
#include <firn/data/memory.hpp>
#include <firn/data/nearest_triangle.hpp>

namespace firn::inline FIRN_BUILD {

/// Options of mesh_distance(), which determine the grid of distances.
struct MeshDistanceOptions {
    double spacing = 0;  ///< distance between nodes [m]; good values: the simulation's cell size, or half of it
    /// How far the grid extends beyond the mesh's bounding box on each side [m]; 0: three times `spacing`. Farther
    /// away, distances are continued from the end of the grid, with errors of some percent: see DistanceGrid.
    double band = 0;
    double most_bytes = 0x1p32;  ///< largest size of the grid [bytes]; a larger grid is an error
};

/// Returns a grid with the signed distance [m] from each node to the nearest triangle. At nodes inside the mesh
/// (according to InsideTest) the distance is negative. Distances are exact up to rounding at all nodes, also far from
/// the mesh: none is capped.
///
/// The thinnest part of the mesh should be two spacings thick. In a part thinner than one spacing, there may be no
/// node: its surface then lies up to half a spacing deeper, or is missing.
/// \tparam Number  float or double
/// \throws mesh_error       if the constructor of InsideTest does not accept the mesh, as one that is not closed
/// \throws parameter_error  if the spacing or the band is not positive or not finite, if the band is narrower than one
///                          spacing, or if the grid is larger than most_bytes
/// \throws memory_error     if the grid does not fit into memory
template <std::floating_point Number = float>
[[nodiscard]] std::shared_ptr<const DistanceNumbers<Number, 3>> mesh_distance(const TriangleMesh& mesh,
                                                                              const MeshDistanceOptions& options) {
    const double spacing = options.spacing, band = options.band == 0 ? 3 * spacing : options.band;
    if (!(spacing > 0) || !std::isfinite(spacing))
        throw parameter_error(
            sentence("The spacing of a grid of distances is ", spacing, " m; it must be positive and finite."));
    if (!(band >= spacing) || !std::isfinite(band))
        throw parameter_error(sentence("The band of a grid of distances is ", band, " m at a spacing of ", spacing,
                                       " m; it must be one spacing at least, and finite."));
    const InsideTest inside(mesh);
    const detail::NearestTriangle nearest(mesh);

    DistanceNumbers<Number, 3> grid;
    grid.spacing = spacing;
    double bytes = sizeof(Number);
    Vec<double, 3> count{};
    for (int a = 0; a < 3; ++a) {
        grid.lower[a] = inside.bounds().lower[a] - band;
        count[a] = std::ceil((inside.bounds().upper[a] + band - grid.lower[a]) / spacing) + 1;
        bytes *= count[a];
    }
    require_memory(
        bytes, sentence("A grid of ", count[0], " x ", count[1], " x ", count[2], " distances, ", spacing, " m apart,"),
        "Take a wider spacing or a narrower band.");
    if (!(bytes <= options.most_bytes) || !(std::max({count[0], count[1], count[2]}) < 1e9))
        throw parameter_error(sentence("At a spacing of ", spacing, " m a grid of distances around this mesh has ",
                                       count[0], " x ", count[1], " x ", count[2], " nodes, ", bytes,
                                       " bytes; at most ", options.most_bytes,
                                       " are allowed. Take a wider spacing, a narrower band, or raise most_bytes."));
    for (int a = 0; a < 3; ++a) grid.nodes[std::size_t(a)] = int(count[a]);
    grid.values.reserve(std::size_t(bytes / sizeof(Number)));

    using P = pack<double, int(register_bytes / sizeof(double))>;  // neighbours along the last axis share a search
    constexpr int lanes = scalar_traits<P>::lanes;
    for (int i = 0; i < grid.nodes[0]; ++i)
        for (int j = 0; j < grid.nodes[1]; ++j)
            for (int k = 0; k < grid.nodes[2]; k += lanes) {
                Vec<double, 3> x[lanes];
                Vec<P, 3> in_lanes{};
                for (int lane = 0; lane < lanes; ++lane) {
                    const int node = std::min(k + lane, grid.nodes[2] - 1);
                    x[lane] = grid.lower + Vec<double, 3>{double(i), double(j), double(node)} * spacing;
                }
                for (int a = 0; a < 3; ++a) in_lanes[a] = from_lanes<P>([&](int lane) { return x[lane][a]; });
                const P distance = nearest.distances(in_lanes);
                for (int lane = 0; lane < std::min(lanes, grid.nodes[2] - k); ++lane)
                    grid.values.push_back(Number(inside(x[lane]) ? -distance[lane] : distance[lane]));
            }
    return std::make_shared<const DistanceNumbers<Number, 3>>(std::move(grid));
}

}  // namespace firn::inline FIRN_BUILD
