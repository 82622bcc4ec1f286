/// \file What the renderer draws and how it is seen: a cloud, a view, and the scene that follows from both, with its
/// camera, floor and background.
#pragma once

#include <firn/core/error.hpp>

#include "shadow.hpp"
#include "triangles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace example {

/// How a particle is drawn: as a ball; or together with others of its colour, under a skin or as clear water; or as
/// some grains.
enum class Look : std::uint8_t { ball, skin, water, snow, sand };

/// How a material's particles are drawn: what deforms and does not flow, with a skin.
inline Look look_of(std::string_view material, bool has_deformation) {
    const auto is = [&](const char* part) { return material.find(part) != std::string_view::npos; };
    if (is("fluid")) return Look::water;
    if (is("snow")) return Look::snow;
    if (is("sand") || is("nacc")) return Look::sand;
    return has_deformation ? Look::skin : Look::ball;
}

/// The particles and surfaces to draw. Particles with a position that is not finite are skipped.
struct Cloud {
    std::vector<std::array<float, 3>> positions;
    std::vector<std::uint8_t> colour;  ///< number in the palette (modulo 9) for each particle; or empty: all 0
    std::vector<float> tone;    ///< for each particle, from 0 (darker) over ½ (unchanged) to 1 (lighter), or empty
    std::vector<Look> look{};   ///< for each particle, or empty: all balls. Flat clouds are drawn as balls.
    std::vector<Mat3> shape{};  ///< the deformation gradient for each particle, which skins follow, or empty: I
    float radius = 0.01F;       ///< of particles; 0.6 (3D) or 0.75 (2D) of their distance closes the surface
    Surface surface{};          ///< drawn without smoothing; its shadows are as soft as those of particles
};

/// The view and size of the picture. If all particles have z = 0, the view is from the front, without perspective.
struct View {
    Vec3 direction{{-0.55F, -0.38F, -1.0F}};  ///< from the eye to the scene
    Vec3 up{{0.0F, 1.0F, 0.0F}};
    std::optional<Box> frame{};   ///< the part of the scene that the picture shows; by default the particles
    std::optional<Box> domain{};  ///< its floor is drawn; by default, the floor is below the lowest particle
    int width = 1280;
    int height = 960;
    float smoothing = 1.0F;  ///< 0 shows every grain, 1 a closed surface
};

namespace detail {

/// Converts between sRGB (IEC 61966-2-1) and linear light.
inline float linear(float encoded) {
    return encoded <= 0.04045F ? encoded / 12.92F : std::pow((encoded + 0.055F) / 1.055F, 2.4F);
}
inline std::uint8_t encoded(float light, float grain) {
    const float x = std::clamp(light, 0.0F, 1.0F);
    const float y = x <= 0.0031308F ? 12.92F * x : 1.055F * std::pow(x, 1.0F / 2.4F) - 0.055F;
    return static_cast<std::uint8_t>(std::clamp(std::floor(255.0F * y + grain), 0.0F, 255.0F));
}
/// A fixed pattern of values from 0 to 1, for rounding gradients without bands (interleaved gradient noise, Jimenez
/// 2014).
inline float dither(int x, int y) {
    const float a = 0.06711056F * static_cast<float>(x) + 0.00583715F * static_cast<float>(y);
    const float b = 52.9829189F * (a - std::floor(a));
    return b - std::floor(b);
}
inline Vec3 from_hex(std::uint32_t rgb) {
    const auto channel = [&](int shift) { return linear(static_cast<float>((rgb >> shift) & 0xFFU) / 255.0F); };
    return {{channel(16), channel(8), channel(0)}};
}
inline Vec3 mix(const Vec3& a, const Vec3& b, float t) { return a * (1.0F - t) + b * t; }
inline Vec3 times(const Vec3& a, const Vec3& b) { return {{a[0] * b[0], a[1] * b[1], a[2] * b[2]}}; }
inline float smoothstep(float lower, float upper, float x) {
    const float t = std::clamp((x - lower) / (upper - lower), 0.0F, 1.0F);
    return t * t * (3.0F - 2.0F * t);
}

/// Coral, teal, amber, indigo, moss, plum, slate, sand, snow.
inline const std::array<Vec3, 9>& palette() {
    static const std::array<Vec3, 9> colours{from_hex(0xEE6A50), from_hex(0x1F9E9A), from_hex(0xF0AE3C),
                                             from_hex(0x5468B4), from_hex(0x77A24C), from_hex(0xA3589C),
                                             from_hex(0x71828F), from_hex(0xD6BC94), from_hex(0xE9EEF3)};
    return colours;
}

/// Data that the passes share.
struct Scene {
    static constexpr int supersampling = 2;

    const Cloud& cloud;
    bool flat = false;
    Box bounds;  // of the particles
    Box box;     // of the part that the picture shows
    Camera camera{};
    Plane plane{};  // the floor; behind the particles in a flat scene
    std::optional<Box> domain;
    Vec3 to_light{};
    float length = 1.0F;  // of the scene; effects are proportional to it
    int width, height;    // of the supersampled picture

    Scene(const Cloud& c, const View& view)
        : cloud(c), domain(view.domain), width(supersampling * view.width), height(supersampling * view.height) {
        flat = true;
        for (const auto& p : cloud.positions) {
            if (!finite(p)) continue;
            bounds.include({{p[0], p[1], p[2]}});
            flat = flat && p[2] == 0.0F;
        }
        for (const auto& p : cloud.surface.vertices) {
            if (!finite(p)) continue;
            bounds.include({{p[0], p[1], p[2]}});
            flat = false;
        }
        flat = flat && !bounds.empty();
        const Vec3 grown = Vec3::filled(cloud.radius);
        if (!bounds.empty()) bounds = {bounds.lower - grown, bounds.upper + grown};
        box = view.frame ? *view.frame : !bounds.empty() ? bounds : domain ? *domain : Box{{}, Vec3::filled(1.0F)};
        // A given frame is the same for every picture of a film; so are the effects then.
        length = std::max(bounds.empty() || view.frame ? box.diagonal() : bounds.diagonal(), 1e-6F);

        camera = flat ? looking({{0.0F, 0.0F, -1.0F}}, {{0.0F, 1.0F, 0.0F}}) : looking(view.direction, view.up);
        camera.orthographic = flat;
        frame(camera, box, width, height, 0.07F, 0.24F);

        const Vec3 up = flat ? Vec3{{0.0F, 0.0F, 1.0F}} : normalised(view.up);
        plane.normal = up;
        plane.u = camera.right;
        plane.v = cross(up, plane.u);
        if (flat) {
            plane.origin = {{0.0F, 0.0F, -std::max(cloud.radius, 0.015F * length)}};  // so that the shadow is visible
            to_light = normalised({{-0.35F, 0.6F, 0.9F}});
        } else {
            const Box& ground = domain ? *domain : bounds.empty() ? box : bounds;
            float lowest = far_away;
            for (int k = 0; k < 8; ++k) lowest = std::min(lowest, firn::dot(ground.corner(k), up));
            plane.origin = up * lowest;
            to_light = normalised(camera.right * -0.85F + up * 1.1F + plane.v * -0.35F);
        }
    }

    /// The depth of the plane at a pixel; far_away above the horizon, and if the camera is below the plane.
    [[nodiscard]] float plane_depth(float x, float y) const {
        const Vec3 a = camera.unproject(x, y, 1.0F);
        const Vec3 b = camera.unproject(x, y, 2.0F);
        const float fall = plane.height(a) - plane.height(b);
        if (fall < 1e-5F || plane.height(camera.eye) < 0.0F) return far_away;
        return 1.0F + plane.height(a) / fall;
    }
};

/// How much a line covers a point: 1 on the line, falling to 0 within a pixel's footprint. Thin lines fade.
inline float line(float distance, float half_width, float footprint) {
    const float edge = std::max(footprint, half_width);
    return (half_width / edge) * (1.0F - smoothstep(edge - 0.5F * footprint, edge + 0.5F * footprint, distance));
}

/// The background: a gentle gradient, with the domain's floor drawn on it.
inline Vec3 backdrop(const Scene& scene, float x, float y, float depth) {
    const float across = (x / static_cast<float>(scene.width) - 0.5F) * 2.0F;
    const float down = y / static_cast<float>(scene.height);
    const Vec3 top = from_hex(0xDCE4EA);
    const Vec3 bottom = from_hex(0xF6F4F0);
    const float corner = across * across + 4.0F * (down - 0.5F) * (down - 0.5F);
    Vec3 colour = mix(top, bottom, smoothstep(0.0F, 0.85F, down)) * (1.0F - 0.05F * corner);
    if (!scene.domain || depth == far_away) return colour;

    const Vec3 point = scene.camera.unproject(x, y, depth);
    const Box& box = *scene.domain;
    const int axes[2] = {0, scene.flat ? 1 : 2};
    const float size = std::max(box.upper[axes[0]] - box.lower[axes[0]], box.upper[axes[1]] - box.lower[axes[1]]);
    const float slant = std::abs(firn::dot(normalised(point - scene.camera.eye), scene.plane.normal));
    const float footprint = 2.0F / scene.camera.scale(depth) / std::max(scene.camera.orthographic ? 1.0F : slant, 0.1F);
    const float thin = 0.0009F * size;
    float beyond = 0.0F;      // squared distance from the rectangle
    float within = far_away;  // distance to its nearest side
    float grid = 0.0F;
    for (const int axis : axes) {
        const float side = std::min(point[axis] - box.lower[axis], box.upper[axis] - point[axis]);
        const float outside = std::max(0.0F, -side);
        beyond += outside * outside;
        within = std::min(within, side);
        const float cell = 0.1F * size;
        const float steps = (point[axis] - box.lower[axis]) / cell;
        grid = std::max(grid, line(std::abs(steps - std::round(steps)) * cell, thin, footprint));
    }
    const float border = line(within < 0.0F ? std::sqrt(beyond) : within, 2.0F * thin, footprint);
    const float inside = smoothstep(-0.5F * footprint, 0.5F * footprint, within);
    const Vec3 ink = from_hex(0x6F8496);
    colour = mix(colour, Vec3::filled(1.0F), 0.35F * inside);
    colour = mix(colour, ink, 0.22F * grid * inside);
    return mix(colour, ink, 0.6F * border);
}

inline void check(const Cloud& cloud, const View& view) {
    using firn::sentence;
    const auto count = cloud.positions.size();
    if (!(std::isfinite(cloud.radius) && cloud.radius > 0.0F)) {
        throw firn::parameter_error(
            sentence("The particles' radius is ", cloud.radius, "; give a finite length above 0."));
    }
    if (!cloud.colour.empty() && cloud.colour.size() != count) {
        throw firn::parameter_error(sentence("There are ", count, " particles and ", cloud.colour.size(),
                                             " colours; give one for each particle, or none."));
    }
    if (!cloud.tone.empty() && cloud.tone.size() != count) {
        throw firn::parameter_error(sentence("There are ", count, " particles and ", cloud.tone.size(),
                                             " tones; give one for each particle, or none."));
    }
    if (!cloud.look.empty() && cloud.look.size() != count) {
        throw firn::parameter_error(sentence("There are ", count, " particles and ", cloud.look.size(),
                                             " looks; give one for each particle, or none."));
    }
    if (!cloud.shape.empty() && cloud.shape.size() != count) {
        throw firn::parameter_error(sentence("There are ", count, " particles and ", cloud.shape.size(),
                                             " shapes; give one for each particle, or none."));
    }
    if (!cloud.surface.colour.empty() && cloud.surface.colour.size() != cloud.surface.triangles.size()) {
        throw firn::parameter_error(sentence("There are ", cloud.surface.triangles.size(), " triangles and ",
                                             cloud.surface.colour.size(),
                                             " colours; give one for each triangle, or none."));
    }
    for (const auto& triangle : cloud.surface.triangles) {
        for (const auto vertex : triangle) {
            if (vertex < cloud.surface.vertices.size()) continue;
            throw firn::parameter_error(sentence("A triangle names vertex ", vertex, ", but there are ",
                                                 cloud.surface.vertices.size(), ", counted from 0."));
        }
    }
    if (view.width < 1 || view.height < 1 || view.width > 8192 || view.height > 8192) {
        throw firn::parameter_error(sentence("The picture has ", view.width, " × ", view.height,
                                             " pixels; both numbers must lie between 1 and 8192."));
    }
}

}  // namespace detail

}  // namespace example
