/// \file The spheres and skins that show the particles of a cloud: each particle is a ball, some grains, or part of a
/// skin.
#pragma once

#include "scene.hpp"
#include "skin.hpp"

#include <array>
#include <cstdint>
#include <map>
#include <vector>

namespace example::detail {

/// Spheres of one radius, each for a particle.
struct Spheres {
    std::vector<std::array<float, 3>> positions;
    std::vector<std::uint32_t> particles;
    float radius = 0.0F;

    void add(const std::array<float, 3>& position, std::uint32_t particle) {
        positions.push_back(position);
        particles.push_back(particle);
    }
};

/// A number from 0 to 1 that depends on two others alone.
inline float chance(std::uint32_t a, std::uint32_t b) {
    std::uint32_t x = a * 0x9E3779B1U ^ (b + 0x7F4A7C15U) * 0x85EBCA77U;
    x = (x ^ x >> 15) * 0x2C1B3C6DU;
    x = (x ^ x >> 12) * 0x297A2D39U;
    x ^= x >> 15;
    return static_cast<float>(x >> 8) / 16777216.0F;
}

/// Adds `count` grains at random places around a particle.
inline void add_grains(Spheres& grains, const std::array<float, 3>& centre, std::uint32_t particle, std::uint32_t count,
                       float spread) {
    for (std::uint32_t g = 0; g < count; ++g) {
        std::array<float, 3> x = centre;
        for (std::uint32_t a = 0; a < 3; ++a) x[a] += spread * (2.0F * chance(particle, 3 * g + a) - 1.0F);
        grains.add(x, particle);
    }
}

/// What shows the particles.
struct Shown {
    std::array<Spheres, 4> spheres;  ///< balls, grains of snow, grains of sand, drops
    Surface skins;
    Surface water;
    std::vector<std::array<float, 3>> wet;  ///< the particles of water that is not drops

    /// The particle of a sphere, which counts on through the spheres of all kinds.
    [[nodiscard]] std::uint32_t particle(std::size_t sphere) const {
        for (const Spheres& kind : spheres) {
            if (sphere < kind.particles.size()) return kind.particles[sphere];
            sphere -= kind.particles.size();
        }
        return 0;
    }
    [[nodiscard]] const std::array<float, 3>& position(std::size_t sphere) const {
        std::size_t kind = 0;
        while (sphere >= spheres[kind].positions.size()) sphere -= spheres[kind++].positions.size();
        return spheres[kind].positions[sphere];
    }
    [[nodiscard]] bool is_drop(std::size_t sphere) const {
        return sphere >= spheres[0].particles.size() + spheres[1].particles.size() + spheres[2].particles.size();
    }
};

inline Shown shown(const Cloud& cloud, bool flat) {
    Shown result;
    const float spacing = cloud.radius / 0.6F;
    result.spheres[0].radius = cloud.radius;
    result.spheres[1].radius = 0.26F * spacing;
    result.spheres[2].radius = 0.28F * spacing;
    result.spheres[3].radius = 0.4F * spacing;
    std::map<std::uint8_t, Body> skins, water;  // by colour
    for (std::uint32_t k = 0; k < cloud.positions.size(); ++k) {
        const auto& x = cloud.positions[k];
        if (!finite(x)) continue;
        const std::uint8_t colour = cloud.colour.empty() ? std::uint8_t(0) : cloud.colour[k];
        switch (cloud.look.empty() || flat ? Look::ball : cloud.look[k]) {
            case Look::ball:
                result.spheres[0].add(x, k);
                break;
            case Look::snow:
                add_grains(result.spheres[1], x, k, 8, 0.55F * spacing);
                break;
            case Look::sand:
                add_grains(result.spheres[2], x, k, 6, 0.5F * spacing);
                break;
            case Look::skin:
                skins[colour].particles.push_back(k);
                break;
            case Look::water:
                water[colour].particles.push_back(k);
                break;
        }
    }
    for (auto& [colour, body] : skins) {
        body.colour = colour;
        for (const auto k : add_skin(result.skins, cloud.positions, cloud.shape, body, spacing))
            result.spheres[0].add(cloud.positions[k], k);
    }
    for (auto& [colour, body] : water) {
        body.colour = colour;
        std::vector<bool> is_drop(cloud.positions.size());
        for (const auto k : add_skin(result.water, cloud.positions, {}, body, spacing)) {
            result.spheres[3].add(cloud.positions[k], k);
            is_drop[k] = true;
        }
        for (const auto k : body.particles)
            if (!is_drop[k]) result.wet.push_back(cloud.positions[k]);
    }
    return result;
}

/// Adds the triangles of another surface.
inline void append(Surface& surface, const Surface& other) {
    const auto first = std::uint32_t(surface.vertices.size());
    surface.colour.resize(surface.triangles.size(), 0);
    surface.normals.resize(surface.vertices.size(), {0.0F, 0.0F, 0.0F});
    surface.vertices.insert(surface.vertices.end(), other.vertices.begin(), other.vertices.end());
    surface.normals.insert(surface.normals.end(), other.normals.begin(), other.normals.end());
    surface.colour.insert(surface.colour.end(), other.colour.begin(), other.colour.end());
    for (const auto& [a, b, c] : other.triangles) surface.triangles.push_back({first + a, first + b, first + c});
}

}  // namespace example::detail
