/// \file Draws particles as spheres into buffers of depths and particle numbers, and smooths the depths.
#pragma once

#include "camera.hpp"
#include "rows.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

namespace example {

constexpr float far_away = std::numeric_limits<float>::infinity();

/// One value per pixel, row by row from the top.
template <class T>
struct Buffer {
    int width, height;
    std::vector<T> values;

    Buffer(int w, int h, const T& value)
        : width(w), height(h), values(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), value) {}
    [[nodiscard]] T* row(int y) { return values.data() + static_cast<std::ptrdiff_t>(y) * width; }
    [[nodiscard]] const T* row(int y) const { return values.data() + static_cast<std::ptrdiff_t>(y) * width; }
    [[nodiscard]] bool holds(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }
};

struct Splats {
    Buffer<float> depth;          ///< of the nearest sphere, or far_away
    Buffer<std::uint32_t> owner;  ///< number of the nearest sphere
};

inline bool finite(const std::array<float, 3>& p) {
    return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
}

/// Calls paint(x, y, q) for each pixel of the disc. q is its squared distance from the middle in radii (0 to 1).
template <class Paint>
void for_disc(float x, float y, float radius, int width, int height, const Paint& paint) {
    if (!(x + radius >= 0.0F && y + radius >= 0.0F && x - radius <= static_cast<float>(width) &&
          y - radius <= static_cast<float>(height))) {
        return;
    }
    const int y_begin = std::max(0, static_cast<int>(std::ceil(y - radius - 0.5F)));
    const int y_end = std::min(height - 1, static_cast<int>(std::floor(y + radius - 0.5F)));
    const int x_begin = std::max(0, static_cast<int>(std::ceil(x - radius - 0.5F)));
    const int x_end = std::min(width - 1, static_cast<int>(std::floor(x + radius - 0.5F)));
    const float inverse = 1.0F / (radius * radius);
    for (int j = y_begin; j <= y_end; ++j) {
        const float dy = static_cast<float>(j) + 0.5F - y;
        for (int i = x_begin; i <= x_end; ++i) {
            const float dx = static_cast<float>(i) + 0.5F - x;
            const float q = (dx * dx + dy * dy) * inverse;
            if (q <= 1.0F) paint(i, j, q);
        }
    }
}

/// Draws spheres of one radius (in units of the scene). Positions that are not finite are skipped. A sphere smaller
/// than a pixel is drawn as one pixel.
/// \param first  number of the first sphere
inline void add_spheres(Splats& splats, const std::vector<std::array<float, 3>>& positions, float radius,
                        const Camera& camera, std::size_t first = 0) {
    const int width = splats.depth.width, height = splats.depth.height;
    for (std::size_t k = 0; k < positions.size(); ++k) {
        if (!finite(positions[k])) continue;
        const auto centre = camera.project({{positions[k][0], positions[k][1], positions[k][2]}});
        if (!camera.orthographic && centre.depth <= radius) continue;
        const float size = std::max(0.71F, radius * camera.scale(centre.depth));
        for_disc(centre.x, centre.y, size, width, height, [&](int x, int y, float q) {
            float& nearest = splats.depth.row(y)[x];
            if (centre.depth - radius >= nearest) return;
            const float depth = centre.depth - radius * std::sqrt(1.0F - q);
            if (depth < nearest) {
                nearest = depth;
                splats.owner.row(y)[x] = static_cast<std::uint32_t>(first + k);
            }
        });
    }
}

inline Splats splat(const std::vector<std::array<float, 3>>& positions, float radius, const Camera& camera, int width,
                    int height) {
    Splats splats{{width, height, far_away}, {width, height, 0}};
    add_spheres(splats, positions, radius, camera);
    return splats;
}

/// A bilateral filter (Tomasi and Manduchi 1998), along rows and then columns. The weight of a neighbour is a Gaussian
/// of `sigma` pixels times (1 − δ² / range²)², where δ is the difference in depth. Filtering the depths themselves
/// turns a heap of spheres into a surface. A wide filter uses only some of the pixels; a second filter of a third of
/// the width removes the pattern that this leaves.
template <class T>
void smooth(Buffer<T>& values, const Buffer<float>& guide, float sigma, float range) {
    if (sigma < 0.3F) return;
    const int stride = std::max(1, static_cast<int>(sigma / 6.0F));
    const int reach = static_cast<int>(std::ceil(2.2F * sigma / static_cast<float>(stride)));
    std::vector<float> weights;
    for (int k = -reach; k <= reach; ++k) {
        const float x = static_cast<float>(k * stride) / sigma;
        weights.push_back(std::exp(-0.5F * x * x));
    }
    const float inverse_range = 1.0F / (range * range);
    const auto along = [&](const Buffer<T>& from, const Buffer<float>& depth, Buffer<T>& to, int dx, int dy) {
        for_rows(from.height, [&](int y) {
            for (int x = 0; x < from.width; ++x) {
                const float here = depth.row(y)[x];
                if (here == far_away) continue;
                T sum = from.row(y)[x] * 0.0F;
                float total = 0.0F;
                for (int k = -reach; k <= reach; ++k) {
                    const int i = x + k * dx;
                    const int j = y + k * dy;
                    if (!from.holds(i, j)) continue;
                    const float difference = depth.row(j)[i] - here;
                    const float likeness = 1.0F - difference * difference * inverse_range;
                    if (!(likeness > 0.0F)) continue;
                    const float weight = weights[static_cast<std::size_t>(k + reach)] * likeness * likeness;
                    sum += from.row(j)[i] * weight;
                    total += weight;
                }
                to.row(y)[x] = sum * (1.0F / total);
            }
        });
    };
    Buffer<T> between = values;
    along(values, guide, between, stride, 0);
    if constexpr (std::is_same_v<T, float>) {
        const bool by_itself = &values == &guide;
        along(between, by_itself ? between : guide, values, 0, stride);
    } else {
        along(between, guide, values, 0, stride);
    }
}

/// The unit normal of the surface under a pixel, towards the camera. In each direction it uses the neighbour with the
/// more similar depth, so that silhouettes stay sharp.
inline Vec3 surface_normal(const Buffer<float>& depth, const Camera& camera, int x, int y) {
    const float here = depth.row(y)[x];
    const auto at = [&](int i, int j) { return depth.holds(i, j) ? depth.row(j)[i] : far_away; };
    const auto point = [&](int i, int j, float d) {
        return camera.unproject(static_cast<float>(i) + 0.5F, static_cast<float>(j) + 0.5F, d);
    };
    const Vec3 p = point(x, y, here);
    const auto tangent = [&](int dx, int dy) {
        const float before = at(x - dx, y - dy);
        const float after = at(x + dx, y + dy);
        if (before == far_away && after == far_away) {
            return point(x + dx, y + dy, here) - p;
        }
        if (std::abs(after - here) <= std::abs(before - here)) return point(x + dx, y + dy, after) - p;
        return p - point(x - dx, y - dy, before);
    };
    const Vec3 normal = normalised(cross(tangent(0, 1), tangent(1, 0)));
    const Vec3 to_eye = camera.orthographic ? camera.forward * -1.0F : normalised(camera.eye - p);
    return normalised(normal + to_eye * std::max(0.0F, 0.12F - firn::dot(normal, to_eye)));
}

}  // namespace example
