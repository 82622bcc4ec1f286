//! # Particles, soft bodies and cloth
//!
//! A firn::ParticleSystem moves free particles and nets of springs without a grid: cloth, ropes, soft bodies,
//! fountains. Its boundaries are the same as those of a Simulation.
#include <firn/lagrangian.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

int main() {
    //! ## A cloth in gusts, over a ball
    //!
    //! The ball is a boundary. The cloth hangs by two corners; `{32, 32}` are cells, so that point i + 33 j lies at the
    //! i-th and j-th corner. `radius` keeps each point that far from the ball [m].
    firn::Collider<firn::Sphere<float, 3>> ball{.shape = {0.25F}, .friction = 0.3};
    ball.position = {0.5, 0.4, 0.35};
    firn::ParticleSystem system(ball);
    const auto sheet = firn::cloth({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {32, 32});      // 1 m × 1 m, upright
    system.add(sheet, {.masses = firn::facet_masses(sheet, 0.2), .radius = 0.01});  // 0.2 kg/m²
    system.points.pin(33 * 32);
    system.points.pin(33 * 32 + 32);
    system.damping = 0.5;  // 1/s

    //! Constraints keep distances (XPBD). A compliance of 0 is stiff; it depends on neither the number of iterations nor
    //! the step. Links tear when they are `tear_factor` times as long as at rest. A pinned point takes the pull of the
    //! whole cloth, so tearing begins there.
    system.constraints.add(sheet, firn::ConstraintOptions{.compliance = 1e-5});  // m/N
    system.constraints.tear_factor = 1.5;

    //! `add_force` returns the force as it is kept, so that it can change in time. Other forces: springs with dampers,
    //! anchors, drag, membranes of any elastic material, and yours.
    auto& air = system.add_force(firn::aerodynamic_surface_of<float>(sheet, {}));
    while (system.time() < 2) {
        const double t = system.time();
        air.law.wind = {0, 0, float(2 + 2 * std::sin(4 * t))};  // m/s
        system.step(1.0 / 500);
    }
    double nearest = 1, lowest = 1;
    for (const auto& x : system.points.position) {
        const firn::Vec<double, 3> at{double(x[0]), double(x[1]), double(x[2])};
        nearest = std::min(nearest, norm(at - ball.position) - 0.25);
        lowest = std::min(lowest, at[1]);
    }
    std::printf("%zu links torn; the lowest point is at %.2f m, the nearest %.3f m from the ball\n",
                system.torn().size(), lowest, nearest);

    //! ## What else there is
    //!
    //! - **Integrators**: firn::Verlet, firn::SymplecticEuler.
    //! - **Tearing**: `system.constraints.tear_factor`; links that are longer than so many times their rest length
    //! tear.
    //! - **Collisions** between points, as balls of any radius: `system.collisions.emplace()`. The boundary needs no such call.
    //! - **Emitters** give particles at a rate, with a lifespan: firn::Emitter.
    //! - **Builders**: firn::cloth, firn::rope, firn::lattice_body, firn::mesh_body.
    //! - **On the grid**: the points of a net are particles of a Simulation (material firn::NoStress), with the same
    //!   forces between them. So cloth meets snow, sand and water: `examples/12_cloth_and_snow.cpp`.
    //!
    //! ![A cloth over a ball, a pile of soft bodies, a fountain: examples/09 to 11](../images/cloth_bodies_fountain.png)
    return nearest > 0.005 && nearest < 0.02 && system.torn().empty() ? 0 : 1;
}
