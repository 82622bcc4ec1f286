/// \file Jelly, water, sand and snow in one simulation, on one grid. A column of sand collapses and runs out, a
/// snowball breaks on a wooden bunny, and a column of water, with a cube of jelly on it, breaks and splashes over both.
/// Each material has its own particles and states. The bunny is a rigid body, which the particles push.
#include "support/lumpy_snow.hpp"
#include "support/rigid_body.hpp"
#include "support/run.hpp"
#include <firn/data/mass_of_mesh.hpp>
#include <firn/data/mesh_distance.hpp>

namespace {

using Jelly = firn::FixedCorotated<float>;
using Water = firn::Fluid<float>;
using Sand = firn::Sand<float>;
using Snow = example::LumpySnow;
using Four = firn::Materials<Jelly, Water, Sand, Snow>;
using Bunny = firn::Collider<firn::DistanceGrid<float, 3>>;
using Boundary = firn::GapContact<firn::Together<firn::Walls<float, 3>, firn::RigidBody<Bunny>>>;
using Simulation = firn::SimulationWith<3, Four, Boundary>;

int four_materials(int argc, char** argv) {
    example::CommandLine line(
        {.name = "four_materials",
         .about = "Sand runs out, snow breaks on a bunny, and water with jelly splashes over them.",
         .particles = 100'000,
         .steps = 4'000,
         .frames = 30});
    double friction_angle = 35, viscosity = 0;
    line.add("--friction-angle", friction_angle, "Friction angle of the sand in degrees", 1, 60);
    line.add("--viscosity", viscosity, "Viscosity of the water in Pa s", 0, 100);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    // Volumes [m³].
    constexpr double pi = 3.14159265358979, sand_radius = 0.17, sand_height = 0.75, snow_radius = 0.14;
    constexpr double water_volume = 0.34 * 0.8 * 0.7, sand_volume = pi * sand_radius * sand_radius * sand_height,
                     jelly_volume = 0.2 * 0.2 * 0.2,
                     snow_volume = 4.0 / 3 * pi * snow_radius * snow_radius * snow_radius;
    const double spacing =
        std::cbrt((water_volume + sand_volume + jelly_volume + snow_volume) / double(options.particles));
    const firn::SamplingOptions filling{.spacing = spacing, .pattern = firn::Pattern::jittered};
    firn::SamplingOptions loose = filling;  // matter that flows shows the rows of a lattice for long
    loose.jitter = 0.5;

    firn::Snow<float> snow;
    snow.largest_exponent = 2;  // crushed snow is at most 7 times as stiff, which allows longer steps
    const Four materials(Jelly::from_young_poisson(2e4, 0.3),
                         Water::from_properties({.bulk = 3e5, .viscosity = viscosity}),
                         Sand::from_properties({.friction_angle = firn::degrees(friction_angle)}), Snow{snow});
    // A wooden bunny that stands on the floor, with its centre of mass at the origin.
    const auto upright = firn::fitted(firn::read_obj(FIRN_EXAMPLES_DATA_DIR "/bunny.obj"), {0.0, 0.0, 0.0}, 0.5);
    const firn::MassOfMesh wood = firn::mass_of(upright, 600);
    const auto mesh = firn::translated(upright, wood.centre * -1.0);
    Bunny bunny{.shape = {firn::mesh_distance(mesh, {.spacing = spacing})},
                .contact = firn::Contact::separate,
                .friction = 0.3};
    bunny.position = {0.95, -firn::bounding_box(mesh).lower[1], 0.35};
    bunny.rotation = firn::rotor({0.0, 1.0, 0.0}, firn::degrees(60));

    auto walls = firn::Walls<float, 3>::all({0, 0, 0}, {2.0F, 1.4F, 0.7F}, {firn::Contact::separate, 0.0});
    walls.at_lower[1].friction = 0.5;
    Simulation simulation({{0.0, 0.0, 0.0}, {2.0, 1.4, 0.7}, 2 * spacing}, materials, {options.threads},
                          Boundary{firn::Together(walls, firn::RigidBody(bunny, wood))});
    auto& body = std::get<1>(simulation.boundary.boundary.parts);

    simulation.set<Water>().add(firn::sample_box<3>({0.0, 0.0, 0.0}, {0.34, 0.8, 0.7}, loose), 1000);
    auto column = firn::sample_box<3>({1.6 - sand_radius, 0.0, 0.35 - sand_radius},
                                      {1.6 + sand_radius, sand_height, 0.35 + sand_radius}, loose);
    std::erase_if(column.positions, [](const auto& x) { return std::hypot(x[0] - 1.6, x[2] - 0.35) > sand_radius; });
    simulation.set<Sand>().add(column, 1600);
    simulation.set<Jelly>().add(firn::sample_box<3>({0.07, 0.95, 0.25}, {0.27, 1.15, 0.45}, filling), 800,
                                {0.0, -1.0, 0.0});
    // The snow parts easily, and more easily at some places than at others.
    auto snowball = simulation.set<Snow>();
    example::vary(snowball,
                  snowball.add(firn::sample_sphere<3>({1.03, 0.9, 0.35}, snow_radius, filling), 400, {-0.6, -6.0, 0.0}),
                  {.stretch = 0.3, .variation = 0.7, .lump = 0.1});

    example::View view{.direction = {{-0.35F, -0.4F, -1.0F}}};
    view.frame = example::Box{{{0.0F, 0.0F, 0.0F}}, {{2.0F, 1.0F, 0.7F}}};
    view.height = 800;
    view.smoothing = 0.5F;
    // Matter moves the bunny; the walls stop the vertices that have reached them.
    const auto stop_bunny = [&] {
        const auto turned = matrix_of(body.collider.rotation);
        for (int a = 0; a < 3; ++a)
            for (const int sign : {1, -1}) {
                const double wall = (sign > 0 ? simulation.domain().lower : simulation.domain().upper)[a];
                double deepest = 0;
                firn::Vec<double, 3> at{}, normal{};
                normal[a] = sign;
                for (const auto& vertex : mesh.vertices) {
                    const auto x = body.collider.position + turned * vertex;
                    const double depth = sign * (wall - x[a]);
                    if (depth > deepest) deepest = depth, at = x;
                }
                if (deepest > 0) {
                    example::stop_at(body, at, normal, 0.5);
                    body.collider.position += normal * deepest;
                }
            }
    };
    // The picture shows the bunny's surface.
    const auto surface = [&] {
        example::Scenery<3> scenery{.colours = {example::coral, example::teal, example::sand, example::snow}};
        auto placed = mesh;
        for (auto& x : placed.vertices) x = body.collider.position + matrix_of(body.collider.rotation) * x;
        example::add_mesh(scenery.surface, placed, example::plum);
        return scenery;
    };
    const example::Outcome outcome = example::run(simulation, options, spacing, view, stop_bunny, surface);
    std::printf("%.3f s in %llu steps\n", simulation.time(), static_cast<unsigned long long>(simulation.steps()));
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return four_materials(argc, argv); });
}
