/// \file The concept of a material (a constitutive model): the members that it must have, and the members that it may
/// have.
///
/// A material must have the functions parameters(), `kirchhoff_stress(F)` [Pa] and `wave_speed(density, F)` [m/s]. F is
/// the deformation gradient, `density` the density of the undeformed material [kg/m³]. A model whose particles do not
/// store F alone declares a struct template `state<D>`, whose static function fields() lists what a particle stores;
/// the functions of the model then take a `state<D>` instead of F. Models may use Eigen::Matrix<S, D, D> instead of
/// `Mat<S, D>` if core/eigen.hpp is included.
///
/// firn passes F as a `DeformationGradient<S, D>`, which is a `Mat<S, D>`. A function that takes every type of
/// `deformation_gradient_of<S>`, and computes with the differences to the undeformed body, loses no small strain.
/// \see math/deformation.hpp
///
/// Optional members:
///
///     energy_density(F or state)             elastic energy [J/m³ of undeformed volume]
///     returned(trial)                        the state<D> after plastic flow (the return mapping); `trial` is the
///                                            state after a step that was computed as if it were elastic
///     returned_with_stress(trial)            the state returned(trial) and its Kirchhoff stress [Pa], as a
///                                            StateAndStress; for models that save work by computing both together
///     updated(state, velocity_gradient, dt)  the state after a time step dt [s]; firn calls this function instead of
///                                            updating F and calling returned()
///     updated_with_stress(state, velocity_gradient, dt)  the state updated(state, velocity_gradient, dt) and its
///                                            Kirchhoff stress [Pa], as a StateAndStress
///     kirchhoff_stress(state, velocity_gradient)  Kirchhoff stress [Pa], if it depends on the velocity gradient, too
///     diffusivity(density, state)            diffusivity of momentum by viscosity [m²/s]; it limits the time step
///     stretch_bound(state)                   an upper bound of how many times as long as at first a particle is [1],
///                                            for a plastic model that bears tension however far it is stretched. With
///                                            it, a simulation warns before such matter breaks for want of particles
///     initial_state<D>()                     the state of a new particle, if this state is not state<D>{}
///     at(surroundings)                       the material with the parameters that it has for one particle, which may
///                                            depend on the particle's position, the time, and more. \see Surroundings
///     outputs, output(state)                 what states have of a particle besides the fields: a std::array of
///                                            StateOutput, and the std::array of their numbers
///     check()                                throws parameter_error if a parameter is out of range; called before the
///                                            first step. Of a model without it, NaN parameters are refused
#pragma once

#include <firn/core/parameters.hpp>
#include <firn/core/tensor.hpp>
#include <firn/math/deformation.hpp>

#include <limits>
#include <type_traits>

namespace firn::inline FIRN_BUILD {

/// The state of a particle that stores only the deformation gradient.
template <class S, int D>
struct ElasticState {
    DeformationGradient<S, D> F;  ///< deformation gradient [1]

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

/// A struct whose member `type` is the scalar type of the parameters of the model M: the template argument of M.
template <class M>
struct material_scalar : detail::first_argument<M> {};
/// A struct whose member `type` is the scalar type of the parameters of a model M that declares `scalar_type`.
template <class M>
    requires requires { typename M::scalar_type; }
struct material_scalar<M> {
    using type = typename M::scalar_type;  ///< The scalar type that the model declares.
};
/// The scalar type of a model's parameters: M::scalar_type if M declares it, else the template argument of M.
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

namespace detail {
/// Returns the part of a matrix that lies in the plane of the axes 0 and 1.
template <scalar S>
FIRN_INLINE Mat<S, 2> in_plane(const Mat<S, 3>& a) {
    Mat<S, 2> part;
    unroll<4>([&](auto k) FIRN_LAMBDA { part.m[k] = a(k % 2, k / 2); });
    return part;
}
/// Returns the gradient in three dimensions of a velocity in the plane that does not change across it.
template <scalar S>
FIRN_INLINE Mat<S, 3> in_space(const Mat<S, 2>& gradient) {
    Mat<S, 3> whole = Mat<S, 3>::zero();
    unroll<4>([&](auto k) FIRN_LAMBDA { whole(k % 2, k / 2) = gradient.m[k]; });
    return whole;
}
}  // namespace detail

/// A particle's state after the return mapping, and the Kirchhoff stress in this state.
template <class State, class S, int D>
struct StateAndStress {
    State state;       ///< The state after the return mapping.
    Mat<S, D> stress;  ///< Kirchhoff stress τ of a particle in this state [Pa]
};

/// A number that states have of each particle, and that a material computes from the particle's state when a state is
/// written. A restart does not read it. \see has_outputs
struct StateOutput {
    const char* name;  ///< name of the field in states
    const char* unit;  ///< its unit
};
/// The largest number of outputs of a material.
inline constexpr std::size_t most_outputs = 8;

/// The type of a particle's state for the material M: M::state<D> if M declares it, else ElasticState.
template <class M, int D>
using material_state_t = typename detail::material_state<M, D>::type;

namespace detail {

// Function objects that call a model's functions. detail::call calls such a function object with firn's matrices, or
// with Eigen's matrices if the model's function takes Eigen's matrices.

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

/// Returns the std::type_identity of the class that declares the given member function. Use `owner` only in decltype:
/// the function has no body.
template <class M, class Result, class... Arguments>
std::type_identity<M> owner(Result (M::*)(Arguments...) const);
}  // namespace detail

// clang-format off
/// Whether M has a function `kirchhoff_stress(F)` or `kirchhoff_stress(state)`. The function returns the Kirchhoff
/// stress τ = J σ [Pa] as a Mat<S, D>; σ is the Cauchy stress, J = det F.
template <class M, int D>
concept has_kirchhoff_stress =
    requires(const M m, const DeformationGradient<material_scalar_t<M>, D> F) {
        { detail::call(detail::KirchhoffStress{}, m, F) } -> std::same_as<Mat<material_scalar_t<M>, D>>;
    } ||
    requires(const M m, const material_state_t<M, D> state) {
        { detail::call(detail::KirchhoffStress{}, m, state) } -> std::same_as<Mat<material_scalar_t<M>, D>>;
    };
/// Whether M has a function `kirchhoff_stress(state, velocity_gradient)`. The function returns the Kirchhoff stress τ
/// [Pa] in this state, at this velocity gradient [1/s].
template <class M, int D>
concept has_rate_dependent_stress =
    requires(const M m, const material_state_t<M, D> state, const Mat<material_scalar_t<M>, D> velocity_gradient) {
        {
            detail::call(detail::KirchhoffStress{}, m, state, velocity_gradient)
        } -> std::same_as<Mat<material_scalar_t<M>, D>>;
    };
/// Whether M has a function `wave_speed(density, F)` or `wave_speed(density, state)`. The function returns an upper
/// bound of the speed of elastic waves [m/s]. `density` is the density of the undeformed material [kg/m³].
template <class M, int D>
concept has_wave_speed =
    requires(const M m, const material_scalar_t<M> density, const DeformationGradient<material_scalar_t<M>, D> F) {
        { detail::call(detail::WaveSpeed{}, m, density, F) } -> std::same_as<material_scalar_t<M>>;
    } ||
    requires(const M m, const material_scalar_t<M> density, const material_state_t<M, D> state) {
        { detail::call(detail::WaveSpeed{}, m, density, state) } -> std::same_as<material_scalar_t<M>>;
    };
/// Whether M has a function `energy_density(F)` or `energy_density(state)`. The function returns the elastic energy
/// [J/m³ of undeformed volume].
template <class M, int D>
concept has_energy_density =
    requires(const M m, const DeformationGradient<material_scalar_t<M>, D> F) {
        { detail::call(detail::EnergyDensity{}, m, F) } -> std::same_as<material_scalar_t<M>>;
    } ||
    requires(const M m, const material_state_t<M, D> state) {
        { detail::call(detail::EnergyDensity{}, m, state) } -> std::same_as<material_scalar_t<M>>;
    };
/// Whether M has a function `diffusivity(density, state)`. The function returns the diffusivity of momentum by
/// viscosity [m²/s]. `density` is the density of the undeformed material [kg/m³].
template <class M, int D>
concept has_diffusivity =
    requires(const M m, const material_scalar_t<M> density, const material_state_t<M, D> state) {
        { m.diffusivity(density, state) } -> std::same_as<material_scalar_t<M>>;
    };
/// Whether M has a function `stretch_bound(state)`. The function returns an upper bound of the stretch of a particle
/// since it was made [1].
template <class M, int D>
concept has_stretch_bound =
    requires(const M m, const material_state_t<M, D> state) {
        { m.stretch_bound(state) } -> std::same_as<material_scalar_t<M>>;
    };
/// Whether M has a function `updated(state, velocity_gradient, dt)`. The function returns the state after a time step
/// dt [s] with this velocity gradient [1/s]. firn calls updated() instead of updating F and calling returned().
template <class M, int D>
concept has_updated =
    requires(const M m, const material_state_t<M, D> state, const Mat<material_scalar_t<M>, D> velocity_gradient,
             const material_scalar_t<M> dt) { detail::call(detail::Updated{}, m, state, velocity_gradient, dt); };
/// Whether M declares a function `updated_with_stress(state, velocity_gradient, dt)`. The function returns the state
/// after a time step and the stress in this state. A function that M inherits does not count, since the stress of M may
/// differ from the stress of the base class.
template <class M, int D>
concept has_updated_with_stress =
    requires {
        { detail::owner(&M::template updated_with_stress<D>) } -> std::same_as<std::type_identity<M>>;
    } && has_updated<M, D>;
/// Whether M has a function `returned(trial)`, a plastic return mapping. `trial` is the state after a step that was
/// computed as if it were elastic.
template <class M, int D>
concept has_returned = requires(const M m, const material_state_t<M, D> trial) { m.returned(trial); };
/// Whether M declares a function `returned_with_stress(trial)`, and has no updated(). The function returns the state
/// after the return mapping and the stress in this state. A function that M inherits does not count, since the stress
/// of M may differ from the stress of the base class.
template <class M, int D>
concept has_returned_with_stress =
    requires {
        { detail::owner(&M::template returned_with_stress<D>) } -> std::same_as<std::type_identity<M>>;
    } && !has_updated<M, D>;
/// Whether M returns the state after a step and its stress together. \see updated_with_stress
template <class M, int D>
concept has_stress_with_state = has_returned_with_stress<M, D> || has_updated_with_stress<M, D>;
/// Whether M has numbers that are written to states besides the fields: `outputs`, an array of StateOutput, and
/// `output(state)`, which returns an array of as many numbers.
template <class M, int D>
concept has_outputs = requires(const M m, const material_state_t<M, D> state) { m.output(state).size(); M::outputs.size(); };
// clang-format on

/// Whether M is a material in D dimensions: M has a scalar type, parameters, a Kirchhoff stress and a wave speed.
template <class M, int D>
concept material =
    scalar<material_scalar_t<M>> && has_parameters<M> && has_kirchhoff_stress<M, D> && has_wave_speed<M, D>;

/// Whether M has a scalar type: M is a template over its scalar type, or M declares `scalar_type`.
template <class M>
concept has_material_scalar = requires { typename material_scalar_t<M>; } && scalar<material_scalar_t<M>>;

/// Returns true if M has a scalar type. If M has none, the compilation stops with a message.
template <class M>
consteval bool require_material_scalar() {
    static_assert(
        has_material_scalar<M>,
        "firn: a material is a template over its scalar, `template <firn::scalar S> struct MyMaterial`, given "
        "with one: MyMaterial<float>. The same lines then run with any scalar; see "
        "examples/own_material.hpp.");
    return has_material_scalar<M>;
}

/// Returns true if M is a material in D dimensions. If M is not, the compilation stops with a message.
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

// firn calls the members of a model through the functions below. If argument-dependent lookup finds an overload of one
// of these functions for the type of the model, firn calls this overload.

/// Returns the state of a new particle: model.initial_state<D>() if the model has this function, else the state with
/// the default value of every field.
template <int D, class M>
material_state_t<M, D> initial_state(const M& model) {
    if constexpr (requires { model.template initial_state<D>(); })
        return model.template initial_state<D>();
    else
        return {};
}

/// Returns the trial state: the particle's state after a time step dt [s] with velocity gradient ∇v [1/s], computed as
/// if the step were elastic. F becomes (I + dt ∇v) F; the other fields of the state keep their values. If F is 3 × 3
/// and ∇v 2 × 2, matter moves in the plane only. \see PlaneStrain
template <class State, scalar S, int D>
FIRN_INLINE State followed(State state, const Mat<S, D>& velocity_gradient, const S& dt) {
    constexpr int N = dimension_of<decltype(state.F)>;
    static_assert(N == D || (N == 3 && D == 2), "firn: F of a particle has D × D or 3 × 3 numbers.");
    const Mat<S, N>& F = state.F;
    if constexpr (N == D)
        state.F = increased(state.F, (velocity_gradient * F) * dt);
    else
        state.F = increased(state.F, (detail::in_space(velocity_gradient) * F) * dt);
    return state;
}
namespace detail {
/// What rounding adds to a strain [1], up to a small factor. A return mapping acts on what is beyond it. A particle on
/// the yield surface then rests there: if the excess of a last digit of F were returned in every step, what the state
/// gathers, such as a plastic strain, would grow without bound while nothing moves.
template <class S>
inline constexpr double strain_rounding = 4 * double(std::numeric_limits<value_type_t<S>>::epsilon());

/// Returns the mask of where two matrices, or two states, differ.
/// @{
template <scalar S>
FIRN_INLINE mask_t<S> differ(const S& a, const S& b) {
    return !(a == b);
}
template <scalar S, int D>
FIRN_INLINE mask_t<S> differ(const Vec<S, D>& a, const Vec<S, D>& b) {
    mask_t<S> found = differ(a.v[0], b.v[0]);
    unroll<D - 1>([&](auto k) FIRN_LAMBDA { found = found | differ(a.v[k + 1], b.v[k + 1]); });
    return found;
}
template <scalar S, int D>
FIRN_INLINE mask_t<S> differ(const Mat<S, D>& a, const Mat<S, D>& b) {
    mask_t<S> found = differ(a.m[0], b.m[0]);
    unroll<D * D - 1>([&](auto k) FIRN_LAMBDA { found = found | differ(a.m[k + 1], b.m[k + 1]); });
    return found;
}
template <scalar S, int D>
FIRN_INLINE mask_t<S> differ(const DeformationGradient<S, D>& a, const DeformationGradient<S, D>& b) {
    return differ(displacement_gradient(a), displacement_gradient(b));
}
template <scalar S>
FIRN_INLINE mask_t<S> differ(const VolumeRatio<S>& a, const VolumeRatio<S>& b) {
    return differ(a.excess, b.excess);
}
template <class State>
    requires requires { State::fields(); }
FIRN_INLINE auto differ(const State& a, const State& b) {
    constexpr auto fields = State::fields();
    return std::apply([&](const auto&... f) FIRN_LAMBDA { return (differ(f.of(a), f.of(b)) | ...); }, fields);
}
/// @}
/// Returns a trial state with what a return mapping gave. The mapping of a wrapper's model gives the model's part of
/// the state only; the rest stays. \see Undrained, PlasticVolume
template <class State, class Returned>
FIRN_INLINE State with_returned(State trial, const Returned& returned) {
    if constexpr (std::derived_from<State, Returned>) {
        static_cast<Returned&>(trial) = returned;
        return trial;
    } else {
        return returned;
    }
}
}  // namespace detail

/// Returns the state after the model's return mapping: model.returned(trial), or the trial state itself if the model
/// has no return mapping.
template <class M, class State>
FIRN_INLINE State returned_by(const M& model, const State& trial) {
    if constexpr (requires { model.returned(trial); })
        return detail::with_returned(trial, model.returned(trial));
    else
        return trial;
}

/// Returns a particle's state after a time step dt [s] with velocity gradient ∇v [1/s]. If the model has updated(),
/// firn calls updated(); else F becomes (I + dt ∇v) F, and the return mapping follows.
template <class M, class State, scalar S, int D>
FIRN_INLINE State updated(const M& model, const State& state, const Mat<S, D>& velocity_gradient, const S& dt) {
    if constexpr (detail::takes<detail::Updated, M, State, Mat<S, D>, S>) {
        return detail::call(detail::Updated{}, model, state, velocity_gradient, dt);
    } else {
        return returned_by(model, followed(state, velocity_gradient, dt));
    }
}

/// Returns a particle's state after a time step dt [s] with velocity gradient ∇v [1/s], and the Kirchhoff stress [Pa]
/// in the new state. This function exists only for models that return both together.
template <class M, class State, scalar S, int D>
    requires has_stress_with_state<M, D>
FIRN_INLINE StateAndStress<State, S, D> updated_with_stress(const M& model, const State& state,
                                                            const Mat<S, D>& velocity_gradient, const S& dt) {
    if constexpr (has_updated_with_stress<M, D>)
        return model.template updated_with_stress<D>(state, velocity_gradient, dt);
    else
        return model.template returned_with_stress<D>(followed(state, velocity_gradient, dt));
}

/// Returns the Kirchhoff stress τ [Pa] in the given state. If the model's stress depends on the velocity gradient ∇v,
/// the result is the stress at ∇v = 0.
template <class M, class State>
FIRN_INLINE auto kirchhoff_stress(const M& model, const State& state) {
    if constexpr (detail::takes<detail::KirchhoffStress, M, State>)
        return detail::call(detail::KirchhoffStress{}, model, state);
    else
        return detail::call(detail::KirchhoffStress{}, model, state.F);
}
/// Returns the Kirchhoff stress τ [Pa] in the given state, at the velocity gradient ∇v [1/s]. A model whose stress does
/// not depend on ∇v ignores ∇v.
template <class M, class State, scalar S, int D>
FIRN_INLINE Mat<S, D> stress_of(const M& model, const State& state, const Mat<S, D>& velocity_gradient) {
    if constexpr (detail::takes<detail::KirchhoffStress, M, State, Mat<S, D>>)
        return detail::call(detail::KirchhoffStress{}, model, state, velocity_gradient);
    else
        return kirchhoff_stress(model, state);
}

/// Returns an upper bound of the speed of elastic waves [m/s] in the given state. `density` is the density of the
/// undeformed material [kg/m³].
template <class M, scalar S, class State>
FIRN_INLINE S wave_speed(const M& model, const S& density, const State& state) {
    if constexpr (detail::takes<detail::WaveSpeed, M, S, State>)
        return detail::call(detail::WaveSpeed{}, model, density, state);
    else
        return detail::call(detail::WaveSpeed{}, model, density, state.F);
}

/// Returns the elastic energy ψ [J/m³ of undeformed volume] in the given state. \see has_energy_density
template <class M, class State>
FIRN_INLINE auto energy_density(const M& model, const State& state) {
    if constexpr (detail::takes<detail::EnergyDensity, M, State>)
        return detail::call(detail::EnergyDensity{}, model, state);
    else
        return detail::call(detail::EnergyDensity{}, model, state.F);
}

}  // namespace firn::inline FIRN_BUILD
