//! # Boundaries
//!
//! A boundary changes the velocities of the grid nodes that it holds. The default boundary is firn::Walls. If you give
//! another boundary, it replaces the walls. To have both, join them with firn::Together.
//!
//! | boundary | what it is |
//! | --- | --- |
//! | firn::Walls | the faces of a box, each with its contact and friction; the default |
//! | firn::Collider | a shape that stands, moves or turns: firn::HalfSpace, firn::Box, firn::Sphere, firn::Capsule |
//! | firn::Collider of a firn::DistanceGrid | a closed mesh, or a function of signed distances |
//! | firn::Together | several boundaries; you fix their number and types when you compile |
//! | firn::BoundaryList | any number of boundaries of one type; you choose them at run time |
//!
//! There are four kinds of contact. `stick` allows no motion at the surface. `slip` allows no motion through the
//! surface. `separate` allows no motion into the surface, but matter may leave it. `none` allows all motion. Friction
//! is Coulomb's coefficient.
//!
//! **If you measure forces that a tool, a gripper or a plate exerts by its position, wrap the boundary in
//! firn::GapContact.** Without it a solid presses on matter about a cell before they touch. Two plates that close on a
//! block of 0.2 m until they compress it by 2 % need 440 N. With cells of 1/40 m, `GapContact{Together(left, right)}`
//! measures 519 N, without it 8,677 N; with 1/80 m, 480 N and 4,297 N. A weight that rests on a floor is measured right
//! either way, since matter finds its place. See [Contact between bodies](15_contact.cpp).
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

    //! In each step, firn moves a collider by its velocities. To steer it, set its velocities between steps:
    //! `std::get<1>(simulation.boundary.parts)` is the ball; `parts` is a std::tuple, so `parts[1]` does not compile.
    //! Of a firn::BoundaryList it is `simulation.boundary.all[1]`. What a firn::GapContact wraps is its member
    //! `boundary`: `std::get<1>(simulation.boundary.boundary.parts)`.
    //!
    //! With firn::Reactions, a simulation records the impulse that each part of the boundary gave to matter in the last
    //! step. The part received the opposite. The sum over steps, divided by their time, is a force.
    simulation.reactions.emplace();
    firn::Reaction<2> given;  // to the sand, by the ball
    while (simulation.time() < 1) {
        auto& moving = std::get<1>(simulation.boundary.parts);
        if (simulation.time() > 0.5) moving.linear_velocity = {1, 0.3};  // up and out of the sand
        simulation.step();
        given += simulation.reactions->parts[1];
    }
    const auto force = given.impulse * (-1 / simulation.time());
    const auto& moved = std::get<1>(simulation.boundary.parts);
    std::printf(
        "the ball is at (%.2f, %.2f) m; the sand held it back with %.0f N and lifted it with %.0f N on average\n",
        moved.position[0], moved.position[1], -force[0], force[1]);

    //! The same simulation also tells what loads gave: `simulation.reactions->of(load)`, of what `add_load` returned.
    //!
    //! ## Other shapes
    //!
    //! ```cpp
    //! firn::Collider<firn::Box<float, 3>> blade{.shape = {.half_extents = {0.04F, 0.2F, 0.15F}}, .position = {0.2, 0.4, 0.4}};
    //! firn::Collider<firn::HalfSpace<float, 3>> slope{.shape = {.outward = {0.5F, 0.8660254F, 0}}, .friction = 0.4};
    //! firn::Collider<firn::DistanceGrid<float, 3>> bunny{.shape = {firn::mesh_distance(mesh, {.spacing = 0.01})}};
    //! bunny.rotation = firn::rotor({0, 1, 0}, firn::degrees(30));
    //! ```
    //!
    //! A firn::DistanceGrid holds signed distances at the nodes of a grid, and works on a GPU, too. firn::mesh_distance
    //! computes them from a mesh, firn::sampled_distance from a shape or a function of yours, which may be any C++:
    //!
    //! ```cpp
    //! const auto waves = [](const firn::Vec<double, 2>& x) { return x[1] - 0.1 * std::sin(20 * x[0]); };
    //! firn::Collider<firn::DistanceGrid<float, 2>> bed{.shape = {firn::sampled_distance<2>(
    //!     waves, {.lower = {0, -0.2}, .upper = {1, 0.4}, .spacing = 0.01})}};
    //! ```
    //!
    //! ## Where several surfaces meet
    //!
    //! In a corner, between two colliders or at the foot of a slope, all surfaces near a node act at once, whatever the
    //! order in which you give them: the node's velocity changes as little as possible so that none is entered. Then
    //! each surface has friction by its own share of the push. A surface that sticks decides; of several, the last.
    //! A boundary of your own acts after these. Reactions of the parts add up to the whole.
    //!
    //! A node between two solids that close on each other moves with the slower one, and rests where they come from both
    //! sides. In a wedge that closes, it gets no faster than five times the solids.
    //!
    //! A shape of your own has one normal at a place. In its concave corners firn finds the other faces by looking one
    //! cell further. If you know the faces, name them: `faces(x, seen)`, see firn/boundary/shape.hpp. Say
    //! `convex = true` or `smooth = true` if there are no such corners, and firn does not look.
    //! A shape of your own has a name, parameters and a `signed_distance(x)`: `firn/boundary/shape.hpp` says what else it
    //! may have. If it caps its distances, say so with `exact_up_to()`: a collider compares them with its layer, and
    //! with two cells more where other solids are near. The distances of a mesh are exact at all nodes of its grid.
    //!
    //! ## Periodic axes and planes of symmetry
    //!
    //! `.periodic = {true, false}` in the domain joins the two ends of the first axis: matter that leaves at one end
    //! comes in at the other. A wall that slips without friction is a plane of symmetry: exactly if its nodes are
    //! mirrored, otherwise with an error of first order in the cell size.
    //!
    //! ## Walls of full order
    //!
    //! By default, the nodes behind a wall are held like those on it. Stresses in the two cells at the wall are then off
    //! by a fifth, on any grid. Mirrored nodes move like mirror images of those in front of the wall, and stresses are
    //! right up to the wall:
    //!
    //! ```cpp
    //! walls.nodes_behind = firn::NodesBehind::mirrored;
    //! ```
    //!
    //! The walls must lie on planes of nodes. All contacts, friction and reactions work as before, and so do all
    //! transfers, kernels and executions. A step costs about 1 % more.
    //!
    //! ## What to know
    //!
    //! Walls act on planes of nodes. A wall between two planes acts on the nearer one, up to half a cell from where you
    //! put it; a simulation warns of that, and says which cell size fits. With firn::GapContact, such walls act where
    //! they stand: [by the gap of particles](15_contact.cpp).
    //!
    //! Colliders may stand anywhere. Matter comes to rest about one cell before their surface (`thickness_in_cells`),
    //! between half a cell and one and a half, depending on where the nodes lie. This layer keeps matter out of the solid.
    //! Friction acts only while matter presses on the surface. Matter that must come right up to the surface meets it by
    //! the gap of particles, too.
    //!
    //! A solid should be at least 3 cells thick. Nodes near one face of a thinner one pull at matter that leaves the
    //! other face, with up to 18 % of the force that pressed before if it has 1.6 cells, 4 % if 2.4, 1 % if 3. Matter on
    //! both of its sides moves as one there. firn warns of such solids. By the gap of particles, they do not pull.
    //!
    //! A domain may lie far from 0, as in map coordinates. firn measures from the domain's corner, so walls, colliders
    //! and firn's acceleration fields lose nothing in float. What gets positions in metres does: boundaries and
    //! acceleration fields of your own, programs for GPUs. They are refused where the last digit of a float exceeds a
    //! thousandth of a cell: with cells of 0.1 m, beyond 1 km. Give them `measured_from(corner)`, compute in double, or
    //! move the origin. Positions in states have the precision of the simulation: in float, 0.5 m at 4,600 km.
    return std::abs(moved.position[0] - 1.3) < 0.01 && force[0] < 0 && force[1] > 0 ? 0 : 1;
}
