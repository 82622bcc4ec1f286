/// \file Reads and writes surfaces and points as Wavefront OBJ files (for Houdini and Blender).
#pragma once

#include <firn/data/memory.hpp>
#include <firn/data/mesh.hpp>
#include <firn/data/polygon.hpp>
#include <firn/io/atomic_file.hpp>
#include <firn/io/obj_text.hpp>
#include <firn/io/state.hpp>

#include <array>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <ranges>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

inline std::string read_text(const std::filesystem::path& path) {
    if (!std::filesystem::exists(path)) throw io_error(sentence("There is no file ", path, ". Check its name."));
    if (std::filesystem::is_directory(path)) throw io_error(sentence(path, " is a folder; give an OBJ file in it."));
    if (std::filesystem::is_character_file(path) || std::filesystem::is_block_file(path))
        throw io_error(sentence(path, " is a device; give an OBJ file."));
    std::error_code no_size;  // is set if `path` is a pipe, because a pipe has no size
    const auto size = std::filesystem::file_size(path, no_size);
    if (!no_size)  // a usual mesh takes 2.5 times the size of its file
        require_memory(4 * double(size), sentence("Reading ", path, " of ", size, " bytes"), "Give a smaller mesh.");
    std::ifstream file(path, std::ios::binary);
    std::string text;
    if (!no_size) {
        text.resize(std::size_t(size));
        file.read(text.data(), std::streamsize(size));
        text.resize(std::size_t(file.gcount()));
        if (file.eof()) file.clear();  // the file has become shorter
    }
    std::ostringstream rest;  // all of a pipe
    if (file && file.peek() != std::ifstream::traits_type::eof()) rest << file.rdbuf();
    if (file.bad() || !rest || (!file && !file.eof())) {
        throw io_error(sentence("Reading ", path, " failed. Check its permissions."));
    }
    return text += std::move(rest).str();
}

/// Returns the surface that an OBJ file describes, its polygons cut into triangles.
/// \throws mesh_error  if a polygon cannot be cut
inline TriangleMesh triangulated(const std::filesystem::path& path, ObjText& text) {
    TriangleMesh mesh{std::move(text.vertices), {}};
    mesh.triangles.reserve(text.corners.size() - 2 * text.faces.size());
    PolygonCutter cutter;
    std::vector<Vec<double, 3>> polygon;
    for (std::size_t f = 0; f < text.faces.size(); ++f) {
        const auto corners = text.corners_of(f);
        if (corners.size() == 3) {
            mesh.triangles.push_back({corners[0], corners[1], corners[2]});
            continue;
        }
        polygon.clear();
        for (const auto corner : corners) polygon.push_back(mesh.vertices[std::size_t(corner)]);
        const auto outcome = cutter.cut(polygon);
        for (const auto& [a, b, c] : cutter.triangles()) mesh.triangles.push_back({corners[a], corners[b], corners[c]});
        if (outcome == PolygonCutter::Outcome::cut) continue;
        std::string why = " that has no area: its corners lie on a line, or parts of it cancel (as in an 8)";
        if (outcome == PolygonCutter::Outcome::meets_itself) {
            const auto at = cutter.meeting();
            const auto edge = [&](std::size_t k) {
                return sentence("from vertex ", corners[at[k]] + 1, " to vertex ", corners[at[k + 1]] + 1);
            };
            why = " that crosses or touches itself, seen along its normal";
            if (at[0] != at[2]) why += sentence(": its edges ", edge(0), " and ", edge(2), " meet");
        }
        throw mesh_error(sentence("Line ", text.faces[f].line, " of ", path, " has a face of ", corners.size(),
                                  " corners", why, ". Mend it, or cut it into triangles before."));
    }
    return mesh;
}

}  // namespace detail

/// Reads a surface from an OBJ file, and returns it as a mesh of triangles. All groups and objects of the file become
/// one mesh. Coordinates are rounded to the nearest `double`.
///
/// Polygons, also concave ones, are cut into triangles in their own plane, wherever they lie and whatever their size.
/// Corners that are nearer together than 9e-13 of the polygon's size count as one. The file may give textures, normals,
/// materials, lines, points and free-form surfaces; they are not read.
///
/// The surface may have holes or open borders. Functions that need a closed surface, such as sample_mesh(), call
/// check_closed() themselves.
/// \throws io_error      if the file cannot be read, if it has no vertex, if it has a keyword that the format does not
///                       have, or if a vertex or face is malformed (the message gives the number of the line)
/// \throws mesh_error    if the file has no faces, or if a polygon of four or more corners has no area, or crosses or
///                       touches itself
/// \throws memory_error  if the file is too large for the memory
[[nodiscard]] inline TriangleMesh read_obj(const std::filesystem::path& path) {
    detail::ObjText found(path, detail::read_text(path));
    if (found.vertices.empty()) throw io_error(sentence(path, " has no vertex (no line \"v x y z\"). Give a mesh."));
    if (found.faces.empty()) {
        const std::string surfaces =
            found.free_form == 0 ? "" : sentence("; its ", found.free_form, " free-form surfaces are not read");
        throw mesh_error(sentence(path, " has ", found.vertices.size(), " vertices and no face", surfaces,
                                  ". Give a surface of polygons, or read the vertices as points with "
                                  "read_obj_points()."));
    }
    auto mesh = detail::triangulated(path, found);
    check_mesh(mesh);
    return mesh;
}

/// Returns the points in an OBJ file that has no faces, in the order of the lines `v x y z`. write_obj_points() writes
/// such files; their points are read again to the last bit. For a file with faces, use read_obj():
/// `read_obj(…).vertices` are the vertices of the surface, and sample_mesh() fills the surface with points.
/// \throws io_error      if the file cannot be read, if it has no vertex, if it has faces or a keyword that the format
///                       does not have, or if a vertex is malformed
/// \throws memory_error  if the file is too large for the memory
[[nodiscard]] inline std::vector<Vec<double, 3>> read_obj_points(const std::filesystem::path& path) {
    detail::ObjText found(path, detail::read_text(path));
    if (found.vertices.empty()) throw io_error(sentence(path, " has no point (no line \"v x y z\"). Give some."));
    if (!found.faces.empty()) {
        throw io_error(sentence(path, " has ", found.faces.size(),
                                " faces; bare points are expected. Fill the surface with "
                                "sample_mesh(read_obj(…)), or take read_obj(…).vertices."));
    }
    return std::move(found.vertices);
}

namespace detail {

/// Writes one line `v x y z` per point (z = 0 in 2D). The numbers have as few digits as possible without rounding
/// (std::to_chars).
/// \param path  the name of the file, for messages
/// \return the number of points
/// \throws parameter_error  if a coordinate of a point is not finite
template <class Points>
std::size_t write_obj_vertices(AtomicFile& file, const std::filesystem::path& path, Points&& points) {
    std::size_t number = 0;
    std::string line;
    for (const auto& x : points) {
        if (!is_finite(x)) {
            throw parameter_error(sentence("Point ", number, " (from 0) for ", path, " is ", describe(x),
                                           "; only finite points can be written. Look for the step that made it so."));
        }
        line = "v";
        for (const auto c : x.v) {
            char digits[32];
            const auto end = std::to_chars(digits, digits + sizeof digits, c).ptr;
            line.append(" ").append(digits, end);
        }
        line += std::size(x.v) == 2 ? " 0\n" : "\n";
        file.write(line);
        ++number;
    }
    return number;
}

}  // namespace detail

/// Writes points to an OBJ file, one line `v x y z` per point (z = 0 in 2D). The numbers have as few digits as possible
/// without rounding (std::to_chars). If writing fails, no incomplete file is left (see AtomicFile).
/// \param points  positions [m]: any range of `Vec<float or double, 2 or 3>`; the range may be empty
/// \throws parameter_error  if a coordinate of a point is not finite
/// \throws io_error         if writing fails
template <std::ranges::input_range Points>
void write_obj_points(const std::filesystem::path& path, Points&& points) {
    AtomicFile file(path);
    file.write("# particles, positions in metres\n");
    detail::write_obj_vertices(file, path, points);
    file.commit();
}

/// Writes a surface to an OBJ file: first one line `v x y z` per point (z = 0 in 2D), then one line per facet. In 3D a
/// facet is a triangle (line `f a b c`), in 2D an edge (line `l a b`). In the file, a, b and c are the indices of the
/// facet's corners; the first point of the file has index 1. If writing fails, no incomplete file is left (see
/// AtomicFile).
/// \param points  positions [m]: any range of `Vec<float or double, 2 or 3>`
/// \param facets  any range of arrays, each with the indices (from 0) of the three corners of a facet (two in 2D); for
///                example TriangleMesh::triangles, ParticleSystem::facets or Net::facets
/// \throws parameter_error  if a coordinate of a point is not finite, or if a facet names a point that does not exist
/// \throws io_error         if writing fails
template <std::ranges::input_range Points, std::ranges::input_range Facets>
void write_obj(const std::filesystem::path& path, Points&& points, Facets&& facets) {
    AtomicFile file(path);
    file.write("# a surface, positions in metres\n");
    const std::size_t count = detail::write_obj_vertices(file, path, points);
    std::string line;
    std::size_t number = 0;
    for (const auto& facet : facets) {
        static_assert(std::tuple_size_v<std::remove_cvref_t<decltype(facet)>> ==
                          std::size(std::ranges::range_value_t<Points>{}.v),
                      "firn: a surface consists of triangles in 3D and of edges in 2D");
        line = facet.size() == 3 ? "f" : "l";
        for (const auto corner : facet) {
            if (std::cmp_less(corner, 0) || std::cmp_greater_equal(corner, count))
                throw parameter_error(sentence("Facet ", number, " (from 0) for ", path, " names point ", corner,
                                               "; there are ", count, ", counted from 0."));
            line += ' ' + std::to_string(std::size_t(corner) + 1);
        }
        file.write(line += '\n');
        ++number;
    }
    file.commit();
}

/// Writes a triangle mesh to an OBJ file, as lines `v x y z` and `f a b c`.
/// \throws parameter_error  if a coordinate of a vertex is not finite, or if a triangle names a vertex that does not
///                          exist
/// \throws io_error         if writing fails
inline void write_obj(const std::filesystem::path& path, const TriangleMesh& mesh) {
    write_obj(path, mesh.vertices, mesh.triangles);
}

/// Writes the points of a state to an OBJ file. If the state has facets, they are written, too.
/// \throws parameter_error  if a coordinate of a point is not finite, or if the parts of the state do not fit together
///                          (see check_state())
/// \throws io_error         if writing fails
template <state_scalar S>
void write_obj(const std::filesystem::path& path, const State<S>& state) {
    check_state(state);
    const auto write = [&](auto dimension) {
        constexpr int D = dimension;
        std::vector<Vec<S, D>> points(state.size());
        std::vector<std::array<std::int64_t, std::size_t(D)>> facets(state.facets.size() / std::size_t(D));
        const std::vector<S>& x = state.field("position").values;
        for (std::size_t i = 0; i < x.size(); ++i) points[i / D][int(i % D)] = x[i];
        for (std::size_t i = 0; i < state.facets.size(); ++i) facets[i / D][i % D] = state.facets[i];
        if (facets.empty())
            write_obj_points(path, points);
        else
            write_obj(path, points, facets);
    };
    if (state.dimension == 2)
        write(std::integral_constant<int, 2>{});
    else
        write(std::integral_constant<int, 3>{});
}

}  // namespace firn::inline FIRN_BUILD
