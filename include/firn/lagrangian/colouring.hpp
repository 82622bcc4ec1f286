/// \file Colours for links: links of one colour share no point, so that they may move their ends at the same time.
#pragma once

#include <firn/core/requirements.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

namespace firn {

/// Each link, in turn, gets the lowest colour that no link at either end has yet.
struct LinkColours {
    /// Points with more links than half of this leave some of them without a colour.
    static constexpr int most = 64;

    std::vector<std::uint8_t> colour;  ///< of each link; `most`: none, for links that must wait for each other
    int count = 0;                     ///< of colours

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

/// Are these colours by which links may move their ends at the same time?
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
