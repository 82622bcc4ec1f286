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
    //! The ball is a boundary. `{32, 32}` is the number of cells of the cloth along its two sides, so point i + 33 j lies
    //! at the i-th and j-th corner. `radius` keeps each point that far from the ball [m]. `add` returns the index of the
    //! net's first point, which is 0 for the first net; for another net, give it to all functions below, too.
    firn::Collider<firn::Sphere<float, 3>> ball{.shape = {0.25F}, .friction = 0.3};
    ball.position = {0.5, 0.4, 0.35};
    firn::ParticleSystem system(ball);
    const auto sheet = firn::cloth({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {32, 32});  // 1 m × 1 m, upright
    const auto first =
        std::uint32_t(system.add(sheet, {.masses = firn::facet_masses(sheet, 0.2), .radius = 0.01}));  // kg/m²
    system.points.pin(first + 33 * 32);  // it hangs by two corners
    system.points.pin(first + 33 * 32 + 32);
    system.damping = 0.5;  // 1/s

    //! Constraints keep distances (SHAKE and XPBD). Under a force [N], a link is longer by the compliance [m/N] times the
    //! force. A link tears when it is `tear_factor` times as long as at rest, so under a force of
    //! (tear_factor − 1) × length / compliance: here 3.9 N. A pinned point takes the pull of the whole cloth, so tearing
    //! begins there. Every net may have its own factor, and so may every kind of link: firn::ConstraintsOfKinds.
    //!
    //! That holds once the iterations have solved the constraints. The stiffer the links and the lighter the points, the
    //! smaller a step must be, or the more iterations it needs; the system warns if they do not suffice. With 8
    //! iterations and steps of 2 ms, links of a tenth of this compliance would be stretched seven times too far.
    system.constraints.add(sheet, firn::ConstraintOptions{.compliance = 4e-3, .tear_factor = 1.5}, first);
    system.iterations = 20;

    //! `add_force` returns a reference to the stored force, so that it can change in time. Other forces: springs with
    //! dampers, anchors, drag, membranes of any elastic material, and yours. Springs tear as constraints do, at the
    //! factor in firn::SpringOptions. firn::ParticleSystem::tear cuts links by hand.
    auto& air = system.add_force(firn::aerodynamic_surface_of<float>(sheet, {}, first));
    double nearest = 1;
    std::size_t torn_in_breeze = 0;
    while (system.time() < 6) {
        const double t = system.time(), strength = t < 2 ? 2 : 12;
        air.law.wind = {0, 0, float(strength * (1 + std::sin(4 * t)))};  // m/s
        system.step(1.0 / 1000);
        for (const auto& x : system.points.position) nearest = std::min(nearest, norm(x - ball.position) - 0.25);
        if (t < 2) torn_in_breeze = system.torn().size();
    }
    std::printf("torn links: %zu in the breeze, %zu in the storm; nearest to the ball: %.3f m\n", torn_in_breeze,
                system.torn().size(), nearest);

    //! ## What holds, and what does not
    //!
    //! - **Far from the origin** a system moves as near it: positions are in double, with float, too. A float's velocity
    //!   loses changes below 6e-8 of it in a step: at 10 m/s, gravity in steps of less than 1e-6 s. Take double there.
    //! - **Rigid links** keep angular momentum and energy when they turn, up to 60° in a step. Under a load that makes
    //!   light points swing faster than the step follows, they damp.
    //! - **Compliance** is what you give once the iterations solve the constraints; until then nets are softer, or
    //!   stiffer, and symmetric nets hang a little askew. The system warns.
    //! - **Restitution** gives back e² of the height, in steps of any size. Points at rest stay at rest. In a crowd, where
    //!   a point meets several others in one step, some energy is lost.
    //! - **Forces** bound the step: springs, dampers, membranes and the air say how stiff they are, and the system warns
    //!   of a longer step. Your own forces say it if they have `stiffness` and `damping`; else nothing warns.
    //!
    //! ## What else there is
    //!
    //! - **Integrators**: firn::Verlet, firn::SymplecticEuler.
    //! - **Collisions** between points, as balls of any radius: `system.collisions.emplace()`. A cloth that collides
    //!   with itself needs `system.collisions->exclude(sheet.links, first)`, too. The boundary needs neither.
    //! - **Emitters** give particles at a rate, with a lifespan: firn::Emitter.
    //! - **Builders**: firn::cloth, firn::rope, firn::lattice_body, firn::mesh_body.
    //! - **On the grid**: the points of a net are particles of a Simulation (material firn::NoStress), with the same
    //!   forces between them. So cloth meets snow, sand and water: `examples/12_cloth_and_snow.cpp`.
    //!
    //! ![A cloth over a ball is pulled apart: examples/10_cloth](../images/cloth.webp)
    //! ![Balls, ropes, soft bodies and ragdolls in the plane: examples/17_toybox](../images/toybox.webp)
    return torn_in_breeze == 0 && system.torn().size() > 0 && nearest > 0.005 ? 0 : 1;
}
