/// \file Nets: points, links between points, and facets. The functions that build cloth, ropes and soft bodies return
/// nets.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// The purpose of a link between two points. Each kind may have its own stiffness.
enum class LinkKind : std::uint8_t {
    stretch,  ///< Resists stretch: joins neighbouring points along an edge of a surface or of a lattice cell.
    shear,    ///< Resists shear: joins two points along a diagonal of a cell.
    bend,     ///< Resists bending: joins a point to a neighbour of one of its neighbours.
    support   ///< Supports a hollow body from inside: joins a point of the surface to a point on the other side.
};
inline constexpr int link_kinds = 4;  ///< Number of kinds of links.

/// A link between two points.
struct Link {
    std::uint32_t a = 0,                ///< The index of one point.
        b = 0;                          ///< The index of the other point.
    LinkKind kind = LinkKind::stretch;  ///< The purpose of the link.

    bool operator==(const Link&) const = default;
};

/// A piece of a surface, given by the point indices of its corners. In 3D a facet is a triangle, with corners in
/// counter-clockwise order if seen from outside. In 2D a facet is an edge between two points; the outside is on the
/// right-hand side if one goes from the first point to the second.
template <int D>
using Facet = std::array<std::uint32_t, D>;

/// @{
/// Returns the outward normal of a facet. The length of this normal is the area of the facet [m²], or in 2D the length
/// of the edge [m].
/// \param x  the positions of the facet's corners [m]
template <scalar S>
FIRN_INLINE Vec<S, 3> area_vector(const std::array<Vec<S, 3>, 3>& x) {
    return cross(x[1] - x[0], x[2] - x[0]) * S(0.5);
}
template <scalar S>
FIRN_INLINE Vec<S, 2> area_vector(const std::array<Vec<S, 2>, 2>& x) {
    const Vec<S, 2> along = x[1] - x[0];
    return {{along.v[1], -along.v[0]}};
}
/// @}

/// Points, links between points, and facets. Links and facets refer to a point by its index in `positions`, counted
/// from 0.
template <int D>
struct Net {
    std::vector<Vec<double, D>> positions;  ///< Positions of the points at rest [m].
    std::vector<Link> links;                ///< Links; each joins two points.
    std::vector<Facet<D>> facets;           ///< Facets (triangles, or edges in 2D) of the surface.
};

}  // namespace firn::inline FIRN_BUILD
