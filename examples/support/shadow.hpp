/// \file Soft shadows by percentage-closer filtering (Reeves, Salesin and Cook 1987). Shadows of particles on particles
/// use a map of depths seen from the light; those on a plane use a summed-area table.
#pragma once

#include "splat.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace example {

/// The depths of the particles, seen from the light.
class ShadowMap {
public:
    /// `softness`: the half-width of the shadow's edge in units of the scene.
    ShadowMap(const std::vector<std::array<float, 3>>& positions, float radius, const Box& bounds, const Vec3& to_light,
              float softness)
        : camera_(look(bounds, radius, to_light)),
          radius_(radius),
          spread_(softness * camera_.focal / reach),
          depth_(splat(positions, radius, camera_, size, size).depth) {}

    /// How much of the light arrives at a point of the particles' surface: 0 … 1.
    [[nodiscard]] float lit(const Vec3& point, const Vec3& normal) const {
        const auto seen = camera_.project(point + normal * (2.5F * radius_));
        float sum = 0.0F;
        float total = 0.0F;
        for (int j = -reach; j <= reach; ++j) {
            for (int i = -reach; i <= reach; ++i) {
                const float weight = static_cast<float>((reach + 1) * (reach + 1) - (i * i + j * j) / 2);
                sum += weight * lit_at(seen.x + static_cast<float>(i) * spread_,
                                       seen.y + static_cast<float>(j) * spread_, seen.depth);
                total += weight;
            }
        }
        return sum / total;
    }

private:
    static constexpr int size = 1024;
    static constexpr int reach = 3;

    static Camera look(const Box& bounds, float radius, const Vec3& to_light) {
        Camera camera = looking(to_light * -1.0F, {{0.0F, 1.0F, 0.0F}});
        const float extent = 0.5F * bounds.diagonal() + 2.0F * radius;
        camera.orthographic = true;
        camera.middle_x = camera.middle_y = 0.5F * static_cast<float>(size);
        camera.focal = camera.middle_x / extent;
        camera.eye = bounds.centre() + to_light * (2.0F * extent);
        return camera;
    }
    // A blocker counts fully only if it is two radii or more before the point, so that grains do not shade each other.
    [[nodiscard]] float lit_at(float x, float y, float depth) const {
        const auto i = static_cast<int>(std::floor(x));
        const auto j = static_cast<int>(std::floor(y));
        if (!depth_.holds(i, j)) return 1.0F;
        const float before = (depth - depth_.row(j)[i]) / radius_;
        return 1.0F - std::clamp(0.5F * before, 0.0F, 1.0F);
    }

    Camera camera_;
    float radius_;
    float spread_;
    Buffer<float> depth_;
};

/// A plane that receives shadows: an origin, two unit vectors in the plane, and its normal.
struct Plane {
    Vec3 origin, u, v, normal;

    [[nodiscard]] float height(const Vec3& p) const { return firn::dot(p - origin, normal); }
};

/// The particles' shadow on a plane, sharper where they touch it. It is a mean over a square, from a summed-area table
/// (Crow 1984), so its edge may have any width. The width grows with the mean height of the particles that cast the
/// shadow (Fernando 2005).
class PlaneShadow {
public:
    /// \param opening  width of the shadow's edge over the height of the particles that cast it
    /// \param least    smallest width of the edge
    PlaneShadow(const std::vector<std::array<float, 3>>& positions, float radius, const Plane& plane,
                const Vec3& to_light, float opening, float least)
        : plane_(plane), opening_(opening), least_(least) {
        const float down = 1.0F / std::max(firn::dot(to_light, plane.normal), 0.05F);
        struct Footprint {
            float u, v, height;
        };
        std::vector<Footprint> feet;
        feet.reserve(positions.size());
        float lower[2] = {0.0F, 0.0F};
        float upper[2] = {0.0F, 0.0F};
        for (const auto& position : positions) {
            if (!finite(position)) continue;
            const Vec3 p{{position[0], position[1], position[2]}};
            const float height = plane.height(p);
            if (height < -radius) continue;
            const Vec3 q = p - to_light * (height * down) - plane.origin;
            const float at[2] = {firn::dot(q, plane.u), firn::dot(q, plane.v)};
            for (int d = 0; d < 2; ++d) {
                lower[d] = feet.empty() ? at[d] : std::min(lower[d], at[d]);
                upper[d] = feet.empty() ? at[d] : std::max(upper[d], at[d]);
            }
            feet.push_back({at[0], at[1], std::max(height, 0.0F)});
            highest_ = std::max(highest_, height);
        }
        if (feet.empty()) return;
        const float extent = std::max({upper[0] - lower[0], upper[1] - lower[1], radius});
        texel_ = (extent + 2.0F * radius) / static_cast<float>(size - 4);
        for (int d = 0; d < 2; ++d) start_[d] = lower[d] - radius - 2.0F * texel_;
        Buffer<float> lowest(size, size, far_away);
        for (const auto& foot : feet) {
            for_disc((foot.u - start_[0]) / texel_, (foot.v - start_[1]) / texel_, std::max(1.0F, radius / texel_),
                     size, size, [&](int x, int y, float) {
                         float& height = lowest.row(y)[x];
                         height = std::min(height, foot.height);
                     });
        }
        sums_ = std::vector<Sum>(static_cast<std::size_t>((size + 1) * (size + 1)));
        for (int y = 0; y < size; ++y) {
            Sum row;
            for (int x = 0; x < size; ++x) {
                const float height = lowest.row(y)[x];
                if (height != far_away) {
                    row.cover += 1.0;
                    row.height += static_cast<double>(height);
                }
                const Sum& above = table(x + 1, y);
                sums_[place(x + 1, y + 1)] = {row.cover + above.cover, row.height + above.height};
            }
        }
    }

    /// How much of the light arrives at a point of the plane: 0 … 1.
    [[nodiscard]] float lit(const Vec3& point) const {
        if (sums_.empty()) return 1.0F;
        const Vec3 q = point - plane_.origin;
        const float x = (firn::dot(q, plane_.u) - start_[0]) / texel_;
        const float y = (firn::dot(q, plane_.v) - start_[1]) / texel_;
        const Sum near = mean(x, y, 0.5F * (least_ + opening_ * highest_) / texel_);
        if (near.cover <= 0.0) return 1.0F;
        const auto height = static_cast<float>(near.height / near.cover);
        const float half_width = std::max(1.0F, (least_ + opening_ * height) / texel_);
        double cover = 0.0;
        for (const float part : {0.35F, 0.7F, 1.0F}) cover += mean(x, y, part * half_width).cover / 3.0;
        return 1.0F - static_cast<float>(cover);
    }

private:
    struct Sum {
        double cover = 0.0, height = 0.0;
    };
    static constexpr int size = 1024;

    static std::size_t place(int x, int y) { return static_cast<std::size_t>(y * (size + 1) + x); }
    [[nodiscard]] const Sum& table(int x, int y) const { return sums_[place(x, y)]; }
    // The sum over [0, x] × [0, y]; texels that are partly inside count in proportion.
    [[nodiscard]] Sum until(float x, float y) const {
        x = std::clamp(x, 0.0F, static_cast<float>(size));
        y = std::clamp(y, 0.0F, static_cast<float>(size));
        const int i = std::min(static_cast<int>(x), size - 1);
        const int j = std::min(static_cast<int>(y), size - 1);
        const double s = static_cast<double>(x) - i;
        const double t = static_cast<double>(y) - j;
        const auto blend = [&](double Sum::* m) {
            return (1.0 - t) * ((1.0 - s) * (table(i, j).*m) + s * (table(i + 1, j).*m)) +
                   t * ((1.0 - s) * (table(i, j + 1).*m) + s * (table(i + 1, j + 1).*m));
        };
        return {blend(&Sum::cover), blend(&Sum::height)};
    }
    [[nodiscard]] Sum mean(float x, float y, float half) const {
        const auto side = static_cast<float>(size);
        if (x + half < 0.0F || y + half < 0.0F || x - half > side || y - half > side) return {};
        const Sum a = until(x - half, y - half);
        const Sum b = until(x + half, y - half);
        const Sum c = until(x - half, y + half);
        const Sum d = until(x + half, y + half);
        const double area = 4.0 * static_cast<double>(half) * static_cast<double>(half);
        return {(d.cover - b.cover - c.cover + a.cover) / area, (d.height - b.height - c.height + a.height) / area};
    }

    Plane plane_;
    float opening_, least_;
    float highest_ = 0.0F;
    float texel_ = 1.0F;
    float start_[2] = {0.0F, 0.0F};
    std::vector<Sum> sums_;
};

}  // namespace example
