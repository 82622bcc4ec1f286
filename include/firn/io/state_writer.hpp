/// \file Writes a state to an HDF5 file that ParaView can open (format VTKHDF 1.0, an UnstructuredGrid whose cells are
/// facets and vertices). The file contains:
///
///     /VTKHDF            attributes Version = 1, 0 and Type = "UnstructuredGrid"
///       NumberOfPoints, NumberOfCells, NumberOfConnectivityIds   i64[1]
///       Points           S[n,3], z = 0 in 2D
///       Connectivity i64[D f + l], Offsets i64[f+l+1], Types u8[f+l]   the cells: first f facets, which are triangles
///                        (type 5) in 3D and lines (type 3) in 2D; then l vertices (type 1), one for each point that
///                        belongs to no facet
///       PointData/NAME   S[n] or S[n,c]: a field; a vector in 2D gets a third component 0; also id i64[n], body i32[n]
///       FieldData/       TimeValue f64[1], last_time_step f64[1], step u64[1]
///     /firn              attributes schema_version i64 = 5, dimension i64, digest u64, and the state's attributes
///       parameters/GROUP/NAME   f64[k]; if there are more than 512 parameters, none is here, but all are in
///       parameter_list/  texts u8[], counts i64[p], values f64[]: of each of the p parameters its group, name and
///       unit,
///                        with a zero byte after each of the three, the number of its values, and its values
///       tables/NAME      i64[r] or i64[r,c]
///       texts/NAME       u8[b]: an attribute's text of more than 32768 bytes; the attribute NAME is then the integer b
///
/// i64[r,c] means a dataset of r rows and c columns of type i64. The types i64 and i32 are signed integers, u8 and u64
/// unsigned integers, f64 and f32 floats; the number in the type's name is its number of bits. S is the precision of
/// the state, f64 or f32. D is the number of dimensions, n the number of points, f the number of facets, l the number
/// of vertex cells, c the number of components of a field (or of columns of a table), r the number of rows of a table,
/// and k the number of values of a parameter.
///
/// Every field and parameter has an attribute `unit`. Every field also has an attribute `components`, which is 2 for a
/// vector in 2D. The digest (see state_digest.hpp) depends on everything that firn reads from the file. If two states
/// are equal, their files have equal bytes.
///
/// Older files: a file of schema_version 1 has no digest. In files of schema_version 1 and 2, `body` is named
/// `material`, and `last_time_step` is named `dt`. In files of schema_version 1 to 3, the slots in the tables `slot`
/// and `blocks` that state_of() makes are those of the memory of the run, with gaps between groups of blocks, and the
/// blocks are in the order of their keys; restore() accepts both. Files of schema_version 1 to 4 have no fields
/// `NAME_remainder`, and the remainders are 0. States of a ParticleSystem of these versions have no table `position`;
/// restore() then takes the rounded positions. No file of schema_version 1 to 4 has `parameter_list` or `texts`.
#pragma once

#include <firn/io/needs_hdf5.hpp>
#include <firn/io/state.hpp>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Options of write_state() and StateSeries.
struct StateOptions {
    /// Level of compression. 0: no compression, which is fastest. 1 to 9: level of the deflate filter of HDF5, used
    /// after the shuffle filter; compressed files are somewhat smaller, but writing is much slower.
    int compression = 0;
    /// Names of the fields to write besides the positions. If empty, all fields are written. The field NAME_remainder
    /// is written with the field NAME. A run can be continued only from a state with all fields.
    std::vector<std::string> fields = {};
    /// How often a StateSeries writes a state with all fields although `fields` selects only some: the states with the
    /// indices 0, `complete_every`, 2 · `complete_every`, … have all fields, so that a run can be continued from any of
    /// these states. 0: every state has only the selected fields.
    std::size_t complete_every = 0;

    /// Returns whether write_state() writes the field with the name `field`. The field "position" is always written.
    bool writes(std::string_view field) const {
        const auto chosen = [&](std::string_view name) {
            return std::find(fields.begin(), fields.end(), name) != fields.end();
        };
        constexpr std::string_view remainder = "_remainder";
        return fields.empty() || field == "position" || chosen(field) ||
               (field.ends_with(remainder) && chosen(field.substr(0, field.size() - remainder.size())));
    }
};

/// Writes a state to an HDF5 file. Every bit of the values is kept. If writing fails, no new file is left, and an old
/// file at `path` is unchanged (see AtomicFile).
///
/// In addition to the memory of the state, writing needs about 20 bytes of memory per particle. In 2D, writing also
/// needs memory for a copy of all vector fields. With compression, it also needs as much memory as the file has bytes.
/// \param path     the name of the file, which should end in .hdf
/// \param options  the compression, and the names of the fields to write; complete_every has no effect here
/// \throws parameter_error  if the parts of the state do not fit together (see check_state()), if the compression is
///                          not 0 to 9, or if a name in options.fields is not the name of a field of the state
/// \throws io_error         if the file cannot be written (folder missing, disk full, …)
template <state_scalar S>
void write_state(const std::filesystem::path& path, const State<S>& state, const StateOptions& options = {});

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES_OF_STATES
#include <firn/io/state_writer-inl.hpp>
#endif
