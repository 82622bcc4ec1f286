/// \file An image: rows from the top, 8-bit sRGB.
#pragma once

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

}  // namespace example
