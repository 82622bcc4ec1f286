/// \file Colours for links. Links of one colour share no point, so they may move their ends at the same time.
#pragma once

#include <firn/core/requirements.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

namespace firn {

/// Colours links in their order. Each link gets the lowest colour that no link at either of its ends has.
struct LinkColours {
    /// The largest number of colours. At a point with more than half as many links, some links may get no colour.
    static constexpr int most = 64;

    std::vector<std::uint8_t> colour;  ///< Of each link. `most`: no colour, such links must act one after another.
    int count = 0;                     ///< Number of colours in use.

    /// Colours links, given by the places of their ends, each below `points`.
    LinkColours(std::span<const std::array<std::uint32_t, 2>> links, std::size_t points) {
        std::vector<std::uint64_t> taken(points, 0);
        colour.reserve(links.size());
        for (const auto& [a, b] : links) {
            const int lowest = std::countr_one(taken[a] | taken[b]);
            colour.push_back(std::uint8_t(lowest));
            if (lowest == most) continue;
            taken[a] |= std::uint64_t(1) << lowest;
            taken[b] |= std::uint64_t(1) << lowest;
            count = std::max(count, lowest + 1);
        }
    }
};

/// Whether there is a colour for each link, and no two links of one colour share a point.
/// \param colour  one per link; LinkColours::most: no colour
/// \param points  number of points; the ends of links are below it
inline bool are_colours(std::span<const std::uint8_t> colour, std::span<const std::array<std::uint32_t, 2>> links,
                        std::size_t points) {
    if (colour.size() != links.size()) return false;
    std::vector<std::uint64_t> taken(points, 0);
    for (std::size_t k = 0; k < links.size(); ++k) {
        if (colour[k] > LinkColours::most) return false;
        if (colour[k] == LinkColours::most) continue;
        const std::uint64_t own = std::uint64_t(1) << colour[k];
        for (const std::uint32_t end : links[k]) {
            if (taken[end] & own) return false;
            taken[end] |= own;
        }
    }
    return true;
}

}  // namespace firn
