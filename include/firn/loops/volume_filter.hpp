/// \file The passes of a volumetric policy that filters volume ratios. They come before P2G. \see VolumeFilter
#pragma once

#include <firn/loops/g2p.hpp>
#include <firn/loops/volume_passes.hpp>
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

/// Interpolates component 0 of the nodes to the particles of a set.
template <class Kernel, class View, class Field, std::floating_point S, int D>
void gather_numbers(const ParticleSet<View>& set, const SparseGrid<S, D>& grid, int threads, const Field& number) {
    gather_to_set<Kernel, false, false>(set, grid, threads,
                                        [&](const Slots& slots, const auto& sums, const auto&)
                                            FIRN_LAMBDA { number.store(slots, 0, sums.velocity.v[0]); });
}

}  // namespace detail

/// Filters the volume ratios of the particles of set k, and updates their states and stresses. The numbers of the nodes
/// are overwritten: call this function before p2g().
/// \param memory    memory for the averages; pass the same object in every step
/// \param mirrors   the mirrored walls. \see mirrors_of
/// \param share     b, the share of the null modes that is removed, from 0 to 1
/// \param material  the material of set k
/// \param set       set k, with the states of its particles
/// \param k         index of the set among `sets`
/// \param sets      all sets on the grid, in the order of p2g()
/// \param time      the present time [s], for a material that asks for its surroundings
/// \throws overflow_error  if fixed-point sums could overflow
template <class Kernel, class Execution, std::floating_point S, int D, class Material, class OfSet, class View>
void filter_volumes(const Execution& execution, SparseGrid<S, D>& grid, FilterMemory<S>& memory, const Mirrors& mirrors,
                    S share, const Material& material, const ParticleSet<OfSet>& set, std::size_t k,
                    ParticleSets<View> sets, double time = 0) {
    using P = native_pack<S>;
    using Lifted = with_scalar_t<Material, P>;
    using State = material_state_t<Lifted, D>;
    if constexpr (has_volume<State>) {
        const auto lifted = lift<P>(material);
        const int threads = detail::threads_of(execution);
        memory.scales.resize(sets.size());
        const detail::surroundings_for<Material, OfSet> around(set.view, set.partition, grid.domain(), time);
        parallel_region(threads, [&] {
            const auto numbers = [&](aligned_vector<S>& of) {
                return detail::numbers_like(set.view, of, set.partition.slots(), threads);
            };
            const auto volumes = numbers(memory.volumes), values = numbers(memory.values),
                       averages = numbers(memory.averages);
            std::vector<ParticleSet<detail::RateView<View>>> all;
            for (const ParticleSet<View>& one : sets)
                if (all.size() == k)
                    all.push_back({{one.view.position, volumes, values, false}, one.partition});
                else
                    all.push_back({{one.view.position, one.view.volume, {}, true}, one.partition});
            const auto average = [&](const auto& to) {
                detail::average_at_nodes<Kernel>(execution, grid, mirrors, memory.scales[k], threads,
                                                 ParticleSets<detail::RateView<View>>(all));
                detail::gather_numbers<Kernel>(sets[k], grid, threads, to);
            };
            detail::for_registers(set, threads, [&](const Slots& slots) {
                const State state = load_state<State>(set.view.state, slots);
                const P mass = set.view.mass.template load_or_zero<P>(slots, 0);
                const P volume = set.view.volume.template load_or_zero<P>(slots, 0);
                volumes.store(
                    slots, 0,
                    select(mass > P(0), filtered_volume(detail::placed_in<D>(lifted, around, slots), state, volume),
                           P(0)));
                values.store(slots, 0, volume_change(state));
            });
            average(values);    // values: A (J - 1)
            average(averages);  // averages: A² (J - 1)
            detail::for_registers(set, threads, [&](const Slots& slots) {
                auto after = filtered_state<D>(
                    detail::placed_in<D>(lifted, around, slots), load_state<State>(set.view.state, slots),
                    load_symmetric<P, D>(set.view.stress, slots), values.template load<P>(slots, 0),
                    averages.template load<P>(slots, 0), volumes.template load<P>(slots, 0), P(share));
                store_state(set.view.state, slots, after.state);
                store_symmetric(set.view.stress, slots, after.stress);
            });
        });
    }
}

}  // namespace firn::inline FIRN_BUILD
