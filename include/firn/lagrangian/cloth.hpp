/// \file Builds cloth from a rectangle or from any triangle mesh.
#pragma once

#include <firn/data/mesh.hpp>
#include <firn/lagrangian/surface.hpp>

#include <iterator>
#include <tuple>

namespace firn::inline FIRN_BUILD {

/// How each cell of a rectangular cloth is cut into two triangles.
enum class Diagonals {
    alternating,  ///< Neighbouring cells are cut along different diagonals, so the cloth has no preferred direction.
    parallel      ///< All cells are cut along the same diagonal.
};

/// Builds a rectangular cloth (or a parallelogram) of cells[0] × cells[1] cells. One corner is `origin` [m]; the
/// vectors u and v [m] are the two edges from that corner. Point (i, j), with 0 ≤ i ≤ cells[0] and 0 ≤ j ≤ cells[1],
/// lies at origin + i/cells[0] u + j/cells[1] v and has index i + (cells[0] + 1) j.
///
/// Stretch links join each point to its neighbours along u and v. Shear links are both diagonals of every cell. Bend
/// links join each point to its second neighbours along u and v (Provot 1995, "Deformation constraints in a mass-spring
/// model to describe rigid cloth behavior"). Each cell is cut into two triangles. The corners of a triangle are in
/// counter-clockwise order if seen from the side to which u × v points.
/// \throws parameter_error  unless origin, u and v are finite, u and v are not parallel, cells[0] and cells[1] are at
///                          least 1, and the cloth has at most `max_points` points
/// \throws memory_error     if the net does not fit into memory
[[nodiscard]] inline Net<3> cloth(const Vec<double, 3>& origin, const Vec<double, 3>& u, const Vec<double, 3>& v,
                                  const std::array<std::size_t, 2>& cells,
                                  Diagonals diagonals = Diagonals::alternating) {
    const double area = norm(cross(u, v));
    if (!detail::is_finite(origin) || !std::isfinite(area) || !(area > 1e-12 * (dot(u, u) + dot(v, v))))
        throw parameter_error(sentence("A cloth at ", detail::describe(origin), " m with the edges ",
                                       detail::describe(u), " and ", detail::describe(v), " m has the area ", area,
                                       " m²; all must be finite and the edges must not be parallel."));
    const double points = (double(cells[0]) + 1) * (double(cells[1]) + 1);
    detail::require_net_memory<3>(points, 6 * points, 2 * points);
    if (cells[0] < 1 || cells[1] < 1 || points > double(max_points))
        throw parameter_error(sentence("A cloth of ", cells[0], " x ", cells[1],
                                       " cells was asked for; give at least one along each edge, and at most ",
                                       max_points, " points."));
    const std::size_t columns = cells[0] + 1, rows = cells[1] + 1;
    const auto at = [&](std::size_t i, std::size_t j) { return std::uint32_t(i + columns * j); };
    Net<3> net;
    net.positions.reserve(columns * rows);
    for (std::size_t j = 0; j < rows; ++j)
        for (std::size_t i = 0; i < columns; ++i)
            net.positions.push_back(origin + u * (double(i) / double(cells[0])) + v * (double(j) / double(cells[1])));

    for (std::size_t j = 0; j < rows; ++j) {
        for (std::size_t i = 0; i < columns; ++i) {
            if (i + 1 < columns) net.links.push_back({at(i, j), at(i + 1, j), LinkKind::stretch});
            if (j + 1 < rows) net.links.push_back({at(i, j), at(i, j + 1), LinkKind::stretch});
            if (i + 2 < columns) net.links.push_back({at(i, j), at(i + 2, j), LinkKind::bend});
            if (j + 2 < rows) net.links.push_back({at(i, j), at(i, j + 2), LinkKind::bend});
            if (i + 1 == columns || j + 1 == rows) continue;
            const std::uint32_t a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
            net.links.push_back({a, c, LinkKind::shear});
            net.links.push_back({b, d, LinkKind::shear});
            const bool rising = diagonals == Diagonals::parallel || (i + j) % 2 == 0;
            if (rising)
                net.facets.insert(net.facets.end(), {{a, b, c}, {a, c, d}});
            else
                net.facets.insert(net.facets.end(), {{a, b, d}, {b, c, d}});
        }
    }
    return net;
}

namespace detail {

/// Checks that a cloth can be built from a mesh.
/// \throws mesh_error  if check_mesh() throws it, if a triangle has no area, or if some vertex belongs to no triangle
inline void check_surface(const TriangleMesh& mesh) {
    check_mesh(mesh);
    std::vector<bool> used(mesh.vertices.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        std::array<Vec<double, 3>, 3> corner;
        for (std::size_t k = 0; k < 3; ++k) {
            corner[k] = mesh.vertices[std::size_t(mesh.triangles[t][k])];
            used[std::size_t(mesh.triangles[t][k])] = true;
        }
        const auto ab = corner[1] - corner[0], bc = corner[2] - corner[1], ca = corner[0] - corner[2];
        const double twice_area = norm(cross(ab, ca));
        if (!(twice_area > 1e-12 * std::max({dot(ab, ab), dot(bc, bc), dot(ca, ca)})))
            throw mesh_error(sentence("Triangle ", t, " (from 0) has no area: its corners ", describe(corner[0]), ", ",
                                      describe(corner[1]), ", ", describe(corner[2]),
                                      " m lie on a line. Remove it and join its neighbours."));
    }
    const auto loose = std::find(used.begin(), used.end(), false);
    if (loose != used.end())
        throw mesh_error(sentence("No triangle uses vertex ", loose - used.begin(),
                                  " (from 0) of the mesh, so it would be a loose point. Remove it."));
}

/// A side of a triangle of a mesh; `triangle` is the index of this triangle. The side's end points are the vertices
/// with the indices `low` and `high`, where low < high; `opposite` is the index of the triangle's third vertex.
struct Side {
    std::uint32_t low, high, opposite;
    std::size_t triangle;
};

/// Returns the three sides of every triangle, sorted by their end points. Sides with the same two end points follow
/// each other.
inline std::vector<Side> sorted_sides(const TriangleMesh& mesh) {
    std::vector<Side> sides;
    sides.reserve(3 * mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto& corners = mesh.triangles[t];
        for (std::size_t k = 0; k < 3; ++k) {
            const auto a = std::uint32_t(corners[k]), b = std::uint32_t(corners[(k + 1) % 3]);
            sides.push_back({std::min(a, b), std::max(a, b), std::uint32_t(corners[(k + 2) % 3]), t});
        }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& left, const Side& right) {
        return std::tuple(left.low, left.high, left.triangle) < std::tuple(right.low, right.high, right.triangle);
    });
    return sides;
}

}  // namespace detail

/// Builds a cloth from an open or closed mesh. The cloth's points are the mesh's vertices and the cloth's facets are
/// the mesh's triangles, in the same order.
///
/// Each edge of the mesh becomes a stretch link. Where two triangles share an edge, a bend link joins the two vertices
/// that lie opposite to this edge, unless an edge of the mesh joins these two vertices already. Where more than two
/// triangles share an edge, every pair of these triangles gets a bend link. Vertices at the same position are not
/// merged.
/// \throws mesh_error  if check_mesh() throws it, if a triangle has no area, if two triangles are folded onto each
///                     other, or if some vertex belongs to no triangle
[[nodiscard]] inline Net<3> cloth(const TriangleMesh& mesh) {
    detail::check_surface(mesh);
    Net<3> net{mesh.vertices, {}, {}};
    for (const auto& [a, b, c] : mesh.triangles)
        net.facets.push_back({std::uint32_t(a), std::uint32_t(b), std::uint32_t(c)});
    const auto sides = detail::sorted_sides(mesh);
    for (auto side = sides.begin(); side != sides.end(); ++side) {
        net.links.push_back({side->low, side->high, LinkKind::stretch});
        for (auto other = std::next(side); other != sides.end() && other->low == side->low && other->high == side->high;
             ++other) {
            const Link bend{side->opposite, other->opposite, LinkKind::bend};
            if (!(rest_length(net, bend) > 1e-9 * norm(mesh.vertices[side->low] - mesh.vertices[side->high])))
                throw mesh_error(sentence("Triangles ", side->triangle, " and ", other->triangle,
                                          " (from 0) of the mesh lie on each other, folded along the edge from vertex ",
                                          side->low, " to ", side->high, ". Remove one of them, or unfold them."));
            net.links.push_back(bend);
        }
    }
    net.links = detail::unique_links(std::move(net.links));
    return net;
}

}  // namespace firn::inline FIRN_BUILD
