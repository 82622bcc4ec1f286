/// \file Pairs of points that do not collide, such as the two end points of a link.
#pragma once

#include <firn/core/error.hpp>
#include <firn/lagrangian/incidence.hpp>
#include <firn/lagrangian/point_masses.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// A set of pairs of points that do not collide.
class ExcludedPairs {
public:
    using Pair = std::array<std::uint32_t, 2>;  ///< The indices (into PointMasses) of two points.

    /// Adds pairs to the set.
    void add(std::span<const Pair> pairs) {
        pairs_.insert(pairs_.end(), pairs.begin(), pairs.end());
        partners_are_known_ = false;
    }
    /// Returns all pairs.
    const std::vector<Pair>& pairs() const { return pairs_; }

    /// Updates the pairs' point indices. Pairs that have lost a point are removed. Call renumber() after points are
    /// removed.
    /// \param new_place  the list that PointMasses::remove_if returned: the new index for each old one. If new_place is
    ///                   empty, nothing changes.
    /// \throws parameter_error  if a pair names a point without an entry in new_place
    void renumber(std::span<const std::uint32_t> new_place) {
        if (new_place.empty()) return;
        for (const Pair& pair : pairs_)
            if (std::max(pair[0], pair[1]) >= new_place.size())
                throw parameter_error(sentence("New places are given for ", new_place.size(), " points, but point ",
                                               std::max(pair[0], pair[1]),
                                               " is in an excluded pair. Exclude existing points only."));
        std::erase_if(pairs_, [&](Pair& pair) { return !detail::renumbered(pair, new_place); });
        partners_are_known_ = false;
    }

    /// Prepares for calls of contains(). After pairs are added or renumbered, call prepare() before contains().
    /// \param points  number of points in the system
    /// \throws parameter_error  if a pair names a point that does not exist
    void prepare(std::size_t points) {
        if (partners_are_known_ && around_.points() <= points) return;
        std::uint32_t last = 0;
        for (const Pair& pair : pairs_) last = std::max({last, pair[0], pair[1]});
        if (!pairs_.empty() && last >= points)
            throw parameter_error(sentence("Point ", last, " is in an excluded pair, but there are ", points,
                                           " points, counted from 0. Call renumber() after points are removed."));
        around_ = Incidence(std::span<const Pair>(pairs_), pairs_.empty() ? 0 : std::size_t(last) + 1);
        partners_are_known_ = true;
    }

    /// Returns whether the set contains any pair.
    bool any() const { return !pairs_.empty(); }
    /// Returns whether the set contains the pair of the points with indices a and b, in either order.
    bool contains(std::uint32_t a, std::uint32_t b) const {
        if (a >= around_.points()) return false;
        const auto corners = around_.of(a);
        return std::any_of(corners.begin(), corners.end(),
                           [&](std::uint32_t corner) { return pairs_[corner / 2][1 - corner % 2] == b; });
    }

private:
    std::vector<Pair> pairs_;
    Incidence around_;  ///< for each point up to the last one in any pair: the pairs with this point
    bool partners_are_known_ = true;
};

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
