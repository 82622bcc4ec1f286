/// \file Positions and base nodes of the particles of a group, relative to their blocks, in SIMD registers.
#pragma once

#include <firn/data/particle_view.hpp>
#include <firn/kernel/concept.hpp>
#include <firn/loops/arena.hpp>
#include <firn/material/concept.hpp>
#include <firn/simd/row.hpp>
#include <firn/simd/transpose.hpp>
#include <firn/stage/time_step.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>

namespace firn::inline FIRN_BUILD {

/// For each slot of a group: the block to which the slot's particle belongs.
template <std::floating_point S, int D>
class BlocksOfSlots {
public:
    /// Finds the blocks of all slots of a group, from the ranges of the group. A range is the particles of one block.
    BlocksOfSlots(const BlockPartition<D>& partition, const BlockGroup& group)
        : mask_(group.sparse ? most_slots - 1 : pack_size - 1) {
        std::size_t slot = 0;
        for (std::uint32_t r = group.first_range; r < group.first_range + group.ranges; ++r) {
            const BlockRange<D>& range = partition.ranges[r];
            const std::size_t padded = group.sparse ? group.packs() * pack_size : std::size_t(pack_size);
            const bool last = r + 1 == group.first_range + group.ranges;
            S corner[D];
            for (int a = 0; a < D; ++a) corner[a] = S(partition.block_along(r, a) * block_size);
            for (const std::size_t end = last ? padded : slot + range.particles; slot < end; ++slot) {
                for (int a = 0; a < D; ++a) lower_[a][slot] = corner[a];
                range_[slot] = r;
            }
        }
        for (int a = 0; a < D; ++a) {
            const int block = partition.block_along(group.first_range, a);
            origin_[a] = S((group.sparse ? block & ~1 : block) * block_size);
        }
    }

    /// Returns the lower corners of the blocks to which a register of slots belongs [cells from the domain's lower
    /// corner].
    /// \param slot  first slot of the register, counted from the group's first slot
    template <class P>
    FIRN_INLINE Vec<P, D> lower(std::size_t slot) const {
        Vec<P, D> r;
        unroll<D>([&](auto a) FIRN_LAMBDA { r.v[a] = P::load(lower_[a] + (slot & mask_)); });
        return r;
    }
    /// Returns the lower corners of the blocks to which a register of slots belongs, in cells from the lower corner of
    /// the group's cube of blocks: 0 or block_size along each axis.
    /// \param slot  first slot of the register, counted from the group's first slot
    template <class P>
    FIRN_INLINE Vec<P, D> in_cube(std::size_t slot) const {
        return lower<P>(slot) - cast<P>(origin_);
    }
    /// Returns the index (in BlockPartition::ranges) of the range to which a slot of the group belongs.
    std::uint32_t range(std::size_t slot) const { return range_[slot & mask_]; }

private:
    static constexpr std::size_t most_slots = 256;
    static_assert((sparse_particles << D) + pack_size <= most_slots);

    std::size_t mask_;  // slot & mask_: index in the arrays. A dense group has one block: one pack is stored for all
    Vec<S, D> origin_;
    alignas(64) S lower_[D][most_slots];
    std::uint32_t range_[most_slots];
};

/// Converts positions between cells and the form in which particles store them. firn's particle store has positions in
/// cells, measured from the lower corner of the particle's block, so that the resolution is the same everywhere in the
/// domain. The arrays of the calling program have positions in metres.
template <class View>
class Positions {
    using S = typename View::scalar_type;
    static constexpr int D = View::dimension;

public:
    /// Whether positions are stored in cells; if not, in metres.
    static constexpr bool in_cells = std::derived_from<decltype(View::position), BlockedSpan<S>>;

    /// Makes a converter for positions in this domain.
    explicit Positions(const Domain<D>& domain) : per_cell_(S(1 / domain.cell_size)) {
        for (int a = 0; a < D; ++a) {
            const auto [lowest, highest] = range_of_steps<S>(domain, a);  // an array of metres is never periodic
            lower_[a] = in_cells ? lowest : S(domain.lower[a]);
            upper_[a] = in_cells ? highest : S(domain.upper[a]);
        }
        cell_ = in_cells ? S(1) : S(domain.cell_size);
    }

    /// Returns positions in cells from the lower corners of the particles' blocks.
    /// \param position  positions as they are stored
    /// \param block  lower corners of the blocks [cells from the domain's lower corner]
    template <class P>
    FIRN_INLINE Vec<P, D> in_block(const Vec<P, D>& position, const Vec<P, D>& block) const {
        if constexpr (in_cells) {
            return position;
        } else {
            Vec<P, D> r;
            unroll<D>([&](auto a)
                          FIRN_LAMBDA { r.v[a] = (position.v[a] - P(lower_.v[a])) * P(per_cell_) - block.v[a]; });
            return r;
        }
    }
    /// Returns the lowest allowed positions of particles, in the form in which positions are stored: the lower corner
    /// of the domain, but along a periodic axis one extent of the domain lower.
    /// \param block  lower corners of the particles' blocks [cells from the domain's lower corner]
    template <class P>
    FIRN_INLINE Vec<P, D> lowest(const Vec<P, D>& block) const {
        return in_cells ? cast<P>(lower_) - block : cast<P>(lower_);
    }
    /// Returns the highest allowed positions of particles, in the form in which positions are stored: the upper corner
    /// of the domain, but along a periodic axis one extent of the domain higher.
    /// \param block  lower corners of the particles' blocks [cells from the domain's lower corner]
    template <class P>
    FIRN_INLINE Vec<P, D> highest(const Vec<P, D>& block) const {
        return in_cells ? cast<P>(upper_) - block : cast<P>(upper_);
    }
    S cell() const { return cell_; }  ///< Returns the cell size, in the unit of stored positions.
    /// Returns the factor that turns a velocity [m/s] into the displacement in one step, in the unit of stored
    /// positions: dt / h if they are in cells, dt if they are in metres.
    /// \param h  cell size [m]
    S per_velocity(const TimeStep& step, double h) const {
        return in_cells ? step.template cells_per_velocity<S>(h) : S(step.dt);
    }

private:
    Vec<S, D> lower_, upper_;
    S per_cell_, cell_;
};

/// A particle's base node in the arena of its block, and the particle's position relative to its base node.
template <class P, int D>
struct Place {
    Vec<P, D> node;      ///< index of the base node along each axis of the arena: 0 to block_size − 1 + 2 allowed_drift
    Vec<P, D> fraction;  ///< position relative to the base node [cells]: f = x/h − base
};

/// Returns the base nodes of particles, and the positions of the particles relative to their base nodes. For a particle
/// that is too far from its block, the nearest allowed base node is returned.
/// \param position  positions from the lower corners of the particles' blocks [cells]
template <class Kernel, class P, int D>
FIRN_INLINE Place<P, D> locate(const Vec<P, D>& position) {
    constexpr int last = block_size - 1 + 2 * allowed_drift;
    Place<P, D> place;
    unroll<D>([&](auto a) FIRN_LAMBDA {
        const P node = base_node<Kernel>(position.v[a]) + P(allowed_drift);
        // The base node is limited to the arena, also if the position is NaN, so that memory outside of the arena is
        // never accessed.
        place.node.v[a] = select(node > P(0), select(node < P(last), node, P(last)), P(0));
        place.fraction.v[a] = position.v[a] - (place.node.v[a] - P(allowed_drift));
    });
    return place;
}

/// Returns the index of the first value of a node, among all values of an arena.
/// \param node  index of the node along each axis of the arena;  \param n  number of nodes along each axis of the arena
template <class P, int D>
FIRN_INLINE P first_number(const Vec<P, D>& node, int n) {
    P number = node.v[0];
    unroll<D - 1>([&](auto a) FIRN_LAMBDA { number = number * P(n) + node.v[a + 1]; });
    return number * P(node_width);
}

/// Returns a mask of the particles whose base node lies more than allowed_drift cells outside their block.
/// \param position  positions from the lower corners of the particles' blocks [cells]
template <class Kernel, class P, int D>
FIRN_INLINE mask_t<P> strays(const Vec<P, D>& position) {
    mask_t<P> stray = P(1) < P(0);
    unroll<D>([&](auto a) FIRN_LAMBDA {
        const P node = base_node<Kernel>(position.v[a]);
        stray = stray | (node < P(-allowed_drift)) | (node > P(block_size - 1 + allowed_drift));
    });
    return stray;
}

namespace detail {
/// Returns true. If particles, partition and grid differ in precision or dimension, the compiler stops with a message.
template <class View, int N, class S, int D>
consteval bool require_same_kind() {
    constexpr bool same = View::dimension == D && N == D && std::same_as<typename View::scalar_type, S>;
    static_assert(same,
                  "firn: the particles, their partition and the grid are of one precision and dimension: "
                  "ForeignParticles<double, 3> go with BlockPartition<3> and SparseGrid<double, 3>.");
    return same;
}

/// Returns true. If the material has another precision than the particles, the compiler stops with a message.
template <class Material, class S>
consteval bool require_same_precision() {
    constexpr bool same = std::same_as<material_scalar_t<Material>, S>;
    static_assert(same,
                  "firn: the material and the particles are of one precision: FixedCorotated<double> goes with "
                  "ForeignParticles<double, 3>.");
    return same;
}
}  // namespace detail

/// Throws an error because particles are too far from the blocks into which they were sorted.
/// \throws usage_error  always
[[noreturn, gnu::cold, gnu::noinline]] inline void throw_strays() {
    throw usage_error(
        "P2G is given a partition that is stale: particles have left the reach of the blocks that they were sorted "
        "into. When g2p() reports sort_needed, and when you have moved particles yourself, call partition_particles() "
        "(or sort_particles()) and grid.activate() before the next p2g().");
}

/// Positions and base nodes of the particles of a group.
template <class View>
class GroupPlaces {
public:
    using S = typename View::scalar_type;      ///< The scalar type: float or double.
    static constexpr int D = View::dimension;  ///< The dimension: 2 or 3.

    /// Finds the blocks of the group's slots. `view` and `positions` must exist as long as this object, which refers to
    /// them.
    GroupPlaces(const View& view, const BlockPartition<D>& partition, const BlockGroup& group,
                const Positions<View>& positions)
        : view_(view),
          positions_(positions),
          blocks_(partition, group),
          first_(group.first_slot),
          order_(partition.order.data()) {}

    const BlocksOfSlots<S, D>& blocks() const { return blocks_; }  ///< The block of each slot.
    /// Returns the slots of one register of particles.
    /// \param slot  first of these slots, counted from the group's first slot
    FIRN_INLINE Slots slots(std::size_t slot) const { return {first_ + slot, order_ + first_ + slot}; }

    /// Returns the positions of one register of particles, in cells from the lower corners of the particles' blocks.
    /// \param slot  slot of the first of these particles, counted from the group's first slot
    template <class P>
    FIRN_INLINE Vec<P, D> position(std::size_t slot) const {
        return positions_.in_block(load_vector<P, D>(view_.position, slots(slot)), blocks_.template lower<P>(slot));
    }

    /// Returns the lower corners of the blocks of one register of particles [cells]. They are measured from the lower
    /// corner of the group's block, or of its cube of blocks.
    /// \param slot  slot of the first of these particles, counted from the group's first slot
    /// \param n     number of nodes along each axis of the group's arena
    template <class Kernel, class P>
    FIRN_INLINE Vec<P, D> block_in_arena(std::size_t slot, int n) const {
        return n == arena_size<Kernel> ? Vec<P, D>::zero() : blocks_.template in_cube<P>(slot);
    }

    /// Returns the smallest box of nodes in the group's arena that contains every node to which a particle of the group
    /// contributes.
    template <class Kernel>
    FIRN_INLINE ArenaBox<D> box(const BlockGroup& group) const {
        using P = native_pack<S>;
        constexpr S far = std::numeric_limits<S>::max();
        constexpr std::size_t lanes = scalar_traits<P>::lanes;
        Vec<P, D> low = Vec<P, D>::filled(P(far)), high = -low;
        mask_t<P> stray = P(1) < P(0);
        const auto see = [&](std::size_t slot, bool look) FIRN_LAMBDA {
            Vec<P, D> x = position<P>(slot);
            if (look) stray = stray | (strays<Kernel>(x) & is_used(group, slot));
            // If the group has one block, positions are compared, because the outermost particles have the outermost
            // nodes. If the group has several blocks, base nodes are compared, because adding the corner of a block to
            // a position could round the position to the next cell.
            if (group.sparse) x = locate<Kernel>(x).node + blocks_.template in_cube<P>(slot);
            unroll<D>([&](auto a) FIRN_LAMBDA {
                low.v[a] = min(low.v[a], x.v[a]);  // min() ignores NaN; a particle at NaN has no right nodes
                high.v[a] = max(high.v[a], x.v[a]);
            });
        };
        ArenaBox<D> box;
        const auto node_of = [](S x) { return base_node<Kernel>(x) + S(allowed_drift); };
        constexpr S last = S(block_size - 1 + 2 * allowed_drift);
        const std::size_t whole = group.particles / lanes * lanes;
        for (std::size_t slot = 0; slot < whole; slot += lanes) see(slot, group.sparse);
        if (!group.sparse && whole > 0)
            unroll<D>([&](auto a) {
                box.strays =
                    box.strays || node_of(-reduce_max(-low.v[a])) < S(0) || node_of(reduce_max(high.v[a])) > last;
            });
        for (std::size_t slot = whole; slot < group.packs() * pack_size; slot += lanes) see(slot, true);
        box.strays = box.strays || any(stray);
        const auto node = [&](S x) { return group.sparse ? int(x) : int(std::clamp(node_of(x), S(0), last)); };
        unroll<D>([&](auto a) {
            box.first[a] = node(-reduce_max(-low.v[a]));
            box.last[a] = node(reduce_max(high.v[a])) + Kernel::support - 1;
        });
        return box;
    }

    /// Returns whether any particle of the group is too far from its block. \see strays
    template <class Kernel>
    FIRN_INLINE bool has_strays(const BlockGroup& group) const {
        using P = native_pack<S>;
        mask_t<P> stray = P(1) < P(0);
        for (std::size_t slot = 0; slot < group.particles; slot += scalar_traits<P>::lanes)
            stray = stray | (strays<Kernel>(position<P>(slot)) & is_used(group, slot));
        return any(stray);
    }

    /// Calls f(corner) for each particle of a spray group (few particles in sparse blocks). `corner` is the index,
    /// among all values of the arena, of the first value of the particle's base node.
    /// \param n  number of nodes along each axis of the arena
    template <class Kernel, class F>
    FIRN_INLINE void for_corners(const BlockGroup& spray, int n, const F& f) const {
        using P = native_pack<S>;
        alignas(64) typename P::integer corner[spray_particles<D>];
        for (std::size_t slot = 0; slot < spray.particles; slot += scalar_traits<P>::lanes)
            first_number(locate<Kernel>(position<P>(slot)).node + block_in_arena<Kernel, P>(slot, n), n)
                .store(corner + slot);
        for (std::size_t i = 0; i < spray.particles; ++i) f(std::size_t(corner[i]));
    }

private:
    /// Returns a mask of the lanes that hold particles, for the register of slots that begins at `slot`. The other
    /// lanes are padding.
    FIRN_INLINE static auto is_used(const BlockGroup& group, std::size_t slot) {
        using P = native_pack<S>;
        S lane[scalar_traits<P>::lanes];
        for (int l = 0; l < scalar_traits<P>::lanes; ++l) lane[l] = S(l);
        return P::load(lane) < P(S(int(std::int64_t(group.particles) - std::int64_t(slot))));
    }

    const View& view_;
    const Positions<View>& positions_;
    BlocksOfSlots<S, D> blocks_;
    std::size_t first_;
    const std::uint32_t* order_;
};

/// Weights of the nodes around the particles of a pack, in the order in which sums over rows of nodes read them. For
/// the leading axes (all but the last), there is one value for each axis, node and particle. For the last axis, there
/// are four values for each particle: the weights of the particle's nodes along this axis, then zeros if there are
/// fewer than four nodes.
template <class Kernel, std::floating_point S, int D, bool Gradients>
struct PackWeights {
    static constexpr int K = Kernel::support;  ///< Number of nodes of the kernel's support along each axis.
    using P = native_pack<S>;                  ///< Type of a SIMD register with elements of type S.
    using Index = typename P::integer;         ///< Type of an integer with the size of S.

    alignas(64) S leading[D - 1][K][pack_size];  ///< Weights along the leading axes.
    alignas(64) S
        leading_gradient[Gradients ? D - 1 : 1][K][pack_size];   ///< Gradients of the weights in `leading` [1/cell].
    alignas(64) S last[pack_size * 4];                           ///< Weights along the last axis.
    alignas(64) S last_gradient[Gradients ? pack_size * 4 : 4];  ///< Gradients of the weights in `last` [1/cell].
    alignas(64) Index corner[pack_size];  ///< Index, in Arena::node, of the first value of each particle's base node.

    /// Computes the weights and `corner` for one register of particles.
    /// \param lane   the register's first lane in the pack
    /// \param block  lower corners of the particles' blocks, from the lower corner of the group's block or cube of
    ///               blocks [cells]
    /// \param n      number of nodes along each axis of the arena
    FIRN_INLINE void fill(int lane, const Place<P, D>& place, const Vec<P, D>& block, int n) {
        const Vec<P, D> node = place.node + block;
        first_number(node, n).store(corner + lane);
        unroll<D>([&](auto a) FIRN_LAMBDA {
            put(a, Kernel::weights(place.fraction.v[a]), lane, leading[a < D - 1 ? int(a) : 0], last);
            if constexpr (Gradients)
                put(a, Kernel::gradients(place.fraction.v[a]), lane, leading_gradient[a < D - 1 ? int(a) : 0],
                    last_gradient);
        });
    }

private:
    template <class A>
    FIRN_INLINE static void put(A axis, const std::array<P, std::size_t(K)>& values, int lane, S (&lead)[K][pack_size],
                                S* quads) {
        if constexpr (axis < D - 1) {
            unroll<K>([&](auto k) FIRN_LAMBDA { values[k].store(lead[k] + lane); });
        } else {
            P r[4] = {P(0), P(0), P(0), P(0)};
            unroll<K>([&](auto k) FIRN_LAMBDA { r[k] = values[k]; });
            store_quads(r, quads + lane * 4);
        }
    }
};

/// Returns the index of the first element of the particle in lane l, in an array that has four elements for each
/// particle of a pack.
template <class P>
FIRN_INLINE constexpr int quad_offset(int l) {
    constexpr unsigned lanes = scalar_traits<P>::lanes;
    return int(unsigned(l) / lanes * lanes + unsigned(quad_of_lane<P>(int(unsigned(l) % lanes)))) * 4;
}

}  // namespace firn::inline FIRN_BUILD
