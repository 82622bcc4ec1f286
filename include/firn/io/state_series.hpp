/// \file A run's states as files NAME_0000.hdf, NAME_0001.hdf, … and the list NAME.hdf.series, which ParaView opens:
///
///     {"file-series-version": "1.0", "files": [{"name": "NAME_0000.hdf", "time": 0}, …]}
#pragma once

#include <firn/io/series_file.hpp>
#include <firn/io/state_writer.hpp>

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace firn {

/// Writes states one by one. After each write the list holds all states so far, and each listed state is whole on
/// disk, whenever the program is killed.
///
/// A series starts afresh: nothing happens to older files until the first state is on disk; then the old list is
/// replaced, and states of the old list that are not of the new one are removed, provided they are called NAME_ and
/// four or more digits and .hdf. No other file is touched: not those that the old list does not name, and none at all
/// where the old list cannot be read.
class StateSeries {
public:
    /// Makes the folder where it is missing. Throws parameter_error for a name that is empty or holds '/' or '.',
    /// io_error where the folder cannot be made.
    StateSeries(std::filesystem::path directory, std::string name, const StateOptions& options = {})
        : directory_(std::move(directory)), name_(std::move(name)), options_(options) {
        detail::check_state_name("series", name_);
        std::error_code failure;
        std::filesystem::create_directories(directory_, failure);
        if (failure || !std::filesystem::is_directory(directory_, failure)) {
            throw io_error(sentence("The folder ", directory_, " for states cannot be made: ",
                                    failure ? failure.message() : "there is a file of that name", "."));
        }
    }

    /// Writes the next state, then the list; returns the state's path. Throws what write_state throws; then the
    /// states before are whole and listed, and the same number is tried again next time.
    template <state_scalar S>
    std::filesystem::path write(const State<S>& state) {
        const std::string file = detail::series_member(name_, entries_.size());
        std::vector<std::string> before;
        if (entries_.empty()) before = detail::series_members_on_disk(path(), name_);
        write_state(directory_ / file, state, options_);
        entries_.push_back({file, state.time});
        try {
            write_series(path(), entries_);
        } catch (...) {
            entries_.pop_back();
            throw;
        }
        for (const auto& stale : before) {
            if (stale == file) continue;
            std::error_code failure;
            std::filesystem::remove(directory_ / stale, failure);
            if (failure) {
                throw io_error(sentence("The state ", directory_ / stale,
                                        " of an older series cannot be removed: ", failure.message(), "."));
            }
        }
        return directory_ / file;
    }

    /// The list's path.
    std::filesystem::path path() const { return directory_ / (name_ + ".hdf.series"); }
    /// States written so far.
    std::size_t size() const { return entries_.size(); }
    const std::vector<SeriesEntry>& entries() const { return entries_; }

private:
    std::filesystem::path directory_;
    std::string name_;
    StateOptions options_;
    std::vector<SeriesEntry> entries_;
};

}  // namespace firn
