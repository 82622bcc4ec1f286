/// \file The pass in which walls and colliders act by the gap of particles. \see GapContact. It follows the grid
/// update:
///
///     const auto mirrors = mirrors_by_gap<Kernel>(execution, grid, boundary, dt, memory, sets);
///     before_p2g<Kernel, Transfer>(execution, grid, mirrors, sets);
///     …
///     grid_update(execution, grid, dt, acceleration, NoBoundary{});
///     act_by_gap<Kernel>(execution, grid, boundary, dt, mirrors, memory, reactions, sets);
///     …
///
/// and memory.forget() follows each grid.activate().
#pragma once

#include <firn/boundary/gap_contact.hpp>
#include <firn/core/parallel.hpp>
#include <firn/data/particle_set.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/loops/execution.hpp>
#include <firn/loops/mirror.hpp>
#include <firn/loops/near_particles.hpp>
#include <firn/loops/reactions.hpp>
#include <firn/loops/separation.hpp>
#include <firn/stage/mirror_planes.hpp>
#include <firn/stage/time_step.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Memory for mirrors_by_gap() and act_by_gap(). Pass the same object in every step, so that memory is not allocated
/// again.
template <class Kernel, std::floating_point S, int D>
class GapMemory {
public:
    /// A block of the grid at which a boundary may act.
    struct Place {
        std::uint32_t block;                             ///< grid index
        typename NearParticles<Kernel, D>::Blocks near;  ///< where the base nodes of its particles lie in near()
    };

    /// Call it when the grid was activated: the particles have moved in memory.
    void forget() { is_known_ = false; }

    /// Finds the blocks at which a boundary may act. As long as they are the same, this does nothing.
    /// \param reaches  a function: reaches(b) returns whether the boundary may act on nodes of block b
    template <class Reaches>
    void find_places(const SparseGrid<S, D>& grid, std::span<const BlockPartition<D>* const> partitions, int threads,
                     const Reaches& reaches) {
        if (of_threads.size() < std::size_t(threads)) of_threads.resize(std::size_t(threads));
        is_reached_.resize(grid.block_count());
        parallel_for(grid.block_count(), threads, [&](std::size_t b, int) { is_reached_[b] = reaches(b); }, 64);
        if (is_known_ && is_reached_ == were_reached_) return;
        is_known_ = true;
        were_reached_ = is_reached_;
        places_.clear(), near_.clear();
        for (std::uint32_t b = 0; b < grid.block_count(); ++b) {
            if (!is_reached_[b]) continue;
            places_.push_back({b, near_.want_around(grid.domain(), grid.block(b))});
        }
        near_.connect(grid.domain(), partitions);
        nodes.resize(places_.size());
    }
    const std::vector<Place>& places() const { return places_; }  ///< The blocks, in the order of the grid.
    NearParticles<Kernel, D>& near() { return near_; }            ///< The particles near these blocks.

    MirrorsByGap<S> mirrors{};           ///< The mirrored walls of the present step. \see mirrors_by_gap
    std::vector<std::uint64_t> nodes{};  ///< For each place, bits of the nodes that take part.
    std::vector<detail::AroundBlock<Kernel, D>> of_threads{};  ///< Memory of each thread.

private:
    bool is_known_ = false;
    std::vector<std::uint8_t> is_reached_{}, were_reached_{};
    std::vector<Place> places_{};
    NearParticles<Kernel, D> near_{};
};

namespace detail {

template <class View>
auto partitions_of(ParticleSets<View> sets) {
    std::vector<const BlockPartition<View::dimension>*> partitions;
    for (const ParticleSet<View>& set : sets) partitions.push_back(&set.partition);
    return partitions;
}

/// Returns whether a boundary may act on nodes of block b.
template <std::floating_point S, int D, class Boundary>
bool reaches_block(const Boundary& boundary, const SparseGrid<S, D>& grid, std::size_t b) {
    return boundary.reaches(node_position(grid, b, 0), node_position(grid, b, block_nodes<D> - 1));
}

/// Returns a set of bits, one for each node of block b on which surfaces of a boundary may act.
/// \param boundary  in double
template <std::floating_point S, int D, class Boundary>
std::uint64_t nodes_of_boundary(const SparseGrid<S, D>& grid, std::size_t b, const Boundary& boundary) {
    std::uint64_t bits = 0;
    for (int node = 0; node < block_nodes<D>; ++node) {
        if (!(grid.nodes(b)[node * node_width + node_mass] >= std::numeric_limits<S>::min())) continue;
        bool takes_part = false;
        const NoteSurface<D> note{grid.domain().cell_size, takes_part};
        const Vec<double, D> v = Vec<double, D>::zero();
        velocity_by_gap<Boundary, D>(boundary, node_position(grid, b, node), v, note, AnySurface{});
        bits |= std::uint64_t(takes_part) << node;
    }
    return bits;
}

/// Lets a boundary act on nodes of one block.
/// \param boundary   in double
/// \param nodes      a set of bits, one for each node that takes part
/// \param reactions  one Reaction for each part; nullptr if they are not wanted
template <class Kernel, std::floating_point S, int D, class Boundary>
void act_on_block(SparseGrid<S, D>& grid, const NearParticles<Kernel, D>& near,
                  const typename GapMemory<Kernel, S, D>::Place& place, std::uint64_t nodes, const Boundary& boundary,
                  double dt, AroundBlock<Kernel, D>& around, Reaction<D>* reactions) {
    if (nodes == 0) return;
    const double h = grid.domain().cell_size;
    near.gather(place.near, nodes, around);
    for (; nodes != 0; nodes &= nodes - 1) {
        const int node = std::countr_zero(nodes);
        const AroundNode<Kernel, D> at_node(around, node);
        if (at_node.size() == 0) continue;
        S* const numbers = grid.nodes(place.block) + node * node_width;
        Vec<double, D> v{};
        for (int a = 0; a < D; ++a) v[a] = double(numbers[a]);
        const Vec<double, D> x = node_position(grid, place.block, node);
        const auto nearest = [&](const Vec<double, D>& normal) {
            return h * Separator<Kernel, D>::depth(at_node, normal);
        };
        const auto seen = [&](int part, const Vec<double, D>& before, const Vec<double, D>& after) {
            if (reactions) add_impulse(reactions[part], x, double(numbers[node_mass]), after - before);
        };
        const Vec<double, D> after =
            velocity_by_gap<Boundary, D>(boundary, x, v, ActByGap<D, decltype(nearest)>{h, dt, nearest}, seen);
        for (int a = 0; a < D; ++a) numbers[a] = S(after[a]);
    }
}

/// Finds the closing speeds of a wall's columns whose middle nodes lie in one block.
template <class Kernel, std::floating_point S, int D>
void find_closing(const NearParticles<Kernel, D>& near, const typename GapMemory<Kernel, S, D>::Place& place,
                  const MirrorPlane& plane, double cell_size, double dt, AroundBlock<Kernel, D>& around, S* closing) {
    const int apart = 1 << (2 * (D - 1 - plane.axis));
    auto normal = Vec<double, D>::zero();
    normal[plane.axis] = plane.inward;
    near.gather(place.near, BoxMasks<D>::along(plane.axis, 1u << (plane.node & 3)), around);
    for (int c = 0; c < BlockColumns<S, D>::count; ++c) {
        const int node = BlockColumns<S, D>::node_of_column(c, apart) + (plane.node & 3) * apart;
        const AroundNode<Kernel, D> at_node(around, node);
        if (at_node.size() == 0) continue;
        const double gap = Separator<Kernel, D>::depth(at_node, normal);  // [cells]
        if (!(gap * cell_size < ActByGap<D, int>::none)) continue;
        closing[c] =
            holds(plane.contact, gap, boundary_reach) ? S(held_by_wall) : S(closing_speed(gap * cell_size, dt));
    }
}

/// Does the work of mirrors_by_gap().
template <class Kernel, class Ranks, std::floating_point S, int D, class Boundary, class View>
MirrorsByGap<S> find_mirrors(int threads, const Ranks& ranks, const SparseGrid<S, D>& grid,
                             const GapContact<Boundary>& boundary, double dt, GapMemory<Kernel, S, D>& memory,
                             ParticleSets<View> sets) {
    check_step(dt);
    MirrorsByGap<S> mirrors{mirrors_of<Kernel>(boundary, grid.domain())};
    if (mirrors.planes.empty()) return mirrors;
    constexpr int padded = BlockColumns<S, D>::padded;
    const std::vector<const BlockPartition<D>*> partitions = partitions_of(sets);
    const auto has_plane = [&](const MirrorPlane& plane, std::size_t b) {
        return grid.block_along(b, plane.axis) == plane.node >> 2;
    };
    const Boundary here = on_grid(boundary.boundary, grid.domain().cell_size);
    memory.find_places(grid, partitions, threads, [&](std::size_t b) {
        return reaches_block(here, grid, b) || std::any_of(mirrors.planes.begin(), mirrors.planes.end(),
                                                           [&](const auto& of) { return has_plane(of, b); });
    });
    mirrors.blocks = grid.block_count();
    mirrors.first.assign(mirrors.planes.size() * mirrors.blocks, MirrorsByGap<S>::no_columns);
    std::uint32_t columns = 0;
    for (std::size_t p = 0; p < mirrors.planes.size(); ++p)
        for (const auto& place : memory.places())
            if (has_plane(mirrors.planes[p], place.block)) {
                mirrors.first[p * mirrors.blocks + place.block] = columns;
                columns += padded;
            }
    mirrors.closing.assign(columns, S(never_closing));
    // Matter must not meet its images behind the wall itself, so walls across different axes have passes of their own.
    for (int axis = 0; axis < D; ++axis) {
        Mirrors others = mirrors;
        std::erase_if(others.planes, [&](const MirrorPlane& plane) { return plane.axis == axis; });
        if (others.planes.size() == mirrors.planes.size()) continue;
        const auto for_columns = [&](const auto& f) {
            const auto of_place = [&](std::size_t i, int thread) {
                for (std::size_t p = 0; p < mirrors.planes.size(); ++p)
                    if (mirrors.planes[p].axis == axis && has_plane(mirrors.planes[p], memory.places()[i].block))
                        f(memory.places()[i], p, std::size_t(thread));
            };
            parallel_for(memory.places().size(), threads, of_place, 16);
        };
        for_columns([&](const auto& place, std::size_t p, std::size_t) {
            memory.near().mark_around(place.near, BoxMasks<D>::along(axis, 1u << (mirrors.planes[p].node & 3)));
        });
        memory.near().find(grid.domain(), others, threads, [&](auto& near) { ranks.bring_near(near); }, sets);
        for_columns([&](const auto& place, std::size_t p, std::size_t thread) {
            find_closing(memory.near(), place, mirrors.planes[p], grid.domain().cell_size, dt,
                         memory.of_threads[thread],
                         mirrors.closing.data() + mirrors.first[p * mirrors.blocks + place.block]);
        });
    }
    return mirrors;
}

/// Finds the blocks that a boundary reaches, unless mirrors_by_gap() has found them. \param here  on this grid
template <class Kernel, std::floating_point S, int D, class Boundary, class View>
void find_places(const Boundary& here, int threads, const SparseGrid<S, D>& grid, const MirrorsByGap<S>& mirrors,
                 GapMemory<Kernel, S, D>& memory, ParticleSets<View> sets) {
    if (!mirrors.planes.empty()) return;
    const std::vector<const BlockPartition<D>*> partitions = partitions_of(sets);
    memory.find_places(grid, partitions, threads, [&](std::size_t b) { return reaches_block(here, grid, b); });
}
/// Finds the nodes of these blocks on which a boundary may act, and the matter near them. Call it in a parallel region.
/// \param exact  the boundary in double
template <class Kernel, class Ranks, std::floating_point S, int D, class Boundary, class View>
void find_nodes(const Boundary& exact, int threads, const Ranks& ranks, const SparseGrid<S, D>& grid,
                const MirrorsByGap<S>& mirrors, GapMemory<Kernel, S, D>& memory, ParticleSets<View> sets) {
    const auto look = [&](std::size_t i, int) {
        const auto& place = memory.places()[i];
        memory.nodes[i] = nodes_of_boundary(grid, place.block, exact);
        memory.near().mark_around(place.near, memory.nodes[i]);
    };
    parallel_for(memory.places().size(), threads, look, 4);
    memory.near().find(grid.domain(), mirrors, threads, [&](auto& near) { ranks.bring_near(near); }, sets);
}

/// Does the work of act_by_gap().
template <class Kernel, class Ranks, std::floating_point S, int D, class Boundary, class View>
void let_boundary_act(int threads, const Ranks& ranks, SparseGrid<S, D>& grid, const GapContact<Boundary>& boundary,
                      double dt, const MirrorsByGap<S>& mirrors, GapMemory<Kernel, S, D>& memory,
                      Reactions<D>* reactions, ParticleSets<View> sets) {
    check_step(dt);
    const Boundary here = on_grid(boundary.boundary, grid.domain().cell_size);
    const auto exact = lift<double>(here);
    find_places(here, threads, grid, mirrors, memory, sets);
    const auto& places = memory.places();
    std::vector<Reaction<D>> of_places;
    std::size_t parts = 0;
    if (reactions) {
        begin_reactions(*reactions, boundary);
        parts = reactions->parts.size();
        of_places.resize(places.size() * parts);
    }
    parallel_region(threads, [&] {
        find_nodes(exact, threads, ranks, grid, mirrors, memory, sets);
        const auto act = [&](std::size_t i, int thread) {
            const bool counts = reactions && ranks.template counts<D>(places[i].block);
            Reaction<D>* const of_place = counts ? of_places.data() + i * parts : nullptr;
            for (std::size_t k = 0; counts && k < parts; ++k) of_place[k].about = reactions->parts[k].about;
            act_on_block(grid, memory.near(), places[i], memory.nodes[i], exact, dt,
                         memory.of_threads[std::size_t(thread)], of_place);
        };
        parallel_for(places.size(), threads, act, 4);
    });
    const RanksAs<S, D, Ranks> sums(ranks);
    if (reactions) sum_reactions<D>(sums, of_places, reactions->parts);
    if constexpr (has_mirrors<Boundary>) mirror_nodes(threads, sums, grid, mirrors, true, reactions);
}

}  // namespace detail

/// Returns the mirrored walls of a boundary that acts by the gap of particles, with the speeds at which matter may
/// approach them in this step.
/// \param dt      time step [s]
/// \param memory  pass the same object in every step
/// \param sets    all sets on the grid
/// \throws parameter_error  in the cases of mirrors_of(), or if `dt` is not valid
template <class Kernel, class Execution, std::floating_point S, int D, class Boundary, class View>
MirrorsByGap<S> mirrors_by_gap(const Execution& execution, const SparseGrid<S, D>& grid,
                               const GapContact<Boundary>& boundary, double dt, GapMemory<Kernel, S, D>& memory,
                               ParticleSets<View> sets) {
    return detail::find_mirrors(detail::threads_of(execution), ranks_of(execution), grid, boundary, dt, memory, sets);
}

/// Lets a boundary act on the nodes, by the gap of particles. Call it when the nodes hold velocities, with the
/// accelerations of the step.
/// \param dt         time step [s]
/// \param mirrors    what mirrors_by_gap() returned in this step
/// \param memory     pass the same object in every step
/// \param reactions  receives the impulses of the boundary on matter; nullptr if they are not wanted. \see Reactions
/// \param sets       all sets on the grid
/// \throws parameter_error  if `dt` or a parameter of the boundary is not valid
template <class Kernel, class Execution, std::floating_point S, int D, class Boundary, class View>
void act_by_gap(const Execution& execution, SparseGrid<S, D>& grid, const GapContact<Boundary>& boundary, double dt,
                const MirrorsByGap<S>& mirrors, GapMemory<Kernel, S, D>& memory, Reactions<D>* reactions,
                ParticleSets<View> sets) {
    detail::let_boundary_act(detail::threads_of(execution), ranks_of(execution), grid, boundary, dt, mirrors, memory,
                             reactions, sets);
}

}  // namespace firn::inline FIRN_BUILD
