/// \file firn_mpi_states FOLDER [PARTICLES]: writes and reads a state of particles in 3D whose rows are on all ranks,
/// and the same state on rank 0 alone without MPI, by turns. Prints the medians of seconds, the ratios, and how many
/// bytes of memory a particle of its share a rank needs besides its state.
#include <firn/firn.hpp>
#include <firn/io/state_reader.hpp>
#include <firn/mpi/state_reader.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

namespace {

using namespace firn;

/// A state of `count` particles, of which those with the numbers [first, end) along the curve are given. Ids follow the
/// curve in pieces of 4096, that are scattered over it.
State<float> some(std::uint64_t count, std::uint64_t first, std::uint64_t end) {
    State<float> state;
    state.fields = {{"position", "m", 3, {}},          {"place", "1", 3, {}},
                    {"velocity", "m/s", 3, {}},        {"C", "1/s", 9, {}},
                    {"kirchhoff_stress", "Pa", 6, {}}, {"mass", "kg", 1, {}},
                    {"volume", "m^3", 1, {}},          {"deformation_gradient", "1", 9, {}}};
    constexpr std::uint64_t piece = 4096;
    const std::uint64_t pieces = (count + piece - 1) / piece;
    std::uint64_t stride = pieces / 2 + 1;  // without a common factor with `pieces`, so that all pieces are met
    while (std::gcd(stride, pieces) != 1) ++stride;
    std::vector<std::pair<std::int64_t, std::int64_t>> rows;  // id, slot
    for (std::uint64_t slot = first; slot < end; ++slot) {
        const std::uint64_t id = slot / piece * stride % pieces * piece + slot % piece;
        rows.push_back({std::int64_t(id), std::int64_t(slot - first)});
    }
    std::sort(rows.begin(), rows.end());
    state.tables = {{"slot", 1, {}}, {"blocks", 5, {}}};
    for (const auto& [id, slot] : rows) {
        state.id.push_back(id);
        state.tables[0].values.push_back(slot);
    }
    for (std::uint64_t slot = first; slot < end; slot += 512)
        state.tables[1].values.insert(state.tables[1].values.end(),
                                      {0, 0, std::int64_t(slot / 512), std::int64_t(slot - first),
                                       std::int64_t(std::min<std::uint64_t>(512, end - slot))});
    state.body.resize(rows.size());
    for (auto& field : state.fields)
        for (const auto& row : rows)
            for (int c = 0; c < field.components; ++c) field.values.push_back(float(row.first) + float(c));
    return state;
}

double seconds(const mpi::Communicator& all, const std::function<void()>& work) {
    all.barrier();
    const auto start = std::chrono::steady_clock::now();
    work();
    const double mine = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return all.max(mine);
}

/// Returns a line of /proc/self/status in bytes.
double status(const std::string& name) {
    std::ifstream file("/proc/self/status");
    for (std::string word; file >> word;)
        if (word == name + ":") {
            double kilobytes = 0;
            file >> kilobytes;
            return 1024 * kilobytes;
        }
    return 0;
}
/// Returns how many bytes more the process has while work() runs than before.
double peak(const std::function<void()>& work) {
    std::ofstream("/proc/self/clear_refs") << 5;
    const double before = status("VmRSS");
    work();
    return status("VmHWM") - before;
}

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
    mpi::Session session(argc, argv);
    const mpi::Communicator all;
    if (argc < 2) throw usage_error("Give a folder.");
    const std::string folder = argv[1];
    const std::uint64_t count = argc > 2 ? std::stoull(argv[2]) : 2'000'000, step = 512;
    const auto cut = [&](int rank) {
        return std::min(count, count / step * std::uint64_t(rank) / std::uint64_t(all.size()) * step +
                                   (rank == all.size() ? count : 0));
    };
    const State<float> mine = some(count, cut(all.rank()), cut(all.rank() + 1));
    State<float> whole;
    if (all.rank() == 0) whole = some(count, 0, count);
    std::vector<double> writes, reads, serial_writes, serial_reads;
    double write_bytes = 0, read_bytes = 0;
    for (int i = 0; i < 7; ++i) {
        const auto alone = [&](const std::function<void()>& work) {
            return seconds(all, [&] {
                if (all.rank() == 0) work();
            });
        };
        serial_writes.push_back(alone([&] { write_state(folder + "/serial.hdf", whole); }));
        writes.push_back(
            seconds(all, [&] { write_bytes = peak([&] { mpi::write_state(all, folder + "/ranks.hdf", mine); }); }));
        serial_reads.push_back(alone([&] { return read_state<float>(folder + "/serial.hdf"); }));
        reads.push_back(seconds(all, [&] {
            State<float> state;
            read_bytes = peak([&] { state = mpi::read_state<float>(all, folder + "/ranks.hdf"); });
        }));
    }
    const double share = double(count) / all.size();
    write_bytes = all.max(write_bytes) / share;
    read_bytes = all.max(read_bytes) / share;
    if (all.rank() > 0) return 0;
    std::ifstream file(folder + "/ranks.hdf", std::ios::binary | std::ios::ate);
    std::printf("%llu particles, %d ranks, a file of %.0f bytes a particle\n", static_cast<unsigned long long>(count),
                all.size(), double(file.tellg()) / double(count));
    const auto print = [](const char* what, const std::vector<double>& ranks, const std::vector<double>& serial,
                          double bytes) {
        const double least = *std::ranges::min_element(ranks), least_serial = *std::ranges::min_element(serial);
        std::printf(
            "%s: least %.3f s, without MPI %.3f s, ratio %.2f; medians %.3f s, %.3f s, ratio %.2f; %.0f bytes\n", what,
            least, least_serial, least / least_serial, median(ranks), median(serial), median(ranks) / median(serial),
            bytes);
    };
    print("write", writes, serial_writes, write_bytes);
    print("read", reads, serial_reads, read_bytes);
}
