/// \file Scatters one matrix of each particle to the nodes around it: Σ Mₚ wᵢ, where wᵢ is the gradient of the node's
/// weight (WeightGradientForce), or Nᵢ D⁻¹ (xᵢ − xₚ) (MlsForce). It is the transpose of gathering ∇u = Σ uᵢ ⊗ wᵢ.
#pragma once

#include <firn/loops/p2g.hpp>
#include <firn/transfer/pic.hpp>

namespace firn::inline FIRN_BUILD {

/// What P2G sees of particles that scatter a matrix, in place of their momenta and stresses.
/// \tparam Field  how positions are stored: the type of ParticleView::position
template <std::floating_point S, int D, class Field>
struct MatrixView {
    using scalar_type = S;
    static constexpr int dimension = D;

    Field position;         ///< As ParticleView::position.
    BlockedSpan<S> matrix;  ///< D × D numbers of each slot, column by column: the matrix [J].
};

/// Reads the matrices of particles, and computes P2G records from them. Masses and momenta are zero.
template <std::floating_point S_, int D_, class Field>
class ParticleReader<MatrixView<S_, D_, Field>> {
public:
    using S = S_;                 ///< The scalar type: float or double.
    static constexpr int D = D_;  ///< The dimension: 2 or 3.

    /// Makes a reader of the particles of `view`, which must exist as long as the reader. The time step is not used.
    ParticleReader(const MatrixView<S, D, Field>& view, const Domain<D>& domain, double /* dt */)
        : view_(view), h_(S(domain.cell_size)) {}

    /// Returns the records of one register of particles.
    /// \param fraction  positions of the particles relative to their base nodes [cells]
    template <class Kernel, class Transfer, class Force, class P>
    FIRN_INLINE P2GRecord<P, D> record(const Slots& slots, const Vec<P, D>& fraction) const {
        P2GParticle<P, D> particle;
        particle.mass = P(0);
        particle.volume = P(-1);  // an impulse is −dt V0 times a stress
        particle.velocity = Vec<P, D>::zero();
        unroll<D * D>([&](auto k) FIRN_LAMBDA { particle.stress.m[k] = view_.matrix.template load<P>(slots, k); });
        return make_record<Kernel, Pic, Force>(particle, from_centre<Kernel>(fraction), P(h_), P(1));
    }

    /// Prefetches into the cache all values that record() reads, for the pack that begins at `slot`.
    template <class Transfer>
    FIRN_INLINE void prefetch(std::size_t slot) const {
        view_.position.template prefetch<D>(slot);
        view_.matrix.template prefetch<D * D>(slot);
    }

private:
    const MatrixView<S, D, Field>& view_;
    S h_;
};

/// Sets the present numbers of all nodes to the sums Σ Mₚ wᵢ [N] over the particles of all sets. The other numbers of a
/// node, its mass among them, are zero. The sums have the same bits for any number of threads.
/// \param threads  number of threads; 0: thread_count() chooses
/// \throws usage_error  in the cases in which p2g() throws it
template <class Kernel, class Force, std::floating_point S, int D, class Field>
void scatter_matrices(SparseGrid<S, D>& grid, int threads, ParticleSets<MatrixView<S, D, Field>> sets) {
    using View = MatrixView<S, D, Field>;
    detail::check_p2g(grid, 0, sets);
    const int workers = thread_count(threads);
    parallel_region(workers, [&] {
        S* const nodes = grid.nodes(0);
        detail::scatter_by_bands(
            grid,
            [&](std::size_t begin, std::size_t end) {
                detail::clear_blocks<D>(nodes, node_width, begin, end, workers);
            },
            [&](const ParticleSet<View>& set, PhaseRange phases) {
                detail::scatter_coloured<Kernel, Pic, Force>(set, grid, 0, workers, FloatSums<S>{}, nodes, phases);
            },
            sets);
    });
}

}  // namespace firn::inline FIRN_BUILD
