/// \file An image: rows from the top, 8-bit sRGB.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace example {

using Pixel = std::array<std::uint8_t, 3>;

struct Image {
    int width = 0;
    int height = 0;
    std::vector<Pixel> pixels;  ///< width × height, row by row

    Image() = default;
    Image(int w, int h) : width(w), height(h), pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}

    [[nodiscard]] const Pixel& at(int x, int y) const { return pixels[index(x, y)]; }
    [[nodiscard]] Pixel& at(int x, int y) { return pixels[index(x, y)]; }

private:
    [[nodiscard]] std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
    }
};

/// Puts two pictures of the same height beside each other.
inline Image beside(const Image& left, const Image& right) {
    Image both(left.width + right.width, left.height);
    for (int y = 0; y < both.height; ++y)
        for (int x = 0; x < both.width; ++x)
            both.at(x, y) = x < left.width ? left.at(x, y) : right.at(x - left.width, y);
    return both;
}

/// Puts two pictures of the same width above each other.
inline Image above(const Image& upper, const Image& lower) {
    Image both(upper.width, upper.height + lower.height);
    std::copy(upper.pixels.begin(), upper.pixels.end(), both.pixels.begin());
    std::copy(lower.pixels.begin(), lower.pixels.end(), both.pixels.begin() + std::ptrdiff_t(upper.pixels.size()));
    return both;
}

}  // namespace example
