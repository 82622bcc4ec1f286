/// \file P2G over all particles, in fixed point. \see FixedPoint
#pragma once

#include <firn/exec/fixed_point.hpp>
#include <firn/exec/p2g.hpp>

namespace firn {

namespace detail {

/// Mass, in quanta rounded up, and number of the particles in one cell.
struct CellLoad {
    using vector [[gnu::vector_size(16)]] = std::uint64_t;
    vector mass_and_count;
};

/// The load that the fixed-point scale is chosen from.
template <class Kernel, class Transfer, class Force, class View, int D>
FixedPointLoad<typename View::scalar_type> fixed_point_load(const View& view, const BlockPartition<D>& partition,
                                                            SparseGrid<typename View::scalar_type, D>& grid, double dt,
                                                            int threads) {
    using S = typename View::scalar_type;
    using P = native_pack<S>;
    constexpr int lanes = scalar_traits<P>::lanes;
    struct alignas(64) Largest {
        S mass = 0, momentum_per_mass = 0, gradient_per_mass = 0;
        CellLoad cell{};
    };
    std::vector<Largest> of_thread{std::size_t(threads)};

    const std::size_t packs = partition.slots() / pack_size;
    parallel_for(
        packs, threads,
        [&](std::size_t pack, int thread) {
            P mass = P(0);
            for (int lane = 0; lane < pack_size; lane += lanes) {
                const std::size_t slot = pack * pack_size + std::size_t(lane);
                mass = max(mass, view.mass.template load_or_zero<P>(Slots{slot, partition.order.data() + slot}, 0));
            }
            S& largest = of_thread[std::size_t(thread)].mass;
            largest = std::max(largest, reduce_max(mass));
        },
        256);
    S largest_mass = 0;
    for (const Largest& largest : of_thread) largest_mass = std::max(largest_mass, largest.mass);
    const double quanta = mass_quanta(double(largest_mass));  // those of one particle fit 22 bits

    constexpr std::size_t per_block = std::size_t(block_nodes<D>);
    CellLoad* cells = grid.template scratch<CellLoad>();  // a cell each, named by its lower node
    clear(cells, 1, grid, threads);

    const Positions<View> positions(grid.domain());
    const ParticleReader<View> reader(view, grid.domain(), dt);
    for_groups_by_colour(partition, threads, [&](const BlockGroup& group, int thread) {
        const GroupPlaces<View> places(view, partition, group, positions);
        P momentum_per_mass = P(0), gradient_per_mass = P(0);
        for (std::size_t slot = 0; slot < group.particles; slot += lanes) {
            const Vec<P, D> position = places.template position<P>(slot);
            const auto record =
                reader.template record<Kernel, Transfer, Force>(places.slots(slot), locate<Kernel>(position).fraction);
            const FixedPointLoad<P> load = load_of<Kernel, Force>(record);
            momentum_per_mass = max(momentum_per_mass, load.momentum_per_mass);
            gradient_per_mass = max(gradient_per_mass, load.gradient_per_mass);

            P node = P(0);
            unroll<D>([&](auto a) FIRN_LAMBDA {
                constexpr int last = arena_size<Kernel> - 1;
                const P cell = floor(position.v[a]) + P(allowed_drift);
                node = node * P(arena_size<Kernel>) + select(cell > P(0), select(cell < P(last), cell, P(last)), P(0));
            });
            const P mass = -floor(-record.mass * P(S(quanta)));  // rounded up
            const std::size_t end = std::min<std::size_t>(lanes, group.particles - slot);
            for (std::size_t l = 0; l < end; ++l) {
                const std::size_t cell = ArenaNodes<Kernel, D>::in_grid(
                    grid.neighbours(places.blocks().range(slot + l)), std::ptrdiff_t(node[int(l)]));
                cells[cell].mass_and_count += CellLoad::vector{std::uint64_t(mass[int(l)]), 1};
            }
        }
        Largest& largest = of_thread[std::size_t(thread)];
        largest.momentum_per_mass = std::max(largest.momentum_per_mass, reduce_max(momentum_per_mass));
        largest.gradient_per_mass = std::max(largest.gradient_per_mass, reduce_max(gradient_per_mass));
    });
    parallel_for(
        grid.block_count(), threads,
        [&](std::size_t b, int thread) {
            CellLoad& largest = of_thread[std::size_t(thread)].cell;
            for (std::size_t i = b * per_block; i < (b + 1) * per_block; ++i)
                for (int k = 0; k < 2; ++k)
                    largest.mass_and_count[k] = std::max(largest.mass_and_count[k], cells[i].mass_and_count[k]);
        },
        64);

    FixedPointLoad<S> load;
    for (const Largest& largest : of_thread) {
        load.momentum_per_mass = std::max(load.momentum_per_mass, largest.momentum_per_mass);
        load.gradient_per_mass = std::max(load.gradient_per_mass, largest.gradient_per_mass);
        load.cell_mass = std::max(load.cell_mass, S(largest.cell.mass_and_count[0]) / S(quanta));
        load.cell_particles = std::max(load.cell_particles, S(largest.cell.mass_and_count[1]));
    }
    return load;
}

}  // namespace detail

/// \copydoc p2g
/// \throws overflow_error before anything is added, if a sum could leave the range of Integer
template <class Kernel, class Transfer, class Force, class View, int D, class Integer, Adding How>
void p2g(const FixedPoint<Integer, How>& execution, const View& view, const BlockPartition<D>& partition,
         SparseGrid<typename View::scalar_type, D>& grid, double dt) {
    using S = typename View::scalar_type;
    const int threads = thread_count(execution.threads);
    const FixedPointScale<S> scale = fixed_point_scale<Kernel, D, Integer>(
        detail::fixed_point_load<Kernel, Transfer, Force>(view, partition, grid, dt, threads), execution.momentum_scale,
        execution.mass_scale);

    constexpr std::size_t numbers = std::size_t(block_nodes<D> * node_width);
    using Node = std::array<Integer, node_width>;
    Integer* sums = grid.template scratch<Node>()->data();
    detail::clear(sums, node_width, grid, threads);

    if constexpr (How == Adding::coloured) {
        detail::scatter_coloured<Kernel, Transfer, Force>(view, partition, grid, dt, threads,
                                                          IntegerSums<Integer, S>(scale), sums);
    } else {
        const AtomicSums<Integer, S> atomic(scale);
        parallel_for(partition.groups.size(), threads, [&](std::size_t g, int) {
            detail::scatter_group<Kernel, Transfer, Force>(view, partition, partition.groups[g], grid, dt, atomic,
                                                           sums);
        });
    }

    const double momentum_quantum = 1 / double(scale.momentum), mass_quantum = 1 / double(scale.mass);
    const auto convert = [&](std::size_t b, int) {
        for (std::size_t i = b * numbers; i < (b + 1) * numbers; i += node_width) {
            const bool filled = sums[i + node_mass] >= fewest_mass_quanta;
            S* to = grid.nodes(0) + i;
            for (int c = 0; c < node_width; ++c) {
                const double quantum = c == node_mass ? mass_quantum : momentum_quantum;
                to[c] = filled ? S(double(sums[i + std::size_t(c)]) * quantum) : S(0);
            }
        }
    };
    parallel_for(grid.block_count(), threads, convert, 16);
}

}  // namespace firn
