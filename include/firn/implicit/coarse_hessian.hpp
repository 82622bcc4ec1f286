/// \file The Hessian of an incremental potential on the first coarse level of a multigrid, directly from the particles.
///
/// With the prolongation P and the free axes T of the fine nodes, it is Pᵀ T K T P, without the K of the fine level: to
/// a particle, the gradient of a coarse node's weight is the sum of those of fine nodes, w_I = Σ P_iI T_i w_i. Along an
/// axis that T holds at some nodes, the gradients differ from those along the others.
#pragma once

#include <firn/implicit/diagonal.hpp>
#include <firn/implicit/stencil_level.hpp>

namespace firn::inline FIRN_BUILD {

/// Number of coarse nodes along each axis that a particle reaches by way of the fine nodes.
template <class Kernel>
inline constexpr int coarse_support = Kernel::support / 2 + 2;

namespace detail {

/// Cuts the groups of a partition into phases: groups of one phase share no coarse node. Those of dense blocks come
/// first, then those of cubes of sparse blocks.
template <class Kernel, int D>
class CoarsePhases {
public:
    explicit CoarsePhases(const BlockPartition<D>& partition, const Domain<D>& domain) {
        // A block's particles reach the coarse nodes 2 b to 2 b + 3 + support/2, those of a cube with the coordinate c
        // the nodes 4 c to 4 c + 5 + support/2.
        static_assert(allowed_drift == 1 && block_size == 4 && Kernel::support <= 5);
        std::array<int, std::size_t(D)> colours{};
        std::size_t dense = 1;
        for (int a = 0; a < D; ++a) {
            const int n = block_period(domain, a) % 3 == 0 ? 3 : 4;
            colours[std::size_t(a)] = n;
            dense *= std::size_t(n);
        }
        const std::size_t phases = dense + (std::size_t(1) << D);
        std::vector<std::vector<std::uint32_t>> of_phase(phases);
        for (std::uint32_t g = 0; g < partition.groups.size(); ++g) {
            const BlockGroup& group = partition.groups[g];
            const BlockCoordinate<D>& block = partition.ranges[group.first_range].block;
            std::size_t phase = 0;
            for (std::size_t a = 0; a < std::size_t(D); ++a)
                phase = group.sparse ? 2 * phase + std::size_t(block[a] >> 1 & 1)
                                     : std::size_t(colours[a]) * phase + std::size_t(modulo(block[a], colours[a]));
            of_phase[phase + (group.sparse ? dense : 0)].push_back(g);
        }
        for (const auto& groups : of_phase) {
            begins_.push_back(groups_.size());
            counts_.push_back(groups.size());
            groups_.insert(groups_.end(), groups.begin(), groups.end());
        }
    }
    /// Calls f(index of a group) for all groups, phase by phase.
    template <class F>
    void run(int workers, const F& f) const {
        parallel_phases(std::span<const std::size_t>(counts_), workers,
                        [&](std::size_t phase, std::size_t i, int) { f(groups_[begins_[phase] + i]); });
    }

private:
    std::vector<std::uint32_t> groups_;
    std::vector<std::size_t> begins_, counts_;
};

/// One particle's share of the coarse Hessian.
template <class Kernel, std::floating_point S, int D>
class CoarseParticle {
    static constexpr int K = Kernel::support, C = coarse_support<Kernel>, N = D * D;
    static constexpr int power(int n, int exponent) { return exponent == 0 ? 1 : n * power(n, exponent - 1); }

public:
    static constexpr int fine = power(K, D), coarse = power(C, D);
    using Level = StencilLevel<S, D, C - 1>;

    /// Begins a particle. \param base  its base node, from the node before its block's first one
    FIRN_INLINE void begin(const std::array<int, std::size_t(D)>& base) { base_ = base; }
    /// Takes the gradient of one fine node's weight. \param free  bit a: whether the node is free along axis a
    FIRN_INLINE void set(int node, const Vec<S, D>& w, unsigned free) {
        for (int k = 0; k < D; ++k)
            for (int a = 0; a < D; ++a) of_fine_[node * N + a + D * k] = (free >> a & 1) != 0 ? w.v[k] : S(0);
    }
    /// Computes the gradients of the coarse nodes' weights: number a + D k is component k of that for motion along a.
    FIRN_INLINE void weigh() {
        const S* from = of_fine_;
        unroll<D>([&](auto axis) FIRN_LAMBDA {
            constexpr int before = power(C, axis), after = power(K, D - 1 - axis) * N;
            S* const to = axis == D - 1 ? of_coarse_ : sums_[axis & 1];
            std::fill_n(to, before * C * after, S(0));
            const int base = base_[std::size_t(axis)];
            for (int i = 0; i < before; ++i)
                for (int k = 0; k < K; ++k) {
                    const int place = base + k, first = place / 2 - base / 2;  // place 0 is an odd node
                    for (int parent = 0; parent < 2; ++parent) {
                        const S weight = S(parent_weight(place + 1, parent));
                        S* const row = to + (i * C + first + parent) * after;
                        const S* const values = from + (i * K + k) * after;
                        for (int n = 0; n < after; ++n) row[n] += weight * values[n];
                    }
                }
            from = to;
        });
    }
    /// Takes the tangent of the particle in one lane. \see DisplacedSet::tangent
    template <class Tangent>
    FIRN_INLINE void read(const Tangent& by, int lane) {
        for (int k = 0; k < D; ++k)
            for (int l = 0; l < D; ++l)
                for (int b = 0; b < D; ++b)
                    for (int a = 0; a < D; ++a) tangent_[k][l][a + D * b] = by[std::size_t(b + D * l)](a, k)[lane];
        for (int J = 0; J < coarse; ++J)
            for (int k = 0; k < D; ++k)
                for (int b = 0; b < D; ++b)
                    for (int a = 0; a < D; ++a) {
                        S sum = S(0);
                        for (int l = 0; l < D; ++l) sum += tangent_[k][l][a + D * b] * of_coarse_[J * N + b + D * l];
                        stress_[k][J * N + a + D * b] = sum;
                    }
    }
    /// Adds the blocks of all pairs of coarse nodes; of a symmetric matrix, at least those of a node with itself and
    /// with later ones. \param index  index(c): the index of coarse node c in the level, or no_node
    template <bool is_symmetric, class Index>
    FIRN_INLINE void add_to(Level& level, const Index& index) const {
        constexpr int lines = coarse / C;
        for (int I = 0; I < coarse; ++I) {
            const std::uint32_t node = index(I);
            if (node == no_node) continue;
            S weights[D][C * N];
            for (int k = 0; k < D; ++k)
                for (int n = 0; n < C * D; ++n)
                    for (int a = 0; a < D; ++a) weights[k][n * D + a] = of_coarse_[I * N + a + D * k];
            S* const row = level.row(node);
            for (int line = is_symmetric ? I / C : 0; line < lines; ++line) {
                std::array<int, std::size_t(D)> offset{};
                for (int a = D - 1, of_J = line * C, of_I = I; a >= 0; --a, of_J /= C, of_I /= C)
                    offset[std::size_t(a)] = of_J % C - of_I % C;
                S* const to = row + Level::block_of(offset) * N;
                if constexpr (D == 2) {
                    const S *const s0 = stress_[0] + line * C * N, *const s1 = stress_[1] + line * C * N;
                    for (int n = 0; n < C * N; ++n) to[n] += weights[0][n] * s0[n] + weights[1][n] * s1[n];
                } else {
                    const S *const s0 = stress_[0] + line * C * N, *const s1 = stress_[1] + line * C * N,
                                   *const s2 = stress_[2] + line * C * N;
                    for (int n = 0; n < C * N; ++n)
                        to[n] += weights[0][n] * s0[n] + weights[1][n] * s1[n] + weights[2][n] * s2[n];
                }
            }
        }
    }

private:
    std::array<int, std::size_t(D)> base_{};
    S of_fine_[fine * N], of_coarse_[coarse * N], sums_[2][power(K > C ? K : C, D) * N];
    S tangent_[D][D][N], stress_[D][coarse * N];
};

/// Adds the Hessian of the particles of one group.
template <class Kernel, class Force, bool is_symmetric, class Set, class Places, std::floating_point S, int D>
void add_coarse_hessian(const Set& set, const SparseGrid<S, D>& grid, double dt, const BlockGroup& group,
                        const Places& places, const std::uint8_t* free,
                        StencilLevel<S, D, coarse_support<Kernel> - 1>& level) {
    using P = native_pack<S>;
    constexpr int lanes = scalar_traits<P>::lanes, K = Kernel::support, C = coarse_support<Kernel>;
    constexpr int n = arena_size<Kernel>, window = C + 2;  // coarse nodes that the particles of a block reach
    const BlockPartition<D>& partition = set.particles().partition;
    PackPlaces<Kernel, Force::weight_gradients, S, D> pack;
    NodeGradients<Kernel, Force, S, D> gradients(S(grid.domain().cell_size));
    CoarseParticle<Kernel, S, D> particle;
    std::array<std::uint32_t, std::size_t(D == 2 ? window * window : window * window * window)> near;
    std::uint32_t range = no_node;
    if (places.template has_strays<Kernel>(group)) throw_strays();
    for (std::size_t slot = 0; slot < group.particles; slot += lanes) {
        const int first = int(slot % pack_size);
        pack.locate(first, places.template position<P>(slot), Vec<P, D>::zero(), arena_size<Kernel>);
        const auto by = set.tangent(places.slots(slot), dt);
        for (int lane = 0; lane < lanes && slot + std::size_t(lane) < group.particles; ++lane) {
            if (const std::uint32_t of_slot = places.blocks().range(slot + std::size_t(lane)); of_slot != range) {
                range = of_slot;
                BlockCoordinate<D> low = partition.ranges[range].block;
                for (int& along : low) along *= 2;
                level.nodes().indices(low, window, near.data());
            }
            gradients.read(pack, first + lane);
            RowsInGrid<Kernel, D> rows;
            rows.find(grid.neighbours(partition, range), pack.weights.corner[first + lane], [](auto) {});
            std::array<int, std::size_t(D)> base{};
            for (int a = D - 1, rest = int(pack.weights.corner[first + lane]) / node_width; a >= 0; --a, rest /= n)
                base[std::size_t(a)] = rest % n;
            particle.begin(base);
            for (int row = 0; row < rows.count; ++row)
                for (int k = 0; k < K; ++k) {
                    std::array<int, std::size_t(D)> at{};
                    if constexpr (D == 2)
                        at = {row, k};
                    else
                        at = {row / K, row % K, k};
                    particle.set(row * K + k, gradients.of(at), free[rows.number(row, k) / node_width]);
                }
            particle.weigh();
            particle.read(by, lane);
            particle.template add_to<is_symmetric>(level, [&](int c) FIRN_LAMBDA {
                int index = 0;
                for (int a = 0, size = CoarseParticle<Kernel, S, D>::coarse; a < D; ++a) {
                    size /= C;
                    index = index * window + base[std::size_t(a)] / 2 + c / size % C;
                }
                return near[std::size_t(index)];
            });
        }
    }
}

}  // namespace detail

/// Adds the Hessian at the last displacement of a potential to the matrix of the first coarse level.
/// \param free  for each node of the grid, bit a: whether it moves by coarse nodes along axis a
template <class Kernel, class Force, std::floating_point S, int D, class... Sets>
void add_coarse_hessian(const IncrementalPotential<Kernel, Force, S, D, Sets...>& potential, const std::uint8_t* free,
                        StencilLevel<S, D, coarse_support<Kernel> - 1>& level) {
    constexpr bool is_symmetric = IncrementalPotential<Kernel, Force, S, D, Sets...>::is_symmetric;
    const SparseGrid<S, D>& grid = potential.grid();
    const int workers = thread_count(potential.threads());
    const auto add = [&](const auto& set) {
        const auto& particles = set.particles();
        using View = std::remove_cvref_t<decltype(particles.view)>;
        const Positions<View> positions(grid.domain());
        const detail::CoarsePhases<Kernel, D> phases(particles.partition, grid.domain());
        phases.run(workers, [&](std::uint32_t g) {
            const BlockGroup& group = particles.partition.groups[g];
            const GroupPlaces<View> places(particles.view, particles.partition, group, positions);
            detail::add_coarse_hessian<Kernel, Force, is_symmetric>(set, grid, potential.dt(), group, places, free,
                                                                    level);
        });
    };
    std::apply([&](const auto&... set) { (add(set), ...); }, potential.sets());
    if (is_symmetric) level.mirror();
}

}  // namespace firn::inline FIRN_BUILD
