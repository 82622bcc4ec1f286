// ranks: 3
// more_ranks: 1 2 4
// threads: 1 2
/// \file A run on many ranks writes the states of a run without MPI, and goes on from them, whoever wrote them.
#include "mpi/restart.hpp"

#include "support/message.hpp"

namespace mpi_restart {
namespace {

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

/// Checks that a run on ranks goes on from the state of a run without MPI as that run does.
/// \param write_begin  write_begin(run, path): writes the state as PATH0.hdf, and makes the run go on from it
template <class WriteBegin>
void check_goes_on(Restart how, const WriteBegin& write_begin) {
    const mpi::Communicator all;
    const SharedFolder folder(all);
    if (all.rank() == 0) {
        auto alone = scenes::two_cubes(Coloured{});
        steps(alone, 20);
        write_begin(alone, folder / "state");
        steps(alone, 20);
        write(alone, folder / "end");
    }
    all.barrier();
    auto again = scenes::two_cubes(mpi::Distributed<Coloured>{});
    read(again, folder / "state", how);
    steps(again, 20);
    write(again, folder / "again");
    CHECK(bytes_of(folder / "end0.hdf") == bytes_of(folder / "again0.hdf"));
}

}  // namespace

TEST_CASE("States and restarts of two cubes have the bits of a run without MPI") {
    check_restart<Coloured>([](const auto& e) { return scenes::two_cubes(e); }, 25, 30);
}
TEST_CASE("A run on ranks goes on from a state with the slots of earlier versions") {
    check_goes_on(Restart::same_bits, [](auto& alone, const fs::path& path) {
        State<float> state = state_of(alone);
        make_old(alone, state);
        write_state(file_of(path, 0), state);
    });
}

TEST_CASE("A state of another run is converted on ranks as it is without") {
    check_goes_on(Restart::converted, [](auto& alone, const fs::path& path) {
        write(alone, path);
        read(alone, path, Restart::converted);
    });
}

TEST_CASE("A state that is damaged or of another run is refused on all ranks, and the simulation is as it was") {
    const mpi::Communicator all;
    const SharedFolder folder(all);
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
