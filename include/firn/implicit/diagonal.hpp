/// \file The diagonal of the Hessian of an incremental potential: a D × D block for each node.
///
/// The blocks are sums of products of two weights, which no scatter of firn forms, so this file has its own loop over
/// the nodes around a particle. Groups of particles take turns as in P2G.
#pragma once

#include <firn/implicit/potential.hpp>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// The gradients wᵢ of the weights of the nodes around one particle, by which a force form scatters a matrix M: M wᵢ.
/// With the weight N and the offset o [cells] of a node from the particle, w = α N o + β ∇N, with ∇N in [1/cell].
template <class Kernel, class Force, std::floating_point S, int D>
class NodeGradients {
    static constexpr int K = Kernel::support;

public:
    /// \param h  cell size [m]
    explicit NodeGradients(S h) {
        const auto unit = Mat<S, D>::identity();
        alpha_ = Force::affine_part(unit, inverse_inertia<Kernel>(h), h)(0, 0);
        beta_ = Force::gradient_part(unit, h)(0, 0);
    }
    /// Reads the weights of the particle in lane l of a pack.
    template <class Places>
    FIRN_INLINE void read(const Places& pack, int l) {
        using P = native_pack<S>;
        const auto& weights = pack.weights;
        const int q = quad_offset<P>(l);
        for (int a = 0; a < D; ++a) {
            offset_[a] = S(-centre_node<Kernel>) - pack.from_centre_node[a][l];
            for (int k = 0; k < K; ++k) {
                weight_[a][k] = a < D - 1 ? weights.leading[a][k][l] : weights.last[q + k];
                if constexpr (Force::weight_gradients)
                    slope_[a][k] = a < D - 1 ? weights.leading_gradient[a][k][l] : weights.last_gradient[q + k];
            }
        }
    }
    /// Returns wᵢ [1/m] of a node. \param k  index of the node along each axis, from the base node
    FIRN_INLINE Vec<S, D> of(const std::array<int, std::size_t(D)>& k) const {
        Vec<S, D> w;
        for (int a = 0; a < D; ++a) {
            w.v[a] = slope(a, k[std::size_t(a)]);
            for (int b = 0; b < D; ++b)
                if (b != a) w.v[a] *= weight(b, k[std::size_t(b)]);
        }
        return w;
    }
    /// Returns the factor of a node's weight along an axis.
    FIRN_INLINE S weight(int a, int k) const { return weight_[a][k]; }
    /// Returns what stands for that factor in component a of wᵢ.
    FIRN_INLINE S slope(int a, int k) const {
        S slope = alpha_ * weight_[a][k] * (offset_[a] + S(k));
        if constexpr (Force::weight_gradients) slope += beta_ * slope_[a][k];
        return slope;
    }

private:
    S alpha_, beta_, weight_[D][K], slope_[D][K], offset_[D];
};

/// The derivative of a particle's matrix by ∇u, contracted with w on both sides: K = Σ C_s p_s, where p_s are the
/// products w_k w_l with k ≤ l.
template <std::floating_point S, int D>
struct QuadraticBlocks {
    using P = native_pack<S>;
    static constexpr int lanes = scalar_traits<P>::lanes, products = symmetric_size<D>;
    static constexpr int packs = (D * D + lanes - 1) / lanes;
    alignas(64) S of[products][packs * lanes] = {};  ///< C_s, column by column

    /// Takes the tangent of the particle in one lane. \see DisplacedSet::tangent
    template <class Tangent>
    FIRN_INLINE void read(const Tangent& by, int lane) {
        for (auto& block : of) std::fill_n(block, D * D, S(0));
        unroll<D>([&](auto k) FIRN_LAMBDA {
            unroll<D>([&](auto l) FIRN_LAMBDA {
                S* const to = of[symmetric_index<D>(k < l ? k : l, k < l ? l : k)];
                for (int b = 0; b < D; ++b)
                    for (int a = 0; a < D; ++a) to[a + D * b] += by[std::size_t(b + D * l)](a, k)[lane];
            });
        });
    }
    /// Adds K to D × D numbers, column by column.
    FIRN_INLINE void add_to(S* block, const Vec<S, D>& w) const {
        P sums[packs];
        for (P& sum : sums) sum = P(0);
        unroll<D>([&](auto k) FIRN_LAMBDA {
            unroll<D - k>([&](auto more) FIRN_LAMBDA {
                const P product(w.v[k] * w.v[k + more]);
                const S* const from = of[symmetric_index<D>(k, k + more)];
                for (int p = 0; p < packs; ++p) sums[p] = sums[p] + product * P::load(from + p * lanes);
            });
        });
        S numbers[packs * lanes];
        for (int p = 0; p < packs; ++p) sums[p].store(numbers + p * lanes);
        for (int i = 0; i < D * D; ++i) block[i] += numbers[i];
    }
};

/// Adds the blocks of a group's particles to those of the nodes around them.
template <class Kernel, class Force, class Set, class Places, std::floating_point S, int D>
void add_diagonal(const Set& set, const SparseGrid<S, D>& grid, double dt, const BlockGroup& group,
                  const Places& places, S* blocks) {
    using P = native_pack<S>;
    constexpr int lanes = scalar_traits<P>::lanes, K = Kernel::support;
    const BlockPartition<D>& partition = set.particles().partition;
    PackPlaces<Kernel, Force::weight_gradients, S, D> pack;
    NodeGradients<Kernel, Force, S, D> gradients(S(grid.domain().cell_size));
    QuadraticBlocks<S, D> quadratic;
    if (places.template has_strays<Kernel>(group)) throw_strays();
    for (std::size_t slot = 0; slot < group.particles; slot += lanes) {
        const int first = int(slot % pack_size);
        pack.locate(first, places.template position<P>(slot), Vec<P, D>::zero(), arena_size<Kernel>);
        const auto by = set.tangent(places.slots(slot), dt);
        for (int lane = 0; lane < lanes && slot + std::size_t(lane) < group.particles; ++lane) {
            gradients.read(pack, first + lane);
            quadratic.read(by, lane);
            RowsInGrid<Kernel, D> rows;
            rows.find(grid.neighbours(partition, places.blocks().range(slot + std::size_t(lane))),
                      pack.weights.corner[first + lane], [](auto) {});
            for (int row = 0; row < rows.count; ++row)
                for (int k = 0; k < K; ++k) {
                    const auto node = std::size_t(rows.number(row, k) / node_width);
                    std::array<int, std::size_t(D)> at{};
                    if constexpr (D == 2)
                        at = {row, k};
                    else
                        at = {row / K, row % K, k};
                    quadratic.add_to(blocks + node * std::size_t(D * D), gradients.of(at));
                }
        }
    }
}

}  // namespace detail

/// Computes the diagonal blocks of the Hessian at the last displacement of a potential. They have the same bits for any
/// number of threads.
/// \param blocks  gets D × D numbers of each node of the grid [N/m], column by column, in the order of the nodes
template <class Kernel, class Force, std::floating_point S, int D, class... Sets>
void hessian_diagonal(const IncrementalPotential<Kernel, Force, S, D, Sets...>& potential, aligned_vector<S>& blocks) {
    const SparseGrid<S, D>& grid = potential.grid();
    const int workers = thread_count(potential.threads());
    const auto add = [&](const auto& set) {
        const auto& particles = set.particles();
        using View = std::remove_cvref_t<decltype(particles.view)>;
        const Positions<View> positions(grid.domain());
        for_groups_by_phase(particles.partition, workers, [&](const BlockGroup& group, int) {
            const GroupPlaces<View> places(particles.view, particles.partition, group, positions);
            detail::add_diagonal<Kernel, Force>(set, grid, potential.dt(), group, places, blocks.data());
        });
    };
    parallel_region(workers, [&] {
        renew(blocks, grid.block_count() * std::size_t(block_nodes<D> * D * D), workers);
        detail::fill_chunks(blocks, S(0), workers);
        std::apply([&](const auto&... set) { (add(set), ...); }, potential.sets());
    });
}

}  // namespace firn::inline FIRN_BUILD
