/// \file What an interpolation kernel is: the weights with which a particle reaches the nodes around it.
///
/// A kernel is a product of one function N per axis. Along an axis, a particle at x, in cells from the lower corner of
/// the grid, touches `support` nodes: base, base + 1, … with base = floor(x − base_shift). The kernel's functions take
/// the particle's position f = x − base [cells].
#pragma once

#include <firn/core/scalar.hpp>

#include <array>

namespace firn {

/// Has K `support`, the number of nodes that it touches along an axis (2 to 4), and `base_shift`?
template <class K>
concept has_support = requires {
    { K::support } -> std::convertible_to<int>;
    { K::base_shift } -> std::convertible_to<double>;
    requires K::support >= 2 && K::support <= 4;
};
/// Has K `weights(f)`? It returns the weights of the nodes from base on [1].
template <class K, class S>
concept has_weights = requires(const S f) {
    { K::weights(f) } -> std::same_as<std::array<S, std::size_t(K::support)>>;
};
/// Has K `gradients(f)`? It returns the derivatives of the weights by x, per cell [1].
template <class K, class S>
concept has_gradients = requires(const S f) {
    { K::gradients(f) } -> std::same_as<std::array<S, std::size_t(K::support)>>;
};
/// Has K `inverse_inertia`, which is D⁻¹ in units of 1/h²?
///
///     Σ N (x_i − x)(x_i − x)ᵀ = h² / inverse_inertia I       for every x
///
/// (Jiang et al. 2015, "The Affine Particle-In-Cell Method", §5.3). A kernel whose inertia depends on x has none. For
/// such a kernel Σ N_i v_i (x_i − x)ᵀ D⁻¹ must equal Σ v_i ⊗ ∇N_i, as for multilinear weights.
template <class K>
concept has_inertia = requires {
    { K::inverse_inertia } -> std::convertible_to<double>;
};
/// Has K `largest_weight` and `largest_gradient`? largest_weight[k] is the largest weight of node base + k;
/// largest_gradient is the largest |gradient| of any node, per cell. The fixed-point scale follows from them.
template <class K>
concept has_bounds = requires {
    { K::largest_weight } -> std::convertible_to<std::array<double, std::size_t(K::support)>>;
    { K::largest_gradient } -> std::convertible_to<double>;
};

/// Has K `courant_limit`, the largest c dt/h at which symplectic Euler is stable in one dimension?
///
/// In matter without gaps it is 2/ω in units of h/c, with lumped mass and weight-gradient forces, where
///
///     ω² = c²/h² max_θ Σ_j e^{ijθ} ∫ N'(u) N'(u − j) du
///
/// is the symbol of the stiffness.
template <class K>
concept has_courant_limit = requires {
    { K::courant_limit } -> std::convertible_to<double>;
};

/// An interpolation kernel.
template <class K>
concept kernel = has_support<K> && has_weights<K, float> && has_weights<K, double> && has_gradients<K, float> &&
                 has_gradients<K, double> && has_bounds<K> && has_courant_limit<K>;

/// Stops the compilation with a message if K is not a kernel; else returns true.
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

/// The node at which a particle's record is centred, counted from base: the middle one.
template <class K>
inline constexpr int centre_node = (K::support - 1) / 2;

}  // namespace firn
