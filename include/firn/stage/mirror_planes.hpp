/// \file The mirrored walls of a boundary on a grid. \see NodesBehind::mirrored
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/core/error.hpp>
#include <firn/data/domain.hpp>
#include <firn/stage/mirror.hpp>

#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// A wall behind which nodes move like mirror images of the nodes in front of it.
struct MirrorPlane {
    int axis = 0,                         ///< The axis across the wall.
        node = 0,                         ///< Index of the nodes on the wall, from the domain's lower corner.
        inward = 1;                       ///< 1 if matter lies above the wall along the axis, −1 if it lies below.
    Contact contact = Contact::separate;  ///< How matter may move at the wall.
    double friction = 0;                  ///< Coulomb's friction coefficient [1]
    int part = 0;                         ///< Index of the boundary's part that the wall belongs to.
};

/// The mirrored walls of a boundary on a grid.
struct Mirrors {
    std::vector<MirrorPlane> planes;   ///< All walls; those of one part and one axis follow each other.
    SurfaceWeights<double> weights{};  ///< Weights of the nodes at the surface of a wall.

    /// Returns the end of the walls of one part and one axis that begin with wall `first`. They act together, after
    /// those before them have finished: at an edge, nodes are mirrored twice.
    std::size_t end_of_axis(std::size_t first) const {
        std::size_t end = first;
        while (end < planes.size() && planes[end].axis == planes[first].axis && planes[end].part == planes[first].part)
            ++end;
        return end;
    }
};

/// The mirrored walls of a boundary that acts by the gap of particles.
template <std::floating_point S>
struct MirrorsByGap : Mirrors {
    /// For each wall and block of the grid: index in `closing` of the block's first column; no_columns if the block has
    /// no columns at this wall.
    std::vector<std::uint32_t> first{};
    std::vector<S>
        closing{};           ///< For each column: the speed at which matter may approach the wall. \see mirrored_by_gap
    std::size_t blocks = 0;  ///< Number of blocks of the grid.
    static constexpr std::uint32_t no_columns = 0xffffffffu;  ///< Stands for the index of a block without columns.

    /// Returns the closing speeds of the columns of block b at wall p [m/s].
    const S* of(std::size_t p, std::size_t b) const { return closing.data() + first[p * blocks + b]; }
};

namespace detail {

/// Checks a mirrored wall, and adds it to the list of walls.
/// \param on_grid    position of the wall, counted in cells from the domain's lower corner
/// \param tolerance  largest rounding error of this position [cells]
[[gnu::cold]] void add_mirror(std::vector<MirrorPlane>& planes, const MirrorPlane& plane, double on_grid,
                              double tolerance, double position, double cell_size);

}  // namespace detail

/// Returns the mirrored walls of a boundary. There are none if the boundary has no function mirrors().
/// \throws parameter_error  if a mirrored wall lies on no plane of nodes, or if two opposite ones are fewer than 3
///                          cells apart
template <class Kernel, class Boundary, int D>
Mirrors mirrors_of(const Boundary& boundary, const Domain<D>& domain) {
    Mirrors mirrors;
    if constexpr (has_mirrors<Boundary>) {
        boundary.mirrors([&](int axis, auto position, int inward, Contact contact, double friction, int part) {
            const double on_grid = (double(position) - domain.lower[axis]) / domain.cell_size;
            constexpr double tolerance = 1e-3;  // [cells], for positions that were rounded to float, too
            detail::add_mirror(mirrors.planes, {axis, int(std::lround(on_grid)), inward, contact, friction, part},
                               on_grid, tolerance, double(position), domain.cell_size);
        });
        mirrors.weights = surface_weights<Kernel, double>();
    }
    return mirrors;
}

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES
#include <firn/stage/mirror_planes-inl.hpp>
#endif
