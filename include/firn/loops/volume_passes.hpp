/// \file The passes of a volumetric policy that averages rates of volume change, between the grid update and G2P. Their
/// averages ride in the nodes in place of the masses, so G2P gathers them at no cost. A step is
///
///     …                                                                 // as without the policy, up to grid_update()
///     average_volume<Kernel, Transfer, Force>(execution, grid, memory, mirrors, k, sets...);      // for each set k
///     g2p<Kernel, Transfer, Force, Volume>(execution, view, partition, grid, material, dt, transfer);
///     restore_masses<Transfer>(execution, grid);
#pragma once

#include <firn/data/particle_set.hpp>
#include <firn/force/none.hpp>
#include <firn/loops/gather.hpp>
#include <firn/loops/mirror.hpp>
#include <firn/loops/p2g.hpp>
#include <firn/loops/transfer_passes.hpp>
#include <firn/stage/volume.hpp>
#include <firn/volumetric/own_volume.hpp>

#include <optional>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Memory for average_volume(). Pass the same object in every step, so that memory is not allocated again.
template <std::floating_point S>
struct VolumeMemory {
    aligned_vector<S> rates;  ///< Rates of volume change of the particles of one set [1/s].
    std::vector<std::optional<FixedPointScale<S>>> scales;  ///< For each set, the scale of the last fixed-point sums.
};

namespace detail {

/// The arrays of a set of particles that the scatter of rates of volume change reads.
template <class View>
struct RateView {
    using scalar_type = typename View::scalar_type;
    static constexpr int dimension = View::dimension;
    using Field = decltype(View::position);

    Field position, volume;
    Field rate;      ///< rate of volume change [1/s]
    bool is_silent;  ///< true if the particles contribute nothing: those of the sets that are not averaged now
};

/// The transfer of the scatter of rates: particles carry no affine field, and scales that a program gives for momentum
/// and mass do not apply.
struct RateTransfer {
    static constexpr bool affine = false, ignores_given_scales = true;
};

/// Returns a span of one number for each slot of a set, in `memory`. Enlarges `memory` if it is too small.
template <class View>
auto numbers_like(const View&, aligned_vector<typename View::scalar_type>& memory, std::size_t slots, int workers) {
    using S = typename View::scalar_type;
    if (memory.size() < slots) renew(memory, slots, workers);
    if constexpr (Positions<View>::in_cells)
        return BlockedSpan<S>{memory.data(), 1};
    else
        return StridedSpan<S>{memory.data(), 1, {}};
}

/// Returns the field of rates of plastic volume change of a view, if the state of its material has one.
/// \see tells_plastic_volume
template <class View>
auto plastic_volume_rates(const View& view) {
    std::optional<std::remove_cvref_t<decltype(view.position)>> rates;
    using State = typename View::state_type;
    if constexpr (tells_plastic_volume<State>) rates = view.state[field_of(&State::plastic_volume_rate)];
    return rates;
}

/// Writes the rate of volume change of every particle of a set to `rate`, as Volume averages it.
/// \param plastic  the rates of plastic volume change [1/s], which are left out, or nothing
template <class Kernel, class Transfer, class Force, class Volume, class View, class Field, std::floating_point S,
          int D>
void gather_rates(const ParticleSet<View>& set, const SparseGrid<S, D>& grid, int threads, double dt, const Field& rate,
                  const std::optional<Field>& plastic) {
    const native_pack<S> h(S(grid.domain().cell_size)), step{S(dt)};
    constexpr bool moments = g2p_needs_moment<Kernel, Transfer, Force>;
    gather_to_set<Kernel, moments, g2p_needs_gradient<Kernel, Transfer, Force>>(
        set, grid, threads, [&](const Slots& slots, const auto& sums, const auto& offset) FIRN_LAMBDA {
            const auto own = take_from_grid<Kernel, Transfer, Force>(sums, offset, h).velocity_gradient;
            auto averaged = rate_to_average<Volume>(own, step);
            if (plastic) {
                using P = native_pack<S>;
                const auto real = set.view.volume.template load_or_zero<P>(slots, 0) > P(0);
                averaged = averaged - select(real, plastic->template load<P>(slots, 0), P(0));
            }
            rate.store(slots, 0, averaged);
        });
}

/// Adds the sums of the nodes behind mirrored walls to those of their mirror images, and gives both the result: the
/// rate of volume change has the same sign on both sides of a wall. The map is its own transpose.
template <std::floating_point S, int D>
void mirror_rates(int threads, SparseGrid<S, D>& grid, const Mirrors& mirrors) {
    using P = native_pack<S>;
    for (const MirrorPlane& plane : mirrors.planes)
        parallel_for(
            grid.block_count(), threads,
            [&](std::size_t b, int) {
                if (grid.block_along(b, plane.axis) != plane.node >> 2) return;
                BlockColumns<S, D> columns(grid, plane, b);
                for (int first = 0; first < BlockColumns<S, D>::padded; first += scalar_traits<P>::lanes) {
                    NodeColumn<P, D> column = columns.column(first);
                    column.front = column.behind = column.front + column.behind;
                    column.mass_front = column.mass_behind = column.mass_front + column.mass_behind;
                    columns.set(first, column);
                }
                columns.write();
            },
            64);
}

/// Does the work of restore_masses().
template <class Transfer, std::floating_point S, int D>
void put_back_masses(int threads, SparseGrid<S, D>& grid) {
    using P = native_pack<S>;
    for_nodes(grid, threads, [kept = grid.layer(layer::of_volumes<Transfer>)](S* node, std::size_t index) {
        P r[4], of_kept[4];
        load_quads(node, r);
        load_quads(kept + index, of_kept);
        r[node_mass] = of_kept[0];
        store_quads(r, node);
    });
}

}  // namespace detail

/// Reads the particles of a set for the scatter of their volumes and, if the view has them, of their rates of volume
/// change: what they scatter is no momentum, so the view has no velocities.
template <class View>
    requires(!requires(const View& view) { view.velocity; })
class ParticleReader<View> {
public:
    using S = typename View::scalar_type;      ///< The scalar type: float or double.
    static constexpr int D = View::dimension;  ///< The dimension: 2 or 3.

    /// Makes a reader of the particles of `view`, which must exist as long as the reader.
    ParticleReader(const View& view, const Domain<D>&, double) : view_(view) {}
    /// Returns the records of one register of particles. \see volume_record
    template <class Kernel, class Transfer, class Force, class P>
    FIRN_INLINE P2GRecord<P, D> record(const Slots& slots, const Vec<P, D>&) const {
        P rate = P(S(0));
        if constexpr (has_rates) rate = view_.rate.template load_or_zero<P>(slots, 0);
        return volume_record<D>(rate, view_.volume.template load_or_zero<P>(slots, 0));
    }
    /// Prefetches into the cache all values that record() reads, for the pack that begins at `slot`.
    template <class Transfer>
    FIRN_INLINE void prefetch(std::size_t slot) const {
        view_.position.template prefetch<D>(slot);
        view_.volume.template prefetch<1>(slot);
        if constexpr (has_rates) view_.rate.template prefetch<1>(slot);
    }

private:
    static constexpr bool has_rates = requires(const View& view) { view.rate; };

    const View& view_;
};

namespace detail {

/// Sums numbers of the particles of one set at the nodes; the other sets are silent. Afterwards every node holds Σ N w
/// a as component 0 and Σ N w as its mass, with the weights N of the particles at the node, and their numbers a (rate)
/// and weights w (volume).
/// \param scale  the scale of the last fixed-point sums of this set
template <class Kernel, class Execution, std::floating_point S, int D, class View>
void sum_at_nodes(const Execution& execution, SparseGrid<S, D>& grid, const Mirrors& mirrors,
                  std::optional<FixedPointScale<S>>& scale, int threads, ParticleSets<RateView<View>> sets) {
    std::swap(grid.last_scale, scale);
    p2g<Kernel, RateTransfer, NoForceNoField>(execution, grid, 0.0, sets);
    std::swap(grid.last_scale, scale);
    mirror_rates(threads, grid, mirrors);
}
/// As sum_at_nodes(), but component 0 is then the average Σ N w a / Σ N w.
template <class Kernel, class Execution, std::floating_point S, int D, class View>
void average_at_nodes(const Execution& execution, SparseGrid<S, D>& grid, const Mirrors& mirrors,
                      std::optional<FixedPointScale<S>>& scale, int threads, ParticleSets<RateView<View>> sets) {
    sum_at_nodes<Kernel>(execution, grid, mirrors, scale, threads, sets);
    for_nodes(grid, threads, [](S* node, std::size_t) {
        native_pack<S> r[4];
        load_quads(node, r);
        r[0] = average_rate(r[0], r[node_mass]);
        store_quads(r, node);
    });
}

}  // namespace detail

/// Averages the rates of volume change of the particles of set k, and puts the average of each node in place of its
/// mass. The node velocities are kept. Call restore_masses() after the G2P of this set. Overwrites one layer of the
/// grid that the transfer does not use.
/// \param memory   memory for rates; pass the same object in every step
/// \param mirrors  the mirrored walls. \see mirrors_of
/// \param k        index of the set among `sets`
/// \param sets     all sets on the grid, in the order of p2g()
/// \param dt       time of the step [s], for a policy that averages what a whole step changes. \see has_averaged_step
/// \param plastic  the rates of plastic volume change of set k [1/s], which are not averaged; nothing if its material
///                 does not tell them. \see PlasticVolume
/// \tparam Volume  the volumetric policy
/// \throws overflow_error  if fixed-point sums could overflow
template <class Kernel, class Transfer, class Force, class Volume = OwnVolume, class Execution, std::floating_point S,
          int D, class View>
void average_volume(const Execution& execution, SparseGrid<S, D>& grid, VolumeMemory<S>& memory, const Mirrors& mirrors,
                    std::size_t k, ParticleSets<View> sets, double dt = 0,
                    const std::optional<std::remove_cvref_t<decltype(std::declval<View>().position)>>& plastic = {}) {
    constexpr std::size_t of_volumes = layer::of_volumes<Transfer>;
    const int threads = detail::threads_of(execution);
    memory.scales.resize(sets.size());
    parallel_region(threads, [&] {
        const auto rate = detail::numbers_like(sets[k].view, memory.rates, sets[k].partition.slots(), threads);
        detail::gather_rates<Kernel, Transfer, Force, Volume>(sets[k], grid, threads, dt, rate, plastic);
        std::vector<ParticleSet<detail::RateView<View>>> all;
        for (const ParticleSet<View>& set : sets)
            all.push_back({{set.view.position, set.view.volume, rate, all.size() != k}, set.partition});
        grid.exchange(of_volumes, threads);  // the layer then holds the velocities and masses
        detail::sum_at_nodes<Kernel>(execution, grid, mirrors, memory.scales[k], threads,
                                     ParticleSets<detail::RateView<View>>(all));
        grid.exchange(of_volumes, threads);
        using P = native_pack<S>;
        detail::for_nodes(grid, threads, [sums = grid.layer(of_volumes)](S* node, std::size_t index) {
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

/// As average_volume() with all sets, for sets given one by one.
template <class Kernel, class Transfer, class Force, class Execution, std::floating_point S, int D, class... Views>
void average_volume(const Execution& execution, SparseGrid<S, D>& grid, VolumeMemory<S>& memory, const Mirrors& mirrors,
                    std::size_t k, const ParticleSet<Views>&... sets) {
    detail::with_sets(
        [&](auto all) {
            decltype(detail::plastic_volume_rates(all[0].view)) plastic;
            std::size_t i = 0;
            ((plastic = i++ == k ? detail::plastic_volume_rates(sets.view) : plastic), ...);
            average_volume<Kernel, Transfer, Force>(execution, grid, memory, mirrors, k, all, 0, plastic);
        },
        sets...);
}

/// Puts the masses back into the nodes, after average_volume() and G2P.
template <class Transfer, class Execution, std::floating_point S, int D>
void restore_masses(const Execution& execution, SparseGrid<S, D>& grid) {
    detail::put_back_masses<Transfer>(detail::threads_of(execution), grid);
}

}  // namespace firn::inline FIRN_BUILD
