/// \file What a material may ask for beside its state: where and when a particle is.
#pragma once

#include <firn/material/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// Where and when a particle is, for a material that asks for it.
///
/// In a step, these are the values at its start. For stresses that are computed before the first step, or after states
/// were set, the velocity is the particle's own.
///
/// A program for a GPU tells the same numbers. It keeps the time as a sum of steps in two floats, and a Simulation on a
/// GPU sets it at the start of each call. If steps are floats, as FixedPoint::float_steps chooses them, the time has
/// the CPU's bits but where a sum lies within 2^-48 of the middle of two floats. Of other fixed steps it is the sum of
/// the nearest floats since the last call.
template <scalar S, int D>
struct Surroundings {
    Vec<S, D> position;  ///< position x of the particle [m]
    Vec<S, D> velocity;  ///< velocity of the nodes around it, Σ N v [m/s], before a transfer blends it
    S cell_size;         ///< cell size h [m]
    S time;              ///< time t [s]
    S density;           ///< density of the undeformed material, mass over initial volume [kg/m³]
};

/// Returns the surroundings in three dimensions of a particle in the plane z = 0.
template <scalar S>
FIRN_INLINE Surroundings<S, 3> in_space(const Surroundings<S, 2>& here) {
    return {{here.position[0], here.position[1], S(0)},
            {here.velocity[0], here.velocity[1], S(0)},
            here.cell_size,
            here.time,
            here.density};
}

/// Returns surroundings with another scalar T. \see lift
template <scalar T, scalar S, int D>
FIRN_INLINE Surroundings<T, D> lift_surroundings(const Surroundings<S, D>& here) {
    if constexpr (std::same_as<T, S>)
        return here;
    else
        return {cast<T>(here.position), cast<T>(here.velocity), T(here.cell_size), T(here.time), T(here.density)};
}

/// Whether a material asks for the surroundings of a particle: it has a function `at(surroundings)`. The function
/// returns the material itself with other parameters, with which firn updates this particle, and computes its stress,
/// its energy and its wave speed. Of a PerParticle material, the parameters that particles have of their own replace
/// those that at() has set.
template <class M, int D>
concept asks_surroundings = requires(const M m, const Surroundings<material_scalar_t<M>, D> here) { m.at(here); };

/// Returns the material for one particle: material.at(surroundings()) if the material asks, else the material itself.
/// \param surroundings  a function object that returns the Surroundings; not called for a material that does not ask
template <int D, class M, class Function>
FIRN_INLINE decltype(auto) placed(const M& material, [[maybe_unused]] const Function& surroundings) {
    if constexpr (asks_surroundings<M, D>) {
        static_assert(std::same_as<std::remove_cvref_t<decltype(material.at(surroundings()))>, M>,
                      "firn: at(surroundings) of a material returns a material of the same type. One that inherits "
                      "from a material that asks needs a function at() of its own.");
        return material.at(surroundings());
    } else {
        return (material);
    }
}

namespace detail {
/// Returns a wrapper of a model with the model that is given.
template <class Model, class Wrapper>
FIRN_INLINE Wrapper around_model(Wrapper wrapper, const Model& model) {
    static_cast<Model&>(wrapper) = model;
    return wrapper;
}
}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
