/// \file Writes points and meshes as a stage of Universal Scene Description (OpenUSD), in its text format .usda, which
/// Houdini, Blender, Omniverse and Unreal can read.
///
/// Lengths are in metres (metersPerUnit = 1) and y is up (upAxis = "Y"). A stage has the root prim NAME, the stage's
/// defaultPrim, and under it one prim for each state: UsdGeomPoints, or UsdGeomMesh for a state with facets.
#pragma once

#include <firn/io/atomic_file.hpp>
#include <firn/io/finite_fields.hpp>
#include <firn/io/state.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// What a state is in a stage.
enum class UsdType {
    automatic,  ///< a mesh if the state has facets and three dimensions, else points
    points,     ///< UsdGeomPoints
    mesh        ///< UsdGeomMesh; only in 3D
};

/// A prim of a stage, made of a state.
template <state_scalar S>
struct UsdPrim {
    std::string name;                   ///< Name of the prim: letters, digits and '_', no digit first.
    State<S> state;                     ///< The particles, or the points and facets of a mesh.
    UsdType type = UsdType::automatic;  ///< Points or a mesh.
};

/// Options for writing stages.
struct UsdOptions {
    /// Time codes per second: a time t [s] is the time code (the frame) t · time_codes_per_second, or the whole number
    /// that is less than 1e-6 away from it.
    double time_codes_per_second = 24;
    /// Diameter of points [m]. 0: of each its spacing, the D-th root of its initial volume (field `volume`).
    double width = 0;
    /// Names of fields to write as primvars, besides the positions, velocities, widths and ids.
    std::vector<std::string> primvars{};
};

namespace detail {

/// Checks that a text is the name of a prim or a primvar.
/// \throws parameter_error  if it is not
inline void check_usd_name(std::string_view kind, std::string_view name) {
    const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
    const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
    const bool good = !name.empty() && name.size() <= max_state_name && !is_digit(name[0]) &&
                      std::ranges::all_of(name, [&](char c) { return is_letter(c) || is_digit(c); });
    if (!good)
        throw parameter_error(sentence("The name of a ", kind, " in a USD stage is '", name, "'; give 1 to ",
                                       max_state_name, " letters, digits and '_', with no digit first."));
}

/// Returns a name of a prim made of any text, with '_' for each character that such a name cannot have.
inline std::string usd_name_of(std::string_view text) {
    std::string name;
    for (const char c : text) {
        const bool digit = c >= '0' && c <= '9';
        if (digit && name.empty()) name += '_';
        name += digit || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ? c : '_';
    }
    return name;
}

/// Returns the shortest text from which a float or an integer is read again.
template <class T>
void append_number(std::string& text, T number) {
    char digits[32];
    text.append(digits, std::to_chars(digits, digits + sizeof digits, number).ptr);
}

/// An attribute of a prim: how it is declared. `values(add)` calls add(text) with its values, in parts.
struct UsdAttribute {
    std::string type;                     ///< type in the text format, such as "point3f[]"
    std::string name;                     ///< name, such as "points" or "primvars:mass"
    const char* interpolation = nullptr;  ///< interpolation of a primvar
};

/// Writes the declaration of an attribute.
inline void append_declaration(std::string& text, const UsdAttribute& attribute) {
    text += "        " + attribute.type + " " + attribute.name;
    if (attribute.interpolation)
        text += sentence(" (\n            interpolation = \"", attribute.interpolation, "\"\n        )");
    text += "\n";
}

/// Whether a state is written as a mesh.
/// \throws parameter_error  if it cannot be
template <class S>
bool is_usd_mesh(const UsdPrim<S>& prim) {
    if (prim.type == UsdType::mesh && prim.state.dimension != 3)
        throw parameter_error(sentence("The prim '", prim.name, "' would be a mesh of ", prim.state.dimension,
                                       " dimensions; USD has meshes in three. Write it as points."));
    return prim.type == UsdType::mesh ||
           (prim.type == UsdType::automatic && prim.state.dimension == 3 && !prim.state.facets.empty());
}

/// Calls visit(attribute, values) for each attribute of a prim that changes with time. values(put) calls put(text) with
/// parts of the text of the attribute's value.
template <class S, class Visit>
void for_usd_attributes(const UsdPrim<S>& prim, const UsdOptions& options, const Visit& visit) {
    const State<S>& state = prim.state;
    const bool mesh = is_usd_mesh(prim);
    const auto D = std::size_t(state.dimension);
    const std::size_t points = state.size();
    const StateField<S>& position = state.field("position");
    const StateField<S>* velocity = state.find("velocity");
    const StateField<S>* volume = mesh || options.width > 0 ? nullptr : &state.field("volume");
    const auto width_of = [&](std::size_t i) {
        return mesh     ? 0.0F
               : volume ? float(std::pow(double(volume->values[i]), 1.0 / double(D)))
                        : float(options.width);
    };
    // An array of `count` values; append(text, i) appends the i-th.
    const auto array = [](std::size_t count, const auto& append) {
        return [=](const auto& put) {
            std::string text = "[";
            for (std::size_t i = 0; i < count; ++i) {
                if (i > 0) text += ", ";
                append(text, i);
                if (text.size() > 4000) {
                    put(text);
                    text.clear();
                }
            }
            put(text += ']');
        };
    };
    // Tuples of n numbers: of fields with fewer components, with zeros.
    const auto tuples = [&](const StateField<S>& field, std::size_t n) {
        return array(points, [&field, n](std::string& text, std::size_t i) {
            const auto components = std::size_t(field.components);
            for (std::size_t c = 0; c < n; ++c) {
                text += c == 0 ? "(" : ", ";
                append_number(text, c < components ? float(field.values[i * components + c]) : 0.0F);
            }
            text += ')';
        });
    };
    visit(UsdAttribute{"float3[]", "extent"}, [&](const auto& put) {
        float box[6];
        for (std::size_t a = 0; a < 3; ++a) {
            box[a] = std::numeric_limits<float>::max();
            box[a + 3] = -box[a];
            for (std::size_t i = 0; i < points; ++i) {
                const float x = a < D ? float(position.values[i * D + a]) : 0.0F, half = width_of(i) / 2;
                box[a] = std::min(box[a], x - half);
                box[a + 3] = std::max(box[a + 3], x + half);
            }
        }
        std::string text = "[(";
        for (std::size_t k = 0; k < 6; ++k) {
            if (k > 0) text += k == 3 ? "), (" : ", ";
            append_number(text, box[k]);
        }
        put(text += ")]");
    });
    if (mesh) {
        visit(UsdAttribute{"int[]", "faceVertexCounts"},
              array(state.facets.size() / 3, [](std::string& text, std::size_t) { text += '3'; }));
        visit(UsdAttribute{"int[]", "faceVertexIndices"},
              array(state.facets.size(),
                    [&state](std::string& text, std::size_t i) { append_number(text, state.facets[i]); }));
    } else {
        visit(UsdAttribute{"int64[]", "ids"},
              array(points, [&state](std::string& text, std::size_t i) { append_number(text, state.id[i]); }));
    }
    visit(UsdAttribute{"point3f[]", "points"}, tuples(position, 3));
    if (velocity) visit(UsdAttribute{"vector3f[]", "velocities"}, tuples(*velocity, 3));
    if (!mesh)
        visit(UsdAttribute{"float[]", "widths", "vertex"},
              array(points, [&width_of](std::string& text, std::size_t i) { append_number(text, width_of(i)); }));
    for (const std::string& name : options.primvars) {
        const StateField<S>& field = state.field(name);
        const auto components = std::size_t(field.components);
        const std::string primvar = "primvars:" + name;
        if (components == 2 || components == 3) {
            visit(UsdAttribute{"vector3f[]", primvar, "vertex"}, tuples(field, 3));
            continue;
        }
        for (std::size_t c = 0; c < components; ++c)
            visit(UsdAttribute{"float[]", components == 1 ? primvar : primvar + "_" + std::to_string(c), "vertex"},
                  array(points, [&field, components, c](std::string& text, std::size_t i) {
                      append_number(text, float(field.values[i * components + c]));
                  }));
    }
}

/// Checks the prims of one time, and returns this time [s].
/// \throws parameter_error  if they cannot be written
template <class S>
[[gnu::cold]] double check_usd_prims(const std::vector<UsdPrim<S>>& prims, const UsdOptions& options) {
    if (!(options.time_codes_per_second > 0) || !std::isfinite(options.time_codes_per_second))
        throw parameter_error(sentence("UsdOptions::time_codes_per_second is ", options.time_codes_per_second,
                                       "; give more than 0, such as 24."));
    if (!(options.width >= 0) || !std::isfinite(double(float(options.width))))
        throw parameter_error(sentence("UsdOptions::width is ", options.width,
                                       " m; give a diameter, or 0 for the spacing of the particles."));
    if (prims.empty())
        throw parameter_error("There are no prims to write; give at least one, with its name and state.");
    check_distinct("prim", prims, [](const auto& prim) { return prim.name; }, max_state_members);
    std::vector<std::string> names = options.primvars;
    std::ranges::sort(names);
    if (const auto twice = std::ranges::adjacent_find(names); twice != names.end())
        throw parameter_error(sentence("UsdOptions::primvars names '", *twice, "' twice; name each field once."));
    for (const std::string& name : names) check_usd_name("primvar", name);
    for (const UsdPrim<S>& prim : prims) {
        check_usd_name("prim", prim.name);
        check_state(prim.state);
        if (prim.state.time != prims[0].state.time)
            throw parameter_error(sentence("The prim '", prim.name, "' has the time ", prim.state.time, " s, and '",
                                           prims[0].name, "' has ", prims[0].state.time,
                                           " s; give states of one time."));
        if (is_usd_mesh(prim) && prim.state.size() > std::size_t(std::numeric_limits<std::int32_t>::max()))
            throw parameter_error(sentence("The mesh '", prim.name, "' has ", prim.state.size(),
                                           " points; USD counts up to ", std::numeric_limits<std::int32_t>::max(),
                                           "."));
        if (!is_usd_mesh(prim) && options.width == 0 && !prim.state.find("volume"))
            throw parameter_error(sentence("The points '", prim.name,
                                           "' have no field 'volume', from which their width would come; give "
                                           "UsdOptions::width [m]."));
        for (const StateField<S>& field : prim.state.fields)
            if (field.name == "position" || field.name == "velocity" || field.name == "volume" ||
                std::ranges::find(names, field.name) != names.end())
                check_finite(prim.state, field, "a USD stage");
    }
    return prims[0].state.time;
}

/// Returns the beginning of a stage: its metadata in the order in which USD writes them.
/// \param root   name of the root prim
/// \param first  the first time code
/// \param last   the last time code
/// \param data   lines of customLayerData, or ""
inline std::string usd_header(const std::string& root, const UsdOptions& options, const std::string& first,
                              const std::string& last, const std::string& data) {
    const std::string rate = exact_text(options.time_codes_per_second);
    std::string text = "#usda 1.0\n(\n";
    if (!data.empty()) text += "    customLayerData = {\n" + data + "    }\n";
    return text + "    defaultPrim = \"" + root + "\"\n    endTimeCode = " + last + "\n    framesPerSecond = " + rate +
           "\n    metersPerUnit = 1\n    startTimeCode = " + first + "\n    timeCodesPerSecond = " + rate +
           "\n    upAxis = \"Y\"\n)\n\n";
}

/// Returns what begins a prim: its type, its name, and attributes that do not change.
inline std::string usd_prim_begin(bool mesh, const std::string& name) {
    std::string text = std::string("    def ") + (mesh ? "Mesh" : "Points") + " \"" + name + "\"\n    {\n";
    if (mesh) text += "        uniform bool doubleSided = 1\n        uniform token subdivisionScheme = \"none\"\n";
    return text;
}

/// Returns the prims with their attributes, without values.
template <class S>
std::string usd_declarations(const std::vector<UsdPrim<S>>& prims, const UsdOptions& options) {
    std::string text;
    for (const UsdPrim<S>& prim : prims) {
        text += usd_prim_begin(is_usd_mesh(prim), prim.name);
        for_usd_attributes(prim, options,
                           [&](const UsdAttribute& attribute, const auto&) { append_declaration(text, attribute); });
        text += "    }\n";
    }
    return text;
}

/// Returns the time code of a time. A time code that is nearly a whole number is that number, because the sum of a
/// run's steps is rounded, and a program that shows frames would lose a last frame of 5.999999999999999.
inline double time_code(double time, const UsdOptions& options) {
    const double code = time * options.time_codes_per_second, whole = std::round(code);
    return std::abs(code - whole) < 1e-6 ? whole : code;
}

/// Writes a stage of one time.
/// \param root  name of the root prim
template <class S>
void write_usd_stage(const std::filesystem::path& path, const std::string& root, const std::vector<UsdPrim<S>>& prims,
                     const UsdOptions& options) {
    const std::string code = exact_text(time_code(check_usd_prims(prims, options), options));
    AtomicFile file(path);
    file.write(usd_header(root, options, code, code, "") + "def Xform \"" + root + "\"\n{\n");
    for (const UsdPrim<S>& prim : prims) {
        file.write(usd_prim_begin(is_usd_mesh(prim), prim.name));
        for_usd_attributes(prim, options, [&](const UsdAttribute& attribute, const auto& values) {
            std::string text;
            append_declaration(text, attribute);
            file.write(text + "        " + attribute.type + " " + attribute.name + ".timeSamples = {\n            " +
                       code + ": ");
            values([&](const std::string& part) { file.write(part); });
            file.write(",\n        }\n");
        });
        file.write("    }\n");
    }
    file.write("}\n");
    file.commit();
}

}  // namespace detail

/// Writes a stage of one time to a USD text file. Each prim is under the root prim, which has the file's name.
/// Positions and other values are rounded to float, as USD's schemas of geometry ask for.
///
/// Points have `points` [m], `velocities` [m/s] if the state has the field `velocity`, `widths` [m] and `ids`; a mesh
/// has `points`, `velocities`, `faceVertexCounts` and `faceVertexIndices`. Fields in UsdOptions::primvars are
/// `primvars:NAME`, of the type vector3f[] for two or three components, else float[], a matrix row by row
/// (elementSize). All have one time sample. In 2D, z = 0, and facets are not written.
///
/// If writing fails, no incomplete file is left (see AtomicFile).
/// \param path   the file, NAME.usda
/// \param prims  names and states, all of one time
/// \throws parameter_error  if there are no prims, if two have one name, if a name is no identifier, if the parts of a
///                          state do not fit together (see check_state()) or their times differ, if a value is not
///                          finite, if points have no field `volume` while options.width is 0, or if a primvar is no
///                          field of each state
/// \throws io_error         if writing fails
template <state_scalar S>
void write_usd(const std::filesystem::path& path, const std::vector<UsdPrim<S>>& prims,
               const UsdOptions& options = {}) {
    detail::write_usd_stage(path, detail::usd_name_of(path.stem().string()), prims, options);
}
/// Writes a stage with the one prim `particles`, or `surface` if the state has facets and three dimensions.
/// \see write_usd(const std::filesystem::path&, const std::vector<UsdPrim<S>>&, const UsdOptions&)
template <state_scalar S>
void write_usd(const std::filesystem::path& path, const State<S>& state, const UsdOptions& options = {}) {
    const bool mesh = state.dimension == 3 && !state.facets.empty();
    write_usd(path, std::vector<UsdPrim<S>>{{mesh ? "surface" : "particles", state}}, options);
}

}  // namespace firn::inline FIRN_BUILD
