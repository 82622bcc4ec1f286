/// \file Makes triangles for the renderer from the surfaces of solids and meshes.
#pragma once

#include "support/triangles.hpp"
#include <firn/data/mesh.hpp>

#include <cmath>
#include <cstdint>

namespace example {

/// Converts a point for the renderer.
template <class S, int D>
std::array<float, 3> drawn(const firn::Vec<S, D>& x) {
    return {float(x[0]), float(x[1]), D == 3 ? float(x[D - 1]) : 0.0F};
}

inline void add_triangle(Surface& surface, const std::array<std::uint32_t, 3>& triangle, std::uint8_t colour) {
    surface.triangles.push_back(triangle);
    surface.colour.push_back(colour);
}

inline void add_mesh(Surface& surface, const firn::TriangleMesh& mesh, std::uint8_t colour) {
    const auto first = std::uint32_t(surface.vertices.size());
    for (const auto& x : mesh.vertices) surface.vertices.push_back(drawn(x));
    for (const auto& [a, b, c] : mesh.triangles)
        add_triangle(surface, {first + std::uint32_t(a), first + std::uint32_t(b), first + std::uint32_t(c)}, colour);
}

/// A sphere of triangles of about the same size: an octahedron with each edge cut into `parts`, moved to the sphere.
inline firn::TriangleMesh sphere_mesh(const firn::Vec<double, 3>& centre, double radius, int parts = 24) {
    // The octahedron is two pyramids over the square |x| + |z| ≤ 1, which has a lattice of points.
    firn::TriangleMesh mesh;
    std::vector<std::int32_t> places;
    const int side = 2 * parts + 1;
    for (const int up : {1, -1}) {
        const auto place = [&](int i, int j) -> std::int32_t& {
            return places[std::size_t((up > 0 ? 0 : side * side) + i + side * j)];
        };
        places.resize(std::size_t(up > 0 ? side * side : 2 * side * side), -1);
        for (int j = 0; j < side; ++j)
            for (int i = 0; i < side; ++i) {
                const int a = i - parts, b = j - parts, height = parts - std::abs(a) - std::abs(b);
                if (height < 0) continue;
                if (up < 0 && height == 0) {  // both pyramids share this edge
                    place(i, j) = places[std::size_t(i + side * j)];
                    continue;
                }
                place(i, j) = std::int32_t(mesh.vertices.size());
                const firn::Vec<double, 3> x{double(a), double(up * height), double(b)};
                mesh.vertices.push_back(centre + x * (radius / firn::norm(x)));
            }
        for (int j = 0; j + 1 < side; ++j)
            for (int i = 0; i + 1 < side; ++i) {
                // Cells are cut along the edge between two faces of the octahedron.
                const bool rising = (i < parts) != (j < parts);
                const std::array<std::int32_t, 4> q{place(i, j), place(i + 1, j), place(i + 1, j + 1), place(i, j + 1)};
                for (const auto& t : rising ? std::array<std::array<int, 3>, 2>{{{0, 2, 1}, {0, 3, 2}}}
                                            : std::array<std::array<int, 3>, 2>{{{0, 3, 1}, {1, 3, 2}}}) {
                    std::array<std::int32_t, 3> triangle{q[std::size_t(t[0])], q[std::size_t(t[1])],
                                                         q[std::size_t(t[2])]};
                    if (triangle[0] < 0 || triangle[1] < 0 || triangle[2] < 0) continue;
                    if (up < 0) std::swap(triangle[1], triangle[2]);
                    mesh.triangles.push_back(triangle);
                }
            }
    }
    return mesh;
}

/// A post that stands upright on `foot`: a cylinder under half a sphere.
inline firn::TriangleMesh post_mesh(const firn::Vec<double, 3>& foot, double height, double radius) {
    firn::TriangleMesh mesh = sphere_mesh(foot, radius);
    for (auto& x : mesh.vertices) x[1] = x[1] < foot[1] ? foot[1] : x[1] + height - radius;
    return mesh;
}

inline firn::TriangleMesh box_mesh(const firn::Vec<double, 3>& lower, const firn::Vec<double, 3>& upper) {
    firn::TriangleMesh mesh;
    for (int k = 0; k < 8; ++k)
        mesh.vertices.push_back({(k & 1 ? upper : lower)[0], (k & 2 ? upper : lower)[1], (k & 4 ? upper : lower)[2]});
    mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return mesh;
}

}  // namespace example
