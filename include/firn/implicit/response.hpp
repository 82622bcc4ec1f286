/// \file What one particle does in a displacement of the nodes: its state and stress afterwards, and the stress by
/// which nodes feel it. All functions are for any scalar; with dual numbers they give directional derivatives, too.
#pragma once

#include <firn/data/converted_state.hpp>
#include <firn/material/concept.hpp>
#include <firn/math/inverse.hpp>

namespace firn::inline FIRN_BUILD {

/// Whether the stress of a material is the derivative of its energy_density() by F, for a step of any size. Then a step
/// has an incremental potential, and its Hessian is symmetric. Plastic flow, viscosity and a state that the material
/// updates itself exclude that.
template <class Material, int D>
inline constexpr bool has_potential = has_energy_density<Material, D> && !has_returned<Material, D> &&
                                      !has_updated<Material, D> && !has_rate_dependent_stress<Material, D>;

/// Returns a particle's state and Kirchhoff stress τ′ [Pa] after a displacement of the nodes in a time of dt, return
/// mapping included. It is what G2P computes from the velocity gradient ∇u/dt.
/// \param gradient  ∇u [1], the gradient of the displacement u by the positions at the start of the step; its volume
///                  change may be an average. \see FBarOfStep
/// \param dt        time of the step [s]; 1 where time has no meaning
template <class Material, class State, scalar S, int D>
FIRN_INLINE StateAndStress<State, S, D> after_displacement(const Material& material, const State& before,
                                                           const Mat<S, D>& gradient, const S& dt) {
    const Mat<S, D> rate = gradient * (S(1) / dt);
    if constexpr (has_stress_with_state<Material, D>) {
        return updated_with_stress(material, before, rate, dt);
    } else {
        StateAndStress<State, S, D> after;
        after.state = updated(material, before, rate, dt);
        after.stress = stress_of(material, after.state, rate);
        return after;
    }
}

/// Returns the first Piola–Kirchhoff stress of a step, times the particle's volume ratio at its start: τ′ (I + ∇u)⁻ᵀ
/// [Pa]. With the undeformed volume V0 and the gradient wᵢ of a node's weight, V0 τ′ (I + ∇u)⁻ᵀ wᵢ is the derivative of
/// the particle's energy by the node's displacement, and its own derivative is symmetric; V0 τ′ wᵢ is neither.
/// \param gradient  ∇u [1];  \param stress  τ′ [Pa], the Kirchhoff stress after the step
template <scalar S, int D>
FIRN_INLINE Mat<S, D> piola_of_step(const Mat<S, D>& gradient, const Mat<S, D>& stress) {
    return stress * inverse_transposed<S, D>(Mat<S, D>::identity() + gradient);
}

/// Returns det(I + ∇u) [1], by which a step multiplies a particle's volume. \param gradient  ∇u [1]
template <scalar S, int D>
FIRN_INLINE S volume_factor(const Mat<S, D>& gradient) {
    return S(1) + volume_change(DeformationGradient<S, D>::from_displacement(gradient));
}

/// Returns the derivative of piola_of_step() [Pa] along a change of ∇u, the return mapping included.
/// \param material   with the scalar `dual<S>`
/// \param before     the state at the start of the step, with the scalar S
/// \param own        ∇u of the particle, by which nodes move around it, and its change [1]
/// \param of_matter  ∇u that strains the particle's matter, and its change [1]: `own`, but for the average of
///                   FBarOfStep
/// \param dt         time of the step [s]
template <class Material, class State, scalar S, int D>
FIRN_INLINE Mat<S, D> piola_change(const Material& material, const State& before, const Mat<dual<S>, D>& own,
                                   const Mat<dual<S>, D>& of_matter, const S& dt) {
    const auto start = detail::converted_state<material_state_t<Material, D>>(before);
    const auto after = after_displacement(material, start, of_matter, dual<S>(dt));
    const Mat<dual<S>, D> piola = piola_of_step(own, after.stress);
    Mat<S, D> derivative;
    unroll<D * D>([&](auto k) FIRN_LAMBDA { derivative.m[k] = piola.m[k].derivative; });
    return derivative;
}

}  // namespace firn::inline FIRN_BUILD
