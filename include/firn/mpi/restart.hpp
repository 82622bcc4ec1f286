/// \file Restores a simulation on many ranks from a state, whatever number of ranks wrote it.
#pragma once

#include <firn/io/restart-inl.hpp>
#include <firn/mpi/distributed.hpp>
#include <firn/mpi/state_reader.hpp>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::mpi {

namespace detail {

/// Which rank gets which particles of a state: intervals of the curve, and of the slots along it.
template <int D>
struct SharesOfState {
    Cuts<D> cuts;
    std::vector<std::uint64_t> first_slot;  ///< for each rank, its first slot
};

/// Shares out the particles of a state evenly. Collective.
template <int D>
SharesOfState<D> share_out(const Communicator& all, const std::vector<BlockRow<D>>& blocks) {
    std::vector<CubeWeight> weights;
    for (const BlockRow<D>& row : blocks)
        weights.push_back({curve_key<D>(cube_of<D>(row.block)), std::uint64_t(std::max<std::int64_t>(row.count, 0))});
    std::sort(weights.begin(), weights.end());
    SharesOfState<D> shares{balanced_cuts<D>(std::span<const CubeWeight>(weights), all.size(),
                                             [&](std::span<std::uint64_t> numbers) { all.sum(numbers); }),
                            {}};
    const WeightBelow below(weights);
    for (const std::uint64_t key : shares.cuts.first) shares.first_slot.push_back(below(key));
    all.sum(std::span<std::uint64_t>(shares.first_slot));
    shares.first_slot[0] = 0;
    return shares;
}

/// Returns the rows grouped by rank, and the order in which they are then: row order[k] is the k-th. \param owner
/// owner(i): the rank of row i
template <class Owner>
std::vector<RowsOfRank> group_by_rank(std::size_t rows, int ranks, const Owner& owner,
                                      std::vector<std::uint32_t>& order) {
    std::vector<std::size_t> next(std::size_t(ranks) + 1);
    for (std::size_t i = 0; i < rows; ++i) ++next[std::size_t(owner(i)) + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    std::vector<RowsOfRank> groups;
    for (int rank = 0; rank < ranks; ++rank) {
        const std::size_t first = next[std::size_t(rank)], end = next[std::size_t(rank) + 1];
        if (end > first) groups.push_back({rank, first, end - first});
    }
    order.resize(rows);
    for (std::size_t i = 0; i < rows; ++i) order[next[std::size_t(owner(i))]++] = std::uint32_t(i);
    return groups;
}

/// Sends the particles of a state to the ranks that own their blocks, and the blocks with them. Collective.
/// \param part  what this rank has read; its memory is released on the way
/// \return  the state of this rank's particles: its slots begin with 0
template <int D, class S>
State<S> bring_home(const Communicator& all, State<S> part, const SharesOfState<D>& shares) {
    StateTable& slots = *find_table(part.tables, "slot", 1);
    StateTable& blocks = *find_table(part.tables, "blocks", D + 2);
    const auto first_of = [&](int rank) { return std::int64_t(shares.first_slot[std::size_t(rank)]); };
    const std::int64_t first = first_of(all.rank());
    {
        std::vector<std::uint32_t> order;
        const std::vector<BlockRow<D>> rows = block_rows<D>(blocks);
        auto groups = group_by_rank(
            rows.size(), all.size(), [&](std::size_t i) { return shares.cuts.owner(rows[i].block); }, order);
        const RowExchange exchange(all, std::move(groups));
        const auto grouped = in_order(std::move(blocks.values), D + 2, order);
        blocks.values = exchange.move(std::span(grouped), D + 2);
        for (std::size_t at = D; at < blocks.values.size(); at += D + 2) blocks.values[at] -= first;
    }
    std::vector<std::uint32_t> order;
    auto groups = group_by_rank(
        part.size(), all.size(),
        [&](std::size_t i) {
            // A slot that no block has goes to a rank that then refuses it.
            const auto& firsts = shares.first_slot;
            const auto slot = std::uint64_t(std::max<std::int64_t>(slots.values[i], 0));
            return int(std::upper_bound(firsts.begin(), firsts.end(), slot) - firsts.begin()) - 1;
        },
        order);
    const RowExchange exchange(all, std::move(groups));
    const auto move = [&](auto& values, std::size_t columns) {
        const auto grouped = in_order(std::move(values), columns, order);
        values = exchange.move(std::span(grouped), columns);
    };
    move(part.id, 1);
    move(part.body, 1);
    move(slots.values, 1);
    for (std::int64_t& slot : slots.values) slot -= first;
    for (StateField<S>& field : part.fields) move(field.values, std::size_t(field.components));
    return part;
}

}  // namespace detail

/// Restores a set of particles (all particles of one material) of a simulation on many ranks, so that the run can be
/// continued. The state may have been written on any number of ranks, or without MPI; the continued run has the bits of
/// the run that wrote it. Collective. What is taken from the state is listed at firn::restore().
///
///     firn::mpi::restore(simulation, firn::mpi::read_state<float>(simulation.execution.communicator(), "state.hdf"));
///
/// The particles are shared out evenly along the curve.
/// \param set    the set; in a simulation with several materials for example `simulation.set<Snow<float>>()`
/// \param state  the part of the state that this rank has read. \see read_state
/// \param how    which states are accepted
/// \throws io_error        in the same cases as firn::restore(); all ranks throw the same error, and the simulation is
///                         unchanged
/// \throws particle_error  if particles are outside the domain; the simulation is unchanged
template <class Simulation, std::size_t I, state_scalar T>
    requires(!has_one_rank<decltype(Simulation::execution)>)
void restore(SetHandle<Simulation, I> set, State<T> state, Restart how = Restart::same_bits) {
    constexpr int D = Simulation::dimension;
    Simulation& simulation = set.simulation();
    const Communicator& all = simulation.execution.communicator();
    detail::SharesOfState<D> shares;
    if (how != Restart::converted) {
        detail::together(all, [&] {
            firn::detail::check_dimension(state, D);
            firn::detail::table(state.tables, "slot", 1);
            const StateTable& blocks = firn::detail::table(state.tables, "blocks", D + 2);
            if (firn::detail::table(state.tables, "slot", 1).values.size() != state.size() ||
                blocks.values.size() % (D + 2) != 0)
                firn::detail::throw_damaged("table of blocks");
        });
        const std::vector<detail::BlockRow<D>> rows =
            detail::block_rows<D>(*detail::find_table(state.tables, "blocks", D + 2));
        shares = detail::share_out<D>(all, rows);
        state = detail::bring_home<D>(all, std::move(state), shares);
    }
    auto made = detail::together(all, [&] { return firn::detail::read_set(set, state, how); });
    state = {};
    if (how != Restart::converted) simulation.execution.set_cuts(I, shares.cuts);
    firn::detail::give_set<Simulation, I>(simulation, std::move(made));
}
/// Restores a simulation with one material on many ranks, so that the run can be continued. The documentation of
/// restore() for a set of particles says more.
/// \param state  the part of the state that this rank has read. \see read_state
/// \param how    which states are accepted
/// \throws io_error, particle_error  as restore() for a set of particles
template <int D, class Material, class... Policies, state_scalar T>
    requires(!has_one_rank<decltype(Simulation<D, Material, Policies...>::execution)>)
void restore(Simulation<D, Material, Policies...>& simulation, State<T> state, Restart how = Restart::same_bits) {
    restore(simulation.set(), std::move(state), how);
}

}  // namespace firn::inline FIRN_BUILD::mpi
