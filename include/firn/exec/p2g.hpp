/// \file P2G over all particles, in three executions. \see Serial, Coloured, FixedPoint
#pragma once

#include <firn/exec/execution.hpp>
#include <firn/exec/fixed_point.hpp>
#include <firn/exec/parallel.hpp>
#include <firn/exec/scatter.hpp>

#include <atomic>
#include <memory>

namespace firn {

namespace detail {

/// Calls body(records, l) for every particle l of every pack of the range.
template <class Kernel, class Transfer, class Force, class View, int D, class Body>
FIRN_INLINE void for_records(const View& view, const BlockPartition<D>& partition, const BlockRange<D>& range,
                             const Domain<D>& domain, double dt, const Body& body) {
    using S = typename View::scalar_type;
    const BlockFrame<S, D> frame(domain, range.block);
    PackRecords<Kernel, Force, S, D> records;
    for (std::size_t p = 0; p < range.packs(); ++p) {
        records.template fill<Transfer>(view, range.first_slot + p * pack_size, partition.order.data(), frame,
                                        S(domain.cell_size), S(dt));
        const int used = int(std::min<std::size_t>(pack_size, range.particles - p * pack_size));
        for (int l = 0; l < used; ++l) body(records, l);
    }
}

template <std::floating_point S, int D>
void clear(SparseGrid<S, D>& grid, int threads) {
    const auto clear_block = [&](std::size_t b, int) { std::fill_n(grid.nodes(b), block_nodes<D> * node_width, S(0)); };
    parallel_for(grid.block_count(), threads, clear_block, 64);
}

/// Adds what a range has gathered in its arena to the blocks of the grid.
template <class Kernel, std::floating_point S, int D, class Grid>
void add_arena(const Arena<Kernel, S, D>& arena, Grid& grid, const std::uint32_t* neighbours) {
    Arena<Kernel, S, D>::for_runs(grid, neighbours, [&](int from, S* to, auto count) FIRN_LAMBDA {
        unroll<count>([&](auto k) FIRN_LAMBDA {
            constexpr int i = k * node_width;
            (quad<S>::load(to + i) + quad<S>::load(arena.node + from + i)).store(to + i);
        });
    });
}

}  // namespace detail

/// Particles to grid: clears the grid, then adds mass and momentum of all particles, the impulse of the stress over
/// dt included. Needs: the grid activated for the partition, and no particle more than `allowed_drift` cells from the
/// block it was sorted into.
template <class Kernel, class Transfer, class Force, class View, int D>
void p2g(const Coloured& execution, const View& view, const BlockPartition<D>& partition,
         SparseGrid<typename View::scalar_type, D>& grid, double dt) {
    using S = typename View::scalar_type;
    const int threads = thread_count(execution.threads);
    detail::clear(grid, threads);
    for (const auto& colour : partition.colours) {
        parallel_for(colour.size(), threads, [&](std::size_t c, int) {
            const std::size_t r = colour[c];
            Arena<Kernel, S, D> arena;
            std::fill(std::begin(arena.node), std::end(arena.node), S(0));
            detail::for_records<Kernel, Transfer, Force>(
                view, partition, partition.ranges[r], grid.domain(), dt, [&](const auto& records, int l) FIRN_LAMBDA {
                    records.scatter(l, [&](std::ptrdiff_t at, const auto& added) FIRN_LAMBDA {
                        using Row = std::remove_cvref_t<decltype(added)>;
                        (Row::load(arena.node + at) + added).store(arena.node + at);
                    });
                });
            detail::add_arena(arena, grid, grid.neighbours(r));
        });
    }
}

/// \copydoc p2g
template <class Kernel, class Transfer, class Force, class View, int D>
void p2g(const Serial&, const View& view, const BlockPartition<D>& partition,
         SparseGrid<typename View::scalar_type, D>& grid, double dt) {
    using S = typename View::scalar_type;
    detail::clear(grid, 1);
    for (std::size_t r = 0; r < partition.ranges.size(); ++r) {
        S* node[Arena<Kernel, S, D>::node_count];
        Arena<Kernel, S, D>::for_runs(grid, grid.neighbours(r), [&](int from, S* to, int count) {
            for (int k = 0; k < count; ++k) node[from / node_width + k] = to + k * node_width;
        });
        detail::for_records<Kernel, Transfer, Force>(
            view, partition, partition.ranges[r], grid.domain(), dt, [&](const auto& records, int l) FIRN_LAMBDA {
                records.scatter(l, [&](std::ptrdiff_t at, const auto& added) FIRN_LAMBDA {
                    S numbers[16];
                    added.store(numbers);
                    for (int k = 0; k < Kernel::support; ++k) {
                        S* to = node[at / node_width + k];
                        (quad<S>::load(to) + quad<S>::load(numbers + k * node_width)).store(to);
                    }
                });
            });
    }
}

namespace detail {

/// The load that the fixed-point scale is chosen from. Cell masses are summed as integers, rounded up.
template <class Kernel, class Transfer, class Force, class View, int D>
FixedPointLoad fixed_point_load(const View& view, const BlockPartition<D>& partition,
                                const SparseGrid<typename View::scalar_type, D>& grid, double dt, int threads) {
    using S = typename View::scalar_type;
    const std::size_t ranges = partition.ranges.size();
    std::vector<FixedPointLoad> of_range(ranges);
    std::vector<double> largest_mass(ranges, 0.0);
    parallel_for(ranges, threads, [&](std::size_t r, int) {
        FixedPointLoad load;
        double mass = 0;
        for_records<Kernel, Transfer, Force>(
            view, partition, partition.ranges[r], grid.domain(), dt, [&](const auto& records, int l) {
                using Records = std::remove_cvref_t<decltype(records)>;
                const int q = quad_offset<typename Records::P>(l);
                const double m = double(records.value[0][q + node_mass]);
                mass = std::max(mass, m);
                for (int a = 0; a < D; ++a) {
                    double momentum = std::abs(double(records.value[0][q + a])), gradient = 0;
                    for (int b = 0; b < D; ++b) {
                        momentum += largest_offset<Kernel> * std::abs(double(records.value[1 + b][q + a]));
                        if constexpr (Records::gradients) gradient += std::abs(double(records.value[1 + D + b][q + a]));
                    }
                    load.momentum_per_mass = std::max(load.momentum_per_mass, momentum / m);
                    load.gradient_per_mass = std::max(load.gradient_per_mass, gradient / m);
                    if (!std::isfinite(momentum + gradient))
                        load.momentum_per_mass = std::numeric_limits<double>::infinity();
                }
            });
        of_range[r] = load;
        largest_mass[r] = mass;
    });
    FixedPointLoad load;
    double mass = 0;
    for (std::size_t r = 0; r < ranges; ++r) {
        load.momentum_per_mass = std::max(load.momentum_per_mass, of_range[r].momentum_per_mass);
        load.gradient_per_mass = std::max(load.gradient_per_mass, of_range[r].gradient_per_mass);
        mass = std::max(mass, largest_mass[r]);
    }

    // A cell is named by its lower node, which lies between the base node and the one after it.
    constexpr int per_block = block_nodes<D>;
    const auto cell_mass = std::make_unique<std::atomic<std::uint64_t>[]>(grid.block_count() * per_block);
    const auto cell_particles = std::make_unique<std::atomic<std::uint32_t>[]>(grid.block_count() * per_block);
    const double quanta = 0x1p20 / mass;
    parallel_for(ranges, threads, [&](std::size_t r, int) {
        const BlockRange<D>& range = partition.ranges[r];
        const BlockFrame<S, D> frame(grid.domain(), range.block);
        for (std::size_t i = 0; i < range.particles; ++i) {
            const std::size_t slot = range.first_slot + i;
            const Slots slots{slot, partition.order.data() + slot};
            int block = 0, node = 0;
            for (int a = 0; a < D; ++a) {
                const S x = (view.position.at(slots, a) - frame.lower[a]) * frame.per_cell;
                const int n = int(std::floor(x)) - int(frame.first[a]) + block_size - allowed_drift;
                const int bounded = std::min(std::max(n, 0), 3 * block_size - 1);
                block = block * 3 + bounded / block_size;
                node = node * block_size + bounded % block_size;
            }
            const std::size_t cell = std::size_t(grid.neighbours(r)[block]) * per_block + std::size_t(node);
            cell_mass[cell].fetch_add(std::uint64_t(std::ceil(double(view.mass.at(slots, 0)) * quanta)),
                                      std::memory_order_relaxed);
            cell_particles[cell].fetch_add(1, std::memory_order_relaxed);
        }
    });
    std::uint64_t most = 0, count = 0;
    for (std::size_t c = 0; c < grid.block_count() * per_block; ++c) {
        most = std::max(most, cell_mass[c].load(std::memory_order_relaxed));
        count = std::max<std::uint64_t>(count, cell_particles[c].load(std::memory_order_relaxed));
    }
    load.cell_mass = double(most) / quanta;
    load.cell_particles = count;
    return load;
}

}  // namespace detail

/// \copydoc p2g
/// \throws overflow_error before anything is added, if a sum could leave the range of Integer
template <class Kernel, class Transfer, class Force, class View, int D, class Integer>
void p2g(const FixedPoint<Integer>& execution, const View& view, const BlockPartition<D>& partition,
         SparseGrid<typename View::scalar_type, D>& grid, double dt) {
    using S = typename View::scalar_type;
    const int threads = thread_count(execution.threads);
    const FixedPointScale scale = fixed_point_scale<Kernel, D, Integer>(
        detail::fixed_point_load<Kernel, Transfer, Force>(view, partition, grid, dt, threads), execution.momentum_scale,
        execution.mass_scale);
    const S momentum_scale = S(scale.momentum), mass_scale = S(scale.mass);
    constexpr std::size_t numbers = std::size_t(block_nodes<D> * node_width);

    const auto sums = std::make_unique<std::atomic<Integer>[]>(grid.block_count() * numbers);
    parallel_for(partition.ranges.size(), threads, [&](std::size_t r, int) {
        std::size_t node[Arena<Kernel, S, D>::node_count];
        Arena<Kernel, S, D>::for_runs(grid, grid.neighbours(r), [&](int from, S* to, int count) {
            for (int k = 0; k < count; ++k)
                node[from / node_width + k] = std::size_t(to - grid.nodes(0) + k * node_width);
        });
        detail::for_records<Kernel, Transfer, Force>(
            view, partition, partition.ranges[r], grid.domain(), dt, [&](const auto& records, int l) FIRN_LAMBDA {
                records.scatter(l, [&](std::ptrdiff_t at, const auto& added) FIRN_LAMBDA {
                    S contribution[16];
                    added.store(contribution);
                    for (int k = 0; k < Kernel::support; ++k) {
                        std::atomic<Integer>* to = sums.get() + node[at / node_width + k];
                        for (int c = 0; c < node_width; ++c) {
                            if (D == 2 && c == 2) continue;
                            const S quanta =
                                contribution[k * node_width + c] * (c == node_mass ? mass_scale : momentum_scale);
                            to[c].fetch_add(Integer(std::llrint(quanta)), std::memory_order_relaxed);
                        }
                    }
                });
            });
    });

    const double momentum_quantum = 1 / scale.momentum, mass_quantum = 1 / scale.mass;
    parallel_for(grid.block_count(), threads, [&](std::size_t b, int) {
        for (std::size_t i = 0; i < numbers; i += node_width) {
            const std::atomic<Integer>* from = sums.get() + b * numbers + i;
            const bool filled = from[node_mass] >= fewest_mass_quanta;
            S* to = grid.nodes(b) + i;
            for (int c = 0; c < node_mass; ++c) to[c] = filled ? S(double(from[c]) * momentum_quantum) : S(0);
            to[node_mass] = filled ? S(double(from[node_mass]) * mass_quantum) : S(0);
        }
    });
}

}  // namespace firn
