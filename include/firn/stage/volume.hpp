/// \file The average of the rates of volume change: what one particle and one node do. \see FBar
#pragma once

#include <firn/stage/p2g.hpp>

#include <limits>

namespace firn::inline FIRN_BUILD {

/// Whether a material's state tells at which rate plastic flow changed the volume in the last step, in a member
/// `plastic_volume_rate` [1/s]. A policy that averages rates of volume change then averages the elastic rest only.
/// \see PlasticVolume
template <class State>
inline constexpr bool tells_plastic_volume = requires(State state) { state.plastic_volume_rate; };

/// Returns what a particle adds to nodes for the average of the rates of volume change. A node with weight N receives
/// N V0 θ as component 0 of its momentum, and N V0 as its mass.
/// \param rate    the particle's rate of volume change θ = tr ∇v [1/s]
/// \param volume  the particle's initial volume V0 [m^D]
template <int D, scalar S>
FIRN_INLINE P2GRecord<S, D> volume_record(const S& rate, const S& volume) {
    P2GRecord<S, D> record{volume, Vec<S, D>::zero(), Mat<S, D>::zero(), Mat<S, D>::zero()};
    record.momentum.v[0] = rate * volume;
    return record;
}

/// Returns the average rate of volume change at a node [1/s]: Σ N V0 θ / Σ N V0. The average is zero for a node without
/// volume, and for a node whose volume is below the smallest normal floating-point number.
/// \param rates   Σ N V0 θ [m^D/s];  \param volume  Σ N V0 [m^D]
template <scalar S>
FIRN_INLINE S average_rate(const S& rates, const S& volume) {
    const auto filled = volume >= S(std::numeric_limits<value_type_t<S>>::min());
    return select(filled, rates / select(filled, volume, S(1)), S(0));
}

}  // namespace firn::inline FIRN_BUILD
