/// \file Particles that carry mass and nothing else: the points of cloth and ropes, which springs and membranes join.
#pragma once

#include <firn/material/concept.hpp>

namespace firn {

/// No stress, no state, no waves. What joins the particles is told to the simulation, which also bounds the step by it:
/// \see Simulation::add_force
template <scalar S = float>
struct NoStress {
    static constexpr const char* name = "no_stress";
    static constexpr auto parameters() { return std::tuple<>{}; }

    template <int D>
    struct state {
        static constexpr auto fields() { return std::tuple<>{}; }
    };

    template <int D>
    FIRN_INLINE state<D> updated(const state<D>& same, const Mat<S, D>&, const S&) const {
        return same;
    }
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>&) const {
        return Mat<S, D>::zero();
    }
    template <int D>
    FIRN_INLINE S energy_density(const state<D>&) const {
        return S(0);
    }
    template <int D>
    FIRN_INLINE S wave_speed(const S&, const state<D>&) const {
        return S(0);
    }
};

}  // namespace firn
