/// \file G2P of one particle: its velocity, affine field and velocity gradient, from sums over nodes.
#pragma once

#include <firn/core/parameters.hpp>
#include <firn/stage/offset.hpp>

namespace firn::inline FIRN_BUILD {

/// Sums over the nodes i around a particle, with weights N_i, velocities v_i, and offsets o_i from the centre node
/// [cells].
template <class S, int D>
struct G2PSums {
    Vec<S, D> velocity;  ///< Σ N_i v_i [m/s]
    Mat<S, D> moment;    ///< Σ N_i v_i o_iᵀ [m/s]; only if needed
    Mat<S, D> gradient;  ///< Σ v_i ∇N_iᵀ, with ∇N_i per cell [m/s]; only if needed
};

/// Whether G2P needs the sum Σ N_i v_i o_iᵀ: for the affine field that a particle keeps, or for the velocity gradient
/// to which MLS forces are dual. \see G2PSums
template <class Kernel, class Transfer, class Force>
inline constexpr bool g2p_needs_moment = (Transfer::affine && (has_inertia<Kernel> || has_local_inertia<Kernel>)) ||
                                         (!Force::weight_gradients && has_inertia<Kernel>);
/// Whether G2P needs the sum Σ v_i ∇N_iᵀ. \see G2PSums
template <class Kernel, class Transfer, class Force>
inline constexpr bool g2p_needs_gradient = Force::weight_gradients || !g2p_needs_moment<Kernel, Transfer, Force>;

/// The values of a particle that G2P computes from the grid.
template <class S, int D>
struct G2PResult {
    Vec<S, D> velocity;           ///< new velocity v [m/s]
    Mat<S, D> affine;             ///< affine field C [1/s]
    Mat<S, D> velocity_gradient;  ///< velocity gradient ∇v, used to update the deformation gradient F [1/s]
};

/// Returns a particle's velocity, affine field C and velocity gradient, from its sums over nodes. The force form
/// decides the velocity gradient. With MLS forces and a spline it is B D⁻¹, whatever the particle keeps of it: the work
/// of MLS forces is V0 τ : B D⁻¹ (Hu et al. 2018, §4). With gradients of weights it is Σ v_i ⊗ ∇N_i, with the
/// velocities v_i and the weights N_i of the nodes.
/// \param d  the particle's position relative to its centre node [cells];  \param h  cell size [m]
/// \param transfer  the transfer with scalar type S
template <class Kernel, class Transfer, class Force, scalar S, int D, class Lifted = with_scalar_t<Transfer, S>>
FIRN_INLINE G2PResult<S, D> take_from_grid(const G2PSums<S, D>& sums, const Vec<S, D>& d, const S& h,
                                           [[maybe_unused]] const Lifted& transfer = {}) {
    constexpr bool moment = g2p_needs_moment<Kernel, Transfer, Force>;
    Mat<S, D> C;
    if constexpr (!moment) {
        C = sums.gradient * (S(1) / h);  // equals B D⁻¹ of APIC with linear weights
    } else if constexpr (has_local_inertia<Kernel>) {
        C = sums.moment - outer(sums.velocity, d);
        unroll<D>([&](auto j) FIRN_LAMBDA {
            const S scale = S(1) / (h * Kernel::inertia(d.v[j]));
            unroll<D>([&](auto i) FIRN_LAMBDA { C(i, j) = C(i, j) * scale; });
        });
    } else {
        C = (sums.moment - outer(sums.velocity, d)) * h * inverse_inertia<Kernel>(h);
    }
    G2PResult<S, D> result;
    result.velocity = sums.velocity;
    result.affine = transfer.affine_field(C);
    if constexpr (moment && g2p_needs_gradient<Kernel, Transfer, Force>)
        result.velocity_gradient = sums.gradient * (S(1) / h);
    else
        result.velocity_gradient = C;
    return result;
}

/// The new position of a particle. \see moved_by
template <class S, int D>
struct G2PMove {
    Vec<S, D> position;  ///< the new position, limited to a box
    S outside;           ///< largest distance along an axis by which the box was left; ≤ 0 if it was not left
};
/// Returns the position of a particle after a step: moved by the particle's velocity, then limited to the box between
/// two corners.
/// \param per_velocity  factor that turns a velocity [m/s] into a displacement: the time step dt if positions are in
///                      metres, dt / h if they are in cells
/// \param lowest, highest  lower and upper corner of the box, in the unit of `position`
template <scalar S, int D>
FIRN_INLINE G2PMove<S, D> moved_by(const Vec<S, D>& velocity, const S& per_velocity, const Vec<S, D>& position,
                                   const Vec<S, D>& lowest, const Vec<S, D>& highest) {
    G2PMove<S, D> move;
    unroll<D>([&](auto a) FIRN_LAMBDA {
        const S to = position.v[a] + velocity.v[a] * per_velocity;
        const S outside = max(lowest.v[a] - to, to - highest.v[a]);
        move.outside = a == 0 ? outside : max(move.outside, outside);
        move.position.v[a] = select(to < lowest.v[a], lowest.v[a], select(to > highest.v[a], highest.v[a], to));
    });
    return move;
}

/// Sums over the nodes along the first `Closed` axes: an intermediate result of G2P, which sums over one axis after the
/// other. N is the weight, v the velocity and o the offset of a node. \see sum_axis
/// \tparam V       type of v: the velocity of a node, or the velocities of a row of nodes
/// \tparam Closed  the number of axes over which the sums were taken
/// \tparam Moments, Gradients  whether there are the sums `moment`, and whether there are the sums `gradient`
template <class V, int Closed, bool Moments, bool Gradients>
struct PartialSums {
    V value;                                                      ///< Σ N v
    std::array<V, std::size_t(Moments ? Closed : 0)> moment;      ///< Σ N v o_a for each summed axis a
    std::array<V, std::size_t(Gradients ? Closed : 0)> gradient;  ///< Σ (∂N/∂x_a) v for each summed axis a
};

/// Returns the sums over the nodes along one more axis, from the sums over the previous axes.
/// \tparam Centre  the index of the centre node in `parts`
/// \param parts  for each node k along this axis, the sums over the previous axes; the offset of node k from the centre
///               node is k − Centre
/// \param w      the kernel's weight at each node k;  \param g  the kernel's gradient at each node k [1/cell]
template <int Centre, class V, int Closed, bool Moments, bool Gradients, class W, std::size_t K>
FIRN_INLINE PartialSums<V, Closed + 1, Moments, Gradients> sum_axis(
    const std::array<PartialSums<V, Closed, Moments, Gradients>, K>& parts, const std::array<W, K>& w,
    const std::array<W, K>& g) {
    PartialSums<V, Closed + 1, Moments, Gradients> sums;
    // Some products of value and weight are needed twice, for the value and for the moment along this axis. These
    // products are computed only once. The product at offset 1 is computed twice, because processors with fused
    // multiply-add compute it without extra cost.
    constexpr auto is_shared = [](int k) { return k == 0 || (Moments && (k < Centre || k > Centre + 1)); };
    std::array<V, K> weighted;
    unroll<int(K)>([&](auto k) FIRN_LAMBDA {
        if constexpr (is_shared(k)) weighted[k] = parts[k].value * w[k];
    });
    sums.value = weighted[0];
    unroll<int(K) - 1>([&](auto k) FIRN_LAMBDA {
        if constexpr (is_shared(k + 1))
            sums.value = sums.value + weighted[k + 1];
        else
            sums.value = plus_times(sums.value, parts[k + 1].value, w[k + 1]);
    });
    if constexpr (Moments) {
        unroll<Closed>([&](auto a) FIRN_LAMBDA {
            sums.moment[a] = parts[0].moment[a] * w[0];
            unroll<int(K) - 1>([&](auto k) FIRN_LAMBDA {
                sums.moment[a] = plus_times(sums.moment[a], parts[k + 1].moment[a], w[k + 1]);
            });
        });
        // The moment is summed first over offsets 1 and −1, then over the others. Offset 0 adds nothing.
        if constexpr (Centre == 0)
            sums.moment[Closed] = parts[Centre + 1].value * w[Centre + 1];
        else
            sums.moment[Closed] = times_minus(parts[Centre + 1].value, w[Centre + 1], weighted[Centre - 1]);
        unroll<int(K)>([&](auto k) FIRN_LAMBDA {
            if constexpr (k < Centre - 1 || k > Centre + 1)
                sums.moment[Closed] =
                    plus_times(sums.moment[Closed], weighted[k], std::integral_constant<int, k - Centre>{});
        });
    }
    if constexpr (Gradients) {
        unroll<Closed>([&](auto a) FIRN_LAMBDA {
            sums.gradient[a] = parts[0].gradient[a] * w[0];
            unroll<int(K) - 1>([&](auto k) FIRN_LAMBDA {
                sums.gradient[a] = plus_times(sums.gradient[a], parts[k + 1].gradient[a], w[k + 1]);
            });
        });
        sums.gradient[Closed] = parts[0].value * g[0];
        unroll<int(K) - 1>([&](auto k) FIRN_LAMBDA {
            sums.gradient[Closed] = plus_times(sums.gradient[Closed], parts[k + 1].value, g[k + 1]);
        });
    }
    return sums;
}

}  // namespace firn::inline FIRN_BUILD
