/// \file Bodies of state_writer.hpp. A program that links firn::compiled_hdf5 does not include them.
#pragma once

#include <firn/io/atomic_file.hpp>
#include <firn/io/hdf5.hpp>
#include <firn/io/hdf5_image.hpp>
#include <firn/io/parameter_list.hpp>
#include <firn/io/state_digest.hpp>
#include <firn/io/state_outline.hpp>
#include <firn/io/state_writer.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

inline constexpr std::int64_t state_schema = 5;

/// VTK's id of the cell type vertex (a cell that is one point).
inline constexpr std::uint8_t vtk_vertex = 1;
/// Returns VTK's id of the cell type of a facet: 3 for a line (in 2D), 5 for a triangle (in 3D).
inline constexpr std::uint8_t vtk_facet(int dimension) { return dimension == 2 ? 3 : 5; }

/// Creates an HDF5 group. The group records the order in which members and attributes are added to the group.
[[gnu::cold]] inline hdf5::Group create_group(hid_t parent, const std::string& name) {
    const std::string tried = "create the group " + name;
    const hdf5::Properties properties(H5Pcreate(H5P_GROUP_CREATE), tried);
    constexpr unsigned order = H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED;
    hdf5::check(H5Pset_link_creation_order(properties.id(), order), tried);
    hdf5::check(H5Pset_attr_creation_order(properties.id(), order), tried);
    hdf5::check(H5Pset_obj_track_times(properties.id(), false), tried);
    return {H5Gcreate2(parent, name.c_str(), H5P_DEFAULT, properties.id(), H5P_DEFAULT), tried};
}

[[gnu::cold]] inline void write_attribute(hid_t owner, const std::string& name, const hdf5::Datatype& type,
                                          const hdf5::Dataspace& space, hid_t memory_type, const void* data) {
    const std::string tried = "write the attribute " + name;
    hdf5::Attribute attribute(H5Acreate2(owner, name.c_str(), type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT), tried);
    hdf5::check(H5Awrite(attribute.id(), memory_type, data), tried);
    attribute.close(tried);
}

/// Writes a text attribute as a string of fixed length, because readers of VTKHDF know no other strings. An empty text
/// is written as one zero byte, because HDF5 has no strings of length 0.
[[gnu::cold]] inline void write_text(hid_t owner, const std::string& name, std::string_view text,
                                     H5T_cset_t characters) {
    const std::string tried = "write the attribute " + name;
    const hdf5::Datatype type(H5Tcopy(H5T_C_S1), tried);
    hdf5::check(H5Tset_size(type.id(), std::max<std::size_t>(1, text.size())), tried);
    hdf5::check(H5Tset_strpad(type.id(), H5T_STR_NULLPAD), tried);
    hdf5::check(H5Tset_cset(type.id(), characters), tried);
    const std::string bytes(text.empty() ? std::string(1, '\0') : std::string(text));
    write_attribute(owner, name, type, {H5Screate(H5S_SCALAR), tried}, type.id(), bytes.data());
}

[[gnu::cold]] inline void write_integers(hid_t owner, const std::string& name,
                                         std::initializer_list<std::int64_t> values) {
    const std::string tried = "write the attribute " + name;
    const hsize_t count = values.size();
    const hdf5::Datatype type(H5Tcopy(hdf5::Number<std::int64_t>::file()), tried);
    const hdf5::Dataspace space(count == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &count, nullptr), tried);
    write_attribute(owner, name, type, space, hdf5::Number<std::int64_t>::memory(), std::data(values));
}

[[gnu::cold]] inline void write_unsigned(hid_t owner, const std::string& name, std::uint64_t value) {
    const std::string tried = "write the attribute " + name;
    const hdf5::Datatype type(H5Tcopy(hdf5::Number<std::uint64_t>::file()), tried);
    write_attribute(owner, name, type, {H5Screate(H5S_SCALAR), tried}, hdf5::Number<std::uint64_t>::memory(), &value);
}

/// Returns the properties with which HDF5 creates a dataset of `rows` × `columns` numbers. A compressed dataset is
/// divided into chunks of about 1 MiB: smaller chunks need a larger index, and larger chunks are not faster.
/// \param number_bytes  size of one number [bytes]
/// \param compression   0: none; 1 to 9: level of deflate
[[gnu::cold]] inline hdf5::Properties dataset_layout(hsize_t rows, hsize_t columns, std::size_t number_bytes,
                                                     int compression) {
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

/// Returns HDF5's types for a kind of numbers.
[[gnu::cold]] inline hdf5::NumberType number_type(NumberKind kind) {
    switch (kind) {
        case NumberKind::f32:
            return hdf5::number_type<float>();
        case NumberKind::f64:
            return hdf5::number_type<double>();
        case NumberKind::u8:
            return hdf5::number_type<std::uint8_t>();
        case NumberKind::i32:
            return hdf5::number_type<std::int32_t>();
        case NumberKind::i64:
            return hdf5::number_type<std::int64_t>();
        default:
            return hdf5::number_type<std::uint64_t>();
    }
}

/// Attributes to write with a dataset.
struct DatasetNotes {
    std::optional<std::string_view> unit = {};  ///< The attribute `unit`; not written if nullopt.
    int components = 0;                         ///< The attribute `components`; not written if 0.
};

/// A dataset whose content is still to be written.
struct OpenDataset {
    std::string path;                      ///< Path of the dataset in the file, for example "/VTKHDF/Points".
    hdf5::Dataset dataset;                 ///< The dataset. It is closed when the file is closed.
    std::optional<std::uint64_t> offset;   ///< Offset of the content in the file [bytes]; nullopt: H5Dwrite writes it.
    hsize_t rows, columns, rows_of_chunk;  ///< Numbers of rows and columns; rows of a chunk, 0 if there are no chunks.
};

/// The HDF5 file of a state, built in memory.
class StateFile {
public:
    /// Builds the file. The state must exist until write() has returned, because large arrays are not copied.
    ///
    /// Arrays that are elsewhere get datasets without content, see open(). Then write the content, and call finish().
    /// \param digest  digest of the parts of the state that are written; the digest is stored in the file. nullopt: the
    ///                digest is known later, and finish() must be called.
    /// \throws io_error  if HDF5 fails
    StateFile(const StateOutline& state, const StateOptions& options, std::optional<std::uint64_t> digest)
        : image_(bytes_beside_arrays(state, options.compression)), compression_(options.compression) {
        write_firn_group(state, digest.value_or(0));
        write_vtk_group(state, options);
        if (digest) image_.close();
    }
    void write(AtomicFile& file) const { image_.write(file); }

    /// The datasets of the arrays that are elsewhere, in the order in which they are in the file.
    const std::vector<OpenDataset>& open() const { return open_; }
    /// Stores the digest, and closes the file.
    /// \throws io_error  if HDF5 fails
    void finish(std::uint64_t digest) {
        open_.clear();
        const std::string tried = "write the attribute digest";
        // HDF5 1.10 cannot write an attribute that H5Aopen_by_name() opened.
        const hdf5::Group firn_group(H5Gopen2(image_.id(), "firn", H5P_DEFAULT), tried);
        hdf5::Attribute attribute(H5Aopen(firn_group.id(), "digest", H5P_DEFAULT), tried);
        hdf5::check(H5Awrite(attribute.id(), hdf5::Number<std::uint64_t>::memory(), &digest), tried);
        attribute.close(tried);
        image_.close();
    }
    /// The bytes of the file, after finish() was called.
    const hdf5::FileImage& image() const { return image_; }

private:
    /// Writes an array as a dataset. The rank of the dataset is 1 if `columns` is 1; otherwise it is 2 (rows,
    /// columns).
    /// \param values  the numbers, row by row; the array must exist until write() has returned
    void write_dataset(hid_t parent, const std::string& name, const StateArray& values, hsize_t columns = 1,
                       const DatasetNotes& notes = {}) {
        const std::string tried = "write the dataset " + name;
        const hdf5::NumberType type = number_type(values.kind);
        const hsize_t extent[2] = {values.count / columns, columns}, bytes = values.count * type.bytes;
        const int compression = bytes < least_compressed ? 0 : compression_;
        const hdf5::Dataspace space(H5Screate_simple(columns > 1 ? 2 : 1, extent, nullptr), tried);
        const auto layout = dataset_layout(extent[0], columns, type.bytes, compression);
        hdf5::Dataset dataset(
            H5Dcreate2(parent, name.c_str(), type.file, space.id(), H5P_DEFAULT, layout.id(), H5P_DEFAULT), tried);
        if (notes.unit) write_text(dataset.id(), "unit", *notes.unit, H5T_CSET_UTF8);
        if (notes.components > 0) write_integers(dataset.id(), "components", {notes.components});
        const bool is_placed = compression == 0 && hdf5::FileImage::can_place(bytes);
        if (!values.is_here()) {
            hsize_t chunk[2] = {0, 0};
            if (compression > 0) hdf5::check(H5Pget_chunk(layout.id(), 2, chunk), tried);
            std::string path(1024, '\0');
            path.resize(std::size_t(hdf5::check(H5Iget_name(dataset.id(), path.data(), path.size()), tried)));
            std::optional<std::uint64_t> offset;
            if (is_placed) offset = image_.leave_out(dataset, bytes);
            open_.push_back({std::move(path), std::move(dataset), offset, extent[0], columns, chunk[0]});
            return;
        }
        if (is_placed) {
            image_.place(dataset, values.bytes());
        } else if (values.count > 0) {
            hdf5::check(H5Dwrite(dataset.id(), type.memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.numbers), tried);
        }
        dataset.close(tried);
    }

    template <class T>
    void write_value(hid_t parent, const std::string& name, T value, const DatasetNotes& notes = {}) {
        write_dataset(parent, name, std::span<const T>(&value, 1), 1, notes);
    }

    /// Writes a field as a dataset. A vector in 2D gets a third component 0, because ParaView only knows vectors of
    /// three components.
    void write_field(hid_t parent, const std::string& name, const StateOutline::Field& field, int dimension) {
        const DatasetNotes notes{field.unit, field.components};
        if (dimension != 2 || field.components != 2) {
            return write_dataset(parent, name, field.values, hsize_t(field.components), notes);
        }
        const std::size_t rows = field.values.count / 2, number_bytes = bytes_of(field.values.kind);
        StateArray padded = field.values;
        padded.move_elsewhere(3 * rows);
        if (field.values.is_here()) {
            std::vector<std::byte> numbers(3 * rows * number_bytes);  // zeros
            const std::byte* from = field.values.bytes().data();
            for (std::size_t i = 0; i < rows; ++i)
                std::copy_n(from + 2 * number_bytes * i, 2 * number_bytes, numbers.data() + 3 * number_bytes * i);
            padded.numbers = image_.keep(std::move(numbers)).data();
        }
        write_dataset(parent, name, padded, 3, notes);
    }

    /// Writes the cells of the VTK grid: all facets, then one vertex cell for each point that belongs to no facet. The
    /// vertex cells are needed because some versions of ParaView do not show a point without a cell.
    void write_cells(hid_t vtk, const StateOutline& state) {
        const std::size_t corners = std::size_t(state.dimension), facets = state.facets.size() / corners;
        std::vector<std::int64_t> points_of_cells(state.facets.begin(), state.facets.end());
        if (facets > 0) {
            std::vector<bool> used(state.points());
            for (const auto point : state.facets) used[std::size_t(point)] = true;
            for (std::size_t i = 0; i < state.points(); ++i)
                if (!used[i]) points_of_cells.push_back(std::int64_t(i));
        }
        const std::size_t vertices = facets > 0 ? points_of_cells.size() - state.facets.size() : state.points();
        const std::size_t cells = facets + vertices, ids = state.facets.size() + vertices;
        StateArray types(NumberKind::u8, cells, nullptr), connectivity(NumberKind::i64, ids, nullptr),
            offsets(NumberKind::i64, cells + 1, nullptr);
        if (state.id.is_here()) {
            std::vector<std::uint8_t> type_of(facets, vtk_facet(state.dimension));
            type_of.resize(cells, vtk_vertex);
            types = image_.keep(std::move(type_of));
            std::vector<std::int64_t> first(cells + 1);
            for (std::size_t c = 0; c < first.size(); ++c)
                first[c] = std::int64_t(c <= facets ? corners * c : corners * facets + (c - facets));
            const auto kept = image_.keep(std::move(first));
            offsets = kept;
            // If there are no facets, Connectivity contains 0, 1, …, like Offsets, but has one element fewer.
            connectivity = facets > 0 ? image_.keep(std::move(points_of_cells)) : kept.first(state.points());
        }
        write_value(vtk, "NumberOfPoints", std::int64_t(state.points()));
        write_value(vtk, "NumberOfCells", std::int64_t(cells));
        write_value(vtk, "NumberOfConnectivityIds", std::int64_t(ids));
        write_dataset(vtk, "Types", types);
        write_dataset(vtk, "Connectivity", connectivity);
        write_dataset(vtk, "Offsets", offsets);
    }

    void write_vtk_group(const StateOutline& state, const StateOptions& options) {
        auto vtk = create_group(image_.id(), "VTKHDF");
        write_integers(vtk.id(), "Version", {1, 0});
        write_text(vtk.id(), "Type", "UnstructuredGrid", H5T_CSET_ASCII);

        auto whole = create_group(vtk.id(), "FieldData");
        write_value(whole.id(), "TimeValue", state.time, {.unit = "s"});
        write_value(whole.id(), "last_time_step", state.last_time_step, {.unit = "s"});
        write_value(whole.id(), "step", state.step, {.unit = "1"});
        whole.close("close FieldData");

        write_cells(vtk.id(), state);
        for (const auto& field : state.fields)
            if (field.name == "position") write_field(vtk.id(), "Points", field, state.dimension);
        auto points = create_group(vtk.id(), "PointData");
        for (const auto& field : state.fields) {
            if (options.writes(field.name) && field.name != "position")
                write_field(points.id(), std::string(field.name), field, state.dimension);
        }
        write_dataset(points.id(), "id", state.id, 1, {"1", 1});
        write_dataset(points.id(), "body", state.body, 1, {"1", 1});
        points.close("close PointData");
        vtk.close("close VTKHDF");
    }

    void write_firn_group(const StateOutline& state, std::uint64_t digest) {
        auto firn_group = create_group(image_.id(), "firn");
        write_integers(firn_group.id(), "schema_version", {state_schema});
        write_integers(firn_group.id(), "dimension", {state.dimension});
        write_unsigned(firn_group.id(), "digest", digest);
        for (const auto& attribute : state.attributes) {
            if (attribute.value.size() <= max_state_text)
                write_text(firn_group.id(), attribute.name, attribute.value, H5T_CSET_UTF8);
            else
                write_integers(firn_group.id(), attribute.name, {std::int64_t(attribute.value.size())});
        }
        auto all = create_group(firn_group.id(), "parameters");
        const bool listed = lists_parameters(state);
        if (!listed) write_parameters(all, state.parameters);
        all.close("close parameters");
        auto tables = create_group(firn_group.id(), "tables");
        for (const auto& table : state.tables) {
            write_dataset(tables.id(), std::string(table.name), table.values, hsize_t(table.columns));
        }
        tables.close("close tables");
        if (listed) write_parameter_list(firn_group, state.parameters);
        write_long_texts(firn_group, state.attributes);
        firn_group.close("close the group firn");
    }
    void write_parameters(const hdf5::Group& all, std::span<const StateParameter> parameters) {
        std::vector<std::string> done;
        for (const auto& first : parameters) {
            if (std::find(done.begin(), done.end(), first.group) != done.end()) continue;
            done.push_back(first.group);
            auto group = create_group(all.id(), first.group);
            for (const auto& parameter : parameters) {
                if (parameter.group != first.group) continue;
                write_dataset(group.id(), parameter.name, parameter.values, 1, {.unit = parameter.unit});
            }
            group.close("close the parameters of " + first.group);
        }
    }
    void write_parameter_list(const hdf5::Group& firn_group, std::span<const StateParameter> parameters) {
        ParameterList list = ParameterList::of(parameters);
        auto group = create_group(firn_group.id(), parameter_list_name);
        write_dataset(group.id(), "texts", image_.keep(std::move(list.texts)));
        write_dataset(group.id(), "counts", image_.keep(std::move(list.counts)));
        write_dataset(group.id(), "values", image_.keep(std::move(list.values)));
        group.close("close the list of parameters");
    }
    void write_long_texts(const hdf5::Group& firn_group, std::span<const StateAttribute> attributes) {
        const auto is_long = [](const StateAttribute& a) { return a.value.size() > max_state_text; };
        if (std::none_of(attributes.begin(), attributes.end(), is_long)) return;
        auto group = create_group(firn_group.id(), long_texts_name);
        for (const StateAttribute& a : attributes)
            if (is_long(a)) write_dataset(group.id(), a.name, {NumberKind::u8, a.value.size(), a.value.data()});
        group.close("close the texts");
    }
    static bool lists_parameters(const StateOutline& state) {
        return state.parameters.size() > most_parameter_datasets;
    }

    /// Returns the number of bytes to reserve at the start of the file for everything except arrays. The header of one
    /// HDF5 object takes about 512 bytes.
    static std::size_t bytes_beside_arrays(const StateOutline& state, int compression) {
        const bool has_large_arrays =
            compression == 0 && state.points() * sizeof(std::int64_t) >= hdf5::FileImage::large;
        const std::size_t parameters = lists_parameters(state) ? 4 : state.parameters.size();
        const std::size_t objects = 32 + state.fields.size() + parameters + state.attributes.size();
        return has_large_arrays ? objects * 1024 : 2048;
    }

    /// The smallest size of an array that is compressed [bytes]. For a smaller array, the index of the chunks needs
    /// more bytes than compression saves.
    static constexpr std::size_t least_compressed = 4096;

    hdf5::FileImage image_;
    std::vector<OpenDataset> open_;  // destroyed, and so closed, before the file
    int compression_;
};

/// Checks what write_state() is given.
/// \throws parameter_error  as write_state()
template <class S>
[[gnu::cold]] void check_before_writing(const State<S>& state, const StateOptions& options) {
    if (options.compression < 0 || options.compression > 9) {
        throw parameter_error(
            sentence("The compression is ", options.compression, "; give 0 (none) or 1 (fast) to 9 (small)."));
    }
    check_state(state);
    for (const std::string& name : options.fields) state.field(name);
}

}  // namespace detail

template <state_scalar S>
void write_state(const std::filesystem::path& path, const State<S>& state, const StateOptions& options) {
    detail::check_before_writing(state, options);
    AtomicFile file(path);  // opened first, so that an invalid path is reported before the long work
    const detail::StateOutline outline(state);
    const std::uint64_t noted =
        detail::digest_of(outline, [&](std::string_view field) { return options.writes(field); });
    hdf5::naming_file(path, [&] { return detail::StateFile(outline, options, noted); }).write(file);
    file.commit();
}

}  // namespace firn::inline FIRN_BUILD
