/// \file firn_full_disk FOLDER: fills the small disk that FOLDER is with states, by each page another room for them.
/// What was written stays whole and listed, what could not be written leaves nothing behind, and writing goes on with
/// room.
#include <firn/data/scratch_file.hpp>
#include <firn/io/background_series.hpp>
#include <firn/io/ply_series.hpp>
#include <firn/io/states.hpp>
#include <firn/io/usd_series.hpp>

#include "unit/io/example_state.hpp"

#include <cstdio>
#include <cstdlib>
#include <map>

namespace {

using State = firn::State<float>;

void require(bool holds, const std::string& what) {
    if (holds) return;
    std::printf("Not so: %s\n", what.c_str());
    std::exit(1);
}

State at_time(double time) {
    auto state = states::example<float>(3, 900);  // about 130 kB
    state.time = time;
    return state;
}

/// The folder holds `count` states, listed, whole and with the values that were written, and `others`; nothing else but
/// the state after them, whole, where there was room for it but not for the list.
void check_series(const std::filesystem::path& folder, std::size_t count, std::set<std::string> others) {
    const auto list = firn::read_series(folder / "run.hdf.series");
    require(list.size() == count, "the list has what was written");
    others.insert("run.hdf.series");
    for (std::size_t i = 0; i < count; ++i) {
        require(list[i].time == double(i), "the list has the times");
        const auto state = firn::read_state<float>(folder / list[i].file);
        require(states::same_bits(state, at_time(double(i))), list[i].file + " has what was written");
        others.insert(list[i].file);
    }
    std::set<std::string> found;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) found.insert(entry.path().filename());
    for (const auto& name : found) require(others.contains(name), name + " is no file of the series");
    require(found == others, "no file is missing");
}

/// Writes states from time `first` on until the disk is full. Returns what the error says.
template <class Write>
std::string fill(double first, const Write& write) {
    for (int i = 0; i < 1000; ++i) {
        try {
            write(at_time(first + i));
        } catch (const firn::io_error& full) {
            return full.what();
        }
    }
    require(false, "the disk is full at last");
    return {};
}

void check_message(const std::string& said, const std::filesystem::path& folder) {
    std::printf("%s\n", said.c_str());
    require(states::holds(said, "No space left on device"), "the error says that there is no space left");
    require(states::holds(said, (folder / "run").string()), "the error names the file");
}

void put_ballast(const std::filesystem::path& folder, std::size_t bytes) {
    std::ofstream(folder / "ballast", std::ios::binary) << std::string(bytes, 'b');
}

void check_series_in_turn(const std::filesystem::path& folder, std::size_t ballast) {
    put_ballast(folder, ballast);
    {
        firn::StateSeries series(folder, "run");
        check_message(fill(double(series.size()), [&](const State& state) { series.write(state); }), folder);
        const std::size_t written = series.size();
        require(written >= 2, "some states have room");
        check_series(folder, written, {"ballast"});
        check_message(fill(double(series.size()), [&](const State& state) { series.write(state); }), folder);
        check_series(folder, written, {"ballast"});
        std::filesystem::remove(folder / "ballast");
        series.write(at_time(double(written)));
        check_series(folder, written + 1, {});
    }
    for (const auto& entry : std::filesystem::directory_iterator(folder)) std::filesystem::remove(entry);
}

void check_series_in_the_background(const std::filesystem::path& folder, std::size_t ballast) {
    put_ballast(folder, ballast);
    {
        firn::BackgroundSeries<float> series(folder, "run");
        std::size_t taken = 0;
        check_message(fill(0,
                           [&](State state) {
                               series.write(std::move(state));
                               ++taken;
                           }),
                      folder);
        std::filesystem::remove(folder / "ballast");
        // What could not be written was kept. An attempt that began before there was room may fail, and be told, too.
        try {
            series.finish();
        } catch (const firn::io_error&) {
            series.finish();
        }
        check_series(folder, taken, {});
    }
    for (const auto& entry : std::filesystem::directory_iterator(folder)) std::filesystem::remove(entry);
}

/// A state that can be drawn.
State finite_at(double time) {
    State state = at_time(time);
    for (auto& field : state.fields)
        for (std::size_t i = 0; i < field.values.size(); ++i) field.values[i] = float(i) + float(time);
    for (std::size_t i = 0; i < state.id.size(); ++i) state.id[i] = std::int64_t(i);
    return state;
}

std::map<std::string, std::string> files_in(const std::filesystem::path& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.path().filename() != "ballast")
            files[entry.path().filename().string()] = states::bytes_of(entry.path());
    return files;
}

/// A series for pictures: what could not be written leaves all files as they were after the last write, and the next
/// write goes on.
/// \param read_list  reads the list of a series
template <class Series, class Read>
void check_drawn_series(const std::filesystem::path& folder, std::size_t ballast,
                        const typename Series::Options& options, const Read& read_list) {
    put_ballast(folder, ballast);
    {
        Series series(folder, "run", options);
        std::map<std::string, std::string> files;
        const auto write = [&](double time) {
            series.write(finite_at(time));
            files = files_in(folder);
        };
        for (int attempt = 0; attempt < 2; ++attempt) {
            check_message(fill(double(series.size()), [&](const State& state) { write(state.time); }), folder);
            require(series.size() >= 2, "some files have room");
            require(files_in(folder) == files, "what could not be written leaves the files as they were");
            require(read_list(series.path()) == series.entries(), "the list has what was written");
        }
        std::filesystem::remove(folder / "ballast");
        write(double(series.size()));
        const auto list = read_list(series.path());
        require(list.size() == series.size(), "writing goes on with room");
        for (std::size_t i = 0; i < list.size(); ++i)
            require(list[i].time == double(i) && files.contains(list[i].file), "each file in the list is there");
        require(files.size() == list.size() + 1, "there are no other files");
    }
    for (const auto& entry : std::filesystem::directory_iterator(folder)) std::filesystem::remove(entry);
}

/// Records are written until the disk is full. Those that were written stay as they are, and when one of them is given
/// up, its room is used again.
void check_scratch_file(const std::filesystem::path& folder) {
    firn::ScratchFile file(folder.string(), std::size_t(1) << 30);
    const auto bytes_of = [](std::size_t k) { return std::vector<std::byte>(100'000, std::byte(k)); };
    const auto record = [&](std::size_t k) {
        const std::vector<std::byte> bytes = bytes_of(k);
        const std::span<const std::byte> part(bytes);
        return std::move(file.write(std::span(&part, 1)).value());
    };
    std::vector<firn::ScratchFile::Record> written;
    std::string said;
    while (said.empty() && written.size() < 1000) {
        try {
            written.push_back(record(written.size()));
        } catch (const firn::io_error& full) {
            said = full.what();
        }
    }
    std::printf("%s\n", said.c_str());
    require(states::holds(said, "No space left on device"), "the error says that there is no space left");
    require(states::holds(said, folder.string()), "the error names the folder");
    require(written.size() >= 4, "some records have room");
    written.erase(written.begin() + 1);
    written.push_back(record(written.size() + 1));  // in its room
    for (std::size_t k = 0; k < written.size(); ++k) {
        std::vector<std::byte> bytes(100'000);
        const std::span<std::byte> part(bytes);
        file.read(written[k], std::span(&part, 1));
        require(bytes == bytes_of(k == 0 ? 0 : k + 1), "a record is as it was written");
    }
    require(std::filesystem::is_empty(folder), "a scratch file has no name");
}

}  // namespace

int main(int, char** arguments) {
    const std::filesystem::path folder = arguments[1];
    const auto space = std::filesystem::space(folder);
    require(space.capacity <= 2'000'000, "the disk is small");
    constexpr std::size_t page = 4096;
    // By a page each time: full at each page of a state, and where the state has room but the list has not.
    for (std::size_t pages = 0; pages < 40; ++pages) check_series_in_turn(folder, 300'000 + pages * page);
    check_series_in_the_background(folder, 500'000);
    for (std::size_t pages = 0; pages < 20; ++pages) {
        const std::size_t ballast = 500'000 + pages * page;
        check_drawn_series<firn::PlySeries>(folder, ballast, {.fields = {"velocity", "C"}}, firn::read_series);
        check_drawn_series<firn::UsdSeries>(folder, ballast, {.width = 0.1}, firn::detail::read_usd_list);
    }
    check_scratch_file(folder);
    std::printf("all so\n");
    return 0;
}
