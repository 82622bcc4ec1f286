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

/// Points and what joins them; links and facets name points by their place in `positions`, counted from 0.
template <int D>
struct Net {
    std::vector<Vec<double, D>> positions;  ///< at rest [m]
    std::vector<Link> links;
    std::vector<Facet<D>> facets;
};

}  // namespace firn
