/// \file The filter of volume ratios: what it does to one particle. \see VolumeFilter
#pragma once

#include <firn/material/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// Whether a material's state contains a volume ratio J [1].
template <class State>
inline constexpr bool has_volume_ratio = requires(State state) { state.J; };
/// Whether a material's state contains a volume ratio J or a deformation gradient F, whose determinant is J.
template <class State>
inline constexpr bool has_volume = has_volume_ratio<State> || requires(State state) { state.F; };

namespace detail {
template <scalar S>
FIRN_INLINE S excess_of_ratio(const S& J) {
    return J - S(1);
}
template <class S>
FIRN_INLINE S excess_of_ratio(const VolumeRatio<S>& J) {
    return J.excess;
}
}  // namespace detail

/// Returns the relative change of the volume of a particle, J − 1, from the state of its material [1].
template <class State>
    requires has_volume<State>
FIRN_INLINE auto volume_change(const State& state) {
    if constexpr (has_volume_ratio<State>)
        return detail::excess_of_ratio(state.J);
    else
        return volume_change(state.F);
}

/// Returns the present volume J V0 of a particle [m^D], from its initial volume V0.
template <class State, scalar S>
FIRN_INLINE S present_volume(const State& state, const S& volume) {
    return volume + volume * volume_change(state);
}

/// Returns the part of a particle in the filter of volume ratios: its initial volume V0; 0 if its volume has changed
/// without elastic stress, as that of spray.
template <class Material, class State, scalar S>
FIRN_INLINE S filtered_volume(const Material& material, const State& state, const S& volume) {
    const S pressure = trace(kirchhoff_stress(material, state)), change = volume_change(state);
    return select((pressure == S(0)) & !(change == S(0)), S(0), volume);
}

/// Returns a state whose volume ratio J is greater by `change` [1], up to terms of the order change². J at most doubles
/// or halves. The return mapping of the material, if it has one, follows.
template <int D, class Material, class State, scalar S>
FIRN_INLINE State with_volume_change(const Material& material, State state, const S& change) {
    const S J = volume_change(state) + S(1);
    const S ratio = max(min(change / max(J, S(1e-3)), S(1)), S(-0.5));
    if constexpr (has_volume_ratio<State>) {
        state.J += J * ratio;
        return state;
    } else {
        if constexpr (constexpr int N = dimension_of<decltype(state.F)>; N == D) {
            const Mat<S, D>& F = state.F;
            state.F = increased(state.F, F * (ratio * S(1.0 / D)));
        } else {  // in the plane only
            const Mat<S, N>& F = state.F;
            state.F = increased(state.F, detail::in_space(Mat<S, D>::diagonal(ratio * S(1.0 / D))) * F);
        }
        if constexpr (requires { material.returned_with_stress(state); })
            return detail::with_returned(state, material.returned_with_stress(state).state);
        else
            return returned_by(material, state);
    }
}

/// Returns how much a pass of the filter changes J: −b (1 − A)² (J − 1) [1].
/// \param own    J − 1 of the particle
/// \param once   A (J − 1): the average of J − 1 around the particle
/// \param twice  A² (J − 1): the average of the averages
/// \param share  b, from 0 to 1
template <scalar S>
FIRN_INLINE S filtered_change(const S& own, const S& once, const S& twice, const S& share) {
    return (once - own + (once - twice)) * share;
}

/// A particle after a pass of the filter.
template <class State, class S, int D>
struct FilteredState {
    State state;       ///< the state of the material
    Mat<S, D> stress;  ///< the Kirchhoff stress τ [Pa]
};

/// Returns the state and the stress of a particle after a pass of the filter. Only the elastic part of the stress
/// changes; a viscous part stays.
/// \param stress  Kirchhoff stress τ before [Pa];  \param volume  \see filtered_volume
/// \param once, twice, share  \see filtered_change
template <int D, class Material, class State, scalar S>
FIRN_INLINE FilteredState<State, S, D> filtered_state(const Material& material, const State& state,
                                                      const Mat<S, D>& stress, const S& once, const S& twice,
                                                      const S& volume, const S& share) {
    const S change = select(volume > S(0), filtered_change(volume_change(state), once, twice, share), S(0));
    const State after = with_volume_change<D>(material, state, change);
    if constexpr (has_rate_dependent_stress<Material, D>)
        return {after, stress + (kirchhoff_stress(material, after) - kirchhoff_stress(material, state))};
    else
        return {after, kirchhoff_stress(material, after)};
}

}  // namespace firn::inline FIRN_BUILD
