/// \file Soft bodies under their own weight: they stand, keep their volume, and come back.
#include "support/catch.hpp"
#include <firn/boundary/walls.hpp>
#include <firn/data/sampling.hpp>
#include <firn/lagrangian/particle_system.hpp>
#include <firn/lagrangian/soft_body.hpp>

#include "../data/meshes.hpp"

using namespace firn;

namespace soft_body_weight_tests {

namespace {

using System = ParticleSystem<3, double, Verlet, Walls<double, 3>>;

/// Its volume over that at rest: after it has lain on a floor under gravity for a second, and a second without.
struct Kept {
    double under_weight, afterwards;
};

Kept lie_down(const SoftBody<3>& body) {
    constexpr double stiffness = 1e3;  // [N/m]
    System system(Walls<double, 3>::all({-5, 0, -5}, {5, 10, 5}, {Contact::stick}));
    system.threads = 1;
    system.iterations = 4;
    system.damping = 3;
    system.gravity[0] = 2;  // the floor is slanted
    system.add(body.net, {.masses = body.masses(300)});
    system.constraints.add(body.net, ConstraintOptions{.compliance = 1 / stiffness});
    const auto volume = [&] {
        auto mesh = surface_mesh(body.net);
        for (std::size_t i = 0; i < mesh.vertices.size(); ++i) mesh.vertices[i] = system.points.position[i];
        return signed_volume(mesh) / signed_volume(surface_mesh(body.net));
    };
    Kept kept{};
    for (int step = 0; step < 500; ++step) system.step(2e-3);
    kept.under_weight = volume();
    system.gravity = {};
    for (int step = 0; step < 500; ++step) system.step(2e-3);
    kept.afterwards = volume();
    return kept;
}

}  // namespace

TEST_CASE("A mesh's support links hold it up under its weight; without them it falls flat", "[slow]") {
    auto ball = mesh_body(test_meshes::sphere({0, 0.5, 0}, 0.5, 2));
    const Kept held = lie_down(ball);
    CAPTURE(held.under_weight, held.afterwards);
    CHECK(held.under_weight > 0.95);
    CHECK(held.afterwards == Approx(1).epsilon(0.02));
    std::erase_if(ball.net.links, [](const Link& link) { return link.kind == LinkKind::support; });
    const Kept bare = lie_down(ball);
    CAPTURE(bare.under_weight);
    CHECK(bare.under_weight < 0.7);
}

TEST_CASE("A lattice of all three kinds of links holds its shape; without shear links it leans over", "[slow]") {
    auto cube = lattice_body(sample_box<3>({-0.5, 0, -0.5}, {0.5, 1, 0.5}, {.spacing = 0.25}));
    const Kept held = lie_down(cube);
    CAPTURE(held.under_weight, held.afterwards);
    CHECK(held.under_weight > 0.95);
    CHECK(held.afterwards == Approx(1).epsilon(0.02));
    std::erase_if(cube.net.links, [](const Link& link) { return link.kind == LinkKind::shear; });
    const Kept bare = lie_down(cube);
    CAPTURE(bare.under_weight);
    CHECK(bare.under_weight < 0.7);
}

}  // namespace soft_body_weight_tests
