/// \file Pairs of points that do not collide, though they come near: those that a link joins, say.
#pragma once

#include <firn/core/error.hpp>
#include <firn/lagrangian/incidence.hpp>
#include <firn/lagrangian/point_masses.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace firn {

class ExcludedPairs {
public:
    using Pair = std::array<std::uint32_t, 2>;  ///< places of two points

    void add(std::span<const Pair> pairs) {
        pairs_.insert(pairs_.end(), pairs.begin(), pairs.end());
        partners_are_known_ = false;
    }
    const std::vector<Pair>& pairs() const { return pairs_; }

    /// When points have been taken out. \param new_place  as PointMasses::remove_if says; nothing happens if empty
    /// \throws parameter_error  if it does not know a point of a pair
    void renumber(std::span<const std::uint32_t> new_place) {
        if (new_place.empty()) return;
        for (const Pair& pair : pairs_)
            if (std::max(pair[0], pair[1]) >= new_place.size())
                throw parameter_error(sentence("New places are given for ", new_place.size(), " points, but point ",
                                               std::max(pair[0], pair[1]), " is in a pair that does not collide."));
        std::erase_if(pairs_, [&](Pair& pair) { return !detail::renumbered(pair, new_place); });
        partners_are_known_ = false;
    }

    /// Before contains() is asked. \throws parameter_error  if a pair names a point that is not there
    void prepare(std::size_t points) {
        if (partners_are_known_ && around_.points() <= points) return;
        std::uint32_t last = 0;
        for (const Pair& pair : pairs_) last = std::max({last, pair[0], pair[1]});
        if (!pairs_.empty() && last >= points)
            throw parameter_error(sentence("Point ", last, " is in a pair that does not collide, but there are ",
                                           points, " points. Were points taken out and not renumbered here?"));
        around_ = Incidence(std::span<const Pair>(pairs_), pairs_.empty() ? 0 : std::size_t(last) + 1);
        partners_are_known_ = true;
    }

    bool any() const { return !pairs_.empty(); }
    bool contains(std::uint32_t a, std::uint32_t b) const {
        if (a >= around_.points()) return false;
        const auto corners = around_.of(a);
        return std::any_of(corners.begin(), corners.end(),
                           [&](std::uint32_t corner) { return pairs_[corner / 2][1 - corner % 2] == b; });
    }

private:
    std::vector<Pair> pairs_;
    Incidence around_;  ///< of the pairs, only up to the last point of one
    bool partners_are_known_ = true;
};

}  // namespace firn
