/// \file Compares runs on many ranks with a run on one, bit by bit.
#pragma once

#include "support/catch.hpp"

#include "mpi/scenes.hpp"

#include <array>
#include <span>
#include <vector>

namespace scenes {

/// What must be the same on any number of ranks.
struct Seen {
    std::vector<std::uint64_t> particles{};  ///< the fingerprint of all particles, after some steps
    std::vector<double> totals{};            ///< totals and reactions
    std::uint64_t migrations = 0;            ///< how often particles were shared out anew

    bool operator==(const Seen& other) const { return particles == other.particles && totals == other.totals; }
};

/// Runs a scene.
template <class Simulation>
Seen look_at(Simulation&& simulation, int steps) {
    constexpr int D = std::remove_cvref_t<Simulation>::dimension;
    Seen seen;
    simulation.warn = nullptr;
    for (int k = 1; k <= steps; ++k) {
        simulation.step();
        if (k % 20 != 0 && k != 1) continue;
        seen.particles.push_back(fingerprint(simulation));
        seen.totals.push_back(simulation.last_time_step());
        const auto note = [&](const auto& set) {
            const Totals<D> totals = set.totals();
            seen.totals.insert(seen.totals.end(), {double(totals.particles), totals.mass, totals.kinetic_energy,
                                                   totals.elastic_energy, totals.momentum[0], totals.momentum[1]});
        };
        [&]<std::size_t... I>(std::index_sequence<I...>) {
            (note(simulation.template set<I>()), ...);
        }(std::make_index_sequence<std::remove_cvref_t<Simulation>::material_count>{});
        if (simulation.reactions)
            for (const Reaction<D>& part : simulation.reactions->parts)
                seen.totals.insert(seen.totals.end(), {part.impulse[0], part.impulse[1]});
        if (simulation.contact_impulses)
            for (const auto& [groups, impulse] : simulation.contact_impulses->on_first)
                seen.totals.insert(seen.totals.end(),
                                   {double(groups.first), double(groups.second), impulse[0], impulse[1]});
    }
    if constexpr (requires { simulation.execution.migrations(); }) seen.migrations = simulation.execution.migrations();
    return seen;
}

/// Runs a scene on all ranks, and on rank 0 alone. Checks that both give the same bits.
/// \param make  make(execution) returns the simulation
/// \return what was seen on all ranks
template <class Inner, class Make>
Seen check_same_bits(const Make& make, int steps) {
    const mpi::Communicator all;
    auto simulation = make(mpi::Distributed<Inner>({}, all));
    simulation.execution.largest_imbalance = 0;  // cuts move as often as they can
    const Seen many = look_at(simulation, steps);
    if (all.rank() == 0) {
        const Seen one = look_at(make(mpi::Distributed<Inner>({}, mpi::Communicator(MPI_COMM_SELF))), steps);
        CHECK(many.particles == one.particles);
        CHECK(many.totals == one.totals);
    }
    return many;
}

}  // namespace scenes
