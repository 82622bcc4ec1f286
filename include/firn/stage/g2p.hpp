/// \file G2P of one particle: its velocity, affine field and velocity gradient, from sums over nodes.
#pragma once

#include <firn/stage/offset.hpp>

namespace firn {

/// Sums over the nodes around a particle.
template <class S, int D>
struct G2PSums {
    Vec<S, D> velocity;  ///< Σ N v_i [m/s]
    Mat<S, D> moment;    ///< Σ N v_i oᵀ, o in cells from the centre node [m/s]; for affine transfers
    Mat<S, D> gradient;  ///< Σ v_i ∇Nᵀ, ∇N per cell [m/s]; where weight gradients are needed
};

/// Whether G2P needs the sum Σ N v_i oᵀ.
template <class Kernel, class Transfer>
inline constexpr bool g2p_needs_moment = Transfer::affine && has_inertia<Kernel>;
/// Whether G2P needs the sum Σ v_i ∇Nᵀ.
template <class Kernel, class Transfer, class Force>
inline constexpr bool g2p_needs_gradient = Force::weight_gradients || !g2p_needs_moment<Kernel, Transfer>;

/// What a particle receives from the grid.
template <class S, int D>
struct G2PResult {
    Vec<S, D> velocity;           ///< v [m/s]
    Mat<S, D> affine;             ///< C [1/s]
    Mat<S, D> velocity_gradient;  ///< ∇v, which moves F [1/s]
};

/// A particle's velocity, C and velocity gradient from its sums. If the transfer is affine and MLS forces act, which
/// are dual to C (Hu et al. 2018, §4), the velocity gradient is C. Otherwise it is Σ v_i ⊗ ∇N_i.
/// \param d  the particle's position from its centre node, in cells;  \param h  cell size [m]
template <class Kernel, class Transfer, class Force, scalar S, int D>
FIRN_INLINE G2PResult<S, D> take_from_grid(const G2PSums<S, D>& sums, const Vec<S, D>& d, const S& h) {
    G2PResult<S, D> result;
    result.velocity = sums.velocity;
    const S D_inverse = inverse_inertia<Kernel>(h);
    if constexpr (g2p_needs_moment<Kernel, Transfer>)
        result.affine = Transfer::affine_field((sums.moment - outer(sums.velocity, d)) * h * D_inverse);
    else if constexpr (Transfer::affine)
        result.affine = Transfer::affine_field(sums.gradient * (S(1) / h));  // the same as B D⁻¹
    else
        result.affine = Mat<S, D>::zero();
    if constexpr (g2p_needs_gradient<Kernel, Transfer, Force>)
        result.velocity_gradient = sums.gradient * (S(1) / h);
    else
        result.velocity_gradient = result.affine;
    return result;
}

/// Where a particle is after a step.
template <class S, int D>
struct G2PMove {
    Vec<S, D> position;  ///< the new position, kept between two corners
    S outside;           ///< how far it would have gone beyond them along any axis; not positive if it stays inside
};
/// Moves a particle by its velocity, and keeps it between two corners.
/// \param per_velocity  the factor from a velocity [m/s] to the motion in dt, in units of the position
/// \param lowest, highest  the corners, in units of the position
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

/// Sums over the nodes along some of the axes; the dual of OpenRecord.
/// \tparam V       the velocity of a node, or of a row of nodes
/// \tparam Closed  the number of axes summed over
template <class V, int Closed, bool Moments, bool Gradients>
struct PartialSums {
    V value;                                                      ///< Σ N v
    std::array<V, std::size_t(Moments ? Closed : 0)> moment;      ///< Σ N v o, one for each axis
    std::array<V, std::size_t(Gradients ? Closed : 0)> gradient;  ///< Σ ∂N v, one for each axis
};

/// Sums over one more axis.
/// \tparam Centre  the place of the centre node in `parts`
/// \param parts  the sums of the nodes at offsets k − Centre
/// \param w      the kernel's weight at each of these offsets;  \param g  its gradient
template <int Centre, class V, int Closed, bool Moments, bool Gradients, class W, std::size_t K>
FIRN_INLINE PartialSums<V, Closed + 1, Moments, Gradients> sum_axis(
    const std::array<PartialSums<V, Closed, Moments, Gradients>, K>& parts, const std::array<W, K>& w,
    const std::array<W, K>& g) {
    PartialSums<V, Closed + 1, Moments, Gradients> sums;
    // The moment along this axis needs some of the products, too: they are computed once. The product of offset 1 is
    // not shared, because it is free on targets that multiply and add in one operation.
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
        // Offsets 1 and −1 first, then the others. Offset 0 adds nothing.
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

}  // namespace firn
