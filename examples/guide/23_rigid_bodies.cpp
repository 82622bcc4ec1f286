//! # Rigid bodies and tools
//!
//! A firn::RigidBody is a collider with a mass. Matter pushes it, and it pushes matter; gravity, forces of the program and
//! a *drive* move it. Wheels sink, boulders roll in mud, fingers grip.
//!
//! ```cpp
//! #include <firn/rigid_body.hpp>
//!
//! firn::Collider<firn::Sphere<float, 3>> stone{.shape = {0.1F}, .friction = 0.5, .position = {0.5, 0.9, 0.5}};
//! firn::Simulation simulation(domain, sand, firn::GapContact{firn::Together(walls, firn::RigidBody(stone, 2600.0))});
//! auto& body = std::get<1>(simulation.boundary.boundary.parts);   // body.collider.position, body.velocity(), …
//! ```
//!
//! | you have | write |
//! | --- | --- |
//! | a ball, a box, a capsule of uniform density | `firn::RigidBody(collider, density)` |
//! | a mesh | firn::mass_of with the mesh, then firn::mesh_distance of the mesh moved to its centre of mass |
//! | other masses, a hollow body | `firn::RigidBody(collider, firn::MassOfBody<3>{mass, inertia})` |
//! | a hundred of one shape | `firn::BoundaryList<firn::RigidBody<…>>` as a part |
//! | a body that moves as given, whatever pushes it | a firn::Collider with velocities, not a body |
//!
//! The example `28_gripper` lifts a cube with two fingers; `29_wheel` drives a wheel with lugs through sand, and has a shape
//! from a grid of distances with a mass of its own.
//!
//! The boundary must be a firn::GapContact, so that matter touches bodies where they are. The origin of the shape is the
//! centre of mass. States have the bodies; a restart goes on with the same bits, as do any number of threads and ranks.
//!
//! ## How body and matter find each other
//!
//! What matter does to a body in a step depends on the body's velocity at the end of the step, and this on what matter
//! does. firn finds both together, by Newton's method, in two or three passes over the nodes near the body. So a body may
//! be much lighter than the matter that it touches, contact adds no energy, and momentum and angular momentum of both are
//! kept to rounding. Where an engine of yours owns the body and takes firn's forces a step later, only heavy bodies are
//! stable; see below.
//!
//! In a fluid, a body drags along what lies within its layer, `thickness_in_cells` of 1.5: a disc with a radius of 12
//! cells accelerates as if the water around it had 1.6 times its added mass. Where `body.in_flow = true`, the fluid in
//! the layer flows around the body; with `thickness_in_cells = 0.75` the added mass of this disc is then right within
//! 2 %. That is for runs of one process, and for smooth bodies.
#include <firn/firn.hpp>
#include <firn/rigid_body.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace {

using Jelly = firn::FixedCorotated<double>;
using Walls = firn::Walls<double, 2>;
using Plate = firn::Collider<firn::Box<double, 2>>;
using Ball = firn::Collider<firn::Sphere<double, 2>>;

constexpr double h = 1.0 / 32;
const firn::Domain<2> room{.lower = {0, 0}, .upper = {2, 1.5}, .cell_size = h};
Walls walls() { return Walls::all({0, 0}, {2, 1.5}, {firn::Contact::separate, 0.3}); }

//! ## A ball on a mat
//!
//! A light ball falls on a mat of jelly, sinks in and comes to rest on it. Then the mat bears its weight.
bool ball_comes_to_rest() {
    const Ball solid{.shape = {0.12}, .friction = 0.3, .position = {1.0, 0.6}};
    const firn::RigidBody ball(solid, 200.0);
    firn::Simulation simulation(room, Jelly::from_young_poisson(5e4, 0.3),
                                firn::GapContact{firn::Together(walls(), ball)});
    simulation.add(firn::sample_box<2>({0, 0}, {2, 0.3}, {.spacing = h / 2}), 1000);
    auto& body = std::get<1>(simulation.boundary.boundary.parts);
    body.drive.hold(1, 0, 60);  // a damper of 60 N s/m, such as air, so that it comes to rest soon
    simulation.advance(3);
    simulation.reactions.emplace();
    double upwards = 0, time = 0;
    for (; time < 0.2; time += simulation.last_time_step()) {
        simulation.step();
        upwards -= simulation.reactions->parts[1].impulse[1];
    }
    const double weight = 9.81 * body.mass;
    std::printf("the ball of %.1f N rests at %.3f m; the mat bears it with %.1f N\n", weight, body.collider.position[1],
                upwards / time);
    return std::abs(upwards / time / weight - 1) < 0.02;
}

//! ## Drives
//!
//! | `body.drive` | |
//! | --- | --- |
//! | `.keep(1, -0.05)` | moves along y with −0.05 m/s, whatever it takes: a penetrometer, a vane |
//! | `.keep(0, 0.2, 30)` | moves along x with 0.2 m/s, unless that takes more than 30 N: a finger |
//! | `.hold(0, 1e4, 50, 20)` | a spring of 10⁴ N/m and a damper to `position`, with at most 20 N: a robot's joint |
//! | `.keep_upright()` | does not turn |
//! | `.release(0)` | moves freely again |
//!
//! Motions are numbered: along x, y, z, then about x, y, z; in 2D 2 is the rotation. `body.driven` has the forces and
//! torques that the drive used in the last step. Stiff springs need no short steps.
//!
//! A plate presses a block against the wall, with at most 300 N. It stops where the block presses back as much.
bool plate_stops() {
    const Plate solid{.shape = {{0.1, 0.3}}, .position = {0.62, 0.3}};
    firn::RigidBody plate(solid, 500.0);
    plate.drive.keep(0, -0.1, 300).keep(1, 0).keep_upright();
    firn::Simulation simulation(room, Jelly::from_young_poisson(1e4, 0.0),
                                firn::GapContact{firn::Together(walls(), plate)});
    simulation.gravity = {};
    simulation.add(firn::sample_box<2>({0, 0.1}, {0.5, 0.5}, {.spacing = h / 2}), 1000);
    const auto& body = std::get<1>(simulation.boundary.boundary.parts);
    simulation.advance(1.5);
    double strain = 0, time = 0;  // the mean, as the plate swings
    for (; time < 2; time += simulation.last_time_step()) {
        simulation.step();
        strain += simulation.last_time_step() * (1 - (body.collider.position[0] - 0.1) / 0.5);
    }
    strain /= time;
    const double expected = 300 / (1e4 * 0.4);
    std::printf("the drive uses %.1f N; the block is shorter by %.2f %%, expected %.2f %%\n", -body.driven[0],
                100 * strain, 100 * expected);
    return std::abs(strain / expected - 1) < 0.1;
}

//! ## Bodies of another engine
//!
//! Bodies that hit each other, joints, robots: an engine for rigid bodies (Bullet, MuJoCo, Drake) does that, and owns the
//! bodies. firn has a Collider for each of them, takes velocities, and gives a force and a torque:
//!
//! 1. before a step of firn, give each collider the position, the rotation and the velocities of its body;
//! 2. take the step with `simulation.reactions`; each part's reaction is what the body gave to matter, about its position;
//! 3. let the engine act with −impulse / dt and −angular_impulse / dt for the time dt, in as many substeps as it likes.
//!
//! This is *staggered*: forces come a step late. It is stable for bodies that are heavier than the matter at the nodes they
//! touch, 2D cells · h² · density. For lighter ones firn has a RigidBody for each body of the engine:
//!
//! 1. before a step, give it the position and the rotation, then the velocities by `set_velocity()`; gravity acts in firn;
//! 2. after the step, `body.velocity()` and `body.angular_momentum` are those after the push of matter: give them to the
//!    engine, whose own gravity is zero, and let it collide and move its bodies for the time dt.
//!
//! So the example `30_boxes` pours light boxes of Bullet into sand. What the engine's contacts push, matter bears in
//! the next step: a box on which others land enters matter, by up to about a cell there; short steps help.
struct Engine {  // here one ball, with gravity
    firn::Vec<double, 2> position{}, velocity{};
    double mass = 0;
    void act(const firn::Vec<double, 2>& force, double dt) {
        velocity += (force * (1 / mass) + firn::Vec<double, 2>{0, -9.81}) * dt;
        position += velocity * dt;
    }
};
bool engine_owns_ball() {
    Engine engine{.position = {1.0, 0.6}, .mass = 60};
    const Ball solid{.shape = {0.12}, .friction = 0.3, .position = engine.position};
    firn::Simulation simulation(room, Jelly::from_young_poisson(5e4, 0.3),
                                firn::GapContact{firn::Together(walls(), solid)});
    simulation.add(firn::sample_box<2>({0, 0}, {2, 0.3}, {.spacing = h / 2}), 1000);
    simulation.reactions.emplace();
    double deepest = engine.position[1];
    while (simulation.time() < 1.0) {
        auto& collider = std::get<1>(simulation.boundary.boundary.parts);
        collider.position = engine.position;
        collider.linear_velocity = engine.velocity;
        simulation.step();
        const double dt = simulation.last_time_step();
        const auto force = simulation.reactions->parts[1].impulse * (-1 / dt);
        for (int substep = 0; substep < 4; ++substep) engine.act(force, dt / 4);
        deepest = std::min(deepest, engine.position[1]);
    }
    std::printf("the engine's ball of 60 kg sank to %.3f m\n", deepest);
    return deepest > 0.15 && deepest < 0.42;
}

//! ## Limits
//!
//! - Rigid bodies do not touch each other, nor walls or colliders: matter between them separates them, but nothing else.
//! - A body should be 2.5 cells thick where matter lies on both of its sides; a simulation warns of thinner ones.
//! - Bodies feel `simulation.gravity`, or the vector that is given to `step()`. A field is refused.
//! - Implicit steps, derivatives and programs for the GPU take no GapContact, so no rigid bodies.

}  // namespace

int main() {
    const bool rests = ball_comes_to_rest(), stops = plate_stops(), owned = engine_owns_ball();
    return rests && stops && owned ? 0 : 1;
}
