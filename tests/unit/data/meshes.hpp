/// \file Closed meshes with known volumes, for the tests of data/ and io/.
#pragma once

#include <firn/data/mesh.hpp>

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace test_meshes {

using firn::TriangleMesh;
using firn::Vec;

/// The axis-aligned box: 12 triangles, outwards.
inline TriangleMesh box(const Vec<double, 3>& lower, const Vec<double, 3>& upper) {
    TriangleMesh mesh;
    for (int i = 0; i < 8; ++i) {
        mesh.vertices.push_back(
            {i & 1 ? upper[0] : lower[0], i & 2 ? upper[1] : lower[1], i & 4 ? upper[2] : lower[2]});
    }
    mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return mesh;
}
inline TriangleMesh unit_cube() { return box({0, 0, 0}, {1, 1, 1}); }

/// An icosahedron split `levels` times onto the sphere: 20 · 4^levels triangles, outwards.
inline TriangleMesh sphere(const Vec<double, 3>& centre, double radius, int levels) {
    const double g = std::numbers::phi;
    TriangleMesh mesh;
    mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                     {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                      {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                      {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    for (int level = 0; level < levels; ++level) {
        std::map<std::pair<int, int>, std::int32_t> middles;
        const auto middle = [&](std::int32_t a, std::int32_t b) {
            const auto [at, is_new] = middles.try_emplace(std::minmax(a, b), std::int32_t(mesh.vertices.size()));
            if (is_new) mesh.vertices.push_back((mesh.vertices[std::size_t(a)] + mesh.vertices[std::size_t(b)]) * 0.5);
            return at->second;
        };
        std::vector<std::array<std::int32_t, 3>> finer;
        for (const auto& [a, b, c] : mesh.triangles) {
            const auto ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
        }
        mesh.triangles = finer;
    }
    for (auto& x : mesh.vertices) x = centre + x * (radius / norm(x));
    return mesh;
}

/// Both surfaces in one mesh.
inline TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
    const auto shift = std::int32_t(a.vertices.size());
    a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
    for (const auto& [i, j, k] : b.triangles) a.triangles.push_back({i + shift, j + shift, k + shift});
    return a;
}

}  // namespace test_meshes
