/// \file Draws triangles into buffers of depths, normals and triangle numbers, and makes points to cast their shadows.
#pragma once

#include "splat.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace example {

/// Surfaces that are visible from both sides. A triangle with a corner that is not finite is skipped.
struct Surface {
    std::vector<std::array<float, 3>> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< three vertex numbers each
    std::vector<std::uint8_t> colour;                     ///< number in the palette for each triangle, or empty for 0
    std::vector<std::array<float, 3>> normals{};  ///< at the first vertices; where 0, and at others, by the triangles

    [[nodiscard]] std::array<Vec3, 3> corners(std::size_t triangle) const {
        std::array<Vec3, 3> x;
        for (std::size_t k = 0; k < 3; ++k) {
            const auto& p = vertices[triangles[triangle][k]];
            x[k] = {{p[0], p[1], p[2]}};
        }
        return x;
    }
    [[nodiscard]] bool is_drawn(std::size_t triangle) const {
        const auto& [a, b, c] = triangles[triangle];
        return finite(vertices[a]) && finite(vertices[b]) && finite(vertices[c]);
    }
};

/// The visible part of a surface, per pixel.
struct SurfaceRaster {
    Buffer<float> depth;          ///< far_away if there is no triangle
    Buffer<std::uint32_t> owner;  ///< number of the triangle
    Buffer<Vec3> normal;          ///< unit normals towards the eye
};

namespace detail {

/// Returns a normal for each corner of each triangle: the mean around the vertex, weighted by area. If the surface
/// bends by more than 32° there, it is the triangle's normal, so that edges stay sharp. A vertex may have its own.
inline std::vector<std::array<Vec3, 3>> corner_normals(const Surface& surface) {
    std::vector<Vec3> sums(surface.vertices.size(), Vec3{});
    std::vector<Vec3> own(surface.triangles.size(), Vec3{});
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        if (!surface.is_drawn(t)) continue;
        const auto [a, b, c] = surface.corners(t);
        own[t] = cross(b - a, c - a);
        for (const auto vertex : surface.triangles[t]) sums[vertex] += own[t];
    }
    std::vector<std::array<Vec3, 3>> normals(surface.triangles.size());
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        const Vec3 flat = normalised(own[t]);
        for (std::size_t k = 0; k < 3; ++k) {
            const auto vertex = surface.triangles[t][k];
            if (vertex < surface.normals.size()) {
                const auto& n = surface.normals[vertex];
                normals[t][k] = {{n[0], n[1], n[2]}};
                if (firn::dot(normals[t][k], normals[t][k]) > 0.25F) continue;
            }
            const Vec3 mean = normalised(sums[vertex]);
            normals[t][k] = firn::dot(mean, flat) > 0.85F ? mean : flat;
        }
    }
    return normals;
}

/// A point's signed distance from the line from a to b, times a constant. The line from b to a gives exactly the
/// negative value, in spite of rounding, so that there is no gap between two triangles.
inline float side(const Projected& a, const Projected& b, float x, float y) {
    if (std::pair(b.x, b.y) < std::pair(a.x, a.y)) return -side(b, a, x, y);
    return (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
}

}  // namespace detail

/// Draws the triangles, except those that reach behind the eye.
inline SurfaceRaster rasterise(const Surface& surface, const Camera& camera, int width, int height) {
    SurfaceRaster raster{{width, height, far_away}, {width, height, 0}, {width, height, Vec3{}}};
    const auto normals = detail::corner_normals(surface);
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        if (!surface.is_drawn(t)) continue;
        std::array<Projected, 3> p{};
        bool behind = false;
        const auto corners = surface.corners(t);
        for (std::size_t k = 0; k < 3; ++k) {
            p[k] = camera.project(corners[k]);
            behind = behind || (!camera.orthographic && p[k].depth <= 0.0F);
        }
        const float area = detail::side(p[0], p[1], p[2].x, p[2].y);
        if (behind || !(std::abs(area) > 1e-9F)) continue;
        const auto [left, right] = std::minmax({p[0].x, p[1].x, p[2].x});
        const auto [top, bottom] = std::minmax({p[0].y, p[1].y, p[2].y});
        const auto pixel = [](float at, int most) {
            return static_cast<int>(std::clamp(at, -1.0F, static_cast<float>(most)));
        };
        const int x_begin = std::max(0, pixel(std::ceil(left - 0.5F), width));
        const int x_end = std::min(width - 1, pixel(std::floor(right - 0.5F), width));
        const int y_begin = std::max(0, pixel(std::ceil(top - 0.5F), height));
        const int y_end = std::min(height - 1, pixel(std::floor(bottom - 0.5F), height));
        for (int y = y_begin; y <= y_end; ++y) {
            for (int x = x_begin; x <= x_end; ++x) {
                const float px = static_cast<float>(x) + 0.5F;
                const float py = static_cast<float>(y) + 0.5F;
                std::array<float, 3> weight{};  // on the screen, later in space
                float sum = 0.0F;
                bool inside = true;
                for (std::size_t k = 0; k < 3; ++k) {
                    weight[k] = detail::side(p[(k + 1) % 3], p[(k + 2) % 3], px, py) / area;
                    inside = inside && weight[k] >= 0.0F;
                    if (!camera.orthographic) weight[k] /= p[k].depth;
                    sum += weight[k];
                }
                if (!inside) continue;
                float depth = 0.0F;
                for (std::size_t k = 0; k < 3; ++k) depth += weight[k] / sum * p[k].depth;
                float& nearest = raster.depth.row(y)[x];
                if (depth >= nearest) continue;
                nearest = depth;
                raster.owner.row(y)[x] = static_cast<std::uint32_t>(t);
                Vec3 normal{};
                for (std::size_t k = 0; k < 3; ++k) normal += normals[t][k] * (weight[k] / sum);
                const Vec3 to_eye = camera.orthographic ? camera.forward * -1.0F
                                                        : normalised(camera.eye - camera.unproject(px, py, depth));
                normal = normalised(normal);
                // The triangle decides which side is visible; near a silhouette the smooth normal may be wrong.
                const Vec3 own = cross(corners[1] - corners[0], corners[2] - corners[0]);
                if (firn::dot(own, to_eye) < 0.0F) normal = normal * -1.0F;
                raster.normal.row(y)[x] =
                    normalised(normal + to_eye * std::max(0.0F, 0.12F - firn::dot(normal, to_eye)));
            }
        }
    }
    return raster;
}

/// Returns points on the triangles, at most `spacing` apart. Spheres of this radius cover the triangles.
inline std::vector<std::array<float, 3>> points_on(const Surface& surface, float spacing) {
    std::vector<std::array<float, 3>> points;
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        if (!surface.is_drawn(t)) continue;
        const auto [a, b, c] = surface.corners(t);
        const float longest = std::max({firn::norm(b - a), firn::norm(c - b), firn::norm(a - c)});
        const int steps = static_cast<int>(std::clamp(std::ceil(longest / spacing), 1.0F, 256.0F));
        for (int i = 0; i <= steps; ++i) {
            for (int j = 0; i + j <= steps; ++j) {
                const Vec3 x = a + (b - a) * (static_cast<float>(i) / static_cast<float>(steps)) +
                               (c - a) * (static_cast<float>(j) / static_cast<float>(steps));
                points.push_back({x[0], x[1], x[2]});
            }
        }
    }
    return points;
}

}  // namespace example
