/// \file The members of an interpolation kernel. A kernel gives the weights of the grid nodes around a particle.
///
/// A kernel is a product of one function N per axis. Let x be a particle's coordinate along an axis, in cells from the
/// lower corner of the grid. The particle touches `support` nodes along this axis: base, base + 1, … with
/// base = floor(x − base_shift). The kernel's functions take f = x − base, the particle's distance from node base
/// [cells].
///
/// In this file, h is the cell size, and N_i, v_i and x_i are the weight, the velocity and the position of node i.
#pragma once

#include <firn/core/scalar.hpp>

#include <algorithm>
#include <array>

namespace firn::inline FIRN_BUILD {

/// Whether K has the members `support` and `base_shift`. `support` is the number of nodes that a particle touches along
/// an axis (2 to 4). `base_shift` gives the first of these nodes: base = floor(x − base_shift), where x is the
/// particle's coordinate [cells].
template <class K>
concept has_support = requires {
    { K::support } -> std::convertible_to<int>;
    { K::base_shift } -> std::convertible_to<double>;
    requires K::support >= 2 && K::support <= 4;
};
/// Whether K has the function `weights(f)`. It returns the weights [1] of the nodes that a particle touches along an
/// axis: base, base + 1, … The argument f is the particle's distance from node base [cells].
template <class K, class S>
concept has_weights = requires(const S f) {
    { K::weights(f) } -> std::same_as<std::array<S, std::size_t(K::support)>>;
};
/// Whether K has the function `gradients(f)`. It returns the derivatives [1] of the weights of the nodes base, base +
/// 1, … with respect to the particle's coordinate x in cells. The argument f is the particle's distance from node base
/// [cells].
template <class K, class S>
concept has_gradients = requires(const S f) {
    { K::gradients(f) } -> std::same_as<std::array<S, std::size_t(K::support)>>;
};
/// Whether K has the member `inverse_inertia`. It is the factor in D⁻¹ = inverse_inertia / h² I, where D is APIC's
/// inertia
///
///     D = Σ N_i (x_i − x)(x_i − x)ᵀ = h² / inverse_inertia I       for every position x of a particle
///
/// (Jiang et al. 2015, "The Affine Particle-In-Cell Method", §5.3). Here h is the cell size, and N_i, v_i and x_i are
/// the weight, the velocity and the position of node i. A kernel whose D depends on x does not have this member. Such a
/// kernel has a function `inertia` in its place, see has_local_inertia; or Σ N_i v_i (x_i − x)ᵀ D⁻¹ equals Σ v_i ⊗
/// ∇N_i, as for multilinear weights.
template <class K>
concept has_inertia = requires {
    { K::inverse_inertia } -> std::convertible_to<double>;
};
/// Whether K has a function `inertia(d)`, because APIC's inertia D depends on the particle's position. The function
/// returns the entry of D/h² along one axis, Σ N_i (x_i − x)²/h² > 0, for a particle at the distance d from the centre
/// node along this axis [cells]. D has no entries off the diagonal. \see has_inertia, centre_node
template <class K>
concept has_local_inertia = requires(const double d) {
    { K::inertia(d) } -> std::same_as<double>;
};
/// Whether K has the members `largest_weight` and `largest_gradient`. largest_weight[k] is the largest weight that node
/// base + k can have, where base is the first node that a particle touches. largest_gradient is the largest absolute
/// derivative of a weight with respect to the particle's coordinate in cells. The scale of the fixed-point sums on the
/// grid is computed from these two members.
template <class K>
concept has_bounds = requires {
    { K::largest_weight } -> std::convertible_to<std::array<double, std::size_t(K::support)>>;
    { K::largest_gradient } -> std::convertible_to<double>;
};

/// Whether K has the member `courant_limit`: the largest c dt/h at which symplectic Euler is stable in one dimension,
/// with the wave speed c, the time step dt and the cell size h.
///
/// In matter without gaps, with lumped mass and weight-gradient forces, the largest stable time step is 2/ω, where
///
///     ω² = c²/h² max_θ Σ_j e^{ijθ} ∫ N'(u) N'(u − j) du
///
/// is the largest squared angular frequency of a wave with the phase difference θ between neighbouring nodes, and N(u)
/// is the weight of a node at the distance u [cells].
template <class K>
concept has_courant_limit = requires {
    { K::courant_limit } -> std::convertible_to<double>;
};

/// Whether K has the function `joined_stretch(n)`: the largest stretch at which the kernel still joins particles of
/// which n lie along an axis of a cell at rest. It is measured with a bar; a bar that is stretched farther breaks,
/// however strong its material.
template <class K>
concept has_joined_stretch = requires(const double n) {
    { K::joined_stretch(n) } -> std::convertible_to<double>;
};
/// Returns the largest stretch at which the kernel joins particles of which n lie along an axis of a cell at rest:
/// K::joined_stretch(n), or that of the splines if K does not say.
template <class K>
double joined_stretch(double n) {
    if constexpr (has_joined_stretch<K>)
        return K::joined_stretch(n);
    else
        return 1.05 + 0.62 * std::max(n - 1, 0.0);
}

/// A type that has all members of an interpolation kernel. (`inverse_inertia` may be missing, see has_inertia.)
template <class K>
concept kernel = has_support<K> && has_weights<K, float> && has_weights<K, double> && has_gradients<K, float> &&
                 has_gradients<K, double> && has_bounds<K> && has_courant_limit<K>;

/// Returns true if K is a kernel. Else the compilation stops with a message.
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

/// Index of the middle one of the nodes that a particle touches along an axis, counted from 0 for the first node, base.
/// If `support` is even, this is the lower one of the two middle nodes. Distances from a particle to its nodes are
/// computed from the distance to the middle node.
template <class K>
inline constexpr int centre_node = (K::support - 1) / 2;

}  // namespace firn::inline FIRN_BUILD
