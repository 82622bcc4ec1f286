/// \file Writes and reads a list of the files of a run. The list is a file NAME.hdf.series (of states),
/// NAME.ply.series, … in ParaView's JSON format.
#pragma once

#include <firn/core/error.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// One entry in a list of states.
struct SeriesEntry {
    std::string file;  ///< Name of the state's file; it is in the same folder as the list.
    double time = 0;   ///< Time of the state [s].

    bool operator==(const SeriesEntry&) const = default;
};

/// Writes a list of states. If writing fails, an old list at `path` is unchanged (see AtomicFile).
/// \param path     the name of the list, NAME.hdf.series
/// \param entries  the states, in the order of the list
/// \throws io_error  if the list cannot be written
void write_series(const std::filesystem::path& path, const std::vector<SeriesEntry>& entries);

/// Returns the entries of a list of states, in the order of the list. The list may be written by write_series() or by
/// another program.
/// \throws io_error  if the file `path` is missing, larger than 1 GiB, or not a list of states; the message names the
///                   file
[[nodiscard]] std::vector<SeriesEntry> read_series(const std::filesystem::path& path);

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES_OF_STATES
#include <firn/io/series_file-inl.hpp>
#endif
