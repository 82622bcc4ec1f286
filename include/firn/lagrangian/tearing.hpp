/// \file Which links tear, and which links lose their support when others tear: for constraints and springs alike.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>
#include <firn/data/field.hpp>
#include <firn/lagrangian/incidence.hpp>
#include <firn/lagrangian/net.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// The indices (into PointMasses) of the two end points of a torn link, in any order.
using Torn = std::array<std::uint32_t, 2>;

namespace detail {

/// Checks a tear factor, the ratio of a link's length to its length at rest above which the link tears.
/// \throws parameter_error  unless the factor is above 1; it may be infinite
inline void check_tear_factor(double factor) {
    if (!(factor > 1))
        throw parameter_error(sentence("A link tears at ", factor,
                                       " times its length at rest; the factor must be above 1 (infinite: never)."));
}

/// A list of torn links, sorted by their end points for fast search.
class TornLinks {
public:
    explicit TornLinks(std::span<const Torn> torn) : links_(torn.begin(), torn.end()) {
        for (Torn& ends : links_) std::sort(ends.begin(), ends.end());
        std::sort(links_.begin(), links_.end());
    }

    /// Returns whether any torn link has both of its end points among `corners`, the point indices of an element's
    /// corners.
    template <std::size_t K>
    bool are_in(std::array<std::uint32_t, K> corners) const {
        std::sort(corners.begin(), corners.end());
        for (std::size_t a = 0; a < K; ++a)
            for (std::size_t b = a + 1; b < K; ++b)
                if (std::binary_search(links_.begin(), links_.end(), Torn{corners[a], corners[b]})) return true;
        return false;
    }

private:
    std::vector<Torn> links_;
};

/// The tear factors of links, squared. It uses no memory if no link has a factor of its own.
template <std::floating_point S>
class TearFactors {
public:
    /// Adds a link.
    /// \param own     the link's own tear factor; empty: the link has none
    /// \param before  number of links that were added before and are not removed
    /// \throws parameter_error  if the factor is not above 1
    void add(const std::optional<double>& own, std::size_t before) {
        if (own) check_tear_factor(*own);
        if (!own && squares_.empty()) return;
        squares_.resize(before, none);
        squares_.push_back(own ? square(*own) : none);
        are_finite_ = are_finite_ || (own && std::isfinite(*own));
    }
    /// Returns whether some link may tear.
    /// \param of_others  the factor of links without a factor of their own
    bool may_tear(double of_others) const { return are_finite_ || std::isfinite(of_others); }

    static S square(double factor) { return S(factor * factor); }
    /// Returns the squared factor of link k.
    /// \param of_others  the squared factor of links without a factor of their own
    S square_of(std::size_t k, S of_others) const {
        return squares_.empty() || squares_[k] == none ? of_others : squares_[k];
    }

    /// Gives the factor of link `from` to link `to`.
    void move(std::size_t from, std::size_t to) {
        if (!squares_.empty()) squares_[to] = squares_[from];
    }
    /// Removes all links but the first `count`.
    void shrink(std::size_t count) {
        if (!squares_.empty()) squares_.resize(count);
    }
    /// Sorts the links: the new link k is the former link order[k].
    void permute(std::span<const std::uint32_t> order) {
        const std::vector<S> before = squares_;
        for (std::size_t k = 0; k < squares_.size(); ++k) squares_[k] = before[order[k]];
    }

private:
    static constexpr S none = 0;
    std::vector<S> squares_;
    bool are_finite_ = false;
};

/// Returns whether a link between points at a and b is longer than its tear factor allows. A link whose length at rest
/// is 0 never tears.
/// \param rest    length at rest [m]
/// \param square  squared tear factor
template <std::floating_point S, int D>
FIRN_INLINE bool is_too_long(const Vec<double, D>& a, const Vec<double, D>& b, S rest, S square) {
    const Vec<S, D> along = cast<S>(b - a);
    return bool((S(0) < rest) & (square * rest * rest < dot(along, along)));
}

/// A constraint or spring, with what decides whether it tears.
template <std::floating_point S>
struct TearingLink {
    std::array<std::uint32_t, 2> ends;
    S rest;         // length at rest [m]
    S square;       // squared tear factor
    LinkKind kind;  // what the link is there for
};

/// Adds the links that have lost their support to a list of torn links. A shear or bend link is supported by a point
/// that stretch links join to both of its end points.
/// \param links   all links before they tear
/// \param points  number of points
template <std::floating_point S>
void add_unsupported(std::span<const TearingLink<S>> links, std::size_t points, std::vector<Torn>& torn) {
    const TornLinks found(torn);
    std::vector<Torn> edges;
    std::vector<bool> is_torn;            // for each edge
    std::vector<bool> is_beside(points);  // for each point, whether a torn edge ends there
    for (const TearingLink<S>& link : links) {
        if (link.kind != LinkKind::stretch) continue;
        edges.push_back(link.ends);
        is_torn.push_back(found.are_in(link.ends));
        if (!is_torn.back()) continue;
        for (const std::uint32_t end : link.ends) is_beside[end] = true;
    }
    const Incidence around(std::span<const Torn>(edges), points);
    const auto are_supported = [&](const Torn& ends, bool before) {
        for (const std::uint32_t at_a : around.of(ends[0]))
            for (const std::uint32_t at_b : around.of(ends[1]))
                if (edges[at_a / 2][1 - at_a % 2] == edges[at_b / 2][1 - at_b % 2] &&
                    (before || !(is_torn[at_a / 2] || is_torn[at_b / 2])))
                    return true;
        return false;
    };
    std::vector<Torn> unsupported;
    for (const TearingLink<S>& link : links) {
        const bool is_carried = link.kind == LinkKind::shear || link.kind == LinkKind::bend;
        if (!is_carried || !(is_beside[link.ends[0]] || is_beside[link.ends[1]])) continue;
        if (!found.are_in(link.ends) && are_supported(link.ends, true) && !are_supported(link.ends, false))
            unsupported.push_back(link.ends);
    }
    torn.insert(torn.end(), unsupported.begin(), unsupported.end());
}

/// Returns the links that lose their support when points are removed.
/// \param links      all links before
/// \param new_place  the list that PointMasses::remove_if returned: the new index for each old one
template <std::floating_point S>
std::vector<Torn> unsupported_without(std::span<const TearingLink<S>> links, std::span<const std::uint32_t> new_place) {
    std::vector<Torn> torn;
    for (const TearingLink<S>& link : links) {
        const auto [a, b] = link.ends;
        if (std::max(a, b) >= new_place.size()) return {};  // renumber() refuses such links
        if (link.kind == LinkKind::stretch && (new_place[a] == no_particle || new_place[b] == no_particle))
            torn.push_back(link.ends);
    }
    const auto removed = std::ptrdiff_t(torn.size());
    if (removed > 0) add_unsupported(links, new_place.size(), torn);
    torn.erase(torn.begin(), torn.begin() + removed);
    return torn;
}

/// Returns the links, each once, in the order in which they are first given.
inline std::vector<Torn> each_once(std::vector<Torn> torn) {
    std::set<Torn> seen;
    std::erase_if(torn, [&](Torn ends) {
        std::sort(ends.begin(), ends.end());
        return !seen.insert(ends).second;
    });
    return torn;
}

/// Returns the links that are too long, and then those that have lost their support, each once.
/// \param links     all constraints and springs
/// \param position  position of each point [m]
template <std::floating_point S, int D>
std::vector<Torn> torn_links(std::span<const TearingLink<S>> links, std::span<const Vec<double, D>> position) {
    std::vector<Torn> torn;
    for (const TearingLink<S>& link : links)
        if (is_too_long(position[link.ends[0]], position[link.ends[1]], link.rest, link.square))
            torn.push_back(link.ends);
    if (!torn.empty()) add_unsupported(links, position.size(), torn);
    return each_once(std::move(torn));
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
