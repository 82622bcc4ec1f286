//! # Boundaries
//!
//! A boundary changes the velocities of the grid nodes that it holds. The default boundary is firn::Walls. If you give
//! another boundary, it replaces the walls. To have both, join them with firn::Together.
//!
//! | boundary | what it is |
//! | --- | --- |
//! | firn::Walls | the faces of a box, each with its contact and friction; the default |
//! | firn::Collider | a shape that stands, moves or turns: firn::HalfSpace, firn::Box, firn::Sphere, firn::Capsule |
//! | firn::Collider of a firn::DistanceGrid | a closed mesh; firn::mesh_distance makes the grid from the mesh |
//! | firn::Together | several boundaries; you fix their number and types when you compile |
//! | firn::BoundaryList | any number of boundaries of one type; you choose them at run time |
//!
//! There are four kinds of contact. `stick` allows no motion at the surface. `slip` allows no motion through the
//! surface. `separate` allows no motion into the surface, but matter may leave it. `none` allows all motion. Friction
//! is Coulomb's coefficient.
#include <firn/firn.hpp>

#include <cstdio>

int main() {
    //! The scene is a box of sand. Its floor sticks, and its side walls slip. A ball ploughs through the sand.
    const firn::Domain<2> box{.lower = {0, 0}, .upper = {2, 1}, .cell_size = 1.0 / 64};
    auto walls = firn::Walls<float, 2>::all({0, 0}, {2, 1}, {firn::Contact::slip, 0});
    walls.at_lower[1] = {firn::Contact::stick, 0};     // axis 1 is up: the floor
    walls.at_upper[1] = {firn::Contact::separate, 0};  // the lid
    const firn::Collider<firn::Sphere<float, 2>> ball{.shape = {0.12F},
                                                      .contact = firn::Contact::separate,
                                                      .friction = 0.3,
                                                      .position = {0.3, 0.2},
                                                      .linear_velocity = {1, 0}};
    const auto sand = firn::Sand<float>::from_properties({.friction_angle = firn::degrees(35)});
    firn::Simulation simulation(box, sand, firn::Together(walls, ball));
    simulation.add(firn::sample_box<2>({0.6, 0}, {2, 0.25}, {.spacing = 1.0 / 128}), 1600);

    //! In each step, firn moves a collider by its velocities. To steer the collider, change the boundary's parts
    //! between steps: `std::get<1>(simulation.boundary.parts)` is the ball.
    //!
    //! With firn::Reactions, a simulation records the impulse that each part of the boundary gave to matter in the last
    //! step. The opposite force acts on the ball: −impulse/dt, where dt is the time step.
    simulation.reactions.emplace();
    double push = 0, time = 0;
    while (simulation.time() < 1) {
        simulation.step();
        push += simulation.reactions->parts[1].impulse[0];
        time += simulation.last_time_step();
    }
    const auto& moved = std::get<1>(simulation.boundary.parts);
    std::printf("the ball is at x = %.3f m; it pushed the sand with %.1f N/m on average\n", moved.position[0],
                push / time);

    //! ## Periodic axes and planes of symmetry
    //!
    //! `.periodic = {true, false}` in the domain joins the two ends of the first axis: matter that leaves at one end
    //! comes in at the other. A wall that slips without friction is a plane of symmetry; the error is of first order in
    //! the cell size.
    //!
    //! ## What to know
    //!
    //! Matter comes to rest up to 1.5 cells before the surface of a collider (`thickness_in_cells`). This layer keeps
    //! matter out of the solid. Friction acts only while matter presses on the surface.
    return std::abs(moved.position[0] - 1.3) < 1e-3 && push > 0 ? 0 : 1;
}
