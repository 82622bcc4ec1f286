/// \file Jelly, water, sand and snow in one simulation, on one grid: water breaks over a heap of sand, a cube of jelly
/// and a snowball fall into it. Each material has particles and states of its own.
#include "support/run.hpp"

namespace {

using Jelly = firn::FixedCorotated<float>;
using Water = firn::Fluid<float>;
using Sand = firn::Sand<float>;
using Snow = firn::Snow<float>;
using Four = firn::Materials<Jelly, Water, Sand, Snow>;

int four_materials(int argc, char** argv) {
    example::CommandLine line({.name = "four_materials",
                               .about = "Jelly, water, sand and snow meet.",
                               .particles = 100'000,
                               .steps = 5'000,
                               .frames = 30});
    double friction_angle = 35, viscosity = 0;
    line.add("--friction-angle", friction_angle, "Of the sand in degrees", 1, 60);
    line.add("--viscosity", viscosity, "Of the water in Pa s", 0, 100);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    // [m]; of the wedge of sand, a half of its box
    constexpr double water_volume = 0.5 * 0.55 * 0.8, sand_volume = 0.5 * 0.9 * 0.5 * 0.8,
                     jelly_volume = 0.3 * 0.3 * 0.3, snow_volume = 4.0 / 3 * 3.14159265358979 * 0.18 * 0.18 * 0.18;
    const double spacing =
        std::cbrt((water_volume + sand_volume + jelly_volume + snow_volume) / double(options.particles));
    const firn::SamplingOptions filling{.spacing = spacing, .pattern = firn::Pattern::jittered};

    const Four materials(Jelly::from_young_poisson(2e4, 0.3),
                         Water::from_properties({.bulk = 3e5, .viscosity = viscosity}),
                         Sand::from_properties({.friction_angle = friction_angle}), Snow::from_properties({}));
    firn::Simulation<3, Four> simulation({{0.0, 0.0, 0.0}, {2.0, 1.6, 0.8}, 2 * spacing}, materials, {options.threads});
    simulation.boundary = firn::Walls<float, 3>::all({0, 0, 0}, {2.0F, 1.6F, 0.8F}, {firn::Contact::separate, 0.0});
    simulation.boundary.at_lower[1].friction = 0.5;

    simulation.add<Water>(firn::sample_box<3>({0.0, 0.0, 0.0}, {0.5, 0.55, 0.8}, filling), 1000);
    auto wedge = firn::sample_box<3>({1.1, 0.0, 0.0}, {2.0, 0.5, 0.8}, filling);
    std::erase_if(wedge.positions, [](const auto& x) { return x[1] / 0.5 > (x[0] - 1.1) / 0.9; });
    simulation.add<Sand>(wedge, 1600);
    simulation.add<Jelly>(firn::sample_box<3>({0.75, 0.6, 0.25}, {1.05, 0.9, 0.55}, filling), 800, {0.0, -1.0, 0.0});
    simulation.add<Snow>(firn::sample_sphere<3>({1.5, 1.05, 0.4}, 0.18, filling), 400, {-0.5, -2.0, 0.0});

    example::View view{.direction = {{-0.35F, -0.4F, -1.0F}}};
    view.frame = example::Box{{{0.0F, 0.0F, 0.0F}}, {{2.0F, 1.0F, 0.8F}}};
    view.smoothing = 0.5F;
    example::run(simulation, options, spacing, view, false, [] {},
                 {.colours = {example::coral, example::teal, example::sand, example::snow}});
    std::printf("%.3f s in %llu steps\n", simulation.time(), static_cast<unsigned long long>(simulation.steps()));
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return four_materials(argc, argv); });
}
