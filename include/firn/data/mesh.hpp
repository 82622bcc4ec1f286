/// \file Closed triangle meshes, which can be filled with particles. Functions check a mesh, compute its volume, and
/// move, scale and turn it.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// A mesh of triangles, which share vertices. The three vertices of a triangle are listed counter-clockwise, seen from
/// outside.
struct TriangleMesh {
    std::vector<Vec<double, 3>> vertices;                ///< positions of the vertices [m]
    std::vector<std::array<std::int32_t, 3>> triangles;  ///< indices into `vertices`, counted from 0
};

/// An axis-aligned box, such as the bounding box of a mesh.
template <int D>
struct Bounds {
    Vec<double, D> lower;  ///< the corner with the lowest coordinates [m]
    Vec<double, D> upper;  ///< the corner with the highest coordinates [m]
};

namespace detail {

template <class S, int D>
bool is_finite(const Vec<S, D>& x) {
    return std::all_of(x.v, x.v + D, [](S c) { return std::isfinite(c); });
}

/// Returns a point as text: "(x, y, z)".
template <class S, int D>
std::string describe(const Vec<S, D>& x) {
    double numbers[D];
    for (int i = 0; i < D; ++i) numbers[i] = double(x[i]);
    return point_text(numbers, D);
}

template <class Move>
TriangleMesh moved(TriangleMesh mesh, const Move& move) {
    for (auto& x : mesh.vertices) x = move(x);
    return mesh;
}

}  // namespace detail

/// Checks that a mesh has triangles, finite vertices and valid indices.
/// \throws mesh_error  if there is no triangle, if a vertex is not finite, if an index is out of range, or if a
///                     triangle uses a vertex twice
inline void check_mesh(const TriangleMesh& mesh) {
    if (mesh.triangles.empty()) {
        throw mesh_error(sentence("The mesh has ", mesh.vertices.size(),
                                  " vertices and no triangle; four or more enclose a volume. Give a surface."));
    }
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        if (!detail::is_finite(mesh.vertices[i])) {
            throw mesh_error(sentence("Vertex ", i, " (from 0) of the mesh is ", detail::describe(mesh.vertices[i]),
                                      "; positions must be finite numbers. Mend or remove it."));
        }
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto& corners = mesh.triangles[t];
        for (const auto index : corners) {
            if (index < 0 || std::size_t(index) >= mesh.vertices.size()) {
                throw mesh_error(sentence("Triangle ", t, " (from 0) names vertex ", index, ", but the mesh has ",
                                          mesh.vertices.size(), " vertices, counted from 0. Mend its indices."));
            }
        }
        if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) {
            throw mesh_error(sentence("Triangle ", t, " (from 0) uses a vertex twice (", corners[0], ", ", corners[1],
                                      ", ", corners[2], "), so it has no area. Remove it and join its neighbours."));
        }
    }
}

/// Returns the bounding box of all triangles [m]. Vertices that no triangle uses are ignored.
/// \throws mesh_error  if the mesh does not pass check_mesh()
inline Bounds<3> bounding_box(const TriangleMesh& mesh) {
    check_mesh(mesh);
    constexpr double infinity = std::numeric_limits<double>::infinity();
    Bounds<3> box{Vec<double, 3>::filled(infinity), Vec<double, 3>::filled(-infinity)};
    for (const auto& corners : mesh.triangles) {
        for (const auto index : corners) {
            for (int k = 0; k < 3; ++k) {
                const double x = mesh.vertices[std::size_t(index)][k];
                box.lower[k] = std::min(box.lower[k], x);
                box.upper[k] = std::max(box.upper[k], x);
            }
        }
    }
    return box;
}

/// Returns the enclosed volume [m³], computed by the divergence theorem. The volume is positive if the vertices of the
/// triangles are counter-clockwise seen from outside. A region that the surface encloses twice counts twice, and one
/// within a shell that faces inwards is taken off: facing_outwards() turns those that bound no hole.
/// \throws mesh_error  if the mesh does not pass check_mesh()
inline double signed_volume(const TriangleMesh& mesh) {
    check_mesh(mesh);
    // The volume is a sum over tetrahedra whose apex is a vertex of the mesh, not the origin. So a small mesh far from
    // the origin loses no digits.
    const auto apex = mesh.vertices[std::size_t(mesh.triangles[0][0])];
    double six_volumes = 0;
    for (const auto& [i, j, k] : mesh.triangles) {
        const auto a = mesh.vertices[std::size_t(i)] - apex;
        const auto b = mesh.vertices[std::size_t(j)] - apex;
        const auto c = mesh.vertices[std::size_t(k)] - apex;
        six_volumes += dot(a, cross(b, c));
    }
    return six_volumes / 6;
}

namespace detail {

/// An edge of a triangle.
struct MeshEdge {
    std::int32_t low, high;  ///< indices of its vertices
    std::int32_t triangle;   ///< index of the triangle
    bool forward;            ///< true if the triangle traverses the edge from low to high
};

/// Returns the edges of all triangles, sorted by their vertices. In a mesh that passes check_closed(), each edge is
/// there twice, once in each direction.
/// \throws mesh_error  as check_closed()
inline std::vector<MeshEdge> closed_edges(const TriangleMesh& mesh) {
    check_mesh(mesh);
    std::vector<MeshEdge> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
            const auto from = mesh.triangles[t][k];
            const auto to = mesh.triangles[t][(k + 1) % 3];
            edges.push_back({std::min(from, to), std::max(from, to), std::int32_t(t), from < to});
        }
    }
    std::sort(edges.begin(), edges.end(),
              [](const MeshEdge& a, const MeshEdge& b) { return a.low != b.low ? a.low < b.low : a.high < b.high; });

    std::size_t open = 0, turned = 0, crowded = 0, touching = 0, total = 0;
    const MeshEdge* first_bad = nullptr;
    for (auto begin = edges.begin(); begin != edges.end(); ++total) {
        const auto end = std::find_if(begin, edges.end(),
                                      [&](const MeshEdge& e) { return e.low != begin->low || e.high != begin->high; });
        const auto count = end - begin;
        const auto forward = std::count_if(begin, end, [](const MeshEdge& e) { return e.forward; });
        if (count != 2 || forward != 1) {
            ++(count == 1 ? open : count == 2 ? turned : crowded);
            touching += count > 2 && 2 * forward == count;
            if (!first_bad) first_bad = &*begin;
        }
        begin = end;
    }
    if (!first_bad) return edges;
    std::string advice;
    if (open > 0) advice += " Fill the holes, and merge vertices that lie on one point.";
    if (turned > 0) advice += " Let all faces look outwards.";
    if (touching > 0)
        advice +=
            " Where parts of the surface touch along an edge, do not merge their vertices: give each part its own.";
    if (crowded > touching) advice += " Remove faces that are there twice, and walls inside.";
    throw mesh_error(
        sentence("The mesh is not a closed, consistently oriented surface: of its ", total, " edges ", open,
                 " belong to one triangle only (a hole), ", turned, " to two triangles of opposite orientation, ",
                 crowded, " to more than two. The first is the edge from vertex ", first_bad->low, " ",
                 detail::describe(mesh.vertices[std::size_t(first_bad->low)]), " to vertex ", first_bad->high, " ",
                 detail::describe(mesh.vertices[std::size_t(first_bad->high)]), " (counted from 0).", advice));
}

}  // namespace detail

/// Checks that a surface is closed and consistently oriented: every edge belongs to exactly two triangles, which
/// traverse the edge in opposite directions. The surface may intersect itself, and may consist of several shells, each
/// of which faces outwards or inwards. \see InsideTest, facing_outwards()
/// \throws mesh_error  if the surface is not closed or not consistently oriented, or if it does not pass check_mesh()
inline void check_closed(const TriangleMesh& mesh) { detail::closed_edges(mesh); }

/// Returns the mesh turned inside out: every triangle faces the opposite side.
[[nodiscard]] inline TriangleMesh reversed(TriangleMesh mesh) {
    for (auto& corners : mesh.triangles) std::swap(corners[1], corners[2]);
    return mesh;
}

/// Returns the mesh moved by `offset` [m].
/// \throws parameter_error  if the offset is not finite
[[nodiscard]] inline TriangleMesh translated(const TriangleMesh& mesh, const Vec<double, 3>& offset) {
    if (!detail::is_finite(offset)) {
        throw parameter_error(
            sentence("A mesh cannot be moved by ", detail::describe(offset), "; give finite metres."));
    }
    return detail::moved(mesh, [&](const auto& x) { return x + offset; });
}

/// Returns the mesh with all positions multiplied by `factor`.
/// \throws parameter_error  if the factor is not finite or not above 0
[[nodiscard]] inline TriangleMesh scaled(const TriangleMesh& mesh, double factor) {
    if (!(factor > 0) || !std::isfinite(factor)) {
        throw parameter_error(sentence("A mesh cannot be scaled by ", factor, "; give a finite number above 0."));
    }
    return detail::moved(mesh, [&](const auto& x) { return x * factor; });
}

/// Returns the matrix of a rotation by `angle` [rad] about `axis` in the sense of the right-hand rule (by Rodrigues'
/// formula).
/// \param axis  direction of the axis; may have any length except 0
/// \throws parameter_error  if the axis has length 0, or if the axis or the angle is not finite
[[nodiscard]] inline Mat<double, 3> rotation(const Vec<double, 3>& axis, double angle) {
    const double length = norm(axis);
    if (!(length > 0) || !std::isfinite(length) || !std::isfinite(angle)) {
        throw parameter_error(sentence("There is no rotation by ", angle, " rad about ", detail::describe(axis),
                                       "; give a finite angle and an axis of finite length above 0."));
    }
    const auto n = axis * (1 / length);
    const auto cross_n = Mat<double, 3>::rows(0, -n[2], n[1], n[2], 0, -n[0], -n[1], n[0], 0);
    return Mat<double, 3>::identity() + cross_n * std::sin(angle) + cross_n * cross_n * (1 - std::cos(angle));
}

/// Returns the mesh turned about the point `pivot` [m] by the rotation matrix `R`.
/// \throws parameter_error  if R is not a rotation matrix: if ‖RRᵀ − I‖ ≥ 1e-9 or det R ≤ 0
[[nodiscard]] inline TriangleMesh rotated(const TriangleMesh& mesh, const Mat<double, 3>& R,
                                          const Vec<double, 3>& pivot = {}) {
    const double skew = squared_norm(R * transpose(R) - Mat<double, 3>::identity());
    constexpr double tolerance = 1e-9;
    if (!(skew < tolerance * tolerance) || !(determinant(R) > 0)) {
        throw parameter_error(sentence("The matrix is no rotation: ‖RRᵀ − I‖² = ", skew, ", det R = ", determinant(R),
                                       "; it must keep lengths and not mirror. Build it with rotation(axis, angle)."));
    }
    return detail::moved(mesh, [&](const auto& x) { return pivot + R * (x - pivot); });
}

/// Returns the mesh, scaled and moved so that the centre of its bounding box is `centre` [m] and the longest edge of
/// its bounding box is `size` [m].
/// \throws parameter_error  if the size is not above 0, or if the size or the centre is not finite
/// \throws mesh_error       if all vertices lie on one point, or if the mesh does not pass check_mesh()
[[nodiscard]] inline TriangleMesh fitted(const TriangleMesh& mesh, const Vec<double, 3>& centre, double size) {
    const auto box = bounding_box(mesh);
    const auto extent = box.upper - box.lower;
    const double longest = std::max({extent[0], extent[1], extent[2]});
    if (!(size > 0) || !std::isfinite(size) || !detail::is_finite(centre)) {
        throw parameter_error(sentence("A mesh cannot be fitted to size ", size, " m at ", detail::describe(centre),
                                       "; give a size above 0 and a centre, all finite."));
    }
    if (!(longest > 0)) throw mesh_error("All vertices of the mesh lie on one point, so it cannot be given a size.");
    const auto middle = (box.lower + box.upper) * 0.5;
    const double factor = size / longest;
    return detail::moved(mesh, [&](const auto& x) { return centre + (x - middle) * factor; });
}

}  // namespace firn::inline FIRN_BUILD
