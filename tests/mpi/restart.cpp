// threads: 1 2
// release: -O0
/// \file A run on many ranks writes the states of a run without MPI, and goes on from them, whoever wrote them.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/mpi/states.hpp>

#include "scenes.hpp"
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace mpi_restart {
namespace {

using namespace firn;
namespace fs = std::filesystem;

/// An empty folder that all ranks know, removed with all that is in it.
class Folder {
public:
    explicit Folder(const mpi::Communicator& all) : all_(all) {
        std::string pattern = (fs::temp_directory_path() / "firn-mpi-restart-XXXXXX").string();
        if (all.rank() == 0 && !::mkdtemp(pattern.data())) throw std::runtime_error("no temporary folder");
        path_ = all.text_of(0, pattern);
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    ~Folder() {
        all_.barrier();
        std::error_code ignored;
        if (all_.rank() == 0) fs::remove_all(path_, ignored);
    }
    fs::path operator/(const std::string& name) const { return path_ / name; }

private:
    const mpi::Communicator& all_;
    fs::path path_;
};

std::string bytes_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// Calls f(set, I) for each set of particles of a simulation.
template <class Simulation, class F>
void for_sets(Simulation& simulation, const F& f) {
    [&]<std::size_t... I>(std::index_sequence<I...>) {
        (f(simulation.template set<I>(), I), ...);
    }(std::make_index_sequence<Simulation::material_count>{});
}
fs::path file_of(const fs::path& path, std::size_t set) { return path.string() + std::to_string(set) + ".hdf"; }

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
    const Folder folder(all);
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

/// Turns the tables of a state that a run without MPI has written into those of schema_version 3.
template <class Simulation>
void make_old(Simulation& simulation, State<float>& state) {
    constexpr int D = Simulation::dimension;
    const auto slots = slots_by_id(simulation.particles(), 1);
    state.tables[0].values.assign(slots.begin(), slots.end());
    auto& blocks = state.tables[1].values;
    blocks.clear();
    const BlockPartition<D>& partition = simulation.partition();
    for (const std::uint32_t r : partition.by_block) {
        const BlockRange<D>& range = partition.ranges[r];
        for (const int coordinate : range.block) blocks.push_back(coordinate);
        blocks.push_back(std::int64_t(range.first_slot));
        blocks.push_back(std::int64_t(range.particles));
    }
}

}  // namespace

TEST_CASE("States and restarts of two cubes have the bits of a run without MPI") {
    check_restart<Coloured>([](const auto& e) { return scenes::two_cubes(e); }, 25, 30);
}
TEST_CASE("States and restarts of spray have the bits of a run without MPI") {
    check_restart<Coloured>([](const auto& e) { return scenes::spray(e); }, 10, 15);
}
TEST_CASE("States and restarts of four materials have the bits of a run without MPI") {
    check_restart<Coloured>([](const auto& e) { return scenes::four_materials(e); }, 8, 12);
}
TEST_CASE("States and restarts of a fountain have the bits of a run without MPI") {
    check_restart<Coloured>([](const auto& e) { return scenes::fountain(e); }, 60, 60);
}
TEST_CASE("States and restarts of waves in double have the bits of a run without MPI") {
    check_restart<Coloured>([](const auto& e) { return scenes::waves(e); }, 15, 20);
}
TEST_CASE("States and restarts of sums in integers have the bits of a run without MPI") {
    check_restart<FixedPoint<std::int64_t>>([](const auto& e) { return scenes::two_cubes(e); }, 10, 10);
}

TEST_CASE("A run on ranks goes on from a state with the slots of earlier versions") {
    const mpi::Communicator all;
    const Folder folder(all);
    if (all.rank() == 0) {
        auto alone = scenes::two_cubes(Coloured{});
        steps(alone, 20);
        State<float> state = state_of(alone);
        make_old(alone, state);
        write_state(folder / "old0.hdf", state);
        steps(alone, 20);
        write(alone, folder / "end");
    }
    all.barrier();
    auto again = scenes::two_cubes(mpi::Distributed<Coloured>{});
    read(again, folder / "old");
    steps(again, 20);
    write(again, folder / "again");
    CHECK(bytes_of(folder / "end0.hdf") == bytes_of(folder / "again0.hdf"));
}

TEST_CASE("A state of another run is converted on ranks as it is without") {
    const mpi::Communicator all;
    const Folder folder(all);
    if (all.rank() == 0) {
        auto alone = scenes::two_cubes(Coloured{});
        steps(alone, 20);
        write(alone, folder / "state");
        read(alone, folder / "state", Restart::converted);
        steps(alone, 20);
        write(alone, folder / "end");
    }
    all.barrier();
    auto again = scenes::two_cubes(mpi::Distributed<Coloured>{});
    read(again, folder / "state", Restart::converted);
    steps(again, 20);
    write(again, folder / "again");
    CHECK(bytes_of(folder / "end0.hdf") == bytes_of(folder / "again0.hdf"));
}

TEST_CASE("A state that is damaged or of another run is refused on all ranks, and the simulation is as it was") {
    const mpi::Communicator all;
    const Folder folder(all);
    auto run = scenes::two_cubes(mpi::Distributed<Coloured>{});
    steps(run, 5);
    write(run, folder / "state");
    const auto was = scenes::fingerprint(run);
    const auto refused = [&](const char* word, const auto& damage) {
        auto state = mpi::read_state<float>(all, folder / "state0.hdf");
        damage(state);
        const std::string said = test_support::message<io_error>([&] { mpi::restore(run, state); });
        UNSCOPED_INFO(said << " | " << word);
        CHECK(test_support::holds(said, word));
        CHECK(all.text_of(0, said) == said);
        CHECK(scenes::fingerprint(run) == was);
    };
    const bool last = all.rank() + 1 == all.size();
    refused("is inconsistent", [&](auto& s) {
        if (last) s.tables[0].values[3] = s.tables[0].values[4];
    });
    refused("is inconsistent", [&](auto& s) {
        if (last) s.tables[0].values[3] = -7;
    });
    refused("is inconsistent", [&](auto& s) {
        if (last) s.tables[1].values[0] = std::int64_t(1) << 40;
    });
    refused("is inconsistent", [&](auto& s) {
        if (last) s.tables[1].values[4] += 1;
    });
    refused("no table 'slot'", [&](auto& s) { s.tables.erase(s.tables.begin()); });
    refused("velocity", [&](auto& s) {
        if (last) s.fields[2].values[5] = std::numeric_limits<float>::infinity();
    });
    refused("'another' for transfer", [&](auto& s) {
        for (auto& attribute : s.attributes)
            if (attribute.name == "transfer") attribute.value = "another";
    });
    steps(run, 5);
}

}  // namespace mpi_restart
