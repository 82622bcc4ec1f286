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

/// The load that the fixed-point scale is chosen from, over one set of particles after the other.
template <std::floating_point S, int D>
class LoadSums {
public:
    using P = native_pack<S>;
    static constexpr int lanes = scalar_traits<P>::lanes;

    LoadSums(SparseGrid<S, D>& grid, double dt, int threads)
        : grid_(grid),
          cells_(grid.template scratch<CellLoad>()),
          dt_(dt),
          threads_(threads),
          of_thread_(std::size_t(threads)) {
        clear(cells_, 1, grid, threads);
    }

    template <class View>
    void see_mass(const ParticleSet<View>& set) {
        parallel_for(
            set.partition.slots() / pack_size, threads_,
            [&](std::size_t pack, int thread) {
                P mass = P(0);
                for (int lane = 0; lane < pack_size; lane += lanes) {
                    const std::size_t slot = pack * pack_size + std::size_t(lane);
                    const Slots slots{slot, set.partition.order.data() + slot};
                    mass = max(mass, set.view.mass.template load_or_zero<P>(slots, 0));
                }
                S& largest = of_thread_[std::size_t(thread)].mass;
                largest = std::max(largest, reduce_max(mass));
            },
            256);
    }

    /// After see_mass() of all sets.
    template <class Kernel, class Transfer, class Force, class View>
    void add(const ParticleSet<View>& set) {
        const S quanta = S(mass_quanta());
        const Positions<View> positions(grid_.domain());
        const ParticleReader<View> reader(set.view, grid_.domain(), dt_);
        for_groups_by_phase(set.partition, threads_, [&](const BlockGroup& group, int thread) {
            const GroupPlaces<View> places(set.view, set.partition, group, positions);
            P momentum_per_mass = P(0), gradient_per_mass = P(0);
            for (std::size_t slot = 0; slot < group.particles; slot += lanes) {
                if (slot % pack_size == 0) reader.template prefetch<Transfer>(group.first_slot + slot + pack_size);
                const Vec<P, D> position = places.template position<P>(slot);
                const auto record = reader.template record<Kernel, Transfer, Force>(places.slots(slot),
                                                                                    locate<Kernel>(position).fraction);
                const FixedPointLoad<P> load = load_of<Kernel, Force>(record);
                momentum_per_mass = max(momentum_per_mass, load.momentum_per_mass);
                gradient_per_mass = max(gradient_per_mass, load.gradient_per_mass);

                P node = P(0);
                unroll<D>([&](auto a) FIRN_LAMBDA {
                    constexpr int last = arena_size<Kernel> - 1;
                    const P cell = floor(position.v[a]) + P(allowed_drift);
                    node =
                        node * P(arena_size<Kernel>) + select(cell > P(0), select(cell < P(last), cell, P(last)), P(0));
                });
                const P mass = -floor(-record.mass * P(quanta));  // rounded up
                const std::size_t end = std::min<std::size_t>(lanes, group.particles - slot);
                for (std::size_t l = 0; l < end; ++l) {
                    const std::size_t cell = ArenaNodes<Kernel, D>::in_grid(
                        grid_.neighbours(set.partition, places.blocks().range(slot + l)), std::ptrdiff_t(node[int(l)]));
                    cells_[cell].mass_and_count += CellLoad::vector{std::uint64_t(mass[int(l)]), 1};
                }
            }
            Largest& largest = of_thread_[std::size_t(thread)];
            largest.momentum_per_mass = std::max(largest.momentum_per_mass, reduce_max(momentum_per_mass));
            largest.gradient_per_mass = std::max(largest.gradient_per_mass, reduce_max(gradient_per_mass));
        });
    }

    /// Of all sets that were added.
    FixedPointLoad<S> load() {
        constexpr std::size_t per_block = std::size_t(block_nodes<D>);
        parallel_for(
            grid_.block_count(), threads_,
            [&](std::size_t b, int thread) {
                CellLoad& largest = of_thread_[std::size_t(thread)].cell;
                for (std::size_t i = b * per_block; i < (b + 1) * per_block; ++i)
                    for (int k = 0; k < 2; ++k)
                        largest.mass_and_count[k] = std::max(largest.mass_and_count[k], cells_[i].mass_and_count[k]);
            },
            64);
        const S quanta = S(mass_quanta());
        FixedPointLoad<S> load;
        for (const Largest& largest : of_thread_) {
            load.momentum_per_mass = std::max(load.momentum_per_mass, largest.momentum_per_mass);
            load.gradient_per_mass = std::max(load.gradient_per_mass, largest.gradient_per_mass);
            load.cell_mass = std::max(load.cell_mass, S(largest.cell.mass_and_count[0]) / quanta);
            load.cell_particles = std::max(load.cell_particles, S(largest.cell.mass_and_count[1]));
        }
        return load;
    }

private:
    struct alignas(64) Largest {
        S mass = 0, momentum_per_mass = 0, gradient_per_mass = 0;
        CellLoad cell{};
    };

    /// Those of one particle fit 22 bits.
    double mass_quanta() const {
        S largest = 0;
        for (const Largest& of_one : of_thread_) largest = std::max(largest, of_one.mass);
        return firn::mass_quanta(double(largest));
    }

    SparseGrid<S, D>& grid_;
    CellLoad* cells_;  // a cell each, named by its lower node
    double dt_;
    int threads_;
    std::vector<Largest> of_thread_;
};

}  // namespace detail

/// \copydoc p2g
/// \throws overflow_error before anything is added, if a sum could leave the range of Integer
template <class Kernel, class Transfer, class Force, class Integer, Adding How, std::floating_point S, int D,
          class... Views>
void p2g(const FixedPoint<Integer, How>& execution, SparseGrid<S, D>& grid, double dt,
         const ParticleSet<Views>&... sets) {
    detail::check_p2g(grid, dt, sets...);
    const int threads = thread_count(execution.threads);
    detail::LoadSums<S, D> load(grid, dt, threads);
    (load.see_mass(sets), ...);
    (load.template add<Kernel, Transfer, Force>(sets), ...);
    const FixedPointScale<S> scale =
        fixed_point_scale<Kernel, D, Integer>(load.load(), execution.momentum_scale, execution.mass_scale);

    constexpr std::size_t numbers = std::size_t(block_nodes<D> * node_width);
    using Node = std::array<Integer, node_width>;
    Integer* sums = grid.template scratch<Node>()->data();
    detail::clear(sums, node_width, grid, threads);

    if constexpr (How == Adding::coloured) {
        const IntegerSums<Integer, S> integers(scale);
        (detail::scatter_coloured<Kernel, Transfer, Force>(sets, grid, dt, threads, integers, sums), ...);
    } else {
        const AtomicSums<Integer, S> atomic(scale);
        const auto scatter = [&](const auto& set) {
            parallel_for(set.partition.groups.size(), threads, [&](std::size_t g, int) {
                detail::scatter_group<Kernel, Transfer, Force>(set, set.partition.groups[g], grid, dt, atomic, sums);
            });
        };
        (scatter(sets), ...);
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
