/// \file Draws a cloud: see renderer.hpp.
#include "renderer.hpp"

#include "grains.hpp"
#include "openness.hpp"
#include "water.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace example {

namespace detail {

/// What is opaque: the nearest sphere or triangle at each pixel.
struct Opaque {
    Splats spheres;
    Buffer<Vec3> normal;  ///< of the nearest of both
    SurfaceRaster raster;
    Buffer<float> depth;  ///< of the nearest of both

    [[nodiscard]] bool is_surface(int x, int y) const {
        return raster.depth.width > 0 && raster.depth.row(y)[x] <= spheres.depth.row(y)[x];
    }
};

/// Draws the spheres, whose depths and normals are smoothed, and the triangles.
inline Opaque opaque(const Scene& scene, const Shown& shown, const Surface& surface, float smoothing) {
    const int width = scene.width, height = scene.height;
    const float radius = scene.cloud.radius;
    Splats splats{{width, height, far_away}, {width, height, 0}};
    std::size_t count = 0;
    for (const Spheres& kind : shown.spheres) {
        add_spheres(splats, kind.positions, kind.radius, scene.camera, count);
        count += kind.positions.size();
    }
    Buffer<Vec3> normals(width, height, Vec3{});
    if (count > 0) {
        const auto grains = splats.depth;
        const float pixels = radius * scene.camera.scale(scene.camera.project(scene.box.centre()).depth);
        const float grain_free = !scene.flat ? 0.9F : pixels < 8.0F ? 0.96F : 0.7F;
        const float sigma = 1.3F * smoothing * std::min(pixels, 24.0F);
        for (const float wide : {sigma, sigma / 3.0F}) smooth(splats.depth, splats.depth, wide, 4.0F * radius);
        for_rows(height, [&](int y) {
            for (int x = 0; x < width; ++x)
                if (splats.depth.row(y)[x] != far_away)
                    normals.row(y)[x] = surface_normal(splats.depth, scene.camera, x, y);
        });
        for (const float wide : {sigma, sigma / 3.0F}) smooth(normals, splats.depth, wide, 4.0F * radius);
        for_rows(height, [&](int y) {
            for (int x = 0; x < width; ++x) {
                if (splats.depth.row(y)[x] == far_away) continue;
                const auto& centre = shown.position(splats.owner.row(y)[x]);
                const Vec3 grain = scene.camera.unproject(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F,
                                                          grains.row(y)[x]);
                const Vec3 rough = normalised(grain - Vec3{{centre[0], centre[1], centre[2]}});
                normals.row(y)[x] = normalised(mix(rough, normalised(normals.row(y)[x]), grain_free * smoothing));
            }
        });
    }
    const bool has_surface = !surface.triangles.empty();
    auto raster = rasterise(surface, scene.camera, has_surface ? width : 0, has_surface ? height : 0);
    auto depth = splats.depth;
    for_rows(has_surface ? height : 0, [&](int y) {
        for (int x = 0; x < width; ++x) {
            if (raster.depth.row(y)[x] == far_away || raster.depth.row(y)[x] > depth.row(y)[x]) continue;
            depth.row(y)[x] = raster.depth.row(y)[x];
            normals.row(y)[x] = raster.normal.row(y)[x];
        }
    });
    return {std::move(splats), std::move(normals), std::move(raster), std::move(depth)};
}

/// The lights of a picture and their shadows: the light that comes from each of its points.
class Lighting {
public:
    Lighting(const Scene& scene, const Shown& shown, const Surface& surface, const Opaque& solid, bool has_frame)
        : scene_(scene),
          shown_(shown),
          surface_(surface),
          solid_(solid),
          casters_(casters_of(scene_)),
          map_(casters_, radius_, scene_.bounds.empty() || has_frame ? scene_.box : scene_.bounds, scene_.to_light,
               0.012F * scene_.length),
          key_(casters_, radius_, scene_.plane, scene_.to_light, 0.16F, 1.5F * radius_),
          sky_(casters_, radius_, scene_.plane, scene_.plane.normal, 0.9F, 3.0F * radius_),
          tinted_(shown_.wet, radius_, scene_.plane, scene_.to_light, 0.16F, 1.5F * radius_) {}

    /// The light from all that is opaque and from the background, at the picture's width and height.
    Buffer<Vec3> of_opaque(int width, int height) const {
        const auto open = openness(scene_, solid_.depth, solid_.normal);
        Buffer<Vec3> light(width, height, Vec3{});
        for_rows(height, [&](int y) {
            for (int x = 0; x < width; ++x) {
                const float occlusion = open.row(y)[x];
                Vec3 sum{};
                int misses = 0;
                for (int j = parts * y; j < parts * (y + 1); ++j) {
                    for (int i = parts * x; i < parts * (x + 1); ++i) {
                        if (solid_.depth.row(j)[i] == far_away) {
                            ++misses;
                        } else {
                            sum += of_solid(i, j, occlusion);
                        }
                    }
                }
                if (misses > 0) {
                    const float px = (static_cast<float>(x) + 0.5F) * static_cast<float>(parts);
                    const float py = (static_cast<float>(y) + 0.5F) * static_cast<float>(parts);
                    sum += of_paper(px, py, occlusion) * static_cast<float>(misses);
                }
                light.row(y)[x] = sum * (1.0F / static_cast<float>(parts * parts));
            }
        });
        return light;
    }

    /// Puts the water before the light from what is behind it.
    void add_water(Buffer<Vec3>& light) const {
        const auto dry = light;
        const auto water = rasterise(shown_.water, scene_.camera, scene_.width, scene_.height);
        const auto thick = thickness(scene_, shown_.wet, radius_ / 0.6F, solid_.depth);
        for_rows(light.height, [&](int y) {
            for (int x = 0; x < light.width; ++x) {
                Vec3 sum{};
                int hits = 0;
                for (int j = parts * y; j < parts * (y + 1); ++j) {
                    for (int i = parts * x; i < parts * (x + 1); ++i) {
                        const float depth = water.depth.row(j)[i];
                        if (depth == far_away || depth > solid_.depth.row(j)[i]) continue;
                        ++hits;
                        const Vec3 point =
                            scene_.camera.unproject(static_cast<float>(i) + 0.5F, static_cast<float>(j) + 0.5F, depth);
                        const Vec3 normal = water.normal.row(j)[i];
                        const float deep = thick.row(y)[x];
                        // Light from behind is bent towards where the surface leans.
                        const float bend =
                            0.3F * std::min(deep, 0.1F * scene_.length) * scene_.camera.scale(depth) / parts;
                        int u = x - static_cast<int>(std::lround(bend * firn::dot(normal, scene_.camera.right)));
                        int v = y + static_cast<int>(std::lround(bend * firn::dot(normal, scene_.camera.up)));
                        if (!dry.holds(u, v) || solid_.depth.row(parts * v)[parts * u] < depth) {
                            u = x;
                            v = y;
                        }
                        sum += light_of_water(scene_,
                                              {normal, to_eye_from(point), deep, map_.lit(point, normal),
                                               colour_of(shown_.water.colour, water.owner.row(j)[i]), dry.row(v)[u]},
                                              sun_, sky_light_);
                    }
                }
                const int all = parts * parts;
                if (hits > 0) light.row(y)[x] = (dry.row(y)[x] * static_cast<float>(all - hits) + sum) * (1.0F / all);
            }
        });
    }

private:
    static constexpr int parts = Scene::supersampling;

    /// What throws shadows: surfaces, and particles but those of water.
    static std::vector<std::array<float, 3>> casters_of(const Scene& scene) {
        const Cloud& cloud = scene.cloud;
        auto casters = points_on(cloud.surface, cloud.radius);
        for (std::size_t k = 0; k < cloud.positions.size(); ++k)
            if (cloud.look.empty() || scene.flat || cloud.look[k] != Look::water) casters.push_back(cloud.positions[k]);
        return casters;
    }
    static Vec3 colour_of(const std::vector<std::uint8_t>& colours, std::size_t k) {
        return palette()[colours.empty() ? 0U : colours[k] % palette().size()];
    }
    Vec3 to_eye_from(const Vec3& point) const {
        return normalised(scene_.camera.orthographic ? scene_.camera.forward * -1.0F : scene_.camera.eye - point);
    }
    /// The share of light that a pixel of what is opaque reflects, and how it looks.
    std::pair<Vec3, Look> albedo_of(int x, int y) const {
        const Cloud& cloud = scene_.cloud;
        Vec3 albedo;
        Look look = Look::skin;
        if (solid_.is_surface(x, y)) {
            albedo = colour_of(surface_.colour, solid_.raster.owner.row(y)[x]);
        } else {
            const std::size_t sphere = solid_.spheres.owner.row(y)[x];
            const auto k = shown_.particle(sphere);
            look = cloud.look.empty() || scene_.flat ? Look::ball : cloud.look[k];
            albedo = colour_of(cloud.colour, k);
            if (!cloud.tone.empty() && std::isfinite(cloud.tone[k])) {
                const float t = 2.0F * std::clamp(cloud.tone[k], 0.0F, 1.0F) - 1.0F;
                albedo = t < 0.0F ? albedo * (1.0F + 0.7F * t) : mix(albedo, Vec3::filled(0.95F), 0.6F * t);
            }
            const float luck = chance(static_cast<std::uint32_t>(sphere), 99);
            if (look == Look::water) albedo = mix(albedo, Vec3::filled(1.0F), 0.65F);  // spray
            if (look == Look::snow) albedo = albedo * (0.97F + 0.06F * luck);
            if (look == Look::sand) albedo = albedo * (0.72F + 0.45F * luck);
        }
        return {albedo, look};
    }
    Vec3 of_solid(int x, int y, float occlusion) const {
        const Vec3 point =
            scene_.camera.unproject(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F, solid_.depth.row(y)[x]);
        const Vec3 normal = solid_.normal.row(y)[x];
        const auto [albedo, look] = albedo_of(x, y);
        const bool is_snow = look == Look::snow;
        const Vec3 to_eye = to_eye_from(point);
        const float facing = std::max(0.0F, firn::dot(normal, to_eye));
        const float towards = firn::dot(normal, scene_.to_light);
        // Light goes through grains of snow, also to their sides away from the sun.
        const float wrap = is_snow ? 0.4F : 0.0F;
        const float direct = towards > -wrap
                                 ? (towards + wrap) / (1.0F + wrap) * map_.lit(point, normal) * (is_snow ? 0.9F : 1.0F)
                                 : 0.0F;
        const float upward = 0.5F + 0.5F * firn::dot(normal, scene_.flat ? scene_.camera.up : scene_.plane.normal);
        const float closed = is_snow ? 0.5F + 0.5F * occlusion : occlusion;
        const Vec3 ambient = mix(bounce_, sky_light_, upward) * (closed * (0.65F + 0.35F * closed));
        const Vec3 half_way = normalised(scene_.to_light + to_eye);
        const float gloss = look == Look::sand ? 0.02F : 0.10F;
        const float shine = gloss * std::pow(std::max(0.0F, firn::dot(normal, half_way)), 28.0F) * direct;
        const float rim = 0.22F * std::pow(1.0F - facing, 3.0F) * upward * occlusion;
        return times(albedo, sun_ * direct + ambient) + sun_ * shine + sky_light_ * rim;
    }
    Vec3 of_paper(float px, float py, float occlusion) const {
        const float depth = scene_.plane_depth(px, py);
        const Vec3 colour = backdrop(scene_, px, py, depth);
        if (depth == far_away) return colour;
        const Vec3 point = scene_.camera.unproject(px, py, depth);
        const float strength = scene_.flat ? 0.45F : 0.75F;
        float sunlit = 1.0F - strength * (1.0F - key_.lit(point));
        if (!shown_.water.triangles.empty()) sunlit *= 1.0F - 0.3F * (1.0F - tinted_.lit(point));
        const float skylit = (1.0F - 0.45F * (1.0F - sky_.lit(point))) * (0.55F + 0.45F * occlusion);
        return times(colour, mix(shade_, Vec3::filled(1.0F), sunlit)) * skylit;
    }

    const Scene& scene_;
    const Shown& shown_;
    const Surface& surface_;
    const Opaque& solid_;
    float radius_ = scene_.cloud.radius;
    std::vector<std::array<float, 3>> casters_;
    ShadowMap map_;
    PlaneShadow key_, sky_, tinted_;

    Vec3 sun_ = Vec3{{1.02F, 0.97F, 0.90F}} * (scene_.flat ? 0.8F : 1.0F);
    Vec3 sky_light_{{0.44F, 0.50F, 0.58F}};
    Vec3 bounce_{{0.34F, 0.31F, 0.28F}};
    Vec3 shade_{{0.36F, 0.42F, 0.52F}};  ///< light on the background in the key light's shadow
};

}  // namespace detail

Image render(const Cloud& cloud, const View& view) {
    detail::check(cloud, view);
    const detail::Scene scene(cloud, view);
    const detail::Shown shown = detail::shown(cloud, scene.flat);
    Surface surface = cloud.surface;
    if (!shown.skins.triangles.empty()) detail::append(surface, shown.skins);
    const auto solid = detail::opaque(scene, shown, surface, std::clamp(view.smoothing, 0.0F, 1.0F));

    const detail::Lighting lighting(scene, shown, surface, solid, bool(view.frame));
    auto light = lighting.of_opaque(view.width, view.height);
    if (!shown.water.triangles.empty()) lighting.add_water(light);

    Image image(view.width, view.height);
    for_rows(view.height, [&](int y) {
        for (int x = 0; x < view.width; ++x) {
            const Vec3& l = light.row(y)[x];
            const float grain = detail::dither(x, y);
            image.at(x, y) = {detail::encoded(l[0], grain), detail::encoded(l[1], grain), detail::encoded(l[2], grain)};
        }
    });
    return image;
}

}  // namespace example
