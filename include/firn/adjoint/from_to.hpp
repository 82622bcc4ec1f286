/// \file G2P from the arrays of one store to those of another, so that the state before a step is kept without a copy.
#pragma once

#include <firn/loops/g2p.hpp>

#include <algorithm>
#include <cstddef>

namespace firn::inline FIRN_BUILD::detail {

/// A field that is read from one array and written to another of the same layout.
template <class S>
struct FromToSpan : BlockedSpan<S> {
    BlockedSpan<S> to;  ///< the array that is written

    /// Writes one component of the field for the particles in the slots, one particle per lane.
    template <class P>
    FIRN_INLINE void store(const Slots& slots, int component, const P& value) const {
        to.store(slots, component, value);
    }
};

/// Returns a view that reads the arrays of `from` and writes those of `to`.
template <std::floating_point S, int D, class State>
ParticleView<S, D, FromToSpan<S>, State> from_to(const ParticleView<S, D, BlockedSpan<S>, State>& from,
                                                 const ParticleView<S, D, BlockedSpan<S>, State>& to) {
    using View = ParticleView<S, D, FromToSpan<S>, State>;
    View both{};
    constexpr auto fields = View::built_in();
    constexpr auto plain = ParticleView<S, D, BlockedSpan<S>, State>::built_in();
    for (std::size_t f = 0; f < fields.size(); ++f)
        both.*(fields[f].member) = {from.*(plain[f].member), to.*(plain[f].member)};
    for (std::size_t f = 0; f < both.state.size(); ++f) both.state[f] = {from.state[f], to.state[f]};
    return both;
}

/// Copies the numbers of a field.
template <std::floating_point S>
void copy_field(const BlockedSpan<S>& from, const BlockedSpan<S>& to, std::size_t slots, int threads) {
    const std::size_t count = slots * std::size_t(from.components);
    copy_and_fill(from.data, count, to.data, count, S(0), threads);
}

/// G2P as g2p_pass(), from the arrays of one view to those of another. What G2P does not write is copied.
template <class Kernel, class Transfer, class Force, class Volume, class Material, std::floating_point S, int D,
          class State>
PassReport g2p_from_to(int threads, const ParticleView<S, D, BlockedSpan<S>, State>& from,
                       const ParticleView<S, D, BlockedSpan<S>, State>& to, const BlockPartition<D>& partition,
                       const SparseGrid<S, D>& grid, const Material& material, double dt, const Transfer& transfer) {
    const std::size_t slots = partition.slots();
    copy_field(from.mass, to.mass, slots, threads);
    copy_field(from.volume, to.volume, slots, threads);
    if constexpr (!Transfer::affine) copy_field(from.affine, to.affine, slots, threads);
    return g2p_pass<Kernel, Transfer, Force, Volume>(threads, from_to(from, to), partition, grid, material, dt,
                                                     transfer);
}

/// Copies a set of particles, except the numbers of their fields.
template <class Set>
void copy_without_fields(Set& from, Set& to) {
    FieldMemory of_from = from.particles.exchange_fields({}), of_to = to.particles.exchange_fields({});
    to = from;
    from.particles.exchange_fields(std::move(of_from)), to.particles.exchange_fields(std::move(of_to));
}

/// Gives the fields of a set to another one that is a copy without fields, and their memory to the set; its numbers
/// are then arbitrary.
template <class Set>
void leave_fields(Set& set, Set& to) {
    FieldMemory spare = to.particles.exchange_fields({});
    FieldMemory fields = set.particles.exchange_fields({});
    spare.make_like(fields);
    set.particles.exchange_fields(std::move(spare)), to.particles.exchange_fields(std::move(fields));
}

}  // namespace firn::inline FIRN_BUILD::detail
