/// \file Makes a state of a mesh, so that what writes states writes meshes, too.
#pragma once

#include <firn/data/mesh.hpp>
#include <firn/io/state.hpp>

#include <cstddef>
#include <cstdint>
#include <utility>

namespace firn::inline FIRN_BUILD {

/// Returns a state with a mesh's vertices as points, with the ids 0, 1, …, and with its triangles as facets. The state
/// has no field but the positions [m].
/// \param mesh  the mesh; it may be empty
/// \param time  time of the state [s]
template <state_scalar S = float>
[[nodiscard]] State<S> state_of(const TriangleMesh& mesh, double time = 0) {
    State<S> state;
    state.time = time;
    StateField<S> position{"position", "m", 3, {}};
    position.values.reserve(3 * mesh.vertices.size());
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        for (const double x : mesh.vertices[i].v) position.values.push_back(S(x));
        state.id.push_back(std::int64_t(i));
    }
    state.body.resize(mesh.vertices.size());
    state.fields.push_back(std::move(position));
    for (const auto& triangle : mesh.triangles)
        state.facets.insert(state.facets.end(), triangle.begin(), triangle.end());
    return state;
}

}  // namespace firn::inline FIRN_BUILD
