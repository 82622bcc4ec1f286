/// \file Sixteen particles to the rows of nodes around them. Where rows are added up is the sink's business.
#pragma once

#include <firn/exec/lanes.hpp>
#include <firn/stage/p2g.hpp>

namespace firn {

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

    /// The nodes that the group's particles reach, in the arena of its cube of blocks.
    template <class Kernel>
    FIRN_INLINE ArenaBox<D> box(std::size_t packs) const {
        using P = native_pack<S>;
        constexpr int lanes = scalar_traits<P>::lanes;
        Vec<P, D> low, high;
        for (std::size_t slot = 0; slot < packs * pack_size; slot += lanes) {
            const Vec<P, D> node = locate<Kernel>(position<P>(slot)).node + blocks_.template in_cube<P>(slot);
            unroll<D>([&](auto a) FIRN_LAMBDA {
                low.v[a] = slot == 0 ? node.v[a] : min(low.v[a], node.v[a]);
                high.v[a] = slot == 0 ? node.v[a] : max(high.v[a], node.v[a]);
            });
        }
        ArenaBox<D> box;
        for (int a = 0; a < D; ++a) {
            box.first[a] = -int(reduce_max(-low[a]));
            box.last[a] = int(reduce_max(high[a])) + Kernel::support - 1;
        }
        return box;
    }

private:
    const View& view_;
    const Positions<View>& positions_;
    BlocksOfSlots<S, D> blocks_;
    std::size_t first_;
    const std::uint32_t* order_;
};

/// What a P2G reads of particles.
template <class View>
class ParticleReader {
public:
    using S = typename View::scalar_type;
    static constexpr int D = View::dimension;

    ParticleReader(const View& view, const Domain<D>& domain, double dt)
        : view_(view), h_(S(domain.cell_size)), dt_(S(dt)) {}

    template <class Kernel, class Transfer, class Force, class P>
    FIRN_INLINE P2GRecord<P, D> record(const Slots& slots, const Vec<P, D>& fraction) const {
        P2GParticle<P, D> particle;
        particle.mass = view_.mass.template load_or_zero<P>(slots, 0);
        particle.volume = view_.volume.template load_or_zero<P>(slots, 0);
        particle.velocity = load_vector<P, D>(view_.velocity, slots);
        particle.stress = load_symmetric<P, D>(view_.stress, slots);
        if constexpr (Transfer::affine)
            unroll<D * D>([&](auto k) FIRN_LAMBDA { particle.affine.m[k] = view_.affine.template load<P>(slots, k); });
        return make_record<Kernel, Transfer, Force>(particle, from_centre<Kernel>(fraction), P(h_), P(dt_));
    }

private:
    const View& view_;
    S h_, dt_;
};

/// Sixteen records, a quad for each of p (with the mass), the columns of A, the columns of G.
template <class Kernel, class Force, std::floating_point S, int D>
struct PackRecords {
    static constexpr bool gradients = Force::weight_gradients;
    static constexpr int quads = 1 + D + (gradients ? D : 0);
    using P = native_pack<S>;

    PackWeights<Kernel, S, D, gradients> weights;
    alignas(64) S value[quads][pack_size * 4];

    /// The lane loop: records and weights of one pack of particles, from slot `slot` of a group on.
    /// \param n  size of the arena
    template <class Transfer, class View>
    FIRN_INLINE void fill(const ParticleReader<View>& reader, const GroupPlaces<View>& places, std::size_t slot,
                          int n) {
        constexpr int lanes = scalar_traits<P>::lanes;
        for (int lane = 0; lane < pack_size; lane += lanes, slot += lanes) {
            const Place<P, D> place = locate<Kernel>(places.template position<P>(slot));
            const Vec<P, D> block =
                n == arena_size<Kernel> ? Vec<P, D>::zero() : places.blocks().template in_cube<P>(slot);
            weights.fill(lane, place, block, n);
            const P2GRecord<P, D> record =
                reader.template record<Kernel, Transfer, Force>(places.slots(slot), place.fraction);

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
    /// \tparam n  size of the arena
    template <int n, class Sink>
    FIRN_INLINE void scatter(int l, Sink&& sink) const {
        using Row = row<S, Kernel::support>;
        constexpr int K = Kernel::support, centre = centre_node<Kernel>;
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
