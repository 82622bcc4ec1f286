/// \file Rigid bodies in water: how deep a box floats, and how fast a disc rises or sinks.
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
template <class S, class Shape, class Transfer>
using Tank =
    SimulationWith<2, Fluid<S>, VolumeFilter, Transfer, GapContact<Together<Walls<S, 2>, RigidBody<Collider<Shape>>>>>;

constexpr double density = 1000, g = 9.81;

std::string short_text(double number) { return formatted("%g", number); }

/// Slip walls that mirror the water.
template <class S>
Walls<S, 2> walls_of(const Domain<2>& domain) {
    auto walls = Walls<S, 2>::all(cast<S>(domain.lower), cast<S>(domain.upper), {Contact::slip, 0});
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
    Tank<double, Box<double, 2>, Apic> tank(domain, Fluid<double>::from_properties({.bulk = 5e6}), Coloured{},
                                            GapContact{Together(walls_of<double>(domain), body)});
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

struct Rise {
    Curve speed;          ///< over that of potential flow, over the way [R]
    double acceleration;  ///< mean over the first 0.2 R, over that of potential flow
};

/// A disc of R cells, in the middle of a tank of 16 R, is let go in water at rest.
template <class Transfer>
Rise release(double ratio, int cells, double layer, const std::string& label) {
    using S = float;
    const double R = 0.12, width = 16 * R, h = R / cells, sound = 100;
    const Domain<2> domain{{0, 0}, {width, width + 8 * h}, h};
    Collider<Sphere<S, 2>> disc{.shape = {S(R)}, .thickness_in_cells = layer};
    disc.position = Point::filled(width / 2);
    const RigidBody body(disc, ratio * density);
    const auto model = Fluid<S>::from_properties({.bulk = density * sound * sound});
    Tank<S, Sphere<S, 2>, Transfer> tank(domain, model, Coloured{}, GapContact{Together(walls_of<S>(domain), body)});
    tank.warn = {};
    auto water = sample_box<2>({0, 0}, {width, width}, {.spacing = h / 2});
    std::erase_if(water.positions, [&](const Point& x) { return norm(x - disc.position) < R; });
    const auto all = tank.add(water, density);
    std::size_t i = 0;
    tank.set_states(all, [&](const auto&, auto& state) {
        const double pressure = density * g * (width - water.positions[i++][1]), gamma = 7;
        state.J = S(std::pow(1 + gamma * pressure / (density * sound * sound), -1 / gamma));
    });
    const double expected = g * (1 - ratio) / (1 + ratio);
    const auto& now = std::get<1>(tank.boundary.boundary.parts);
    const auto way = [&] { return (now.collider.position[1] - disc.position[1]) / R; };
    Rise out{Curve{label}, 0};
    for (int n = 0; std::abs(way()) < 0.2 && tank.time() < 1; ++n) {
        tank.step();
        if (n % 20 == 0 && tank.time() > 0.01)
            out.speed.add(std::abs(way()), now.velocity()[1] / (expected * tank.time()));
    }
    out.acceleration = now.velocity()[1] / (expected * tank.time());
    return out;
}

}  // namespace

int main(int argc, char** argv) {
    Case report(argc, argv, "Rigid bodies in water",
                "A square box, 24 cells high, floats in a tank of water: K = 5 MPa, h = 1/32 m, APIC, VolumeFilter, "
                "mirrored walls. It displaces its weight (Archimedes), where the water that it displaces raises the "
                "level. Its draught is the mean of the last half of the run. A disc, R = 12 cells, is let go in the "
                "middle of a tank of 16 R: in potential flow it moves with g (ρ_w − ρ)/(ρ_w + ρ), as its added mass is "
                "that of the water that it displaces (Lamb, Hydrodynamics, §68).");
    const bool quick = report.quick();
    Plot& draught = report.plot({"draught", "Draught over that of Archimedes", "t [s]", ""});
    for (const double ratio : quick ? std::vector{0.5} : std::vector{0.25, 0.5, 0.75}) {
        const Float box = float_box(ratio, "density " + short_text(ratio), quick);
        draught.curves.push_back(box.draught);
        report.check({"draught of a box of density " + short_text(ratio) + " over Archimedes'", box.mean, 1, 0.02,
                      "Archimedes' principle; our aim: 2 %"});
    }
    if (quick) return report.finish();
    Plot& speed = report.plot({"speed", "Speed of a disc over that of potential flow", "way / R", ""});
    std::string text =
        "The disc is held back by the water that moves with it. Its mean acceleration over 0.2 R, over that "
        "of potential flow (our aim was 5 %): ";
    const auto add = [&](const Rise& rise) {
        speed.curves.push_back(rise.speed);
        text += rise.speed.label + ", " + percent(rise.acceleration) + "; ";
    };
    add(release<Aflip<float>>(0.5, 12, 1.5, "density 0.5, layer of 1.5 cells"));
    for (const double ratio : {2.0, 0.5, 0.1, 0.01})
        add(release<Aflip<float>>(ratio, 12, 0.5, "density " + short_text(ratio) + ", layer of 0.5 cells"));
    add(release<Apic>(0.5, 12, 0.5, "density 0.5, layer of 0.5 cells, APIC"));
    add(release<Aflip<float>>(0.5, 24, 0.5, "density 0.5, layer of 0.5 cells, R = 24 cells"));
    report.remark(
        text +
        "the rest with AFLIP and R = 12 cells. All nodes within the layer get the disc's velocity along its "
        "normal, and as the water keeps its volume, it then moves with the disc: a ring as wide as the layer, "
        "a, is added to the disc, and the added mass is that of a disc of R + a. So with R = 12 cells and a "
        "layer of 1.5 cells, 74 % is expected, with 0.5 cells 90 %.");
    return report.finish();
}
