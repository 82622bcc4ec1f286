/// \file Reads and writes surfaces and points as Wavefront OBJ files (for Houdini and Blender).
///
/// The library tinyobjloader parses the files, but it does not report all mistakes in a file. It reads a coordinate
/// that is not a number as 0, and it leaves out a face that has only two vertices or names a vertex that does not
/// exist. So firn checks the file first, and throws an error whose message gives the number of the invalid line.
#pragma once

#include <firn/data/memory.hpp>
#include <firn/data/mesh.hpp>
#include <firn/io/atomic_file.hpp>
#include <firn/io/state.hpp>
#include <firn/io/vendor/tiny_obj_loader.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
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

/// Checks the text of an OBJ file, line by line, and counts the vertices, faces and triangles in the text. firn later
/// compares these counts with what tinyobjloader has read.
class ObjCheck {
public:
    ObjCheck(const std::filesystem::path& path, std::string_view text) : path_(path) {
        while (!text.empty()) {
            ++line_;
            const auto length = std::min(text.find_first_of("\r\n"), text.size());
            check_line(text.substr(0, length));
            const bool two = text.substr(length, 2) == "\r\n";
            text.remove_prefix(std::min(text.size(), length + (two ? 2 : 1)));
        }
        if (highest_ > vertices_) {
            line_ = highest_line_;
            refuse(sentence("names vertex ", highest_, ", but the file has ", vertices_, " vertices"));
        }
    }
    std::int64_t vertices() const { return vertices_; }
    std::int64_t faces() const { return faces_; }
    /// Returns the number of triangles into which the faces are cut: n − 2 triangles for a face of n vertices.
    std::int64_t triangles() const { return triangles_; }

private:
    static constexpr std::string_view blanks = " \t";

    [[noreturn]] void refuse(const std::string& what) const {
        throw io_error(sentence("Line ", line_, " of ", path_, " ", what, ". Correct the file."));
    }

    static std::string_view next_word(std::string_view& line) {
        line.remove_prefix(std::min(line.find_first_not_of(blanks), line.size()));
        const auto word = line.substr(0, line.find_first_of(blanks));
        line.remove_prefix(word.size());
        return word;
    }

    void check_line(std::string_view line) {
        const auto keyword = next_word(line);
        if (keyword != "v" && keyword != "f") return;
        if (line.ends_with('\\')) refuse("continues on the next line (\\), which is not supported; join the lines");
        keyword == "v" ? check_vertex(line) : check_face(line);
    }

    void check_vertex(std::string_view line) {
        ++vertices_;
        if (vertices_ > std::numeric_limits<std::int32_t>::max()) refuse("has one vertex more than int32 can name");
        for (int k = 0; k < 3; ++k) {
            const auto word = next_word(line);
            const auto digits = word.substr(word.starts_with('+') ? 1 : 0);
            double x = 0;
            const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), x);
            if (word.empty()) refuse(sentence("has ", k, " coordinates for vertex ", vertices_, "; three are needed"));
            if (code != std::errc{} || end != digits.data() + digits.size() || !std::isfinite(x)) {
                refuse(sentence("has the coordinate \"", word, "\" for vertex ", vertices_,
                                "; a finite number is needed"));
            }
        }
    }

    void check_face(std::string_view line) {
        ++faces_;
        corners_.clear();
        for (auto word = next_word(line); !word.empty(); word = next_word(line)) {
            const auto digits = word.substr(0, word.find('/'));
            std::int64_t index = 0;
            const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), index);
            if (code != std::errc{} || end != digits.data() + digits.size() || index == 0) {
                refuse(sentence("has a face with the vertex index \"", word,
                                "\"; indices are whole numbers from 1, or "
                                "negative ones that count back"));
            }
            if (index < -vertices_) {
                const auto back = -std::uint64_t(index);  // correct also for the lowest std::int64_t
                refuse(sentence("has a face that counts back by ", back, " vertices, of ", vertices_, " so far"));
            }
            const auto vertex = index > 0 ? index : vertices_ + 1 + index;
            if (std::find(corners_.begin(), corners_.end(), vertex) != corners_.end()) {
                refuse(sentence("has a face that names vertex ", vertex, " twice"));
            }
            corners_.push_back(vertex);
            if (vertex > highest_) {
                highest_ = vertex;
                highest_line_ = line_;
            }
        }
        if (corners_.size() < 3) {
            refuse(sentence("has a face of ", corners_.size(), " vertices; three or more are needed"));
        }
        triangles_ += std::int64_t(corners_.size()) - 2;
    }

    const std::filesystem::path& path_;
    std::int64_t line_ = 0, vertices_ = 0, faces_ = 0, triangles_ = 0;
    std::int64_t highest_ = 0, highest_line_ = 0;
    std::vector<std::int64_t> corners_;  // indices (from 1) of the vertices of the current face
};

inline std::string read_text(const std::filesystem::path& path) {
    if (!std::filesystem::exists(path)) throw io_error(sentence("There is no file ", path, ". Check its name."));
    if (std::filesystem::is_directory(path)) throw io_error(sentence(path, " is a folder; give an OBJ file in it."));
    if (std::filesystem::is_character_file(path) || std::filesystem::is_block_file(path))
        throw io_error(sentence(path, " is a device; give an OBJ file."));
    std::error_code no_size;  // is set if `path` is a pipe, because a pipe has no size
    const auto size = std::filesystem::file_size(path, no_size);
    if (!no_size)
        require_memory(4 * double(size), sentence("Reading ", path, " of ", size, " bytes"), "Give a smaller mesh.");
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    if (file && file.peek() != std::ifstream::traits_type::eof()) text << file.rdbuf();
    if (!file || file.bad() || !text) {
        throw io_error(sentence("Reading ", path, " failed. Check its permissions."));
    }
    return std::move(text).str();
}

/// Returns the mesh that the text of an OBJ file describes. tinyobjloader parses the text, and cuts every polygon into
/// triangles.
inline TriangleMesh parse_obj(const std::filesystem::path& path, const std::string& text) {
    firn_tinyobj::attrib_t attributes;
    std::vector<firn_tinyobj::shape_t> shapes;
    std::vector<firn_tinyobj::material_t> materials;
    std::string warnings, errors;
    std::istringstream stream(text);
    constexpr bool triangulate = true, colours = false;
    if (!firn_tinyobj::LoadObj(&attributes, &shapes, &materials, &warnings, &errors, &stream, nullptr, triangulate,
                               colours)) {
        throw io_error(sentence("Reading ", path, " failed: ", errors, warnings));
    }
    TriangleMesh mesh;
    const auto& xyz = attributes.vertices;
    for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) mesh.vertices.push_back({xyz[i], xyz[i + 1], xyz[i + 2]});
    for (const auto& shape : shapes) {
        const auto& corners = shape.mesh.indices;
        for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
            mesh.triangles.push_back(
                {corners[i].vertex_index, corners[i + 1].vertex_index, corners[i + 2].vertex_index});
        }
    }
    return mesh;
}

}  // namespace detail

/// Reads a surface from an OBJ file, and returns it as a mesh of triangles. Polygons are cut into triangles. All groups
/// and objects of the file become one mesh. Materials are ignored. The coordinates have rounding errors of a few units
/// in the last place, because tinyobjloader does not convert text to numbers exactly.
///
/// The surface may have holes or open borders. Functions that need a closed surface, such as sample_mesh(), call
/// check_closed() themselves.
/// \throws io_error    if the file cannot be read, if it has no vertex, or if a vertex or face is malformed (the
///                     message gives the number of the line)
/// \throws mesh_error  if the file has no faces, or if it has a polygon that cannot be cut into triangles
inline TriangleMesh read_obj(const std::filesystem::path& path) {
    const auto text = detail::read_text(path);
    const detail::ObjCheck found(path, text);
    if (found.vertices() == 0) throw io_error(sentence(path, " has no vertex (no line \"v x y z\"). Give a mesh."));
    if (found.faces() == 0) {
        throw mesh_error(sentence(path, " has ", found.vertices(),
                                  " vertices and no face. Give a surface, or read the vertices as points with "
                                  "read_obj_points()."));
    }
    auto mesh = detail::parse_obj(path, text);
    if (std::int64_t(mesh.vertices.size()) != found.vertices() ||
        std::int64_t(mesh.triangles.size()) != found.triangles()) {
        throw mesh_error(sentence(path, " should give ", found.vertices(), " vertices and ", found.triangles(),
                                  " triangles, but gave ", mesh.vertices.size(), " and ", mesh.triangles.size(),
                                  ": some polygons intersect themselves or have no area. Triangulate the mesh first."));
    }
    check_mesh(mesh);
    return mesh;
}

/// Returns the points in an OBJ file that has no faces, in the order of the lines `v x y z`. write_obj_points() writes
/// such files. For a file with faces, use read_obj(): `read_obj(…).vertices` are the vertices of the surface, and
/// sample_mesh() fills the surface with points.
/// \throws io_error  if the file cannot be read, if it has no vertex, if it has faces, or if a vertex is malformed
inline std::vector<Vec<double, 3>> read_obj_points(const std::filesystem::path& path) {
    const auto text = detail::read_text(path);
    const detail::ObjCheck found(path, text);
    if (found.vertices() == 0) throw io_error(sentence(path, " has no point (no line \"v x y z\"). Give some."));
    if (found.faces() != 0) {
        throw io_error(sentence(path, " has ", found.faces(),
                                " faces; bare points are expected. Fill the surface with "
                                "sample_mesh(read_obj(…)), or take read_obj(…).vertices."));
    }
    return detail::parse_obj(path, text).vertices;
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
