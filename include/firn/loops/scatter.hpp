/// \file Scatter: adds the contributions of a pack of particles to the rows of nodes around them. The caller chooses
/// the type of the sums, and where they are stored.
#pragma once

#include <firn/loops/row_sums.hpp>

namespace firn::inline FIRN_BUILD {

/// Reads particles, and computes their P2G records: the values from which contributions to nodes are computed.
template <class View>
class ParticleReader {
public:
    using S = typename View::scalar_type;      ///< The scalar type: float or double.
    static constexpr int D = View::dimension;  ///< The dimension: 2 or 3.

    /// Makes a reader of the particles of `view`, for a time step of `dt` [s]. `view` must exist as long as the reader.
    ParticleReader(const View& view, const Domain<D>& domain, double dt)
        : view_(view), h_(S(domain.cell_size)), dt_(S(dt)) {}

    /// Returns the records of one register of particles.
    /// \param fraction  positions of the particles relative to their base nodes [cells]
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

    /// Prefetches into the cache all values that record() reads, for the pack that begins at `slot`.
    template <class Transfer>
    FIRN_INLINE void prefetch(std::size_t slot) const {
        view_.template prefetch<Transfer::affine>(slot);
    }

private:
    const View& view_;
    S h_, dt_;
};

/// For each particle of a pack: the weights of the nodes around the particle, and the products of these weights that a
/// scatter needs for each row of nodes.
/// \tparam gradients  whether the gradients of the weights are needed, too
template <class Kernel, bool gradients, std::floating_point S, int D>
struct PackProducts {
    static constexpr int K = Kernel::support;                   ///< Number of nodes of the kernel along each axis.
    static constexpr int lines = lines_of_particle<Kernel, D>;  ///< Number of rows of nodes around a particle.
    using P = native_pack<S>;                                   ///< Type of a SIMD register with elements of type S.

    PackWeights<Kernel, S, D, gradients> weights;  ///< Weights of the nodes along each axis.
    alignas(64) S product[lines][pack_size];       ///< For each row: product of the weights along the leading axes.
    /// For each row and each leading axis (all but the last): `product`, but with the kernel's gradient in place of its
    /// weight along this axis.
    alignas(64) S gradient_product[gradients ? lines : 1][D - 1][pack_size];

    /// Computes the weights and products of one register of particles, the first of which is in lane `lane` of the
    /// pack.
    FIRN_INLINE void fill(int lane, const Place<P, D>& place, const Vec<P, D>& block, int n) {
        weights.fill(lane, place, block, n);
        unroll<lines>([&](auto line) FIRN_LAMBDA { fill_products(line, lane); });
    }
    /// Calls count(corner, 1) for each particle in lanes [first, last) of the pack; `corner` is the particle's base
    /// node.
    template <class Count>
    FIRN_INLINE void count(int first, int last, const Count& count) const {
        for (int l = first; l < last; ++l) count(weights.corner[l], 1);
    }

private:
    /// Returns the index of a row of nodes along the leading axis a: 0 to K − 1. `line` is the index of the row among
    /// all rows around a particle.
    FIRN_INLINE static constexpr int along(int a, int line) { return D == 3 && a == 0 ? line / K : line % K; }

    /// Computes `product` and `gradient_product` of row `line` for one register of particles.
    FIRN_INLINE void fill_products(int line, int lane) {
        const auto factor = [&](const auto& table, int a)
                                FIRN_LAMBDA { return P::load(table[a][along(a, line)] + lane); };
        P weight = factor(weights.leading, 0);
        if constexpr (D == 3) weight *= factor(weights.leading, 1);
        weight.store(product[line] + lane);
        if constexpr (gradients)
            unroll<D - 1>([&](auto a) FIRN_LAMBDA {
                P gradient = factor(weights.leading_gradient, a);
                if constexpr (D == 3) gradient *= factor(weights.leading, 1 - a);
                gradient.store(gradient_product[line][a] + lane);
            });
    }
};

/// The values of the P2G records of a pack's particles. A record is stored as vectors of four components. The first
/// vector is the momentum p and the mass; the columns of the matrix A follow, then, if the force policy uses weight
/// gradients, the columns of the matrix G. \see P2GRecord
template <class Kernel, class Force, std::floating_point S, int D>
struct PackValues {
    static constexpr bool gradients = Force::weight_gradients;  ///< Whether records have a matrix G.
    /// Whether records have no matrix A: a node receives the same at every offset, apart from its weight.
    static constexpr bool constant = requires { Force::constant_records; };
    static constexpr int quads = 1 + (constant ? 0 : D) + (gradients ? D : 0);  ///< Number of vectors in a record.
    static constexpr int K = Kernel::support,  ///< Number of nodes of the kernel's support along each axis.
        centre = centre_node<Kernel>;          ///< Index of the centre node, counted from the base node.
    static constexpr int lines = lines_of_particle<Kernel, D>;  ///< Number of rows of nodes around a particle.
    using P = native_pack<S>;                                   ///< Type of a SIMD register with elements of type S.

    alignas(64) S value[quads][pack_size * 4];  ///< value[i]: vector i of each record; 4 elements per particle.

    /// Stores the records of one register of particles, the first of which is in lane `lane` of the pack.
    FIRN_INLINE void fill(int lane, const P2GRecord<P, D>& record) {
        P r[4];
        put(record.momentum, r);
        r[node_mass] = record.mass;
        store_quads(r, value[0] + lane * 4);
        unroll<constant ? 0 : D>([&](auto a) FIRN_LAMBDA {
            put(record.affine.column(a), r);
            store_quads(r, value[1 + a] + lane * 4);
            if constexpr (gradients) {
                put(record.gradient.column(a), r);
                store_quads(r, value[1 + D + a] + lane * 4);
            }
        });
    }

    /// Adds the contributions of the particles in lanes [first, last) of the pack to the rows of nodes around them.
    /// \param products  the weights of the pack
    /// \param rows_at   rows_at(corner) returns the rows around a base node. \see ArenaRows, GridRows
    /// \param count     called as count(corner, particles) after contributions of consecutive particles with the same
    ///                  base node were added; `corner` is the base node, and `particles` the number of these particles
    /// \tparam Held  whether sums stay in registers while consecutive particles have the same base node. The additions
    ///               and their order are the same either way.
    template <bool Held, class Products, class RowsAt, class Count>
    FIRN_INLINE void scatter(const Products& products, int first, int last, const RowsAt& rows_at,
                             const Count& count) const {
        using Row = typename decltype(rows_at(0))::Row;
        for (int l = first; l < last;) {
            const std::ptrdiff_t corner = products.weights.corner[l];
            const auto rows = rows_at(corner);
            const int begin = l;
            if constexpr (Held) {
                decltype(rows.load(0)) sums[lines];
                unroll<lines>([&](auto line) FIRN_LAMBDA { sums[line] = rows.load(line); });
                do {
                    for_rows<Row>(products, l, [&](auto line, const auto&... row) FIRN_LAMBDA {
                        sums[line] = rows.plus(sums[line], row...);
                    });
                } while (++l < last && products.weights.corner[l] == corner);
                unroll<lines>([&](auto line) FIRN_LAMBDA { rows.store(line, sums[line]); });
            } else {
                for_rows<Row>(products, l, [&](auto line, const auto&... row) FIRN_LAMBDA {
                    rows.store(line, rows.plus(rows.load(line), row...));
                });
                ++l;
            }
            count(corner, l - begin);
        }
    }

private:
    /// Calls f(line, record, weight, gradients) for each row of nodes around the particle in lane l. `record` is the
    /// particle's record, moved to the row with OpenRecord::moved(). `weight` and `gradients` are the arguments for
    /// OpenRecord::weighted().
    template <class Row, class Products, class F>
    FIRN_INLINE void for_rows(const Products& products, int l, const F& f) const {
        const auto& weights = products.weights;
        using Number = typename Row::Number;
        const int q = quad_offset<P>(l);
        if constexpr (constant) {
            const OpenRecord<Row, 0, false> same{Row::repeat(value[0] + q) * Row::spread(weights.last + q), {}, {}};
            unroll<lines>([&](auto line) FIRN_LAMBDA {
                f(line, same, Number::fill(&products.product[line][l]), std::array<Number, 0>{});
            });
        } else {
            OpenRecord<Row, D, gradients> record;
            record.value = Row::repeat(value[0] + q);
            unroll<D>([&](auto a) FIRN_LAMBDA {
                record.column[a] = Row::repeat(value[1 + a] + q);
                if constexpr (gradients) record.gradient[a] = Row::repeat(value[1 + D + a] + q);
            });
            Row gradient{};
            if constexpr (gradients) gradient = Row::spread(weights.last_gradient + q);
            const auto row = record.contract(Row::load(row_offsets.data()), Row::spread(weights.last + q), gradient);

            const auto go = [&](auto axis, auto line, const auto& at, const auto& self) FIRN_LAMBDA -> void {
                unroll<K>([&](auto k) FIRN_LAMBDA {
                    constexpr int a = axis;
                    constexpr std::integral_constant<int, line + (D == 3 && a == 0 ? K : 1) * k> to{};
                    const auto there = at.moved(a, std::integral_constant<int, k - centre>{});
                    if constexpr (a > 0) {
                        self(std::integral_constant<int, a - 1>{}, to, there, self);
                    } else {
                        std::array<Number, std::size_t(gradients ? D - 1 : 0)> g;
                        if constexpr (gradients)
                            unroll<D - 1>(
                                [&](auto b) FIRN_LAMBDA { g[b] = Number::fill(&products.gradient_product[to][b][l]); });
                        f(to, there, Number::fill(&products.product[to][l]), g);
                    }
                });
            };
            go(std::integral_constant<int, D - 2>{}, std::integral_constant<int, 0>{}, row, go);
        }
    }

    /// The offset of each node of a row from the centre node, in cells. Each offset is repeated four times.
    alignas(64) static constexpr std::array<S, 16> row_offsets = [] {
        std::array<S, 16> r{};
        for (int i = 0; i < 16; ++i) r[std::size_t(i)] = S(i / 4 - centre);
        return r;
    }();

    FIRN_INLINE static void put(const Vec<P, D>& v, P (&r)[4]) {
        r[2] = r[3] = P(0);
        unroll<D>([&](auto i) FIRN_LAMBDA { r[i] = v.v[i]; });
    }
};

/// The P2G records of the particles of a pack, with the weights of the nodes around the particles.
template <class Kernel, class Force, std::floating_point S, int D>
struct PackRecords {
    using P = native_pack<S>;  ///< Type of a SIMD register with elements of type S.

    PackProducts<Kernel, Force::weight_gradients, S, D> products;  ///< Weights of the nodes.
    PackValues<Kernel, Force, S, D> values;                        ///< The records.

    /// Computes the records and weights of one pack of particles.
    /// \param slot  the first slot of the pack, counted from the group's first slot
    /// \param n     number of nodes along each axis of the arena
    /// \param unit  unit(record) returns the record in the unit of the sums
    template <class Transfer, class Reader, class Places, class Unit>
    FIRN_INLINE void fill(const Reader& reader, const Places& places, std::size_t slot, int n, Unit&& unit) {
        constexpr int lanes = scalar_traits<P>::lanes;
        for (int lane = 0; lane < pack_size; lane += lanes, slot += lanes) {
            const Place<P, D> place = locate<Kernel>(places.template position<P>(slot));
            products.fill(lane, place, places.template block_in_arena<Kernel, P>(slot, n), n);
            values.fill(lane,
                        unit(reader.template record<Kernel, Transfer, Force>(places.slots(slot), place.fraction)));
        }
    }
    /// Adds the contributions of the particles in lanes [first, last). \see PackValues::scatter
    template <bool Held, class RowsAt, class Count>
    FIRN_INLINE void scatter(int first, int last, const RowsAt& rows_at, const Count& count) const {
        values.template scatter<Held>(products, first, last, rows_at, count);
    }
    /// Calls count(corner, 1) for each particle in lanes [first, last), and adds no contributions.
    /// \see PackProducts::count
    template <class Count>
    FIRN_INLINE void count(int first, int last, const Count& count) const {
        products.count(first, last, count);
    }
};

}  // namespace firn::inline FIRN_BUILD
