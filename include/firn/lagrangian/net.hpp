/// \file What builders of cloth, ropes and soft bodies make: points, the links between them, the facets they span.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace firn {

/// What a link between two points is there for: each kind may be given a stiffness of its own.
enum class LinkKind : std::uint8_t {
    stretch,  ///< along an edge of the surface, or of a lattice
    shear,    ///< across a cell of a lattice
    bend,     ///< to a neighbour's neighbour
    support   ///< through the inside of a body
};
inline constexpr int link_kinds = 4;

struct Link {
    std::uint32_t a = 0, b = 0;
    LinkKind kind = LinkKind::stretch;

    bool operator==(const Link&) const = default;
};

/// A piece of surface: a triangle in 3D, counter-clockwise seen from outside; an edge in 2D, the outside on its right.
template <int D>
using Facet = std::array<std::uint32_t, D>;

/// A facet's normal, as long as its area [m²] (in 2D: as an edge [m]), pointing outwards.
template <scalar S>
FIRN_INLINE Vec<S, 3> area_vector(const std::array<Vec<S, 3>, 3>& x) {
    return cross(x[1] - x[0], x[2] - x[0]) * S(0.5);
}
template <scalar S>
FIRN_INLINE Vec<S, 2> area_vector(const std::array<Vec<S, 2>, 2>& x) {
    const Vec<S, 2> along = x[1] - x[0];
    return {{along.v[1], -along.v[0]}};
}

/// Points and what joins them; links and facets name points by their place in `positions`, counted from 0.
template <int D>
struct Net {
    std::vector<Vec<double, D>> positions;  ///< at rest [m]
    std::vector<Link> links;
    std::vector<Facet<D>> facets;
};

}  // namespace firn
