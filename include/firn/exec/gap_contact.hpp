/// \file The pass in which walls and colliders act by the gap of particles. \see GapContact. It follows the grid
/// update:
///
///     const auto mirrors = mirrors_by_gap<Kernel>(execution, grid, boundary, dt, memory, sets...);
///     before_p2g<Kernel, Transfer>(execution, grid, mirrors, sets...);
///     …
///     grid_update(execution, grid, dt, acceleration, NoBoundary{});
///     act_by_gap<Kernel>(execution, grid, boundary, dt, mirrors, memory, reactions, sets...);
///     …
#pragma once

#include <firn/boundary/gap_contact.hpp>
#include <firn/core/parallel.hpp>
#include <firn/data/particle_set.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/exec/contact.hpp>
#include <firn/exec/execution.hpp>
#include <firn/exec/mirror.hpp>
#include <firn/exec/reactions.hpp>
#include <firn/exec/separation.hpp>
#include <firn/stage/mirror_planes.hpp>
#include <firn/stage/time_step.hpp>

#include <algorithm>
#include <array>
#include <vector>

namespace firn {

namespace detail {
/// Memory of one thread for boundaries that act by the gap of particles.
template <class Kernel, int D>
struct GapScratch {
    NearParticles<Kernel, D> near{};       ///< the particles around the nodes of a block
    std::vector<MirrorImage<D>> images{};  ///< the mirror images of particles that may reach the block
};
}  // namespace detail

/// Memory for mirrors_by_gap() and act_by_gap(). Pass the same object in every step, so that memory is not allocated
/// again.
template <class Kernel, int D>
struct GapMemory {
    std::vector<detail::GapScratch<Kernel, D>> of_threads{};  ///< Memory of each thread.
};

namespace detail {

/// Finds the particles, and their mirror images, around some nodes of a block: those of the block's contact group.
/// \param low, high     the nodes: the lowest and the highest along each axis, counted from the block's first node
/// \param but_not_axis  mirror images across this axis are left out; −1: none are
template <class Kernel, std::floating_point S, int D, class... Views>
void find_near_block(GapScratch<Kernel, D>& scratch, const SparseGrid<S, D>& grid, std::size_t b, const int (&low)[D],
                     const int (&high)[D], const Mirrors& mirrors, int but_not_axis,
                     const ParticleSet<Views>&... sets) {
    const double h = grid.domain().cell_size;
    BlockCoordinate<D> in_domain = grid.block(b);
    in_domain[0] = grid.block_along(b, 0);
    find_images(mirrors, in_domain, scratch.images);
    if (but_not_axis >= 0)
        std::erase_if(scratch.images, [&](const MirrorImage<D>& image) { return image.reflects[but_not_axis]; });
    scratch.near.clear(low, high);
    const auto add = [&](const auto& set) {
        const BlockPartition<D>& partition = set.partition;
        const auto key_of = [&](std::uint32_t range) { return block_key<D>(partition.ranges[range].block); };
        for (int i = 0; i < (D == 2 ? 9 : 27); ++i) {
            int apart[D];
            BlockCoordinate<D> block = grid.block(b);
            for (int a = D - 1, rest = i; a >= 0; --a, rest /= 3) {
                apart[a] = rest % 3 - 1;
                block[std::size_t(a)] += apart[a];
            }
            const std::uint64_t key = block_key<D>(wrapped(grid.domain(), block));
            const auto found = std::ranges::lower_bound(partition.by_block, key, {}, key_of);
            if (found == partition.by_block.end() || key_of(*found) != key) continue;
            for (const MirrorImage<D>& image : scratch.images)
                find_near(scratch.near, set.view, partition.order.data(), partition.ranges[*found], apart, image, h);
        }
    };
    (add(sets), ...);
    scratch.near.sort();
}

/// Returns the place of a node in its block along an axis. \param node  index of the node in the block
template <int D>
constexpr int place_in_block(int node, int axis) {
    return node >> 2 * (D - 1 - axis) & (block_size - 1);
}

/// Lets a boundary act on the nodes of one block.
/// \param boundary   in double
/// \param reactions  one Reaction for each part; nullptr if they are not wanted
template <class Kernel, std::floating_point S, int D, class Boundary, class... Views>
void act_on_block(SparseGrid<S, D>& grid, std::size_t b, const Boundary& boundary, double dt, const Mirrors& mirrors,
                  GapScratch<Kernel, D>& scratch, Reaction<D>* reactions, const ParticleSet<Views>&... sets) {
    const double h = grid.domain().cell_size;
    const auto position = [&](int node) {
        Vec<double, D> x{};
        for (int a = 0; a < D; ++a)
            x[a] = position_of_place(grid.domain(), grid.block(b), a, place_in_block<D>(node, a));
        return x;
    };
    std::array<bool, std::size_t(block_nodes<D>)> takes_part{};
    int low[D], high[D];
    std::fill_n(low, D, block_size);
    std::fill_n(high, D, -1);
    for (int node = 0; node < block_nodes<D>; ++node) {
        if (!(grid.nodes(b)[node * node_width + node_mass] >= std::numeric_limits<S>::min())) continue;
        bool& takes = takes_part[std::size_t(node)];
        const auto look = [&](const Vec<double, D>&) {
            takes = true;
            return std::numeric_limits<double>::infinity();  // the surface does not act
        };
        velocity_by_gap<Boundary, D>(boundary, position(node), {}, ActByGap<D, decltype(look)>{h, dt, look},
                                     AnySurface{});
        if (!takes) continue;
        for (int a = 0; a < D; ++a) {
            low[a] = std::min(low[a], place_in_block<D>(node, a));
            high[a] = std::max(high[a], place_in_block<D>(node, a));
        }
    }
    if (high[0] < 0) return;
    find_near_block(scratch, grid, b, low, high, mirrors, -1, sets...);
    if (scratch.near.found.empty()) return;
    for (int node = 0; node < block_nodes<D>; ++node) {
        if (!takes_part[std::size_t(node)]) continue;
        S* const numbers = grid.nodes(b) + node * node_width;
        int at[D];
        Vec<double, D> v{};
        for (int a = 0; a < D; ++a) {
            at[a] = place_in_block<D>(node, a);
            v[a] = double(numbers[a]);
        }
        const Vec<double, D> x = position(node);
        const auto nearest = [&](const Vec<double, D>& normal) {
            return h * Separator<Kernel, D>::nearest(scratch.near, at, normal);
        };
        const auto seen = [&](int part, const Vec<double, D>& before, const Vec<double, D>& after) {
            if (reactions) add_impulse(reactions[part], x, double(numbers[node_mass]), after - before);
        };
        const Vec<double, D> after =
            velocity_by_gap<Boundary, D>(boundary, x, v, ActByGap<D, decltype(nearest)>{h, dt, nearest}, seen);
        for (int a = 0; a < D; ++a) numbers[a] = S(after[a]);
    }
}

/// Finds the closing speeds of a wall's columns whose middle nodes lie in block b.
template <class Kernel, std::floating_point S, int D, class... Views>
void find_closing(const SparseGrid<S, D>& grid, std::size_t b, const MirrorPlane& plane, double dt,
                  const Mirrors& mirrors, GapScratch<Kernel, D>& scratch, S* closing,
                  const ParticleSet<Views>&... sets) {
    int low[D], high[D];
    std::fill_n(low, D, 0);
    std::fill_n(high, D, block_size - 1);
    low[plane.axis] = high[plane.axis] = plane.node & 3;
    find_near_block(scratch, grid, b, low, high, mirrors, plane.axis, sets...);
    if (scratch.near.found.empty()) return;
    const bool holds = plane.contact == Contact::slip || plane.contact == Contact::stick;
    const int apart = 1 << (2 * (D - 1 - plane.axis));
    auto normal = Vec<double, D>::zero();
    normal[plane.axis] = plane.inward;
    for (int c = 0; c < BlockColumns<S, D>::count; ++c) {
        const int node = BlockColumns<S, D>::node_of_column(c, apart);
        int at[D];
        for (int a = 0; a < D; ++a) at[a] = a == plane.axis ? plane.node & 3 : place_in_block<D>(node, a);
        const double gap = Separator<Kernel, D>::nearest(scratch.near, at, normal);  // [cells]
        if (!(gap < Separator<Kernel, D>::none)) continue;
        closing[c] = holds && gap <= boundary_reach ? S(-1) : S(std::max(gap, 0.0) * grid.domain().cell_size / dt);
    }
}

}  // namespace detail

/// Returns the mirrored walls of a boundary that acts by the gap of particles, with the speeds at which matter may
/// approach them in this step.
/// \param dt      time step [s]
/// \param memory  pass the same object in every step
/// \param sets    all sets on the grid
/// \throws parameter_error  in the cases of mirrors_of(), or if `dt` is not valid
template <class Kernel, class Execution, std::floating_point S, int D, class Boundary, class... Views>
MirrorsByGap<S> mirrors_by_gap(const Execution& execution, const SparseGrid<S, D>& grid,
                               const GapContact<Boundary>& boundary, double dt, GapMemory<Kernel, D>& memory,
                               const ParticleSet<Views>&... sets) {
    detail::check_step(dt);
    MirrorsByGap<S> mirrors{mirrors_of<Kernel>(boundary, grid.domain())};
    if (mirrors.planes.empty()) return mirrors;
    constexpr int padded = detail::BlockColumns<S, D>::padded;
    struct Place {
        std::size_t plane, block;
    };
    std::vector<Place> places;
    mirrors.blocks = grid.block_count();
    mirrors.first.assign(mirrors.planes.size() * mirrors.blocks, MirrorsByGap<S>::no_columns);
    for (std::size_t p = 0; p < mirrors.planes.size(); ++p)
        for (std::size_t b = 0; b < mirrors.blocks; ++b)
            if (grid.block_along(b, mirrors.planes[p].axis) == mirrors.planes[p].node >> 2) {
                mirrors.first[p * mirrors.blocks + b] = std::uint32_t(places.size() * padded);
                places.push_back({p, b});
            }
    mirrors.closing.assign(places.size() * padded, S(never_closing));
    const int threads = thread_count(requested_threads(execution));
    if (memory.of_threads.size() < std::size_t(threads)) memory.of_threads.resize(std::size_t(threads));
    const auto find = [&](std::size_t i, int thread) {
        detail::find_closing(grid, places[i].block, mirrors.planes[places[i].plane], dt, mirrors,
                             memory.of_threads[std::size_t(thread)], mirrors.closing.data() + i * padded, sets...);
    };
    parallel_for(places.size(), threads, find, 4);
    return mirrors;
}

/// Lets a boundary act on the nodes, by the gap of particles. Call it when the nodes hold velocities, with the
/// accelerations of the step.
/// \param dt         time step [s]
/// \param mirrors    what mirrors_by_gap() returned in this step
/// \param memory     pass the same object in every step
/// \param reactions  receives the impulses of the boundary on matter; nullptr if they are not wanted. \see Reactions
/// \param sets       all sets on the grid
/// \throws parameter_error  if `dt` or a parameter of the boundary is not valid
template <class Kernel, class Execution, std::floating_point S, int D, class Boundary, class... Views>
void act_by_gap(const Execution& execution, SparseGrid<S, D>& grid, const GapContact<Boundary>& boundary, double dt,
                const MirrorsByGap<S>& mirrors, GapMemory<Kernel, D>& memory, Reactions<D>* reactions,
                const ParticleSet<Views>&... sets) {
    static_assert(has_one_rank<Execution>,
                  "firn: boundaries that act by the gap of particles (GapContact) do not run on several processes yet. "
                  "Give the walls and colliders themselves, or use an execution without firn::mpi.");
    detail::check_step(dt);
    const double h = grid.domain().cell_size;
    const Boundary here = on_grid(boundary.boundary, h);
    const auto exact = lift<double>(here);
    const int threads = thread_count(requested_threads(execution));
    if (memory.of_threads.size() < std::size_t(threads)) memory.of_threads.resize(std::size_t(threads));
    std::vector<Reaction<D>> of_blocks;
    std::size_t parts = 0;
    if (reactions) {
        detail::begin_reactions(*reactions, boundary);
        parts = reactions->parts.size();
        of_blocks.resize(grid.block_count() * parts);
    }
    const auto act = [&](std::size_t b, int thread) {
        Vec<double, D> low, high;
        for (int a = 0; a < D; ++a) {
            low[a] = position_of_place(grid.domain(), grid.block(b), a, 0);
            high[a] = low[a] + h * (block_size - 1);
        }
        if (!here.reaches(low, high)) return;
        Reaction<D>* const of_block = reactions ? of_blocks.data() + b * parts : nullptr;
        for (std::size_t k = 0; k < parts; ++k) of_block[k].about = reactions->parts[k].about;
        detail::act_on_block(grid, b, exact, dt, mirrors, memory.of_threads[std::size_t(thread)], of_block, sets...);
    };
    parallel_for(grid.block_count(), threads, act, 4);
    if (reactions) detail::sum_reactions<Execution, D>(execution, of_blocks, reactions->parts);
    if constexpr (has_mirrors<Boundary>) detail::mirror_nodes(execution, grid, mirrors, true, reactions);
}

}  // namespace firn
