/// \file Boxes fall into sand, onto each other and against walls. Bullet, an engine for rigid bodies, owns the boxes:
/// what hits what among boxes, floor and walls is its own. Sand and boxes push each other in firn.
///
/// In each step firn takes poses and velocities of the boxes from Bullet, and finds their velocities together with the
/// impulses of sand and gravity. Bullet takes these velocities, lets the boxes collide, and moves them. As firn finds
/// box and sand together, boxes may be far lighter than sand: forces of sand that come a step late would throw them up.
/// What boxes push each other with comes a step late: a box on which others land enters the sand, by up to about a
/// cell.
///
/// What must come out: boxes that have come to rest stand on sand alone, so that it bears their weight; they have not
/// sunk into each other. The program prints both.
#include "support/run.hpp"
#include <firn/firn.hpp>
#include <firn/rigid_body.hpp>

#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

namespace {

using Point = firn::Vec<double, 3>;
using Box = firn::RigidBody<firn::Collider<firn::Box<float, 3>>>;
using Boundary = firn::GapContact<firn::Together<firn::Walls<float, 3>, firn::BoundaryList<Box>>>;
using Simulation = firn::SimulationWith<3, firn::Sand<float>, Boundary>;

constexpr double width = 1.5, depth = 0.2;                    // of the bed of sand [m]
constexpr double thinnest = 0.11, thickest = 0.15;            // edges of boxes [m]
constexpr double sand_density = 1600, young = 2e5, g = 9.81;  // [kg/m³], [Pa], [m/s²]
constexpr double apart = 0.265;                               // distance of boxes at the start [m]
constexpr std::int64_t in_row = 5;                            // boxes beside each other at the start
constexpr double usual_time = 1.5, usual_spacing = 0.022;     // [s], [m]
constexpr int usual_steps = 1100;
constexpr double slow = 0.05;    // at rest is a box of which no point moves faster [m/s]
constexpr double window = 0.25;  // over which forces are averaged [s]

btVector3 to_bullet(const Point& x) { return {btScalar(x[0]), btScalar(x[1]), btScalar(x[2])}; }
Point from_bullet(const btVector3& x) { return {double(x.x()), double(x.y()), double(x.z())}; }

/// The engine: it has a body for each box, and five planes.
class Engine {
public:
    explicit Engine(double friction) : friction_(std::sqrt(friction)) {  // Bullet multiplies those of two bodies
        world_.setGravity({0, 0, 0});                                    // gravity is in the velocities that firn finds
        // In steps as short as firn's, boxes that overlap would be thrown apart, if they did not move apart without
        // taking speed from that.
        world_.getSolverInfo().m_splitImpulse = 1;
        world_.getSolverInfo().m_splitImpulsePenetrationThreshold = 0;
        world_.getDispatchInfo().m_deterministicOverlappingPairs = true;
        add_plane({0, 1, 0}, 0);
        for (const int axis : {0, 2})
            for (const int side : {1, -1}) {
                btVector3 normal(0, 0, 0);
                normal[axis] = btScalar(side);
                add_plane(normal, side > 0 ? 0 : -width);
            }
    }
    void add(const Box& box) {
        const auto half = firn::cast<double>(box.collider.shape.half_extents);
        auto shape = std::make_unique<btBoxShape>(to_bullet(half));
        const btVector3 inertia(btScalar(box.inertia[0]), btScalar(box.inertia[1]), btScalar(box.inertia[2]));
        add_body(std::move(shape), box.mass, inertia);
        const auto q = firn::cast<btScalar>(box.collider.rotation);
        const btQuaternion rotation(q[1], q[2], q[3], q[0]);
        const btTransform pose(rotation, to_bullet(box.collider.position));
        bodies_.back()->setCenterOfMassTransform(pose);
        bodies_.back()->setActivationState(DISABLE_DEACTIVATION);  // sand may move what is at rest
    }
    /// Gives a box of firn the pose and the velocities of its body.
    void show(std::size_t k, Box& box) const {
        const btRigidBody& body = *bodies_[planes + k];
        const btQuaternion q = body.getOrientation();
        firn::Rotor<double, 3> rotation{double(q.w()), double(q.x()), double(q.y()), double(q.z())};
        box.collider.position = from_bullet(body.getCenterOfMassPosition());
        box.collider.rotation = rotation * (1 / firn::norm(rotation));
        box.set_velocity(from_bullet(body.getLinearVelocity()), from_bullet(body.getAngularVelocity()));
    }
    /// Gives a body the velocities that the momenta of its box make, in the pose that show() gave it.
    void take(std::size_t k, const Box& box) {
        btRigidBody& body = *bodies_[planes + k];
        body.setLinearVelocity(to_bullet(box.velocity()));
        body.setAngularVelocity(body.getInvInertiaTensorWorld() * to_bullet(box.angular_momentum));
    }
    /// Lets the bodies collide, and moves them by a time dt [s].
    void move(double dt) {
        for (int substep = 0; substep < substeps; ++substep) move_once(dt / substeps);
    }
    /// The most that two bodies, or a body and a plane, have overlapped [m].
    double overlap() const { return overlap_; }

private:
    static constexpr std::size_t planes = 5;
    static constexpr int substeps = 2;

    void move_once(double dt) {
        world_.stepSimulation(btScalar(dt), 0);
        for (int i = 0; i < dispatcher_.getNumManifolds(); ++i) {
            const btPersistentManifold& touch = *dispatcher_.getManifoldByIndexInternal(i);
            for (int k = 0; k < touch.getNumContacts(); ++k)
                overlap_ = std::max(overlap_, -double(touch.getContactPoint(k).getDistance()));
        }
    }
    void add_plane(const btVector3& normal, double offset) {
        add_body(std::make_unique<btStaticPlaneShape>(normal, btScalar(offset)), 0, {0, 0, 0});
    }
    void add_body(std::unique_ptr<btCollisionShape> shape, double mass, const btVector3& inertia) {
        btRigidBody::btRigidBodyConstructionInfo made(btScalar(mass), nullptr, shape.get(), inertia);
        made.m_friction = btScalar(friction_);
        shapes_.push_back(std::move(shape));
        bodies_.push_back(std::make_unique<btRigidBody>(made));
        world_.addRigidBody(bodies_.back().get());
    }

    double friction_, overlap_ = 0;
    btDefaultCollisionConfiguration configuration_;
    btCollisionDispatcher dispatcher_{&configuration_};
    btDbvtBroadphase broadphase_;
    btSequentialImpulseConstraintSolver solver_;
    std::vector<std::unique_ptr<btCollisionShape>> shapes_;
    std::vector<std::unique_ptr<btRigidBody>> bodies_;
    btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
};

/// Boxes of random sizes and rotations, in layers of 5 by 5 above the sand.
std::vector<Box> boxes_above(std::int64_t count, double density, double friction) {
    firn::RandomSequence random(11);
    const auto between = [&](double least, double most) {
        return least + (most - least) * firn::unit_interval(random.bits());
    };
    std::vector<Box> boxes;
    for (std::int64_t n = 0; n < count; ++n) {
        firn::Collider<firn::Box<float, 3>> solid{.friction = friction};
        for (int a = 0; a < 3; ++a) solid.shape.half_extents[a] = float(0.5 * between(thinnest, thickest));
        const std::array<std::int64_t, 3> place{n % in_row, n / in_row / in_row, n / in_row % in_row};
        for (int a = 0; a < 3; ++a) {
            const double at = a == 1 ? depth + apart * (double(place[1]) + 0.7)
                                     : 0.5 * width + apart * (double(place[std::size_t(a)]) - 0.5 * double(in_row - 1));
            solid.position[a] = at + between(-0.002, 0.002);
        }
        Point axis{};
        for (int a = 0; a < 3; ++a) axis[a] = between(-1, 1);
        solid.rotation = firn::rotor(axis * (1 / firn::norm(axis)), firn::degrees(between(0, 180)));
        boxes.emplace_back(solid, density);
    }
    return boxes;
}

double reach(const Box& box) { return firn::norm(firn::cast<double>(box.collider.shape.half_extents)); }

/// Height of the lowest corner [m].
double lowest(const Box& box) {
    const auto half = firn::cast<double>(box.collider.shape.half_extents);
    const auto R = firn::matrix_of(box.collider.rotation);
    double down = 0;
    for (int a = 0; a < 3; ++a) down += std::abs(R(1, a)) * half[a];
    return box.collider.position[1] - down;
}

/// How far the centre of the deepest particle lies inside a box [m].
double deepest_particle(const Simulation& simulation, const std::vector<Box>& boxes) {
    double deepest = 0;
    const auto particles = example::positions(simulation);
    for (const Box& box : boxes) {
        const auto half = firn::cast<double>(box.collider.shape.half_extents);
        const auto turned = firn::transpose(firn::matrix_of(box.collider.rotation));
        for (const Point& x : particles) {
            const Point there = turned * (x - box.collider.position);
            double inside = width;
            for (int a = 0; a < 3; ++a) inside = std::min(inside, half[a] - std::abs(there[a]));
            deepest = std::max(deepest, inside);
        }
    }
    return deepest;
}

int pour(int argc, char** argv) {
    example::CommandLine line({.name = "boxes",
                               .about = "Boxes fall into sand and onto each other: Bullet owns them, and sand and "
                                        "boxes push each other in firn.",
                               .particles = 42'000,
                               .steps = usual_steps,
                               .frames = 50,
                               .takes_time = true});
    std::int64_t count = 100;
    double density = 300, friction = 0.5;
    line.add("--boxes", count, "Number of boxes", 1, 1000);
    line.add("--density", density, "Density of the boxes in kg/m^3; that of sand is 1600", 10, 20'000);
    line.add("--friction", friction, "Friction of boxes, with sand and with each other", 0, 10);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    const double spacing = std::cbrt(width * width * depth / double(options.particles));
    const double layers = std::ceil(double(count) / double(in_row * in_row));
    const Point room{width, depth + apart * (layers + 0.5), width};
    const auto walls = firn::Walls<float, 3>::all({}, firn::cast<float>(room), {firn::Contact::separate, 0.5});
    const std::vector<Box> made = boxes_above(count, density, friction);
    Simulation simulation({{}, room, 2 * spacing}, firn::Sand<float>::from_properties({.young = young}),
                          firn::Coloured{options.threads},
                          Boundary{firn::Together(walls, firn::BoundaryList<Box>{made})});
    simulation.gravity = {0, -g, 0};
    simulation.add(firn::sample_box<3>({}, {width, depth, width},
                                       {.spacing = spacing, .pattern = firn::Pattern::jittered, .jitter = 0.5}),
                   sand_density);
    simulation.fixed_time_step = usual_time / usual_steps * spacing / usual_spacing;
    auto& boxes = std::get<1>(simulation.boundary.boundary.parts).all;
    Engine engine(friction);
    for (const Box& box : boxes) engine.add(box);

    double borne = 0, time = 0;  // impulse of sand on the boxes, upwards [N s], and its time [s]
    const double weight_of_all = [&] {
        double mass = 0;
        for (const Box& box : made) mass += box.mass;
        return mass * g;
    }();
    const double end = options.time.value_or(double(options.schedule.steps) * simulation.fixed_time_step);
    const auto upwards = [&] {
        double momentum = 0;
        for (const Box& box : boxes) momentum += box.momentum[1];
        return momentum;
    };
    double before = upwards();
    const auto after_step = [&] {
        const double dt = simulation.last_time_step();
        if (simulation.time() > end - window) {
            borne += upwards() - before + weight_of_all * dt;
            time += dt;
        }
        for (std::size_t k = 0; k < boxes.size(); ++k) engine.take(k, boxes[k]);
        engine.move(dt);
        for (std::size_t k = 0; k < boxes.size(); ++k) engine.show(k, boxes[k]);
        before = upwards();
    };

    example::View view{.direction = {{-0.45F, -0.55F, -1.0F}}};
    view.frame = example::Box{{}, {{float(width), float(depth + 0.45), float(width)}}};
    const auto scenery = [&] {
        example::Scenery<3> shown{.points = {}, .colours = {example::sand}};
        constexpr example::Colour colours[] = {example::coral,  example::teal, example::amber,
                                               example::indigo, example::moss, example::plum};
        for (std::size_t k = 0; k < boxes.size(); ++k) {
            const auto half = firn::cast<double>(boxes[k].collider.shape.half_extents);
            auto mesh = example::box_mesh(half * -1.0, half);
            const auto R = firn::matrix_of(boxes[k].collider.rotation);
            for (auto& x : mesh.vertices) x = boxes[k].collider.position + R * x;
            example::add_mesh(shown.surface, mesh, std::uint8_t(colours[k % std::size(colours)]));
        }
        return shown;
    };
    const example::Outcome outcome = example::run(simulation, options, spacing, view, after_step, scenery);
    if (!outcome.has_moved()) return outcome.exit_code();

    std::size_t at_rest = 0, in_sand = 0;
    double mean = 0, most = 0;
    for (const Box& box : boxes) {
        const double speed = firn::norm(box.velocity()) + firn::norm(box.angular_velocity()) * reach(box);
        at_rest += speed < slow;
        const double sunk = depth - lowest(box);
        in_sand += sunk > 0;
        mean += std::max(sunk, 0.0);
        most = std::max(most, sunk);
    }
    mean /= double(std::max<std::size_t>(in_sand, 1));
    std::printf(
        "%safter %.2f s, %zu of %zu boxes are at rest; %zu are in the sand, %.1f cm below its first surface in the "
        "mean and %.1f cm at most\n",
        outcome.part().c_str(), simulation.time(), at_rest, boxes.size(), in_sand, 100 * mean, 100 * most);
    const double bears = time > 0 ? borne / time / weight_of_all : 0;
    std::printf(
        "the sand bears %.3f of their weight; boxes and walls overlapped by %.2f mm at most, sand and boxes "
        "overlap by %.2f mm\n",
        bears, 1000 * engine.overlap(), 1000 * deepest_particle(simulation, boxes));
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return pour(argc, argv); });
}
