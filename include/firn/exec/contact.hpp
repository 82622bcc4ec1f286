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

#include <firn/core/parallel.hpp>
#include <firn/data/particle_set.hpp>
#include <firn/data/particle_view.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/exec/execution.hpp>
#include <firn/exec/separation.hpp>
#include <firn/math/exp_log.hpp>
#include <firn/stage/contact.hpp>
#include <firn/stage/mirror_planes.hpp>
#include <firn/stage/volume_filter.hpp>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

namespace firn {

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

/// The cubes of blocks at which contact groups may meet: those of which the grid has blocks for several groups.
template <int D>
class MeetingPlaces {
public:
    /// Particles of one block that may reach a node of a cube.
    struct Near {
        std::uint32_t set,  ///< index of the set of particles
            range;          ///< index of the range in the partition of the set
        int blocks[D];      ///< coordinates of their block, counted from the cube's first block
    };
    static constexpr int blocks_of_cube = D == 2 ? 4 : 8;  ///< Number of blocks in a cube.
    /// The nodes of one group at a cube of blocks.
    struct Copy {
        int group;          ///< number of the contact group
        std::size_t first,  ///< index in nears() of the first particles that may reach the nodes
            last;           ///< index of the last such particles, plus 1
        /// Grid indices of the blocks that hold the group's nodes, the last axis fastest; no_block where there is none.
        std::array<std::uint32_t, std::size_t(blocks_of_cube)> blocks;
    };
    /// A cube of blocks.
    struct Place {
        BlockCoordinate<D> corner;  ///< coordinates of its first block in the domain
        std::size_t first,          ///< index in copies() of its first group; they are sorted by number
            last;                   ///< index of its last group, plus 1
    };

    /// The cubes, sorted by the keys of their first blocks.
    const std::vector<Place>& places() const { return places_; }
    const std::vector<Copy>& copies() const { return copies_; }  ///< The groups at all cubes.
    const std::vector<Near>& nears() const { return nears_; }    ///< The particles near all copies.

    /// Finds the cubes, after the grid was activated for these partitions.
    template <std::floating_point S>
    void find(const SparseGrid<S, D>& grid, std::span<BlockPartition<D>* const> partitions) {
        places_.clear(), copies_.clear(), nears_.clear();
        if (std::none_of(partitions.begin(), partitions.end(), [](const auto* p) { return p->copy_stride > 0; }))
            return;
        struct Found {
            std::uint64_t cube;  // key of its first block in the domain
            int group;
            std::uint32_t block;  // grid index
            bool operator<(const Found& other) const {
                return std::tie(cube, group, block) < std::tie(other.cube, other.group, other.block);
            }
        };
        std::vector<Found> all;
        for (std::uint32_t b = 0; b < grid.block_count(); ++b) {
            BlockCoordinate<D> block = grid.block(b);
            block[0] = grid.block_along(b, 0);
            for (int& along : block) along &= ~(cube_blocks - 1);
            all.push_back({block_key<D>(block), grid.contact_group(b), b});
        }
        std::sort(all.begin(), all.end());
        for (std::size_t first = 0, last = 0; first < all.size(); first = last) {
            while (last < all.size() && all[last].cube == all[first].cube) ++last;
            if (all[first].group == all[last - 1].group) continue;
            const std::size_t begin = copies_.size();
            for (std::size_t i = first; i < last; ++i) {
                if (i == first || all[i].group != all[i - 1].group) add_copy(grid, all[i].block, partitions);
                int corner = 0;
                for (const int along : grid.block(all[i].block)) corner = corner * cube_blocks + (along & 1);
                copies_.back().blocks[std::size_t(corner)] = all[i].block;
            }
            places_.push_back({block_of_key<D>(all[first].cube), begin, copies_.size()});
        }
    }

private:
    /// Adds the group of block b at the cube of block b, without its blocks.
    template <std::floating_point S>
    void add_copy(const SparseGrid<S, D>& grid, std::size_t b, std::span<BlockPartition<D>* const> partitions) {
        constexpr int n = cube_blocks + 2;  // blocks along an axis whose particles reach the cube
        Copy copy{grid.contact_group(b), nears_.size(), 0, {}};
        copy.blocks.fill(no_block);
        for (std::uint32_t s = 0; s < partitions.size(); ++s) {
            const BlockPartition<D>& partition = *partitions[s];
            const auto key_of = [&](std::uint32_t range) { return block_key<D>(partition.ranges[range].block); };
            for (int i = 0; i < (D == 2 ? n * n : n * n * n); ++i) {
                Near near{s, 0, {}};
                BlockCoordinate<D> block = grid.block(b);
                for (int a = D - 1, rest = i; a >= 0; --a, rest /= n) {
                    near.blocks[a] = rest % n - 1;
                    block[std::size_t(a)] = (block[std::size_t(a)] & ~(cube_blocks - 1)) + near.blocks[a];
                }
                const std::uint64_t key = block_key<D>(wrapped(grid.domain(), block));
                const auto found = std::ranges::lower_bound(partition.by_block, key, {}, key_of);
                if (found == partition.by_block.end() || key_of(*found) != key) continue;
                near.range = *found;
                nears_.push_back(near);
            }
        }
        copy.last = nears_.size();
        copies_.push_back(copy);
    }

    std::vector<Place> places_;
    std::vector<Copy> copies_;
    std::vector<Near> nears_;
};

namespace detail {

/// Returns the index of a member among the fields of a material's state.
template <class State, class Member>
consteval std::size_t field_of(Member State::* member) {
    std::size_t index = 0;
    std::apply(
        [&](const auto&... field) {
            std::size_t i = 0;
            const auto look = [&](const auto& of) {
                if constexpr (std::same_as<std::remove_cvref_t<decltype(of.member)>, Member State::*>)
                    if (of.member == member) index = i;
                ++i;
            };
            (look(field), ...);
        },
        State::fields());
    return index;
}

/// Returns the volume ratios J of particles; 1 for a material that has neither F nor J.
template <class View, class P>
FIRN_INLINE P volume_ratio_of(const View& view, const Slots& slots) {
    using State = typename View::state_type;
    constexpr int D = View::dimension;
    if constexpr (has_volume_ratio<State>) {
        return view.state[field_of(&State::J)].template load<P>(slots, 0);
    } else if constexpr (has_volume<State>) {
        Mat<P, D> F;
        unroll<D * D>([&](auto k) FIRN_LAMBDA { F.m[k] = view.state[field_of(&State::F)].template load<P>(slots, k); });
        return determinant(F);
    } else {
        return P(1);
    }
}

/// Returns half of the extents of particles [cells]: ½ (J V0)^(1/D) / h.
/// \param per_cell  1/h^D [1/m^D]
template <class View, class P>
FIRN_INLINE P radius_of(const View& view, const Slots& slots, const P& per_cell) {
    using S = typename View::scalar_type;
    constexpr int D = View::dimension;
    const P volume = view.volume.template load<P>(slots, 0) * volume_ratio_of<View, P>(view, slots) * per_cell;
    const P filled = max(volume, P(S(1e-12)));
    const P extent = D == 2 ? sqrt(filled) : exp(log(filled) * P(S(1.0 / 3)));
    return select(volume > P(S(1e-12)), extent * P(S(0.5)), P(S(0)));
}

/// How the mirror images of particles are found: for each axis, whether the coordinate is reflected, and twice the
/// position of the mirror, counted from the first block of the nodes [cells].
template <int D>
struct MirrorImage {
    bool reflects[D] = {};
    int twice[D] = {};
};

/// Finds the mirror images that may reach the nodes of a cube of blocks; the first one is no reflection.
/// \param first  coordinates of the cube's first block in the domain
template <int D>
void find_images(const Mirrors& mirrors, const BlockCoordinate<D>& first, std::vector<MirrorImage<D>>& images) {
    images.assign(1, {});
    for (const MirrorPlane& plane : mirrors.planes) {
        const int node = plane.node - first[std::size_t(plane.axis)] * block_size;
        if (plane.contact == Contact::none || node < -block_size || node > (cube_blocks + 1) * block_size) continue;
        const std::size_t count = images.size();
        for (std::size_t i = 0; i < count; ++i) {
            if (images[i].reflects[plane.axis]) continue;
            images.push_back(images[i]);
            images.back().reflects[plane.axis] = true;
            images.back().twice[plane.axis] = 2 * node;
        }
    }
}

/// Adds the particles of one range that reach some nodes to `near`.
/// \param ids     id of the particle in each slot
/// \param blocks  coordinates of the particles' block, counted from the first block of the nodes
/// \param image   whether the particles' mirror images are added instead, and where the mirrors are
template <class Kernel, int D, class View>
void find_near(NearParticles<Kernel, D>& near, const View& view, const std::uint32_t* ids, const BlockRange<D>& range,
               const int (&blocks)[D], const MirrorImage<D>& image, double cell_size) {
    using S = typename View::scalar_type;
    using P = native_pack<S>;
    constexpr int lanes = scalar_traits<P>::lanes;
    const P per_cell(S(D == 2 ? 1 / (cell_size * cell_size) : 1 / (cell_size * cell_size * cell_size)));
    int corner[D];  // where the corner of the particles' block, or its image, lies
    for (int a = 0; a < D; ++a) {
        corner[a] = image.reflects[a] ? image.twice[a] - blocks[a] * block_size : blocks[a] * block_size;
        // A base node is rounded down, also that of an image.
        const int low = image.reflects[a] ? corner[a] - block_size - 1 : corner[a];
        const int high = image.reflects[a] ? corner[a] : corner[a] + block_size - 1;
        if (near.first(a) > high + allowed_drift || near.last(a) < low - allowed_drift) return;
    }
    const std::size_t end = range.first_slot + range.particles;
    for (std::size_t slot = range.first_slot / lanes * lanes; slot < end; slot += lanes) {
        const Slots slots{slot, nullptr};
        Vec<P, D> place = load_vector<P, D>(view.position, slots);
        auto inside = P(1) > P(0);
        P bin = P(0);
        unroll<D>([&](auto a) FIRN_LAMBDA {
            if (image.reflects[a]) place.v[a] = -place.v[a];
            const P base = base_node<Kernel>(place.v[a]) + P(S(corner[a] - near.first(a)));
            inside = inside & (base >= P(0)) & (base <= P(S(near.bins(a) - 1)));
            bin = bin * P(S(near.bins(a))) + base;
        });
        if (!any(inside)) continue;
        alignas(64) S bins[lanes], radii[lanes], places[D][lanes];
        bin.store(bins);
        radius_of<View, P>(view, slots, per_cell).store(radii);
        unroll<D>([&](auto a) FIRN_LAMBDA { (place.v[a] + P(S(corner[a]))).store(places[a]); });
        const auto first = std::size_t(slot < range.first_slot ? range.first_slot - slot : 0);
        for (std::size_t l = first; l < std::min<std::size_t>(lanes, end - slot); ++l) {
            if (!inside[int(l)]) continue;
            auto& particle = near.found.emplace_back();
            particle.id = ids[slot + l];
            particle.bin = std::uint32_t(bins[l]);
            particle.radius = float(radii[l]);
            for (int a = 0; a < D; ++a) particle.place[a] = float(places[a][l]);
        }
    }
}

/// Memory of one thread for contact.
template <class Kernel, int D>
struct ContactScratch {
    std::vector<NearParticles<Kernel, D>> near{};  ///< for each group at a cube
    std::vector<std::size_t> places{};             ///< for each group and node at a cube, the node's index in the grid
    std::vector<MirrorImage<D>> images{};          ///< the mirror images of particles that may reach the cube
    std::vector<Vec<double, D>> normals{};         ///< for each two groups at a cube, the normal found last
    std::vector<GroupAtNode<D>> groups{};
    std::vector<std::size_t> copy_of{};  ///< for each of `groups`, the index of its copy
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
    MeetingPlaces<D> meetings;                                     ///< Where groups may meet.
    std::vector<detail::ContactScratch<Kernel, D>> of_threads{};   ///< Memory of each thread.
    std::vector<std::vector<detail::PairImpulse<D>>> of_places{};  ///< Impulses at each cube.
};

namespace detail {

/// Lets the groups at the nodes of one cube of blocks act on each other.
/// \param mirrors   walls behind which particles have mirror images; these count as particles for normals and gaps
/// \param impulses  receives the impulses between groups; nullptr if they are not wanted
template <class Kernel, class Law, std::floating_point S, int D, class... Views>
void meet_at(SparseGrid<S, D>& grid, const MeetingPlaces<D>& meetings, const typename MeetingPlaces<D>::Place& place,
             const Law& law, double dt, const Mirrors& mirrors, ContactScratch<Kernel, D>& scratch,
             std::vector<PairImpulse<D>>* impulses, const ParticleSet<Views>&... sets) {
    constexpr int n = cube_blocks * block_size, nodes = D == 2 ? n * n : n * n * n;
    const std::size_t count = place.last - place.first;
    const auto copy = [&](std::size_t c) -> const auto& { return meetings.copies()[place.first + c]; };
    const auto along = [](int node, int a) { return node / (a == D - 1 ? 1 : a == D - 2 ? n : n * n) % n; };
    // For each group and node of the cube: the node's index in the grid; none if the group has no mass there.
    constexpr auto none = std::numeric_limits<std::size_t>::max();
    scratch.places.assign(count * nodes, none);
    std::array<std::uint8_t, std::size_t(nodes)> groups_at{};
    bool some = false;
    for (std::size_t c = 0; c < count; ++c)
        for (int block = 0; block < MeetingPlaces<D>::blocks_of_cube; ++block) {
            const std::uint32_t b = copy(c).blocks[std::size_t(block)];
            if (b == no_block) continue;
            int first = 0;  // node of the cube
            for (int a = 0; a < D; ++a) first = first * n + (block >> (D - 1 - a) & 1) * block_size;
            for (int i = 0; i < block_nodes<D>; ++i) {
                if (!(grid.nodes(b)[i * node_width + node_mass] >= std::numeric_limits<S>::min())) continue;
                const int plane = D == 3 ? i / (block_size * block_size) * n * n : 0;
                const int node = first + plane + i / block_size % block_size * n + i % block_size;
                scratch.places[c * nodes + std::size_t(node)] = std::size_t(b) * block_nodes<D> + std::size_t(i);
                some = ++groups_at[std::size_t(node)] > 1 || some;
            }
        }
    if (!some) return;
    const auto filled = [&](std::size_t c, int node) -> S* {
        const std::size_t index = scratch.places[c * nodes + std::size_t(node)];
        return index == none ? nullptr : grid.nodes(0) + index * node_width;
    };

    const double h = grid.domain().cell_size;
    if (scratch.near.size() < count) scratch.near.resize(count);
    scratch.normals.assign(count * count, Vec<double, D>::zero());
    find_images(mirrors, place.corner, scratch.images);
    for (std::size_t c = 0; c < count; ++c) {
        int low[D], high[D];  // the nodes at which this group meets others
        std::fill_n(low, D, n);
        std::fill_n(high, D, -1);
        for (int node = 0; node < nodes; ++node)
            if (groups_at[std::size_t(node)] > 1 && filled(c, node))
                for (int a = 0; a < D; ++a) {
                    low[a] = std::min(low[a], along(node, a));
                    high[a] = std::max(high[a], along(node, a));
                }
        if (high[0] < 0) continue;
        auto& near = scratch.near[c];
        near.clear(low, high);
        for (std::size_t i = copy(c).first; i < copy(c).last; ++i) {
            const auto& of = meetings.nears()[i];
            std::uint32_t s = 0;
            const auto add = [&](const auto& set) {
                if (s++ != of.set) return;
                for (const MirrorImage<D>& image : scratch.images)
                    find_near(near, set.view, set.partition.order.data(), set.partition.ranges[of.range], of.blocks,
                              image, h);
            };
            (add(sets), ...);
        }
        near.sort();
    }

    const ContactNormals how = normals_of(law);
    const double reach = reach_of(law);
    const Separator<Kernel, D> separator;
    for (int node = 0; node < nodes; ++node) {
        if (groups_at[std::size_t(node)] < 2) continue;
        auto& groups = scratch.groups;
        auto& pairs = scratch.pairs;
        groups.clear(), pairs.clear(), scratch.copy_of.clear();
        for (std::size_t c = 0; c < count; ++c) {
            const S* const numbers = filled(c, node);
            if (!numbers) continue;
            GroupAtNode<D> group{copy(c).group, double(numbers[node_mass]), {}};
            for (int a = 0; a < D; ++a) group.momentum[a] = double(numbers[a]);
            groups.push_back(group);
            scratch.copy_of.push_back(c);
        }
        int at[D];
        for (int a = 0; a < D; ++a) at[a] = along(node, a);
        for (std::size_t i = 0; i < groups.size(); ++i)
            for (std::size_t k = i + 1; k < groups.size(); ++k) {
                const std::size_t first = scratch.copy_of[i], second = scratch.copy_of[k];
                const Vec<double, D> moved = velocity_between(groups[i], groups[k]) * (dt / h);
                Vec<double, D>& normal = scratch.normals[first * count + second];
                const Separation<D> found =
                    separator(scratch.near[first], scratch.near[second], at, moved, reach, how, normal);
                normal = found.normal;
                if (found.may_touch) pairs.push_back({i, k, found.normal, found.gap * h});
            }
        if (pairs.empty()) continue;
        meet(law, std::span(groups), std::span(pairs), h, dt);
        for (std::size_t i = 0; i < groups.size(); ++i) {
            S* const numbers = filled(scratch.copy_of[i], node);
            for (int a = 0; a < D; ++a) numbers[a] = S(groups[i].momentum[a]);
        }
        if (!impulses) continue;
        for (const PairAtNode<D>& pair : pairs)
            if (dot(pair.impulse, pair.impulse) > 0)
                impulses->push_back({groups[pair.first].group, groups[pair.second].group, pair.impulse});
    }
}

}  // namespace detail

/// Lets contact groups act on each other: changes the momenta at all nodes where several groups have mass. Call it when
/// the nodes hold momenta and masses, with the impulses of stresses.
/// \param law       the contact law. \see contact/concept.hpp
/// \param dt        time step [s]
/// \param mirrors   mirrors_of<Kernel>(boundary, domain)
/// \param memory    memory; its `meetings` must have been found for the grid
/// \param impulses  receives the impulses between groups; nullptr if they are not wanted
/// \param sets      all sets on the grid, in the order of their partitions
template <class Kernel, class Law, class Execution, std::floating_point S, int D, class... Views>
void meet_groups(const Execution& execution, SparseGrid<S, D>& grid, const Law& law, double dt, const Mirrors& mirrors,
                 ContactMemory<Kernel, D>& memory, ContactImpulses<D>* impulses, const ParticleSet<Views>&... sets) {
    if (impulses) impulses->on_first.clear();
    const auto& places = memory.meetings.places();
    if (places.empty()) return;
    const int threads = thread_count(requested_threads(execution));
    if (memory.of_threads.size() < std::size_t(threads)) memory.of_threads.resize(std::size_t(threads));
    if (impulses) memory.of_places.resize(places.size());
    parallel_for(places.size(), threads, [&](std::size_t i, int thread) {
        if (impulses) memory.of_places[i].clear();
        detail::meet_at(grid, memory.meetings, places[i], law, dt, mirrors, memory.of_threads[std::size_t(thread)],
                        impulses ? &memory.of_places[i] : nullptr, sets...);
    });
    if (!impulses) return;
    for (std::size_t i = 0; i < places.size(); ++i)
        for (const detail::PairImpulse<D>& one : memory.of_places[i])
            impulses->on_first.try_emplace({one.first, one.second}, Vec<double, D>::zero()).first->second +=
                one.on_first;
}

}  // namespace firn
