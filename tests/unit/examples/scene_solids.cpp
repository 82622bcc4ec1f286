/// \file The solids of a scene as triangles: on the surfaces of the solids, where they are, and closed.
#include "../../../examples/support/scene_solids.hpp"

#include "support/catch.hpp"

#include <algorithm>
#include <vector>

namespace scene_solids_tests {
namespace {

using namespace firn;

const Domain<3> domain{{0, 0, 0}, {1, 1, 1}, 0.1};
const example::Vec3 from_front{{-0.5F, -0.4F, -1.0F}};

example::Surface drawn(const std::vector<BoundaryPart<3>>& parts, const std::vector<TriangleMesh>& meshes = {}) {
    example::Surface surface;
    example::add_solids(surface, parts, meshes, domain, from_front, 6);
    return surface;
}
TriangleMesh mesh_of(const example::Surface& surface) {
    TriangleMesh mesh;
    for (const auto& x : surface.vertices) mesh.vertices.push_back({x[0], x[1], x[2]});
    for (const auto& [a, b, c] : surface.triangles)
        mesh.triangles.push_back({std::int32_t(a), std::int32_t(b), std::int32_t(c)});
    return mesh;
}
template <class Shape>
Collider<Shape> placed(const Shape& shape) {
    Collider<Shape> solid;
    solid.shape = shape;
    solid.position = {0.5, 0.25, 0.75};
    solid.rotation = rotor({1, 2, 3}, degrees(70));
    return solid;
}
/// The vertices drawn lie on the solid, and the triangles, which face outwards, enclose its volume.
template <class Shape>
void check_solid(const Shape& shape, double volume, double tolerance) {
    const Collider<Shape> solid = placed(shape);
    const example::Surface surface = drawn({solid});
    CAPTURE(Shape::name);
    CHECK(signed_volume(mesh_of(surface)) == Approx(volume).epsilon(tolerance));
    CHECK_NOTHROW(check_closed(mesh_of(surface)));
    double off = 0;
    const auto back = transpose(matrix_of(solid.rotation));
    for (const auto& x : mesh_of(surface).vertices)
        off = std::max(off, std::abs(shape.signed_distance(back * (x - solid.position))));
    CHECK(off < 1e-6);
    CHECK(std::all_of(surface.colour.begin(), surface.colour.end(), [](int colour) { return colour == 6; }));
}
double area(const TriangleMesh& mesh) {
    double sum = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
        const auto &x = mesh.vertices[std::size_t(a)], &y = mesh.vertices[std::size_t(b)],
                   &z = mesh.vertices[std::size_t(c)];
        sum += 0.5 * norm(cross(y - x, z - x));
    }
    return sum;
}
Collider<HalfSpace<double, 3>> plane(const Vec<double, 3>& outward, const Vec<double, 3>& position) {
    Collider<HalfSpace<double, 3>> solid;
    solid.shape.outward = outward * (1 / norm(outward));
    solid.position = position;
    return solid;
}

constexpr double pi = 3.14159265358979323846;

}  // namespace

TEST_CASE("solids of a scene are drawn where they are", "[examples]") {
    check_solid(Sphere<double, 3>{0.2}, 4 * pi / 3 * 0.008, 0.01);
    check_solid(Box<double, 3>{{0.1, 0.2, 0.3}}, 8 * 0.006, 1e-5);
    check_solid(Capsule<double, 3>{0.2, 0.1}, pi * 0.01 * (0.4 + 0.4 / 3), 0.01);
    CHECK(drawn({Walls<double, 3>::all(domain.lower, domain.upper, {Contact::slip, 0})}).triangles.empty());
}

TEST_CASE("meshes of a scene are drawn in the order of its solids", "[examples]") {
    const TriangleMesh small = example::box_mesh({-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1}),
                       large = example::box_mesh({-0.2, -0.2, -0.2}, {0.2, 0.2, 0.2});
    auto first = placed(DistanceGrid<double, 3>{}), second = first;
    first.position = {0.25, 0, 0};
    second.position = {0.75, 0, 0};
    const auto mesh = mesh_of(drawn({first, placed(Sphere<double, 3>{0.1}), second}, {small, large}));
    const auto size = [&](std::size_t from) {
        double farthest = 0;
        for (std::size_t k = from; k < from + 8; ++k)
            farthest = std::max(farthest, norm(mesh.vertices[k] - (from == 0 ? first : second).position));
        return farthest;
    };
    CHECK(size(0) == Approx(0.1 * std::sqrt(3)));
    CHECK(size(mesh.vertices.size() - 8) == Approx(0.2 * std::sqrt(3)));
}

TEST_CASE("of a half-space, its plane within the domain is drawn", "[examples]") {
    CHECK(area(mesh_of(drawn({plane({0, 1, 0}, {0.3, 0.25, 7})}))) == Approx(1).epsilon(1e-5));
    // A plane at right angles to a diagonal of a cube cuts it in a regular hexagon, half way along the diagonal.
    const auto hexagon = mesh_of(drawn({plane({1, 1, 1}, {0.5, 0.5, 0.5})}));
    CHECK(hexagon.vertices.size() == 6);
    CHECK(area(hexagon) == Approx(0.75 * std::sqrt(3)).epsilon(1e-5));
    for (const auto& x : hexagon.vertices) CHECK(x[0] + x[1] + x[2] == Approx(1.5).epsilon(1e-6));
    auto turned = plane({0, 1, 0}, {0.5, 0.5, 0.5});
    turned.rotation = rotor({0, 0, 1}, degrees(-45));
    CHECK(area(mesh_of(drawn({turned}))) == Approx(std::sqrt(2)).epsilon(1e-5));
    CHECK(drawn({plane({0, 1, 0}, {0, 0, 0})}).triangles.empty());     // the floor of the domain
    CHECK(drawn({plane({0, 1, 0}, {0, -0.5, 0})}).triangles.empty());  // below it
    CHECK(drawn({plane({0, 0, -1}, {0, 0, 0.9})}).triangles.empty());  // it would hide what it holds
    CHECK(!drawn({plane({0, 0, 1}, {0, 0, 0.1})}).triangles.empty());
}

}  // namespace scene_solids_tests
