/// \file Mass, centre of mass and inertia of the solid that a triangle mesh encloses.
#pragma once

#include <firn/boundary/rigid_body.hpp>
#include <firn/core/error.hpp>
#include <firn/data/mesh.hpp>

namespace firn::inline FIRN_BUILD {

/// Mass [kg] and inertia [kg m²] about the centre of mass [m] of a solid.
struct MassOfMesh : MassOfBody<3> {
    Vec<double, 3> centre;  ///< the centre of mass [m]
};

/// Returns mass, centre of mass and inertia of the solid of uniform density [kg/m³] that a closed mesh encloses. They
/// are exact: sums over the tetrahedra from a vertex to the triangles.
///
/// A RigidBody has its centre of mass at the origin of its shape:
///
///     const auto mass = firn::mass_of(mesh, 600);
///     solid.shape = {firn::mesh_distance(firn::translated(mesh, -mass.centre), {.spacing = h / 2})};
///     firn::RigidBody body(solid, mass);
/// \throws parameter_error  if the mesh encloses no volume, or if its triangles point inwards
inline MassOfMesh mass_of(const TriangleMesh& mesh, double density) {
    double volume = 0;
    auto first = Vec<double, 3>::zero();   // ∫ x dV
    auto second = Mat<double, 3>::zero();  // ∫ x xᵀ dV
    const Vec<double, 3> from = mesh.vertices.empty() ? first : mesh.vertices[0];
    for (const auto& [i, j, k] : mesh.triangles) {
        const Vec<double, 3> a = mesh.vertices[std::size_t(i)] - from, b = mesh.vertices[std::size_t(j)] - from,
                             c = mesh.vertices[std::size_t(k)] - from, sum = a + b + c;
        const double part = dot(a, cross(b, c)) / 6;
        volume += part;
        first += sum * (part / 4);
        second += (outer(sum, sum) + outer(a, a) + outer(b, b) + outer(c, c)) * (part / 20);
    }
    if (!(volume > 0))
        throw parameter_error(sentence("A mesh of ", mesh.triangles.size(), " triangles encloses ", volume,
                                       " m³; a body needs a closed mesh whose triangles point outwards."));
    const Vec<double, 3> centre = first * (1 / volume);
    second = (second - outer(centre, first)) * density;
    return {{density * volume, Mat<double, 3>::identity() * trace(second) - second}, from + centre};
}

}  // namespace firn::inline FIRN_BUILD
