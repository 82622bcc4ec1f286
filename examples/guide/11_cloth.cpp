//! # Particles, soft bodies and cloth
//!
//! A firn::ParticleSystem moves free particles and nets of springs without a grid: cloth, ropes, soft bodies,
//! fountains. What is a boundary of a Simulation is one of a system.
#include <firn/lagrangian.hpp>

#include <cstdio>

int main() {
    //! A sheet of 1 m × 1 m hangs by two corners in the wind. `{32, 32}` are cells, so that point i + 33 j lies at the
    //! i-th and j-th corner.
    firn::ParticleSystem<3> system;
    const auto sheet = firn::cloth({0.0, 1.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 0.0, 1.0}, {32, 32});
    system.add(sheet, {.masses = firn::facet_masses(sheet, 0.2)});  // kg/m²

    //! Constraints keep distances (XPBD, with a compliance that depends on neither iterations nor step). A pinned point
    //! moves only as you say: `pin(point, velocity)`.
    system.constraints.add(sheet);
    system.points.pin(0);
    system.points.pin(32);

    //! Forces: springs with dampers, anchors, drag, membranes of any elastic material, wind on facets, and yours.
    system.add_force(firn::aerodynamic_surface_of<float>(sheet, {.wind = {3, 0, 1}}));
    system.advance(2, 0.005);  // seconds, in steps of so many

    double lowest = 1;
    for (const auto& x : system.points.position) lowest = std::min(lowest, double(x[1]));
    std::printf("the lowest point hangs at %.2f m; the pinned corner is at %.2f m\n", lowest,
                double(system.points.position[0][1]));

    //! - **Integrators**: firn::Verlet, firn::SymplecticEuler.
    //! - **Tearing**: `system.constraints.tear_factor`; links that are longer than so many times their rest length
    //! tear.
    //! - **Collisions** of balls of any radius: `system.collisions.emplace()`.
    //! - **Emitters** give particles at a rate, with a lifespan: firn::Emitter.
    //! - **Builders**: firn::cloth, firn::rope, firn::soft_body; from rectangles, lattices and meshes.
    //! - **On the grid**: the points of a net are particles of a Simulation (material firn::NoStress), with the same
    //!   forces between them. So cloth meets snow, sand and water: `examples/12_cloth_and_snow.cpp`.
    //!
    //! ![A cloth over a ball, a pile of soft bodies, a fountain: examples/09 to 11](../images/cloth_bodies_fountain.png)
    return lowest < 0.3 && std::abs(double(system.points.position[0][1]) - 1) < 1e-6 ? 0 : 1;
}
