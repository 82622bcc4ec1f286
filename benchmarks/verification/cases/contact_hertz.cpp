/// \file Contact between groups against Hertz: two cylinders, a ball on a block, a ball on a stiff floor.
#include "scenes/contact_hertz.hpp"

#include "case.hpp"

#include <algorithm>

using namespace firn;
using namespace verification;

namespace {

struct Cylinders {
    bool pressed = false;
    double load = 0, balance = 0;  ///< P′ [N/m]; |force between the groups − force on the plates|/P′
    double b = 0, highest = 0;     ///< of the fitted ellipse, over Hertz
    Curve pressure;                ///< of particles, over p₀ of Hertz, at x/R
};

Cylinders press(const HertzVariant& variant) {
    PressedCylinders scene(variant);
    Cylinders out;
    out.pressure = {formatted("h = R/%d", variant.cells), {}, {}, Curve::Kind::particles};
    out.pressed = scene.press();
    if (!out.pressed) return out;
    out.load = scene.load;
    out.balance = std::abs(scene.contact_force / scene.load - 1);
    std::vector<double> x, p;
    scene.pressures(x, p);
    const double b = PressedCylinders::half_width(out.load), highest = PressedCylinders::highest_pressure(out.load);
    const auto ellipse = PressureEllipse::fitted(x, p, b);
    out.b = ellipse.b / b;
    out.highest = ellipse.highest / highest;
    for (std::size_t i = 0; i < x.size(); ++i) out.pressure.add(x[i] / PressedCylinders::radius, p[i] / highest);
    return out;
}

struct Ball {
    double force = 0, balance = 0;  ///< over Hertz; |force between the groups − force on the plate|/force
    double of_plate = 0;            ///< force over Hertz, if the way of the plate is taken for the approach
    double farther = 0;             ///< (approach of far points − way of the plate)/way
    Curve on_the_way;               ///< force over that of Hertz at the end, at way/R
    Curve hertz;                    ///< the same by Hertz
};

Ball press(const HertzVariant& variant, double stiffness, double height) {
    PressedBall scene(variant, stiffness, height);
    scene.press();
    Ball out;
    const double force = variant.groups ? scene.force : scene.on_plate, beyond = scene.beyond(force);
    out.force = force / scene.hertz(scene.approach + beyond);
    out.of_plate = force / scene.hertz(scene.approach);
    out.balance = std::abs(scene.on_plate / scene.force - 1);
    out.farther = beyond / scene.approach;
    out.on_the_way = {formatted("h = R/%d", variant.cells)};
    out.hertz = {"Hertz", {}, {}, Curve::Kind::reference};
    const double end = scene.hertz(scene.approach + beyond);
    for (std::size_t i = 0; i < scene.approaches.size(); ++i)
        out.on_the_way.add(scene.approaches[i] / PressedBall::radius, scene.forces[i] / end);
    for (int i = 0; i <= 60; ++i) {
        const double far = (scene.approach + beyond) * i / 60, at = scene.hertz(far);
        out.hertz.add((far - scene.beyond(at)) / PressedBall::radius, at / end);
    }
    return out;
}

/// Where a straight line through values at cells of size h, fitted by least squares, meets h = 0.
double at_zero(const Curve& of) {
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (std::size_t i = 0; i < of.x.size(); ++i) {
        n += 1, sx += of.x[i], sy += of.y[i];
        sxx += of.x[i] * of.x[i], sxy += of.x[i] * of.y[i];
    }
    return (sy * sxx - sx * sxy) / (n * sxx - sx * sx);
}

Curve errors_of(const std::string& label, const Curve& ratios) {
    Curve errors{label};
    for (std::size_t i = 0; i < ratios.x.size(); ++i)
        errors.add(1 / ratios.x[i], std::max(std::abs(ratios.y[i] - 1), 1e-4));
    return errors;
}

}  // namespace

int main(int argc, char** argv) {
    Case report(
        argc, argv, "Hertz's contact between bodies",
        "Round elastic bodies (E = 1e6 Pa, ν = 0.3, fixed corotated) of two contact groups are pressed together "
        "without friction, slowly, with damping, until they rest (APIC, 2 particles a cell and axis). Two equal "
        "cylinders in plane strain are pressed until b = 0.15 R by Hertz: b = √(4 P′ R*/(π E*)), p₀ = 2 P′/(π b). "
        "P′ is the force on the plates. b and p₀ are those of the ellipse that fits the pressures of the "
        "particles in the cell next to the surface (two layers of particles) best, by least squares. A ball is pressed "
        "into a block of its own material, and onto a floor that is a block 100 times as stiff, by R/16; a = R/4. "
        "F = 4/3 E* √R d^1.5 (Johnson 1985, §4). d is the approach of points that are far from the contact. "
        "It is that of the ball's middle plane and the block's base, and a part more that follows from linear "
        "elasticity: the ball is pressed at both poles (Legendre series), the block is a layer between planes of "
        "symmetry (Fourier series).");
    const bool quick = report.quick();
    const std::vector<int> cells = quick ? std::vector<int>{20, 40} : std::vector<int>{20, 40, 80};
    const std::string hertz = "Hertz; Johnson 1985, §4.2";

    Plot& profile = report.plot({"profile", "Cylinders: pressure beside the surface", "x / R", "p / p₀"});
    Curve widths{"b"}, pressures{"p₀"};
    for (const int each : cells) {
        const Cylinders one = press(HertzVariant{.cells = each});
        const std::string size = formatted(", R = %d h", each);
        profile.curves.push_back(one.pressure);
        widths.add(1.0 / each, one.b);
        pressures.add(1.0 / each, one.highest);
        report.at_most("cylinders: force between the groups against that on the plates" + size, one.balance, 0.01,
                       "equilibrium; the load is held to 0.2 %");
        if (each == cells.back()) {
            report.check({"cylinders: b over Hertz" + size, one.b, 1, 0.06, hertz});
            report.check({"cylinders: p₀ over Hertz" + size, one.highest, 1, 0.06, hertz});
        }
    }
    if (!quick) {
        const std::string finite = hertz + ", and finite elements for these strains; a straight line through all sizes";
        report.check({"cylinders: b over Hertz, extrapolated to h = 0", at_zero(widths), 0.989, 0.03, finite});
        report.check({"cylinders: p₀ over Hertz, extrapolated to h = 0", at_zero(pressures), 1.011, 0.03, finite});
    }
    std::string list;
    for (std::size_t i = 0; i < cells.size(); ++i)
        list += formatted("%s%.3f and %.3f with R = %d h", i ? "; " : "", widths.y[i], pressures.y[i], cells[i]);
    report.remark("Cylinders: b and p₀ over Hertz are " + list + ".");
    const int middle = quick ? 20 : 40;
    const Cylinders on_nodes = press({.cells = middle, .offset = 0}), between = press({.cells = middle, .offset = 0.5}),
                    clipped = press({.cells = middle, .lattice = true}),
                    shared = press({.cells = middle, .groups = false});
    report.remark(
        formatted("With R = %d h, b and p₀ over Hertz are %.3f and %.3f if the plane of contact lies on nodes, "
                  "%.3f and %.3f if it lies in the middle between nodes (above: a quarter of a cell beside "
                  "nodes).",
                  middle, on_nodes.b, on_nodes.highest, between.b, between.highest));
    report.remark(
        formatted("Particles lie on shells, the outermost half a spacing below the surface, and have volumes "
                  "of their own. With a lattice that is clipped to the disks, %s; the steps of its surface are "
                  "half a cell high.",
                  clipped.pressed ? formatted("b and p₀ are %.3f and %.3f of Hertz", clipped.b, clipped.highest).c_str()
                                  : "the load is not reached"));
    shared.pressed ? report.remark(formatted("Without groups, b and p₀ are %.3f and %.3f of Hertz with R = %d h.",
                                             shared.b, shared.highest, middle))
                   : report.remark("Without groups, the load is not reached.");
    if (shared.pressed) {
        profile.curves.push_back(shared.pressure);
        profile.curves.back().label = formatted("h = R/%d, without groups", middle);
    }
    Curve ellipse{"Hertz", {}, {}, Curve::Kind::reference};
    const PressureEllipse exact{PressedCylinders::wanted, 1};
    for (int i = 0; i <= 200; ++i) ellipse.add(0.0015 * i, exact(0.0015 * i));
    profile.curves.push_back(ellipse);

    Plot& errors = report.plot({"errors", "Error against Hertz", "R / h", "error", true});
    errors.curves.push_back(errors_of("cylinders, b", widths));
    errors.curves.push_back(errors_of("cylinders, p₀", pressures));

    // A line through two sizes that are close to each other would multiply their errors when it is extrapolated.
    const std::vector<int> sizes = quick ? std::vector<int>{8, 16} : std::vector<int>{8, 16, 24};
    struct Under {
        const char *name, *plot, *title;
        double stiffness, height;
    };
    for (const Under& under : {Under{"ball on a block", "block", "Ball on a block of its own material", 1, 1},
                               Under{"ball on a floor", "floor", "Ball on a floor, 100 times as stiff", 100, 0.5}}) {
        Plot& force =
            report.plot({under.plot, under.title, "approach of the ball's middle plane / R", "F / F at the end"});
        Curve ratios{under.name};
        const std::string name = under.name;
        Ball last;
        std::string each_force;
        for (const int each : sizes) {
            last = press(HertzVariant{.cells = each}, under.stiffness, under.height);
            force.curves.push_back(last.on_the_way);
            ratios.add(1.0 / each, last.force);
            each_force += formatted("%s%.3f with R = %d h", each_force.empty() ? "" : ", ", last.force, each);
            report.at_most(
                name + ": force between the groups against that on the plate" + formatted(", R = %d h", each),
                last.balance, 0.02, "equilibrium; a few thousandths of the motion are left");
        }
        force.curves.push_back(last.hertz);
        const double limit = at_zero(ratios);
        report.check({name + ": force over Hertz, extrapolated to h = 0", limit, 1, 0.05,
                      "Hertz; Johnson 1985, §4.2; a straight line through all sizes"});
        errors.curves.push_back(errors_of(name, ratios));
        const Ball shared_ball = press({.cells = sizes.front(), .groups = false}, under.stiffness, under.height);
        report.remark(formatted(
            "A %s: the force is %s, of Hertz. Without groups it is %.3f with R = %d h. Far points "
            "approach each other by %.1f %% more than the middle plane and the base; without this, "
            "the force at the finest size would be %.3f of Hertz.",
            under.name, each_force.c_str(), shared_ball.force, sizes.front(), 100 * last.farther, last.of_plate));
    }
    report.remark(
        "Hertz's theory is one of small strains and small b/R. Here p₀ is 0.08 E for the cylinders, 0.09 E for the "
        "ball on "
        "the block and 0.17 E for that on the floor. An independent finite-element solution with the same material "
        "gives "
        "0.989 b and 1.011 p₀ of Hertz for the cylinders at b = 0.15 R.");
    return report.finish();
}
