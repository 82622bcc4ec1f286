/// \file A rigid wheel with lugs drives through dry sand in a test bed: the drive keeps its angular velocity ω, and a
/// carriage keeps its speed v = (1 − slip) ω R or, with --pull, lets go of it against a given force. The wheel sinks as
/// far as it must to bear its load. R is the radius with lugs.
///
/// In plane strain, per metre of width; the picture shows the plane as a slice. The sand is firn::MohrCoulomb with the
/// strength of the dry sand of the Land Locomotion Laboratory, c = 1.04 kPa and φ = 28° (Wong, "Theory of Ground
/// Vehicles", table 2.3). In steady state the program prints slip, sinkage, drawbar pull and torque beside those of
/// the law of Bekker, Wong and Reece with the measured constants of this sand, for firm and for loose sand. The law
/// knows no lugs: its wheel has the radius R.
///
/// What must come out: the sand bears the load, and the drive gives more power than the carriage takes. At a slip of
/// 0.3, with 20 cells over R or more, sinkage, pull and torque lie between those of the law for loose and firm sand, or
/// 30 % beside. But the pull is not converged: with 14, 20, 28 and 40 cells over R it is 0.32, 0.23, 0.18 and 0.15 of the
/// load. In coarse cells the layers of two lugs, of 1.5 cells each, fill the gap between them, so that sand there moves
/// with the wheel; with layers of half a cell (Collider::thickness_in_cells) it is 0.21, 0.18, 0.17 and 0.14. The law
/// misses how slip digs: at a slip of 0.1 the wheel sinks half as far as it says, at 0.6 half as far again, and there it
/// pulls 70 % more.
#include "support/run.hpp"
#include "support/wong_reece.hpp"
#include <firn/firn.hpp>
#include <firn/rigid_body.hpp>
#include <firn/soil.hpp>

#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>

namespace {

using Point = firn::Vec<double, 2>;
using Sand = firn::PlaneStrain<firn::MohrCoulomb<float>>;
using Wheel = firn::RigidBody<firn::Collider<firn::DistanceGrid<float, 2>>>;
using Bed = firn::GapContact<firn::Together<firn::Walls<float, 2>, Wheel>>;
using Simulation = firn::SimulationWith<2, Sand, Bed>;

constexpr double pi = std::numbers::pi, g = 9.81, density = 1600, young = 1e6;  // [1], [m/s²], [kg/m³], [Pa]
constexpr double radius = 0.3, lug = 0.03, width = 0.25;  // with lugs, their height and thickness, of Bekker's law [m]
constexpr double omega = 0.5 / radius;                    // at which the wheel turns [rad/s]
constexpr double start = 0.6, depth = 1.5 * radius, length = 9 * radius;  // where the wheel starts; of the bed [m]
constexpr double sunk = 0.4, turns = 0.8, lets_go = 1.2, end = 3.5;       // when phases end [s]
constexpr double steady = end - 2 * pi / (3 * omega);  // means are over a third of a turn, so over whole lugs [s]
constexpr double usual_cell = radius / 20;             // [m]
constexpr int usual_steps = 20000, usual_lugs = 24;

/// Returns the corners of the wheel [m], counterclockwise, about its centre.
std::vector<Point> outline_of(int lugs) {
    std::vector<Point> corners;
    const double rim = radius - lug, half = std::asin(lug / 2 / rim);
    const auto add = [&](double r, double angle) { corners.push_back({r * std::cos(angle), r * std::sin(angle)}); };
    const double out = std::hypot(radius, lug / 2), half_out = std::atan(lug / 2 / radius);
    const int parts = lugs > 0 ? lugs : 120, per_gap = lugs > 0 ? 1 + 120 / lugs : 1;
    for (int k = 0; k < parts; ++k) {
        const double at = 2 * pi * k / parts, next = at + 2 * pi / parts;
        if (lugs > 0) add(rim, at - half), add(out, at - half_out), add(out, at + half_out);
        for (int i = 0; i < per_gap; ++i) {
            const double from = lugs > 0 ? at + half : at, to = lugs > 0 ? next - half : next;
            add(lugs > 0 ? rim : radius, from + i * (to - from) / per_gap);
        }
    }
    return corners;
}
/// Returns the signed distance from a polygon [m].
double distance_from(const std::vector<Point>& corners, const Point& x) {
    double square = 1e30;
    bool inside = false;
    for (std::size_t k = 0; k < corners.size(); ++k) {
        const Point a = corners[k], b = corners[(k + 1) % corners.size()], edge = b - a;
        const double along = std::clamp(dot(x - a, edge) / dot(edge, edge), 0.0, 1.0);
        const Point apart = x - a - edge * along;
        square = std::min(square, dot(apart, apart));
        if ((a[1] > x[1]) != (b[1] > x[1]) && x[0] < a[0] + edge[0] * (x[1] - a[1]) / edge[1]) inside = !inside;
    }
    return (inside ? -1 : 1) * std::sqrt(square);
}
/// Returns mass and inertia of a polygon about its centre, with this mass [kg].
firn::MassOfBody<2> mass_of(const std::vector<Point>& corners, double mass) {
    double area = 0, second = 0;
    for (std::size_t k = 0; k < corners.size(); ++k) {
        const Point a = corners[k], b = corners[(k + 1) % corners.size()];
        const double part = (a[0] * b[1] - a[1] * b[0]) / 2;
        area += part;
        second += part * (dot(a, a) + dot(a, b) + dot(b, b)) / 6;
    }
    return {mass, mass * second / area};
}
/// Returns the wheel as a solid from z = 0 to −width [m], turned and moved.
firn::TriangleMesh mesh_of(const std::vector<Point>& corners, const Wheel& wheel) {
    firn::TriangleMesh mesh;
    const Point centre = wheel.collider.position;
    for (const double z : {0.0, -width}) {
        mesh.vertices.push_back({centre[0], centre[1], z});
        for (const Point& corner : corners) {
            const Point x = centre + firn::matrix_of(wheel.collider.rotation) * corner;
            mesh.vertices.push_back({x[0], x[1], z});
        }
    }
    const int n = int(corners.size());
    for (int k = 0; k < n; ++k) {
        const int a = 1 + k, b = 1 + (k + 1) % n, behind = n + 1;
        mesh.triangles.push_back({0, a, b});
        mesh.triangles.push_back({behind, behind + b, behind + a});
        mesh.triangles.push_back({a, behind + a, behind + b});
        mesh.triangles.push_back({a, behind + b, b});
    }
    return mesh;
}

struct Test {
    double slip = 0.3;             ///< that the carriage keeps [1]
    double load = 3000;            ///< [N/m]
    std::optional<double> pull{};  ///< that the wheel must pull with, over its load [1]
};
Wheel& wheel_of(Simulation& simulation) { return std::get<1>(simulation.boundary.boundary.parts); }

/// Sets the drive for a step that begins at a time [s]. It follows from the time alone, so a run can go on.
void drive(Wheel& wheel, double time, const Test& test) {
    const double part = std::clamp((time - sunk) / (turns - sunk), 0.0, 1.0), speed = part * omega;
    wheel.drive.keep(2, -speed).keep(0, (1 - test.slip) * speed * radius);
    // While it sinks, a damper takes the wheel's energy.
    wheel.drive.hold(1, 0, time < sunk ? test.load / g * 30 : 0);
    wheel.force = {0, wheel.mass * g - test.load};
    if (!test.pull || time < lets_go) return;
    wheel.drive.release(0);
    wheel.force[0] = -*test.pull * test.load;
}

/// Makes the bed at rest, with the wheel above it. Half of the load is the wheel's weight.
Simulation made(const std::vector<Point>& corners, double h, const Test& test, int threads) {
    const double reach = radius + 6 * h;
    firn::Collider<firn::DistanceGrid<float, 2>> solid{
        .shape = {firn::sampled_distance<2>([&](const Point& x) { return distance_from(corners, x); },
                                            {.lower = {-reach, -reach}, .upper = {reach, reach}, .spacing = h / 2})},
        .friction = 0.5};
    solid.position = {start, depth + radius + 0.5 * h};
    const firn::Domain<2> room{{0, 0}, {length, depth + 3 * radius}, h};
    auto walls = firn::Walls<float, 2>::all(room.lower, room.upper, {firn::Contact::slip, 0});
    walls.at_lower[1] = {firn::Contact::separate, 0.5};
    walls.at_upper[1].contact = firn::Contact::none;
    const example::SoilOfWheels& like = example::firm_sand;
    const auto sand = firn::MohrCoulomb<float>::from_properties({.young = young,
                                                                 .poisson = 0.3,
                                                                 .cohesion = like.cohesion,
                                                                 .friction_angle = firn::radians(like.friction_angle)});
    Simulation bed(room, Sand{sand}, firn::Coloured{threads},
                   Bed{firn::Together(walls, Wheel(solid, mass_of(corners, 0.5 * test.load / g)))});
    const firn::Body ground = bed.add(firn::sample_box<2>({0, 0}, {length, depth}, {.spacing = h / 2}), density);
    firn::set_at_rest(bed.set(), ground, {.surface = [](const Point&) { return depth; }});
    bed.gravity = {0, -g};
    bed.reactions.emplace();
    bed.fixed_time_step = end / usual_steps * h / usual_cell;
    return bed;
}

/// Draws the plane as a slice somewhat wider than the wheel. \param heights  of the particles at the start, by id [m]
example::Image drawn(Simulation& simulation, const std::vector<Point>& corners, const std::vector<double>& heights) {
    const double spacing = simulation.domain().cell_size / 2, front = 0.3 * width, back = -1.3 * width;
    example::Cloud slice;
    slice.radius = float(0.75 * spacing);
    const auto& particles = simulation.particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const auto x = firn::cast<double>(particles.position(slot));
        const double deep = depth - heights[particles.id(slot)];
        const auto colour = std::uint8_t(std::fmod(deep, 0.12) > 0.06 ? example::amber : example::sand);
        // Behind the front only the surface is seen.
        const bool is_seen = deep < 0.25 || x[0] > length - 3 * spacing || x[0] < 3 * spacing;
        for (double z = front; z > (is_seen ? back : front - 2 * spacing); z -= spacing) {
            slice.positions.push_back({float(x[0]), float(x[1]), float(z)});
            slice.colour.push_back(colour);
        }
    }
    example::add_mesh(slice.surface, mesh_of(corners, wheel_of(simulation)), example::slate);
    example::View view{.direction = {{-0.35F, -0.4F, -1.0F}}, .width = 1600, .height = 800};
    view.domain = view.frame = example::Box{{{0, 0, float(back)}}, {{float(length), 1.05F, float(front)}}};
    return example::render(slice, view);
}

/// Sums over steps in steady state.
struct Sums {
    double time = 0, borne = 0, pull = 0, torque = 0, height = 0, way = 0;
    void add(const Simulation& simulation, const Wheel& wheel, const Test& test) {
        const double dt = simulation.last_time_step();
        if (simulation.time() < steady) return;
        time += dt;
        borne -= simulation.reactions->parts[1].impulse[1];
        pull += test.pull ? dt * *test.pull * test.load : -dt * wheel.driven[0];
        torque -= dt * wheel.driven[2];
        height += dt * wheel.collider.position[1];
        way += dt * wheel.velocity()[0];
    }
};
/// Prints what the wheel did beside the law. \return whether that is what must come out
bool report(const Sums& sums, const Test& test, bool is_usual) {
    const double per = 1 / sums.time, per_load = per / test.load, borne = sums.borne * per_load;
    const double slip = 1 - sums.way * per / (omega * radius);
    const double sinkage = (depth + radius - sums.height * per) / radius, pull = sums.pull * per_load,
                 torque = sums.torque * per_load / radius;
    std::printf(": the sand bears %.3f of the load\n%-18s %6s  %6s  %6s\n", borne, "", "here", "firm", "loose");
    std::printf("%-18s %6.3f\n", "slip", slip);
    bool agrees = true;
    const auto row = [&](const char* what, double here, const auto& of) {
        double law[2];
        for (const int k : {0, 1})
            law[k] = of(example::wheel_under_load(k == 0 ? example::firm_sand : example::loose_sand, test.load, radius,
                                                  width, slip));
        std::printf("%-18s %6.3f  %6.3f  %6.3f\n", what, here, law[0], law[1]);
        const auto [least, most] = std::minmax(law[0], law[1]);
        agrees = agrees && here > 0.7 * least && here < 1.3 * most;
    };
    row("sinkage/R", sinkage, [&](const auto& law) { return law.sinkage / radius; });
    row("pull/load", pull, [&](const auto& law) { return law.pull / test.load; });
    row("torque/(load R)", torque, [&](const auto& law) { return law.torque / (test.load * radius); });
    const bool is_whole = sums.time > 0.99 * (end - steady);  // not the rest after a restart
    return !is_whole || (std::abs(borne - 1) < 0.03 && torque > pull * (1 - slip) && (agrees || !is_usual));
}

int run_wheel(int argc, char** argv) {
    example::CommandLine line(
        {.name = "wheel",
         .about = "A rigid wheel with lugs drives through sand: slip, sinkage and pull, in 3.5 s.",
         .particles = 21'600,
         .steps = usual_steps,
         .frames = 60,
         .can_go_on = true,
         .takes_time = true});
    Test test;
    std::int64_t lugs = usual_lugs;
    line.add("--slip", test.slip, "Slip that the carriage keeps: 1 - v/(omega R)", 0, 0.95);
    line.add("--pull", test.pull, "Drawbar pull over load; the carriage lets go, and slip comes out", -1, 1);
    line.add("--load", test.load, "Load per width, in N/m", 500, 10000);
    line.add("--lugs", lugs, "Number of lugs, not 1; 0: a smooth wheel", 0, 36);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();
    if (lugs == 1) throw firn::parameter_error("A wheel with one lug has no centre of mass at its axle; give two.");

    const double h =
        radius / std::max(std::round(radius * std::sqrt(double(options.particles) / (4 * length * depth))), 4.0);
    const auto corners = outline_of(int(lugs));
    Simulation simulation = made(corners, h, test, options.threads);
    std::vector<double> heights;
    for (const Point& x : example::positions(simulation)) heights.push_back(x[1]);
    simulation.add_pass("drive", "sort", [&](auto& run, const auto&) { drive(wheel_of(run), run.time(), test); });

    example::StatesOfAll states(simulation, options);
    const example::Begun begun = options.go_on ? states.go_on(simulation) : example::Begun{};
    example::Options timed = options;
    if (options.time)
        timed.schedule = options.schedule_of_time(simulation.time(), begun.steps, simulation.fixed_time_step);
    Sums sums;
    const example::Outcome outcome = example::run_schedule(
        timed, [&] { return std::int64_t(example::particle_count(simulation)); }, begun,
        [&] { states.write(simulation); }, [&] { states.finish(); },
        [&] {
            simulation.step();
            sums.add(simulation, wheel_of(simulation), test);
        },
        [&] { return drawn(simulation, corners, heights); }, states.files());
    if (!outcome.has_moved()) return outcome.exit_code();
    std::printf("%sto %.2f s", outcome.part().c_str(), simulation.time());
    if (!(sums.time > 0)) {
        std::printf("\n");
        return outcome.exit_code();
    }
    const bool is_usual = !test.pull && test.slip == Test{}.slip && test.load == Test{}.load && lugs == usual_lugs &&
                          h < 1.01 * usual_cell;
    if (!report(sums, test, is_usual)) throw std::runtime_error("That is not what must come out.");
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return run_wheel(argc, argv); });
}
