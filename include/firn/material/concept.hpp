/// \file What a constitutive model is. The least a user writes: `kirchhoff_stress(F)` and `wave_speed(density, F)`.
#pragma once

#include <firn/core/parameters.hpp>
#include <firn/core/tensor.hpp>

namespace firn {

/// The state of a particle of a model that needs nothing but the deformation gradient.
template <class S, int D>
struct ElasticState {
    Mat<S, D> F = Mat<S, D>::identity();  ///< deformation gradient [1]

    static constexpr auto fields() { return std::tuple{parameter{"deformation_gradient", "1", &ElasticState::F}}; }
};

/// The scalar that a model's parameters are made of.
template <class M>
struct material_scalar;
template <template <class> class M, class S>
struct material_scalar<M<S>> {
    using type = S;
};
template <class M>
using material_scalar_t = typename material_scalar<M>::type;

// clang-format off
/// τ = J σ [Pa] from the deformation gradient.
template <class M, int D>
concept has_kirchhoff_stress = requires(const M m, const Mat<material_scalar_t<M>, D> F) {
    { m.kirchhoff_stress(F) } -> std::same_as<Mat<material_scalar_t<M>, D>>;
};
/// A bound of the speed of sound [m/s] from the density at rest [kg/m³] and the deformation gradient.
template <class M, int D>
concept has_wave_speed = requires(const M m, const material_scalar_t<M> density,
                                  const Mat<material_scalar_t<M>, D> F) {
    { m.wave_speed(density, F) } -> std::same_as<material_scalar_t<M>>;
};
// clang-format on

/// A constitutive model in D dimensions.
template <class M, int D>
concept material =
    scalar<material_scalar_t<M>> && has_parameters<M> && has_kirchhoff_stress<M, D> && has_wave_speed<M, D>;

template <class M>
concept has_material_scalar = requires { typename material_scalar_t<M>; } && scalar<material_scalar_t<M>>;

/// True, or the compiler says what M lacks.
template <class M, int D>
consteval bool require_material() {
    if constexpr (has_material_scalar<M>) {
        static_assert(has_parameters<M>,
                      "firn: a material lists its parameters in a static function parameters(); see "
                      "firn/core/parameters.hpp.");
        static_assert(has_kirchhoff_stress<M, D>,
                      "firn: a material offers `Mat<S, D> kirchhoff_stress(const Mat<S, D>& F) const` [Pa].");
        static_assert(has_wave_speed<M, D>,
                      "firn: a material offers `S wave_speed(const S& density, const Mat<S, D>& F) "
                      "const` [m/s]; the time step is bounded by it.");
    } else {
        static_assert(has_material_scalar<M>,
                      "firn: a material is a template over its scalar, "
                      "`template <firn::scalar S> struct MyMaterial`.");
    }
    return material<M, D>;
}

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

/// What a particle of material M keeps: ElasticState, or M::state<D> where the model has one of its own (and then its
/// own `updated`, `kirchhoff_stress` and `wave_speed` of that state, found beside it).
template <class M, int D>
using material_state_t = typename detail::material_state<M, D>::type;

/// The state after dt in a flow of velocity gradient ∇v: F ← (I + dt ∇v) F.
template <class M, scalar S, int D>
FIRN_INLINE ElasticState<S, D> updated(const M&, const ElasticState<S, D>& state, const Mat<S, D>& velocity_gradient,
                                       const S& dt) {
    return {state.F + (velocity_gradient * state.F) * dt};
}
template <class M, scalar S, int D>
FIRN_INLINE Mat<S, D> kirchhoff_stress(const M& model, const ElasticState<S, D>& state) {
    return model.kirchhoff_stress(state.F);
}
template <class M, scalar S, int D>
FIRN_INLINE S wave_speed(const M& model, const S& density, const ElasticState<S, D>& state) {
    return model.wave_speed(density, state.F);
}

}  // namespace firn
