/// \file Compares the states of a run on many ranks, and of runs that go on from them, with those of a run without MPI.
#pragma once

#include "support/catch.hpp"
#include <firn/mpi/states.hpp>

#include "scenes.hpp"
#include "shared_folder.hpp"

namespace mpi_restart {

using namespace firn;
namespace fs = std::filesystem;

/// Calls f(set, I) for each set of particles of a simulation.
template <class Simulation, class F>
void for_sets(Simulation& simulation, const F& f) {
    [&]<std::size_t... I>(std::index_sequence<I...>) {
        (f(simulation.template set<I>(), I), ...);
    }(std::make_index_sequence<Simulation::material_count>{});
}
inline fs::path file_of(const fs::path& path, std::size_t set) { return path.string() + std::to_string(set) + ".hdf"; }

/// Writes the states of all sets of a run without MPI, or on ranks, as PATH0.hdf, PATH1.hdf, ….
template <class Simulation>
void write(Simulation& simulation, const fs::path& path) {
    for_sets(simulation, [&](auto set, std::size_t i) {
        if constexpr (requires { simulation.execution.communicator(); })
            mpi::write_state(simulation.execution.communicator(), file_of(path, i), state_of(set));
        else
            write_state(file_of(path, i), state_of(set));
    });
}
template <class Simulation>
void read(Simulation& simulation, const fs::path& path, Restart how = Restart::same_bits) {
    using S = typename Simulation::scalar_type;
    for_sets(simulation, [&](auto set, std::size_t i) {
        if constexpr (requires { simulation.execution.communicator(); })
            mpi::restore(set, mpi::read_state<S>(simulation.execution.communicator(), file_of(path, i)), how);
        else
            restore(set, read_state<S>(file_of(path, i)), how);
    });
}

template <class Simulation>
void steps(Simulation& simulation, int count) {
    for (int i = 0; i < count; ++i) simulation.step();
}

/// Runs a scene for `before` steps, writes its states, and runs it for `after` more: without MPI on rank 0, and on all
/// ranks. Then goes on from the states. All that is written at the same step has the same bytes.
/// \param scene  scene(execution) makes the simulation
template <class Execution, class Scene>
void check_restart(const Scene& scene, int before, int after) {
    const mpi::Communicator all;
    const SharedFolder folder(all);
    std::size_t sets = 0;
    if (all.rank() == 0) {
        auto alone = scene(Execution{});
        steps(alone, before);
        write(alone, folder / "alone");
        steps(alone, after);
        write(alone, folder / "alone_end");
    }
    const mpi::Distributed<Execution> execution;
    auto whole = scene(execution);
    sets = std::remove_cvref_t<decltype(whole)>::material_count;
    steps(whole, before);
    write(whole, folder / "ranks");
    const auto same = [&](const char* one, const char* other) {
        all.barrier();
        for (std::size_t i = 0; i < sets; ++i) {
            INFO(one << " " << other << " set " << i);
            CHECK(bytes_of(file_of(folder / one, i)) == bytes_of(file_of(folder / other, i)));
        }
    };
    same("alone", "ranks");
    steps(whole, after);
    write(whole, folder / "ranks_end");
    same("alone_end", "ranks_end");

    auto again = scene(execution);
    read(again, folder / "alone");
    write(again, folder / "again");
    same("alone", "again");
    steps(again, after);
    write(again, folder / "again_end");
    same("alone_end", "again_end");
    if (all.rank() == 0) {
        auto alone = scene(Execution{});
        read(alone, folder / "ranks");
        steps(alone, after);
        write(alone, folder / "back_end");
    }
    same("alone_end", "back_end");
}

}  // namespace mpi_restart
