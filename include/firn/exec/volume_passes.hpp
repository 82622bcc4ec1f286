/// \file The passes of a volumetric policy that averages rates of volume change, between the grid update and G2P. Their
/// averages ride in the nodes in place of the masses, so G2P gathers them at no cost. A step is
///
///     …                                                                 // as without the policy, up to grid_update()
///     average_volume<Kernel, Transfer, Force>(execution, grid, memory, mirrors, k, sets...);      // for each set k
///     g2p<Kernel, Transfer, Force, Volume>(execution, view, partition, grid, material, dt, transfer);
///     restore_masses<Transfer>(execution, grid);
#pragma once

#include <firn/data/particle_set.hpp>
#include <firn/exec/gather.hpp>
#include <firn/exec/mirror.hpp>
#include <firn/exec/p2g.hpp>
#include <firn/exec/transfer_passes.hpp>
#include <firn/force/none.hpp>
#include <firn/stage/volume.hpp>
#include <firn/volumetric/concept.hpp>

#include <optional>
#include <vector>

namespace firn {

/// Memory for average_volume(). Pass the same object in every step: fixed-point sums then try the right scale first.
template <std::floating_point S>
struct VolumeMemory {
    std::vector<std::optional<FixedPointScale<S>>> scales;  ///< For each set, the scale of the last fixed-point sums.
};

namespace detail {

/// Layer of the grid that holds the velocities while rates are summed. FLIP uses layer 1.
template <class Transfer>
inline constexpr int volume_layer = blends_velocities<Transfer> ? 2 : 1;

/// The arrays of a set of particles that the scatter of rates of volume change reads, and the grid with the velocities.
template <class View>
struct RateView {
    using scalar_type = typename View::scalar_type;
    static constexpr int dimension = View::dimension;

    decltype(View::position) position, volume;
    const SparseGrid<scalar_type, dimension>& grid;
    const BlockPartition<dimension>& partition;
    bool is_silent;  ///< true if the particles contribute nothing: those of the sets that are not averaged now
};

/// The transfer of the scatter of rates. Particles carry no affine field, and the scales that a program gives for
/// momentum and mass do not apply.
/// \tparam Gradient  whether the rate is Σ v·∇N; otherwise it is the trace of the affine field C
/// \tparam Layer     layer of the grid that holds the velocities
template <bool Gradient, int Layer>
struct RateTransfer {
    static constexpr bool affine = false, ignores_given_scales = true, gradient = Gradient;
    static constexpr int layer = Layer;
};
/// The force form of the scatter of rates: records have neither a matrix A nor a matrix G.
struct RateForce : NoForce {
    static constexpr bool constant_records = true;
};

/// The records of a pack of particles for the scatter of rates. The rates are gathered here, so that the gather and the
/// scatter share the weights, and no rate goes through memory.
///
/// θ is the sum of v_a G_a over the nodes and the axes a. G_a is the product of the weights along all axes, with
/// another factor along the axis a: the kernel's gradient; or, for the trace of C, the weight times the distance from
/// the particle. In a row of nodes along the last axis, only this axis tells the nodes apart. So the rows are summed
/// first, each multiplied by the factors of the other axes.
template <class Kernel, bool Gradient, std::floating_point S, int D>
struct RateRecords : PackRecords<Kernel, RateForce, S, D> {
    using Records = PackRecords<Kernel, RateForce, S, D>;
    using P = native_pack<S>;
    static constexpr int K = Records::K, lines = Records::lines;

    alignas(64) S leading[lines][pack_size * 4];  ///< for each row: the factors of the leading axes in G_0, G_1, …
    alignas(64) S along[K][pack_size * 4];  ///< for each node of a row: the factor of the last axis in G_0, G_1, …
    alignas(64) S sum[pack_size * 4];       ///< v_0 G_0, v_1 G_1, …, summed over all nodes
    /// Base nodes in the arena from which velocities are gathered.
    struct {
        struct {
            alignas(64) typename P::integer corner[pack_size];
        } weights;
    } gathered;

    /// Computes the weights and records of one pack of particles.
    /// \param nodes  the velocities around the group
    /// \param of_gather  number of nodes along each axis of the arena from which velocities are gathered
    template <class Nodes, class Field, class Places, class Unit>
    FIRN_INLINE void fill(const Nodes& nodes, int of_gather, const Field& volume, const S& h, const Places& places,
                          std::size_t slot, int n, Unit&& unit) {
        constexpr int lanes = scalar_traits<P>::lanes;
        for (int lane = 0; lane < pack_size; lane += lanes) {
            const std::size_t at = slot + std::size_t(lane);
            const Place<P, D> place = locate<Kernel>(places.template position<P>(at));
            this->weights.fill(lane, place, places.template block_in_arena<Kernel, P>(at, n), n);
            first_number(place.node + places.template block_in_arena<Kernel, P>(at, of_gather), of_gather)
                .store(gathered.weights.corner + lane);
            fill_factors(lane, place.fraction);
        }
        nodes.template gather<0>(gathered, *this, places, slot);
        const P scale = Gradient ? P(1) / P(h) : inverse_inertia<Kernel>(P(h)) * P(h);
        for (int lane = 0; lane < pack_size; lane += lanes) {
            P r[4];
            load_quads(sum + lane * 4, r);
            P rate = r[0];
            unroll<D - 1>([&](auto a) FIRN_LAMBDA { rate = rate + r[a + 1]; });
            const P2GRecord<P, D> record = unit(volume_record<D>(
                rate * scale, volume.template load_or_zero<P>(places.slots(slot + std::size_t(lane)), 0)));
            r[0] = record.momentum.v[0];
            r[1] = r[2] = P(0);
            r[node_mass] = record.mass;
            store_quads(r, this->value[0] + lane * 4);
        }
    }

    /// Computes `sum`. \see PackSums::gather
    template <class Weights, class RowOfLine>
    FIRN_INLINE void gather(const Weights&, const RowOfLine& row_of_line) {
        using Row = std::remove_cvref_t<decltype(row_of_line(0, std::integral_constant<int, 0>{}))>;
        using Factor = typename Row::Number;
        constexpr int abreast = rows_abreast<Row>;
        for (int l = 0; l < pack_size / abreast; ++l) {
            std::array<Row, std::size_t(abreast)> rows;
            unroll<abreast>([&](auto i) FIRN_LAMBDA {
                const int lane = l + i * (pack_size / abreast), q = quad_offset<P>(lane);
                rows[i] = row_of_line(lane, std::integral_constant<int, 0>{}) * Factor::repeat(leading[0] + q);
                unroll<lines - 1>([&](auto line) FIRN_LAMBDA {
                    constexpr std::integral_constant<int, line + 1> next{};
                    rows[i] = plus_times(rows[i], row_of_line(lane, next), Factor::repeat(leading[next] + q));
                });
            });
            const auto of_nodes = nodes_of_rows(rows);
            using Number = typename decltype(of_nodes)::value_type;
            const int q = quad_offset<P>(l);
            auto all = of_nodes[0] * Number::load(along[0] + q);
            unroll<K - 1>([&](auto k)
                              FIRN_LAMBDA { all = plus_times(all, of_nodes[k + 1], Number::load(along[k + 1] + q)); });
            all.store(sum + q);
        }
    }

private:
    /// Computes `leading`, `along` and the products of weights for one register of particles.
    FIRN_INLINE void fill_factors(int lane, const Vec<P, D>& fraction) {
        std::array<std::array<P, std::size_t(K)>, std::size_t(D)> w, g;
        unroll<D>([&](auto a) FIRN_LAMBDA {
            w[a] = Kernel::weights(fraction.v[a]);
            if constexpr (Gradient)
                g[a] = Kernel::gradients(fraction.v[a]);
            else
                unroll<K>([&](auto k) FIRN_LAMBDA { g[a][k] = w[a][k] * (P(S(int(k))) - fraction.v[a]); });
        });
        P r[4] = {P(0), P(0), P(0), P(0)};
        unroll<K>([&](auto k) FIRN_LAMBDA {
            unroll<D - 1>([&](auto a) FIRN_LAMBDA { r[a] = w[D - 1][k]; });
            r[D - 1] = g[D - 1][k];
            store_quads(r, along[k] + lane * 4);
        });
        unroll<lines>([&](auto line) FIRN_LAMBDA {
            if constexpr (D == 2) {
                r[0] = g[0][line];
                r[1] = w[0][line];
            } else {
                r[0] = g[0][line / K] * w[1][line % K];
                r[1] = w[0][line / K] * g[1][line % K];
                r[2] = w[0][line / K] * w[1][line % K];
            }
            r[D - 1].store(this->product[line] + lane);
            store_quads(r, leading[line] + lane * 4);
        });
    }
};

/// Calls body(records, slot, used) for every pack of the group, as the other for_packs() does, with the records of
/// rates of volume change.
template <class Kernel, class Transfer, class Force, class View, class Sums, class Body>
FIRN_INLINE void for_packs(const ParticleReader<RateView<View>>& reader, const GroupPlaces<RateView<View>>& places,
                           const BlockGroup& group, int n, Sums& sums, const Body& body) {
    using S = typename View::scalar_type;
    constexpr int D = View::dimension;
    const RateView<View>& view = reader.view();
    const NodesOfGroup<Kernel, S, D, 1, Transfer::layer> nodes(view.grid, view.partition, group, places);
    RateRecords<Kernel, Transfer::gradient, S, D> records;
    const S h = S(view.grid.domain().cell_size);
    for (std::size_t slot = 0; slot < group.particles; slot += pack_size) {
        view.position.template prefetch<D>(group.first_slot + slot + pack_size);
        view.volume.template prefetch<1>(group.first_slot + slot + pack_size);
        records.fill(nodes, nodes.nodes_along_axis(), view.volume, h, places, slot, n, sums);
        body(records, slot, int(std::min<std::size_t>(pack_size, group.particles - slot)));
    }
}

/// Adds the sums of the nodes behind mirrored walls to those of their mirror images, and gives both the result: the
/// rate of volume change has the same sign on both sides of a wall.
template <class Execution, std::floating_point S, int D>
void mirror_rates(const Execution& execution, SparseGrid<S, D>& grid, const Mirrors& mirrors) {
    const int threads = thread_count(requested_threads(execution));
    using P = native_pack<S>;
    for (const MirrorPlane& plane : mirrors.planes)
        parallel_for(
            grid.block_count(), threads,
            [&](std::size_t b, int) {
                if (grid.block_along(b, plane.axis) != plane.node >> 2) return;
                BlockColumns<S, D>(grid, plane, b).change([](NodeColumn<P, D> column) {
                    column.front = column.behind = column.front + column.behind;
                    column.mass_front = column.mass_behind = column.mass_front + column.mass_behind;
                    return column;
                });
            },
            64);
}

}  // namespace detail

/// Gives the scatter of rates of volume change access to the particles of a set.
template <class View>
class ParticleReader<detail::RateView<View>> {
public:
    /// Makes a reader of the particles of `view`, which must exist as long as the reader.
    ParticleReader(const detail::RateView<View>& view, const Domain<View::dimension>&, double) : view_(view) {}
    const detail::RateView<View>& view() const { return view_; }  ///< The particles' arrays.

private:
    const detail::RateView<View>& view_;
};

/// Averages the rates of volume change of the particles of set k, and puts the average of each node in place of its
/// mass. The node velocities are kept. Call restore_masses() after the G2P of this set. Overwrites one layer of the
/// grid that the transfer does not use.
/// \param memory   pass the same object in every step
/// \param mirrors  the mirrored walls. \see mirrors_of
/// \param k        index of the set among `sets`
/// \param sets     all sets on the grid, in the order of p2g()
/// \throws overflow_error  if fixed-point sums could overflow
template <class Kernel, class Transfer, class Force, class Execution, std::floating_point S, int D, class... Views>
void average_volume(const Execution& execution, SparseGrid<S, D>& grid, VolumeMemory<S>& memory, const Mirrors& mirrors,
                    std::size_t k, const ParticleSet<Views>&... sets) {
    constexpr int layer = detail::volume_layer<Transfer>;
    const int threads = thread_count(requested_threads(execution));
    memory.scales.resize(sizeof...(Views));
    parallel_region(threads, [&] {
        std::size_t i = 0;
        const auto rated = [&]<class View>(const ParticleSet<View>& set) {
            return ParticleSet<detail::RateView<View>>{
                {set.view.position, set.view.volume, grid, set.partition, i++ != k}, set.partition};
        };
        const std::tuple<ParticleSet<detail::RateView<Views>>...> all{rated(sets)...};
        using Rates = detail::RateTransfer<g2p_needs_gradient<Kernel, Transfer, Force>, layer>;
        grid.exchange(layer, threads);  // the layer then holds the velocities and masses
        std::swap(grid.last_scale, memory.scales[k]);
        std::apply([&](const auto&... set) { p2g<Kernel, Rates, detail::RateForce>(execution, grid, 0.0, set...); },
                   all);
        std::swap(grid.last_scale, memory.scales[k]);
        detail::mirror_rates(execution, grid, mirrors);
        grid.exchange(layer, threads);
        using P = native_pack<S>;
        detail::for_nodes(grid, threads, [sums = grid.layer(layer)](S* node, std::size_t index) {
            P r[4], of_sums[4];
            load_quads(node, r);
            load_quads(sums + index, of_sums);
            const P mass = r[node_mass];
            r[node_mass] = average_rate(of_sums[0], of_sums[node_mass]);
            of_sums[0] = mass;
            store_quads(r, node);
            store_quads(of_sums, sums + index);
        });
    });
}

/// Puts the masses back into the nodes, after average_volume() and G2P.
template <class Transfer, class Execution, std::floating_point S, int D>
void restore_masses(const Execution& execution, SparseGrid<S, D>& grid) {
    const int threads = thread_count(requested_threads(execution));
    using P = native_pack<S>;
    detail::for_nodes(grid, threads, [kept = grid.layer(detail::volume_layer<Transfer>)](S* node, std::size_t index) {
        P r[4], of_kept[4];
        load_quads(node, r);
        load_quads(kept + index, of_kept);
        r[node_mass] = of_kept[0];
        store_quads(r, node);
    });
}

}  // namespace firn
