/// \file The passes of a volumetric policy that filters volume ratios. They come before P2G. \see VolumeFilter
#pragma once

#include <firn/exec/g2p.hpp>
#include <firn/exec/volume_passes.hpp>
#include <firn/stage/volume_filter.hpp>

namespace firn::inline FIRN_BUILD {

/// Memory for filter_volumes(). Pass the same object in every step, so that memory is not allocated again.
template <std::floating_point S>
struct FilterMemory {
    aligned_vector<S> volumes,  ///< Volumes of the particles that take part in the filter; 0 for the others.
        values,                 ///< J − 1 of the particles, then its average around the particle [1].
        averages;               ///< The averages of the averages [1].
    std::vector<aligned_vector<S>> present;  ///< For each set, the present volumes of its particles [m^D].
    std::vector<std::optional<FixedPointScale<S>>> scales;  ///< For each set, the scale of the last fixed-point sums.
    std::optional<FixedPointScale<S>> scale_of_present;     ///< The scale of the last sums of present volumes.
};

namespace detail {

/// Calls body(slots) for each register of particles of a set.
template <class View, class Body>
void for_registers(const ParticleSet<View>& set, int threads, const Body& body) {
    constexpr std::size_t lanes = std::size_t(scalar_traits<native_pack<typename View::scalar_type>>::lanes);
    parallel_for(
        set.partition.slots() / lanes, threads,
        [&](std::size_t k, int) { body(Slots{k * lanes, set.partition.order.data() + k * lanes}); }, 256);
}

/// Averages numbers of the particles of one set at the nodes; the other sets are silent. Afterwards component 0 of
/// every node holds Σ N w a / Σ N w, with the weights N of the particles at the node, and their numbers a (rate) and
/// weights w (volume).
template <class Kernel, class Execution, std::floating_point S, int D, class... Views>
void average_at_nodes(const Execution& execution, SparseGrid<S, D>& grid, const Mirrors& mirrors,
                      std::optional<FixedPointScale<S>>& scale, int threads,
                      const ParticleSet<RateView<Views>>&... sets) {
    std::swap(grid.last_scale, scale);
    p2g<Kernel, RateTransfer, NoForceNoField>(execution, grid, 0.0, sets...);
    std::swap(grid.last_scale, scale);
    mirror_rates(execution, grid, mirrors);
    for_nodes(grid, threads, [](S* node, std::size_t) {
        native_pack<S> r[4];
        load_quads(node, r);
        r[0] = average_rate(r[0], r[node_mass]);
        store_quads(r, node);
    });
}

/// Interpolates component 0 of the nodes to the particles of a set.
template <class Kernel, class View, class Field, std::floating_point S, int D>
void gather_numbers(const ParticleSet<View>& set, const SparseGrid<S, D>& grid, int threads, const Field& number) {
    const Positions<View> positions(grid.domain());
    parallel_for(set.partition.groups.size(), threads, [&](std::size_t g, int) {
        const BlockGroup& group = set.partition.groups[g];
        const GroupPlaces<View> places(set.view, set.partition, group, positions);
        NodesOfGroup<Kernel, S, D, 1> nodes(grid, set.partition, group, places);
        PackPlaces<Kernel, false, S, D> pack;
        PackSums<Kernel, false, false, S, D> sums;
        for (std::size_t slot = 0; slot < group.packs() * pack_size; slot += pack_size) {
            nodes.locate(pack, places, slot);
            nodes.template gather<0>(pack, sums);
            for (int lane = 0; lane < pack_size; lane += scalar_traits<native_pack<S>>::lanes)
                number.store(places.slots(slot + std::size_t(lane)), 0, sums.lanes(lane).velocity.v[0]);
        }
    });
}

}  // namespace detail

/// Filters the volume ratios of the particles of set k, and updates their states and stresses. The numbers of the nodes
/// are overwritten: call this function before p2g().
/// \param memory    memory for the averages; pass the same object in every step
/// \param mirrors   the mirrored walls. \see mirrors_of
/// \param share     b, the share of the null modes that is removed, from 0 to 1
/// \param material  the material of set k
/// \param k         index of the set among `sets`
/// \param sets      all sets on the grid, in the order of p2g()
/// \throws overflow_error  if fixed-point sums could overflow
template <class Kernel, class Execution, std::floating_point S, int D, class Material, class... Views>
void filter_volumes(const Execution& execution, SparseGrid<S, D>& grid, FilterMemory<S>& memory, const Mirrors& mirrors,
                    S share, const Material& material, std::size_t k, const ParticleSet<Views>&... sets) {
    using P = native_pack<S>;
    using Lifted = with_scalar_t<Material, P>;
    using State = material_state_t<Lifted, D>;
    if constexpr (has_volume<State>) {
        const auto lifted = lift<P>(material);
        const int threads = thread_count(requested_threads(execution));
        memory.scales.resize(sizeof...(Views));
        std::size_t i = 0;
        const auto with_arrays = [&]<class View>(const ParticleSet<View>& set) {
            if (i++ != k)
                return ParticleSet<detail::RateView<View>>{{set.view.position, set.view.volume, {}, true},
                                                           set.partition};
            const std::size_t slots = set.partition.slots();
            return ParticleSet<detail::RateView<View>>{
                {set.view.position, detail::numbers_like(set.view, memory.volumes, slots, threads),
                 detail::numbers_like(set.view, memory.values, slots, threads), false},
                set.partition};
        };
        const auto filter = [&]<class View>(const ParticleSet<View>& set, const auto&... all) {
            const std::size_t slots_of_set = set.partition.slots();
            const auto volumes = detail::numbers_like(set.view, memory.volumes, slots_of_set, threads);
            const auto values = detail::numbers_like(set.view, memory.values, slots_of_set, threads);
            const auto averages = detail::numbers_like(set.view, memory.averages, slots_of_set, threads);
            detail::for_registers(set, threads, [&](const Slots& slots) {
                const State state = load_state<State>(set.view.state, slots);
                const P mass = set.view.mass.template load_or_zero<P>(slots, 0);
                const P volume = set.view.volume.template load_or_zero<P>(slots, 0);
                volumes.store(slots, 0, select(mass > P(0), filtered_volume(lifted, state, volume), P(0)));
                values.store(slots, 0, volume_change(state));
            });
            detail::average_at_nodes<Kernel>(execution, grid, mirrors, memory.scales[k], threads, all...);
            detail::gather_numbers<Kernel>(set, grid, threads, values);  // values: A (J - 1)
            detail::average_at_nodes<Kernel>(execution, grid, mirrors, memory.scales[k], threads, all...);
            detail::gather_numbers<Kernel>(set, grid, threads, averages);  // averages: A² (J - 1)
            detail::for_registers(set, threads, [&](const Slots& slots) {
                auto after = filtered_state<D>(lifted, load_state<State>(set.view.state, slots),
                                               load_symmetric<P, D>(set.view.stress, slots),
                                               values.template load<P>(slots, 0), averages.template load<P>(slots, 0),
                                               volumes.template load<P>(slots, 0), P(share));
                store_state(set.view.state, slots, after.state);
                store_symmetric(set.view.stress, slots, after.stress);
            });
        };
        parallel_region(threads, [&] {
            const std::tuple<ParticleSet<detail::RateView<Views>>...> all{with_arrays(sets)...};
            std::size_t number = 0;
            const auto look = [&]<class View>(const ParticleSet<View>& set) {
                if constexpr (std::same_as<typename View::state_type, material_state_t<Material, D>>)
                    if (number == k) std::apply([&](const auto&... each) { filter(set, each...); }, all);
                ++number;
            };
            (look(sets), ...);
        });
    }
}

}  // namespace firn::inline FIRN_BUILD
