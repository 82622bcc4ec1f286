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

    /// Sums of the particle of lane l over the nodes from `corner` on.
    /// \tparam n  nodes a line, in memory
    template <int n>
    FIRN_INLINE void gather(int l, const S* corner) {
        using Row = row<S, Kernel::support>;
        constexpr int K = Kernel::support, centre = centre_node<Kernel>;

        const auto along = [&](auto axis, const S* at, const auto& self) FIRN_LAMBDA {
            constexpr int a = axis;
            constexpr std::ptrdiff_t stride = (a == D - 2 ? n : n * n) * node_width;
            std::array<PartialSums<Row, a, moments, gradients>, std::size_t(K)> parts;
            unroll<K>([&](auto k) FIRN_LAMBDA {
                if constexpr (a == 0)
                    parts[k].value = Row::load(at + k * stride);
                else
                    parts[k] = self(std::integral_constant<int, a - 1>{}, at + k * stride, self);
            });
            return sum_axis<centre>(parts, weights.leading_weights(a, l), weights.leading_gradients(a, l));
        };
        const auto rows = along(std::integral_constant<int, D - 2>{}, corner, along);

        const int q = quad_offset<P>(l);
        const Row w = Row::spread(weights.last + q);
        (rows.value * w).sum().store(value[0] + q);
        if constexpr (moments) {
            constexpr S row_offsets[4] = {S(0 - centre), S(1 - centre), S(2 - centre), S(3 - centre)};
            unroll<D - 1>([&](auto a) FIRN_LAMBDA { (rows.moment[a] * w).sum().store(value[1 + a] + q); });
            ((rows.value * w) * Row::spread(row_offsets)).sum().store(value[D] + q);
        }
        if constexpr (gradients) {
            constexpr int first = 1 + (moments ? D : 0);
            unroll<D - 1>([&](auto a) FIRN_LAMBDA { (rows.gradient[a] * w).sum().store(value[first + a] + q); });
            (rows.value * Row::spread(weights.last_gradient + q)).sum().store(value[first + D - 1] + q);
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
};

}  // namespace firn
