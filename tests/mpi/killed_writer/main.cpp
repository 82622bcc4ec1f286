/// \file firn_mpi_writing HOW FOLDER: a program that run.sh kills or lets run out of disk.
///     write FOLDER   writes a series of states in FOLDER without end. Each rank leaves a file FOLDER/processes/PID,
///     and
///                    rank 0 appends a line to FOLDER/written for each state that is written.
///     fill FOLDER    the same, until a state cannot be written; then a state must be writable again after earlier ones
///                    were removed
///     check FOLDER   without MPI: reads all states of the series, and compares them with what was written
#include <firn/firn.hpp>
#include <firn/io/state_reader.hpp>
#include <firn/mpi/state_series.hpp>

#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <string>

namespace {

using namespace firn;

constexpr std::uint64_t particles = 60'000, of_block = 300;

/// The state after `step` steps, of the particles [first, end) along the curve; ids run against it.
State<float> some(std::uint64_t step, std::uint64_t first, std::uint64_t end) {
    State<float> state;
    state.step = step;
    state.time = double(step);
    state.fields = {{"position", "m", 3, {}}, {"deformation_gradient", "1", 9, {}}};
    state.tables = {{"slot", 1, {}}, {"blocks", 5, {}}};
    for (std::uint64_t slot = end; slot-- > first;) {
        state.id.push_back(std::int64_t(particles - 1 - slot));
        state.tables[0].values.push_back(std::int64_t(slot - first));
    }
    for (std::uint64_t slot = first; slot < end; slot += of_block)
        state.tables[1].values.insert(state.tables[1].values.end(),
                                      {0, 0, std::int64_t(slot / of_block), std::int64_t(slot - first), of_block});
    state.body.resize(state.size());
    for (auto& field : state.fields)
        for (const std::int64_t id : state.id)
            for (int c = 0; c < field.components; ++c) field.values.push_back(float(id) + float(step) * float(c));
    return state;
}

/// Returns whether all states of the list are as they were written, and at least as many as rank 0 has noted.
bool check(const std::string& folder) {
    std::ifstream written(folder + "/written");
    std::size_t noted = 0;
    for (std::string line; std::getline(written, line);) ++noted;
    const std::string list = folder + "/run.hdf.series";
    std::vector<SeriesEntry> entries;
    if (noted > 0 || std::filesystem::exists(list)) entries = read_series(list);
    bool right = entries.size() >= noted && entries.size() <= noted + 1;
    for (std::size_t i = 0; i < entries.size(); ++i)
        right = right && read_state<float>(folder + "/" + entries[i].file) == some(i, 0, particles);
    std::printf("%zu states noted, %zu in the list, %s\n", noted, entries.size(), right ? "whole" : "NOT WHOLE");
    return right;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 3) return 2;
    const std::string how = argv[1], folder = argv[2];
    if (how == "check") return check(folder) ? 0 : 1;

    mpi::Session session(argc, argv);
    const mpi::Communicator all;
    std::ofstream(folder + "/processes/" + std::to_string(::getpid()));
    const auto cut = [&](int rank) {
        return particles / of_block * std::uint64_t(rank) / std::uint64_t(all.size()) * of_block;
    };
    mpi::StateSeries series(all, folder, "run");
    std::ofstream written;
    if (all.rank() == 0) written.open(folder + "/written");
    for (std::uint64_t step = 0;; ++step) {
        const State<float> mine = some(step, cut(all.rank()), cut(all.rank() + 1));
        try {
            series.write(mine);
        } catch (const io_error& failure) {
            if (how != "fill") throw;
            std::string said = failure.what();
            bool same = all.min(all.text_of(0, said) == said ? 1 : 0) == 1;
            if (all.rank() == 0) {
                // The disk has no remains of the state: the room of an earlier state is enough for it.
                std::filesystem::remove(folder + "/run_0000.hdf");
                std::printf("%zu states, then on %s: %s\n", series.size(), same ? "all ranks" : "NOT ALL RANKS",
                            said.c_str());
            }
            all.barrier();
            series.write(mine);
            if (all.rank() == 0) std::printf("written again: %zu states\n", series.size());
            return same ? 0 : 1;
        }
        written << step << std::endl;
    }
}
