/// \file The rows of nodes around sixteen particles to their sums.
#pragma once

#include <firn/exec/lanes.hpp>
#include <firn/stage/g2p.hpp>

namespace firn {

/// \tparam moments, gradients  which sums are made besides Σ N v
template <class Kernel, bool moments, bool gradients, std::floating_point S, int D>
struct PackSums {
    static constexpr int quads = 1 + (moments ? D : 0) + (gradients ? D : 0);
    static constexpr int K = Kernel::support;
    using P = native_pack<S>;

    PackWeights<Kernel, S, D, gradients> weights;
    alignas(64) S value[quads][pack_size * 4];
    alignas(64) S from_centre_node[D][pack_size];  ///< [cells]

    /// Sets the particles of the lanes from `lane` on.
    /// \param position  in their blocks [cells];  \param block  of their blocks in the arena;  \param n  its size
    FIRN_INLINE void locate(int lane, const Vec<P, D>& position, const Vec<P, D>& block, int n) {
        const Place<P, D> place = firn::locate<Kernel>(position);
        weights.fill(lane, place, block, n);
        const Vec<P, D> offset = from_centre<Kernel>(place.fraction);
        unroll<D>([&](auto a) FIRN_LAMBDA { offset.v[a].store(from_centre_node[a] + lane); });
    }
    FIRN_INLINE Vec<P, D> offset(int lane) const {
        Vec<P, D> r;
        unroll<D>([&](auto a) FIRN_LAMBDA { r.v[a] = P::load(from_centre_node[a] + lane); });
        return r;
    }

    /// Sums of all particles over the nodes that they reach.
    /// \param row_of_line  row_of_line(l, i): the row of line i of the nodes of lane l's particle, in any form.
    ///                     \see line_begin
    template <class RowOfLine>
    FIRN_INLINE void gather(const RowOfLine& row_of_line) {
        using Row = std::remove_cvref_t<decltype(row_of_line(0, std::integral_constant<int, 0>{}))>;
        // Particles abreast have their quads beside each other.
        constexpr int abreast = rows_abreast<Row>;
        static_assert(abreast == 1 || quad_offset<P>(pack_size / abreast) == quad_offset<P>(0) + 4);
        for (int l = 0; l < pack_size / abreast; ++l) {
            std::array<PartialSums<Row, D - 1, moments, gradients>, std::size_t(abreast)> rows;
            unroll<abreast>([&](auto i) FIRN_LAMBDA {
                const int lane = l + i * (pack_size / abreast);
                rows[i] = leading_sums(lane, [&](auto line) FIRN_LAMBDA { return row_of_line(lane, line); });
            });
            close_rows(quad_offset<P>(l), rows);
        }
    }

    /// The sums of the lanes from `lane` on.
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

private:
    /// Along all axes but the last: a row of nodes remains.
    template <class RowOfLine>
    FIRN_INLINE auto leading_sums(int l, const RowOfLine& row_of_line) const {
        using Row = std::remove_cvref_t<decltype(row_of_line(std::integral_constant<int, 0>{}))>;
        using Number = typename Row::Number;
        const auto close = [&](auto axis, auto line, const auto& self) FIRN_LAMBDA {
            constexpr int a = axis;
            std::array<PartialSums<Row, a, moments, gradients>, std::size_t(K)> parts;
            std::array<Number, std::size_t(K)> w, g{};
            unroll<K>([&](auto k) FIRN_LAMBDA {
                constexpr std::integral_constant<int, line + (D == 3 && a == 0 ? K : 1) * k> next{};
                if constexpr (a == 0)
                    parts[k].value = k + 1 < K ? row_of_line(next) : row_of_line(next).held();  // used twice
                else
                    parts[k] = self(std::integral_constant<int, a - 1>{}, next, self);
                w[k] = Number::fill(&weights.leading[a][k][l]);
                if constexpr (gradients) g[k] = Number::fill(&weights.leading_gradient[a][k][l]);
            });
            return sum_axis<centre_node<Kernel>>(parts, w, g);
        };
        return close(std::integral_constant<int, D - 2>{}, std::integral_constant<int, 0>{}, close);
    }

    /// Along the last axis, for the particles whose quads begin at q: rows fall into their nodes.
    template <class Row, std::size_t N>
    FIRN_INLINE void close_rows(int q, const std::array<PartialSums<Row, D - 1, moments, gradients>, N>& rows) {
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

/// The same with what a transfer and a form of the forces need.
template <class Kernel, class Transfer, class Force, std::floating_point S, int D>
using TransferSums =
    PackSums<Kernel, g2p_needs_moment<Kernel, Transfer>, g2p_needs_gradient<Kernel, Transfer, Force>, S, D>;

/// The nodes around a group in one place, to gather from.
template <class Kernel, std::floating_point S, int D, int Blocks>
class GroupNodes {
public:
    static constexpr int n = Arena<Kernel, S, D, Blocks>::n;

    /// \param nodes  of the whole grid, or one of its layers
    FIRN_INLINE GroupNodes(const S* nodes, const BlocksAround<D, Blocks>& around, const ArenaBox<D>& box) {
        arena_.clear(box);
        Arena<Kernel, S, D, Blocks>::for_runs(nodes, around.data(), box,
                                              [&](int to, const S* from, auto count) FIRN_LAMBDA {
                                                  exact_row<S, count>::load(from).store(arena_.node + to);
                                              });
    }
    /// The sums of the pack that begins at `slot` of the group.
    template <class Sums, class View>
    FIRN_INLINE void gather(Sums& sums, const GroupPlaces<View>& places, std::size_t slot) const {
        using P = native_pack<S>;
        for (int lane = 0; lane < pack_size; lane += scalar_traits<P>::lanes)
            sums.locate(lane, places.template position<P>(slot + std::size_t(lane)),
                        places.blocks().template in_cube<P>(slot + std::size_t(lane)), n);
        sums.gather([&](int l, auto line) FIRN_LAMBDA {
            return row<S, Kernel::support>::load(arena_.node + sums.weights.corner[l] +
                                                 line_begin<Kernel, D, n>(line) * node_width);
        });
    }

private:
    Arena<Kernel, S, D, Blocks> arena_;
};

/// The same where few particles are: nodes are gathered from the grid where they lie, a register each.
template <class Kernel, std::floating_point S, int D>
class NodesInGrid {
public:
    /// \param nodes  of the whole grid, or one of its layers
    FIRN_INLINE NodesInGrid(const S* nodes, const SparseGrid<S, D>& grid, const BlockPartition<D>& partition)
        : nodes_(nodes), grid_(grid), partition_(partition) {}

    template <class Sums, class View>
    FIRN_INLINE void gather(Sums& sums, const GroupPlaces<View>& places, std::size_t slot) const {
        using P = native_pack<S>;
        for (int lane = 0; lane < pack_size; lane += scalar_traits<P>::lanes)
            sums.locate(lane, places.template position<P>(slot + std::size_t(lane)), Vec<P, D>::zero(),
                        arena_size<Kernel>);
        sums.gather([&](int l, auto line) FIRN_LAMBDA {
            const std::uint32_t* neighbours =
                grid_.neighbours(partition_, places.blocks().range(slot + std::size_t(l)));
            return portable_row<S, Kernel::support>::of_nodes([&](auto k) FIRN_LAMBDA {
                const std::size_t node = ArenaNodes<Kernel, D>::in_grid(neighbours, sums.weights.corner[l], line, k);
                return quad<S>::load(nodes_ + node * node_width);
            });
        });
    }

private:
    const S* nodes_;
    const SparseGrid<S, D>& grid_;
    const BlockPartition<D>& partition_;
};

}  // namespace firn
