/// \file Two fingers lift a cube of jelly and put it down again. Each finger is a rigid body with a drive: it closes
/// with a limited force, so that it stops where the jelly presses back as much, and moves up and down with a given
/// velocity. Friction alone holds the cube.
///
/// What must come out: while the fingers hold the cube, each presses with the force of its drive, and both together
/// bear the weight. By Coulomb the cube hangs if the force of each finger is above weight / (2 μ), and is left behind
/// if it is below. The program prints the forces when a phase ends.
#include "support/run.hpp"
#include <firn/firn.hpp>
#include <firn/rigid_body.hpp>

#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace {

using Point = firn::Vec<double, 3>;
using Jelly = firn::FixedCorotated<float>;
using Finger = firn::RigidBody<firn::Collider<firn::Box<float, 3>>>;
using Hand = firn::GapContact<firn::Together<firn::Walls<float, 3>, Finger, Finger>>;
using Simulation = firn::SimulationWith<3, Jelly, Hand>;

constexpr double side = 0.16, density = 1000, g = 9.81, height = 0.2, friction = 0.6;  // [m], [kg/m³], [m/s²], [m], [1]
constexpr double weight = density * side * side * side * g;                            // [N]
constexpr double needed = weight / (2 * friction);                                     // of each finger [N]
constexpr double speed = 0.06, apart = 0.02;  // at which fingers close [m/s]; from the cube at the start [m]
constexpr double usual_young = 5e4, usual_cell = side / 15;  // [Pa], [m]
constexpr int usual_steps = 6000;
const Point room{0.6, 0.5, 0.4}, half{0.035, 0.085, 0.085};

struct Phase {
    const char* name;
    double end;      ///< [s]
    double closing;  ///< speed at which fingers want to approach each other, each [m/s]
    double rise;     ///< height by which they rise [m]
};
constexpr std::array<Phase, 5> phases{{{"close", 0.6, speed, 0},
                                       {"lift", 1.4, speed, height},
                                       {"hold", 1.8, speed, 0},
                                       {"lower", 2.6, speed, -height},
                                       {"open", 3.0, -speed, 0}}};

std::size_t phase_at(double time) {
    std::size_t k = 0;
    while (k + 1 < phases.size() && time >= phases[k].end) ++k;
    return k;
}
double begin_of(std::size_t phase) { return phase == 0 ? 0 : phases[phase - 1].end; }
Finger& finger(Simulation& simulation, int k) {
    auto& parts = simulation.boundary.boundary.parts;
    return k == 0 ? std::get<1>(parts) : std::get<2>(parts);
}
/// Sets the drives for a step that begins at a time [s]. They follow from the time alone, so a run can go on.
void drive(Simulation& simulation, double time, double force) {
    const std::size_t k = phase_at(time);
    const double begin = begin_of(k), length = phases[k].end - begin;
    // Speed grows and falls smoothly, so that the cube is not torn off by its own inertia.
    const double up = phases[k].rise / length * (1 - std::cos(2 * std::numbers::pi * (time - begin) / length));
    for (const int i : {0, 1})
        finger(simulation, i).drive.keep(0, (i == 0 ? 1 : -1) * phases[k].closing, force).keep(1, up);
}
Finger finger_at(double x) {
    firn::Collider<firn::Box<float, 3>> box{.shape = {firn::cast<float>(half)}, .friction = friction};
    box.position = {x, half[1] + 0.01, room[2] / 2};
    Finger made(box, 1000);
    made.drive.keep(2, 0).keep_upright();
    return made;
}

/// What the fingers do in the last fifth of a phase.
struct Forces {
    double time = 0;                  ///< [s]
    std::array<Point, 2> impulses{};  ///< of the fingers on the jelly [N s]
};
/// The fingers at the end of the phase `hold`.
struct Held {
    bool seen = false;
    double above = 0;                    ///< height of the cube's lowest particle [m]
    double borne = 0;                    ///< part of the weight that the fingers bear [1]
    std::array<double, 2> presses = {};  ///< [N]
};

double lowest(const Simulation& simulation) {
    double least = room[1];
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) least = std::min(least, double(particles.position(slot)[1]));
    return least;
}

/// Adds the forces of a step, and prints them when a phase ends.
void look(const Simulation& simulation, Forces& forces, Held& held) {
    const double now = simulation.time(), dt = simulation.last_time_step();
    const std::size_t k = phase_at(now - 0.5 * dt);
    if (now > phases[k].end - 0.2 * (phases[k].end - begin_of(k))) {
        forces.time += dt;
        for (std::size_t i = 0; i < 2; ++i) forces.impulses[i] += simulation.reactions->parts[1 + i].impulse;
    }
    if (now + 0.5 * dt < phases[k].end || now - 0.5 * dt > phases[k].end) return;
    const std::array<double, 2> presses{forces.impulses[0][0] / forces.time, -forces.impulses[1][0] / forces.time};
    const double bear = (forces.impulses[0][1] + forces.impulses[1][1]) / (forces.time * weight);
    const double above = lowest(simulation);
    forces = {};
    // The progress bar has the line.
    std::printf(
        "\n%s: the fingers press with %.1f N and %.1f N and bear %.3f of the weight; the lowest particle is "
        "%.1f cm above the floor\n",
        phases[k].name, presses[0], presses[1], bear, 100 * above);
    if (std::string_view(phases[k].name) == "hold") held = {true, above, bear, presses};
}

int grip(int argc, char** argv) {
    example::CommandLine line({.name = "gripper",
                               .about = "Two fingers under force lift a cube of jelly and put it down, in 3 s.",
                               .particles = 27'000,
                               .steps = usual_steps,
                               .frames = 60,
                               .can_go_on = true,
                               .takes_time = true});
    double force = 60, young = usual_young;
    line.add("--force", force, "Force with which each finger presses, in N", 1, 200);
    line.add("--young", young, "Young's modulus of the jelly in Pa; stiffer jelly takes shorter steps: give --time 3",
             2e4, 1e7);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    const double cells = std::max(std::round(0.5 * std::cbrt(double(options.particles))), 3.0);
    const double h = side / cells, spacing = h / 2, middle = room[0] / 2;
    const auto walls = firn::Walls<float, 3>::all({}, firn::cast<float>(room), {firn::Contact::separate, 0.5});
    const double reach = side / 2 + apart + half[0];
    Simulation simulation({{}, room, h}, Jelly::from_young_poisson(float(young), 0.3F), firn::Coloured{options.threads},
                          Hand{firn::Together(walls, finger_at(middle - reach), finger_at(middle + reach))});
    const Point corner{middle - side / 2, 0, (room[2] - side) / 2};
    simulation.add(firn::sample_box<3>(corner, corner + Point::filled(side), {.spacing = spacing}), density);
    simulation.gravity = {0, -g, 0};
    simulation.reactions.emplace();
    // About 0.6 of the bound; the default number of steps takes the fingers through all phases.
    simulation.fixed_time_step = phases.back().end / usual_steps * h / usual_cell * std::sqrt(usual_young / young);
    simulation.add_pass("drive", "sort", [&](auto& run, const auto&) { drive(run, run.time(), force); });

    example::View view{.direction = {{-0.35F, -0.25F, -1.0F}}};
    view.frame = example::Box{{{0.08F, 0, 0.1F}}, {{0.52F, 0.42F, 0.3F}}};
    const auto scenery = [&] {
        example::Scenery<3> shown{.points = {}, .colours = {example::coral}};
        for (const int i : {0, 1}) {
            const Point at = finger(simulation, i).collider.position;
            example::add_mesh(shown.surface, example::box_mesh(at - half, at + half), example::slate);
        }
        return shown;
    };
    Forces forces;
    Held held;
    const example::Outcome outcome =
        example::run(simulation, options, spacing, view, [&] { look(simulation, forces, held); }, scenery);
    if (!outcome.has_moved()) return outcome.exit_code();
    std::printf("%sof %.1f N, %.2f of what friction needs, to %.2f s", outcome.part().c_str(), force, force / needed,
                simulation.time());
    if (!held.seen) {
        std::printf("\n");
        return outcome.exit_code();
    }
    const bool hangs = held.above > 0.9 * height;
    std::printf(": the fingers %s\n", hangs ? "lift the cube" : "leave the cube behind");
    const bool presses = std::abs(held.presses[0] / force - 1) < 0.03 && std::abs(held.presses[1] / force - 1) < 0.03;
    // While its speed grows, the cube needs a fifth more.
    const bool right =
        hangs ? force > 0.97 * needed && presses && std::abs(held.borne - 1) < 0.03 : force < 1.3 * needed;
    if (!right) throw std::runtime_error("That is not what must come out.");
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return grip(argc, argv); });
}
