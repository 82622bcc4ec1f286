/// \file Contact between groups of matter, at all nodes where groups meet. Every contact group has nodes of its own: in
/// a copy of the domain's blocks, so P2G and G2P need not know of groups. \see copy_stride. A step is
///
///     …                                                                   // as without contact, up to the momenta
///     meet_groups<Kernel>(execution, grid, law, dt, mirrors, memory, impulses, sets...);
///     grid_update(execution, grid, dt, acceleration, boundary);
///     …
///
/// and memory.meetings.find(grid, partitions) follows each grid.activate().
#pragma once

#include <firn/core/exact_sum.hpp>
#include <firn/core/parallel.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/loops/execution.hpp>
#include <firn/loops/near_particles.hpp>
#include <firn/loops/separation.hpp>
#include <firn/loops/transfer_passes.hpp>
#include <firn/simd/transpose.hpp>
#include <firn/stage/contact.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <compare>
#include <limits>
#include <map>
#include <span>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// The impulses between contact groups in one step, summed over all nodes.
template <int D>
struct ContactImpulses {
    /// For each two groups that touched, the lower number first: the impulse on the first group [N s]. The second group
    /// received the opposite impulse.
    std::map<std::pair<int, int>, Vec<double, D>> on_first{};

    /// Returns the impulse that group b exerted on group a [N s]; zero if they did not touch.
    Vec<double, D> on(int a, int b) const {
        const auto found = on_first.find(std::minmax(a, b));
        if (found == on_first.end()) return Vec<double, D>::zero();
        return a < b ? found->second : -found->second;
    }
};

/// The blocks of the domain at which contact groups may meet: those of which the grid has copies for several groups.
template <class Kernel, int D>
class MeetingPlaces {
public:
    /// The nodes of one group in a block of the domain.
    struct Copy {
        int group;                                       ///< number of the contact group
        std::uint32_t block;                             ///< grid index of the copy
        typename NearParticles<Kernel, D>::Blocks near;  ///< where the base nodes of its particles lie in near()
    };
    /// A block of the domain.
    struct Place {
        std::size_t first,  ///< index in copies() of its first group; they are sorted by number
            last;           ///< index of its last group, plus 1
    };

    const std::vector<Place>& places() const { return places_; }  ///< The blocks, in the order of their keys.
    const std::vector<Copy>& copies() const { return copies_; }   ///< The groups in all blocks.
    /// The particles near these blocks.
    /// @{
    NearParticles<Kernel, D>& near() { return near_; }
    const NearParticles<Kernel, D>& near() const { return near_; }
    /// @}

    /// Finds the blocks, after the grid was activated for these partitions.
    /// \param elsewhere  the copies that only other ranks have. \see OneRank::copies_elsewhere
    template <std::floating_point S>
    void find(const SparseGrid<S, D>& grid, std::span<BlockPartition<D>* const> partitions,
              const CopiesElsewhere& elsewhere = {}) {
        places_.clear(), copies_.clear(), near_.clear();
        if (!has_contact_groups<D>(partitions) && elsewhere.keys.empty()) return;
        struct Found {
            std::uint64_t in_domain, key;
            std::uint32_t block;
            auto operator<=>(const Found&) const = default;
        };
        std::vector<Found> all;
        for (std::uint32_t b = 0; b < grid.block_count(); ++b) {
            const std::uint64_t key = block_key<D>(grid.block(b));
            all.push_back({key_in_domain(grid.domain(), key), key, b});
        }
        auto block = std::uint32_t(elsewhere.first_block);
        for (const std::uint64_t key : elsewhere.keys) all.push_back({key_in_domain(grid.domain(), key), key, block++});
        std::sort(all.begin(), all.end());  // copies of higher groups have higher keys
        for (std::size_t first = 0, last = 0; first < all.size(); first = last) {
            const std::uint64_t key = all[first].in_domain;
            while (last < all.size() && all[last].in_domain == key) ++last;
            if (last - first == 1) continue;
            places_.push_back({copies_.size(), copies_.size() + last - first});
            for (std::size_t i = first; i < last; ++i) {
                const BlockCoordinate<D> of = block_of_key<D>(all[i].key);
                copies_.push_back({group_of_copy(of[0], copy_stride(grid.domain())), all[i].block,
                                   near_.want_around(grid.domain(), of)});
            }
        }
        near_.connect(grid.domain(), partitions);
    }

private:
    std::vector<Place> places_;
    std::vector<Copy> copies_;
    NearParticles<Kernel, D> near_;
};

namespace detail {

/// Memory of one thread for contact.
template <class Kernel, int D>
struct ContactScratch {
    Separator<Kernel, D> separator{};
    std::vector<AroundBlock<Kernel, D>> around{};  ///< for each group in a block, its particles
    std::vector<AroundNode<Kernel, D>> at_node{};  ///< for each of `groups`, its particles
    std::vector<Vec<double, D>> normals{};         ///< for each two groups in a block, the normal found last
    std::vector<GroupAtNode<D>> groups{};
    std::vector<std::size_t> copy_of{};  ///< for each of `groups`, the index of its copy in the block
    std::vector<PairAtNode<D>> pairs{};
};

/// An impulse between two groups.
template <int D>
struct PairImpulse {
    int first, second;
    Vec<double, D> on_first;
};

}  // namespace detail

/// Memory for meet_groups(). Pass the same object in every step, so that memory is not allocated again.
template <class Kernel, int D>
struct ContactMemory {
    MeetingPlaces<Kernel, D> meetings{};                           ///< Where groups may meet.
    std::vector<std::uint64_t> meeting_nodes{};                    ///< For each copy, its nodes that meet others: bits.
    std::vector<detail::ContactScratch<Kernel, D>> of_threads{};   ///< Memory of each thread.
    std::vector<std::vector<detail::PairImpulse<D>>> of_places{};  ///< Impulses in each block.
};

namespace detail {

/// Returns a set of bits, one for each node of a block that has mass.
template <std::floating_point S, int D>
std::uint64_t nodes_with_mass(const SparseGrid<S, D>& grid, std::uint32_t block) {
    using P = native_pack<S>;
    constexpr int lanes = scalar_traits<P>::lanes;
    const S* const nodes = grid.nodes(block);
    std::uint64_t bits = 0;
    for (int from = 0; from < block_nodes<D>; from += lanes) {
        P r[4];
        load_quads(nodes + from * node_width, r);
        const auto filled = r[node_mass] >= P(std::numeric_limits<S>::min());
        if (!any(filled)) continue;
        for (int l = 0; l < lanes; ++l) bits |= std::uint64_t(filled[l]) << (from + quad_of_lane<P>(l));
    }
    return bits;
}

/// Finds the nodes of a block of the domain at which groups meet, and marks the particles that they need.
template <class Kernel, std::floating_point S, int D>
void find_meeting_nodes(const SparseGrid<S, D>& grid, const typename MeetingPlaces<Kernel, D>::Place& place,
                        ContactMemory<Kernel, D>& memory) {
    auto& meetings = memory.meetings;
    std::uint64_t some = 0, several = 0;
    for (std::size_t c = place.first; c < place.last; ++c) {
        const std::uint64_t filled = nodes_with_mass(grid, meetings.copies()[c].block);
        memory.meeting_nodes[c] = filled;
        several |= some & filled;
        some |= filled;
    }
    for (std::size_t c = place.first; c < place.last; ++c) {
        const std::uint64_t nodes = memory.meeting_nodes[c] &= several;
        meetings.near().mark_around(meetings.copies()[c].near, nodes);
    }
}

/// Lets the groups at the nodes of one block of the domain act on each other.
/// \param ranks     impulses on groups whose sums another rank counts are left out
/// \param meeting_nodes  for each copy in the block, bits of the nodes at which it meets others
/// \param masses    the numbers of the nodes with the masses that impulses count for; nullptr: the grid's
/// \param impulses  receives the impulses between groups; nullptr if they are not wanted
template <class Kernel, class Ranks, class Law, std::floating_point S, int D>
void meet_at(const Ranks& ranks, SparseGrid<S, D>& grid, const S* masses, const MeetingPlaces<Kernel, D>& meetings,
             const typename MeetingPlaces<Kernel, D>::Place& place, const std::uint64_t* meeting_nodes, const Law& law,
             double dt, ContactScratch<Kernel, D>& scratch, std::vector<PairImpulse<D>>* impulses) {
    const std::size_t count = place.last - place.first;
    const double h = grid.domain().cell_size;
    const ContactNormals how = normals_of(law);
    const double reach = reach_of(law);
    const auto copy = [&](std::size_t c) -> const auto& { return meetings.copies()[place.first + c]; };
    const auto numbers = [&](std::size_t c, int node) { return grid.nodes(copy(c).block) + node * node_width; };
    const auto group_at = [&](std::size_t c, int node) {
        GroupAtNode<D> group{copy(c).group, double(numbers(c, node)[node_mass]), {}};
        for (int a = 0; a < D; ++a) group.momentum[a] = double(numbers(c, node)[a]);
        return group;
    };
    std::uint64_t left = 0;
    for (std::size_t c = 0; c < count; ++c) left |= meeting_nodes[c];
    if (left == 0) return;
    if (scratch.around.size() < count) scratch.around.resize(count);
    for (std::size_t c = 0; c < count; ++c)
        for (std::uint64_t nodes = meeting_nodes[c]; nodes != 0; nodes &= nodes - 1)
            __builtin_prefetch(numbers(c, std::countr_zero(nodes)), 1);
    for (std::size_t c = 0; c < count; ++c)
        if (meeting_nodes[c] != 0) meetings.near().gather(copy(c).near, meeting_nodes[c], scratch.around[c]);
    scratch.normals.assign(count * count, Vec<double, D>::zero());
    for (; left != 0; left &= left - 1) {
        const int node = std::countr_zero(left);
        auto& groups = scratch.groups;
        auto& pairs = scratch.pairs;
        groups.clear(), pairs.clear(), scratch.copy_of.clear(), scratch.at_node.clear();
        for (std::size_t c = 0; c < count; ++c) {
            if (!(meeting_nodes[c] >> node & 1)) continue;
            groups.push_back(group_at(c, node));
            scratch.at_node.emplace_back(scratch.around[c], node);
            scratch.copy_of.push_back(c);
        }
        for (std::size_t i = 0; i < groups.size(); ++i)
            for (std::size_t k = i + 1; k < groups.size(); ++k) {
                const Vec<double, D> moved = velocity_between(groups[i], groups[k]) * (dt / h);
                Vec<double, D>& normal = scratch.normals[scratch.copy_of[i] * count + scratch.copy_of[k]];
                const Separation<D> found =
                    scratch.separator(scratch.at_node[i], scratch.at_node[k], moved, reach, how, normal);
                normal = found.normal;
                if (found.may_touch) pairs.push_back({i, k, found.normal, found.gap * h});
            }
        if (pairs.empty()) continue;
        meet(law, std::span(groups), std::span(pairs), h, dt);
        for (std::size_t i = 0; i < groups.size(); ++i)
            for (int a = 0; a < D; ++a) numbers(scratch.copy_of[i], node)[a] = S(groups[i].momentum[a]);
        if (!impulses) continue;
        for (const PairAtNode<D>& pair : pairs) {
            const std::size_t c = scratch.copy_of[pair.first], block = copy(c).block;
            if (!(dot(pair.impulse, pair.impulse) > 0) || block >= grid.block_count() ||
                !ranks.template counts<D>(block))
                continue;
            const double mass = masses ? double(masses[numbers(c, node) - grid.nodes(0) + node_mass]) : 0;
            impulses->push_back({groups[pair.first].group, groups[pair.second].group,
                                 masses ? pair.impulse * (mass / groups[pair.first].mass) : pair.impulse});
        }
    }
}

/// Sums the impulses between groups over all ranks. Each sum is exact and rounded once.
template <class Ranks, int D>
void sum_impulses(const Ranks& ranks, const std::vector<std::vector<PairImpulse<D>>>& of_places,
                  ContactImpulses<D>& impulses) {
    std::vector<std::pair<int, int>> pairs;
    for (const auto& of_place : of_places)
        for (const PairImpulse<D>& one : of_place) pairs.emplace_back(one.first, one.second);
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    ranks.join_pairs(pairs);
    std::vector<ExactSum> sums(pairs.size() * D);
    for (const auto& of_place : of_places)
        for (const PairImpulse<D>& one : of_place) {
            const auto pair = std::ranges::lower_bound(pairs, std::pair(one.first, one.second)) - pairs.begin();
            for (int a = 0; a < D; ++a)
                if (one.on_first[a] != 0) sums[std::size_t(pair * D + a)].add(one.on_first[a]);
        }
    ranks.merge(sums);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        Vec<double, D>& on_first = impulses.on_first[pairs[i]];
        for (int a = 0; a < D; ++a) on_first[a] = sums[i * D + std::size_t(a)].value();
    }
}

/// Lets mirrored walls act on the nodes beside them, which hold momenta and masses, without friction. Afterwards layer
/// 2 of the grid has the numbers before, and layer 3 those after.
template <std::floating_point S, int D, std::derived_from<Mirrors> M>
void mirror_momenta(int threads, SparseGrid<S, D>& grid, const M& mirrors) {
    using P = native_pack<S>;
    keep_in_layer(grid, layer::before_mirroring, threads);
    velocities_of_momenta(threads, grid, mirrors);
    for_nodes(grid, threads, [](S* node, std::size_t) {
        P r[4];
        const Vec<P, D> v = load_node_vectors<D>(node, r);
        store_node_vectors(v * r[node_mass], r, node);
    });
    keep_in_layer(grid, layer::mirrored, threads);
}
/// Gives the nodes the numbers that they had before mirror_momenta(), and the change of velocity since then.
template <std::floating_point S, int D>
void undo_mirrors(int threads, SparseGrid<S, D>& grid) {
    using P = native_pack<S>;
    for_nodes(grid, threads,
              [of_before = grid.layer(layer::before_mirroring), of_mirrored = grid.layer(layer::mirrored)](
                  S* node, std::size_t i) {
                  P r[4], before[4], mirrored[4];
                  const Vec<P, D> p = load_node_vectors<D>(node, r),
                                  p_before = load_node_vectors<D>(of_before + i, before);
                  const Vec<P, D> change = p - load_node_vectors<D>(of_mirrored + i, mirrored);
                  const P part = before[node_mass] * inverse_mass(mirrored[node_mass]);
                  r[node_mass] = before[node_mass];
                  store_node_vectors(p_before + change * part, r, node);
              });
}

/// Does the work of meet_groups().
template <class Kernel, class Law, class Ranks, std::floating_point S, int D, std::derived_from<Mirrors> M, class View>
void let_groups_meet(int threads, const Ranks& ranks, SparseGrid<S, D>& grid, const Law& law, double dt,
                     const M& mirrors, ContactMemory<Kernel, D>& memory, ContactImpulses<D>* impulses,
                     ParticleSets<View> sets) {
    const auto& places = memory.meetings.places();
    if (memory.of_threads.size() < std::size_t(threads)) memory.of_threads.resize(std::size_t(threads));
    memory.meeting_nodes.resize(memory.meetings.copies().size());
    memory.of_places.resize(places.size());
    const bool is_mirrored = !mirrors.planes.empty() && !places.empty();
    parallel_region(threads, [&] {
        if (is_mirrored) mirror_momenta(threads, grid, mirrors);
        ranks.bring_copies(grid);
        const S* const masses = is_mirrored ? grid.layer(layer::before_mirroring) : nullptr;
        parallel_for(
            places.size(), threads, [&](std::size_t i, int) { find_meeting_nodes(grid, places[i], memory); }, 16);
        memory.meetings.near().find(grid.domain(), mirrors, threads, [&](auto& near) { ranks.bring_near(near); }, sets);
        parallel_for(places.size(), threads, [&](std::size_t i, int thread) {
            memory.of_places[i].clear();
            meet_at(ranks, grid, masses, memory.meetings, places[i], memory.meeting_nodes.data() + places[i].first, law,
                    dt, memory.of_threads[std::size_t(thread)], impulses ? &memory.of_places[i] : nullptr);
        });
        if (is_mirrored) undo_mirrors(threads, grid);
    });
    if (!impulses) return;
    impulses->on_first.clear();
    sum_impulses(ranks, memory.of_places, *impulses);
}

}  // namespace detail

/// Gives every node the sum of its numbers over all contact groups that have the node.
/// \param ranks     what the ranks of the run tell each other
/// \param meetings  where groups may meet
template <class Kernel, class Ranks, std::floating_point S, int D>
void sum_copies(const Ranks& ranks, SparseGrid<S, D>& grid, const MeetingPlaces<Kernel, D>& meetings, int threads) {
    ranks.bring_copies(grid);
    parallel_for(
        meetings.places().size(), threads,
        [&](std::size_t p, int) {
            const auto& place = meetings.places()[p];
            for (int k = 0; k < block_nodes<D> * node_width; ++k) {
                S sum = 0;
                for (std::size_t c = place.first; c < place.last; ++c) sum += grid.nodes(meetings.copies()[c].block)[k];
                for (std::size_t c = place.first; c < place.last; ++c) grid.nodes(meetings.copies()[c].block)[k] = sum;
            }
        },
        16);
}

/// Lets contact groups act on each other: changes the momenta at all nodes where several groups have mass. Call it when
/// the nodes hold momenta and masses, with the impulses of stresses.
///
/// Beside mirrored walls, the nodes in front of a wall and behind it meet with the momentum and the mass that they have
/// together. Otherwise half a body would not meet another half as the whole meets the whole. Overwrites layers 2 and 3
/// of the grid if there are such walls.
/// \param law       the contact law. \see contact/concept.hpp
/// \param dt        time step [s]
/// \param mirrors   mirrors_of<Kernel>(boundary, domain)
/// \param memory    memory; its `meetings` must have been found for the grid
/// \param impulses  receives the impulses between groups; nullptr if they are not wanted
/// \param sets      all sets on the grid, in the order of their partitions
template <class Kernel, class Law, class Execution, std::floating_point S, int D, std::derived_from<Mirrors> M,
          class View>
void meet_groups(const Execution& execution, SparseGrid<S, D>& grid, const Law& law, double dt, const M& mirrors,
                 ContactMemory<Kernel, D>& memory, ContactImpulses<D>* impulses, ParticleSets<View> sets) {
    detail::let_groups_meet(detail::threads_of(execution), ranks_of(execution), grid, law, dt, mirrors, memory,
                            impulses, sets);
}

}  // namespace firn::inline FIRN_BUILD
