/// \file Materials that ask for the surroundings of their particles, for programs.
#pragma once

#include <firn/material/fixed_corotated.hpp>
#include <firn/material/sand.hpp>
#include <firn/material/surroundings.hpp>

namespace scenes {

/// How many times as stiff matter is somewhere, by all that a material is told.
template <firn::scalar S, int D>
FIRN_INLINE S stiffness(const firn::Surroundings<S, D>& here) {
    using firn::max;
    S factor = S(0.6) + here.position[0] + S(0.5) * here.position[1] * here.position[1];
    factor = factor + S(0.01) * here.velocity[1] + S(2) * here.cell_size + S(30) * here.time;
    return max(factor * (here.density * S(0.001)), S(0.1));
}

/// Elastic matter whose stiffness depends on all that it is told.
template <firn::scalar S>
struct Graded {
    S mu = S(4e4), lambda = S(6e4);  // [Pa]

    static constexpr const char* name = "graded";
    static constexpr auto parameters() {
        return std::tuple{firn::parameter{"mu", "Pa", &Graded::mu}, firn::parameter{"lambda", "Pa", &Graded::lambda}};
    }
    template <int D>
    FIRN_INLINE Graded at(const firn::Surroundings<S, D>& here) const {
        const S factor = stiffness(here);
        return {mu * factor, lambda * factor};
    }
    template <firn::deformation_gradient_of<S> G>
    FIRN_INLINE firn::matrix_of_t<G> kirchhoff_stress(const G& F) const {
        return elastic().kirchhoff_stress(F);
    }
    template <firn::deformation_gradient_of<S> G>
    FIRN_INLINE S wave_speed(const S& density, const G& F) const {
        return elastic().wave_speed(density, F);
    }

private:
    FIRN_INLINE firn::FixedCorotated<S> elastic() const { return {mu, lambda}; }
};

/// Sand whose stiffness depends on all that it is told, and which returns state and stress together.
template <firn::scalar S>
struct GradedSand : firn::Sand<S> {
    using scalar_type = S;
    template <class T>
    using with_scalar = GradedSand<T>;
    template <int D>
    using state = typename firn::Sand<S>::template state<D>;

    static constexpr const char* name = "graded_sand";
    template <int D>
    FIRN_INLINE GradedSand at(const firn::Surroundings<S, D>& here) const {
        GradedSand there = *this;
        there.mu = there.mu * stiffness(here);
        there.lambda = there.lambda * stiffness(here);
        return there;
    }
    template <int D>
    FIRN_INLINE firn::StateAndStress<state<D>, S, D> returned_with_stress(const state<D>& trial) const {
        return firn::Sand<S>::template returned_with_stress<D>(trial);
    }
};

}  // namespace scenes
