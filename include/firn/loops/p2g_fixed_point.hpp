/// \file P2G of all particles, in fixed point. \see FixedPoint
#pragma once

#include <firn/loops/fixed_point.hpp>
#include <firn/loops/p2g.hpp>

#include <array>
#include <cstring>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Sums of contributions in integers. The particles are also measured while their contributions are added: their
/// largest momentum, largest mass and so on, as in FixedPointLoad.
///
/// The right scale (quanta per unit) is known only after all particles were measured, but it is mostly the same as in
/// the last step. So P2G first uses the scale of the last step. If this scale turns out to be right, the particles are
/// read only once. If it turns out to be wrong, or if a contribution did not fit into an integer, P2G discards the sums
/// and adds all contributions again.
template <class Kernel, class Force, class Integer, std::floating_point S>
struct MeasuredSums : IntegerSums<Integer, S> {
    using P = native_pack<S>;

    /// The measurements of the particles whose contributions one thread adds.
    struct alignas(64) Seen {
        FixedPointLoad<P> load;
        P largest = P(0);  ///< largest contribution of the present pack [quanta]
        std::uint32_t particles = 0;
        bool all_fitted = true;
    };

    /// Counts, for each node in the arena of a group, the particles of the group that have this node as their base
    /// node. The counts are first collected in an arena, which fits into the cache, and then added to the counts for
    /// all nodes of the grid.
    template <class K, int D>
    class Counts {
    public:
        FIRN_INLINE Counts(const BlockGroup& group, const ArenaBox<D>& box) { counts_.clear(group, box); }

        FIRN_INLINE void add(std::ptrdiff_t corner, int particles) {
            counts_.node[std::size_t(corner) / node_width] += std::uint32_t(particles);
        }

        FIRN_INLINE void add_to_grid(const MeasuredSums& sums, const BlocksAround<D>& around,
                                     const ArenaBox<D>& box) const {
            counts_.for_runs(sums.counts, around, box, [&](int from, std::uint32_t* to, auto count) FIRN_LAMBDA {
                unroll<count>([&](auto i) FIRN_LAMBDA { to[i] += counts_.node[from + i]; });
            });
        }

    private:
        Arena<K, std::uint32_t, D, 1> counts_;
    };

    Seen* seen;
    std::uint32_t* counts;  ///< for each node of the grid, the number of particles with this base node
    bool scatters;          ///< whether contributions are added; false: particles are only measured

    MeasuredSums(const FixedPointScale<S>& quanta_per_unit, Seen* of_threads, std::uint32_t* particles_by_node,
                 bool scatter)
        : IntegerSums<Integer, S>(quanta_per_unit), seen(of_threads), counts(particles_by_node), scatters(scatter) {}

    MeasuredSums of_thread(int thread) const { return {this->scale, seen + thread, counts, scatters}; }

    template <int D>
    FIRN_INLINE P2GRecord<P, D> operator()(const P2GRecord<P, D>& record) {
        const FixedPointLoad<P> load = load_of<Kernel, Force>(record);
        seen->load = larger(seen->load, load);
        const P momentum = load.momentum + load.gradient * P(S(Kernel::largest_gradient));
        seen->largest = max(seen->largest, max(momentum * P(this->scale.momentum), load.mass * P(this->scale.mass)));
        return IntegerSums<Integer, S>::operator()(record);
    }
    /// Returns whether the contributions of the last measured pack may be added to the sums. Then gets ready to measure
    /// the next pack.
    FIRN_INLINE bool fits() {
        const bool fit = scatters && !any(seen->largest > P(S(std::numeric_limits<Integer>::max() / 2)));
        seen->all_fitted = seen->all_fitted && fit;
        seen->largest = P(0);
        return fit;
    }
    /// Adds `particles` to the number of particles whose base node is `node`. `node` is an index among all nodes of the
    /// grid.
    FIRN_INLINE void count(std::size_t node, int particles) { counts[node] += std::uint32_t(particles); }
};

/// Memory for the sums of all nodes, and memory to count, for each node, the particles with this base node.
template <class Integer>
struct GridIntegers {
    Integer* sums;
    std::uint32_t* counts;
};

/// Returns memory for the integers of all nodes. If Integer has the size of S, the sums use the memory of the nodes'
/// floating-point values; otherwise they use scratch memory. Integers may lie in memory of floating-point values,
/// because they are cleared, read and written as bytes.
template <class Integer, std::floating_point S, int D>
GridIntegers<Integer> integers_of(SparseGrid<S, D>& grid) {
    if constexpr (sizeof(Integer) == sizeof(S)) {
        return {reinterpret_cast<Integer*>(grid.nodes(0)), grid.template scratch<std::uint32_t>()};
    } else {
        using OfNode = std::array<std::byte, node_width * sizeof(Integer) + sizeof(std::uint32_t)>;
        auto* const sums = reinterpret_cast<Integer*>(grid.template scratch<OfNode>());
        const std::size_t numbers = grid.block_count() * std::size_t(block_nodes<D> * node_width);
        return {sums, reinterpret_cast<std::uint32_t*>(sums + numbers)};
    }
}

/// Returns the maxima over all particles, computed from the measurements of all threads. The scale is chosen from these
/// maxima.
/// \param counts  for each node of the grid, the number of particles with this base node
template <class Seen, std::floating_point S, int D>
FixedPointLoad<S> load_of_all(std::vector<Seen>& threads, const std::uint32_t* counts, const SparseGrid<S, D>& grid) {
    constexpr std::size_t per_block = std::size_t(block_nodes<D>);
    const auto look = [&](std::size_t b, int thread) {
        std::uint32_t most = 0;
        for (std::size_t i = b * per_block; i < (b + 1) * per_block; ++i) most = std::max(most, counts[i]);
        std::uint32_t& particles = threads[std::size_t(thread)].particles;
        particles = std::max(particles, most);
    };
    parallel_for(grid.block_count(), int(threads.size()), look, 64);
    FixedPointLoad<S> load;
    for (const Seen& seen : threads)
        load = larger(load, {reduce_max(seen.load.momentum), reduce_max(seen.load.gradient), reduce_max(seen.load.mass),
                             S(seen.particles)});
    return load;
}

/// Converts sums in quanta to the momentum [kg m/s] and the mass [kg] of the nodes. `sums` may lie in the memory of the
/// nodes. Nodes with less mass than fewest_mass_quanta are set to zero.
template <class Integer, std::floating_point S, int D>
void to_nodes(const Integer* sums, const FixedPointScale<S>& scale, SparseGrid<S, D>& grid, int threads) {
    constexpr int together = 4 * node_width, m = node_mass;
    // Scales are powers of two, so a 32-bit integer is rounded only by the conversion to Real.
    using Real = std::conditional_t<sizeof(Integer) == 4, S, double>;
    using Integers [[gnu::vector_size(together * sizeof(Integer))]] = Integer;
    using Reals [[gnu::vector_size(together * sizeof(Real))]] = Real;
    using Floats [[gnu::vector_size(together * sizeof(S))]] = S;
    const Real momentum = 1 / Real(scale.momentum), mass = 1 / Real(scale.mass);
    Reals quantum;
    for (int i = 0; i < together; ++i) quantum[i] = i % node_width == node_mass ? mass : momentum;
    constexpr std::size_t numbers = std::size_t(block_nodes<D> * node_width);
    const auto convert = [&](std::size_t b, int) {
        for (std::size_t i = b * numbers; i < (b + 1) * numbers; i += together) {
            Integers sum;
            std::memcpy(&sum, sums + i, sizeof sum);
            sum &= __builtin_shufflevector(sum, sum, m, m, m, m, m + 4, m + 4, m + 4, m + 4, m + 8, m + 8, m + 8, m + 8,
                                           m + 12, m + 12, m + 12, m + 12) >= fewest_mass_quanta;
            const Floats to = __builtin_convertvector(__builtin_convertvector(sum, Reals) * quantum, Floats);
            std::memcpy(grid.nodes(0) + i, &to, sizeof to);
        }
    };
    parallel_for(grid.block_count(), threads, convert, 16);
}

/// What ranks tell each other about their sums in quanta, for a run of one rank: nothing. firn::mpi has another such
/// class, with the same functions.
struct JoinNothing {
    /// Adds the other ranks' numbers of particles by base node, where ranks share nodes.
    static void join_counts(std::uint32_t*) {}
    /// Joins the loads of all ranks. Returns whether `fitted` is true on all of them.
    template <class S>
    static bool join_loads(FixedPointLoad<S>&, bool fitted) {
        return fitted;
    }
};

/// Computes the sums of P2G in quanta, and stores them in the memory that integers_of() returns.
/// \param join  what ranks tell each other. \see JoinNothing
/// \return the scale of the sums
/// \throws overflow_error  if a sum could leave the range of Integer; all nodes are set to zero in this case
template <class Kernel, class Transfer, class Force, class Integer, Adding How, class Join, std::floating_point S,
          int D, class View>
FixedPointScale<S> sum_in_quanta(const FixedPoint<Integer, How>& execution, Join& join, SparseGrid<S, D>& grid,
                                 double dt, ParticleSets<View> sets) {
    const int threads = thread_count(execution.threads);
    const GridIntegers<Integer> integers = integers_of<Integer>(grid);
    Integer* const sums = integers.sums;
    clear(sums, node_width, grid, threads);
    clear(integers.counts, 1, grid, threads);

    // If the scale of the last step is known, this pass adds contributions with that scale and measures their loads.
    // Otherwise it only measures the loads, from which the scale follows.
    using Measured = MeasuredSums<Kernel, Force, Integer, S>;
    const bool tries = How == Adding::coloured && grid.last_scale;
    const FixedPointScale<S> tried = tries ? *grid.last_scale : FixedPointScale<S>{S(1), S(1)};
    std::vector<typename Measured::Seen> seen{std::size_t(threads)};
    const Measured measured(tried, seen.data(), integers.counts, tries);
    for (const ParticleSet<View>& set : sets)
        scatter_coloured<Kernel, Transfer, Force>(set, grid, dt, threads, measured, sums);
    join.join_counts(integers.counts);
    FixedPointLoad<S> load = load_of_all(seen, integers.counts, grid);
    const bool fitted = join.join_loads(
        load, tries && std::all_of(seen.begin(), seen.end(), [](const auto& s) { return s.all_fitted; }));
    const FixedPointScale<S> scale = [&] {
        try {
            if constexpr (requires { Transfer::ignores_given_scales; })
                return fixed_point_scale<Kernel, D, Integer>(load, std::nullopt, std::nullopt);
            else
                return fixed_point_scale<Kernel, D, Integer>(load, execution.momentum_scale, execution.mass_scale);
        } catch (...) {
            clear(grid.nodes(0), node_width, grid, threads);
            throw;
        }
    }();
    const bool was_right = fitted && tried == scale;
    grid.last_scale = scale;

    if (!was_right) {
        if (tries) clear(sums, node_width, grid, threads);
        if constexpr (How == Adding::coloured) {
            const IntegerSums<Integer, S> right(scale);
            for (const ParticleSet<View>& set : sets)
                scatter_coloured<Kernel, Transfer, Force>(set, grid, dt, threads, right, sums);
        } else {
            const AtomicSums<Integer, S> atomic(scale);
            for (const ParticleSet<View>& set : sets)
                parallel_for(set.partition.groups.size(), threads, [&](std::size_t g, int) {
                    scatter_group<Kernel, Transfer, Force>(set, set.partition.groups[g], grid, dt, atomic, sums);
                });
        }
    }
    return scale;
}

}  // namespace detail

/// Particles to grid, with sums in integers (fixed point). This function has the same requirements as the p2g() that
/// takes a Coloured, and throws the same errors, too.
/// \throws overflow_error  if a sum could leave the range of Integer; all nodes are set to zero in this case
template <class Kernel, class Transfer, class Force, class Integer, Adding How, std::floating_point S, int D,
          class View>
void p2g(const FixedPoint<Integer, How>& execution, SparseGrid<S, D>& grid, double dt, ParticleSets<View> sets) {
    detail::check_p2g(grid, dt, sets);
    const int threads = thread_count(execution.threads);
    parallel_region(threads, [&] {
        detail::JoinNothing join;
        const FixedPointScale<S> scale =
            detail::sum_in_quanta<Kernel, Transfer, Force>(execution, join, grid, dt, sets);
        detail::to_nodes(detail::integers_of<Integer>(grid).sums, scale, grid, threads);
    });
}

}  // namespace firn::inline FIRN_BUILD
