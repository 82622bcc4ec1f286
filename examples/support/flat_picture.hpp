/// \file Draws scenes in the plane: discs, each with its own radius, and thick lines with round ends.
///
///     example::FlatPicture picture({0, 0}, {4, 3});
///     picture.paint(std::vector<example::Stroke>{{{1, 1}, {2, 1}, 0.1F, example::coral}});
///     example::write_png("out/last.png", picture.image());
#pragma once

#include "support/renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace example {

/// A thick line from a to b with round ends; a disc if a and b are the same.
struct Stroke {
    std::array<float, 2> a, b;
    float radius;             ///< half of its thickness
    std::uint8_t colour = 0;  ///< number in the renderer's palette
    bool is_round = true;     ///< whether it is shaded as a ball or a tube, or flat
};

/// Returns a flat disc at each of some points. \param colour  colour(i) returns that of point i
template <class Points, class Colour>
std::vector<Stroke> discs(const Points& points, double radius, const Colour& colour) {
    std::vector<Stroke> all;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const std::array at{float(points[i][0]), float(points[i][1])};
        all.push_back({at, at, float(radius), std::uint8_t(colour(i)), false});
    }
    return all;
}

/// A picture of the rectangle from `lower` to `upper`, with a margin.
class FlatPicture {
public:
    FlatPicture(std::array<float, 2> lower, std::array<float, 2> upper, int width = 1280, int height = 960)
        : width_(width), height_(height), light_(std::size_t(width) * std::size_t(height)) {
        scale_ = 0.94F * std::min(float(width) / (upper[0] - lower[0]), float(height) / (upper[1] - lower[1]));
        left_ = 0.5F * (float(width) - scale_ * (lower[0] + upper[0]));
        bottom_ = 0.5F * (float(height) + scale_ * (lower[1] + upper[1]));
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                at(x, y) =
                    detail::mix(detail::from_hex(0xDCE4EA), detail::from_hex(0xF6F4F0), float(y) / float(height));
    }

    /// Paints a body over what is there. Its outline goes around all of its strokes.
    void paint(std::span<const Stroke> body) {
        for (const bool is_outline : {true, false})
            for (const Stroke& stroke : body)
                if (std::isfinite(stroke.a[0] + stroke.a[1] + stroke.b[0] + stroke.b[1])) paint(stroke, is_outline);
    }

    [[nodiscard]] Image image() const {
        Image image(width_, height_);
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) {
                const Vec3& light = light_[std::size_t(y) * std::size_t(width_) + std::size_t(x)];
                for (int c = 0; c < 3; ++c)
                    image.at(x, y)[std::size_t(c)] = detail::encoded(light[c], detail::dither(x, y));
            }
        return image;
    }

private:
    Vec3& at(int x, int y) { return light_[std::size_t(y) * std::size_t(width_) + std::size_t(x)]; }

    void paint(const Stroke& stroke, bool is_outline) {
        const float ax = left_ + scale_ * stroke.a[0], ay = bottom_ - scale_ * stroke.a[1];  // in pixels
        const float bx = left_ + scale_ * stroke.b[0], by = bottom_ - scale_ * stroke.b[1];
        const float radius = scale_ * stroke.radius, reach = radius + (is_outline ? 1.5F : 0.0F);
        const float along[2] = {bx - ax, by - ay}, square = along[0] * along[0] + along[1] * along[1];
        const auto pixel = [](float x, int end) { return int(std::clamp(x, 0.0F, float(end))); };
        const int right = pixel(std::max(ax, bx) + reach + 2, width_),
                  low = pixel(std::max(ay, by) + reach + 2, height_);
        const Vec3& paint = detail::palette()[stroke.colour % detail::palette().size()];
        for (int y = pixel(std::min(ay, by) - reach - 1, height_); y < low; ++y)
            for (int x = pixel(std::min(ax, bx) - reach - 1, width_); x < right; ++x) {
                const float px = float(x) + 0.5F - ax, py = float(y) + 0.5F - ay;
                const float t = square > 0 ? std::clamp((px * along[0] + py * along[1]) / square, 0.0F, 1.0F) : 0.0F;
                const float dx = px - t * along[0], dy = py - t * along[1], distance = std::sqrt(dx * dx + dy * dy);
                const float cover = std::clamp(reach - distance + 0.5F, 0.0F, 1.0F);
                if (cover <= 0) continue;
                float shade = is_outline ? 0.3F : 1.0F;
                if (!is_outline && stroke.is_round && radius > 0) {
                    const float nx = dx / radius, ny = dy / radius;
                    const float up = std::sqrt(std::max(0.0F, 1 - nx * nx - ny * ny));
                    shade = 0.55F + 0.55F * std::max(0.0F, 0.75F * up - 0.35F * nx - 0.56F * ny);
                }
                at(x, y) = detail::mix(at(x, y), paint * shade, cover);
            }
    }

    int width_, height_;
    float scale_, left_, bottom_;  // pixels per unit of length, and the pixel of the origin
    std::vector<Vec3> light_;
};

}  // namespace example
