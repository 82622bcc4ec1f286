/// \file Writes surfaces of particles to files: PLY, and states, which StateSeries writes for ParaView. write_obj()
/// writes their triangles as OBJ.
#pragma once

#include <firn/data/surface.hpp>
#include <firn/io/mesh_state.hpp>
#include <firn/io/obj.hpp>
#include <firn/io/ply.hpp>
#include <firn/io/state.hpp>

#include <filesystem>
#include <utility>

namespace firn::inline FIRN_BUILD {

/// Returns a surface as a state: its vertices are the points, numbered from 0, its triangles the facets. The state has
/// the field "normal" [1] besides those of the surface.
/// \param time  [s]
/// \throws parameter_error  if the parts of the surface do not fit together
template <state_scalar S = float>
State<S> state_of(const SurfaceMesh& surface, double time = 0) {
    State<S> state = state_of<S>(static_cast<const TriangleMesh&>(surface), time);
    StateField<S> normal{"normal", "1", 3, {}};
    normal.values.reserve(3 * surface.normals.size());
    for (const auto& vector : surface.normals)
        for (const double component : vector.v) normal.values.push_back(S(component));
    state.fields.push_back(std::move(normal));
    for (const auto& field : surface.fields)
        state.fields.push_back({field.name, field.unit, field.components, {field.values.begin(), field.values.end()}});
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
