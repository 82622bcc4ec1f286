/// \file Writes the points, facets and selected fields of a state to a PLY file (Turk 1994; binary, little endian).
/// Blender, MeshLab, Houdini and Open3D can read PLY files.
#pragma once

#include <firn/io/atomic_file.hpp>
#include <firn/io/finite_fields.hpp>
#include <firn/io/state.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

template <class T>
void append_little_endian(std::string& bytes, T value) {
    using Bits = std::conditional_t<sizeof(T) == 8, std::uint64_t, std::uint32_t>;
    const Bits bits = std::bit_cast<Bits>(value);
    for (std::size_t k = 0; k < sizeof(T); ++k) bytes += char(std::uint8_t(bits >> 8 * k));
}

/// Returns the name, in the PLY file, of one component of the field `name`. The result is `name` for a scalar,
/// `name_x`, `name_y`, … for a field of two or three components, and `name_0`, `name_1`, … for a field of more
/// components. The components of the velocity are `vx`, `vy` and `vz`, and those of `normal` are `nx`, `ny` and `nz`,
/// as other programs call them.
/// \param component   index of the component, from 0
/// \param components  number of components of the field
inline std::string component_name(const std::string& name, int component, int components) {
    if (components == 1) return name;
    if (name == "velocity" && components <= 3) return std::string("v") + "xyz"[component];
    if (name == "normal" && components == 3) return std::string("n") + "xyz"[component];
    if (components <= 3) return name + "_" + "xyz"[component];
    return name + "_" + std::to_string(component);
}

/// Returns how many properties a field has in a PLY file: its components, and in 2D a third of the velocity.
template <class S>
int written_components(const StateField<S>& field) {
    return field.name == "velocity" && field.components == 2 ? 3 : field.components;
}

/// Returns the names of the properties of the fields' components, in their order.
/// \param taken  the names of the properties before them
/// \throws parameter_error  if a name has a space, which ends a name in PLY, or if two properties have one name
template <class S>
std::vector<std::string> property_names(const std::vector<const StateField<S>*>& fields,
                                        const std::vector<std::string>& taken) {
    std::vector<std::string> names = taken;
    for (const StateField<S>* field : fields) {
        if (field->name.find(' ') != std::string::npos)
            throw parameter_error(sentence("The field '", field->name,
                                           "' cannot be a property of a PLY file, where a space ends a name; rename "
                                           "the field."));
        const int components = written_components(*field);
        for (int c = 0; c < components; ++c) {
            std::string name = component_name(field->name, c, components);
            if (std::find(names.begin(), names.end(), name) != names.end())
                throw parameter_error(sentence("The field '", field->name,
                                               "' would give the PLY file a second property '", name,
                                               "'; name each field once, or rename it."));
            names.push_back(std::move(name));
        }
    }
    names.erase(names.begin(), names.begin() + std::ptrdiff_t(taken.size()));
    return names;
}

/// A property of the vertices in a PLY file.
struct PlyProperty {
    const char* type;  ///< "float", "double", "uint", …
    std::string name;  ///< name without spaces
};

/// Returns the header of a binary PLY file.
/// \param comment   one line about the file
/// \param vertices  number of vertices
/// \param facets    the lines of the header about facets
inline std::string ply_header(const std::string& comment, std::size_t vertices,
                              const std::vector<PlyProperty>& properties, const std::string& facets = {}) {
    std::string header =
        "ply\nformat binary_little_endian 1.0\ncomment " + comment + "\n" + sentence("element vertex ", vertices, "\n");
    for (const PlyProperty& property : properties)
        header += sentence("property ", property.type, " ", property.name, "\n");
    return header + facets + "end_header\n";
}

/// Checks that a PLY file can count the points of a state.
/// \throws parameter_error  if there are more than 2³¹ − 1
inline void check_ply_size(std::size_t points) {
    constexpr auto most = std::size_t(std::numeric_limits<std::int32_t>::max());
    if (points > most)
        throw parameter_error(sentence("The state has ", points, " points; PLY counts up to ", most, "."));
}

}  // namespace detail

/// Writes a state to a PLY file. Each point becomes a `vertex` element. The properties of the vertex are the position
/// (x, y, z) in the precision of the state (z = 0 in 2D), the id, and one property for each component of the fields in
/// `fields`: `mass`, `vx vy vz` of the velocity (vz = 0 in 2D), `NAME_x NAME_y NAME_z` of other vectors, and `NAME_0`,
/// `NAME_1`, … of matrices, row by row. The facets become `face` elements (triangles) in 3D and `edge` elements in 2D.
/// If writing fails, no incomplete file is left (see AtomicFile).
/// \param fields  names of the fields to write besides the positions
/// \throws parameter_error  if the parts of the state do not fit together (see check_state()), if a name in `fields` is
///                          not the name of a field of the state, if the name of a field has a space or gives a
///                          property the name of another (x, y, z, id, or that of another field), if a value is not
///                          finite, if the state has more than 2³¹ − 1 points, or if an id is not within [0, 2³² − 1]
/// \throws io_error         if writing fails
template <state_scalar S>
void write_ply(const std::filesystem::path& path, const State<S>& state, const std::vector<std::string>& fields = {}) {
    check_state(state);
    detail::check_ply_size(state.size());
    std::vector<const StateField<S>*> written;
    for (const std::string& name : fields) written.push_back(&state.field(name));
    for (const std::int64_t id : state.id)
        if (id < 0 || id > std::int64_t(std::numeric_limits<std::uint32_t>::max()))
            throw parameter_error(sentence("A point has the id ", id, "; PLY has 32 bits for it."));
    const auto corners = std::size_t(state.dimension);
    const std::size_t facets = state.facets.size() / corners;
    const StateField<S>& position = state.field("position");

    detail::check_finite(state, position, "a PLY file");
    for (const StateField<S>* field : written) detail::check_finite(state, *field, "a PLY file");

    const char* number = sizeof(S) == 4 ? "float" : "double";
    std::vector<detail::PlyProperty> properties{{number, "x"}, {number, "y"}, {number, "z"}, {"uint", "id"}};
    for (std::string& name : detail::property_names(written, {"x", "y", "z", "id"}))
        properties.push_back({number, std::move(name)});
    std::string elements;
    if (facets > 0)
        elements = state.dimension == 3
                       ? sentence("element face ", facets, "\nproperty list uchar int vertex_indices\n")
                       : sentence("element edge ", facets, "\nproperty int vertex1\nproperty int vertex2\n");

    AtomicFile file(path);
    file.write(detail::ply_header(sentence("positions in metres, after ", state.time, " seconds"), state.size(),
                                  properties, elements));
    std::string bytes;
    for (std::size_t i = 0; i < state.size(); ++i) {
        bytes.clear();
        for (std::size_t a = 0; a < 3; ++a)
            detail::append_little_endian(bytes, a < corners ? position.values[i * corners + a] : S(0));
        detail::append_little_endian(bytes, std::uint32_t(state.id[i]));
        for (const StateField<S>* field : written) {
            for (std::size_t c = 0; c < std::size_t(field->components); ++c)
                detail::append_little_endian(bytes, field->values[i * std::size_t(field->components) + c]);
            if (detail::written_components(*field) > field->components) detail::append_little_endian(bytes, S(0));
        }
        file.write(bytes);
    }
    for (std::size_t f = 0; f < facets; ++f) {
        bytes.clear();
        if (state.dimension == 3) bytes += char(3);
        for (std::size_t k = 0; k < corners; ++k)
            detail::append_little_endian(bytes, std::int32_t(state.facets[f * corners + k]));
        file.write(bytes);
    }
    file.commit();
}

}  // namespace firn::inline FIRN_BUILD
