/// \file Writes surfaces of particles to files: PLY, and states, which StateSeries writes for ParaView. write_obj()
/// writes their triangles as OBJ.
#pragma once

#include <firn/data/surface.hpp>
#include <firn/io/obj.hpp>
#include <firn/io/ply.hpp>
#include <firn/io/state.hpp>

#include <filesystem>
#include <numeric>

namespace firn::inline FIRN_BUILD {

/// Returns a surface as a state: its vertices are the points, numbered from 0, its triangles the facets. The state has
/// the field "normal" [1] besides those of the surface.
/// \param time  [s]
/// \throws parameter_error  if the parts of the surface do not fit together
template <state_scalar S = float>
State<S> state_of(const SurfaceMesh& surface, double time = 0) {
    State<S> state;
    state.time = time;
    const std::size_t n = surface.vertices.size();
    state.id.resize(n);
    std::iota(state.id.begin(), state.id.end(), std::int64_t(0));
    state.body.resize(n);
    const auto add = [&](const char* name, const char* unit, const std::vector<Vec<double, 3>>& vectors) {
        StateField<S> field{name, unit, 3, {}};
        field.values.reserve(3 * vectors.size());
        for (const auto& vector : vectors)
            for (const double component : vector.v) field.values.push_back(S(component));
        state.fields.push_back(std::move(field));
    };
    add("position", "m", surface.vertices);
    add("normal", "1", surface.normals);
    for (const auto& field : surface.fields)
        state.fields.push_back({field.name, field.unit, field.components, {field.values.begin(), field.values.end()}});
    state.facets.reserve(3 * surface.triangles.size());
    for (const auto& corners : surface.triangles)
        state.facets.insert(state.facets.end(), corners.begin(), corners.end());
    check_state(state);
    return state;
}

/// Writes a surface to a PLY file: vertices with normals (nx, ny, nz) and all fields, and triangles.
/// \param time  [s], in a comment of the file
/// \throws parameter_error  if the parts of the surface do not fit together, or as write_ply(path, state)
/// \throws io_error         if writing fails
inline void write_ply(const std::filesystem::path& path, const SurfaceMesh& surface, double time = 0) {
    const auto state = state_of<float>(surface, time);
    std::vector<std::string> fields;
    for (std::size_t f = 1; f < state.fields.size(); ++f) fields.push_back(state.fields[f].name);
    write_ply(path, state, fields);
}

}  // namespace firn::inline FIRN_BUILD
