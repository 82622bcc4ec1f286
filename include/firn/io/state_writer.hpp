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
///     /firn              attributes schema_version i64 = 3, dimension i64, digest u64, and the state's attributes
///       parameters/GROUP/NAME   f64[k]
///       tables/NAME      i64[r] or i64[r,c]
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
/// `material`, and `last_time_step` is named `dt`.
#pragma once

#include <firn/io/atomic_file.hpp>
#include <firn/io/hdf5.hpp>
#include <firn/io/hdf5_image.hpp>
#include <firn/io/state.hpp>
#include <firn/io/state_digest.hpp>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace firn {

/// Options of write_state() and StateSeries.
struct StateOptions {
    /// Level of compression. 0: no compression, which is fastest. 1 to 9: level of the deflate filter of HDF5, used
    /// after the shuffle filter; compressed files are somewhat smaller, but writing is much slower.
    int compression = 0;
    /// Names of the fields to write besides the positions. If empty, all fields are written. A run can be continued
    /// only from a state with all fields.
    std::vector<std::string> fields = {};
    /// How often a StateSeries writes a state with all fields although `fields` selects only some: the states with the
    /// indices 0, `complete_every`, 2 · `complete_every`, … have all fields, so that a run can be continued from any of
    /// these states. 0: every state has only the selected fields.
    std::size_t complete_every = 0;

    /// Returns whether write_state() writes the field with the name `field`. The field "position" is always written.
    bool writes(std::string_view field) const {
        return fields.empty() || field == "position" || std::find(fields.begin(), fields.end(), field) != fields.end();
    }
};

namespace detail {

inline constexpr std::int64_t state_schema = 3;

/// VTK's id of the cell type vertex (a cell that is one point).
inline constexpr std::uint8_t vtk_vertex = 1;
/// Returns VTK's id of the cell type of a facet: 3 for a line (in 2D), 5 for a triangle (in 3D).
inline constexpr std::uint8_t vtk_facet(int dimension) { return dimension == 2 ? 3 : 5; }

/// Creates an HDF5 group. The group records the order in which members and attributes are added to the group.
inline hdf5::Group create_group(hid_t parent, const std::string& name) {
    const std::string tried = "create the group " + name;
    const hdf5::Properties properties(H5Pcreate(H5P_GROUP_CREATE), tried);
    constexpr unsigned order = H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED;
    hdf5::check(H5Pset_link_creation_order(properties.id(), order), tried);
    hdf5::check(H5Pset_attr_creation_order(properties.id(), order), tried);
    hdf5::check(H5Pset_obj_track_times(properties.id(), false), tried);
    return {H5Gcreate2(parent, name.c_str(), H5P_DEFAULT, properties.id(), H5P_DEFAULT), tried};
}

inline void write_attribute(hid_t owner, const std::string& name, const hdf5::Datatype& type,
                            const hdf5::Dataspace& space, hid_t memory_type, const void* data) {
    const std::string tried = "write the attribute " + name;
    hdf5::Attribute attribute(H5Acreate2(owner, name.c_str(), type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT), tried);
    hdf5::check(H5Awrite(attribute.id(), memory_type, data), tried);
    attribute.close(tried);
}

/// Writes a text attribute as a string of fixed length, because readers of VTKHDF know no other strings. An empty text
/// is written as one zero byte, because HDF5 has no strings of length 0.
inline void write_text(hid_t owner, const std::string& name, std::string_view text, H5T_cset_t characters) {
    const std::string tried = "write the attribute " + name;
    const hdf5::Datatype type(H5Tcopy(H5T_C_S1), tried);
    hdf5::check(H5Tset_size(type.id(), std::max<std::size_t>(1, text.size())), tried);
    hdf5::check(H5Tset_strpad(type.id(), H5T_STR_NULLPAD), tried);
    hdf5::check(H5Tset_cset(type.id(), characters), tried);
    const std::string bytes(text.empty() ? std::string(1, '\0') : std::string(text));
    write_attribute(owner, name, type, {H5Screate(H5S_SCALAR), tried}, type.id(), bytes.data());
}

inline void write_integers(hid_t owner, const std::string& name, std::initializer_list<std::int64_t> values) {
    const std::string tried = "write the attribute " + name;
    const hsize_t count = values.size();
    const hdf5::Datatype type(H5Tcopy(hdf5::Number<std::int64_t>::file()), tried);
    const hdf5::Dataspace space(count == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &count, nullptr), tried);
    write_attribute(owner, name, type, space, hdf5::Number<std::int64_t>::memory(), std::data(values));
}

inline void write_unsigned(hid_t owner, const std::string& name, std::uint64_t value) {
    const std::string tried = "write the attribute " + name;
    const hdf5::Datatype type(H5Tcopy(hdf5::Number<std::uint64_t>::file()), tried);
    write_attribute(owner, name, type, {H5Screate(H5S_SCALAR), tried}, hdf5::Number<std::uint64_t>::memory(), &value);
}

/// Returns the properties with which HDF5 creates a dataset of `rows` × `columns` numbers. A compressed dataset is
/// divided into chunks of about 1 MiB: smaller chunks need a larger index, and larger chunks are not faster.
/// \param number_bytes  size of one number [bytes]
/// \param compression   0: none; 1 to 9: level of deflate
inline hdf5::Properties dataset_layout(hsize_t rows, hsize_t columns, std::size_t number_bytes, int compression) {
    const std::string_view tried = "lay out a dataset";
    hdf5::Properties properties(H5Pcreate(H5P_DATASET_CREATE), tried);
    hdf5::check(H5Pset_obj_track_times(properties.id(), false), tried);
    hdf5::check(H5Pset_fill_time(properties.id(), H5D_FILL_TIME_NEVER), tried);
    hdf5::check(H5Pset_alloc_time(properties.id(), H5D_ALLOC_TIME_EARLY), tried);
    if (compression > 0 && rows > 0) {
        constexpr hsize_t chunk_bytes = hsize_t(1) << 20;
        const hsize_t extent[2] = {std::clamp<hsize_t>(chunk_bytes / (columns * number_bytes), 1, rows), columns};
        hdf5::check(H5Pset_chunk(properties.id(), columns > 1 ? 2 : 1, extent), tried);
        hdf5::check(H5Pset_shuffle(properties.id()), tried);
        hdf5::check(H5Pset_deflate(properties.id(), unsigned(compression)), "compress: HDF5 was built without zlib");
    }
    return properties;
}

/// Attributes to write with a dataset.
struct DatasetNotes {
    std::optional<std::string_view> unit = {};  ///< The attribute `unit`; not written if nullopt.
    int components = 0;                         ///< The attribute `components`; not written if 0.
};

/// The HDF5 file of a state, built in memory.
class StateFile {
public:
    /// Builds the file. The state must exist until write() has returned, because large arrays are not copied.
    /// \param digest  digest of the parts of the state that are written; the digest is stored in the file
    /// \throws parameter_error  if a name in options.fields is not the name of a field of the state
    /// \throws io_error         if HDF5 fails
    template <class S>
    StateFile(const State<S>& state, const StateOptions& options, std::uint64_t digest)
        : image_(bytes_beside_arrays(state, options.compression)), compression_(options.compression) {
        for (const std::string& name : options.fields) state.field(name);
        write_firn_group(state, digest);
        write_vtk_group(state, options);
        image_.close();
    }
    void write(AtomicFile& file) const { image_.write(file); }

private:
    /// Writes a dataset of numbers of type T. The rank of the dataset is 1 if `columns` is 1; otherwise it is 2 (rows,
    /// columns).
    /// \param values  the numbers, row by row; the array must exist until write() has returned
    template <class T>
    void write_dataset(hid_t parent, const std::string& name, std::span<const T> values, hsize_t columns = 1,
                       const DatasetNotes& notes = {}) {
        const std::string tried = "write the dataset " + name;
        const hsize_t extent[2] = {values.size() / columns, columns};
        const int compression = values.size_bytes() < least_compressed ? 0 : compression_;
        const hdf5::Dataspace space(H5Screate_simple(columns > 1 ? 2 : 1, extent, nullptr), tried);
        const auto layout = dataset_layout(extent[0], columns, sizeof(T), compression);
        hdf5::Dataset dataset(H5Dcreate2(parent, name.c_str(), hdf5::Number<T>::file(), space.id(), H5P_DEFAULT,
                                         layout.id(), H5P_DEFAULT),
                              tried);
        if (notes.unit) write_text(dataset.id(), "unit", *notes.unit, H5T_CSET_UTF8);
        if (notes.components > 0) write_integers(dataset.id(), "components", {notes.components});
        if (compression == 0 && hdf5::FileImage::can_place(values)) {
            image_.place(dataset, values);
        } else if (!values.empty()) {
            hdf5::check(H5Dwrite(dataset.id(), hdf5::Number<T>::memory(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()),
                        tried);
        }
        dataset.close(tried);
    }

    template <class T>
    void write_value(hid_t parent, const std::string& name, T value, const DatasetNotes& notes = {}) {
        write_dataset(parent, name, std::span<const T>(&value, 1), 1, notes);
    }

    /// Writes a field as a dataset. A vector in 2D gets a third component 0, because ParaView only knows vectors of
    /// three components.
    template <class S>
    void write_field(hid_t parent, const std::string& name, const StateField<S>& field, int dimension) {
        const DatasetNotes notes{field.unit, field.components};
        if (dimension != 2 || field.components != 2) {
            return write_dataset<S>(parent, name, field.values, hsize_t(field.components), notes);
        }
        std::vector<S> padded(field.values.size() / 2 * 3);
        for (std::size_t i = 0; 2 * i < field.values.size(); ++i) {
            padded[3 * i] = field.values[2 * i];
            padded[3 * i + 1] = field.values[2 * i + 1];
        }
        write_dataset<S>(parent, name, image_.keep(std::move(padded)), 3, notes);
    }

    /// Writes the cells of the VTK grid: all facets, then one vertex cell for each point that belongs to no facet. The
    /// vertex cells are needed because some versions of ParaView do not show a point without a cell.
    template <class S>
    void write_cells(hid_t vtk, const State<S>& state) {
        const std::size_t corners = std::size_t(state.dimension), facets = state.facets.size() / corners;
        std::vector<std::int64_t> connectivity = state.facets;
        if (facets > 0) {
            std::vector<bool> used(state.size());
            for (const auto point : state.facets) used[std::size_t(point)] = true;
            for (std::size_t i = 0; i < state.size(); ++i)
                if (!used[i]) connectivity.push_back(std::int64_t(i));
        }
        const std::size_t vertices = facets > 0 ? connectivity.size() - state.facets.size() : state.size();
        write_value(vtk, "NumberOfPoints", std::int64_t(state.size()));
        write_value(vtk, "NumberOfCells", std::int64_t(facets + vertices));
        write_value(vtk, "NumberOfConnectivityIds", std::int64_t(state.facets.size() + vertices));
        std::vector<std::uint8_t> types(facets, vtk_facet(state.dimension));
        types.resize(facets + vertices, vtk_vertex);
        write_dataset(vtk, "Types", image_.keep(std::move(types)));
        std::vector<std::int64_t> offsets(facets + vertices + 1);
        for (std::size_t c = 0; c < offsets.size(); ++c)
            offsets[c] = std::int64_t(c <= facets ? corners * c : corners * facets + (c - facets));
        const auto kept = image_.keep(std::move(offsets));
        // If there are no facets, Connectivity contains 0, 1, …, like Offsets, but has one element fewer.
        write_dataset(vtk, "Connectivity",
                      facets > 0 ? image_.keep(std::move(connectivity)) : kept.first(state.size()));
        write_dataset(vtk, "Offsets", kept);
    }

    template <class S>
    void write_vtk_group(const State<S>& state, const StateOptions& options) {
        auto vtk = create_group(image_.id(), "VTKHDF");
        write_integers(vtk.id(), "Version", {1, 0});
        write_text(vtk.id(), "Type", "UnstructuredGrid", H5T_CSET_ASCII);

        auto whole = create_group(vtk.id(), "FieldData");
        write_value(whole.id(), "TimeValue", state.time, {.unit = "s"});
        write_value(whole.id(), "last_time_step", state.last_time_step, {.unit = "s"});
        write_value(whole.id(), "step", state.step, {.unit = "1"});
        whole.close("close FieldData");

        write_cells(vtk.id(), state);
        write_field(vtk.id(), "Points", state.field("position"), state.dimension);
        auto points = create_group(vtk.id(), "PointData");
        for (const auto& field : state.fields) {
            if (options.writes(field.name) && field.name != "position")
                write_field(points.id(), field.name, field, state.dimension);
        }
        write_dataset<std::int64_t>(points.id(), "id", state.id, 1, {"1", 1});
        write_dataset<std::int32_t>(points.id(), "body", state.body, 1, {"1", 1});
        points.close("close PointData");
        vtk.close("close VTKHDF");
    }

    template <class S>
    void write_firn_group(const State<S>& state, std::uint64_t digest) {
        auto firn_group = create_group(image_.id(), "firn");
        write_integers(firn_group.id(), "schema_version", {state_schema});
        write_integers(firn_group.id(), "dimension", {state.dimension});
        write_unsigned(firn_group.id(), "digest", digest);
        for (const auto& attribute : state.attributes) {
            write_text(firn_group.id(), attribute.name, attribute.value, H5T_CSET_UTF8);
        }
        auto all = create_group(firn_group.id(), "parameters");
        std::vector<std::string> done;
        for (const auto& first : state.parameters) {
            if (std::find(done.begin(), done.end(), first.group) != done.end()) continue;
            done.push_back(first.group);
            auto group = create_group(all.id(), first.group);
            for (const auto& parameter : state.parameters) {
                if (parameter.group != first.group) continue;
                write_dataset<double>(group.id(), parameter.name, parameter.values, 1, {.unit = parameter.unit});
            }
            group.close("close the parameters of " + first.group);
        }
        all.close("close parameters");
        auto tables = create_group(firn_group.id(), "tables");
        for (const auto& table : state.tables) {
            write_dataset<std::int64_t>(tables.id(), table.name, table.values, hsize_t(table.columns));
        }
        tables.close("close tables");
        firn_group.close("close the group firn");
    }

    /// Returns the number of bytes to reserve at the start of the file for everything except arrays. The header of one
    /// HDF5 object takes about 512 bytes.
    template <class S>
    static std::size_t bytes_beside_arrays(const State<S>& state, int compression) {
        const bool has_large_arrays = compression == 0 && state.size() * sizeof(std::int64_t) >= hdf5::FileImage::large;
        const std::size_t objects = 32 + state.fields.size() + state.parameters.size() + state.attributes.size();
        return has_large_arrays ? objects * 1024 : 2048;
    }

    /// The smallest size of an array that is compressed [bytes]. For a smaller array, the index of the chunks needs
    /// more bytes than compression saves.
    static constexpr std::size_t least_compressed = 4096;

    hdf5::FileImage image_;
    int compression_;
};

}  // namespace detail

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
void write_state(const std::filesystem::path& path, const State<S>& state, const StateOptions& options = {}) {
    if (options.compression < 0 || options.compression > 9) {
        throw parameter_error(
            sentence("The compression is ", options.compression, "; give 0 (none) or 1 (fast) to 9 (small)."));
    }
    check_state(state);
    AtomicFile file(path);  // opened first, so that an invalid path is reported before the long work
    const std::uint64_t noted = digest(state, [&](std::string_view field) { return options.writes(field); });
    hdf5::naming_file(path, [&] { return detail::StateFile(state, options, noted); }).write(file);
    file.commit();
}

}  // namespace firn
