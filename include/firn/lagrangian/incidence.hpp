/// \file Which elements a point belongs to. Sums over these elements need neither atomics nor colours.
#pragma once

#include <firn/core/requirements.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace firn {

/// For every point, the element corners that lie on it, in the order of the elements.
class Incidence {
public:
    Incidence() = default;  ///< For no points.
    /// For elements of K corners each, over `points` points. Corners are places of points, below `points`.
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

    /// Whether it was made for this number of points, and not cleared since.
    bool is_for(std::size_t points) const { return first_.size() == points + 1; }
    /// Makes is_for() false for any number of points.
    void clear() { first_.clear(); }
    /// Number of points.
    std::size_t points() const { return first_.empty() ? 0 : first_.size() - 1; }
    /// The corners on a point, each as K · element + the corner's number in the element, 0 to K − 1.
    std::span<const std::uint32_t> of(std::size_t point) const {
        return std::span(corners_).subspan(first_[point], first_[point + 1] - first_[point]);
    }

private:
    std::vector<std::uint32_t> first_, corners_;
};

}  // namespace firn
