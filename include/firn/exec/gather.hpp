/// \file The rows of nodes around sixteen particles to their sums.
#pragma once

#include <firn/exec/lanes.hpp>
#include <firn/stage/g2p.hpp>

namespace firn {

template <class Kernel, class Transfer, class Force, std::floating_point S, int D>
struct PackSums {
    static constexpr bool moments = g2p_needs_moment<Transfer>;
    static constexpr bool gradients = g2p_needs_gradient<Transfer, Force>;
    static constexpr int quads = 1 + (moments ? D : 0) + (gradients ? D : 0);
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

    /// Sums of the particle of lane l over the nodes that it reaches.
    /// \param row_of_line  row_of_line(i): the row of its line i of nodes, in any form. \see line_begin
    template <class RowOfLine>
    FIRN_INLINE void gather(int l, const RowOfLine& row_of_line) {
        using Row = std::remove_cvref_t<decltype(row_of_line(std::integral_constant<int, 0>{}))>;
        using Number = typename Row::Number;
        constexpr int K = Kernel::support, centre = centre_node<Kernel>;

        const auto close = [&](auto axis, auto line, const auto& self) FIRN_LAMBDA {
            constexpr int a = axis;
            std::array<PartialSums<Row, a, moments, gradients>, std::size_t(K)> parts;
            std::array<Number, std::size_t(K)> w, g{};
            unroll<K>([&](auto k) FIRN_LAMBDA {
                constexpr std::integral_constant<int, line + (D == 3 && a == 0 ? K : 1) * k> next{};
                if constexpr (a == 0)
                    parts[k].value = row_of_line(next);
                else
                    parts[k] = self(std::integral_constant<int, a - 1>{}, next, self);
                w[k] = Number::fill(&weights.leading[a][k][l]);
                if constexpr (gradients) g[k] = Number::fill(&weights.leading_gradient[a][k][l]);
            });
            return sum_axis<centre>(parts, w, g);
        };
        const auto rows = close(std::integral_constant<int, D - 2>{}, std::integral_constant<int, 0>{}, close);

        // Along the last axis a row falls into its nodes.
        const int q = quad_offset<P>(l);
        std::array<PartialSums<quad<S>, D - 1, moments, gradients>, std::size_t(K)> nodes;
        std::array<quad<S>, std::size_t(K)> w, g{};
        unroll<K>([&](auto k) FIRN_LAMBDA {
            nodes[k].value = rows.value.template node<k>();
            unroll<D - 1>([&](auto a) FIRN_LAMBDA {
                if constexpr (moments) nodes[k].moment[a] = rows.moment[a].template node<k>();
                if constexpr (gradients) nodes[k].gradient[a] = rows.gradient[a].template node<k>();
            });
            w[k] = quad<S>::fill(weights.last + q + k);
            if constexpr (gradients) g[k] = quad<S>::fill(weights.last_gradient + q + k);
        });
        const auto sums = sum_axis<centre>(nodes, w, g);
        sums.value.store(value[0] + q);
        unroll<D>([&](auto a) FIRN_LAMBDA {
            if constexpr (moments) sums.moment[a].store(value[1 + a] + q);
            if constexpr (gradients) sums.gradient[a].store(value[1 + (moments ? D : 0) + a] + q);
        });
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
};

}  // namespace firn
