/// \file Sixteen particles to the rows of nodes around them. Where rows are added up is the sink's business.
#pragma once

#include <firn/exec/lanes.hpp>
#include <firn/stage/p2g.hpp>

namespace firn {

/// Sixteen records, a quad for each of p (with the mass), the columns of A, the columns of G.
template <class Kernel, class Force, std::floating_point S, int D>
struct PackRecords {
    static constexpr bool gradients = Force::weight_gradients;
    static constexpr int quads = 1 + D + (gradients ? D : 0);
    using P = native_pack<S>;

    PackWeights<Kernel, S, D, gradients> weights;
    alignas(64) S value[quads][pack_size * 4];

    /// The lane loop: records and weights of one pack of particles.
    template <class Transfer, class View>
    FIRN_INLINE void fill(const View& view, std::size_t first_slot, const std::uint32_t* order,
                          const BlockFrame<S, D>& frame, S h, S dt) {
        constexpr int lanes = scalar_traits<P>::lanes;
        for (int lane = 0; lane < pack_size; lane += lanes) {
            const Slots slots{first_slot + std::size_t(lane), order + first_slot + lane};
            const Place<P, D> place = locate<Kernel>(load_vector<P, D>(view.position, slots), frame);
            weights.fill(lane, place);

            P2GParticle<P, D> particle;
            particle.mass = view.mass.template load_or_zero<P>(slots, 0);
            particle.volume = view.volume.template load_or_zero<P>(slots, 0);
            particle.velocity = load_vector<P, D>(view.velocity, slots);
            particle.stress = load_symmetric<P, D>(view.stress, slots);
            if constexpr (Transfer::affine)
                unroll<D * D>([&](auto k)
                                  FIRN_LAMBDA { particle.affine.m[k] = view.affine.template load<P>(slots, k); });
            const P2GRecord<P, D> record =
                make_record<Kernel, Transfer, Force>(particle, from_centre<Kernel>(place.fraction), P(h), P(dt));

            P r[4];
            put(record.momentum, r);
            r[node_mass] = record.mass;
            store_quads(r, value[0] + lane * 4);
            unroll<D>([&](auto a) FIRN_LAMBDA {
                put(record.affine.column(a), r);
                store_quads(r, value[1 + a] + lane * 4);
                if constexpr (gradients) {
                    put(record.gradient.column(a), r);
                    store_quads(r, value[1 + D + a] + lane * 4);
                }
            });
        }
    }

    /// Calls sink(arena offset of the row's first number, row) for the rows that the particle of lane l reaches.
    template <class Sink>
    FIRN_INLINE void scatter(int l, Sink&& sink) const {
        using Row = row<S, Kernel::support>;
        constexpr int n = arena_size<Kernel>, K = Kernel::support, centre = centre_node<Kernel>;
        const int q = quad_offset<P>(l);

        OpenRecord<Row, D, gradients> record;
        record.value = Row::repeat(value[0] + q);
        unroll<D>([&](auto a) FIRN_LAMBDA {
            record.column[a] = Row::repeat(value[1 + a] + q);
            if constexpr (gradients) record.gradient[a] = Row::repeat(value[1 + D + a] + q);
        });
        constexpr S row_offsets[4] = {S(0 - centre), S(1 - centre), S(2 - centre), S(3 - centre)};
        Row gradient_row{};
        if constexpr (gradients) gradient_row = Row::spread(weights.last_gradient + q);
        const auto rows = record.contract(Row::spread(row_offsets), Row::spread(weights.last + q), gradient_row);

        const std::ptrdiff_t corner = weights.corner[l];
        const auto along = [&](auto axis, const auto& open, std::ptrdiff_t at, const auto& self) FIRN_LAMBDA -> void {
            constexpr int a = axis;
            const auto w = weights.leading_weights(a, l);
            const auto g = weights.leading_gradients(a, l);
            unroll<K>([&](auto k) FIRN_LAMBDA {
                const auto closed =
                    open.contract(std::integral_constant<int, k - centre>{}, w[k], gradients ? g[k] : S(0));
                constexpr std::ptrdiff_t stride = (a == D - 2 ? n : n * n) * node_width;
                if constexpr (a == 0)
                    sink(at + k * stride, closed.value);
                else
                    self(std::integral_constant<int, a - 1>{}, closed, at + k * stride, self);
            });
        };
        along(std::integral_constant<int, D - 2>{}, rows, corner, along);
    }

private:
    FIRN_INLINE static void put(const Vec<P, D>& v, P (&r)[4]) {
        r[2] = r[3] = P(0);
        unroll<D>([&](auto i) FIRN_LAMBDA { r[i] = v.v[i]; });
    }
};

}  // namespace firn
