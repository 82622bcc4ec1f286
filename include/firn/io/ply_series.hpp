/// \file Writes the states of a run as a series of PLY files, in the background if you like.
#pragma once

#include <firn/io/background.hpp>
#include <firn/io/file_series.hpp>
#include <firn/io/ply.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Options for writing a series of PLY files.
struct PlyOptions {
    /// Names of the fields to write besides the positions and ids.
    std::vector<std::string> fields = {"velocity"};
};

/// The format of a PlySeries: write_ply().
struct PlyFormat {
    using Options = PlyOptions;                    ///< Options for writing a file.
    static constexpr const char* ending = ".ply";  ///< Ending of the files' names.
    /// Writes a file. \see write_ply
    template <state_scalar S>
    static void write(const std::filesystem::path& path, const State<S>& state, const PlyOptions& options) {
        write_ply(path, state, options.fields);
    }
};

/// A series of PLY files NAME_0000.ply, NAME_0001.ply, …, and a list of them, NAME.ply.series, which ParaView can open:
///
///     firn::BackgroundSeries<float, firn::PlySeries> series("out", "run", {.fields = {"velocity", "mass"}});
///     …
///     series.write(firn::state_of(simulation));
///
/// \see SeriesOf, BackgroundSeries
using PlySeries = SeriesOf<PlyFormat>;

}  // namespace firn::inline FIRN_BUILD
