/// \file A disc is let go in water: how fast it sinks or rises, and how much of that is buoyancy and added mass.
#include <firn/rigid_body.hpp>

#include "case.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

using namespace firn;
using namespace verification;

namespace {

using Point = Vec<double, 2>;
using S = float;
using Disc = RigidBody<Collider<Sphere<S, 2>>>;
using Tank = SimulationWith<2, Fluid<S>, VolumeFilter, Aflip<S>, GapContact<Together<Walls<S, 2>, Disc>>>;

constexpr double density = 1000, g = 9.81, R = 0.12, width = 16 * R, sound = 100;

/// Added mass of a disc in the middle of the tank, over the mass of the water that it displaces, in potential flow.
/// Walls and the free surface are images of its dipole; those of higher order are below 1e-3.
double added_mass_in_tank() {
    double along = 0;  // velocity of all images at the disc, over U (R/width)²
    constexpr int most = 200;
    for (int n = -most; n <= most; ++n) {
        // A wall turns the sign of an upright dipole across it, the free surface does not.
        const int by_wall = n > 0 ? n / 2 : (1 - n) / 2;
        for (int m = -most; m <= most; ++m)
            if (const double square = double(m) * m + double(n) * n; square > 0)
                along += (by_wall % 2 == 0 ? 1 : -1) * (2.0 * n * n / square - 1) / square;
    }
    return 1 - 2 * along * (R / width) * (R / width);
}

struct Options {
    double ratio = 0.5;  ///< density of the disc over that of water
    int cells = 12;      ///< R over h
    double layer = 0.5;  ///< of the collider [cells]
    bool flow = false;   ///< RigidBody::in_flow
};

Tank filled(const Options& of, bool held) {
    const double h = R / of.cells;
    const Domain<2> domain{{0, 0}, {width, width + 8 * h}, h};
    auto walls = Walls<S, 2>::all(cast<S>(domain.lower), cast<S>(domain.upper), {Contact::slip, 0});
    walls.nodes_behind = NodesBehind::mirrored;
    Collider<Sphere<S, 2>> disc{.shape = {S(R)}, .thickness_in_cells = of.layer};
    disc.position = Point::filled(width / 2);
    Disc body(disc, of.ratio * density);
    body.in_flow = of.flow;
    if (held) body.drive.keep(0, 0).keep(1, 0).keep(2, 0);
    Tank tank(domain, Fluid<S>::from_properties({.bulk = density * sound * sound}), Coloured{},
              GapContact{Together(walls, body)});
    tank.warn = {};
    auto water = sample_box<2>({0, 0}, {width, width}, {.spacing = h / 2});
    std::erase_if(water.positions, [&](const Point& x) { return norm(x - disc.position) < R; });
    const auto all = tank.add(water, density);
    std::size_t i = 0;
    tank.set_states(all, [&](const auto&, auto& state) {
        const double pressure = density * g * (width - water.positions[i++][1]), gamma = 7;
        state.J = S(std::pow(1 + gamma * pressure / (density * sound * sound), -1 / gamma));
    });
    return tank;
}
Disc& disc_of(Tank& tank) { return std::get<1>(tank.boundary.boundary.parts); }

struct Release {
    Curve speed;          ///< over that of potential flow, over the way [R]
    double acceleration;  ///< mean over the first 0.2 R [g]
    double inside;        ///< how far water enters the disc, at the end [cells]
};
/// Lets the disc go, in water at rest.
Release release(const Options& of, const std::string& label) {
    auto tank = filled(of, false);
    const auto& disc = disc_of(tank);
    const double start = disc.collider.position[1], expected = g * (1 - of.ratio) / (1 + of.ratio);
    const auto way = [&] { return std::abs(disc.collider.position[1] - start) / R; };
    Release out{Curve{label}, 0, 0};
    for (int n = 0; way() < 0.2 && tank.time() < 1; ++n) {
        tank.step();
        if (n % 20 == 0 && tank.time() > 0.01) out.speed.add(way(), disc.velocity()[1] / (expected * tank.time()));
    }
    out.acceleration = disc.velocity()[1] / (g * tank.time());
    double nearest = std::numeric_limits<double>::max();
    for_particles(tank, [&](std::size_t slot) {
        nearest = std::min(nearest, norm(tank.particles().exact_position(slot) - disc.collider.position) - R);
    });
    out.inside = std::max(-nearest * of.cells / R, 0.0);
    std::printf("%s: %.4f of potential flow, water %.3f cells inside, %.3f s\n", label.c_str(),
                out.acceleration * g / expected, out.inside, tank.time());
    std::fflush(stdout);
    return out;
}

/// The force on a disc that is held in water at rest, over the weight of the water that it displaces; the mean from
/// 0.04 s to 0.12 s, 8 times what sound takes from the disc to the floor.
double held(const Options& of) {
    auto tank = filled(of, true);
    tank.reactions.emplace();
    double force = 0, time = 0;
    while (tank.time() < 0.12) {
        tank.step();
        if (tank.time() < 0.04) continue;
        force -= tank.reactions->parts[1].impulse[1];
        time += tank.last_time_step();
    }
    return force / (time * density * g * std::numbers::pi * R * R);
}

struct Split {
    double buoyancy, added_mass;  ///< over weight and mass of the water that the disc displaces [1]
};
/// The buoyancy B and the added mass C that fit the accelerations a of all densities r best: a (r + C) = B − r.
Split split_of(const std::vector<double>& ratios, const std::vector<double>& accelerations) {
    double n = 0, sa = 0, saa = 0, sy = 0, say = 0;
    for (std::size_t i = 0; i < ratios.size(); ++i) {
        const double a = accelerations[i], y = ratios[i] * (1 + a);  // B − C a = y
        n += 1, sa += a, saa += a * a, sy += y, say += a * y;
    }
    const double slope = (n * say - sa * sy) / (n * saa - sa * sa);
    return {(sy - slope * sa) / n, -slope};
}

double of_potential_flow(double ratio, double acceleration) { return acceleration * (1 + ratio) / (1 - ratio); }

}  // namespace

int main(int argc, char** argv) {
    const double in_tank = added_mass_in_tank();
    Case report(
        argc, argv, "Disc in a tank",
        "A disc, R = 0.12 m = 12 cells, is let go in water at rest, in the middle of a tank of 16 R: weakly "
        "compressible water with c = 100 m/s, AFLIP, VolumeFilter, mirrored walls, by the gap of particles, with "
        "2 × 2 particles a cell. In potential flow without walls it moves with g (ρ_w − ρ)/(ρ_w + ρ), as its added "
        "mass is that of the water that it displaces (Lamb, Hydrodynamics, §68). The walls and the surface of the tank "
        "raise the added mass to " +
            formatted("%.3f", in_tank) +
            " of this. A layer is Collider::thickness_in_cells. The split: the buoyancy B and the added mass C, over "
            "weight and mass of the water displaced, that fit the mean accelerations over the first 0.2 R of the "
            "densities 2, 0.5, 0.1 and 0.01, a = g (B − ρ/ρ_w)/(C + ρ/ρ_w).");
    const bool quick = report.quick();
    const std::vector<double> all_ratios{2, 0.5, 0.1, 0.01}, few_ratios{2, 0.1};
    const auto in_tank_of = [&](double ratio) { return (1 - ratio) / (in_tank + ratio); };
    const int cells = quick ? 6 : 12;
    const double aim = quick ? 0.1 : 0.05;
    Plot& speed = report.plot({"speed", "Speed over that of potential flow, in_flow", "way / R", ""});
    Plot& means = report.plot({"layers", "Buoyancy and added mass over the layer", "layer [cells]", ""});
    std::vector<double> accelerations;
    for (const double ratio : quick ? few_ratios : all_ratios) {
        const Release one =
            release({.ratio = ratio, .cells = cells, .layer = 0.75, .flow = true}, formatted("density %g", ratio));
        accelerations.push_back(one.acceleration);
        speed.curves.push_back(one.speed);
        report.check({formatted("mean acceleration over 0.2 R, density %g, in_flow, R = %d cells [g]", ratio, cells),
                      one.acceleration, in_tank_of(ratio), aim, "potential flow in the tank; our aim: 5 %"});
    }
    const Split with_flow = split_of(quick ? few_ratios : all_ratios, accelerations);
    const double at_rest = held({.cells = cells, .layer = 0.75, .flow = true});
    report.check({formatted("buoyancy of a disc that is held, in_flow, R = %d cells", cells), at_rest, 1, 0.02,
                  "Archimedes; our aim: 2 %"});
    if (quick) return report.finish();
    std::string text =
        "The mean acceleration over the first 0.2 R, over g (ρ_w − ρ)/(ρ_w + ρ); our aim was 5 %. In the tank, "
        "potential flow gives";
    for (const double ratio : all_ratios)
        text += (ratio < 2 ? ", " : " ") + percent(of_potential_flow(ratio, in_tank_of(ratio))) +
                formatted(" with density %g", ratio);
    text += ". With in_flow and a layer of 0.75 cells we have";
    for (std::size_t i = 0; i < all_ratios.size(); ++i)
        text += (i > 0 ? ", " : " ") + percent(of_potential_flow(all_ratios[i], accelerations[i]));
    text += formatted("; B = %.3f, C = %.3f.", with_flow.buoyancy, with_flow.added_mass) + " Without in_flow:";
    Curve buoyancy{"buoyancy"}, added{"added mass"};
    Curve ring{"added mass if a ring moves along", {}, {}, Curve::Kind::reference};
    std::string entered;
    for (const double layer : {0.0, 0.25, 0.5, 1.0, 1.5}) {
        const auto& ratios = layer == 0.5 ? all_ratios : few_ratios;
        accelerations.clear();
        double deepest = 0;
        text += formatted(" layer of %g cells,", layer);
        for (const double ratio : ratios) {
            const Release one = release({.ratio = ratio, .layer = layer}, formatted("density %g", ratio));
            accelerations.push_back(one.acceleration);
            deepest = std::max(deepest, one.inside);
            text += " " + percent(of_potential_flow(ratio, one.acceleration)) + formatted(" with density %g,", ratio);
        }
        const Split split = split_of(ratios, accelerations);
        buoyancy.add(layer, split.buoyancy);
        added.add(layer, split.added_mass);
        text += formatted(" B = %.3f, C = %.3f%s", split.buoyancy, split.added_mass, layer < 1.5 ? ";" : ".");
        if (deepest > 0.02)
            entered += formatted("%s%.2f cells with a layer of %g", entered.empty() ? "" : ", ", deepest, layer);
    }
    for (int i = 0; i <= 6; ++i) {
        const double square = std::pow(1 + 0.25 * i / cells, 2);
        ring.add(0.25 * i, in_tank * square + square - 1);
    }
    means.curves = {ring, added, buoyancy,
                    Curve{"added mass, in_flow; potential flow", {0.75, 0.75}, {with_flow.added_mass, in_tank}},
                    Curve{"buoyancy, in_flow", {0.75}, {with_flow.buoyancy}}};
    report.remark(text + " The buoyancy of a disc that is held without in_flow is " +
                  two_decimals(held({.layer = 0.5})) + " with a layer of 0.5 cells.");
    report.remark(
        "Without in_flow two errors oppose each other. All nodes within the layer get the disc's velocity along its "
        "normal. As the water keeps its volume, it then does not flow around the disc there, but moves with it: a ring "
        "as wide as the layer is added to the disc, and the added mass becomes too large. Without the layer, water "
        "presses on nodes in front of the disc that the disc does not hold, the buoyancy becomes too small, and water "
        "enters the disc: " +
        entered +
        ". With in_flow the water in the layer flows around the disc; its layer of 0.75 cells was chosen by this case, "
        "with density 0.01. In the first step the disc of density 0.01 has 14 times the acceleration, as water with "
        "the "
        "pressure of its depth is not quite at rest on the grid; that is 1 % of the speed at the end.");
    report.remark(
        "A ball (3D, a tank of 8 R, not run here) needs as fine a grid: with in_flow and density 0.01 it has 78, 87 "
        "and "
        "93 % of the acceleration in unbounded water, g (ρ_w − ρ)/(½ ρ_w + ρ), with R = 6, 8 and 12 cells; without "
        "in_flow, with 8 cells and a layer of 0.5, 71 %.");
    return report.finish();
}
