/// \file The Hessian of an incremental potential on the first coarse level of a multigrid, directly from the particles.
///
/// With the prolongation P and the free axes T of the fine nodes, it is Pᵀ T K T P, without the K of the fine level: to
/// a particle, the gradient of a coarse node's weight is the sum of those of fine nodes, w_I = Σ P_iI T_i w_i. Along an
/// axis that T holds at some nodes, the gradients differ from those along the others. A node behind a mirrored wall
/// moves by the parents of its image, so T P is continued behind the wall as displacements are.
#pragma once

#include <firn/implicit/diagonal.hpp>
#include <firn/implicit/mirrored_nodes.hpp>
#include <firn/implicit/stencil_level.hpp>

#include <memory>
#include <span>

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
    /// Calls f(index of a group, worker) for all groups, phase by phase.
    template <class F>
    void run(int workers, const F& f) const {
        parallel_phases(std::span<const std::size_t>(counts_), workers,
                        [&](std::size_t phase, std::size_t i, int worker) { f(groups_[begins_[phase] + i], worker); });
    }

private:
    std::vector<std::uint32_t> groups_;
    std::vector<std::size_t> begins_, counts_;
};

/// Sums the blocks of all pairs of coarse nodes around particles that reach the same coarse nodes.
template <class Kernel, std::floating_point S, int D>
class CoarseBlocks {
    using P = native_pack<S>;
    static constexpr int lanes = scalar_traits<P>::lanes, N = D * D, C = coarse_support<Kernel>;
    static constexpr int padded(int n) { return (n + lanes - 1) / lanes * lanes; }

public:
    static constexpr int coarse = D == 2 ? C * C : C * C * C;  ///< Number of coarse nodes that a particle reaches.
    static constexpr int lines = coarse / C;                   ///< Number of lines of these along the last axis.
    static constexpr int block = padded(N);                    ///< Numbers of memory for a block.
    using Level = StencilLevel<S, D, C - 1>;
    using Nodes = std::array<std::uint32_t, std::size_t(coarse)>;
    /// The derivatives of a particle's matrix: number a + D b of (k, l) is that of element (a, k) by (b, l) of ∇u.
    using Tangent = std::array<S, std::size_t(N* block)>;
    /// The gradients of the coarse nodes' weights: D components of each.
    using Gradients = std::array<S, std::size_t(coarse* D)>;

    /// Adds a particle. \param of_axes  the gradients for motion along each axis; or one for all
    template <bool is_symmetric>
    FIRN_INLINE void add(Level& level, const Nodes& nodes, const Tangent& tangent, std::span<const Gradients> of_axes) {
        // With gradients that differ, the rows of each axis count as a particle of their own.
        for (std::size_t a = 0; a < of_axes.size(); ++a) {
            if (count_ == most) flush<is_symmetric>(level, nodes);
            gradients_[count_] = of_axes[a];
            if (of_axes.size() == 1)
                find_stresses(tangent, of_axes[0]);
            else
                find_stresses(tangent, of_axes, int(a));
            ++count_;
        }
    }
    /// Adds the sums of the particles so far to the matrix of the level: of a symmetric matrix, at least the blocks of
    /// a node with itself and with later ones.
    template <bool is_symmetric>
    void flush(Level& level, const Nodes& nodes) {
        for (int line = 0; line < lines && count_ > 0; ++line)
            for (int of_row = 0; of_row < (is_symmetric ? line + 1 : lines); ++of_row) {
                P sums[C][packs];
                for (auto& sum : sums)
                    for (P& one : sum) one = P(0);
                for (int e = 0; e < count_; ++e) {
                    const S* from = stresses_[line][e];
                    const S* const gradients = gradients_[e].data() + of_row * C * D;
                    for (int k = 0; k < D; ++k, from += stride) {
                        P stress[packs];
                        for (int p = 0; p < packs; ++p) stress[p] = P::load(from + p * lanes);
                        for (int i = 0; i < C; ++i) {
                            const P gradient(gradients[i * D + k]);
                            for (int p = 0; p < packs; ++p) sums[i][p] = sums[i][p] + gradient * stress[p];
                        }
                    }
                }
                std::array<int, std::size_t(D)> offset{};
                for (int a = D - 2, of_J = line, of_I = of_row; a >= 0; --a, of_J /= C, of_I /= C)
                    offset[std::size_t(a)] = of_J % C - of_I % C;
                for (int i = 0; i < C; ++i) {
                    const std::uint32_t node = nodes[std::size_t(of_row * C + i)];
                    if (node == no_node) continue;
                    offset.back() = -i;
                    S numbers[packs * lanes];
                    for (int p = 0; p < packs; ++p) sums[i][p].store(numbers + p * lanes);
                    S* const to = level.row(node) + Level::block_of(offset) * N;
                    for (int n = 0; n < C * N; ++n) to[n] += numbers[n];
                }
            }
        count_ = 0;
    }

private:
    static constexpr int most = 16, packs = padded(C * N) / lanes, stride = padded((C - 1) * N + block);

    FIRN_INLINE void find_stresses(const Tangent& tangent, const Gradients& gradients) {
        for (int k = 0; k < D; ++k) {
            P by[D][block / lanes];
            for (int l = 0; l < D; ++l)
                for (int p = 0; p < block / lanes; ++p)
                    by[l][p] = P::load(tangent.data() + (k * D + l) * block + p * lanes);
            for (int J = 0; J < coarse; ++J) {
                S* const to = stresses_[J / C][count_] + k * stride + J % C * N;  // the next one overwrites the padding
                for (int p = 0; p < block / lanes; ++p) {
                    P sum = by[0][p] * P(gradients[std::size_t(J * D)]);
                    for (int l = 1; l < D; ++l) sum = sum + by[l][p] * P(gradients[std::size_t(J * D + l)]);
                    sum.store(to + p * lanes);
                }
            }
        }
    }
    void find_stresses(const Tangent& tangent, std::span<const Gradients> of_axes, int only) {
        for (int k = 0; k < D; ++k)
            for (int J = 0; J < coarse; ++J) {
                S* const to = stresses_[J / C][count_] + k * stride + J % C * N;
                std::fill_n(to, block, S(0));
                for (int b = 0; b < D; ++b)
                    for (int l = 0; l < D; ++l)
                        to[only + D * b] += tangent[std::size_t((k * D + l) * block + only + D * b)] *
                                            of_axes[std::size_t(b)][std::size_t(J * D + l)];
            }
    }

    int count_ = 0;
    Gradients gradients_[most];
    alignas(64) S stresses_[lines][most][D * stride];
};

/// The gradients of the weights of the coarse nodes around one particle.
template <class Kernel, std::floating_point S, int D>
class CoarseGradients {
    static constexpr int K = Kernel::support, C = coarse_support<Kernel>;
    using Blocks = CoarseBlocks<Kernel, S, D>;

public:
    using Place = std::array<int, std::size_t(D)>;

    /// Begins a particle. \param base  its base node, from the node before its block's first one
    FIRN_INLINE void begin(const Place& base) {
        for (int a = 0; a < D; ++a)
            for (int k = 0; k < K; ++k) {
                const int place = base[std::size_t(a)] + k;  // place 0 is an odd node
                first_[a][k] = place / 2 - base[std::size_t(a)] / 2;
                first_weight_[a][k] = S(parent_weight(place + 1, 0));
            }
    }
    /// Computes the gradients if all fine nodes are free: they are products of sums along the axes.
    template <class Fine>
    FIRN_INLINE void of_free(const Fine& fine, typename Blocks::Gradients& to) const {
        S weight[D][C] = {}, slope[D][C] = {};
        for (int a = 0; a < D; ++a)
            for (int k = 0; k < K; ++k)
                for (int parent = 0; parent < 2; ++parent) {
                    const S part = parent == 0 ? first_weight_[a][k] : S(1) - first_weight_[a][k];
                    weight[a][first_[a][k] + parent] += part * fine.weight(a, k);
                    slope[a][first_[a][k] + parent] += part * fine.slope(a, k);
                }
        for (int J = 0; J < Blocks::coarse; ++J) {
            const Place at = place<C>(J);
            for (int a = 0; a < D; ++a) {
                S product = slope[a][at[std::size_t(a)]];
                for (int b = 0; b < D; ++b)
                    if (b != a) product *= weight[b][at[std::size_t(b)]];
                to[std::size_t(J * D + a)] = product;
            }
        }
    }
    /// Computes the gradients for motion along one axis. \param free  bit a of one: whether a node is free along axis a
    /// \param images  how nodes follow their mirror images. \see MirroredNodes::Image
    template <class Fine>
    void of_axis(const Fine& fine, const std::uint8_t* free, const std::uint16_t* images, int axis,
                 typename Blocks::Gradients& to) const {
        to.fill(S(0));
        for (int i = 0; i < (D == 2 ? K * K : K * K * K); ++i) {
            if ((free[i] >> axis & 1) == 0) continue;
            Place k = place<K>(i);
            const Vec<S, D> w = (images[i] >> (6 + axis) & 1) != 0 ? -fine.of(k) : fine.of(k);
            if (!follow(images[i], k)) continue;
            for (int e = 0; e < 1 << D; ++e) {
                int J = 0;
                S part = S(1);
                for (int a = 0; a < D; ++a) {
                    const int parent = e >> a & 1;
                    J = J * C + first_[a][k[std::size_t(a)]] + parent;
                    const S first = first_weight_[a][k[std::size_t(a)]];
                    part *= parent == 0 ? first : S(1) - first;
                }
                for (int a = 0; a < D; ++a) to[std::size_t(J * D + a)] += part * w.v[a];
            }
        }
    }

private:
    /// Goes to the mirror image of a node. \return  whether it is among those around the particle: it is, unless the
    /// particle lies behind the wall
    static bool follow(std::uint16_t image, Place& k) {
        bool is_around = true;
        for (int a = 0; a < D; ++a) {
            int& along = k[std::size_t(a)];
            if ((image >> a & 1) != 0) along += (image >> (3 + a) & 1) != 0 ? -2 : 2;
            is_around = is_around && along >= 0 && along < K;
        }
        return is_around;
    }
    template <int width>
    FIRN_INLINE static Place place(int i) {
        Place at{};
        for (int a = D - 1; a >= 0; --a, i /= width) at[std::size_t(a)] = i % width;
        return at;
    }
    int first_[D][K];
    S first_weight_[D][K];
};

/// Memory of one worker that sums up the coarse Hessian.
template <class Kernel, std::floating_point S, int D>
struct CoarseMemory {
    using Blocks = CoarseBlocks<Kernel, S, D>;
    static constexpr std::size_t most = 256;  ///< particles at a time
    struct Particle {
        std::uint32_t reach, index, axes;  ///< what coarse nodes it reaches; of its tangent; 1 or D gradients
        std::size_t first;                 ///< index of the first of these
    };

    Blocks blocks;
    std::vector<Particle> particles{};
    std::vector<typename Blocks::Tangent> tangents = std::vector<typename Blocks::Tangent>(most);
    std::vector<typename Blocks::Gradients> gradients = std::vector<typename Blocks::Gradients>(most * D);
};

/// Adds the Hessian of the particles of one group.
template <class Kernel, class Force, bool is_symmetric, class Set, class Places, std::floating_point S, int D>
void add_coarse_hessian(const Set& set, const SparseGrid<S, D>& grid, double dt, const BlockGroup& group,
                        const Places& places, const std::uint8_t* free, const std::uint16_t* images,
                        StencilLevel<S, D, coarse_support<Kernel> - 1>& level, CoarseMemory<Kernel, S, D>& memory) {
    using P = native_pack<S>;
    using Blocks = CoarseBlocks<Kernel, S, D>;
    constexpr int lanes = scalar_traits<P>::lanes, K = Kernel::support, C = coarse_support<Kernel>;
    constexpr int n = arena_size<Kernel>, fine = D == 2 ? K * K : K * K * K, reaches = 27;
    const BlockPartition<D>& partition = set.particles().partition;
    PackPlaces<Kernel, Force::weight_gradients, S, D> pack;
    NodeGradients<Kernel, Force, S, D> gradients(S(grid.domain().cell_size));
    CoarseGradients<Kernel, S, D> coarse;
    if (places.template has_strays<Kernel>(group)) throw_strays();
    const auto sum_up = [&] {
        auto& particles = memory.particles;
        std::sort(particles.begin(), particles.end(), [](const auto& a, const auto& b) {
            return a.reach != b.reach ? a.reach < b.reach : a.index < b.index;
        });
        typename Blocks::Nodes nodes{};
        for (std::size_t i = 0; i < particles.size(); ++i) {
            const auto& one = particles[i];
            if (i == 0 || one.reach != particles[i - 1].reach) {
                if (i > 0) memory.blocks.template flush<is_symmetric>(level, nodes);
                BlockCoordinate<D> low = partition.ranges[one.reach / reaches].block;
                for (int a = D - 1, rest = int(one.reach % reaches); a >= 0; --a, rest /= 3)
                    low[std::size_t(a)] = 2 * low[std::size_t(a)] + rest % 3;
                level.nodes().indices(low, C, nodes.data());
            }
            memory.blocks.template add<is_symmetric>(level, nodes, memory.tangents[one.index],
                                                     {memory.gradients.data() + one.first, one.axes});
        }
        memory.blocks.template flush<is_symmetric>(level, nodes);
        particles.clear();
    };
    std::size_t used = 0;
    for (std::size_t slot = 0; slot < group.particles; slot += lanes) {
        const int first = int(slot % pack_size);
        pack.locate(first, places.template position<P>(slot), Vec<P, D>::zero(), n);
        const auto by = set.tangent(places.slots(slot), dt);
        for (int lane = 0; lane < lanes && slot + std::size_t(lane) < group.particles; ++lane) {
            const std::uint32_t range = places.blocks().range(slot + std::size_t(lane));
            gradients.read(pack, first + lane);
            const auto index = std::uint32_t(memory.particles.size());
            auto& tangent = memory.tangents[index];
            tangent.fill(S(0));
            for (int k = 0; k < D; ++k)
                for (int l = 0; l < D; ++l)
                    for (int b = 0; b < D; ++b)
                        for (int a = 0; a < D; ++a)
                            tangent[std::size_t((k * D + l) * Blocks::block + a + D * b)] =
                                by[std::size_t(b + D * l)](a, k)[lane];
            std::array<int, std::size_t(D)> base{};
            for (int a = D - 1, rest = int(pack.weights.corner[first + lane]) / node_width; a >= 0; --a, rest /= n)
                base[std::size_t(a)] = rest % n;
            std::uint32_t reach = range;
            for (const int along : base) reach = 3 * reach + std::uint32_t(along / 2);
            if (D == 2) reach += range * (reaches - 9);
            coarse.begin(base);
            RowsInGrid<Kernel, D> rows;
            rows.find(grid.neighbours(partition, range), pack.weights.corner[first + lane], [](auto) {});
            std::uint8_t free_here[fine], all = (1 << D) - 1;
            std::uint16_t images_here[fine] = {}, any_image = 0;
            for (int i = 0; i < fine; ++i) {
                const auto node = rows.number(i / K, i % K) / node_width;
                all &= free_here[i] = free[node];
                if (images) any_image |= images_here[i] = images[node];
            }
            const bool is_free = all == (1 << D) - 1 && any_image == 0;
            memory.particles.push_back({reach, index, is_free ? 1u : unsigned(D), used});
            if (is_free)
                coarse.of_free(gradients, memory.gradients[used++]);
            else
                for (int a = 0; a < D; ++a)
                    coarse.of_axis(gradients, free_here, images_here, a, memory.gradients[used++]);
        }
        if (memory.particles.size() + lanes > memory.most) {
            sum_up();
            used = 0;
        }
    }
    sum_up();
}

}  // namespace detail

/// Adds the Hessian at the last displacement of a potential to the matrix of the first coarse level.
/// \param free    for each node of the grid, bit a: whether it moves by coarse nodes along axis a
/// \param images  for each node, how it follows its mirror image; nullptr: none does. \see MirroredNodes::Image
template <class Kernel, class Force, std::floating_point S, int D, class... Sets>
void add_coarse_hessian(const IncrementalPotential<Kernel, Force, S, D, Sets...>& potential, const std::uint8_t* free,
                        const std::uint16_t* images, StencilLevel<S, D, coarse_support<Kernel> - 1>& level) {
    constexpr bool is_symmetric = IncrementalPotential<Kernel, Force, S, D, Sets...>::is_symmetric;
    const SparseGrid<S, D>& grid = potential.grid();
    const int workers = thread_count(potential.threads());
    std::vector<std::unique_ptr<detail::CoarseMemory<Kernel, S, D>>> memory(std::size_t(std::max(workers, 1)));
    const auto add = [&](const auto& set) {
        const auto& particles = set.particles();
        using View = std::remove_cvref_t<decltype(particles.view)>;
        const Positions<View> positions(grid.domain());
        const detail::CoarsePhases<Kernel, D> phases(particles.partition, grid.domain());
        phases.run(workers, [&](std::uint32_t g, int worker) {
            auto& mine = memory[std::size_t(worker)];
            if (!mine) mine = std::make_unique<detail::CoarseMemory<Kernel, S, D>>();
            const BlockGroup& group = particles.partition.groups[g];
            const GroupPlaces<View> places(particles.view, particles.partition, group, positions);
            detail::add_coarse_hessian<Kernel, Force, is_symmetric>(set, grid, potential.dt(), group, places, free,
                                                                    images, level, *mine);
        });
    };
    std::apply([&](const auto&... set) { (add(set), ...); }, potential.sets());
    if (is_symmetric) level.mirror();
}

}  // namespace firn::inline FIRN_BUILD
