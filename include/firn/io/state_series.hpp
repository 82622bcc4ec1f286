/// \file Writes the states of a run as a series of files NAME_0000.hdf, NAME_0001.hdf, …, and a list of these files,
/// NAME.hdf.series. ParaView can open the list:
///
///     {"file-series-version": "1.0", "files": [{"name": "NAME_0000.hdf", "time": 0}, …]}
#pragma once

#include <firn/io/file_series.hpp>
#include <firn/io/needs_hdf5.hpp>
#include <firn/io/state_writer.hpp>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
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
    using Options = StateOptions;  ///< Options for writing the states.
    /// What write() takes: a state.
    template <state_scalar S>
    using Frame = State<S>;

    /// Makes the folder `directory` if this folder does not exist. No file is written yet.
    /// \param directory  the folder for the files of the series
    /// \param name       the part NAME of the file names NAME_0000.hdf, NAME_0001.hdf, …
    /// \param options    options for writing the states
    /// \throws parameter_error  if `name` is empty, is longer than 200 bytes, or contains '/', '.' or control
    ///                          characters
    /// \throws io_error         if the folder cannot be made
    StateSeries(std::filesystem::path directory, std::string name, const StateOptions& options = {});

    /// Continues a series of this name that exists on disk. Call this function before the first call of write(), which
    /// then removes or overwrites the states that are later than `time`.
    /// \param time  states up to and including this time [s] are kept
    /// \throws io_error  if the list of states cannot be read, or if it names a file that is not a state of this series
    void go_on_from(double time);

    /// Writes the next state, then the list of states. Returns the path of the state's file. If the state or the list
    /// cannot be written, the earlier states stay complete and in the list, and the next call of write() uses the same
    /// file name.
    /// \throws parameter_error  if the parts of the state do not fit together (see check_state()), if the compression
    ///                          is not 0 to 9, or if a name in StateOptions::fields is not the name of a field of the
    ///                          state
    /// \throws io_error         if the state or the list cannot be written, or if a state of an older series cannot be
    ///                          removed
    template <state_scalar S>
    std::filesystem::path write(const State<S>& state);

    /// Like write(), for a state that somebody else writes. \see mpi::StateSeries
    /// \param time  time of the state [s]
    /// \param put   put(path, options) writes the state, in the manner of write_state()
    std::filesystem::path write_with(double time,
                                     const std::function<void(const std::filesystem::path&, const StateOptions&)>& put);

    /// Returns the path of the list of states, NAME.hdf.series.
    std::filesystem::path path() const { return files_.path(); }
    /// Returns the number of states in the list.
    std::size_t size() const { return files_.size(); }
    /// Returns the states in the list, in the order in which they were written.
    const std::vector<SeriesEntry>& entries() const { return files_.entries(); }

private:
    FileSeries files_;
    StateOptions options_;
};

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES_OF_STATES
#include <firn/io/state_series-inl.hpp>
#endif
