/// \file Jelly, water, sand and snow in one simulation, on one grid. Water breaks over a heap of sand; a cube of jelly
/// and a snowball fall into it. Each material has its own particles and states. A rigid bunny falls among them: its
/// mesh is a boundary, and the reaction of the particles pushes the bunny.
#include "support/rigid_body.hpp"
#include "support/run.hpp"
#include <firn/data/mesh_distance.hpp>

namespace {

using Jelly = firn::FixedCorotated<float>;
using Water = firn::Fluid<float>;
using Sand = firn::Sand<float>;
using Snow = firn::Snow<float>;
using Four = firn::Materials<Jelly, Water, Sand, Snow>;
using Bunny = firn::Collider<firn::DistanceGrid<float, 3>>;
using Boundary = firn::Together<firn::Walls<float, 3>, Bunny>;
using Simulation = firn::SimulationWith<3, Four, Boundary>;

/// Mass [kg], centre of mass [m], and inertia about it [kg m²] of a closed mesh of uniform density, from samples.
struct MassProperties {
    double mass = 0;
    firn::Vec<double, 3> centre{};
    firn::Mat<double, 3> inertia = firn::Mat<double, 3>::zero();
};
MassProperties mass_properties(const firn::TriangleMesh& mesh, double density, double spacing) {
    const auto samples = firn::sample_mesh(mesh, {.spacing = spacing});
    const double mass = density * samples.volume;
    MassProperties sum;
    for (const auto& x : samples.positions) {
        sum.mass += mass;
        sum.centre += x * mass;
    }
    sum.centre = sum.centre * (1 / sum.mass);
    for (const auto& x : samples.positions) {
        const auto r = x - sum.centre;
        sum.inertia += (firn::Mat<double, 3>::diagonal(dot(r, r)) - outer(r, r)) * mass;
    }
    return sum;
}

int four_materials(int argc, char** argv) {
    example::CommandLine line({.name = "four_materials",
                               .about = "Jelly, water, sand and snow meet.",
                               .particles = 100'000,
                               .steps = 5'000,
                               .frames = 30});
    double friction_angle = 35, viscosity = 0;
    line.add("--friction-angle", friction_angle, "Friction angle of the sand in degrees", 1, 60);
    line.add("--viscosity", viscosity, "Viscosity of the water in Pa s", 0, 100);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    // [m³]; the wedge of sand fills half of its box
    constexpr double water_volume = 0.5 * 0.55 * 0.8, sand_volume = 0.5 * 0.9 * 0.5 * 0.8,
                     jelly_volume = 0.3 * 0.3 * 0.3, snow_volume = 4.0 / 3 * 3.14159265358979 * 0.18 * 0.18 * 0.18;
    const double spacing =
        std::cbrt((water_volume + sand_volume + jelly_volume + snow_volume) / double(options.particles));
    const firn::SamplingOptions filling{.spacing = spacing, .pattern = firn::Pattern::jittered};

    const Four materials(
        Jelly::from_young_poisson(2e4, 0.3), Water::from_properties({.bulk = 3e5, .viscosity = viscosity}),
        Sand::from_properties({.friction_angle = firn::degrees(friction_angle)}), Snow::from_properties({}));
    // A wooden bunny that floats, with its centre of mass at the origin.
    const auto upright = firn::fitted(firn::read_obj(FIRN_EXAMPLES_DATA_DIR "/bunny.obj"), {0.0, 0.0, 0.0}, 0.36);
    const MassProperties wood = mass_properties(upright, 600, 0.01);
    const auto mesh = firn::translated(upright, wood.centre * -1.0);
    example::RigidBody<3> body(wood.mass, wood.inertia);
    body.position = {0.32, 0.95, 0.4};
    body.rotation = firn::rotor({0.3, 1.0, 0.2}, firn::radians(0.8));
    Bunny bunny{.shape = {firn::mesh_distance(mesh, {.spacing = spacing})},
                .contact = firn::Contact::separate,
                .friction = 0.3};
    body.place(bunny);

    auto walls = firn::Walls<float, 3>::all({0, 0, 0}, {2.0F, 1.6F, 0.8F}, {firn::Contact::separate, 0.0});
    walls.at_lower[1].friction = 0.5;
    Simulation simulation({{0.0, 0.0, 0.0}, {2.0, 1.6, 0.8}, 2 * spacing}, materials, {options.threads},
                          {walls, bunny});
    simulation.reactions.emplace();

    simulation.set<Water>().add(firn::sample_box<3>({0.0, 0.0, 0.0}, {0.5, 0.55, 0.8}, filling), 1000);
    auto wedge = firn::sample_box<3>({1.1, 0.0, 0.0}, {2.0, 0.5, 0.8}, filling);
    std::erase_if(wedge.positions, [](const auto& x) { return x[1] / 0.5 > (x[0] - 1.1) / 0.9; });
    simulation.set<Sand>().add(wedge, 1600);
    simulation.set<Jelly>().add(firn::sample_box<3>({0.75, 0.6, 0.25}, {1.05, 0.9, 0.55}, filling), 800,
                                {0.0, -1.0, 0.0});
    simulation.set<Snow>().add(firn::sample_sphere<3>({1.5, 1.05, 0.4}, 0.18, filling), 400, {-0.5, -2.0, 0.0});

    example::View view{.direction = {{-0.35F, -0.4F, -1.0F}}};
    view.frame = example::Box{{{0.0F, 0.0F, 0.0F}}, {{2.0F, 1.0F, 0.8F}}};
    view.smoothing = 0.5F;
    // The bunny loses the impulse that it gave to the particles. Then it moves, and its collider with it.
    const auto move_bunny = [&] {
        const double dt = simulation.last_time_step();
        const auto& given = simulation.reactions->parts[1];
        body.push(simulation.gravity * (body.mass() * dt) - given.impulse, given.angular_impulse * -1.0);
        body.move(dt);
        for (int a = 0; a < 3; ++a) {  // keeps the bunny off the walls, which act on particles only
            const double room = 0.14, to = body.position[a];
            if (to < simulation.domain().lower[a] + room) body.momentum[a] = std::max(body.momentum[a], 0.0);
            if (to > simulation.domain().upper[a] - room) body.momentum[a] = std::min(body.momentum[a], 0.0);
        }
        body.place(std::get<1>(simulation.boundary.parts));
    };
    // The picture shows the bunny's surface at the end.
    const auto surface = [&] {
        example::Scenery<3> scenery{.points = {},
                                    .solid = example::plum,
                                    .colours = {example::coral, example::teal, example::sand, example::snow}};
        for (const auto& x : firn::sample_mesh(mesh, {.spacing = spacing}).positions)
            scenery.points.push_back(body.position + matrix_of(body.rotation) * x);
        return scenery;
    };
    const example::Outcome outcome = example::run(simulation, options, spacing, view, move_bunny, surface);
    std::printf("%.3f s in %llu steps\n", simulation.time(), static_cast<unsigned long long>(simulation.steps()));
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return four_materials(argc, argv); });
}
