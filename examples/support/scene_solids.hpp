/// \file The solids of a scene as triangles, where they are at the time of a picture.
#pragma once

#include "support/scene.hpp"
#include "support/scene_file.hpp"
#include "support/solids.hpp"
#include <firn/any/boundary.hpp>

#include <cmath>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace example {

/// A capsule along the second axis with its middle at the origin.
inline firn::TriangleMesh capsule_mesh(double half_length, double radius) {
    firn::TriangleMesh mesh = sphere_mesh({}, radius);
    for (auto& x : mesh.vertices) x[1] += x[1] < 0 ? -half_length : half_length;
    return mesh;
}

/// The part of a plane within a box: a convex polygon, or nothing where the box has nothing behind the plane.
/// \param normal  of length 1, from what is behind the plane
inline std::vector<firn::Vec<double, 3>> plane_within(const firn::Vec<double, 3>& point,
                                                      const firn::Vec<double, 3>& normal, const firn::Bounds<3>& box) {
    using Point = firn::Vec<double, 3>;
    const Point middle = (box.lower + box.upper) * 0.5, half = (box.upper - box.lower) * 0.5;
    const double size = firn::norm(half), from_middle = firn::dot(middle - point, normal);
    double reach = 0;
    for (int a = 0; a < 3; ++a) reach += std::abs(normal[a]) * half[a];
    if (from_middle - reach > -1e-6 * size) return {};
    // A square that holds the box's part of the plane, cut by each face of the box.
    Point across{};
    across[std::abs(normal[0]) < 0.7 ? 0 : 1] = 1;
    const Point along = firn::cross(normal, across), u = along * (2 * size / firn::norm(along));
    const Point v = firn::cross(normal, u);
    const Point centre = middle - normal * from_middle;
    std::vector<Point> polygon{centre - u - v, centre + u - v, centre + u + v, centre - u + v};
    for (int face = 0; face < 6; ++face) {
        const int a = face / 2;
        const auto inside = [&](const Point& x) { return face % 2 ? box.upper[a] - x[a] : x[a] - box.lower[a]; };
        std::vector<Point> cut;
        for (std::size_t i = 0; i < polygon.size(); ++i) {
            const Point &from = polygon[i], &to = polygon[(i + 1) % polygon.size()];
            const double here = inside(from), there = inside(to);
            if (here >= 0) cut.push_back(from);
            if ((here >= 0) != (there >= 0)) cut.push_back(from + (to - from) * (here / (here - there)));
        }
        polygon = std::move(cut);
    }
    return polygon;
}

/// Adds the solids to a surface: of a half-space, the part of its plane within the domain if it faces the eye.
/// \param parts   the boundary as it is now
/// \param meshes  those of Scene::meshes
/// \param view    from the eye to the scene
inline void add_solids(Surface& surface, const std::vector<firn::BoundaryPart<3>>& parts,
                       const std::vector<firn::TriangleMesh>& meshes, const firn::Domain<3>& domain, const Vec3& view,
                       std::uint8_t colour) {
    std::size_t next = 0;
    const auto mesh_of = [&]<class Shape>(const Shape& shape) {
        if constexpr (std::is_same_v<Shape, firn::Sphere<double, 3>>)
            return sphere_mesh({}, shape.radius);
        else if constexpr (std::is_same_v<Shape, firn::Capsule<double, 3>>)
            return capsule_mesh(shape.half_length, shape.radius);
        else if constexpr (std::is_same_v<Shape, firn::Box<double, 3>>)
            return box_mesh(shape.half_extents * -1.0, shape.half_extents);
        else if constexpr (std::is_same_v<Shape, firn::DistanceGrid<double, 3>>)
            return meshes.at(next++);
        else  // a shape that only the program that offers it knows
            return firn::TriangleMesh{};
    };
    const auto add = [&]<class Part>(const Part& solid) {
        if constexpr (!std::is_same_v<Part, firn::Walls<double, 3>>) {
            const auto turned = matrix_of(solid.rotation);
            firn::TriangleMesh mesh;
            if constexpr (std::is_same_v<Part, firn::Collider<firn::HalfSpace<double, 3>>>) {
                const auto normal = turned * solid.shape.outward;
                if (firn::dot(firn::cast<float>(normal), view) >= 0.0F) return;
                mesh.vertices = plane_within(solid.position, normal, {domain.lower, domain.upper});
                for (std::int32_t k = 2; k < std::int32_t(mesh.vertices.size()); ++k)
                    mesh.triangles.push_back({0, k - 1, k});
            } else {
                mesh = mesh_of(solid.shape);
                for (auto& x : mesh.vertices) x = solid.position + turned * x;
            }
            add_mesh(surface, mesh, colour);
        }
    };
    for (const auto& part : parts) std::visit(add, part);
}

}  // namespace example
