/// \file Skins: the closed surface of a body of particles, as triangles.
///
/// Each particle is an ellipsoid. The field φ(x) = Σ w(|F⁻¹ (x − xₚ)| / h) counts them, with a smooth kernel w of the
/// radius h and the particle's deformation gradient F. Its scale is such that φ = 1 inside a body, however the body is
/// deformed: stretched matter has no holes. The skin is where φ has a smaller value.
#pragma once

#include "ellipsoid.hpp"
#include "triangles.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace example {

namespace detail {

/// A field on a lattice, stored in blocks of 8³ nodes where it is not 0.
class Field {
public:
    static constexpr int side = 8;
    using Index = std::array<int, 3>;

    explicit Field(float cell) : cell_(cell) {}

    /// Adds scale · (1 − |to_ball (x − centre)|²)³ in the ellipsoid. Returns whether it lies on the lattice.
    bool add(const Vec3& centre, const Mat3& to_ball, const Vec3& reach, float scale) {
        Index first, last;
        for (int a = 0; a < 3; ++a) {
            if (!(std::abs(centre[a]) + reach[a] < 4e6F * cell_)) return false;
            first[std::size_t(a)] = int(std::ceil((centre[a] - reach[a]) / cell_));
            last[std::size_t(a)] = int(std::floor((centre[a] + reach[a]) / cell_));
        }
        const Vec3 along{{to_ball(0, 0) * cell_, to_ball(1, 0) * cell_, to_ball(2, 0) * cell_}};
        // Blocks reach a node further, so that every node beside one where the field is not 0 is stored.
        const auto block = [](int node) { return node >> 3; };
        for (int bz = block(first[2] - 1); bz <= block(last[2] + 1); ++bz)
            for (int by = block(first[1] - 1); by <= block(last[1] + 1); ++by)
                for (int bx = block(first[0] - 1); bx <= block(last[0] + 1); ++bx) {
                    auto& values = blocks_[std::size_t(made({bx, by, bz}))].values;
                    const Index from{std::max(first[0], side * bx), std::max(first[1], side * by),
                                     std::max(first[2], side * bz)};
                    const Index to{std::min(last[0], side * bx + side - 1), std::min(last[1], side * by + side - 1),
                                   std::min(last[2], side * bz + side - 1)};
                    for (int k = from[2]; k <= to[2]; ++k)
                        for (int j = from[1]; j <= to[1]; ++j) {
                            const Vec3 start = to_ball * (Vec3{{float(from[0]), float(j), float(k)}} * cell_ - centre);
                            float* row = values.data() + place(from[0] & 7, j & 7, k & 7);
                            for (int i = 0; i <= to[0] - from[0]; ++i) {
                                const Vec3 q = start + along * float(i);
                                const float rest = std::max(0.0F, 1.0F - firn::dot(q, q));
                                row[i] += scale * rest * rest * rest;
                            }
                        }
                }
        return true;
    }

    /// Whether the field is above `level` at a node beside a point: the one nearest to it and the 26 around.
    [[nodiscard]] bool reaches(float level, const Vec3& x) const {
        Index node{};
        for (int a = 0; a < 3; ++a) {
            if (!(std::abs(x[a]) < 4e6F * cell_)) return false;
            node[std::size_t(a)] = int(std::lround(x[a] / cell_));
        }
        for (int n = 0; n < 27; ++n) {
            const int i = node[0] + n % 3 - 1, j = node[1] + n / 3 % 3 - 1, k = node[2] + n / 9 - 1;
            const auto block = found_.find(key({i >> 3, j >> 3, k >> 3}));
            if (block != found_.end() && blocks_[block->second].values[place(i & 7, j & 7, k & 7)] > level) return true;
        }
        return false;
    }

    /// Adds the surface where the field is `level` to `surface`, as vertices and pairs of triangles, by surface nets
    /// (Gibson 1998): each cell that the surface crosses has one vertex, the mean of the crossings of its edges.
    void add_surface(Surface& surface, float level) {
        for (Block& block : blocks_) place_vertices(surface, block, level);
        for (const Block& block : blocks_) connect(surface, block, level);
    }

private:
    static constexpr std::uint32_t none = ~std::uint32_t(0);
    struct Block {
        Index at;
        std::array<float, side * side * side> values{};
        std::vector<std::uint32_t> vertices{};  // one per cell, where the surface crosses the block
    };

    static std::size_t place(int i, int j, int k) { return std::size_t(i + side * (j + side * k)); }
    static std::uint64_t key(const Index& at) {
        std::uint64_t result = 0;
        for (const int a : at) result = result << 21 | std::uint64_t(a + (1 << 20));
        return result;
    }
    std::uint32_t made(const Index& at) {
        if (!blocks_.empty() && blocks_[latest_].at == at) return latest_;
        const auto [entry, is_new] = found_.try_emplace(key(at), std::uint32_t(blocks_.size()));
        if (is_new) blocks_.push_back({at});
        return latest_ = entry->second;
    }
    /// The blocks at `at` and one further in each direction of `step`, or null: 8 pointers, in the order of bits.
    [[nodiscard]] std::array<const Block*, 8> neighbours(const Index& at, int step) const {
        std::array<const Block*, 8> result{};
        for (int n = 0; n < 8; ++n) {
            const auto entry =
                found_.find(key({at[0] + (n & 1 ? step : 0), at[1] + (n & 2 ? step : 0), at[2] + (n & 4 ? step : 0)}));
            result[std::size_t(n)] = entry == found_.end() ? nullptr : &blocks_[entry->second];
        }
        return result;
    }
    /// The values at the block's nodes and those one further: 9³ of them.
    using Values = std::array<float, (side + 1) * (side + 1) * (side + 1)>;
    static std::size_t place_in_values(int i, int j, int k) {
        return std::size_t(i + (side + 1) * (j + (side + 1) * k));
    }
    [[nodiscard]] bool values_around(const Block& block, float level, Values& values) const {
        const auto near = neighbours(block.at, 1);
        bool above = false, below = false;
        for (int k = 0; k <= side; ++k)
            for (int j = 0; j <= side; ++j)
                for (int i = 0; i <= side; ++i) {
                    const Block* from = near[std::size_t((i >> 3) + 2 * (j >> 3) + 4 * (k >> 3))];
                    const float value = from ? from->values[place(i & 7, j & 7, k & 7)] : 0.0F;
                    values[place_in_values(i, j, k)] = value;
                    (value > level ? above : below) = true;
                }
        return above && below;
    }

    void place_vertices(Surface& surface, Block& block, float level) {
        Values values;
        if (!values_around(block, level, values)) return;
        block.vertices.assign(block.values.size(), none);
        for (int k = 0; k < side; ++k)
            for (int j = 0; j < side; ++j)
                for (int i = 0; i < side; ++i) {
                    std::array<float, 8> corner;
                    int inside = 0;
                    for (int n = 0; n < 8; ++n) {
                        corner[std::size_t(n)] = values[place_in_values(i + (n & 1), j + (n >> 1 & 1), k + (n >> 2))];
                        inside |= int(corner[std::size_t(n)] > level) << n;
                    }
                    if (inside == 0 || inside == 255) continue;
                    Vec3 sum{{0.0F, 0.0F, 0.0F}};
                    float crossings = 0.0F;
                    for (int n = 0; n < 8; ++n)
                        for (int a = 0; a < 3; ++a) {
                            const int m = n | 1 << a;
                            if (m == n || ((inside >> n & 1) == (inside >> m & 1))) continue;
                            const float start = corner[std::size_t(n)], end = corner[std::size_t(m)];
                            Vec3 x{{float(n & 1), float(n >> 1 & 1), float(n >> 2)}};
                            x[a] = (level - start) / (end - start);
                            sum += x;
                            crossings += 1.0F;
                        }
                    const Vec3 node{
                        {float(side * block.at[0] + i), float(side * block.at[1] + j), float(side * block.at[2] + k)}};
                    const Vec3 x = (node + sum * (1.0F / crossings)) * cell_;
                    block.vertices[place(i, j, k)] = std::uint32_t(surface.vertices.size());
                    surface.vertices.push_back({x[0], x[1], x[2]});
                }
    }

    void connect(Surface& surface, const Block& block, float level) const {
        Values values;
        if (!values_around(block, level, values)) return;
        const auto before = neighbours(block.at, -1);
        const auto vertex = [&](const Index& cell) {
            int n = 0;
            for (std::size_t a = 0; a < 3; ++a) n |= int(cell[a] < 0) << a;
            return before[std::size_t(n)]->vertices[place(cell[0] & 7, cell[1] & 7, cell[2] & 7)];
        };
        for (int k = 0; k < side; ++k)
            for (int j = 0; j < side; ++j)
                for (int i = 0; i < side; ++i) {
                    const auto above = [&](int x, int y, int z) { return values[place_in_values(x, y, z)] > level; };
                    const bool inside = above(i, j, k);
                    for (std::size_t a = 0; a < 3; ++a) {
                        if (inside == above(i + (a == 0), j + (a == 1), k + (a == 2))) continue;
                        // The cells around the edge, counterclockwise when seen from its end.
                        const std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
                        std::array<std::uint32_t, 4> quad{};
                        for (std::size_t n = 0; n < 4; ++n) {
                            Index cell{i, j, k};
                            cell[b] -= n == 0 || n == 3;
                            cell[c] -= n < 2;
                            quad[n] = vertex(cell);
                        }
                        if (!inside) std::swap(quad[1], quad[3]);
                        surface.triangles.push_back({quad[0], quad[1], quad[2]});
                        surface.triangles.push_back({quad[0], quad[2], quad[3]});
                    }
                }
    }

    float cell_;
    std::vector<Block> blocks_;
    std::unordered_map<std::uint64_t, std::uint32_t> found_;
    std::uint32_t latest_ = 0;
};

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
    constexpr float reach_in_spacings = 2.5F;
    const float radius = reach_in_spacings * spacing;  // of the kernel, h
    constexpr float level = 0.4F;
    // ∫ (1 − r²/h²)³ dx = 64 π h³ / 315, and there is one particle per spacing³.
    const float scale = 315.0F / (64.0F * 3.14159265F * reach_in_spacings * reach_in_spacings * reach_in_spacings);
    detail::Field field(0.75F * spacing);
    const auto at = [&](std::uint32_t k) { return Vec3{{positions[k][0], positions[k][1], positions[k][2]}}; };
    std::vector<std::uint32_t> alone;
    for (const auto k : body.particles) {
        const Mat3 shape = shapes.empty() ? Mat3::identity() : drawable(shapes[k]);
        Vec3 reach{};
        for (int i = 0; i < 3; ++i) reach[i] = radius * firn::norm(Vec3{{shape(i, 0), shape(i, 1), shape(i, 2)}});
        field.add(at(k), inverse(shape) * (1.0F / radius), reach, scale);
    }
    for (const auto k : body.particles)
        if (!field.reaches(level, at(k))) alone.push_back(k);

    const std::size_t first_vertex = surface.vertices.size(), first_triangle = surface.triangles.size();
    surface.colour.resize(first_triangle, 0);
    field.add_surface(surface, level);
    surface.colour.resize(surface.triangles.size(), body.colour);
    detail::add_normals(surface, first_vertex, first_triangle);
    return alone;
}

}  // namespace example
