/// \file Writes the states of a run as a series of files NAME_0000.hdf, NAME_0001.hdf, …, and a list of these files,
/// NAME.hdf.series. ParaView can open the list:
///
///     {"file-series-version": "1.0", "files": [{"name": "NAME_0000.hdf", "time": 0}, …]}
#pragma once

#include <firn/io/series_file.hpp>
#include <firn/io/state_writer.hpp>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// A series of states on disk, and a list of these states. The list is updated after each state is written. Even if the
/// program is killed, every state in the list is complete on disk.
///
/// The series replaces an older series of the same name in the same folder, unless go_on_from() is called. The files of
/// the older series are kept until the first new state is on disk. Then the new list replaces the old list, and the
/// files that are only in the old list are removed. A file is removed only if its name consists of NAME_, four or more
/// digits, and .hdf. If the old list cannot be read, no file is removed.
class StateSeries {
public:
    /// Makes the folder `directory` if this folder does not exist. No file is written yet.
    /// \param directory  the folder for the files of the series
    /// \param name       the part NAME of the file names NAME_0000.hdf, NAME_0001.hdf, …
    /// \param options    options for writing the states
    /// \throws parameter_error  if `name` is empty, is longer than 200 bytes, or contains '/', '.' or control
    ///                          characters
    /// \throws io_error         if the folder cannot be made
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

    /// Continues a series of this name that exists on disk. Call this function before the first call of write(), which
    /// then removes or overwrites the states that are later than `time`.
    /// \param time  states up to and including this time [s] are kept
    /// \throws io_error  if the list of states cannot be read, or if it names a file that is not a state of this series
    void go_on_from(double time) {
        std::vector<SeriesEntry> kept;
        std::size_t next = 0;
        for (SeriesEntry& entry : read_series(path())) {
            if (!detail::is_series_member(entry.file, name_))
                throw io_error(sentence("The list of states ", path(), " names '", entry.file,
                                        "', which is not a state of the series '", name_, "'. Use another name."));
            if (entry.time > time) continue;
            next = std::max(next, detail::series_number(entry.file, name_) + 1);
            kept.push_back(std::move(entry));
        }
        entries_ = std::move(kept);
        next_ = next;
        has_written_ = false;
    }

    /// Writes the next state, then the list of states. Returns the path of the state's file. If the state or the list
    /// cannot be written, the earlier states stay complete and in the list, and the next call of write() uses the same
    /// file name.
    /// \throws parameter_error  if the parts of the state do not fit together (see check_state()), if the compression
    ///                          is not 0 to 9, or if a name in StateOptions::fields is not the name of a field of the
    ///                          state
    /// \throws io_error         if the state or the list cannot be written, or if a state of an older series cannot be
    ///                          removed
    template <state_scalar S>
    std::filesystem::path write(const State<S>& state) {
        return write_with(state.time, [&](const std::filesystem::path& file, const StateOptions& options) {
            write_state(file, state, options);
        });
    }

    /// Like write(), for a state that somebody else writes. \see mpi::StateSeries
    /// \param time  time of the state [s]
    /// \param put   put(path, options) writes the state, in the manner of write_state()
    template <class Put>
    std::filesystem::path write_with(double time, const Put& put) {
        const std::string file = detail::series_member(name_, next_);
        std::vector<std::string> before;
        if (!has_written_) before = detail::series_members_on_disk(path(), name_);
        std::error_code unknown;
        const bool is_there = std::filesystem::exists(directory_ / file, unknown);
        StateOptions options = options_;
        if (options.complete_every > 0 && next_ % options.complete_every == 0) options.fields.clear();
        put(directory_ / file, std::as_const(options));
        entries_.push_back({file, time});
        try {
            write_series(path(), entries_);
        } catch (...) {
            entries_.pop_back();
            std::error_code ignored;
            // A file that existed before this call is kept.
            if (!is_there) std::filesystem::remove(directory_ / file, ignored);
            throw;
        }
        ++next_;
        has_written_ = true;
        for (const auto& stale : before) {
            if (std::ranges::any_of(entries_, [&](const SeriesEntry& entry) { return entry.file == stale; })) continue;
            std::error_code failure;
            std::filesystem::remove(directory_ / stale, failure);
            if (failure) {
                throw io_error(sentence("The state ", directory_ / stale,
                                        " of an older series cannot be removed: ", failure.message(), "."));
            }
        }
        return directory_ / file;
    }

    /// Returns the path of the list of states, NAME.hdf.series.
    std::filesystem::path path() const { return directory_ / (name_ + ".hdf.series"); }
    /// Returns the number of states in the list.
    std::size_t size() const { return entries_.size(); }
    /// Returns the states in the list, in the order in which they were written.
    const std::vector<SeriesEntry>& entries() const { return entries_; }

private:
    std::filesystem::path directory_;
    std::string name_;
    StateOptions options_;
    std::vector<SeriesEntry> entries_;
    std::size_t next_ = 0;  // index of the next state, which its file name contains
    bool has_written_ = false;
};

}  // namespace firn::inline FIRN_BUILD
