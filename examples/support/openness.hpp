/// \file How open to the sky the visible points are: ambient occlusion in screen space.
#pragma once

#include "scene.hpp"

#include <algorithm>
#include <cmath>

namespace example::detail {

/// Returns how open to the sky each pixel of the final picture is (after Mittring 2007). It takes points of a
/// hemisphere over the surface; those behind the visible depth are closed. The points turn from pixel to pixel in a 4 ×
/// 4 pattern, and a mean over 4 × 4 pixels of similar depth then removes the pattern.
inline Buffer<float> openness(const Scene& scene, const Buffer<float>& particles, const Buffer<Vec3>& normals) {
    constexpr int half = Scene::supersampling;
    const int width = scene.width / half;
    const int height = scene.height / half;
    Buffer<float> depth(width, height, far_away);
    for_rows(height, [&](int y) {
        for (int x = 0; x < width; ++x) {
            const float px = static_cast<float>(half * x) + 0.5F;
            const float py = static_cast<float>(half * y) + 0.5F;
            depth.row(y)[x] = std::min(particles.row(half * y)[half * x], scene.plane_depth(px, py));
        }
    });

    constexpr int count = 20;
    constexpr float golden_angle = 2.3999632F;
    const float radius = std::max(0.11F * scene.length, 3.0F * scene.cloud.radius);
    Buffer<float> rough(width, height, 1.0F);
    for_rows(height, [&](int y) {
        for (int x = 0; x < width; ++x) {
            const float here = depth.row(y)[x];
            if (here == far_away) continue;
            const bool on_plane = particles.row(half * y)[half * x] > here;
            const Vec3 normal = on_plane ? scene.plane.normal : normals.row(half * y)[half * x];
            const Vec3 point =
                scene.camera.unproject(static_cast<float>(half * x) + 0.5F, static_cast<float>(half * y) + 0.5F, here);
            if (on_plane) {
                const Vec3 away = point - scene.bounds.centre();
                if (scene.bounds.empty() || firn::norm(away) > scene.length) continue;
            }
            const Vec3 side = normalised(
                cross(normal, std::abs(normal[0]) < 0.6F ? Vec3{{1.0F, 0.0F, 0.0F}} : Vec3{{0.0F, 1.0F, 0.0F}}));
            const Vec3 other = cross(normal, side);
            const float turn = static_cast<float>((x & 3) * 4 + ((y & 3) ^ ((x & 1) * 2))) * (6.2831853F / 16.0F);
            float closed = 0.0F;
            for (int k = 0; k < count; ++k) {
                const float part = (static_cast<float>(k) + 0.5F) / static_cast<float>(count);
                const float sine = std::sqrt(0.96F * part);
                const float cosine = std::sqrt(1.0F - sine * sine);
                const float angle = golden_angle * static_cast<float>(k) + turn;
                const float length = radius * (0.15F + 0.85F * static_cast<float>((k * 7) % count) / count);
                const Vec3 sample = point + normal * (length * cosine + 0.06F * radius) +
                                    (side * std::cos(angle) + other * std::sin(angle)) * (length * sine);
                const auto seen = scene.camera.project(sample);
                const int i = static_cast<int>(std::floor(seen.x / half));
                const int j = static_cast<int>(std::floor(seen.y / half));
                if (seen.depth <= 0.0F || !depth.holds(i, j)) continue;
                const float behind = seen.depth - depth.row(j)[i];
                if (behind > 0.01F * radius) closed += 1.0F - smoothstep(0.6F * radius, 2.0F * radius, behind);
            }
            rough.row(y)[x] = 1.0F - closed / static_cast<float>(count);
        }
    });

    Buffer<float> open(width, height, 1.0F);
    for_rows(height, [&](int y) {
        for (int x = 0; x < width; ++x) {
            const float here = depth.row(y)[x];
            if (here == far_away) continue;
            float sum = 0.0F;
            float total = 0.0F;
            for (int j = y - 4; j < y + 4; ++j) {
                for (int i = x - 4; i < x + 4; ++i) {
                    if (!depth.holds(i, j) || !(std::abs(depth.row(j)[i] - here) < 0.4F * radius)) continue;
                    sum += rough.row(j)[i];
                    total += 1.0F;
                }
            }
            open.row(y)[x] = sum / total;
        }
    });
    return open;
}

}  // namespace example::detail
