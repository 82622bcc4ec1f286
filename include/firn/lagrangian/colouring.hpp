/// \file Colours for links. Links of one colour have no point in common, so threads can move the end points of these
/// links in parallel.
#pragma once

#include <firn/core/requirements.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Gives each link a colour, so that links of one colour have no point in common. Links are coloured in the order
/// given. Each link gets the lowest colour that no earlier link at either of its two end points has. Colours are
/// numbered from 0.
struct LinkColours {
    /// The largest number of colours. A link gets no colour if earlier links at its two end points use all of these
    /// colours.
    static constexpr int most = 64;

    std::vector<std::uint8_t> colour;  ///< Colour of each link. `most`: the link has no colour; move it alone.
    int count = 0;                     ///< Number of colours used.

    /// Colours links.
    /// \param links   the indices of the two end points of each link
    /// \param points  number of points; every index in `links` must be below this number
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

}  // namespace detail

/// Returns whether `colour` is a valid colouring: it has one entry per link, and no two links of one colour have a
/// point in common.
/// \param colour  the colour of each link; LinkColours::most: no colour
/// \param links   the indices of the two end points of each link
/// \param points  number of points; every index in `links` must be below this number
inline bool are_colours(std::span<const std::uint8_t> colour, std::span<const std::array<std::uint32_t, 2>> links,
                        std::size_t points) {
    if (colour.size() != links.size()) return false;
    std::vector<std::uint64_t> taken(points, 0);
    for (std::size_t k = 0; k < links.size(); ++k) {
        if (colour[k] > detail::LinkColours::most) return false;
        if (colour[k] == detail::LinkColours::most) continue;
        const std::uint64_t own = std::uint64_t(1) << colour[k];
        for (const std::uint32_t end : links[k]) {
            if (taken[end] & own) return false;
            taken[end] |= own;
        }
    }
    return true;
}

}  // namespace firn::inline FIRN_BUILD
