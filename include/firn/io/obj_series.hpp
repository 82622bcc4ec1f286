/// \file Writes the surfaces of a run as a series of OBJ files, in the background if you like.
#pragma once

#include <firn/io/background.hpp>
#include <firn/io/file_series.hpp>
#include <firn/io/mesh_state.hpp>
#include <firn/io/obj.hpp>

#include <filesystem>

namespace firn::inline FIRN_BUILD {

/// Options for writing a series of OBJ files: there are none.
struct ObjOptions {};

/// The format of an ObjSeries: write_obj().
struct ObjFormat {
    using Options = ObjOptions;                    ///< Options for writing a file.
    static constexpr const char* ending = ".obj";  ///< Ending of the files' names.
    /// Writes a file. \see write_obj
    template <state_scalar S>
    static void write(const std::filesystem::path& path, const State<S>& state, const ObjOptions&) {
        write_obj(path, state);
    }
};

/// A series of OBJ files NAME_0000.obj, NAME_0001.obj, …, and a list of them, NAME.obj.series. The surfaces are the
/// facets of states: those of cloth and skins; state_of() makes a state of any other mesh, such as that of a
/// collider. Points and facets may change from file to file.
///
///     firn::BackgroundSeries<float, firn::ObjSeries> series("out", "cloth");
///     …
///     series.write(firn::state_of(simulation.set<1>()));
///
/// \see SeriesOf, BackgroundSeries
using ObjSeries = SeriesOf<ObjFormat>;

}  // namespace firn::inline FIRN_BUILD
