/// \file The pass over the nodes beside mirrored walls, after the grid update. \see NodesBehind::mirrored
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/core/parallel.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/exec/execution.hpp>
#include <firn/exec/reactions.hpp>
#include <firn/stage/mirror.hpp>

#include <cmath>
#include <vector>

namespace firn {

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
};

namespace detail {

/// Checks a mirrored wall, and adds it to the list of walls.
/// \param on_grid    position of the wall, counted in cells from the domain's lower corner
/// \param tolerance  largest rounding error of this position [cells]
[[gnu::cold]] inline void add_mirror(std::vector<MirrorPlane>& planes, const MirrorPlane& plane, double on_grid,
                                     double tolerance, double position, double cell_size) {
    if (!(std::abs(on_grid - plane.node) <= tolerance))
        throw parameter_error(sentence(
            "The wall at ", position, " m along axis ", plane.axis, " lies ", on_grid,
            " cells above the lower end of the domain, on no plane of nodes. A mirrored wall must lie on one: move it, "
            "choose cells that divide the domain (now ",
            cell_size, " m), or set nodes_behind to NodesBehind::held."));
    for (const MirrorPlane& other : planes)
        if (other.part == plane.part && other.axis == plane.axis && std::abs(other.node - plane.node) < 3)
            throw parameter_error(sentence("Two mirrored walls across axis ", plane.axis, " are ",
                                           std::abs(other.node - plane.node),
                                           " cells apart; at least 3 are needed. Take smaller cells, or set "
                                           "nodes_behind to NodesBehind::held."));
    planes.push_back(plane);
}

}  // namespace detail

/// Returns the mirrored walls of a boundary. There are none if the boundary has no function mirrors().
/// \throws parameter_error  if a mirrored wall lies on no plane of nodes, or if two opposite ones are fewer than 3
/// cells
///                          apart
template <class Kernel, class Boundary, int D>
Mirrors mirrors_of(const Boundary& boundary, const Domain<D>& domain) {
    Mirrors mirrors;
    if constexpr (has_mirrors<Boundary>) {
        boundary.mirrors([&](int axis, auto position, int inward, Contact contact, double friction, int part) {
            const double on_grid = (double(position) - domain.lower[axis]) / domain.cell_size;
            const double rounding = double(std::numeric_limits<decltype(position)>::epsilon());
            const double tolerance =
                1e-6 + 4 * rounding * (std::abs(domain.lower[axis]) + std::abs(domain.upper[axis])) / domain.cell_size;
            detail::add_mirror(mirrors.planes, {axis, int(std::lround(on_grid)), inward, contact, friction, part},
                               on_grid, tolerance, double(position), domain.cell_size);
        });
        mirrors.weights = surface_weights<Kernel, double>();
    }
    return mirrors;
}

namespace detail {

/// The three nodes of one column in the grid: behind the wall, on it, and in front of it. nullptr stands for a node
/// that the grid does not contain.
template <class S>
using ColumnNodes = std::array<S*, 3>;

/// Calls f(nodes) for each column of nodes across a wall whose middle node lies in block b.
template <std::floating_point S, int D, class F>
void for_columns(SparseGrid<S, D>& grid, const MirrorPlane& plane, std::size_t b, const F& f) {
    const auto axis = std::size_t(plane.axis);
    BlockCoordinate<D> block = grid.block(b);
    if (block[axis] != plane.node >> 2) return;
    const int apart = 1 << (2 * (D - 1 - plane.axis));  // the nodes of a column are so many nodes apart in the block
    ColumnNodes<S> first;                               // the column through the block's first line
    for (int k = 0; k < 3; ++k) {
        const int node = plane.node + (k - 1) * plane.inward;
        block[axis] = node >> 2;
        const std::uint32_t of_node = k == 1 ? std::uint32_t(b) : grid.find(wrapped(grid.domain(), block));
        first[std::size_t(k)] = of_node == no_block ? nullptr : grid.nodes(of_node) + (node & 3) * apart * node_width;
    }
    for (int line = 0; line < block_nodes<D> / block_size; ++line) {
        const int offset = (line / apart * apart * block_size + line % apart) * node_width;
        ColumnNodes<S> nodes;
        for (std::size_t k = 0; k < 3; ++k) nodes[k] = first[k] ? first[k] + offset : nullptr;
        f(nodes);
    }
}

template <std::floating_point S, int D>
FIRN_INLINE NodeColumn<S, D> load_column(const ColumnNodes<S>& nodes) {
    NodeColumn<S, D> column{};
    Vec<S, D>* const velocities[] = {&column.behind, &column.on, &column.front};
    S* const masses[] = {&column.mass_behind, &column.mass_on, &column.mass_front};
    for (std::size_t k = 0; k < 3; ++k)
        if (nodes[k]) {
            for (int a = 0; a < D; ++a) velocities[k]->v[a] = nodes[k][a];
            *masses[k] = nodes[k][node_mass];
        }
    return column;
}
template <std::floating_point S, int D>
FIRN_INLINE void store_column(const NodeColumn<S, D>& column, const ColumnNodes<S>& nodes) {
    const Vec<S, D>* const velocities[] = {&column.behind, &column.on, &column.front};
    const S masses[] = {column.mass_behind, column.mass_on, column.mass_front};
    for (std::size_t k = 0; k < 3; ++k)
        if (nodes[k]) {
            for (int a = 0; a < D; ++a) nodes[k][a] = velocities[k]->v[a];
            nodes[k][node_mass] = masses[k];
        }
}

/// Adds the impulse of a wall on matter at the nodes of a column. The masses are those before any wall acted.
template <std::floating_point S, int D>
[[gnu::cold]] void add_reaction(Reaction<D>& sum, const SparseGrid<S, D>& grid, const ColumnNodes<S>& nodes,
                                const S* masses, const NodeColumn<S, D>& before, const NodeColumn<S, D>& after) {
    const Vec<S, D>*const old[] = {&before.behind, &before.on, &before.front}, *const now[] = {&after.behind, &after.on,
                                                                                               &after.front};
    for (std::size_t k = 0; k < 3; ++k) {
        if (!nodes[k]) continue;
        const auto index = std::size_t(nodes[k] - grid.nodes(0)) / node_width, in_block = index % block_nodes<D>;
        const BlockCoordinate<D> block = grid.block(index / block_nodes<D>);
        Vec<double, D> arm{}, impulse{};
        for (int a = 0; a < D; ++a) {
            const int place = int(in_block >> 2 * (D - 1 - a)) & (block_size - 1);
            arm[a] = position_of_place(grid.domain(), block, a, place) - sum.about[a];
            impulse[a] = double(masses[index]) * (double(now[k]->v[a]) - double(old[k]->v[a]));
        }
        sum.impulse += impulse;
        sum.angular_impulse += axial_product(arm, impulse);
    }
}

/// Lets mirrored walls act on the nodes beside them, which hold velocities and masses. \see mirrored
/// \param with_friction  false: walls act without friction
/// \param reactions      impulses of the walls on matter are added to it; nullptr if they are not wanted
template <class Execution, std::floating_point S, int D>
void mirror_nodes(const Execution& execution, SparseGrid<S, D>& grid, const Mirrors& mirrors, bool with_friction,
                  Reactions<D>* reactions = nullptr) {
    if (mirrors.planes.empty()) return;
    const int threads = thread_count(requested_threads(execution));
    const SurfaceWeights<S> weights{S(mirrors.weights.on), S(mirrors.weights.beside)};
    const std::size_t blocks = grid.block_count();
    std::vector<Reaction<D>> of_blocks;
    std::size_t parts = 0;
    S* masses = nullptr;
    if (reactions) {
        parts = reactions->parts.size();
        of_blocks.resize(blocks * parts);
        for (std::size_t i = 0; i < of_blocks.size(); ++i) of_blocks[i].about = reactions->parts[i % parts].about;
        masses = grid.template scratch<S>(threads);
        const S* const nodes = grid.nodes(0);
        for (std::size_t i = 0; i < blocks * block_nodes<D>; ++i) masses[i] = nodes[i * node_width + node_mass];
    }
    // A column across one axis must find the columns across the axis before it finished: at an edge, nodes are mirrored
    // twice.
    for (std::size_t first = 0, last = 0; first < mirrors.planes.size(); first = last) {
        const MirrorPlane& of = mirrors.planes[first];
        while (last < mirrors.planes.size() && mirrors.planes[last].axis == of.axis &&
               mirrors.planes[last].part == of.part)
            ++last;
        // The rank that counts the block behind the wall counts the column, in the sum of that block. No matter reaches
        // a column without this block.
        const auto add = [&](const ColumnNodes<S>& nodes, int part, const NodeColumn<S, D>& before,
                             const NodeColumn<S, D>& after) {
            if (!nodes[0]) return;
            const auto behind = std::size_t(nodes[0] - grid.nodes(0)) / std::size_t(block_nodes<D> * node_width);
            if (ranks_of(execution).template counts<D>(behind))
                add_reaction(of_blocks[behind * parts + std::size_t(part)], grid, nodes, masses, before, after);
        };
        const auto act = [&](std::size_t b, int) {
            for (std::size_t p = first; p < last; ++p) {
                const MirrorPlane& plane = mirrors.planes[p];
                const S friction = with_friction ? S(plane.friction) : S(0);
                for_columns(grid, plane, b, [&](const ColumnNodes<S>& nodes) {
                    const NodeColumn<S, D> before = load_column<S, D>(nodes);
                    if (!(before.mass_behind > 0 || before.mass_on > 0 || before.mass_front > 0)) return;
                    const NodeColumn<S, D> after =
                        mirrored(before, plane.axis, plane.inward, plane.contact, friction, weights);
                    store_column(after, nodes);
                    if (reactions) add(nodes, plane.part, before, after);
                });
            }
        };
        parallel_for(blocks, threads, act, 16);
    }
    if (reactions) {
        std::vector<Reaction<D>> of_walls(parts);
        sum_reactions<Execution, D>(execution, of_blocks, of_walls);
        for (std::size_t k = 0; k < parts; ++k) reactions->parts[k] += of_walls[k];
    }
}

}  // namespace detail
}  // namespace firn
