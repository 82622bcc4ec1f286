/// \file Cloth among snow, on one grid: snowballs land on a cloth that hangs between four posts, and a second cloth
/// falls on a heap of snow. The points of the cloth are particles of the simulation like those of the snow; membranes
/// of an elastic material join them, so that each pushes the other through the nodes of the grid.
#include "support/run.hpp"
#include <firn/lagrangian/cloth.hpp>
#include <firn/lagrangian/net_forces.hpp>
#include <firn/material/no_stress.hpp>

namespace {

using Cloth = firn::NoStress<float>;
using Snow = firn::Snow<float>;
using Point = firn::Vec<double, 3>;
using Ball = firn::Collider<firn::Sphere<float, 3>>;
using Boundary = firn::Together<firn::Walls<float, 3>, firn::BoundaryList<Ball>>;
using Simulation = firn::Simulation<3, firn::Materials<Cloth, Snow>, firn::Apic, firn::MlsForce, firn::QuadraticBSpline,
                                    firn::Coloured, Boundary>;

/// How cloth is: an elastic sheet, as stiff as cotton would be a hundred times thinner.
struct Fabric {
    double young = 2e5;  ///< [Pa]
    double poisson = 0.3;
    double thickness = 1e-3;  ///< [m]
    double mass = 0.3;        ///< [kg/m²]
};

/// A square of fabric, `side` [m] long, flat over `middle`.
void add_cloth(Simulation& simulation, const Fabric& fabric, const Point& middle, double side, double spacing) {
    const auto cells = std::size_t(std::ceil(side / spacing));
    const auto net =
        firn::cloth(middle - Point{side / 2, 0.0, side / 2}, {0.0, 0.0, side}, {side, 0.0, 0.0}, {cells, cells});
    const auto body = simulation.add<Cloth>(net, firn::facet_masses(net, fabric.mass));
    const auto material = firn::FixedCorotated<float>::from_young_poisson(fabric.young, fabric.poisson);
    simulation.add_force<Cloth>(body, firn::membranes_of(net, material, fabric.thickness, 0));
}

int cloth_and_snow(int argc, char** argv) {
    example::CommandLine line({.name = "cloth_and_snow",
                               .about = "Snow lands on cloth, and cloth on snow.",
                               .particles = 60'000,
                               .steps = 8'000,
                               .frames = 30});
    Fabric fabric;
    line.add("--fabric-young", fabric.young, "Young's modulus of the cloth in Pa", 1e3, 1e7);
    line.add("--fabric-mass", fabric.mass, "Of the cloth in kg/m²", 0.05, 5);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    constexpr double ball = 0.11, heap = 0.2, pi = 3.14159265358979;  // radii [m]
    const double snow_volume = 3 * 4.0 / 3 * pi * ball * ball * ball + 2.0 / 3 * pi * heap * heap * heap;
    const double spacing = std::cbrt(snow_volume / double(options.particles)), cell = 2 * spacing;
    const firn::SamplingOptions filling{.spacing = spacing, .pattern = firn::Pattern::jittered};

    // Four small balls that nothing slips through hold the corners of the first cloth.
    const Point hung{0.5, 0.62, 0.5}, laid{1.45, 0.45, 0.5};
    const double side = 0.8;
    firn::BoundaryList<Ball> posts;
    for (const double x : {-0.5, 0.5})
        for (const double z : {-0.5, 0.5})
            posts.all.push_back({.shape = {float(0.035)},
                                 .contact = firn::Contact::stick,
                                 .position = hung + Point{x * side, 0.0, z * side}});
    const auto walls = firn::Walls<float, 3>::all({0, 0, 0}, {2, 1.4F, 1}, {firn::Contact::separate, 0.5});
    Simulation simulation({{0.0, 0.0, 0.0}, {2.0, 1.4, 1.0}, cell}, {}, {options.threads}, {walls, posts});

    add_cloth(simulation, fabric, hung, side, 0.5 * cell);
    add_cloth(simulation, fabric, laid, side, 0.5 * cell);
    for (const Point& centre : {Point{0.45, 0.8, 0.5}, Point{0.62, 1.1, 0.4}, Point{0.4, 1.25, 0.62}})
        simulation.add<Snow>(firn::sample_sphere<3>(centre, ball, filling), 400, {0.0, -1.0, 0.0});
    auto dome = firn::sample_sphere<3>({laid[0], 0.0, laid[2]}, heap, filling);
    std::erase_if(dome.positions, [](const Point& x) { return x[1] <= 0; });
    simulation.add<Snow>(dome, 400);

    example::View view{.direction = {{-0.25F, -0.45F, -1.0F}}};
    view.frame = example::Box{{{0.0F, 0.0F, 0.0F}}, {{2.0F, 0.95F, 1.0F}}};
    view.width = 1100;
    view.height = 700;
    view.smoothing = 0.4F;
    const auto scenery = [&] {
        return example::Scenery<3>{.points = {}, .solid = example::slate, .colours = {example::coral, example::snow}};
    };
    example::run(simulation, options, spacing, view, false, [] {}, scenery);
    std::printf("%.3f s in %llu steps\n", simulation.time(), static_cast<unsigned long long>(simulation.steps()));
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return cloth_and_snow(argc, argv); });
}
