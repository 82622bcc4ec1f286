/// \file Cloth and snow on one grid. Snowballs crumble on a cloth that is held at two edges, and a second cloth falls
/// on a heap of snow. The points of the cloth are particles, like those of the snow, and elastic membranes connect
/// them. Cloth and snow push each other through the nodes of the grid.
#include "support/lumpy_snow.hpp"
#include "support/run.hpp"
#include <firn/lagrangian/cloth.hpp>
#include <firn/lagrangian/net_forces.hpp>
#include <firn/material/no_stress.hpp>

namespace {

using Cloth = firn::NoStress<float>;
using Snow = example::LumpySnow;
using Point = firn::Vec<double, 3>;
using Simulation = firn::Simulation<3, firn::Materials<Cloth, Snow>>;

/// Cloth is an elastic sheet.
struct Fabric {
    double young = 4e5;  ///< [Pa]
    double poisson = 0.3;
    double thickness = 1e-3;  ///< [m]
    double mass = 0.3;        ///< [kg/m²]
};

/// Adds a horizontal square of fabric with sides of `side` [m] and its centre at `middle`. If `held`, the two edges
/// across x are fixed.
void add_cloth(Simulation& simulation, const Fabric& fabric, const Point& middle, double side, double spacing,
               bool held) {
    const auto cells = std::size_t(std::ceil(side / spacing));
    const auto net =
        firn::cloth(middle - Point{side / 2, 0.0, side / 2}, {0.0, 0.0, side}, {side, 0.0, 0.0}, {cells, cells});
    auto cloth = simulation.set<Cloth>();
    const auto body = cloth.add(net, firn::facet_masses(net, fabric.mass));
    const auto material = firn::FixedCorotated<float>::from_young_poisson(fabric.young, fabric.poisson);
    cloth.add_force(body, firn::membranes_of(net, material, fabric.thickness));
    if (!held) return;
    firn::Anchors<float, 3> anchors;
    const double stiffness = 4 * fabric.young * fabric.thickness;  // below that of the membranes
    for (std::uint32_t i = 0; i < net.positions.size(); ++i)
        if (std::abs(std::abs(net.positions[i][0] - middle[0]) - side / 2) < 0.1 * spacing)
            anchors.add({i}, {net.positions[i], float(stiffness), 0});
    cloth.add_force(body, std::move(anchors));
}

int cloth_and_snow(int argc, char** argv) {
    example::CommandLine line({.name = "cloth_and_snow",
                               .about = "Snow lands on cloth, and cloth on snow.",
                               .particles = 40'000,
                               .steps = 8'000,
                               .frames = 30,
                               .can_go_on = true});
    Fabric fabric;
    line.add("--fabric-young", fabric.young, "Young's modulus of the cloth in Pa", 1e3, 1e7);
    line.add("--fabric-mass", fabric.mass, "Mass per area of the cloth in kg/m²", 0.05, 5);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    constexpr double ball = 0.1, heap = 0.17, pi = 3.14159265358979;  // radii [m]
    const double snow_volume = 4 * 4.0 / 3 * pi * ball * ball * ball + 2.0 / 3 * pi * heap * heap * heap;
    const double spacing = std::cbrt(snow_volume / double(options.particles)), cell = 2 * spacing;
    const firn::SamplingOptions filling{.spacing = spacing, .pattern = firn::Pattern::jittered};

    const Point hung{0.5, 0.55, 0.5}, laid{1.55, 0.4, 0.5};
    const double side = 0.8;
    const auto walls = firn::Walls<float, 3>::all({0, 0, 0}, {2.1F, 1.4F, 1}, {firn::Contact::separate, 0.5});
    firn::Snow<float> loose;
    loose.largest_exponent = 1;  // crushed snow is at most 2.7 times as stiff, which allows longer steps
    Simulation simulation({{0.0, 0.0, 0.0}, {2.1, 1.4, 1.0}, cell}, {Cloth{}, Snow{loose}}, {options.threads}, walls);

    add_cloth(simulation, fabric, hung, side, 0.8 * cell, true);
    add_cloth(simulation, fabric, laid, side, 0.8 * cell, false);
    const example::SnowKind crumbly{.stiffness = 2, .compression = 3, .stretch = 0.2, .variation = 0.8, .lump = 0.05};
    auto snow = simulation.set<Snow>();
    for (const Point& centre :
         {Point{0.36, 0.75, 0.62}, Point{0.62, 1.1, 0.36}, Point{1.02, 0.5, 0.72}, Point{1.02, 0.85, 0.3}})
        example::vary(snow, snow.add(firn::sample_sphere<3>(centre, ball, filling), 400, {0.0, -6.0, 0.0}), crumbly);
    auto dome = firn::sample_sphere<3>({laid[0], 0.0, laid[2]}, heap, filling);
    std::erase_if(dome.positions, [](const Point& x) { return x[1] <= 0; });
    snow.add(dome, 400);

    example::View view{.direction = {{-0.25F, -0.45F, -1.0F}}};
    view.frame = example::Box{{{0.0F, 0.0F, 0.0F}}, {{2.1F, 0.7F, 1.0F}}};
    view.width = 1100;
    view.height = 700;
    view.smoothing = 0.4F;
    const auto scenery = [&] {
        example::Scenery<3> shown{.points = {}, .solid = example::slate, .colours = {example::coral, example::snow}};
        for (const double x : {-0.5, 0.5})  // the bars that hold the edges
            for (double z = -0.52 * side; z < 0.52 * side; z += 0.5 * spacing)
                shown.points.push_back(hung + Point{x * side, 0.0, z});
        return shown;
    };
    const example::Outcome outcome = example::run(simulation, options, spacing, view, [] {}, scenery);
    std::printf("%.3f s in %llu steps\n", simulation.time(), static_cast<unsigned long long>(simulation.steps()));
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return cloth_and_snow(argc, argv); });
}
