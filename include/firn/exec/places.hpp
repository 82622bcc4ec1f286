/// \file Where the particles of a group lie among the nodes around their blocks, read in SIMD lanes.
#pragma once

#include <firn/data/particle_view.hpp>
#include <firn/exec/arena.hpp>
#include <firn/kernel/concept.hpp>
#include <firn/material/concept.hpp>
#include <firn/simd/row.hpp>
#include <firn/simd/transpose.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>

namespace firn {

/// The block of each slot of a group.
template <std::floating_point S, int D>
class BlocksOfSlots {
public:
    /// Reads the ranges of a group.
    BlocksOfSlots(const BlockPartition<D>& partition, const BlockGroup& group)
        : mask_(group.sparse ? most_slots - 1 : pack_size - 1) {
        std::size_t slot = 0;
        for (std::uint32_t r = group.first_range; r < group.first_range + group.ranges; ++r) {
            const BlockRange<D>& range = partition.ranges[r];
            const std::size_t padded = group.sparse ? group.packs() * pack_size : std::size_t(pack_size);
            const bool last = r + 1 == group.first_range + group.ranges;
            for (const std::size_t end = last ? padded : slot + range.particles; slot < end; ++slot) {
                for (int a = 0; a < D; ++a) lower_[a][slot] = S(range.block[std::size_t(a)] * block_size);
                range_[slot] = r;
            }
        }
        for (int a = 0; a < D; ++a) {
            const int block = partition.ranges[group.first_range].block[std::size_t(a)];
            origin_[a] = S((group.sparse ? block & ~1 : block) * block_size);
        }
    }

    /// Lower corners of the blocks of a register of slots, from `slot` of the group on [cells from the domain's lower
    /// corner].
    template <class P>
    FIRN_INLINE Vec<P, D> lower(std::size_t slot) const {
        Vec<P, D> r;
        unroll<D>([&](auto a) FIRN_LAMBDA { r.v[a] = P::load(lower_[a] + (slot & mask_)); });
        return r;
    }
    /// The same, from the lower corner of the group's cube of blocks: 0 or block_size along each axis.
    template <class P>
    FIRN_INLINE Vec<P, D> in_cube(std::size_t slot) const {
        return lower<P>(slot) - cast<P>(origin_);
    }
    std::uint32_t range(std::size_t slot) const { return range_[slot & mask_]; }  ///< Number of a slot's range.

private:
    static constexpr std::size_t most_slots = 256;
    static_assert((sparse_particles << D) + pack_size <= most_slots);

    std::size_t mask_;  // all slots of a dense group belong to one block, so the first pack is stored for all
    Vec<S, D> origin_;
    alignas(64) S lower_[D][most_slots];
    std::uint32_t range_[most_slots];
};

/// How positions are stored. firn's particles store them in cells from the lower corner of the particle's block, so
/// that their resolution is the same everywhere. The arrays of a foreign program store them in metres.
template <class View>
class Positions {
    using S = typename View::scalar_type;
    static constexpr int D = View::dimension;

public:
    /// Whether positions are stored in cells.
    static constexpr bool in_cells = std::same_as<decltype(View::position), BlockedSpan<S>>;

    /// Positions in this domain.
    explicit Positions(const Domain<D>& domain) : per_cell_(S(1 / domain.cell_size)) {
        for (int a = 0; a < D; ++a) {
            lower_[a] = in_cells ? S(0) : S(domain.lower[a]);
            upper_[a] = in_cells ? extent_in_cells<S>(domain, a) : S(domain.upper[a]);
            if (domain.periodic[std::size_t(a)]) {  // a particle may go one extent beyond the domain in a step
                lower_[a] = -upper_[a];
                upper_[a] = 2 * upper_[a];
            }
        }
        cell_ = in_cells ? S(1) : S(domain.cell_size);
    }

    /// Stored positions, converted to cells from the lower corner of their block.
    /// \param block  lower corner of the block [cells from the domain's]
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
    /// The lower corner of the domain, as the positions in a block are stored. Along a periodic axis, one extent below.
    template <class P>
    FIRN_INLINE Vec<P, D> lowest(const Vec<P, D>& block) const {
        return in_cells ? cast<P>(lower_) - block : cast<P>(lower_);
    }
    /// The upper corner of the domain, as the positions in a block are stored. Along a periodic axis, one extent above.
    template <class P>
    FIRN_INLINE Vec<P, D> highest(const Vec<P, D>& block) const {
        return in_cells ? cast<P>(upper_) - block : cast<P>(upper_);
    }
    S cell() const { return cell_; }  ///< The cell size in the unit of positions.
    /// The factor from a velocity [m/s] to the motion of a position in dt.
    /// \param dt  time step [s];  \param h  cell size [m]
    S per_velocity(double dt, double h) const { return S(in_cells ? dt / h : dt); }

private:
    Vec<S, D> lower_, upper_;
    S per_cell_, cell_;
};

/// A particle's place among the nodes: its base node in the arena of its block, and its position from there.
template <class P, int D>
struct Place {
    Vec<P, D> node;      ///< base node, counted from the arena's first: 0 to block_size − 1 + 2 allowed_drift
    Vec<P, D> fraction;  ///< f = x/h − base, in cells
};

/// The place of particles. A particle beyond the arena is put at its end.
/// \param position  in cells, from the lower corner of the particle's block
template <class Kernel, class P, int D>
FIRN_INLINE Place<P, D> locate(const Vec<P, D>& position) {
    constexpr int last = block_size - 1 + 2 * allowed_drift;
    Place<P, D> place;
    unroll<D>([&](auto a) FIRN_LAMBDA {
        const P node = base_node<Kernel>(position.v[a]) + P(allowed_drift);
        // Clamped, also for NaN, so that memory outside of the arena is never touched.
        place.node.v[a] = select(node > P(0), select(node < P(last), node, P(last)), P(0));
        place.fraction.v[a] = position.v[a] - (place.node.v[a] - P(allowed_drift));
    });
    return place;
}

/// The index of a node's first number in an arena with n nodes along each axis.
template <class P, int D>
FIRN_INLINE P first_number(const Vec<P, D>& node, int n) {
    P number = node.v[0];
    unroll<D - 1>([&](auto a) FIRN_LAMBDA { number = number * P(n) + node.v[a + 1]; });
    return number * P(node_width);
}

/// A mask of the particles that lie beyond the reach of their block.
/// \param position  in cells, from the lower corner of the particle's block
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
/// True. If precision or dimension of particles, partition and grid differ, the compiler stops with a message.
template <class View, int N, class S, int D>
consteval bool require_same_kind() {
    constexpr bool same = View::dimension == D && N == D && std::same_as<typename View::scalar_type, S>;
    static_assert(same,
                  "firn: the particles, their partition and the grid are of one precision and dimension: "
                  "ForeignParticles<double, 3> go with BlockPartition<3> and SparseGrid<double, 3>.");
    return same;
}

/// True. If the material has another precision, the compiler stops with a message.
template <class Material, class S>
consteval bool require_same_precision() {
    constexpr bool same = std::same_as<material_scalar_t<Material>, S>;
    static_assert(same,
                  "firn: the material and the particles are of one precision: FixedCorotated<double> goes with "
                  "ForeignParticles<double, 3>.");
    return same;
}
}  // namespace detail

/// \throws usage_error  always: particles have left the reach of their blocks
[[noreturn, gnu::cold, gnu::noinline]] inline void throw_strays() {
    throw usage_error(
        "P2G is given a partition that is stale: particles have left the reach of the blocks that they were sorted "
        "into. When g2p() reports sort_needed, and when you have moved particles yourself, call partition_particles() "
        "(or sort_particles()) and grid.activate() before the next p2g().");
}

/// The places of the particles of a group.
template <class View>
class GroupPlaces {
public:
    using S = typename View::scalar_type;      ///< float or double.
    static constexpr int D = View::dimension;  ///< 2 or 3.

    /// The places of this group. `view` and `positions` must outlive it.
    GroupPlaces(const View& view, const BlockPartition<D>& partition, const BlockGroup& group,
                const Positions<View>& positions)
        : view_(view),
          positions_(positions),
          blocks_(partition, group),
          first_(group.first_slot),
          order_(partition.order.data()) {}

    const BlocksOfSlots<S, D>& blocks() const { return blocks_; }  ///< The blocks of the slots.
    /// A register of slots of the particles, from `slot` of the group on.
    FIRN_INLINE Slots slots(std::size_t slot) const { return {first_ + slot, order_ + first_ + slot}; }

    /// Positions of a register of particles, in cells from the lower corners of their blocks.
    template <class P>
    FIRN_INLINE Vec<P, D> position(std::size_t slot) const {
        return positions_.in_block(load_vector<P, D>(view_.position, slots(slot)), blocks_.template lower<P>(slot));
    }

    /// Lower corners of the particles' blocks in an arena with n nodes along each axis [cells].
    template <class Kernel, class P>
    FIRN_INLINE Vec<P, D> block_in_arena(std::size_t slot, int n) const {
        return n == arena_size<Kernel> ? Vec<P, D>::zero() : blocks_.template in_cube<P>(slot);
    }

    /// The box of nodes of its arena that the particles of the group reach.
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
            // In one block the outermost particles have the outermost nodes. With several blocks nodes are compared,
            // because adding the corner of a block to a position could round it to the next cell.
            if (group.sparse) x = locate<Kernel>(x).node + blocks_.template in_cube<P>(slot);
            unroll<D>([&](auto a) FIRN_LAMBDA {
                low.v[a] = min(low.v[a], x.v[a]);  // ignores NaN, which reaches wrong nodes anyway
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

    /// Whether a particle of the group lies beyond the reach of its block.
    template <class Kernel>
    FIRN_INLINE bool has_strays(const BlockGroup& group) const {
        using P = native_pack<S>;
        mask_t<P> stray = P(1) < P(0);
        for (std::size_t slot = 0; slot < group.particles; slot += scalar_traits<P>::lanes)
            stray = stray | (strays<Kernel>(position<P>(slot)) & is_used(group, slot));
        return any(stray);
    }

    /// Calls f(corner) for each particle of spray.
    /// \param n  nodes along an axis of the arena
    /// \param f  gets the index of the first number of the particle's base node in the arena
    template <class Kernel, class F>
    FIRN_INLINE void for_corners(const BlockGroup& spray, int n, const F& f) const {
        using P = native_pack<S>;
        alignas(64) typename P::integer corner[spray_particles];
        for (std::size_t slot = 0; slot < spray.particles; slot += scalar_traits<P>::lanes)
            first_number(locate<Kernel>(position<P>(slot)).node + block_in_arena<Kernel, P>(slot, n), n)
                .store(corner + slot);
        for (std::size_t i = 0; i < spray.particles; ++i) f(std::size_t(corner[i]));
    }

private:
    /// A mask of the lanes from `slot` on that hold particles. The others are padding.
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

/// Weights of a pack of particles, laid out for rows of nodes. The leading axes have one number for each axis, node and
/// particle. The last axis has four numbers for each particle: the weights of its nodes.
template <class Kernel, std::floating_point S, int D, bool Gradients>
struct PackWeights {
    static constexpr int K = Kernel::support;  ///< Nodes along an axis.
    using P = native_pack<S>;                  ///< A register of lanes.
    using Index = typename P::integer;         ///< An integer of the same size as S.

    alignas(64) S leading[D - 1][K][pack_size];                           ///< Weights along the leading axes.
    alignas(64) S leading_gradient[Gradients ? D - 1 : 1][K][pack_size];  ///< Their gradients [1/cell].
    alignas(64) S last[pack_size * 4];                                    ///< Weights along the last axis.
    alignas(64) S last_gradient[Gradients ? pack_size * 4 : 4];           ///< Their gradients [1/cell].
    alignas(64) Index corner[pack_size];  ///< Index in the arena of the base node's first number.

    /// Computes the weights of one register of particles.
    /// \param lane   the first lane of the pack
    /// \param block  lower corners of the particles' blocks in the arena;  \param n  nodes along an axis of the arena
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

/// The index of the first of the four numbers of lane l of a pack.
template <class P>
FIRN_INLINE constexpr int quad_offset(int l) {
    constexpr unsigned lanes = scalar_traits<P>::lanes;
    return int(unsigned(l) / lanes * lanes + unsigned(quad_of_lane<P>(int(unsigned(l) % lanes)))) * 4;
}

}  // namespace firn
