/// \file Nets: points, the links between them, and facets. Builders of cloth, ropes and soft bodies return them.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace firn {

/// The purpose of a link between two points. Each kind may have its own stiffness.
enum class LinkKind : std::uint8_t {
    stretch,  ///< Along an edge of the surface or of a lattice.
    shear,    ///< Along a diagonal of a cell.
    bend,     ///< To a neighbour's neighbour.
    support   ///< Through the inside of a body.
};
inline constexpr int link_kinds = 4;  ///< Number of kinds in LinkKind.

/// A link between two points.
struct Link {
    std::uint32_t a = 0,                ///< The place of one point.
        b = 0;                          ///< The place of the other point.
    LinkKind kind = LinkKind::stretch;  ///< Its purpose.

    bool operator==(const Link&) const = default;
};

/// A piece of surface, given by the places of its corners. In 3D it is a triangle, counter-clockwise seen from outside.
/// In 2D it is an edge with the outside on its right.
template <int D>
using Facet = std::array<std::uint32_t, D>;

/// @{
/// A facet's outward normal, whose length is the facet's area [m²], or the length of an edge [m] in 2D.
/// \param x  the corners [m]
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

/// Points, links and facets. Links and facets name points by their place in `positions`, counted from 0.
template <int D>
struct Net {
    std::vector<Vec<double, D>> positions;  ///< Points at rest [m].
    std::vector<Link> links;                ///< Links between points.
    std::vector<Facet<D>> facets;           ///< The surface.
};

}  // namespace firn
