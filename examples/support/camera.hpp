/// \file Cameras: perspective, or orthographic for flat clouds and lights. frame() makes one show a box.
#pragma once

#include <firn/core/tensor.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace example {

using Vec3 = firn::Vec<float, 3>;
using Mat3 = firn::Mat<float, 3>;

inline Vec3 cross(const Vec3& a, const Vec3& b) {
    return {{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}};
}
inline Vec3 normalised(const Vec3& a) { return a * (1.0F / std::max(firn::norm(a), 1e-30F)); }

/// An axis-aligned box; empty if lower > upper.
struct Box {
    Vec3 lower = Vec3::filled(std::numeric_limits<float>::max());
    Vec3 upper = Vec3::filled(std::numeric_limits<float>::lowest());

    [[nodiscard]] bool empty() const { return !(lower[0] <= upper[0]); }
    [[nodiscard]] Vec3 centre() const { return (lower + upper) * 0.5F; }
    [[nodiscard]] float diagonal() const { return firn::norm(upper - lower); }
    [[nodiscard]] Vec3 corner(int k) const {
        return {{(k & 1 ? upper : lower)[0], (k & 2 ? upper : lower)[1], (k & 4 ? upper : lower)[2]}};
    }
    void include(const Vec3& p) {
        for (int d = 0; d < 3; ++d) {
            lower[d] = std::min(lower[d], p[d]);
            upper[d] = std::max(upper[d], p[d]);
        }
    }
};

/// A point on the screen: x to the right and y down in pixels, depth along the view direction in units of the scene.
struct Projected {
    float x, y, depth;
};

struct Camera {
    Vec3 eye;
    Vec3 right, up, forward;  ///< orthonormal
    float focal = 1.0F;       ///< pixels per unit of length (orthographic), or per unit of length at depth 1
    float middle_x = 0.0F, middle_y = 0.0F;
    bool orthographic = false;

    [[nodiscard]] float scale(float depth) const { return orthographic ? focal : focal / depth; }
    [[nodiscard]] Projected project(const Vec3& p) const {
        const Vec3 from_eye = p - eye;
        const float depth = firn::dot(from_eye, forward);
        const float s = scale(depth);
        return {middle_x + s * firn::dot(from_eye, right), middle_y - s * firn::dot(from_eye, up), depth};
    }
    [[nodiscard]] Vec3 unproject(float x, float y, float depth) const {
        const float s = 1.0F / scale(depth);
        return eye + right * ((x - middle_x) * s) + up * ((middle_y - y) * s) + forward * depth;
    }
};

/// Returns a camera that looks along `direction`, with `up` upwards. The caller sets its position. `direction` may be
/// parallel to `up`.
inline Camera looking(const Vec3& direction, const Vec3& up) {
    Camera camera{};
    camera.forward = normalised(direction);
    Vec3 side = cross(camera.forward, up);
    if (firn::norm(side) < 1e-4F) side = cross(camera.forward, Vec3{{0.0F, 0.0F, -1.0F}});
    if (firn::norm(side) < 1e-4F) side = Vec3{{1.0F, 0.0F, 0.0F}};
    camera.right = normalised(side);
    camera.up = cross(camera.right, camera.forward);
    return camera;
}

/// Places the camera so that the box fills the picture, except for `margin` (a fraction of the picture) on each side.
///
/// Perspective: in the camera's axes with the origin at the box's centre, a corner (a, b, c) is seen when
/// |a − s| ≤ (c + d) t, with s the shift, d the distance and t the tangent of half the opening. Over the corners,
/// A = max(a − c t) and B = max(−a − c t) give the least distance d = (A + B) / 2t, at the shift s = (A − B) / 2.
inline void frame(Camera& camera, const Box& box, int width, int height, float margin, float half_opening) {
    camera.middle_x = 0.5F * static_cast<float>(width);
    camera.middle_y = 0.5F * static_cast<float>(height);
    const float inside = 1.0F - 2.0F * margin;
    const Vec3 centre = box.centre();
    const float size = std::max(box.diagonal(), 1e-6F);
    if (camera.orthographic) {
        float a = 1e-6F * size;
        float b = a;
        for (int k = 0; k < 8; ++k) {
            const Vec3 corner = box.corner(k) - centre;
            a = std::max(a, firn::dot(corner, camera.right));
            b = std::max(b, firn::dot(corner, camera.up));
        }
        camera.focal = inside * std::min(camera.middle_x / a, camera.middle_y / b);
        camera.eye = centre - camera.forward * (2.0F * size);
        return;
    }
    camera.focal = camera.middle_y / std::tan(half_opening);
    const float tangents[2] = {inside * camera.middle_x / camera.focal, inside * camera.middle_y / camera.focal};
    const Vec3 axes[2] = {camera.right, camera.up};
    float shift[2];
    float distance = 0.0F;
    for (int axis = 0; axis < 2; ++axis) {
        float positive = std::numeric_limits<float>::lowest();
        float negative = positive;
        for (int k = 0; k < 8; ++k) {
            const Vec3 corner = box.corner(k) - centre;
            const float a = firn::dot(corner, axes[axis]);
            const float c = firn::dot(corner, camera.forward) * tangents[axis];
            positive = std::max(positive, a - c);
            negative = std::max(negative, -a - c);
        }
        shift[axis] = 0.5F * (positive - negative);
        distance = std::max(distance, 0.5F * (positive + negative) / tangents[axis]);
    }
    camera.eye = centre + camera.right * shift[0] + camera.up * shift[1] - camera.forward * (distance + 1e-6F * size);
}

}  // namespace example
