/// \file What a constitutive model is. The least a user writes: `kirchhoff_stress(F)` and `wave_speed(density, F)`.
///
/// Its functions may be written in Eigen's terms, with core/eigen.hpp: Eigen::Matrix<S, D, D> in place of Mat<S, D>.
///
/// A model that keeps more than F has a struct template `state<D>` of its own, with its fields(), and takes that in the
/// place of F. What else a model may offer, each a member that costs nothing where it is not there:
///
///     energy_density(F or state)             elastic energy [J/m³ of undeformed volume]
///     returned(trial)                        the state<D> of a trial state: a plastic return mapping, after F has
///                                            followed the flow
///     returned_with_stress(trial)            returned(trial) and its Kirchhoff stress, a StateAndStress, where the two
///                                            are cheaper together
///     updated(state, velocity_gradient, dt)  in place of F following the flow and returned()
///     kirchhoff_stress(state, velocity_gradient)  a stress [Pa] that depends on the rate, too
///     diffusivity(density, state)            of momentum by viscosity [m²/s], for the bound of the time step
///     initial_state<D>()                     what a particle begins with, if that is not state<D>{}
#pragma once

#include <firn/core/parameters.hpp>
#include <firn/core/tensor.hpp>

#include <type_traits>

namespace firn {

/// The state of a particle of a model that needs nothing but the deformation gradient.
template <class S, int D>
struct ElasticState {
    Mat<S, D> F = Mat<S, D>::identity();  ///< deformation gradient [1]

    static constexpr auto fields() { return std::tuple{parameter{"deformation_gradient", "1", &ElasticState::F}}; }
};

namespace detail {
template <class M>
struct first_argument {};
template <template <class> class M, class S>
struct first_argument<M<S>> {
    using type = S;
};
}  // namespace detail

/// The scalar that a model's parameters are made of: its template argument, or what it says itself.
template <class M>
struct material_scalar : detail::first_argument<M> {};
template <class M>
    requires requires { typename M::scalar_type; }
struct material_scalar<M> {
    using type = typename M::scalar_type;
};
template <class M>
using material_scalar_t = typename material_scalar<M>::type;

namespace detail {
template <class M, int D>
struct material_state {
    using type = ElasticState<material_scalar_t<M>, D>;
};
template <class M, int D>
    requires requires { typename M::template state<D>; }
struct material_state<M, D> {
    using type = typename M::template state<D>;
};
}  // namespace detail

/// A particle's state, and the Kirchhoff stress in it.
template <class State, class S, int D>
struct StateAndStress {
    State state;
    Mat<S, D> stress;  ///< τ [Pa]
};

/// What a particle of material M keeps: ElasticState, or M::state<D> where the model has one of its own.
template <class M, int D>
using material_state_t = typename detail::material_state<M, D>::type;

namespace detail {

// A model's functions of matrices, to be called with firn's or with another library's. \see detail::call

struct KirchhoffStress {
    template <class M, class... A>
    FIRN_INLINE auto operator()(const M& model, const A&... a) const -> decltype(model.kirchhoff_stress(a...)) {
        return model.kirchhoff_stress(a...);
    }
};
struct WaveSpeed {
    template <class M, class... A>
    FIRN_INLINE auto operator()(const M& model, const A&... a) const -> decltype(model.wave_speed(a...)) {
        return model.wave_speed(a...);
    }
};
struct EnergyDensity {
    template <class M, class... A>
    FIRN_INLINE auto operator()(const M& model, const A&... a) const -> decltype(model.energy_density(a...)) {
        return model.energy_density(a...);
    }
};
struct Updated {
    template <class M, class... A>
    FIRN_INLINE auto operator()(const M& model, const A&... a) const -> decltype(model.updated(a...)) {
        return model.updated(a...);
    }
};

/// The class that declares a member function.
template <class M, class Result, class... Arguments>
std::type_identity<M> owner(Result (M::*)(Arguments...) const);
}  // namespace detail

// clang-format off
/// τ = J σ [Pa] from the deformation gradient, or from the model's own state.
template <class M, int D>
concept has_kirchhoff_stress =
    requires(const M m, const Mat<material_scalar_t<M>, D> F) {
        { detail::call(detail::KirchhoffStress{}, m, F) } -> std::same_as<Mat<material_scalar_t<M>, D>>;
    } ||
    requires(const M m, const material_state_t<M, D> state) {
        { detail::call(detail::KirchhoffStress{}, m, state) } -> std::same_as<Mat<material_scalar_t<M>, D>>;
    };
/// τ [Pa] from the model's own state and the velocity gradient [1/s].
template <class M, int D>
concept has_rate_dependent_stress =
    requires(const M m, const material_state_t<M, D> state, const Mat<material_scalar_t<M>, D> velocity_gradient) {
        {
            detail::call(detail::KirchhoffStress{}, m, state, velocity_gradient)
        } -> std::same_as<Mat<material_scalar_t<M>, D>>;
    };
/// A bound of the speed of sound [m/s] from the density at rest [kg/m³] and the deformation gradient or state.
template <class M, int D>
concept has_wave_speed =
    requires(const M m, const material_scalar_t<M> density, const Mat<material_scalar_t<M>, D> F) {
        { detail::call(detail::WaveSpeed{}, m, density, F) } -> std::same_as<material_scalar_t<M>>;
    } ||
    requires(const M m, const material_scalar_t<M> density, const material_state_t<M, D> state) {
        { detail::call(detail::WaveSpeed{}, m, density, state) } -> std::same_as<material_scalar_t<M>>;
    };
/// Elastic energy [J/m³ of undeformed volume] of the deformation gradient or state.
template <class M, int D>
concept has_energy_density =
    requires(const M m, const Mat<material_scalar_t<M>, D> F) {
        { detail::call(detail::EnergyDensity{}, m, F) } -> std::same_as<material_scalar_t<M>>;
    } ||
    requires(const M m, const material_state_t<M, D> state) {
        { detail::call(detail::EnergyDensity{}, m, state) } -> std::same_as<material_scalar_t<M>>;
    };
/// Diffusivity of momentum [m²/s] from the density at rest [kg/m³].
template <class M, int D>
concept has_diffusivity =
    requires(const M m, const material_scalar_t<M> density, const material_state_t<M, D> state) {
        { m.diffusivity(density, state) } -> std::same_as<material_scalar_t<M>>;
    };
/// The state after a step in a flow of that velocity gradient [1/s], the model's own way.
template <class M, int D>
concept has_updated =
    requires(const M m, const material_state_t<M, D> state, const Mat<material_scalar_t<M>, D> velocity_gradient,
             const material_scalar_t<M> dt) { detail::call(detail::Updated{}, m, state, velocity_gradient, dt); };
/// A plastic return mapping.
template <class M, int D>
concept has_returned = requires(const M m, const material_state_t<M, D> trial) { m.returned(trial); };
/// The state after a return mapping and its stress from one member function, of the model itself: one that inherits it
/// may have another stress.
template <class M, int D>
concept has_returned_with_stress =
    requires {
        { detail::owner(&M::template returned_with_stress<D>) } -> std::same_as<std::type_identity<M>>;
    } && !has_updated<M, D>;
// clang-format on

/// A constitutive model in D dimensions.
template <class M, int D>
concept material =
    scalar<material_scalar_t<M>> && has_parameters<M> && has_kirchhoff_stress<M, D> && has_wave_speed<M, D>;

template <class M>
concept has_material_scalar = requires { typename material_scalar_t<M>; } && scalar<material_scalar_t<M>>;

/// True, or the compiler says that M has no scalar.
template <class M>
consteval bool require_material_scalar() {
    static_assert(
        has_material_scalar<M>,
        "firn: a material is a template over its scalar, `template <firn::scalar S> struct MyMaterial`, given "
        "with one: MyMaterial<float>. The same lines then run with any scalar; see "
        "examples/own_material.hpp.");
    return has_material_scalar<M>;
}

/// True, or the compiler says what M lacks.
template <class M, int D>
consteval bool require_material() {
    if constexpr (require_material_scalar<M>()) {
        static_assert(has_parameters<M>,
                      "firn: a material lists its parameters in a static function parameters(); see "
                      "firn/core/parameters.hpp.");
        static_assert(has_kirchhoff_stress<M, D>,
                      "firn: a material offers `Mat<S, D> kirchhoff_stress(const Mat<S, D>& F) const` [Pa], or of its "
                      "own `state<D>`.");
        static_assert(has_wave_speed<M, D>,
                      "firn: a material offers `S wave_speed(const S& density, const Mat<S, D>& F) "
                      "const` [m/s], or of its own `state<D>`; the time step is bounded by it.");
    }
    return material<M, D>;
}

// A model is asked through these. What is written for one model, found beside it, goes before them.

/// What a particle begins with: what the model says, or undeformed.
template <int D, class M>
material_state_t<M, D> initial_state(const M& model) {
    if constexpr (requires { model.template initial_state<D>(); })
        return model.template initial_state<D>();
    else
        return {};
}

/// The trial state: F has followed the flow.
template <class State, scalar S, int D>
FIRN_INLINE State followed(State state, const Mat<S, D>& velocity_gradient, const S& dt) {
    state.F = state.F + (velocity_gradient * state.F) * dt;
    return state;
}
/// What the model's return mapping makes of a trial state; the same where it has none.
template <class M, class State>
FIRN_INLINE State returned_by(const M& model, const State& trial) {
    if constexpr (requires { model.returned(trial); })
        return model.returned(trial);
    else
        return trial;
}

/// The state after dt [s] in a flow of velocity gradient ∇v [1/s]: F ← (I + dt ∇v) F, and the model's return mapping.
template <class M, class State, scalar S, int D>
FIRN_INLINE State updated(const M& model, const State& state, const Mat<S, D>& velocity_gradient, const S& dt) {
    if constexpr (detail::takes<detail::Updated, M, State, Mat<S, D>, S>) {
        return detail::call(detail::Updated{}, model, state, velocity_gradient, dt);
    } else {
        return returned_by(model, followed(state, velocity_gradient, dt));
    }
}

/// The same and the stress in that state, where the model gives both at once.
template <class M, class State, scalar S, int D>
    requires has_returned_with_stress<M, D>
FIRN_INLINE StateAndStress<State, S, D> updated_with_stress(const M& model, const State& state,
                                                            const Mat<S, D>& velocity_gradient, const S& dt) {
    return model.returned_with_stress(followed(state, velocity_gradient, dt));
}

/// τ [Pa]; of a rate-dependent model the part of a body at rest.
template <class M, class State>
FIRN_INLINE auto kirchhoff_stress(const M& model, const State& state) {
    if constexpr (detail::takes<detail::KirchhoffStress, M, State>)
        return detail::call(detail::KirchhoffStress{}, model, state);
    else
        return detail::call(detail::KirchhoffStress{}, model, state.F);
}
/// τ [Pa] in a flow of velocity gradient ∇v [1/s].
template <class M, class State, scalar S, int D>
FIRN_INLINE Mat<S, D> stress_of(const M& model, const State& state, const Mat<S, D>& velocity_gradient) {
    if constexpr (detail::takes<detail::KirchhoffStress, M, State, Mat<S, D>>)
        return detail::call(detail::KirchhoffStress{}, model, state, velocity_gradient);
    else
        return kirchhoff_stress(model, state);
}

/// A bound of the speed of sound [m/s].
template <class M, scalar S, class State>
FIRN_INLINE S wave_speed(const M& model, const S& density, const State& state) {
    if constexpr (detail::takes<detail::WaveSpeed, M, S, State>)
        return detail::call(detail::WaveSpeed{}, model, density, state);
    else
        return detail::call(detail::WaveSpeed{}, model, density, state.F);
}

/// ψ [J/m³ of undeformed volume], the elastic part. \see has_energy_density
template <class M, class State>
FIRN_INLINE auto energy_density(const M& model, const State& state) {
    if constexpr (detail::takes<detail::EnergyDensity, M, State>)
        return detail::call(detail::EnergyDensity{}, model, state);
    else
        return detail::call(detail::EnergyDensity{}, model, state.F);
}

}  // namespace firn
