/// \file How deep a rigid box floats in water.
#include <firn/rigid_body.hpp>

#include "case.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

using namespace firn;
using namespace verification;

namespace {

using Point = Vec<double, 2>;
using Tank = SimulationWith<2, Fluid<double>, VolumeFilter,
                            GapContact<Together<Walls<double, 2>, RigidBody<Collider<Box<double, 2>>>>>>;

constexpr double density = 1000, g = 9.81;

std::string short_text(double number) { return formatted("%g", number); }

/// Slip walls that mirror the water.
Walls<double, 2> walls_of(const Domain<2>& domain) {
    auto walls = Walls<double, 2>::all(domain.lower, domain.upper, {Contact::slip, 0});
    walls.nodes_behind = NodesBehind::mirrored;
    return walls;
}

struct Float {
    Curve draught;  ///< over the time [s], over what Archimedes says
    double mean;    ///< of the last half
};

/// A square box of 24 cells floats upright in a tank four times as wide.
/// \param ratio  its density over that of water
Float float_box(double ratio, const std::string& label, bool quick) {
    const double h = 1.0 / 32, width = 96 * h, depth = 48 * h, side = 24 * h;
    const Domain<2> domain{{0, 0}, {width, 80 * h}, h};
    Collider<Box<double, 2>> box{.shape = {{side / 2, side / 2}}};
    box.position = {width / 2, depth - ratio * side + side / 2};
    RigidBody body(box, ratio * density);
    // Critical damping of the heave without added mass is 1; the box comes to rest where it would without.
    body.drive.hold(1, 0, 0.6 * std::sqrt(body.mass * density * g * side)).keep(0, 0).keep_upright();
    Tank tank(domain, Fluid<double>::from_properties({.bulk = 5e6}), Coloured{},
              GapContact{Together(walls_of(domain), body)});
    tank.warn = {};
    auto water = sample_box<2>({0, 0}, {width, depth}, {.spacing = h / (quick ? 2 : 3)});
    std::erase_if(water.positions, [&](const Point& x) {
        return std::abs(x[0] - box.position[0]) < side / 2 && x[1] > box.position[1] - side / 2;
    });
    tank.add(water, density);
    const double volume = double(water.positions.size()) * water.volume;
    const auto& now = std::get<1>(tank.boundary.boundary.parts);
    Float out{Curve{label}, 0};
    const double end = quick ? 2 : 4;
    double weight = 0;
    for (int i = 0; tank.time() < end; ++i) {
        // Gravity grows smoothly, so that no sound is left in the water.
        const double part = std::min(tank.time(), 1.0);
        tank.gravity = {0, -g * part * part * (3 - 2 * part)};
        tank.step();
        // The level of the water, with the part that the box displaces.
        const double bottom = now.collider.position[1] - side / 2, level = (volume - side * bottom) / (width - side);
        const double draught = (level - bottom) / (ratio * side);
        if (i % 20 == 0) out.draught.add(tank.time(), draught);
        if (tank.time() < end / 2) continue;
        out.mean += tank.last_time_step() * draught;
        weight += tank.last_time_step();
    }
    out.mean /= weight;
    return out;
}

}  // namespace

int main(int argc, char** argv) {
    Case report(argc, argv, "Rigid bodies in water",
                "A square box, 24 cells high, floats in a tank of water: K = 5 MPa, h = 1/32 m, APIC, VolumeFilter, "
                "mirrored walls. It displaces its weight (Archimedes), where the water that it displaces raises the "
                "level. Its draught is the mean of the last half of the run.");
    const bool quick = report.quick();
    Plot& draught = report.plot({"draught", "Draught over that of Archimedes", "t [s]", ""});
    for (const double ratio : quick ? std::vector{0.5} : std::vector{0.25, 0.5, 0.75}) {
        const Float box = float_box(ratio, "density " + short_text(ratio), quick);
        draught.curves.push_back(box.draught);
        report.check({"draught of a box of density " + short_text(ratio) + " over Archimedes'", box.mean, 1, 0.02,
                      "Archimedes' principle; our aim: 2 %"});
    }
    return report.finish();
}
