/// \file Draws particles as shaded spheres that merge into a surface, and surfaces of triangles among them, with soft
/// shadows on a floor.
///
///     example::Image image = example::render(cloud, {.domain = box});
///     example::write_png("out/last.png", image);
///
/// The same cloud and view give the same picture for any number of threads. One core draws 150,000 particles at
/// 1280 × 960 in less than three seconds.
#pragma once

#include <firn/core/error.hpp>

#include "image.hpp"
#include "shadow.hpp"
#include "splat.hpp"
#include "triangles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

namespace example {

/// The particles and surfaces to draw. Particles with a position that is not finite are skipped.
struct Cloud {
    std::vector<std::array<float, 3>> positions;
    std::vector<std::uint8_t> colour;  ///< number in the palette (modulo 9) for each particle; or empty: all 0
    std::vector<float> tone;  ///< for each particle, from 0 (darker) over ½ (unchanged) to 1 (lighter), or empty
    float radius = 0.01F;     ///< of particles; 0.6 (3D) or 0.75 (2D) of their distance closes the surface
    Surface surface{};        ///< drawn without smoothing; its shadows are as soft as those of particles
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
        length = std::max(bounds.empty() ? box.diagonal() : bounds.diagonal(), 1e-6F);

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

/// Draws the cloud.
/// \throws firn::parameter_error  if the radius is not above 0, if there are colours or tones, but not one for each
///         particle or triangle, if a triangle names a vertex that does not exist, or if width or height of the picture
///         is not from 1 to 8192
inline Image render(const Cloud& cloud, const View& view = {}) {
    detail::check(cloud, view);
    const detail::Scene scene(cloud, view);
    const float radius = cloud.radius;
    auto splats = splat(cloud.positions, radius, scene.camera, scene.width, scene.height);
    const auto grains = splats.depth;
    const float smoothing = std::clamp(view.smoothing, 0.0F, 1.0F);
    const float pixels = radius * scene.camera.scale(scene.camera.project(scene.box.centre()).depth);
    const float grain_free = !scene.flat ? 0.9F : pixels < 8.0F ? 0.96F : 0.7F;
    const float sigma = 1.3F * smoothing * std::min(pixels, 24.0F);
    for (const float width : {sigma, sigma / 3.0F}) smooth(splats.depth, splats.depth, width, 4.0F * radius);

    Buffer<Vec3> normals(scene.width, scene.height, Vec3{});
    for_rows(scene.height, [&](int y) {
        for (int x = 0; x < scene.width; ++x) {
            if (splats.depth.row(y)[x] != far_away) {
                normals.row(y)[x] = surface_normal(splats.depth, scene.camera, x, y);
            }
        }
    });
    for (const float width : {sigma, sigma / 3.0F}) smooth(normals, splats.depth, width, 4.0F * radius);
    for_rows(scene.height, [&](int y) {
        for (int x = 0; x < scene.width; ++x) {
            if (splats.depth.row(y)[x] == far_away) continue;
            const auto& centre = cloud.positions[splats.owner.row(y)[x]];
            const Vec3 grain =
                scene.camera.unproject(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F, grains.row(y)[x]);
            const Vec3 rough = normalised(grain - Vec3{{centre[0], centre[1], centre[2]}});
            normals.row(y)[x] = normalised(detail::mix(rough, normalised(normals.row(y)[x]), grain_free * smoothing));
        }
    });
    const bool has_surface = !cloud.surface.triangles.empty();
    const auto raster =
        rasterise(cloud.surface, scene.camera, has_surface ? scene.width : 0, has_surface ? scene.height : 0);
    const auto is_surface = [&](int x, int y) {
        return has_surface && raster.depth.row(y)[x] <= splats.depth.row(y)[x];
    };
    for_rows(has_surface ? scene.height : 0, [&](int y) {
        for (int x = 0; x < scene.width; ++x) {
            if (raster.depth.row(y)[x] == far_away || !is_surface(x, y)) continue;
            splats.depth.row(y)[x] = raster.depth.row(y)[x];
            normals.row(y)[x] = raster.normal.row(y)[x];
        }
    });
    const auto open = detail::openness(scene, splats.depth, normals);
    auto casters = points_on(cloud.surface, radius);
    casters.insert(casters.end(), cloud.positions.begin(), cloud.positions.end());
    const ShadowMap map(casters, radius, scene.bounds.empty() ? scene.box : scene.bounds, scene.to_light,
                        0.012F * scene.length);
    const PlaneShadow key(casters, radius, scene.plane, scene.to_light, 0.16F, 1.5F * radius);
    const PlaneShadow sky(casters, radius, scene.plane, scene.plane.normal, 0.9F, 3.0F * radius);

    const Vec3 sun = Vec3{{1.02F, 0.97F, 0.90F}} * (scene.flat ? 0.8F : 1.0F);
    const Vec3 sky_light{{0.44F, 0.50F, 0.58F}};
    const Vec3 bounce{{0.34F, 0.31F, 0.28F}};
    const Vec3 shade{{0.36F, 0.42F, 0.52F}};  // light on the background in the key light's shadow

    const auto surface = [&](int x, int y, float occlusion) {
        const Vec3 point =
            scene.camera.unproject(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F, splats.depth.row(y)[x]);
        const Vec3 normal = normals.row(y)[x];
        const bool of_surface = is_surface(x, y);
        const auto k = of_surface ? raster.owner.row(y)[x] : splats.owner.row(y)[x];
        const auto& colours = of_surface ? cloud.surface.colour : cloud.colour;
        Vec3 albedo = detail::palette()[colours.empty() ? 0U : colours[k] % detail::palette().size()];
        if (!of_surface && !cloud.tone.empty() && std::isfinite(cloud.tone[k])) {
            const float t = 2.0F * std::clamp(cloud.tone[k], 0.0F, 1.0F) - 1.0F;
            albedo = t < 0.0F ? albedo * (1.0F + 0.7F * t) : detail::mix(albedo, Vec3::filled(0.95F), 0.6F * t);
        }
        const Vec3 to_eye =
            normalised(scene.camera.orthographic ? scene.camera.forward * -1.0F : scene.camera.eye - point);
        const float facing = std::max(0.0F, firn::dot(normal, to_eye));
        const float towards = firn::dot(normal, scene.to_light);
        const float direct = towards > 0.0F ? towards * map.lit(point, normal) : 0.0F;
        const float upward = 0.5F + 0.5F * firn::dot(normal, scene.flat ? scene.camera.up : scene.plane.normal);
        const Vec3 ambient = detail::mix(bounce, sky_light, upward) * (occlusion * (0.65F + 0.35F * occlusion));
        const Vec3 half_way = normalised(scene.to_light + to_eye);
        const float shine = 0.10F * std::pow(std::max(0.0F, firn::dot(normal, half_way)), 28.0F) * direct;
        const float rim = 0.22F * std::pow(1.0F - facing, 3.0F) * upward * occlusion;
        return detail::times(albedo, sun * direct + ambient) + sun * shine + sky_light * rim;
    };
    const auto paper = [&](float px, float py, float occlusion) {
        const float depth = scene.plane_depth(px, py);
        const Vec3 colour = detail::backdrop(scene, px, py, depth);
        if (depth == far_away) return colour;
        const Vec3 point = scene.camera.unproject(px, py, depth);
        const float strength = scene.flat ? 0.45F : 0.75F;
        const float sunlit = 1.0F - strength * (1.0F - key.lit(point));
        const float skylit = (1.0F - 0.45F * (1.0F - sky.lit(point))) * (0.55F + 0.45F * occlusion);
        return detail::times(colour, detail::mix(shade, Vec3::filled(1.0F), sunlit)) * skylit;
    };

    Image image(view.width, view.height);
    constexpr int parts = detail::Scene::supersampling;
    for_rows(view.height, [&](int y) {
        for (int x = 0; x < view.width; ++x) {
            const float occlusion = open.row(y)[x];
            Vec3 light{};
            int misses = 0;
            for (int j = parts * y; j < parts * (y + 1); ++j) {
                for (int i = parts * x; i < parts * (x + 1); ++i) {
                    if (splats.depth.row(j)[i] == far_away) {
                        ++misses;
                    } else {
                        light += surface(i, j, occlusion);
                    }
                }
            }
            if (misses > 0) {
                const float px = (static_cast<float>(x) + 0.5F) * static_cast<float>(parts);
                const float py = (static_cast<float>(y) + 0.5F) * static_cast<float>(parts);
                light += paper(px, py, occlusion) * static_cast<float>(misses);
            }
            light = light * (1.0F / static_cast<float>(parts * parts));
            const float grain = detail::dither(x, y);
            image.at(x, y) = {detail::encoded(light[0], grain), detail::encoded(light[1], grain),
                              detail::encoded(light[2], grain)};
        }
    });
    return image;
}

}  // namespace example
