/// \file Bodies of state_reader.hpp. A program that links firn::compiled_hdf5 does not include them.
#pragma once

#include <firn/io/hdf5.hpp>
#include <firn/io/state_digest.hpp>
#include <firn/io/state_reader.hpp>
#include <firn/io/state_writer-inl.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

[[gnu::cold]] inline bool has_member(hid_t parent, const std::string& name) {
    return hdf5::check(H5Lexists(parent, name.c_str(), H5P_DEFAULT), "look for " + name) > 0;
}

/// Checks that the group `parent` has a member `name`, and that this member is not a soft or external link, which could
/// lead to another file.
/// \throws io_error  if the member is missing, or if it is such a link
[[gnu::cold]] inline void require_member(hid_t parent, const std::string& name) {
    if (!has_member(parent, name)) {
        throw io_error("it has no '" + name + "': it is not a state of firn, or a broken one");
    }
    H5L_info_t info;
    hdf5::check(H5Lget_info(parent, name.c_str(), &info, H5P_DEFAULT), "look for " + name);
    if (info.type != H5L_TYPE_HARD) throw io_error("'" + name + "' is a link to elsewhere; firn reads no links");
}

[[gnu::cold]] inline hdf5::Group open_group(hid_t parent, const std::string& name) {
    require_member(parent, name);
    return {H5Gopen2(parent, name.c_str(), H5P_DEFAULT), "open the group " + name};
}

/// Returns the names of a group's members, in the order in which they were written. If the file does not record this
/// order, the names are in alphabetical order.
[[gnu::cold]] inline std::vector<std::string> member_names(const hdf5::Group& group) {
    const std::string_view tried = "list a group";
    H5G_info_t info;
    hdf5::check(H5Gget_info(group.id(), &info), tried);
    if (info.nlinks > max_state_members) {
        throw io_error(sentence("a group has ", info.nlinks, " members; a state has at most ", max_state_members));
    }
    const hdf5::Properties properties(H5Gget_create_plist(group.id()), tried);
    unsigned order = 0;
    hdf5::check(H5Pget_link_creation_order(properties.id(), &order), tried);
    const H5_index_t index = (order & H5P_CRT_ORDER_TRACKED) ? H5_INDEX_CRT_ORDER : H5_INDEX_NAME;
    std::vector<std::string> names;
    for (hsize_t i = 0; i < info.nlinks; ++i) {
        std::array<char, max_state_name + 2> name{};
        const auto length = hdf5::check(
            H5Lget_name_by_idx(group.id(), ".", index, H5_ITER_INC, i, name.data(), name.size(), H5P_DEFAULT), tried);
        if (std::size_t(length) > max_state_name) {
            throw io_error(sentence("a member's name has ", length, " bytes; a state's have at most ", max_state_name));
        }
        names.emplace_back(name.data(), std::size_t(length));
    }
    return names;
}

[[gnu::cold]] inline std::vector<std::string> attribute_names(const hdf5::Group& group) {
    std::vector<std::string> names;
    const auto keep = [](hid_t, const char* name, const H5A_info_t*, void* out) -> herr_t {
        try {
            auto& kept = *static_cast<std::vector<std::string>*>(out);
            kept.emplace_back(name);
            return kept.size() > max_state_members ? 1 : 0;
        } catch (...) {
            return -1;
        }
    };
    const hdf5::Properties properties(H5Gget_create_plist(group.id()), "list attributes");
    unsigned order = 0;
    hdf5::check(H5Pget_attr_creation_order(properties.id(), &order), "list attributes");
    const H5_index_t index = (order & H5P_CRT_ORDER_TRACKED) ? H5_INDEX_CRT_ORDER : H5_INDEX_NAME;
    hdf5::check(H5Aiterate2(group.id(), index, H5_ITER_INC, nullptr, keep, &names), "list attributes");
    if (names.size() > max_state_members) {
        throw io_error(sentence("a group has more than ", max_state_members, " attributes"));
    }
    return names;
}

/// Returns the text of an attribute that is a string of fixed length. Returns nullopt if the attribute does not exist,
/// has another type, or is longer than max_state_text.
[[gnu::cold]] inline std::optional<std::string> read_text(hid_t owner, const std::string& name) {
    const std::string tried = "read the attribute " + name;
    if (hdf5::check(H5Aexists(owner, name.c_str()), tried) == 0) return {};
    const hdf5::Attribute attribute(H5Aopen(owner, name.c_str(), H5P_DEFAULT), tried);
    const hdf5::Datatype type(H5Aget_type(attribute.id()), tried);
    const hdf5::Dataspace space(H5Aget_space(attribute.id()), tried);
    const std::size_t size = H5Tget_size(type.id());
    if (H5Tget_class(type.id()) != H5T_STRING || H5Tis_variable_str(type.id()) != 0 || size == 0 ||
        size > max_state_text || H5Sget_simple_extent_npoints(space.id()) != 1) {
        return {};
    }
    std::string text(size, '\0');
    hdf5::check(H5Aread(attribute.id(), type.id(), text.data()), tried);
    return text.substr(0, text.find('\0'));
}

/// Reads an attribute that is one number.
/// \param value  where the number goes, of the type `number.memory`
/// \return whether the attribute exists
/// \throws io_error  if the attribute is not one number of this type
[[gnu::cold]] inline bool read_number(hid_t owner, const std::string& name, const hdf5::NumberType& number,
                                      void* value) {
    const std::string tried = "read the attribute " + name;
    if (hdf5::check(H5Aexists(owner, name.c_str()), tried) == 0) return false;
    const hdf5::Attribute attribute(H5Aopen(owner, name.c_str(), H5P_DEFAULT), tried);
    const hdf5::Datatype type(H5Aget_type(attribute.id()), tried);
    const hdf5::Dataspace space(H5Aget_space(attribute.id()), tried);
    if (!hdf5::is_number(type, number) || H5Sget_simple_extent_npoints(space.id()) != 1) {
        throw io_error(sentence("the attribute '", name, "' is not one ", number.name));
    }
    hdf5::check(H5Aread(attribute.id(), number.memory, value), tried);
    return true;
}

/// Reads an attribute that is one integer; nullopt if it does not exist.
/// \throws io_error  if the attribute is not one integer of type T
template <class T = std::int64_t>
[[gnu::cold]] std::optional<T> read_integer(hid_t owner, const std::string& name) {
    T value = 0;
    if (!read_number(owner, name, hdf5::number_type<T>(), &value)) return {};
    return value;
}

/// One of `parts` contiguous parts of the rows of an array, counted from 0.
struct RowsPart {
    std::uint64_t part = 0, parts = 1;

    /// Returns the first row of this part of `rows` rows. The parts have equally many rows, or one row more.
    std::uint64_t first(std::uint64_t rows) const { return rows / parts * part + std::min(part, rows % parts); }
    /// Returns the number of rows of this part.
    std::uint64_t count(std::uint64_t rows) const { return rows / parts + (part < rows % parts ? 1 : 0); }
};

/// Reader of the datasets in one file. It counts the bytes that the datasets have in the file, so that a wrong size in
/// a damaged file does not make the reader allocate too much memory.
class DatasetReader {
public:
    /// \param file_bytes  size of the file [bytes]
    /// \param part        the part of the rows that read_part() reads
    explicit DatasetReader(std::uintmax_t file_bytes, const RowsPart& part = {})
        : file_bytes_(file_bytes), unread_bytes_(file_bytes), part_(part) {}

    /// What a table has beside its values.
    struct Outline {
        hsize_t rows = 0;  ///< Number of rows of the dataset; `values` may have only a part of them.
        hsize_t columns = 1;
        std::string unit;
        std::optional<std::int64_t> components;
    };
    template <class T>
    struct Table : Outline {
        std::vector<T> values;
    };

    /// Reads a dataset of numbers of type T. The rank of the dataset must be 1, or 2 with at most 1024 columns.
    /// \param rows  the number of rows that the dataset must have; nullopt: any number of rows is accepted
    /// \throws io_error  if the dataset is missing, or if it has another type, rank or size
    template <class T>
    Table<T> read(hid_t parent, const std::string& name, std::optional<hsize_t> rows = {}) {
        return read_rows<T>(parent, name, rows, {});
    }
    /// Reads this reader's part of the rows of a dataset.
    template <class T>
    Table<T> read_part(hid_t parent, const std::string& name, std::optional<hsize_t> rows = {}) {
        return read_rows<T>(parent, name, rows, part_);
    }
    /// Returns whether read_part() reads only a part of the rows.
    bool reads_parts() const { return part_.parts > 1; }

    template <class T>
    T read_value(hid_t parent, const std::string& name) {
        return read<T>(parent, name, 1).values.at(0);
    }

private:
    template <class T>
    Table<T> read_rows(hid_t parent, const std::string& name, std::optional<hsize_t> rows, const RowsPart& part) {
        Table<T> table;
        const OpenTable open = open_table(parent, name, hdf5::number_type<T>(), rows, table);
        table.values.resize(std::size_t(part.count(table.rows) * table.columns));
        if (!table.values.empty()) read_values(open, table, part, table.values.data());
        return table;
    }

    /// A dataset whose values are still to be read.
    struct OpenTable {
        std::string tried;  ///< for messages
        hdf5::Dataset dataset;
        hdf5::Dataspace space;
        int rank;
        hid_t memory_type;
    };

    /// Opens a dataset, checks it as read() says, and reads what it has beside its values into `table`.
    OpenTable open_table(hid_t parent, const std::string& name, const hdf5::NumberType& number,
                         std::optional<hsize_t> rows, Outline& table) {
        const std::string tried = "read the dataset " + name;
        require_member(parent, name);
        hdf5::Dataset dataset(H5Dopen2(parent, name.c_str(), H5P_DEFAULT), tried);
        require_type({H5Dget_type(dataset.id()), tried}, name, number);

        hdf5::Dataspace space(H5Dget_space(dataset.id()), tried);
        const int rank = hdf5::check(H5Sget_simple_extent_ndims(space.id()), tried);
        if (H5Sget_simple_extent_type(space.id()) != H5S_SIMPLE || rank < 1 || rank > 2) {
            throw io_error(sentence("the dataset '", name, "' has rank ", rank, "; 1 or 2 is allowed"));
        }
        hsize_t extent[2] = {0, 1};
        hdf5::check(H5Sget_simple_extent_dims(space.id(), extent, nullptr), tried);
        if (rows && extent[0] != *rows) {
            throw io_error(
                sentence("the dataset '", name, "' has ", extent[0], " rows where ", *rows, " are expected"));
        }
        if (extent[1] < 1 || extent[1] > 1024) {
            throw io_error(sentence("the dataset '", name, "' has ", extent[1], " columns; 1 to 1024 are allowed"));
        }
        account(dataset, name, extent[0], extent[1], number.bytes);

        table = {extent[0], extent[1], read_text(dataset.id(), "unit").value_or(""),
                 read_integer(dataset.id(), "components")};
        return {tried, std::move(dataset), std::move(space), rank, number.memory};
    }

    /// Reads a part of the rows of a dataset, which is not empty, to `values`.
    static void read_values(const OpenTable& open, const Outline& table, const RowsPart& part, void* values) {
        const hid_t dataset = open.dataset.id(), space = open.space.id();
        if (part.parts == 1) {
            hdf5::check(H5Dread(dataset, open.memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values), open.tried);
            return;
        }
        const hsize_t first[2] = {part.first(table.rows), 0}, count[2] = {part.count(table.rows), table.columns};
        const hdf5::Dataspace here(H5Screate_simple(open.rank, count, nullptr), open.tried);
        hdf5::check(H5Sselect_hyperslab(space, H5S_SELECT_SET, first, nullptr, count, nullptr), open.tried);
        hdf5::check(H5Dread(dataset, open.memory_type, here.id(), space, H5P_DEFAULT, values), open.tried);
    }

    static void require_type(const hdf5::Datatype& type, const std::string& name, const hdf5::NumberType& number) {
        if (hdf5::is_number(type, number)) return;
        const std::string_view wanted = number.name, found = hdf5::type_name(type);
        const std::string_view single = hdf5::Number<float>::name, twice = hdf5::Number<double>::name;
        const char* advice = "";
        if (wanted == single && found == twice) advice = "; read it with read_state<double>";
        if (wanted == twice && found == single) advice = "; read it with read_state<float>";
        throw io_error(sentence("the dataset '", name, "' is of ", found, " where ", wanted, " is expected", advice));
    }

    /// Checks that the bytes in the file are enough for a dataset of `rows` × `columns` numbers. A compressed dataset
    /// may have 1032 times as many bytes as it has in the file, because deflate compresses by a factor of at most 1032.
    /// \throws io_error  if the bytes are not enough, or if the dataset is not stored in this file
    void account(const hdf5::Dataset& dataset, const std::string& name, hsize_t rows, hsize_t columns,
                 std::size_t number_bytes) {
        const std::string tried = "read the dataset " + name;
        const hdf5::Properties layout(H5Dget_create_plist(dataset.id()), tried);
        const auto kind = H5Pget_layout(layout.id());
        const hsize_t stored = rows == 0 ? 0 : H5Dget_storage_size(dataset.id());
        hsize_t most = stored;
        if (kind == H5D_CHUNKED) {
            require_known_filters(layout, name);
            hsize_t extent[2] = {0, 1};
            if (hdf5::check(H5Pget_chunk(layout.id(), 2, extent), tried) > 2 || extent[0] > rows ||
                extent[1] > columns) {
                throw io_error("the dataset '" + name + "' has chunks larger than itself");
            }
            most = stored > std::numeric_limits<hsize_t>::max() / 1032 ? stored : stored * 1032;
        } else if (kind == H5D_CONTIGUOUS) {
            const haddr_t offset = rows == 0 ? 0 : H5Dget_offset(dataset.id());
            if (hdf5::check(H5Pget_external_count(layout.id()), tried) != 0 || offset > file_bytes_ ||
                stored > file_bytes_ - offset) {
                throw io_error("the dataset '" + name + "' lies outside of the file");
            }
        } else if (kind != H5D_COMPACT) {
            throw io_error("the dataset '" + name + "' has a layout that firn does not read");
        }
        const hsize_t row_bytes = columns * number_bytes;
        if (stored > unread_bytes_ || rows > most / row_bytes) {
            throw io_error(sentence("the dataset '", name, "' claims ", rows, " × ", columns,
                                    " numbers, more than the file's ", file_bytes_, " bytes hold"));
        }
        unread_bytes_ -= stored;
    }

    /// Checks that a dataset has no filters except deflate, shuffle and Fletcher32. For other filters, HDF5 would load
    /// a plugin and run its code.
    /// \throws io_error  if the dataset has another filter
    static void require_known_filters(const hdf5::Properties& layout, const std::string& name) {
        const int filters = hdf5::check(H5Pget_nfilters(layout.id()), "read the dataset " + name);
        for (unsigned i = 0; i < unsigned(filters); ++i) {
            unsigned flags = 0, settings = 0;
            std::size_t count = 0;
            const auto filter = H5Pget_filter2(layout.id(), i, &flags, &count, nullptr, 0, nullptr, &settings);
            if (filter != H5Z_FILTER_DEFLATE && filter != H5Z_FILTER_SHUFFLE && filter != H5Z_FILTER_FLETCHER32) {
                throw io_error(sentence("the dataset '", name, "' is packed with the filter ", filter,
                                        ", which firn does not read"));
            }
        }
    }

    std::uintmax_t file_bytes_;
    std::uintmax_t unread_bytes_;
    RowsPart part_;
};

/// Reads a field.
/// \param rows  the number of rows that the field must have; nullopt: any number is accepted, and is stored here
template <class S>
[[gnu::cold]] StateField<S> read_field(DatasetReader& reader, hid_t parent, const std::string& dataset,
                                       const std::string& name, int dimension, std::optional<hsize_t>& rows) {
    auto table = reader.read_part<S>(parent, dataset, rows);
    rows = table.rows;
    const auto components = table.components.value_or(std::int64_t(table.columns));
    StateField<S> field{name, std::move(table.unit), int(table.columns), {}};
    if (dimension == 2 && components == 2 && table.columns == 3) {
        field.components = 2;
        const std::size_t count = table.values.size() / 3;
        field.values.resize(count * 2);
        for (std::size_t i = 0; i < count; ++i) {
            if (!(table.values[3 * i + 2] == 0)) {
                throw io_error(sentence("the dataset '", dataset, "' is of 2D, but its row ", i,
                                        " has a third component ", table.values[3 * i + 2]));
            }
            field.values[2 * i] = table.values[3 * i];
            field.values[2 * i + 1] = table.values[3 * i + 1];
        }
    } else if (components == std::int64_t(table.columns)) {
        field.values = std::move(table.values);
    } else {
        throw io_error(sentence("the dataset '", dataset, "' notes ", components, " components and has ", table.columns,
                                " columns"));
    }
    return field;
}

/// Reads the facets of a state. In the file, the cells of the VTK grid are facets or single vertices; the vertices are
/// ignored.
/// \throws io_error  if the cells in the file are invalid
template <class S>
[[gnu::cold]] void read_facets(const hdf5::Group& vtk, DatasetReader& reader, State<S>& state) {
    const auto cells = reader.read_value<std::int64_t>(vtk.id(), "NumberOfCells"),
               ids = reader.read_value<std::int64_t>(vtk.id(), "NumberOfConnectivityIds");
    if (cells == ids) return;  // each cell has one point, so there are no facets
    if (reader.reads_parts()) throw io_error("it has facets, which a run on many ranks cannot go on with");
    if (cells < 0 || ids < cells) {
        throw io_error(sentence("NumberOfCells is ", cells, " and NumberOfConnectivityIds ", ids,
                                "; a cell has one point or more"));
    }
    const auto types = reader.read<std::uint8_t>(vtk.id(), "Types", hsize_t(cells));
    const auto offsets = reader.read<std::int64_t>(vtk.id(), "Offsets", hsize_t(cells) + 1);
    const auto points = reader.read<std::int64_t>(vtk.id(), "Connectivity", hsize_t(ids));
    if (types.columns != 1 || offsets.columns != 1 || points.columns != 1) {
        throw io_error("its Types, Offsets and Connectivity must have one column each");
    }
    if (offsets.values.front() != 0 || offsets.values.back() != ids) {
        throw io_error(sentence("Offsets run from ", offsets.values.front(), " to ", offsets.values.back(),
                                " where 0 to ", ids, " is expected"));
    }
    for (std::size_t c = 0; c < std::size_t(cells); ++c) {
        const bool is_facet = types.values[c] == vtk_facet(state.dimension);
        if (!is_facet && types.values[c] != vtk_vertex) {
            throw io_error(sentence("cell ", c, " is of VTK's type ", int(types.values[c]), "; firn reads ",
                                    int(vtk_facet(state.dimension)), " and ", int(vtk_vertex), " in ", state.dimension,
                                    " dimensions"));
        }
        const std::int64_t begin = offsets.values[c], end = offsets.values[c + 1];
        // `begin` is valid, because the offsets of all earlier cells were checked: they start at 0 and increase.
        if (end < begin || end > ids || end - begin != (is_facet ? state.dimension : 1)) {
            throw io_error(sentence("cell ", c, " has the points from ", begin, " to ", end, " of Connectivity, where ",
                                    is_facet ? state.dimension : 1, " are expected"));
        }
        for (auto i = begin; i < end; ++i) {
            const auto point = points.values[std::size_t(i)];
            if (point < 0 || point >= std::int64_t(state.fields[0].values.size()) / state.fields[0].components) {
                throw io_error(sentence("cell ", c, " names point ", point, ", which does not exist"));
            }
            if (is_facet) state.facets.push_back(point);
        }
    }
}

/// Names of the two datasets that schema_version 3 renamed.
struct NamesOfSchema {
    const char *body, *last_time_step;
};
[[gnu::cold]] inline NamesOfSchema names_of_schema(std::int64_t schema) {
    return schema < 3 ? NamesOfSchema{"material", "dt"} : NamesOfSchema{"body", "last_time_step"};
}

/// Reads the group VTKHDF.
/// \return  the number of points in the file
template <class S>
[[gnu::cold]] hsize_t read_vtk_group(hid_t file, DatasetReader& reader, const NamesOfSchema& names, State<S>& state) {
    const auto vtk = open_group(file, "VTKHDF");
    if (const auto type = read_text(vtk.id(), "Type"); type != "UnstructuredGrid") {
        throw io_error("its VTKHDF Type is '" + type.value_or("none") + "' where 'UnstructuredGrid' is expected");
    }
    std::optional<hsize_t> count;
    state.fields.push_back(read_field<S>(reader, vtk.id(), "Points", "position", state.dimension, count));
    if (const auto noted = reader.read_value<std::int64_t>(vtk.id(), "NumberOfPoints"); noted != std::int64_t(*count)) {
        throw io_error(sentence("NumberOfPoints is ", noted, ", but there are ", *count, " points"));
    }
    read_facets(vtk, reader, state);

    const auto points = open_group(vtk.id(), "PointData");
    const auto flat = [](const std::string& name, hsize_t columns) {
        if (columns != 1) throw io_error(sentence("the dataset '", name, "' has ", columns, " columns; 1 is allowed"));
    };
    for (const auto& name : member_names(points)) {
        if (name == "id") {
            auto table = reader.read_part<std::int64_t>(points.id(), name, count);
            flat(name, table.columns);
            state.id = std::move(table.values);
        } else if (name == names.body) {
            auto table = reader.read_part<std::int32_t>(points.id(), name, count);
            flat(name, table.columns);
            state.body = std::move(table.values);
        } else {
            state.fields.push_back(read_field<S>(reader, points.id(), name, name, state.dimension, count));
        }
    }
    // In a state without particles, check_state() would not find that these datasets are missing.
    require_member(points.id(), "id");
    require_member(points.id(), names.body);

    const auto whole = open_group(vtk.id(), "FieldData");
    state.time = reader.read_value<double>(whole.id(), "TimeValue");
    state.last_time_step = reader.read_value<double>(whole.id(), names.last_time_step);
    state.step = reader.read_value<std::uint64_t>(whole.id(), "step");
    return *count;
}

template <class S>
[[gnu::cold]] void read_parameters(const hdf5::Group& firn_group, DatasetReader& reader, State<S>& state) {
    const auto all = open_group(firn_group.id(), "parameters");
    for (const auto& group_name : member_names(all)) {
        const auto group = open_group(all.id(), group_name);
        for (const auto& name : member_names(group)) {
            if (state.parameters.size() >= max_state_members) {
                throw io_error(sentence("it has more than ", max_state_members, " parameters"));
            }
            auto table = reader.read<double>(group.id(), name);
            if (table.columns != 1) throw io_error("the parameter '" + name + "' has rank 2; 1 is allowed");
            state.parameters.push_back({group_name, name, std::move(table.unit), std::move(table.values)});
        }
    }
    if (!has_member(firn_group.id(), parameter_list_name)) return;
    const auto group = open_group(firn_group.id(), parameter_list_name);
    const auto flat = [&]<class T>(const char* name, std::vector<T>& to) {
        auto table = reader.read<T>(group.id(), name);
        if (table.columns != 1) throw io_error(sentence("the dataset '", name, "' has rank 2; 1 is allowed"));
        to = std::move(table.values);
    };
    ParameterList list;
    flat("texts", list.texts);
    flat("counts", list.counts);
    flat("values", list.values);
    list.append_to(state.parameters);
}

/// Reads the attributes that are texts, and the texts that are too long for attributes.
template <class S>
[[gnu::cold]] void read_attributes(const hdf5::Group& firn_group, DatasetReader& reader, State<S>& state) {
    std::optional<hdf5::Group> long_texts;
    if (has_member(firn_group.id(), long_texts_name)) long_texts = open_group(firn_group.id(), long_texts_name);
    for (const auto& name : attribute_names(firn_group)) {
        if (auto text = read_text(firn_group.id(), name)) {
            state.attributes.push_back({name, std::move(*text)});
        } else if (long_texts && has_member(long_texts->id(), name)) {
            const auto bytes = reader.read<std::uint8_t>(long_texts->id(), name);
            if (bytes.columns != 1) throw io_error("the text '" + name + "' has rank 2; 1 is allowed");
            state.attributes.push_back({name, std::string(bytes.values.begin(), bytes.values.end())});
        }
    }
}

/// Reads the tables. Of the tables `slot` and `blocks`, which grow with the number of particles, this reader's part of
/// the rows is read.
/// \return  the number of rows of each table in the file
template <class S>
[[gnu::cold]] std::vector<hsize_t> read_tables(const hdf5::Group& firn_group, DatasetReader& reader, State<S>& state) {
    const auto tables = open_group(firn_group.id(), "tables");
    std::vector<hsize_t> rows;
    for (const auto& name : member_names(tables)) {
        auto table = is_spread_table(name) ? reader.read_part<std::int64_t>(tables.id(), name)
                                           : reader.read<std::int64_t>(tables.id(), name);
        rows.push_back(table.rows);
        state.tables.push_back({name, int(table.columns), std::move(table.values)});
    }
    return rows;
}

/// A state that was read from a file, or a part of its rows, and what the file says of the whole.
template <class S>
struct StateOnDisk {
    State<S> state;
    std::optional<std::uint64_t> digest;  ///< nullopt if the file has schema_version 1, or if no digest is needed.
    hsize_t points = 0;                   ///< Number of points in the file.
    std::vector<hsize_t> table_rows{};    ///< Number of rows in the file of each of the state's tables.
};

/// Reads a state, or the part `part` of its rows.
template <class S>
[[gnu::cold]] StateOnDisk<S> read_state_file(const std::filesystem::path& path, bool needs_digest,
                                             const RowsPart& part = {}) {
    std::error_code failure;
    const auto file_bytes = std::filesystem::file_size(path, failure);
    if (failure) throw io_error("could not open it: " + failure.message());
    const hdf5::Properties access(H5Pcreate(H5P_FILE_ACCESS), "open it");
    hdf5::check(H5Pset_fclose_degree(access.id(), H5F_CLOSE_STRONG), "open it");
    const hdf5::File file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.id()), "open it as HDF5");

    StateOnDisk<S> found;
    State<S>& state = found.state;
    const auto firn_group = open_group(file.id(), "firn");
    const auto schema = read_integer(firn_group.id(), "schema_version");
    if (!schema || *schema < 1 || *schema > state_schema) {
        throw io_error(sentence("its schema_version is ", schema ? std::to_string(*schema) : "missing",
                                "; this firn reads 1 to ", state_schema));
    }
    if (*schema > 1 && needs_digest) {
        found.digest = read_integer<std::uint64_t>(firn_group.id(), "digest");
        if (!found.digest) throw io_error("it has no digest, but states of schema_version 2 and later have one");
    }
    const auto dimension = read_integer(firn_group.id(), "dimension");
    if (dimension != 2 && dimension != 3) throw io_error("its dimension is neither 2 nor 3");
    state.dimension = int(*dimension);

    DatasetReader reader(file_bytes, part);
    found.points = read_vtk_group(file.id(), reader, names_of_schema(*schema), state);
    read_parameters(firn_group, reader, state);
    found.table_rows = read_tables(firn_group, reader, state);
    read_attributes(firn_group, reader, state);
    return found;
}

/// Checks that the parts of a state that was read from the file `path` fit together.
/// \throws io_error  if they do not
template <class S>
[[gnu::cold]] void check_what_was_read(const std::filesystem::path& path, const State<S>& state) {
    try {
        check_state(state);
    } catch (const parameter_error& wrong) {
        throw io_error(sentence("The state ", path, ": its parts do not fit: ", wrong.what()));
    }
}

[[noreturn]] inline void throw_wrong_digest(const std::filesystem::path& path) {
    throw io_error(sentence("The state ", path,
                            ": its content does not match its digest: bits have changed since it was written. Use an "
                            "earlier state, or read it with verify = false to examine it."));
}

}  // namespace detail

template <state_scalar S>
[[gnu::cold]] State<S> read_state(const std::filesystem::path& path, const StateReading& reading) {
    auto found = hdf5::naming_file(path, [&] { return detail::read_state_file<S>(path, reading.verify); });
    detail::check_what_was_read(path, found.state);
    if (found.digest && *found.digest != digest(found.state)) detail::throw_wrong_digest(path);
    return std::move(found.state);
}

}  // namespace firn::inline FIRN_BUILD
