/// \file Gather: sums of node values over the rows of nodes around each particle of a pack (sixteen particles).
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/data/particle_set.hpp>
#include <firn/loops/places.hpp>
#include <firn/stage/g2p.hpp>

namespace firn::inline FIRN_BUILD {

/// For each particle of a pack: the weights of the nodes around the particle, and the particle's position relative to
/// its centre node. All sums over nodes use these values.
/// \tparam gradients  whether the gradients of the weights are needed, too
template <class Kernel, bool gradients, std::floating_point S, int D>
struct PackPlaces {
    using P = native_pack<S>;  ///< Type of a SIMD register with elements of type S.

    PackWeights<Kernel, S, D, gradients> weights;  ///< Weights of the nodes, and their gradients if needed.
    alignas(64) S from_centre_node[D][pack_size];  ///< Position of each particle relative to its centre node [cells].

    /// Computes `weights` and `from_centre_node` for one register of particles, the first of which is in lane `lane` of
    /// the pack.
    /// \param position  position of each particle, from the lower corner of the particle's block [cells]
    /// \param block     lower corner of each particle's block, from the lower corner of the group's block or cube of
    ///                  blocks [cells]
    /// \param n         number of nodes along each axis of the arena
    FIRN_INLINE void locate(int lane, const Vec<P, D>& position, const Vec<P, D>& block, int n) {
        const Place<P, D> place = firn::locate<Kernel>(position);
        weights.fill(lane, place, block, n);
        const Vec<P, D> offset = from_centre<Kernel>(place.fraction);
        unroll<D>([&](auto a) FIRN_LAMBDA { offset.v[a].store(from_centre_node[a] + lane); });
    }
    /// Returns the positions of one register of particles relative to their centre nodes [cells]. The first of these
    /// particles is in lane `lane` of the pack.
    FIRN_INLINE Vec<P, D> offset(int lane) const {
        Vec<P, D> r;
        unroll<D>([&](auto a) FIRN_LAMBDA { r.v[a] = P::load(from_centre_node[a] + lane); });
        return r;
    }
};

/// For each particle of a pack, sums over the nodes around the particle: Σ N v, and two further sums if needed. N is
/// the weight and v the velocity of a node. \see G2PSums
/// \tparam moments    whether to compute Σ N v oᵀ, with the offset o of a node from the centre node [cells]
/// \tparam gradients  whether to compute Σ v ∇Nᵀ
template <class Kernel, bool moments, bool gradients, std::floating_point S, int D>
struct PackSums {
    /// Number of vectors per particle: Σ N v, then the columns of Σ N v oᵀ, then the columns of Σ v ∇Nᵀ.
    static constexpr int quads = 1 + (moments ? D : 0) + (gradients ? D : 0);
    static constexpr int K = Kernel::support;  ///< Number of nodes of the kernel's support along each axis.
    using P = native_pack<S>;                  ///< Type of a SIMD register with elements of type S.

    /// value[i] holds vector i of the sums, for all particles of the pack: four elements per particle. \see quad_offset
    alignas(64) S value[quads][pack_size * 4];

    /// Computes the sums over nodes for all particles of the pack.
    /// \param row_of_line  row_of_line(l, i) returns the values of a row of nodes: row i of the nodes around the
    ///                     particle in lane l. \see line_begin
    template <class Weights, class RowOfLine>
    FIRN_INLINE void gather(const Weights& weights, const RowOfLine& row_of_line) {
        using Row = std::remove_cvref_t<decltype(row_of_line(0, std::integral_constant<int, 0>{}))>;
        // Particles that are processed together have their quads (groups of four numbers) next to each other in
        // `value`.
        constexpr int abreast = rows_abreast<Row>;
        static_assert(abreast == 1 || quad_offset<P>(pack_size / abreast) == quad_offset<P>(0) + 4);
        for (int l = 0; l < pack_size / abreast; ++l) {
            std::array<PartialSums<Row, D - 1, moments, gradients>, std::size_t(abreast)> rows;
            unroll<abreast>([&](auto i) FIRN_LAMBDA {
                const int lane = l + i * (pack_size / abreast);
                rows[i] = leading_sums(weights, lane, [&](auto line) FIRN_LAMBDA { return row_of_line(lane, line); });
            });
            close_rows(weights, quad_offset<P>(l), rows);
        }
    }

    /// Returns the sums of one register of particles, the first of which is in lane `lane` of the pack.
    FIRN_INLINE G2PSums<P, D> lanes(int lane) const {
        G2PSums<P, D> sums;
        P r[4];
        load_quads(value[0] + lane * 4, r);
        unroll<D>([&](auto i) FIRN_LAMBDA { sums.velocity.v[i] = r[i]; });
        unroll<D>([&](auto a) FIRN_LAMBDA {
            if constexpr (moments) {
                load_quads(value[1 + a] + lane * 4, r);
                unroll<D>([&](auto i) FIRN_LAMBDA { sums.moment(i, a) = r[i]; });
            }
            if constexpr (gradients) {
                load_quads(value[1 + (moments ? D : 0) + a] + lane * 4, r);
                unroll<D>([&](auto i) FIRN_LAMBDA { sums.gradient(i, a) = r[i]; });
            }
        });
        return sums;
    }

    /// Returns the sum of the fourth numbers of the nodes, weighted, of one register of particles: the masses Σ N m, or
    /// what lies in their place. \see average_volume
    FIRN_INLINE P fourth(int lane) const {
        P r[4];
        load_quads(value[0] + lane * 4, r);
        return r[node_mass];
    }

private:
    /// Sums the weighted node values of the particle in lane l over all axes except the last. The result is one row of
    /// values, one for each node along the last axis.
    template <class Weights, class RowOfLine>
    FIRN_INLINE static auto leading_sums(const Weights& weights, int l, const RowOfLine& row_of_line) {
        using Row = std::remove_cvref_t<decltype(row_of_line(std::integral_constant<int, 0>{}))>;
        using Number = typename Row::Number;
        const auto close = [&](auto axis, auto line, const auto& self) FIRN_LAMBDA {
            constexpr int a = axis;
            std::array<PartialSums<Row, a, moments, gradients>, std::size_t(K)> parts;
            std::array<Number, std::size_t(K)> w, g{};
            unroll<K>([&](auto k) FIRN_LAMBDA {
                constexpr std::integral_constant<int, line + (D == 3 && a == 0 ? K : 1) * k> next{};
                if constexpr (a == 0)
                    parts[k].value =
                        k + 1 < K ? row_of_line(next) : row_of_line(next).held();  // the last row is used twice
                else
                    parts[k] = self(std::integral_constant<int, a - 1>{}, next, self);
                w[k] = Number::fill(&weights.leading[a][k][l]);
                if constexpr (gradients) g[k] = Number::fill(&weights.leading_gradient[a][k][l]);
            });
            return sum_axis<centre_node<Kernel>>(parts, w, g);
        };
        return close(std::integral_constant<int, D - 2>{}, std::integral_constant<int, 0>{}, close);
    }

    /// Sums each given row over its nodes along the last axis, and stores the sums in `value`.
    /// \param q     index of the first element to write in each value[i]
    /// \param rows  for each of N particles: the sums over all axes except the last
    template <class Weights, class Row, std::size_t N>
    FIRN_INLINE void close_rows(const Weights& weights, int q,
                                const std::array<PartialSums<Row, D - 1, moments, gradients>, N>& rows) {
        const auto split = [&](const auto& part) FIRN_LAMBDA {
            std::array<Row, N> of_each;
            unroll<int(N)>([&](auto i) FIRN_LAMBDA { of_each[i] = part(rows[i]); });
            return nodes_of_rows(of_each);
        };
        const auto values = split([](const auto& sums) FIRN_LAMBDA { return sums.value; });
        using Number = typename decltype(values)::value_type;
        std::array<PartialSums<Number, D - 1, moments, gradients>, std::size_t(K)> nodes;
        std::array<Number, std::size_t(K)> w, g{};
        unroll<K>([&](auto k) FIRN_LAMBDA {
            nodes[k].value = values[k];
            w[k] = Number::template fill_quads<k>(weights.last + q);
            if constexpr (gradients) g[k] = Number::template fill_quads<k>(weights.last_gradient + q);
        });
        unroll<D - 1>([&](auto a) FIRN_LAMBDA {
            if constexpr (moments) {
                const auto of_axis = split([&](const auto& sums) FIRN_LAMBDA { return sums.moment[a]; });
                unroll<K>([&](auto k) FIRN_LAMBDA { nodes[k].moment[a] = of_axis[k]; });
            }
            if constexpr (gradients) {
                const auto of_axis = split([&](const auto& sums) FIRN_LAMBDA { return sums.gradient[a]; });
                unroll<K>([&](auto k) FIRN_LAMBDA { nodes[k].gradient[a] = of_axis[k]; });
            }
        });
        const auto sums = sum_axis<centre_node<Kernel>>(nodes, w, g);
        sums.value.store(value[0] + q);
        unroll<D>([&](auto a) FIRN_LAMBDA {
            if constexpr (moments) sums.moment[a].store(value[1 + a] + q);
            if constexpr (gradients) sums.gradient[a].store(value[1 + (moments ? D : 0) + a] + q);
        });
    }
};

/// The PackSums that compute only the sums that the transfer policy and the force policy need.
template <class Kernel, class Transfer, class Force, std::floating_point S, int D>
using TransferSums =
    PackSums<Kernel, g2p_needs_moment<Kernel, Transfer, Force>, g2p_needs_gradient<Kernel, Transfer, Force>, S, D>;

namespace detail {

/// Computes the sums over nodes for a pack, from an arena. With firn::compiled the function is not inlined: it knows no
/// material, so one instance serves all.
/// \param nodes  the arena's nodes;  \param n  number of nodes along each axis of the arena
template <class Kernel, bool has_gradients, bool moments, bool gradients, std::floating_point S, int D>
FIRN_INLINE_OR_COMPILED void gather_from_arena(const PackWeights<Kernel, S, D, has_gradients>& weights, const S* nodes,
                                               int n, PackSums<Kernel, moments, gradients, S, D>& sums) {
    sums.gather(weights, [&](int l, auto line) FIRN_LAMBDA {
        return row<S, Kernel::support>::load(nodes + weights.corner[l] + line_begin<Kernel, D>(line, n) * node_width);
    });
}
/// The same for a pack of spray, from the grid.
/// \param numbers  the numbers of a layer;  \param rows  the rows of nodes around each particle
/// \param used     number of particles of the pack; the other lanes are padding, for which any nodes will do
template <class Kernel, bool has_gradients, bool moments, bool gradients, std::floating_point S, int D>
FIRN_INLINE_OR_COMPILED void gather_from_grid(const PackWeights<Kernel, S, D, has_gradients>& weights, const S* numbers,
                                              const RowsInGrid<Kernel, D>* rows, int used,
                                              PackSums<Kernel, moments, gradients, S, D>& sums) {
    sums.gather(weights, [&](int l, auto row) FIRN_LAMBDA {
        const RowsInGrid<Kernel, D>& of = rows[l < used ? l : 0];
        return row_of_runs<S, Kernel::support>::of_runs(numbers + of.first[row], numbers + of.second[row], of.split);
    });
}

/// Copies the numbers of the nodes around a group to an arena.
template <class Kernel, std::floating_point S, int D>
FIRN_INLINE_OR_COMPILED void fill_arena(Arena<Kernel, S, D>& arena, const S* numbers, const BlocksAround<D>& around,
                                        const BlockGroup& group, const ArenaBox<D>& box) {
    arena.clear(group, box);
    arena.for_runs(numbers, around, box, [&](int to, const S* from, auto count) FIRN_LAMBDA {
        exact_row<S, count>::load(from).store(arena.node + to);
    });
}

}  // namespace detail

/// The node values that are summed for the particles of a group. They are copied to an arena (contiguous memory),
/// unless the group is spray (few particles in sparse blocks, see is_spray). For spray, the values are read
/// from the grid, node by node.
/// \tparam Layers  number of layers of the grid (arrays of node values) from which values are needed. Layer 0 is the
///                 array of the nodes' present values; the other layers hold values that were stored earlier. \see
///                 SparseGrid::layer
template <class Kernel, std::floating_point S, int D, int Layers>
class NodesOfGroup {
    using P = native_pack<S>;
    using Rows = RowsInGrid<Kernel, D>;

public:
    /// Copies the node values to an arena, unless the group is spray.
    /// \param first_layer  the first of the layers from which values are needed
    template <class View>
    FIRN_INLINE NodesOfGroup(const SparseGrid<S, D>& grid, const BlockPartition<D>& partition, const BlockGroup& group,
                             const GroupPlaces<View>& places, std::size_t first_layer = 0)
        : grid_(grid), partition_(partition), is_spray_(is_spray<D>(group)), particles_(group.particles) {
        for (std::size_t k = 0; k < Layers; ++k)
            numbers_[k] = first_layer + k == 0 ? grid.nodes(0) : grid.layer(first_layer + k);
        if (is_spray_) {
            for (const S* const numbers : numbers_) prefetch_next_spray(numbers, grid, partition, group);
            return;
        }
        const BlocksAround<D> around(grid, partition, group);
        const ArenaBox<D> box = places.template box<Kernel>(group);
        for (std::size_t k = 0; k < Layers; ++k) detail::fill_arena(arena_[k], numbers_[k], around, group, box);
    }

    /// Computes the weights and positions of the particles of one pack, and stores them in `pack`. If the group is
    /// spray, also finds the nodes around these particles, and prefetches them.
    /// \param slot  first slot of the pack, counted from the group's first slot
    template <class Pack, class View>
    FIRN_INLINE void locate(Pack& pack, const GroupPlaces<View>& places, std::size_t slot) {
        const int n = is_spray_ ? arena_size<Kernel> : arena_[0].n;
        for (int lane = 0; lane < pack_size; lane += scalar_traits<P>::lanes) {
            const std::size_t at = slot + std::size_t(lane);
            pack.locate(lane, places.template position<P>(at), places.template block_in_arena<Kernel, P>(at, n), n);
        }
        if (is_spray_) find_rows(pack, places, slot);
    }
    /// Computes the sums over nodes for a pack, with the node values of one layer of the grid. Call locate() for the
    /// pack first.
    template <int layer, class Pack, class Sums>
    FIRN_INLINE void gather(const Pack& pack, Sums& sums) const {
        if (is_spray_)
            detail::gather_from_grid(pack.weights, numbers_[layer], rows_, used_, sums);
        else
            detail::gather_from_arena(pack.weights, arena_[layer].node, arena_[layer].n, sums);
    }

private:
    /// Finds the rows of nodes around the particles of a pack of spray, and brings them into the cache. The grid of
    /// spray is larger than the cache, and the processor cannot foresee which nodes are next.
    template <class Pack, class View>
    FIRN_INLINE void find_rows(const Pack& pack, const GroupPlaces<View>& places, std::size_t slot) {
        used_ = int(std::min<std::size_t>(pack_size, particles_ - slot));
        for (int l = 0; l < used_; ++l) {
            const std::size_t range = places.blocks().range(slot + std::size_t(l));
            rows_[l].find(grid_.neighbours(partition_, range), pack.weights.corner[l], [&](auto row) FIRN_LAMBDA {
                for (const S* const numbers : numbers_) {
                    __builtin_prefetch(numbers + rows_[l].first[row]);
                    __builtin_prefetch(numbers + rows_[l].last(row));
                }
            });
        }
    }

    const SparseGrid<S, D>& grid_;
    const BlockPartition<D>& partition_;
    bool is_spray_;
    std::size_t particles_;  // number of the group's particles
    const S* numbers_[Layers];
    int used_ = 0;  // of spray: number of particles of the present pack, and where the nodes around them are
    Rows rows_[pack_size];
    Arena<Kernel, S, D> arena_[Layers];
};

namespace detail {

/// Gathers the numbers of nodes to the particles of a group: calls take(slot, sums, offset) for each register of
/// particles, with its first slot in the group, its sums and its positions relative to the centre nodes [cells].
/// \tparam moments, gradients  which sums are needed. \see PackSums
/// \param layer  the layer of the grid whose numbers are gathered
template <class Kernel, bool moments, bool gradients, class View, std::floating_point S, int D, class Take>
FIRN_INLINE void gather_to_group(const BlockPartition<D>& partition, const BlockGroup& group,
                                 const GroupPlaces<View>& places, const SparseGrid<S, D>& grid, std::size_t layer,
                                 const Take& take) {
    NodesOfGroup<Kernel, S, D, 1> nodes(grid, partition, group, places, layer);
    PackPlaces<Kernel, gradients, S, D> pack;
    PackSums<Kernel, moments, gradients, S, D> sums;
    for (std::size_t slot = 0; slot < group.packs() * pack_size; slot += pack_size) {
        nodes.locate(pack, places, slot);
        nodes.template gather<0>(pack, sums);
        for (int lane = 0; lane < pack_size; lane += scalar_traits<native_pack<S>>::lanes)
            take(slot + std::size_t(lane), sums.lanes(lane), pack.offset(lane));
    }
}

/// Gathers the present numbers of nodes to the particles of a set: calls take(slots, sums, offset) for each register
/// of particles. \see gather_to_group
template <class Kernel, bool moments, bool gradients, class View, std::floating_point S, int D, class Take>
void gather_to_set(const ParticleSet<View>& set, const SparseGrid<S, D>& grid, int threads, const Take& take) {
    const Positions<View> positions(grid.domain());
    parallel_for(set.partition.groups.size(), threads, [&](std::size_t g, int) {
        const BlockGroup& group = set.partition.groups[g];
        const GroupPlaces<View> places(set.view, set.partition, group, positions);
        gather_to_group<Kernel, moments, gradients>(
            set.partition, group, places, grid, 0,
            [&](std::size_t slot, const G2PSums<native_pack<S>, D>& sums, const Vec<native_pack<S>, D>& offset)
                FIRN_LAMBDA { take(places.slots(slot), sums, offset); });
    });
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
