/// \file Two rigid fingers under force press and hold an elastic cube: Hooke's law, and Coulomb's.
#include <firn/rigid_body.hpp>

#include "case.hpp"

#include <array>
#include <deque>
#include <numbers>

using namespace firn;
using namespace verification;

namespace {

using Point = Vec<double, 2>;
using Finger = RigidBody<Collider<Box<double, 2>>>;
using Hand = GapContact<Together<Finger, Finger>>;

constexpr double side = 0.16, density = 1000, young = 1e5, g = 9.81, weight = density * side * side * g,
                 thickness = 0.06;  // of fingers [m]

struct Grip {
    int cells = 16;        ///< of the side of the cube
    double poisson = 0;    ///< ν
    double friction = 0;   ///< μ
    double height = 0.24;  ///< of fingers [m]
    double offset = 0;     ///< of cube and fingers from the planes of nodes [h]
    double finger = 500;   ///< density of fingers [kg/m³]
};

/// A cube between two fingers, which touch it, without force.
struct Gripper {
    Grip grip;
    double h;
    SimulationWith<2, FixedCorotated<double>, Hand> simulation;
    Point centre;

    explicit Gripper(const Grip& of)
        : grip(of),
          h(side / of.cells),
          simulation({{0, 0}, {0.64, 0.64}, h}, FixedCorotated<double>::from_young_poisson(young, of.poisson),
                     Coloured{1}, Hand{Together(finger(-1), finger(1))}),
          centre(centre_of(of)) {
        const Point half = Point::filled(side / 2);
        simulation.add(sample_box<2>(centre - half, centre + half, {.spacing = h / 2}), density);
        simulation.gravity = Point::zero();
        simulation.reactions.emplace();
        simulation.warn = {};
        simulation.fixed_time_step = 0.5 * simulation.stable_time_step();
    }
    static Point centre_of(const Grip& of) { return Point::filled(0.32 + of.offset * side / of.cells); }
    Finger finger(int sign) const {
        const double half = thickness / 2;
        Collider<Box<double, 2>> box{.shape = {{half, grip.height / 2}}, .friction = grip.friction};
        box.position = centre_of(grip) + Point{sign * (side / 2 + half), 0.0};
        Finger made(box, grip.finger);
        made.drive.keep(1, 0).keep(2, 0);
        return made;
    }
    Finger& left() { return std::get<0>(simulation.boundary.boundary.parts); }
    Finger& right() { return std::get<1>(simulation.boundary.boundary.parts); }
    /// Lets both fingers press with this force [N/m].
    void press(double force) {
        left().drive.keep(0, 0.1, force);
        right().drive.keep(0, -0.1, force);
    }
    /// What a finger presses with [N/m].
    double pressed(int k) const {
        return (k == 0 ? 1 : -1) * simulation.reactions->parts[std::size_t(k)].impulse[0] / simulation.last_time_step();
    }
    /// How much the middle half of the cube is shortened [1].
    double strain() const {
        double sum = 0;
        int count = 0;
        for_particles(simulation, [&](std::size_t slot) {
            const Point from = simulation.particles().exact_position(slot) - centre;
            if (std::abs(from[0]) > side / 4) return;
            sum += 1 - simulation.particles().state(slot).F(0, 0), ++count;
        });
        return sum / count;
    }
    /// What is between the faces of the fingers [m].
    double between() { return right().collider.position[0] - left().collider.position[0] - thickness; }
};

/// From 0 to 1 as t goes from 0 to 1, without a jerk.
double rise(double t) { return 0.5 - 0.5 * std::cos(std::numbers::pi * std::clamp(t, 0.0, 1.0)); }

/// The value that is farthest from 1.
double worst_of(std::initializer_list<double> values) {
    double worst = 1;
    for (const double value : values)
        if (!(std::abs(value - 1) <= std::abs(worst - 1))) worst = value;
    return worst;
}

struct Squeezed {
    double strain = 0;                    ///< over F / (E A) [1]
    double gap = 0;                       ///< between a finger and the face that the strain leaves [h]
    std::array<double, 2> presses{0, 0};  ///< over F [1]
    Curve curve;
};
/// Presses the cube slowly by the force that shortens it by a part of `most`, and takes means while it rests.
Squeezed squeeze(const Grip& grip, double most) {
    Gripper gripper(grip);
    auto& simulation = gripper.simulation;
    const double force = young * side * most, duration = 1, rest = 0.2;
    Squeezed out{.curve = {formatted("h = L/%d", grip.cells)}};
    double time = 0;
    while (simulation.time() < duration + rest) {
        gripper.press(force * rise(simulation.time() / duration));
        simulation.step();
        if (simulation.steps() % 40 == 0)
            out.curve.add(gripper.strain(), 0.5 * (gripper.pressed(0) + gripper.pressed(1)) / (young * side));
        if (simulation.time() < duration) continue;
        const double dt = simulation.last_time_step();
        time += dt;
        out.strain += dt * gripper.strain() / most;
        out.gap += dt * (gripper.between() - side * (1 - most)) / (2 * gripper.h);
        for (const int k : {0, 1}) out.presses[std::size_t(k)] += dt * gripper.pressed(k) / force;
    }
    for (double* sum : {&out.strain, &out.gap, &out.presses[0], &out.presses[1]}) *sum /= time;
    std::printf("h = L/%d, off by %g h: E ε A/F %.5f, gap %.4f h, forces over F %.6f %.6f\n", grip.cells, grip.offset,
                out.strain, out.gap, out.presses[0], out.presses[1]);
    std::fflush(stdout);
    return out;
}

struct Slipped {
    std::array<double, 2> at{0, 0};  ///< force of each finger when the cube slips, over weight / (2 μ) [1]
    double sunk = 0;                 ///< by then, from when the force began to fall [h]
    Curve curve;
};
constexpr double falls = 0.05;  ///< part of weight / (2 μ) by which the force falls in a second

/// Lets the cube hang between the fingers, and lowers their force until it slips. \param first  force at the start,
/// over weight / (2 μ)
Slipped lower(const Grip& grip, double first, const std::string& label) {
    Gripper gripper(grip);
    auto& simulation = gripper.simulation;
    const double needed = weight / (2 * grip.friction), raising = 1, rest = 0.3, window = 0.02;
    Slipped out{.curve = {label}};
    struct Now {
        double time;
        std::array<double, 2> pressed;
    };
    std::deque<Now> last;
    double from = 0, part = first;
    for (bool slips = false; !slips && part > 0;) {
        const double up = rise(simulation.time() / raising);
        part = first - falls * std::max(0.0, simulation.time() - raising - rest);
        simulation.gravity = {0, -g * up};
        gripper.press(needed * up * std::max(part, 0.0));
        simulation.step();
        last.push_back({simulation.time(), {gripper.pressed(0), gripper.pressed(1)}});
        while (last.front().time < simulation.time() - window) last.pop_front();
        const auto totals = simulation.totals();
        const double height = totals.first_moment[1] / totals.mass, sinks = -totals.momentum[1] / totals.mass;
        if (simulation.time() < raising + rest) {
            from = height;
            continue;
        }
        slips = sinks > 0.5 * gripper.h;
        out.sunk = (from - height) / gripper.h;
        if (slips || simulation.steps() % 40 == 0) out.curve.add(part, sinks / gripper.h);
    }
    for (const Now& now : last)
        for (std::size_t k = 0; k < 2; ++k) out.at[k] += now.pressed[k] / (needed * double(last.size()));
    std::printf("h = L/%d, off by %g h, μ = %g, fingers of %g m and %g kg/m³: slips at %.5f %.5f, has sunk by %.3f h\n",
                grip.cells, grip.offset, grip.friction, grip.height, grip.finger, out.at[0], out.at[1], out.sunk);
    std::fflush(stdout);
    return out;
}

/// Lets the cube fall between fixed boxes of 0.1 m without friction, for 0.1 s. \param beside  gap between each and the
/// cube [h];  \return  by how much it falls [h]
double fallen_past_edges(double beside) {
    Gripper gripper({.height = 0.1});
    auto& simulation = gripper.simulation;
    const auto middle = [&] { return simulation.totals().first_moment[1] / simulation.totals().mass; };
    const double from = middle();
    gripper.left().collider.position[0] -= beside * gripper.h;
    gripper.right().collider.position[0] += beside * gripper.h;
    for (Finger* finger : {&gripper.left(), &gripper.right()}) finger->drive.keep(0, 0);
    simulation.gravity = {0, -g};
    simulation.advance(0.1);
    return (from - middle()) / gripper.h;
}

void check_squeeze(Case& report) {
    constexpr double most = 0.05;
    Plot& plot = report.plot({"strain", "Squeezed without friction", "strain ε [1]", "F / (E A) [1]"});
    double gap = 0, force = 1;
    for (const int cells : report.quick() ? std::vector{8} : std::vector{8, 16, 32}) {
        const Squeezed on = squeeze({.cells = cells}, most), off = squeeze({.cells = cells, .offset = 0.3}, most);
        report.check({formatted("E ε A over F, h = L/%d", cells), worst_of({on.strain, off.strain}), 1, 0.03,
                      "Hooke's law, P = E ε for ν = 0; our aim: 3 %"});
        for (const Squeezed& one : {on, off}) {
            gap = std::max(gap, std::abs(one.gap));
            force = worst_of({force, one.presses[0], one.presses[1]});
        }
        plot.curves.push_back(off.curve);
    }
    plot.curves.push_back({"F = E ε A", {0, most}, {0, most}, Curve::Kind::reference});
    report.check({"force of the fingers on the cube over F, all h", force, 1, 1e-3,
                  "a finger at rest passes on the force of its drive"});
    report.at_most("distance of a finger from where Hooke's law puts it, all h [h]", gap, 0.05,
                   "our aim: a twentieth of a cell, as between blocks that meet");
}

void check_slip(Case& report) {
    constexpr double first = 1.25;
    const Grip usual{.cells = report.quick() ? 8 : 16, .poisson = 0.3, .friction = 0.3}, rough{usual.cells, 0.3, 0.6};
    Plot& plot = report.plot({"slip", formatted("Force of the fingers lowered, h = L/%d", usual.cells),
                              "μ N of a finger, over half the weight [1]", "velocity downwards [cells/s]"});
    const auto check = [&](Grip grip, const std::string& of) {
        const std::string label = formatted("μ = %g", grip.friction) + of;
        const Slipped on = lower(grip, first, label);
        grip.offset = 0.3;
        const Slipped off = lower(grip, first, label);
        const char* const sides[] = {"left", "right"};
        for (std::size_t k = 0; k < 2; ++k)
            report.check({sentence("μ N of the ", sides[k], " finger over half the weight as the cube slips, h = L/",
                                   grip.cells, ", ", label),
                          worst_of({on.at[k], off.at[k]}), 1, 0.03, "Coulomb's law; our aim: 3 %"});
        if (grip.cells == usual.cells) plot.curves.push_back(off.curve);
        return std::max(on.sunk, off.sunk);
    };
    double sunk = check(usual, "");
    sunk = std::max(sunk, check(rough, ""));
    Grip light = rough;
    light.finger = 1;
    sunk = std::max(sunk, check(light, ", fingers of 1 kg/m³"));
    if (report.quick()) return;
    const Grip coarse{8, 0.3, 0.6};
    sunk = std::max(sunk, check(coarse, ""));
    const double h = side / usual.cells;
    Curve slides{"slides by Coulomb's law", {}, {}, Curve::Kind::reference};
    for (double part = first; part > 0.99; part -= 0.0005) {
        const double missing = std::max(0.0, 1 - part), v = g * missing * missing / (2 * falls * h);
        if (v < 0.5) slides.add(part, v);
    }
    plot.curves.push_back(slides);
    report.remark(
        formatted("As the force falls, the cube creeps, by %.2f h at most until it slips. From rest, the velocity of "
                  "0.5 cells a second is reached when μ N has fallen to %.4f of half the weight, as 1 − √(h r/g) says.",
                  sunk, 1 - std::sqrt(h * falls / g)));
    std::string caught;
    for (const double gap : {0.0, 0.25, 0.5, 1.0})
        caught += formatted("%s%.2f cells (beside it by %g h)", gap == 0 ? "" : ", ", fallen_past_edges(gap), gap);
    report.remark(
        "Matter does not catch at the edges of boxes: a cube between two fixed boxes of 0.1 m, without friction, falls "
        "freely. In the time of a fall by 4.9 cells it falls by " +
        caught + ".");
}

}  // namespace

int main(int argc, char** argv) {
    Case report(
        argc, argv, "Gripper: rigid fingers under force",
        "Two rigid fingers with drives press a cube from two sides, in plane strain: L = 0.16 m, E = 100 kPa, "
        "ρ = 1000 kg/m³, fixed corotated, 2 × 2 particles a cell, double; fingers of 500 kg/m³ and 0.24 m, with "
        "GapContact. First without weight and friction, ν = 0: the force F of each drive rises to 0.05 E A in 1 "
        "s, and the middle half of the cube must have the strain ε = F/(E A). Then the cube hangs between the "
        "fingers by friction, ν = 0.3. From 1.25 times what is needed, the force N falls, by r = 5 % a second. "
        "The cube must slip (0.5 cells a second, downwards) when μ N of each finger, by the reactions, is half "
        "the weight. Cube and fingers lie on planes of nodes, and 0.3 h off; the worse is reported.");
    check_squeeze(report);
    check_slip(report);
    return report.finish();
}
