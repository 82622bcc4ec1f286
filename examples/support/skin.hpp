/// \file Skins: the closed surface of a body of particles, as triangles to draw. \see firn/data/surface.hpp
#pragma once

#include <firn/data/surface.hpp>

#include "triangles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace example {

namespace detail {

/// Gives normals to the vertices from `first_vertex` on, which only the triangles from `first_triangle` on use: means
/// of the triangles', weighted by area, and then of the neighbours'.
inline void add_normals(Surface& surface, std::size_t first_vertex, std::size_t first_triangle) {
    const std::size_t count = surface.vertices.size() - first_vertex;
    std::vector<Vec3> own(count, Vec3{{0.0F, 0.0F, 0.0F}});
    for (std::size_t t = first_triangle; t < surface.triangles.size(); ++t) {
        const auto [a, b, c] = surface.corners(t);
        for (const auto v : surface.triangles[t]) own[v - first_vertex] += cross(b - a, c - a);
    }
    for (auto& n : own) n = normalised(n);
    auto sum = own;
    for (std::size_t t = first_triangle; t < surface.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k)
            sum[surface.triangles[t][k] - first_vertex] += own[surface.triangles[t][(k + 1) % 3] - first_vertex];
    surface.normals.resize(first_vertex, {0.0F, 0.0F, 0.0F});
    for (const Vec3& of_neighbours : sum) {
        const Vec3 n = normalised(of_neighbours);
        surface.normals.push_back({n[0], n[1], n[2]});
    }
}

/// Returns a place amid particles: the median along each axis.
inline Vec3 middle_of(const std::vector<std::array<float, 3>>& positions, const std::vector<std::uint32_t>& particles) {
    Vec3 middle{};
    std::vector<float> along(particles.size());
    for (std::size_t a = 0; a < 3; ++a) {
        std::transform(particles.begin(), particles.end(), along.begin(), [&](auto k) { return positions[k][a]; });
        const auto half = along.begin() + std::ptrdiff_t(along.size() / 2);
        std::nth_element(along.begin(), half, along.end());
        middle[int(a)] = *half;
    }
    return middle;
}

}  // namespace detail

/// A body of particles to be covered by a skin.
struct Body {
    std::vector<std::uint32_t> particles;  ///< numbers in the positions
    std::uint8_t colour = 0;               ///< of the skin
};

/// Adds the skin of some particles to `surface`. Returns the particles that it leaves out, because they are alone.
/// \param spacing  distance of the undeformed particles
/// \param shapes   their deformation gradients; or empty: I
inline std::vector<std::uint32_t> add_skin(Surface& surface, const std::vector<std::array<float, 3>>& positions,
                                           const std::vector<Mat3>& shapes, const Body& body, float spacing) {
    std::vector<std::uint32_t> alone, covered;
    const Vec3 middle = detail::middle_of(positions, body.particles);
    for (const auto k : body.particles) {
        float away = 0.0F;
        for (std::size_t a = 0; a < 3; ++a) away = std::max(away, std::abs(positions[k][a] - middle[int(a)]));
        (away < 1e5F * spacing ? covered : alone).push_back(k);  // others have flown off
    }
    std::vector<firn::Vec<double, 3>> places;
    std::vector<firn::Mat<double, 3>> gradients;
    for (const auto k : covered) {
        places.push_back({double(positions[k][0]), double(positions[k][1]), double(positions[k][2])});
        if (shapes.empty()) continue;
        const bool finite = std::isfinite(firn::squared_norm(shapes[k]));
        gradients.push_back(firn::cast<double>(finite ? shapes[k] : Mat3::identity()));
    }
    const double volume = std::pow(double(spacing), 3);
    const auto skin = firn::surface_of({places, std::span(&volume, 1), gradients}, {.radius = 3.6, .separate = false});
    for (const auto k : skin.alone) alone.push_back(covered[k]);

    const std::size_t first_vertex = surface.vertices.size(), first_triangle = surface.triangles.size();
    surface.colour.resize(first_triangle, 0);
    for (const auto& x : skin.vertices) surface.vertices.push_back({float(x[0]), float(x[1]), float(x[2])});
    for (const auto& corners : skin.triangles) {
        auto& added = surface.triangles.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) added[k] = std::uint32_t(first_vertex + std::size_t(corners[k]));
    }
    surface.colour.resize(surface.triangles.size(), body.colour);
    detail::add_normals(surface, first_vertex, first_triangle);
    return alone;
}

}  // namespace example
