/// \file Blocks of cells as the lane loops see them: the nodes around a block, and where a particle lies among them.
#pragma once

#include <firn/data/particle_view.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/exec/row.hpp>
#include <firn/exec/transpose.hpp>
#include <firn/kernel/concept.hpp>

#include <algorithm>
#include <limits>

namespace firn {

/// Which nodes of an arena particles reach, both ends included.
template <int D>
struct ArenaBox {
    int first[D], last[D];
};

/// Numbers of the blocks around the block or cube of a group, or no_block: those that the grid has around its ranges.
template <int D>
class BlocksAround {
public:
    template <class Grid>
    BlocksAround(const Grid& grid, const BlockPartition<D>& partition, const BlockGroup& group) {
        if (!group.sparse) {
            blocks_ = grid.neighbours(partition, group.first_range);
            return;
        }
        blocks_ = of_cube_;
        std::fill(std::begin(of_cube_), std::end(of_cube_), no_block);
        for (std::uint32_t r = group.first_range; r < group.first_range + group.ranges; ++r) {
            int corner = 0;
            for (const int coordinate : partition.ranges[r].block) corner = corner * n + (coordinate & 1);
            const std::uint32_t* neighbour = grid.neighbours(partition, r);
            for (int line = 0; line < (D == 2 ? 3 : 9); ++line)
                for (int k = 0; k < 3; ++k)
                    of_cube_[corner + (D == 2 ? line : line / 3 * n + line % 3) * n + k] = *neighbour++;
        }
    }
    BlocksAround(const BlocksAround&) = delete;
    const std::uint32_t* data() const { return blocks_; }

private:
    static constexpr int n = cube_blocks + 2;
    const std::uint32_t* blocks_;
    std::uint32_t of_cube_[D == 2 ? n * n : n * n * n];
};

/// Nodes of an arena of n along each axis.
template <int D>
constexpr int arena_nodes(int n) {
    return D == 2 ? n * n : n * n * n;
}

/// Rows of nodes of a group's block or cube of blocks and its surroundings: contiguous. One code serves both: a size
/// that is known when compiled is not faster, and costs as much to compile once more.
/// \tparam Number  of floating point, or an integer for fixed-point sums;  \tparam Width  how many of them a node has
template <class Kernel, class Number, int D, int Width = node_width>
struct Arena {
    static constexpr int n_of_block = arena_size<Kernel>, n_of_cube = arena_size<Kernel, cube_blocks>;
    static_assert(n_of_block <= colours_along_axis<Kernel> * block_size && n_of_cube <= 2 * cube_blocks * block_size,
                  "firn: two groups of one colour never touch one node");

    int n;  ///< nodes along an axis
    /// Rows of a whole register may reach over the end.
    alignas(64) Number node[(arena_nodes<D>(n_of_cube) + 4) * Width];

    /// Makes it the group's, and zeros the lines of a box.
    FIRN_INLINE void clear(const BlockGroup& group, const ArenaBox<D>& box) {
        n = group.sparse ? n_of_cube : n_of_block;
        if (group.sparse)
            clear_lines<cube_blocks>(box);
        else
            clear_lines<1>(box);
        std::fill_n(node + arena_nodes<D>(n) * Width, 4 * Width, Number(0));
    }

    /// Calls f(number in the arena, numbers in the grid, count) for runs of nodes that are neighbours in both and hold
    /// the box; the count of nodes is a compile-time constant.
    /// \param nodes  of the whole grid
    template <class N, class F>
    FIRN_INLINE void for_runs(N* nodes, const BlocksAround<D>& around, const ArenaBox<D>& box, const F& f) const {
        if (n == n_of_block)
            for_runs_of<1>(nodes, around.data(), box, f);
        else
            for_runs_of<cube_blocks>(nodes, around.data(), box, f);
    }

private:
    static constexpr int before = block_size - allowed_drift;  // nodes of the first block that the arena leaves out

    template <int Blocks>
    FIRN_INLINE void clear_lines(const ArenaBox<D>& box) {
        constexpr int numbers = arena_size<Kernel, Blocks> * Width;
        for_lines<Blocks>(
            box, [&](int line, int, int) FIRN_LAMBDA { std::fill_n(node + line * numbers, numbers, Number(0)); });
    }

    /// \param of_block  numbers of the blocks around, or no_block
    template <int Blocks, class N, class F>
    FIRN_INLINE static void for_runs_of(N* nodes, const std::uint32_t* of_block, const ArenaBox<D>& box, const F& f) {
        constexpr int size = arena_size<Kernel, Blocks>, blocks = Blocks + 2;
        static_assert(size + before <= blocks * block_size);
        for_lines<Blocks>(box, [&](int line, int outer_block, int outer_node) FIRN_LAMBDA {
            unroll<blocks>([&](auto b) FIRN_LAMBDA {
                constexpr int first = b == 0 ? before : 0;
                constexpr int last = std::min(block_size, before + size - b * block_size);
                constexpr int place = b * block_size + first - before;  // in the line
                const std::uint32_t block = of_block[outer_block * blocks + b];
                if (place > box.last[D - 1] || place + last - first <= box.first[D - 1] || block == no_block) return;
                N* run = nodes +
                         (block * std::size_t(block_nodes<D>) + std::size_t(outer_node * block_size + first)) * Width;
                f((line * size + place) * Width, run, std::integral_constant<int, last - first>{});
            });
        });
    }

    /// f(line, block and node in it along the leading axes)
    template <int Blocks, class F>
    FIRN_INLINE static void for_lines(const ArenaBox<D>& box, const F& f) {
        for (int i = box.first[0]; i <= box.last[0]; ++i) {
            const int block = (i + before) / block_size, in_block = (i + before) % block_size;
            if constexpr (D == 2)
                f(i, block, in_block);
            else
                for (int j = box.first[1]; j <= box.last[1]; ++j)
                    f(i * arena_size<Kernel, Blocks> + j, block * (Blocks + 2) + (j + before) / block_size,
                      in_block * block_size + (j + before) % block_size);
        }
    }
};

/// Lines of nodes, one row each, that a particle reaches.
template <class Kernel, int D>
inline constexpr int lines_of_particle = D == 2 ? Kernel::support : Kernel::support * Kernel::support;

/// Where line `line` begins, in nodes of an arena of n a line, from the particle's base node on.
template <class Kernel, int D>
FIRN_INLINE constexpr std::ptrdiff_t line_begin(int line, std::ptrdiff_t n) {
    constexpr int K = Kernel::support;
    return (D == 2 ? line : line / K * n + line % K) * n;
}

/// Where in the grid a node of a block's arena is, whether the arena is filled or not.
template <class Kernel, int D>
class ArenaNodes {
public:
    /// Node k of line `line` of those that a particle reaches: its place in the grid, in nodes.
    /// \param corner  the number, in the arena, of the first number of the particle's base node
    FIRN_INLINE static std::size_t in_grid(const std::uint32_t* neighbours, std::ptrdiff_t corner, int line, int k) {
        const Place place = places[std::size_t(corner / node_width + line_begin<Kernel, D>(line, n) + k)];
        return std::size_t(neighbours[place.neighbour]) * std::size_t(block_nodes<D>) + place.node;
    }

private:
    static constexpr int n = arena_size<Kernel>;
    struct Place {
        std::uint8_t neighbour, node;
    };
    static constexpr auto places = [] {
        std::array<Place, std::size_t(D == 2 ? n * n : n * n * n)> table{};
        for (int i = 0; i < int(table.size()); ++i) {
            int neighbour = 0, node = 0;
            for (int a = 0, scale = int(table.size()) / n; a < D; ++a, scale /= n) {
                const int k = i / scale % n + block_size - allowed_drift;
                neighbour = neighbour * 3 + k / block_size;
                node = node * block_size + k % block_size;
            }
            table[std::size_t(i)] = {std::uint8_t(neighbour), std::uint8_t(node)};
        }
        return table;
    }();
};

/// The blocks that the slots of a group belong to.
template <std::floating_point S, int D>
class BlocksOfSlots {
public:
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

    /// Lower corners, in cells from the domain's, of the blocks of the slots from `slot` of the group on.
    template <class P>
    FIRN_INLINE Vec<P, D> lower(std::size_t slot) const {
        Vec<P, D> r;
        unroll<D>([&](auto a) FIRN_LAMBDA { r.v[a] = P::load(lower_[a] + (slot & mask_)); });
        return r;
    }
    /// The same from the lower corner of the group's cube of blocks: 0 or block_size.
    template <class P>
    FIRN_INLINE Vec<P, D> in_cube(std::size_t slot) const {
        return lower<P>(slot) - cast<P>(origin_);
    }
    std::uint32_t range(std::size_t slot) const { return range_[slot & mask_]; }

private:
    static constexpr std::size_t most_slots = 256;
    static_assert((sparse_particles << D) + pack_size <= most_slots);

    std::size_t mask_;  // all slots of a dense group belong to one block: the first pack stands for all
    Vec<S, D> origin_;
    alignas(64) S lower_[D][most_slots];
    std::uint32_t range_[most_slots];
};

/// How positions are stored. In firn's own particles: in cells, from the lower corner of the particle's block, so that
/// they are equally fine everywhere. In a foreign program's arrays: in metres.
template <class View>
class Positions {
    using S = typename View::scalar_type;
    static constexpr int D = View::dimension;

public:
    static constexpr bool in_cells = std::same_as<decltype(View::position), BlockedSpan<S>>;

    explicit Positions(const Domain<D>& domain) : per_cell_(S(1 / domain.cell_size)) {
        for (int a = 0; a < D; ++a) {
            lower_[a] = in_cells ? S(0) : S(domain.lower[a]);
            upper_[a] = in_cells ? extent_in_cells<S>(domain, a) : S(domain.upper[a]);
            if (domain.periodic[std::size_t(a)]) {  // no step is longer than the domain
                lower_[a] = -upper_[a];
                upper_[a] = 2 * upper_[a];
            }
        }
        cell_ = in_cells ? S(1) : S(domain.cell_size);
    }

    /// In cells, from the lower corner of the block that begins at `block` [cells].
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
    /// The faces of the domain.
    template <class P>
    FIRN_INLINE Vec<P, D> lowest(const Vec<P, D>& block) const {
        return in_cells ? cast<P>(lower_) - block : cast<P>(lower_);
    }
    template <class P>
    FIRN_INLINE Vec<P, D> highest(const Vec<P, D>& block) const {
        return in_cells ? cast<P>(upper_) - block : cast<P>(upper_);
    }
    S cell() const { return cell_; }
    /// What a velocity [m/s] is multiplied with to move a position by dt.
    S per_velocity(double dt, double h) const { return S(in_cells ? dt / h : dt); }

private:
    Vec<S, D> lower_, upper_;
    S per_cell_, cell_;
};

/// A particle's place: its base node in the arena, and the fractional position.
template <class P, int D>
struct Place {
    Vec<P, D> node;      ///< base node, counted from the arena's first [0, block_size − 1 + 2 drift]
    Vec<P, D> fraction;  ///< f = x/h − base, in cells
};

/// \param position  in cells, from the lower corner of the particle's block
template <class Kernel, class P, int D>
FIRN_INLINE Place<P, D> locate(const Vec<P, D>& position) {
    constexpr int last = block_size - 1 + 2 * allowed_drift;
    Place<P, D> place;
    unroll<D>([&](auto a) FIRN_LAMBDA {
        const P node = base_node<Kernel>(position.v[a]) + P(allowed_drift);
        // Bounded even if a position were not a number: memory outside the arena is never touched.
        place.node.v[a] = select(node > P(0), select(node < P(last), node, P(last)), P(0));
        place.fraction.v[a] = position.v[a] - (place.node.v[a] - P(allowed_drift));
    });
    return place;
}

/// Which particles lie beyond the reach of their block.
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

/// Where the particles of a group are.
template <class View>
class GroupPlaces {
public:
    using S = typename View::scalar_type;
    static constexpr int D = View::dimension;

    GroupPlaces(const View& view, const BlockPartition<D>& partition, const BlockGroup& group,
                const Positions<View>& positions)
        : view_(view),
          positions_(positions),
          blocks_(partition, group),
          first_(group.first_slot),
          order_(partition.order.data()) {}

    const BlocksOfSlots<S, D>& blocks() const { return blocks_; }
    FIRN_INLINE Slots slots(std::size_t slot) const { return {first_ + slot, order_ + first_ + slot}; }

    /// In cells, from the lower corner of each particle's block.
    template <class P>
    FIRN_INLINE Vec<P, D> position(std::size_t slot) const {
        return positions_.in_block(load_vector<P, D>(view_.position, slots(slot)), blocks_.template lower<P>(slot));
    }

    /// Where the particles' blocks begin in an arena of n along each axis.
    template <class Kernel, class P>
    FIRN_INLINE Vec<P, D> block_in_arena(std::size_t slot, int n) const {
        return n == arena_size<Kernel> ? Vec<P, D>::zero() : blocks_.template in_cube<P>(slot);
    }

    /// The nodes that the particles of the group reach, in its arena.
    template <class Kernel>
    FIRN_INLINE ArenaBox<D> box(const BlockGroup& group) const {
        using P = native_pack<S>;
        constexpr S far = std::numeric_limits<S>::max();
        Vec<P, D> low = Vec<P, D>::filled(P(far)), high = -low;
        for (std::size_t slot = 0; slot < group.packs() * pack_size; slot += scalar_traits<P>::lanes) {
            Vec<P, D> x = position<P>(slot);
            // Of one block's particles the outermost have the outermost nodes. Not so of several blocks': the sum of a
            // position and its block's corner may be rounded to the next cell.
            if (group.sparse) x = locate<Kernel>(x).node + blocks_.template in_cube<P>(slot);
            unroll<D>([&](auto a) FIRN_LAMBDA {
                low.v[a] = min(low.v[a], x.v[a]);  // what is not a number is left out: it reaches wrong nodes anyway
                high.v[a] = max(high.v[a], x.v[a]);
            });
        }
        ArenaBox<D> box;
        const auto node = [&](S x) {
            if (group.sparse) return int(x);
            const S last = S(block_size - 1 + 2 * allowed_drift);
            return int(std::clamp(base_node<Kernel>(x) + S(allowed_drift), S(0), last));
        };
        unroll<D>([&](auto a) {
            box.first[a] = node(-reduce_max(-low.v[a]));
            box.last[a] = node(reduce_max(high.v[a])) + Kernel::support - 1;
        });
        return box;
    }

private:
    const View& view_;
    const Positions<View>& positions_;
    BlocksOfSlots<S, D> blocks_;
    std::size_t first_;
    const std::uint32_t* order_;
};

/// Weights of sixteen particles, laid out for the row kernels: a number an axis and node for the leading axes,
/// a quad of the nodes' weights for the last axis.
template <class Kernel, std::floating_point S, int D, bool Gradients>
struct PackWeights {
    static constexpr int K = Kernel::support;
    using P = native_pack<S>;
    using Index = typename P::integer;

    alignas(64) S leading[D - 1][K][pack_size];
    alignas(64) S leading_gradient[Gradients ? D - 1 : 1][K][pack_size];
    alignas(64) S last[pack_size * 4];
    alignas(64) S last_gradient[Gradients ? pack_size * 4 : 4];
    alignas(64) Index corner[pack_size];  ///< the base node's first number in the arena

    /// \param block  where the particles' blocks begin in the arena;  \param n  the arena's size
    FIRN_INLINE void fill(int lane, const Place<P, D>& place, const Vec<P, D>& block, int n) {
        const Vec<P, D> node = place.node + block;
        P corner_node = node.v[0];
        unroll<D - 1>([&](auto a) FIRN_LAMBDA { corner_node = corner_node * P(S(n)) + node.v[a + 1]; });
        (corner_node * P(node_width)).store(corner + lane);
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

/// Where lane l (of sixteen) of a pack has its quad, in numbers.
template <class P>
FIRN_INLINE constexpr int quad_offset(int l) {
    constexpr unsigned lanes = scalar_traits<P>::lanes;
    return int(unsigned(l) / lanes * lanes + unsigned(quad_of_lane<P>(int(unsigned(l) % lanes)))) * 4;
}

}  // namespace firn
