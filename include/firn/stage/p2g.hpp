/// \file P2G of one particle: its record, and the value of the record at a node.
///
/// A node at offset o (whole cells from the particle's centre node) receives
///     N (p + A o) + G ∇N      momentum [kg m/s]        and        N m      mass [kg]
/// where p and A come from the transfer and the MLS form of the forces, and G from the weight-gradient form.
#pragma once

#include <firn/stage/offset.hpp>

namespace firn {

/// What P2G reads of a particle.
template <class S, int D>
struct P2GParticle {
    S mass;              ///< m [kg]
    S volume;            ///< V0, at rest [m^D]
    Vec<S, D> velocity;  ///< v [m/s]
    Mat<S, D> affine;    ///< C [1/s]; read by affine transfers only
    Mat<S, D> stress;    ///< Kirchhoff stress τ [Pa]
};

/// What P2G scatters to the nodes around a particle.
template <class S, int D>
struct P2GRecord {
    S mass;              ///< m [kg]
    Vec<S, D> momentum;  ///< p, at the centre node [kg m/s]
    Mat<S, D> affine;    ///< A [kg m/s a cell]
    Mat<S, D> gradient;  ///< G [kg m/s]; zero unless the force form uses weight gradients
};

/// The record of a particle: its momentum, its affine field and the impulse of its stress.
/// \param d  the particle's position from its centre node, in cells
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

/// A record along its path to a node. The node's offset is chosen axis by axis; an axis without an offset is open.
///
/// There are two ways. contract() closes one axis after the other; after the last one, `value` is what the node
/// receives. Or moved() goes along each axis, and weighted() weights the result: this needs fewer operations if many
/// nodes share products of weights.
/// \tparam V          momentum and mass of a node, or of a row of nodes
/// \tparam Open       the number of open axes, which are the leading ones
/// \tparam Gradients  whether the force form uses weight gradients
template <class V, int Open, bool Gradients>
struct OpenRecord {
    V value;                                                    ///< momentum and mass at the present offset
    std::array<V, std::size_t(Open)> column;                    ///< columns of A
    std::array<V, std::size_t(Gradients ? Open : 0)> gradient;  ///< columns of G

    /// Closes the last open axis at offset o, where the kernel has weight w and gradient g.
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

    /// The record at offset o along open axis a.
    template <class O>
    FIRN_INLINE OpenRecord moved(int a, const O& o) const {
        OpenRecord there = *this;
        there.value = plus_times(value, column[std::size_t(a)], o);
        return there;
    }
    /// What a node receives, after moved() was called for all open axes.
    /// \param weight     product of these axes' weights
    /// \param gradients  for each axis, the same product with its gradient in place of its weight
    template <class W>
    FIRN_INLINE V weighted(const W& weight, const std::array<W, std::size_t(Gradients ? Open : 0)>& gradients) const {
        return with_gradients(value * weight, gradients);
    }
    /// sum + weighted(…)
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

}  // namespace firn
