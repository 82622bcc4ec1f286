/// \file Builds ropes. In 2D, a rope can also stand for the cross-section of a cloth.
#pragma once

#include <firn/lagrangian/surface.hpp>

namespace firn::inline FIRN_BUILD {

/// Builds a straight rope of `segments` + 1 evenly spaced points. The first point is at position `a` and the last at
/// position `b` [m]. Stretch links join neighbouring points, and bend links join each point to its second neighbours.
/// In 2D the segments are facets, too; the outside of a facet is on the right-hand side if one goes from `a` to `b`.
/// \throws parameter_error  unless `a` and `b` are finite and different, and the number of segments is at least 1 and
///                          below `max_points`
/// \throws memory_error     if the net does not fit into memory
template <int D>
[[nodiscard]] Net<D> rope(const Vec<double, D>& a, const Vec<double, D>& b, std::size_t segments) {
    const double length = norm(b - a);
    if (!(length > 0) || !std::isfinite(length))
        throw parameter_error(sentence("A rope from ", detail::describe(a), " to ", detail::describe(b),
                                       " m has the length ", length, " m; its ends must be finite and apart."));
    if (segments < 1 || segments >= max_points)
        throw parameter_error(
            sentence("A rope of ", segments, " segments was asked for; give 1 to ", max_points - 1, "."));
    detail::require_net_memory<D>(double(segments) + 1, 2 * double(segments), D == 2 ? double(segments) : 0);
    Net<D> net;
    for (std::size_t i = 0; i <= segments; ++i) {
        const double t = double(i) / double(segments);
        net.positions.push_back(a * (1 - t) + b * t);
    }
    for (std::uint32_t i = 0; i < segments; ++i) {
        net.links.push_back({i, i + 1, LinkKind::stretch});
        if (i + 1 < segments) net.links.push_back({i, i + 2, LinkKind::bend});
        if constexpr (D == 2) net.facets.push_back({i, i + 1});
    }
    return net;
}

}  // namespace firn::inline FIRN_BUILD
