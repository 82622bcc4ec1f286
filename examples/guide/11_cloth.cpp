//! # Particles, soft bodies and cloth
//!
//! A firn::ParticleSystem moves free particles and nets of springs without a grid: cloth, ropes, soft bodies,
//! fountains. Its boundaries are the same as those of a Simulation.
#include <firn/lagrangian.hpp>

#include <cstdio>

int main() {
    //! A sheet of 1 m × 1 m hangs by two corners in the wind. `{32, 32}` is the number of cells along its two sides. So
    //! the sheet has 33 × 33 points, and the point with index i + 33 j is the i-th along the first side and the j-th
    //! along the second.
    firn::ParticleSystem<3> system;
    const auto sheet = firn::cloth({0.0, 1.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 0.0, 1.0}, {32, 32});
    system.add(sheet, {.masses = firn::facet_masses(sheet, 0.2)});  // kg/m²

    //! Constraints keep the distances between points (XPBD). Their compliance depends neither on the number of
    //! iterations nor on the time step. A pinned point moves only with the velocity that you give it:
    //! `pin(point, velocity)`.
    system.constraints.add(sheet);
    system.points.pin(0);
    system.points.pin(32);

    //! There are these forces: springs with dampers, anchors, drag, membranes of any elastic material, wind on facets,
    //! and your own.
    system.add_force(firn::aerodynamic_surface_of<float>(sheet, {.wind = {3, 0, 1}}));
    system.advance(2, 0.005);  // seconds, in steps of so many

    double lowest = 1;
    for (const auto& x : system.points.position) lowest = std::min(lowest, double(x[1]));
    std::printf("the lowest point hangs at %.2f m; the pinned corner is at %.2f m\n", lowest,
                double(system.points.position[0][1]));

    //! - **Integrators**: firn::Verlet and firn::SymplecticEuler.
    //! - **Tearing**: a link tears when it is longer than its rest length times `system.constraints.tear_factor`.
    //! - **Collisions**: `system.collisions.emplace()` lets balls of any radius collide.
    //! - **Emitters**: a firn::Emitter creates particles at a rate, with a lifespan.
    //! - **Builders**: firn::cloth, firn::rope and firn::soft_body build nets from rectangles, lattices and meshes.
    //! - **On the grid**: the points of a net can also be particles of a Simulation (material firn::NoStress), with the
    //!   same forces between them. So cloth meets snow, sand and water: `examples/12_cloth_and_snow.cpp`.
    //!
    //! ![A cloth over a ball, a pile of soft bodies, a fountain: examples/09 to 11](../images/cloth_bodies_fountain.png)
    return lowest < 0.3 && std::abs(double(system.points.position[0][1]) - 1) < 1e-6 ? 0 : 1;
}
