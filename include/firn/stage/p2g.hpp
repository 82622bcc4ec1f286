/// \file P2G of one particle: the particle's record, and its contributions to nodes.
///
/// A node with offset o from the particle's centre node (in cells) receives
///     N (p + A o) + G ∇N      momentum [kg m/s]        and        N m      mass [kg]
/// where N is the weight of the node and m the mass of the particle. The vector p and the matrix A come from the
/// transfer and from MLS forces, the matrix G from weight-gradient forces.
#pragma once

#include <firn/stage/offset.hpp>

namespace firn::inline FIRN_BUILD {

/// The values of a particle that P2G reads.
template <class S, int D>
struct P2GParticle {
    S mass;              ///< mass m [kg]
    S volume;            ///< initial volume V0 [m^D]
    Vec<S, D> velocity;  ///< velocity v [m/s]
    Mat<S, D> affine;    ///< affine field C [1/s]; used by affine transfers only
    Mat<S, D> stress;    ///< Kirchhoff stress τ [Pa]
};

/// The values of a particle from which its contributions to nodes are computed. A node with weight N and offset o from
/// the centre node receives the momentum N (p + A o) + G ∇N and the mass N m. \see firn/stage/p2g.hpp
template <class S, int D>
struct P2GRecord {
    S mass;              ///< mass m [kg]
    Vec<S, D> momentum;  ///< p: momentum, extrapolated to the centre node [kg m/s]
    Mat<S, D> affine;    ///< A: change of the momentum per cell [kg m/s]
    Mat<S, D> gradient;  ///< G: impulse that is multiplied by ∇N [kg m/s]; zero for MLS forces
};

/// Returns the record of a particle, from its momentum, its affine field and the impulse of its stress.
/// \param d  the particle's position relative to its centre node [cells]
/// \param h  cell size [m];  \param dt  time step [s]
template <class Kernel, class Transfer, class Force, scalar S, int D>
FIRN_INLINE P2GRecord<S, D> make_record(const P2GParticle<S, D>& particle, const Vec<S, D>& d, const S& h,
                                        const S& dt) {
    static_assert(require_inertia<Kernel, Force>());
    const S D_inverse = inverse_inertia<Kernel>(h);
    const Mat<S, D> impulse = particle.stress * (-(dt * particle.volume));
    Mat<S, D> A = Force::affine_part(impulse, D_inverse, h);
    if constexpr (Transfer::affine) A += particle.affine * (particle.mass * h);
    return {particle.mass, particle.velocity * particle.mass - A * d, A, Force::gradient_part(impulse, h)};
}

/// The P2G record of a particle on the way to its contribution to one node. The offset of the node from the particle's
/// centre node is chosen axis by axis. An axis is open as long as the offset along this axis is not chosen. The open
/// axes are always the first `Open` axes.
///
/// There are two ways to get the contribution to a node. Either call contract() for the last open axis until no axis is
/// open: then `value` is the contribution. Or call moved() for each open axis, and then weighted(), which returns the
/// contribution. The second way needs fewer operations if many nodes share products of weights.
/// \tparam V          type that holds momentum and mass, of one node or of a row of nodes
/// \tparam Open       the number of open axes
/// \tparam Gradients  whether the force policy uses weight gradients
template <class V, int Open, bool Gradients>
struct OpenRecord {
    V value;                                                    ///< momentum and mass at the chosen offset
    std::array<V, std::size_t(Open)> column;                    ///< columns of A, one for each open axis
    std::array<V, std::size_t(Gradients ? Open : 0)> gradient;  ///< columns of G, one for each open axis

    /// Returns the record at offset o along the last open axis, an axis along which no offset is chosen yet. w and g
    /// are the kernel's weight and gradient at this offset.
    template <class O, class W>
    FIRN_INLINE OpenRecord<V, Open - 1, Gradients> contract(const O& o, const W& w, const W& g) const {
        OpenRecord<V, Open - 1, Gradients> rest;
        rest.value = plus_times(value, column[Open - 1], o) * w;
        if constexpr (Gradients) rest.value = plus_times(rest.value, gradient[Open - 1], g);
        unroll<Open - 1>([&](auto a) FIRN_LAMBDA {
            rest.column[a] = column[a] * w;
            if constexpr (Gradients) rest.gradient[a] = gradient[a] * w;
        });
        return rest;
    }

    /// Returns the record moved by the offset o along the open axis a. The kernel's weight is not applied.
    template <class O>
    FIRN_INLINE OpenRecord moved(int a, const O& o) const {
        OpenRecord there = *this;
        there.value = plus_times(value, column[std::size_t(a)], o);
        return there;
    }
    /// Returns the contribution to a node. Call moved() for all open axes first.
    /// \param weight     product of the kernel's weights along all axes for which moved() was called
    /// \param gradients  for each of these axes: `weight`, but with the kernel's gradient in place of its weight along
    ///                   this axis
    template <class W>
    FIRN_INLINE V weighted(const W& weight, const std::array<W, std::size_t(Gradients ? Open : 0)>& gradients) const {
        return with_gradients(value * weight, gradients);
    }
    /// Returns `sum` plus the contribution weighted(weight, gradients).
    template <class W>
    FIRN_INLINE V added_to(const V& sum, const W& weight,
                           const std::array<W, std::size_t(Gradients ? Open : 0)>& gradients) const {
        return with_gradients(plus_times(sum, value, weight), gradients);
    }

private:
    template <class W, std::size_t N>
    FIRN_INLINE V with_gradients(V sum, const std::array<W, N>& gradients) const {
        unroll<int(N)>([&](auto a) FIRN_LAMBDA { sum = plus_times(sum, gradient[a], gradients[a]); });
        return sum;
    }
};

}  // namespace firn::inline FIRN_BUILD
