/// \file Pairs of points that do not collide, though they come near: those that a link joins, say.
#pragma once

#include <firn/core/error.hpp>
#include <firn/lagrangian/net.hpp>
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
        constexpr std::uint32_t gone = PointMasses<double, 3>::no_point;
        if (new_place.empty()) return;
        for (const Pair& pair : pairs_)
            if (std::max(pair[0], pair[1]) >= new_place.size())
                throw parameter_error(sentence("New places are given for ", new_place.size(), " points, but point ",
                                               std::max(pair[0], pair[1]), " is in a pair that does not collide."));
        for (Pair& pair : pairs_) pair = {new_place[pair[0]], new_place[pair[1]]};
        std::erase_if(pairs_, [](const Pair& pair) { return pair[0] == gone || pair[1] == gone; });
        partners_are_known_ = false;
    }

    /// Before contains() is asked. \throws parameter_error  if a pair names a point that is not there
    void prepare(std::size_t points) {
        if (partners_are_known_ && first_.size() <= points + 1) return;
        std::uint32_t last = 0;
        for (const Pair& pair : pairs_) last = std::max({last, pair[0], pair[1]});
        if (!pairs_.empty() && last >= points)
            throw parameter_error(sentence("Point ", last, " is in a pair that does not collide, but there are ",
                                           points, " points. Were points taken out and not renumbered here?"));
        first_.assign(pairs_.empty() ? 0 : std::size_t(last) + 2, 0);
        partners_.resize(2 * pairs_.size());
        for (const Pair& pair : pairs_)
            for (const std::uint32_t point : pair) ++first_[point + 1];
        for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
        std::vector<std::size_t> next(first_);
        for (const Pair& pair : pairs_) {
            partners_[next[pair[0]]++] = pair[1];
            partners_[next[pair[1]]++] = pair[0];
        }
        partners_are_known_ = true;
    }

    bool any() const { return !pairs_.empty(); }
    bool contains(std::uint32_t a, std::uint32_t b) const {
        if (std::size_t(a) + 1 >= first_.size()) return false;
        const auto begin = partners_.begin();
        const auto end = begin + std::ptrdiff_t(first_[a + 1]);
        return std::find(begin + std::ptrdiff_t(first_[a]), end, b) != end;
    }

private:
    std::vector<Pair> pairs_;
    std::vector<std::size_t> first_;  ///< of each point's partners; only up to the last point of a pair
    std::vector<std::uint32_t> partners_;
    bool partners_are_known_ = true;
};

}  // namespace firn
