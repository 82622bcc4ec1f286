/// \file What an interpolation kernel is.
#pragma once

#include <firn/core/scalar.hpp>

#include <array>

namespace firn {

// A kernel is a product of one function a dimension. Along one axis, for a particle at x (in cells from the lower
// corner), it touches `support` nodes from base = floor(x − base_shift); all its functions take the fractional
// position f = x − base.

template <class K>
concept has_support = requires {
    { K::support } -> std::convertible_to<int>;
    { K::base_shift } -> std::convertible_to<double>;
    requires K::support >= 2 && K::support <= 4;
};
template <class K, class S>
concept has_weights = requires(const S f) {
    { K::weights(f) } -> std::same_as<std::array<S, std::size_t(K::support)>>;
};
template <class K, class S>
concept has_gradients = requires(const S f) {
    { K::gradients(f) } -> std::same_as<std::array<S, std::size_t(K::support)>>;  ///< per cell
};
/// D⁻¹ in 1/h²: Σ N (x_i − x)(x_i − x)ᵀ = h²/inverse_inertia I for every x (Jiang et al. 2015, §5.3). A kernel whose
/// inertia depends on x has none; for it, Σ N_i v_i (x_i − x)ᵀ D⁻¹ must be Σ v_i ⊗ ∇N_i, as for multilinear weights.
template <class K>
concept has_inertia = requires {
    { K::inverse_inertia } -> std::convertible_to<double>;
};
/// largest_weight[k]: the most that a particle gives to node k of those that it touches; largest_gradient: the largest
/// |gradient| of any of them. The bound of the fixed-point scale comes from them.
template <class K>
concept has_bounds = requires {
    { K::largest_weight } -> std::convertible_to<std::array<double, std::size_t(K::support)>>;
    { K::largest_gradient } -> std::convertible_to<double>;
};

/// A time step c dt/h up to which symplectic Euler is stable in one dimension: in matter without gaps 2/ω, from the
/// symbol of the stiffness ω² = c²/h² max_θ Σ_j e^{ijθ} ∫ N'(u) N'(u − j) du (lumped mass, weight-gradient forces).
template <class K>
concept has_courant_limit = requires {
    { K::courant_limit } -> std::convertible_to<double>;
};

template <class K>
concept kernel = has_support<K> && has_weights<K, float> && has_weights<K, double> && has_gradients<K, float> &&
                 has_gradients<K, double> && has_bounds<K> && has_courant_limit<K>;

/// True, or the compiler says what K lacks.
template <class K>
consteval bool require_kernel() {
    static_assert(has_support<K>,
                  "firn: a kernel says how many nodes it touches along an axis, `support` (2 to 4), and "
                  "`base_shift`; see firn/kernel/concept.hpp.");
    static_assert(has_weights<K, float> && has_weights<K, double>,
                  "firn: a kernel offers a static weights(f) that gives std::array<S, support> for every scalar S.");
    static_assert(has_gradients<K, float> && has_gradients<K, double>,
                  "firn: a kernel offers a static gradients(f) that gives std::array<S, support> for every scalar S.");
    static_assert(has_bounds<K>,
                  "firn: a kernel states its `largest_weight` and `largest_gradient`; see "
                  "firn/kernel/concept.hpp.");
    static_assert(has_courant_limit<K>,
                  "firn: a kernel states its `courant_limit`, from which the bound of the time step comes; see "
                  "firn/kernel/concept.hpp.");
    return kernel<K>;
}

/// Offset of the node, counted from base, at which a record is centred: the middle one.
template <class K>
inline constexpr int centre_node = (K::support - 1) / 2;

}  // namespace firn
