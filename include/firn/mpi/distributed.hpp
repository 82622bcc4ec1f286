/// \file An execution of a simulation on many ranks (processes), on one machine or on many.
#pragma once

#include <firn/data/samples.hpp>
#include <firn/loops/execution.hpp>
#include <firn/loops/p2g.hpp>
#include <firn/loops/p2g_fixed_point.hpp>
#include <firn/mpi/ranks.hpp>
#include <firn/mpi/shared_sums.hpp>
#include <firn/simulation/body.hpp>

#include <type_traits>

namespace firn::inline FIRN_BUILD::mpi {

namespace detail {
template <class E>
inline constexpr bool sums_integers = false;
template <class Integer, Adding How>
inline constexpr bool sums_integers<FixedPoint<Integer, How>> = true;
}  // namespace detail

/// An execution on many ranks: each rank has some of the particles, and the ranks join their sums at the nodes that
/// they share.
///
///     firn::mpi::Session session(argc, argv);
///     firn::Simulation simulation(domain, material, walls, firn::mpi::Distributed<firn::Coloured>{});
///
/// Every rank runs the same program and makes the same calls: each function of the simulation is collective. What the
/// program adds, every rank adds: the particles are then shared out. particles() has those of this rank.
///
/// The bits of a run do not depend on the number of ranks, nor on the number of threads of each, and are those of a run
/// without MPI.
/// \tparam Execution  how each rank sums: Coloured or FixedPoint
template <class Execution = Coloured>
class Distributed : public Execution {
    static_assert(
        std::same_as<Execution, Coloured> || detail::sums_integers<Execution>,
        "firn: Distributed<…> takes Coloured or FixedPoint<…>: their sums do not depend on the number of ranks.");

public:
    /// Makes an execution on the ranks of a communicator. Collective.
    /// \param execution  how each rank sums, and with how many threads
    /// \param all        the ranks; by default all ranks of the program
    /// \throws usage_error  if MPI does not run. \see Session
    explicit Distributed(const Execution& execution = {}, const Communicator& all = Communicator())
        : Execution(execution), state_(all, !detail::sums_integers<Execution>) {}

    /// A rank may have this many times the mean number of particles. If one has more when particles are sorted, they
    /// are shared out anew.
    double largest_imbalance = 1.1;

    const Communicator& communicator() const { return state_.all; }  ///< The ranks.
    /// Whether SIGINT or SIGTERM had arrived on any rank when the last step ended. All ranks return the same.
    /// \see Interruption
    bool interrupted() const { return state_.interrupted; }
    /// How often particles were shared out anew so far.
    std::uint64_t migrations() const { return state_.migrations; }

    /// Returns which rank owns which cubes of blocks, for the particles of one material.
    /// \param material  index of the material in the list of materials
    template <int D>
    const Cuts<D>& cuts(std::size_t material = 0) const {
        return state_.template of<D>().of_material(material);
    }
    /// Sets which rank owns which cubes of blocks. Call it before the simulation is given particles that are on these
    /// ranks, and sorted.
    template <int D>
    void set_cuts(std::size_t material, const Cuts<D>& cuts) {
        state_.template of<D>().of_material(material) = cuts;
        state_.template of<D>().current = cuts;
    }

    /// Records what this rank does, if it is not nullptr.
    void record(Trace* trace) { state_.trace = trace; }

private:
    template <class E>
    friend Ranks ranks_of(const Distributed<E>& execution);

    mutable detail::RankState state_;
};

/// Returns what the ranks of a run tell each other.
template <class Execution>
Ranks ranks_of(const Distributed<Execution>& execution) {
    return Ranks(execution.state_, execution.largest_imbalance);
}

/// Adds a body whose samples no rank has alone: the samples of rank 0, then those of rank 1, and so on. Their order
/// gives the particles' ids, so the bits of a run depend on this order, and not on where it is cut into parts.
/// Collective.
/// \param set      a simulation with one material, or a handle to one of its sets
/// \param samples  the samples of this rank
/// \return the whole body, the same on all ranks
/// \throws parameter_error, particle_error  as SetAccess::add
template <class Set, int D>
Body add(Set&& set, const Samples<D>& samples, double density, const Vec<double, D>& velocity = {}) {
    const Communicator& all = [&]() -> const Communicator& {
        if constexpr (requires { set.execution.communicator(); })
            return set.execution.communicator();
        else
            return set.simulation().execution.communicator();
    }();
    const std::uint64_t mine = samples.positions.size();
    const auto before = all.sum_before(mine), count = all.sum(mine);
    const double volume = all.max(mine > 0 ? samples.volume : 0.0);  // a rank may have no samples
    if (mine == 0)
        return set.add_part(Samples<D>{{}, volume}, std::size_t(before), std::size_t(count), density, velocity);
    return set.add_part(samples, std::size_t(before), std::size_t(count), density, velocity);
}

namespace detail {

/// Joins the sums in quanta of all ranks.
template <class Integer, std::floating_point S, int D>
class JoinQuanta {
public:
    JoinQuanta(const Communicator& all, SharedSums<D>& sums) : all_(all), sums_(sums) {}

    void join_counts(std::uint32_t* counts) {
        sums_.template expect<1>(counts);
        sums_.template send<1>(counts, 1);
        sums_.template add<1>(counts);
        sums_.finish_sends();
    }
    bool join_loads(FixedPointLoad<S>& load, bool fitted) {
        S numbers[] = {load.momentum, load.gradient, load.mass, load.particles, fitted ? S(0) : S(1)};
        for (S& number : numbers)  // the largest of numbers one of which is NaN is not defined
            if (std::isnan(number)) number = std::numeric_limits<S>::infinity();
        all_.max(std::span<S>(numbers));
        load = {numbers[0], numbers[1], numbers[2], numbers[3]};
        return numbers[4] == S(0);
    }
    void join_sums(Integer* sums) {
        sums_.template expect<node_width>(sums);
        sums_.template send<node_width>(sums, 1);
        sums_.template add<node_width>(sums);
        sums_.template send_back<node_width>(sums);
    }

private:
    const Communicator& all_;
    SharedSums<D>& sums_;
};

}  // namespace detail

/// Particles to grid on many ranks, with the requirements and errors of the p2g() that takes a Coloured. Afterwards all
/// nodes that particles of this rank reach have the sums of all ranks. Collective.
template <class Kernel, class Transfer, class Force, std::floating_point S, int D, class View>
void p2g(const Distributed<Coloured>& execution, SparseGrid<S, D>& grid, double dt, ParticleSets<View> sets) {
    const Ranks ranks = ranks_of(execution);
    detail::RankState& state = ranks.state();
    auto& shared = state.of<D>().shared;
    if (!shared.has_table() && shared.incoming().empty()) {
        const detail::Phase phase(state.trace, "scatter");
        return firn::p2g<Kernel, Transfer, Force>(static_cast<const Coloured&>(execution), grid, dt, sets);
    }
    firn::detail::check_p2g(grid, dt, sets);
    const int threads = thread_count(execution.threads);
    parallel_region(threads, [&] {
        detail::SharedSums<D> sums(state.all, shared, state.memory, state.mirrors, threads, state.trace);
        const detail::GridOfPieces<S, D> pieces{grid, shared};
        for (std::size_t k = 0; k < sets.size(); ++k) sums.template mark<Kernel>(sets[k], k, pieces);
        sums.mark_mirrored(grid);
        S* const nodes = grid.nodes(0);
        sums.template expect<node_width>(nodes);
        {
            const detail::Phase phase(state.trace, "clear");
            firn::detail::clear(nodes, node_width, grid, threads);
            sums.clear(nodes);
        }
        for (int batch = 0; batch < 2; ++batch) {
            {
                const detail::Phase phase(state.trace, batch == 0 ? "scatter first half" : "scatter second half");
                for (std::size_t k = 0; k < sets.size(); ++k) {
                    const std::size_t split = shared.phases_of_batch(k);
                    const PhaseRange range = batch == 0 ? PhaseRange{0, split} : PhaseRange{split};
                    firn::detail::scatter_coloured<Kernel, Transfer, Force>(sets[k], pieces, dt, threads,
                                                                            FloatSums<S>{}, nodes, range);
                }
            }
            sums.template send<node_width>(nodes, batch);
        }
        sums.template add<node_width>(nodes);
        sums.template send_back<node_width>(nodes);
    });
}

/// Particles to grid on many ranks, with sums in integers. Collective.
/// \throws overflow_error  if a sum could leave the range of Integer; all ranks throw it
template <class Kernel, class Transfer, class Force, class Integer, Adding How, std::floating_point S, int D,
          class View>
void p2g(const Distributed<FixedPoint<Integer, How>>& execution, SparseGrid<S, D>& grid, double dt,
         ParticleSets<View> sets) {
    const Ranks ranks = ranks_of(execution);
    detail::RankState& state = ranks.state();
    firn::detail::check_p2g(grid, dt, sets);
    const int threads = thread_count(execution.threads);
    parallel_region(threads, [&] {
        detail::SharedSums<D> sums(state.all, state.of<D>().shared, state.memory, state.mirrors, threads, state.trace);
        for (std::size_t k = 0; k < sets.size(); ++k) sums.template mark<Kernel>(sets[k], k, grid);
        sums.mark_mirrored(grid);
        detail::JoinQuanta<Integer, S, D> join(state.all, sums);
        const FixedPointScale<S> scale = firn::detail::sum_in_quanta<Kernel, Transfer, Force>(
            static_cast<const FixedPoint<Integer, How>&>(execution), join, grid, dt, sets);
        Integer* const integers = firn::detail::integers_of<Integer>(grid).sums;
        join.join_sums(integers);
        firn::detail::to_nodes(integers, scale, grid, threads);
    });
}

}  // namespace firn::inline FIRN_BUILD::mpi
