/// \file For each point, a list of the elements that have a corner at this point. With these lists, the forces of
/// elements can be summed point by point, so several threads need neither atomic operations nor colours.
#pragma once

#include <firn/core/requirements.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Lists for each point the corners of elements that lie on this point, in the order of the elements. See of() for how
/// a corner is listed.
class Incidence {
public:
    Incidence() = default;  ///< Makes an empty list for zero points.
    /// Makes the list.
    /// \param elements  for each element, the indices of the points at its K corners; each index must be below `points`
    /// \param points    number of points
    template <std::size_t K>
    Incidence(std::span<const std::array<std::uint32_t, K>> elements, std::size_t points) : first_(points + 1, 0) {
        for (const auto& corners : elements)
            for (const std::uint32_t point : corners) ++first_[point + 1];
        for (std::size_t i = 0; i < points; ++i) first_[i + 1] += first_[i];
        corners_.resize(elements.size() * K);
        std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
        std::uint32_t corner = 0;
        for (const auto& corners : elements)
            for (const std::uint32_t point : corners) corners_[next[point]++] = corner++;
    }

    /// Returns whether the list was made for this number of points and has not been cleared since then.
    bool is_for(std::size_t points) const { return first_.size() == points + 1; }
    /// Deletes the list. After this call, is_for() returns false for any number of points.
    void clear() { first_.clear(); }
    /// Returns the number of points for which the list was made.
    std::size_t points() const { return first_.empty() ? 0 : first_.size() - 1; }
    /// Returns the list of the element corners that lie on the point with index `point`. Corner c of element e is
    /// listed as K e + c, where K is the number of corners of an element; e and c are counted from 0.
    std::span<const std::uint32_t> of(std::size_t point) const {
        return std::span(corners_).subspan(first_[point], first_[point + 1] - first_[point]);
    }

private:
    std::vector<std::uint32_t> first_, corners_;
};

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
