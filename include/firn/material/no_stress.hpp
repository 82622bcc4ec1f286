/// \file A material without stress: particles that only carry mass.
#pragma once

#include <firn/material/concept.hpp>

namespace firn::inline FIRN_BUILD {

/// Particles that carry mass and nothing else: no stress, no state, no waves.
///
/// Use NoStress for the points of cloth and ropes. Add springs and membranes between the points to the simulation. The
/// stiffness of these springs and membranes then limits the time step, too. \see SetAccess::add_force
template <scalar S = float>
struct NoStress {
    static constexpr const char* name = "no_stress";
    static constexpr auto parameters() { return std::tuple<>{}; }

    /// The state of a particle: nothing is stored.
    template <int D>
    struct state {
        static constexpr auto fields() { return std::tuple<>{}; }
    };

    /// Returns the empty state unchanged.
    template <int D>
    FIRN_INLINE state<D> updated(const state<D>& same, const Mat<S, D>&, const S&) const {
        return same;
    }
    /// Kirchhoff stress: zero [Pa].
    template <int D>
    FIRN_INLINE Mat<S, D> kirchhoff_stress(const state<D>&) const {
        return Mat<S, D>::zero();
    }
    /// Elastic energy: zero [J/m³].
    template <int D>
    FIRN_INLINE S energy_density(const state<D>&) const {
        return S(0);
    }
    /// Wave speed: zero [m/s].
    template <int D>
    FIRN_INLINE S wave_speed(const S&, const state<D>&) const {
        return S(0);
    }
};

}  // namespace firn::inline FIRN_BUILD
