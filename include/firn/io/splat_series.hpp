/// \file Writes the particles of a run as a series of Gaussian splats, in the background if you like.
#pragma once

#include <firn/io/background.hpp>
#include <firn/io/file_series.hpp>
#include <firn/io/splats.hpp>

#include <filesystem>

namespace firn::inline FIRN_BUILD {

/// The format of a SplatSeries: write_splats().
struct SplatFormat {
    using Options = SplatOptions;                  ///< Options for writing a file.
    static constexpr const char* ending = ".ply";  ///< Ending of the files' names.
    /// Writes a file. \see write_splats
    template <state_scalar S>
    static void write(const std::filesystem::path& path, const State<S>& state, const SplatOptions& options) {
        write_splats(path, state, options);
    }
};

/// A series of Gaussian splats NAME_0000.ply, NAME_0001.ply, …, and a list of them, NAME.ply.series. Beside a PlySeries
/// in the same folder it needs another name.
///
///     firn::BackgroundSeries<float, firn::SplatSeries> series("out", "snow_splats", {.colour = {0.9, 0.95, 1}});
///     …
///     series.write(firn::state_of(simulation));
///
/// \see SeriesOf, BackgroundSeries
using SplatSeries = SeriesOf<SplatFormat>;

}  // namespace firn::inline FIRN_BUILD
