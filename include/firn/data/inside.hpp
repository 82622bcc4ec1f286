/// \file Tests whether a point lies inside a closed triangle mesh, by the winding number.
#pragma once

#include <firn/data/mesh_shells.hpp>
#include <firn/data/winding_number.hpp>

namespace firn::inline FIRN_BUILD {

/// Tests whether points lie inside a closed mesh, that is, whether their winding number is ≥ 1. So if a mesh intersects
/// itself, or consists of several shells, its inside is the union of the parts. A shell that faces inwards and lies
/// within another one bounds a hole. A shell that faces inwards and lies apart is taken as if it, and all within it,
/// were reversed: see facing_outwards().
class InsideTest {
public:
    /// Prepares the test for a mesh.
    /// \throws mesh_error  if facing_outwards() does not accept the mesh, if more than a tenth of its surface is inside
    ///                     out (as the second half of a body that is twisted like an 8), or if the mesh is so small and
    ///                     so far from the origin that its shape is lost to rounding
    explicit InsideTest(const TriangleMesh& mesh) : InsideTest(detail::oriented(mesh)) {}

    /// True if the point x [m] lies inside the mesh.
    /// \throws parameter_error  if x is not finite
    bool operator()(const Vec<double, 3>& x) const { return winding_number(x) >= 1; }

    /// Returns how often the surface winds around the point x [m]: 0 outside, 1 inside a simple body, n where n bodies
    /// overlap.
    /// \throws parameter_error  if x is not finite
    int winding_number(const Vec<double, 3>& x) const { return winding_(x); }

    /// Returns the bounding box of the mesh [m].
    const Bounds<3>& bounds() const { return winding_.bounds(); }

    /// Returns the enclosed volume [m³], without holes. Where n bodies overlap, it counts n times.
    double volume() const { return volume_; }

private:
    explicit InsideTest(const detail::OrientedMesh& oriented) : winding_(oriented.mesh), volume_(oriented.volume) {
        detail::check_facing(oriented, winding_);
    }

    detail::WindingNumber winding_;
    double volume_;
};

}  // namespace firn::inline FIRN_BUILD
