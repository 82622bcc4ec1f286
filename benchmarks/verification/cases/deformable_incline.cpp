/// \file A disk and a block on an incline that is elastic, too.
#include "scenes/deformable_incline.hpp"

#include "case.hpp"

using namespace firn;
using namespace verification;

namespace {

constexpr double radius = 0.25;  // of the disk [m]

template <class Transfer = Apic>
Descent roll(const DescentOptions& options, bool lattice = false, const Transfer& transfer = {}) {
    const Vec<double, 2> centre{1.5 * radius, radius};
    const auto disk = lattice ? sample_sphere<2>(centre, radius, {.spacing = options.h / 2})
                              : concentric_disk(centre, radius, options.h / 2);
    Incline<Transfer> incline(options, disk, 7 * radius, 2.25 * radius, transfer);
    return incline.run(4 * radius, 2);
}

template <class Transfer = Apic>
Descent slide(const DescentOptions& options, double duration, const Transfer& transfer = {}) {
    Incline<Transfer> incline(options, sample_box<2>({0.2, 0.0}, {0.5, 0.1}, {.spacing = options.h / 2}), 1.4, 0.3,
                              transfer);
    return incline.run(10, duration);
}

Curve every(const Descent& run, const std::vector<double>& of, const std::string& label, std::size_t step) {
    Curve curve{label};
    for (std::size_t i = 0; i < run.time.size(); i += step) curve.add(run.time[i], of[i]);
    return curve;
}

/// The line with a slope that ends where the run ends.
Curve line(const Descent& run, const std::vector<double>& of, double slope, const std::string& label) {
    Curve curve{label, {}, {}, Curve::Kind::reference};
    for (const double share : {0.0, 1.0}) {
        const double t = run.time.back() * (0.5 + 0.5 * share);
        curve.add(t, of.back() + slope * (t - run.time.back()));
    }
    return curve;
}

struct Rates {
    double acceleration, spin;  ///< [m/s²], [rad/s²]
};
/// Of a rigid disk.
Rates rigid_disk(const DescentOptions& options) {
    const double down = gravity_on_earth * std::sin(options.slope), normal = gravity_on_earth * std::cos(options.slope);
    if (std::tan(options.slope) <= 3 * options.friction) return {2 * down / 3, 2 * down / 3 / radius};
    return {down - options.friction * normal, 2 * options.friction * normal / radius};
}

std::string found(const Descent& run, const Rates& rigid) {
    return percent(run.rate(run.speed, 2 * radius) / rigid.acceleration - 1) + " in the acceleration and " +
           percent(run.rate(run.spin, 2 * radius) / rigid.spin - 1) + " in the angular acceleration";
}

void disks(Case& report) {
    Plot& ways = report.plot({"disk_way", "Disk: way of the centre of mass", "t [s]", "x [m]"});
    Plot& speeds = report.plot({"disk_speed", "Disk: velocity of the centre; rigid: slope", "t [s]", "v [m/s]"});
    Plot& spins = report.plot({"disk_spin", "Disk: velocity of the rim; rigid: slope", "t [s]", "ω R [m/s]"});
    std::vector<double> frictions{0.1, 0.5};
    if (!report.quick()) frictions = {0.1, 0.3, 0.5};
    bool labelled = false;
    for (const double friction : frictions) {
        const DescentOptions options{.friction = friction, .ramp = 0.2};
        const Rates rigid = rigid_disk(options);
        const bool rolls = std::tan(options.slope) <= 3 * friction;
        const Descent run = roll(options);
        std::vector<double> rim = run.spin;
        for (double& of : rim) of *= radius;
        const std::string label = formatted("μ = %.1f, ", friction) + (rolls ? "rolls" : "slides");
        ways.curves.push_back(every(run, run.way, label, 20));
        speeds.curves.push_back(every(run, run.speed, label, 20));
        spins.curves.push_back(every(run, rim, label, 20));
        speeds.curves.push_back(line(run, run.speed, rigid.acceleration, labelled ? "" : "rigid"));
        spins.curves.push_back(line(run, rim, rigid.spin * radius, labelled ? "" : "rigid"));
        labelled = true;
        report.check({"disk, acceleration from 2 R to 4 R, " + label + " [m/s²]", run.rate(run.speed, 2 * radius),
                      rigid.acceleration, rolls ? 0.02 : 0.01, "rigid disk; 1 % if it slides, 2 % if it rolls"});
        if (!rolls)
            report.check({"disk, angular acceleration from 2 R to 4 R, " + label + " [rad/s²]",
                          run.rate(run.spin, 2 * radius), rigid.spin, 0.03, "rigid disk: 2 μ g cos θ/R"});
    }
    if (report.quick()) return;
    const DescentOptions slides{.friction = 0.1, .ramp = 0.2};
    DescentOptions together = slides;
    together.groups = false;
    const Descent stuck = roll(together);
    ways.curves.push_back(every(stuck, stuck.way, "without groups", 20));
    report.remark(
        "FLIP with a share of 1, μ = 0.1: errors of " +
        found(roll(slides, false, Flip<double>{.ratio = 1}), rigid_disk(slides)) +
        ". APIC, with a disk whose particles lie on a lattice, so that its rim has steps of up to a quarter of "
        "a cell: " +
        found(roll(slides, true), rigid_disk(slides)) + ".");
    report.remark(formatted("Without contact groups, the disk with μ = 0.1 moves %.3f m in %.2f s.", stuck.way.back(),
                            stuck.time.back()) +
                  " All matter then shares one field of velocities, so μ has no effect.");
    report.remark(
        "The region where disk and slab touch is 1.3 cells wide (Hertz). So the centre of pressure must be "
        "right to a twentieth of a cell if the angular acceleration shall be right to 3 %. Besides, in APIC "
        "the affine fields of the particles carry angular momentum, 0.4 % of the disk's.");
}

void blocks(Case& report) {
    Plot& ways = report.plot({"block_way", "Block: way of the centre of mass", "t [s]", "x [m]"});
    Plot& speeds = report.plot({"block_speed", "Block: velocity of the centre; rigid: from rest", "t [s]", "v [m/s]"});
    std::vector<double> frictions{0.0, 0.3};
    if (!report.quick()) frictions = {0.0, 0.2, 0.3, 0.45};
    const DescentOptions of_block{.young = 1e8, .h = 1.0 / 40};
    bool labelled = false;
    for (const double friction : frictions) {
        DescentOptions options = of_block;
        options.friction = friction;
        const double expected =
            gravity_on_earth * (std::sin(options.slope) - options.friction * std::cos(options.slope));
        const Descent run = slide(options, 0.5);
        const std::string label = formatted("μ = %.2f", friction);
        ways.curves.push_back(every(run, run.way, label, 20));
        speeds.curves.push_back(every(run, run.speed, label, 20));
        Curve way{labelled ? "" : "rigid block", {}, {}, Curve::Kind::reference}, speed = way;
        for (std::size_t i = 0; i < run.time.size(); i += 20) {
            way.add(run.time[i], 0.5 * expected * run.time[i] * run.time[i]);
            speed.add(run.time[i], expected * run.time[i]);
        }
        labelled = true;
        ways.curves.push_back(way);
        speeds.curves.push_back(speed);
        report.at_most("block, acceleration in the second half, " + label + ", relative error",
                       run.error_of_acceleration(expected), 2e-3, "rigid block");
    }
    std::vector<double> held{0.7};
    if (!report.quick()) held = {0.6, 0.7};
    for (const double friction : held) {
        DescentOptions options = of_block;
        options.friction = friction;
        options.ramp = 0.3;
        options.hold = 0.5;
        const Descent run = slide(options, 1.6);
        double before = 0;
        for (std::size_t i = 0; i < run.time.size() && run.time[i] <= 0.6; ++i) before = run.way[i];
        report.at_most(
            formatted("block, slip in 1 s, μ = %.2f, tan θ = 0.577 [h]", friction),
            (run.way.back() - before) / options.h, 0.01,
            "below the angle of friction a block rests; gravity grows in 0.3 s, the block is held for 0.5 s, "
            "and 0.1 s later it counts");
    }
    if (report.quick()) return;
    DescentOptions options = of_block;
    const double expected = gravity_on_earth * (std::sin(options.slope) - options.friction * std::cos(options.slope));
    const double flip = slide(options, 0.5, Flip<double>{.ratio = 1}).error_of_acceleration(expected);
    options.groups = false;
    const Descent stuck = slide(options, 0.5);
    options.groups = true;
    options.friction = 0.7;
    const Descent bounces = slide(options, 1);
    report.remark(
        formatted("FLIP with a share of 1: the relative error of the block's acceleration at μ = 0.3 is %.1e. "
                  "Without contact groups the block with μ = 0.3 moves %.4f m in 0.5 s, for it sticks.",
                  flip, stuck.way.back()));
    report.remark(
        formatted("If gravity sets in at once and the block is not held, the block with μ = 0.7 slips by %.2f "
                  "cells in 1 s.",
                  bounces.way.back() / options.h) +
        " It bounces and rocks at its resonances, and while it is light it slips. The slip feeds the rocking.");
}

}  // namespace

int main(int argc, char** argv) {
    Case report(
        argc, argv, "Disk and block on a deformable incline",
        "An elastic body lies on an elastic slab, 8 cells thick, which is bonded to the floor of the domain; gravity "
        "is "
        "askew by θ = 30°. Body and slab are contact groups with Coulomb friction μ. Disk: R = 0.25 m = 16 cells, E = "
        "1e7 Pa, ρ = 1000 kg/m³, ν = 0.3; its particles lie on circles; gravity grows in 0.2 s, so that the disk does "
        "not bounce. A rigid disk rolls with ⅔ g sin θ if tan θ ≤ 3 μ; else it slides with g (sin θ − μ cos θ) and "
        "turns "
        "with 2 μ g cos θ/R. Rates are fitted over the second half of a way of 4 R. Block: 0.3 × 0.1 m, E = 1e8 Pa, h "
        "= "
        "1/40 m, as on the incline that is rigid; it starts from rest, and a rigid one slides with g (sin θ − μ cos "
        "θ). "
        "After Bardenhagen, Brackbill and Sulsky 2000, \"The material-point method for granular materials\".");
    disks(report);
    blocks(report);
    return report.finish();
}
