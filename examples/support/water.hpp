/// \file Clear water over what lies behind it: the light that comes through is bent and, with the thickness, coloured
/// (Lambert and Beer); the surface reflects the sky (Fresnel, in Schlick's form) and the sun.
#pragma once

#include "scene.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace example::detail {

/// The light from the sky and the ground, as a mirror shows it.
inline Vec3 mirrored(float upward) {
    return mix(Vec3{{0.62F, 0.62F, 0.60F}}, mix(Vec3{{0.86F, 0.88F, 0.90F}}, Vec3{{0.50F, 0.60F, 0.72F}}, upward),
               smoothstep(-0.15F, 0.1F, upward));
}

/// The thickness of water before what is opaque, per pixel of the final picture, in units of the scene: each particle
/// adds its share, and a blur makes it smooth.
/// \param depth  of what is opaque, supersampled
inline Buffer<float> thickness(const Scene& scene, const std::vector<std::array<float, 3>>& wet, float spacing,
                               const Buffer<float>& depth) {
    constexpr int parts = Scene::supersampling;
    Buffer<float> sum(scene.width / parts, scene.height / parts, 0.0F);
    const float radius = 0.9F * spacing;
    // A ball of this radius and the thickness t √(1 − q) has the volume spacing³.
    const float middle = spacing * spacing * spacing / (2.0F / 3.0F * 3.14159265F * radius * radius);
    for (const auto& x : wet) {
        const auto centre = scene.camera.project({{x[0], x[1], x[2]}});
        if (!scene.camera.orthographic && centre.depth <= radius) continue;
        const float size = std::max(0.71F, radius * scene.camera.scale(centre.depth) / parts);
        for_disc(centre.x / parts, centre.y / parts, size, sum.width, sum.height, [&](int i, int j, float q) {
            if (centre.depth < depth.row(parts * j)[parts * i]) sum.row(j)[i] += middle * std::sqrt(1.0F - q);
        });
    }
    const float pixels = radius * scene.camera.scale(scene.camera.project(scene.box.centre()).depth) / parts;
    const int reach = std::clamp(static_cast<int>(1.5F * pixels), 1, 40);
    for (const bool across : {true, false}) {
        const auto from = sum;
        for_rows(sum.height, [&](int y) {
            for (int x = 0; x < sum.width; ++x) {
                float total = 0.0F, weights = 0.0F;
                for (int k = -reach; k <= reach; ++k) {
                    const int i = across ? x + k : x, j = across ? y : y + k;
                    if (!from.holds(i, j)) continue;
                    const float part = static_cast<float>(k) / static_cast<float>(reach + 1);
                    const float weight = (1.0F - part * part) * (1.0F - part * part);
                    total += weight * from.row(j)[i];
                    weights += weight;
                }
                sum.row(y)[x] = total / weights;
            }
        });
    }
    return sum;
}

/// What is known of the water at a point of its surface.
struct WaterPoint {
    Vec3 normal, to_eye;
    float thickness;
    float sunlit;  ///< how much of the sun arrives: 0 … 1
    Vec3 colour;   ///< of the palette
    Vec3 behind;   ///< light from behind
};

/// The light that comes from a point of the water's surface.
inline Vec3 light_of_water(const Scene& scene, const WaterPoint& at, const Vec3& sun, const Vec3& sky) {
    const float facing = std::clamp(firn::dot(at.normal, at.to_eye), 0.0F, 1.0F);
    const float mirror = 0.02F + 0.98F * std::pow(1.0F - facing, 5.0F);
    const Vec3 reflected = at.normal * (2.0F * facing) - at.to_eye;
    const Vec3 half_way = normalised(scene.to_light + at.to_eye);
    const float glint = 0.9F * at.sunlit * std::pow(std::max(0.0F, firn::dot(at.normal, half_way)), 160.0F);

    const float lengths = at.thickness / (0.10F * scene.length);
    const Vec3 clear = mix(at.colour, Vec3::filled(1.0F), 0.42F);
    Vec3 through{};
    for (int c = 0; c < 3; ++c) through[c] = std::pow(clear[c], lengths);
    // A little of the light is scattered back, so that deep water is not black.
    const float towards = std::max(0.0F, firn::dot(at.normal, scene.to_light));
    const Vec3 scattered =
        times(mix(at.colour, Vec3::filled(1.0F), 0.10F), sun * (0.25F + 0.45F * towards * at.sunlit) + sky * 0.5F) *
        (1.0F - std::exp(-0.9F * lengths));
    return (times(at.behind, through) * std::exp(-0.35F * lengths) + scattered) * (1.0F - mirror) +
           mirrored(firn::dot(reflected, scene.plane.normal)) * mirror + sun * glint;
}

}  // namespace example::detail
