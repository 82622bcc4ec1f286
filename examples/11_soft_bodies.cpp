/// \file Soft bodies fall into a box and pile up: bunnies and balls of triangles with links inside, and cubes of
/// lattice cells. Prints how much of their volume they keep in the pile.
#include "support/run_particles.hpp"
#include <firn/boundary/walls.hpp>
#include <firn/data/sampling.hpp>
#include <firn/io/obj.hpp>
#include <firn/lagrangian/soft_body.hpp>

namespace {

constexpr int D = 3;
using Point = firn::Vec<double, D>;
using System = firn::ParticleSystem<D, float, firn::Verlet, firn::Walls<float, D>>;

constexpr double width = 1;   // width of the box [m]
constexpr double size = 0.3;  // size of a body [m]

// Bodies with their middle at the origin. A bunny has the vertices of its mesh, the others about `points` points.
firn::SoftBody<D> bunny() {
    return firn::mesh_body(firn::fitted(firn::read_obj(FIRN_EXAMPLES_DATA_DIR "/bunny.obj"), {}, 1.3 * size));
}
firn::SoftBody<D> ball(double points) {
    return firn::mesh_body(example::sphere_mesh({}, 0.5 * size, std::max(1, int(std::lround(std::sqrt(points / 4))))));
}
firn::SoftBody<D> cube(double points) {
    const double cells = std::max(1.0, std::round(std::cbrt(points) - 1));
    const Point half = Point::filled(0.45 * size);
    return firn::lattice_body(firn::sample_box<D>(half * -1.0, half * (1 + 1e-9), {.spacing = 0.9 * size / cells}));
}

struct Placed {
    std::size_t first;  // its first point
    firn::Net<D> net;
    double volume;  // at rest [m³]
};

double volume_of(const System& system, const Placed& body) {
    firn::TriangleMesh mesh = firn::surface_mesh(body.net);
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) mesh.vertices[i] = system.points.position[body.first + i];
    return firn::signed_volume(mesh);
}

/// The mean length of the links of a kind [m].
double mean_length(const firn::Net<D>& net, firn::LinkKind kind) {
    double sum = 0, count = 0;
    for (const firn::Link& link : net.links)
        if (link.kind == kind) sum += firn::rest_length(net, link), ++count;
    return sum / count;
}

int soft_bodies(int argc, char** argv) {
    example::CommandLine line({.name = "soft_bodies",
                               .about = "Soft bodies fall into a box and pile up. --particles is met approximately: a "
                                        "bunny has 1,839 points, and bunnies get at most half of all.",
                               .particles = 20'000,
                               .steps = 3000,
                               .frames = 60});
    double dt = 5e-4, density = 500, young = 2e4, friction = 0.3;
    std::int64_t count = 15, iterations = 4;
    line.add("--dt", dt, "Time step in s", 1e-5, 1e-2);
    line.add("--bodies", count, "Number of bodies", 1, 1000);
    line.add("--density", density, "Density of the bodies in kg/m^3", 1, 1e5);
    line.add("--young", young, "Approximate Young's modulus of the bodies in Pa", 1, 1e9);
    line.add("--friction", friction, "Friction between bodies and at the walls", 0, 10);
    line.add("--iterations", iterations, "Iterations of the constraints per step", 1, 1000);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    System system(
        firn::Walls<float, D>::all({0, 0, 0}, {float(width), 100, float(width)}, {firn::Contact::separate, friction}));
    system.threads = options.threads;
    system.iterations = int(iterations);
    system.damping = 0.3;
    system.collisions.emplace();
    system.collisions->friction = friction;

    // Of three bodies one is a bunny, unless the bunnies would have more than half of the points; then there are more
    // balls. The cubes share the rest with the balls, which make up for what does not fit into a cube.
    std::array<firn::SoftBody<D>, 3> kinds;
    kinds[0] = bunny();
    const double of_bunny = double(kinds[0].net.positions.size());
    const auto bunnies = std::min((count + 2) / 3, std::int64_t(double(options.particles) / 2 / of_bunny));
    const std::int64_t cubes = count / 3, balls = count - bunnies - cubes;
    double rest = double(options.particles) - double(bunnies) * of_bunny;
    kinds[2] = cube(rest / double(std::max<std::int64_t>(balls + cubes, 1)));
    rest -= double(cubes) * double(kinds[2].net.positions.size());
    kinds[1] = ball(rest / double(std::max<std::int64_t>(balls, 1)));
    std::vector<Placed> bodies;
    firn::RandomSequence random(3);
    const auto within = [&](double most) { return most * (2 * firn::unit_interval(random.bits()) - 1); };
    for (std::int64_t b = 0; b < count; ++b) {
        const firn::SoftBody<D>& body = kinds[std::size_t(b % 3 == 0 && b / 3 >= bunnies ? 1 : b % 3)];
        firn::Net<D> net = body.net;
        // Four bodies per layer, with random rotations.
        const auto turned = firn::rotation({within(1), 1.5 + within(1), within(1)}, within(3.1));
        const Point middle{width * (b % 2 ? 0.74 : 0.26) + within(0.02), 0.3 + 0.5 * double(b / 4),
                           width * (b / 2 % 2 ? 0.74 : 0.26) + within(0.02)};
        for (Point& x : net.positions) x = middle + turned * x;
        double volume = 0;
        for (const double part : body.volumes) volume += part;
        const double spacing = std::cbrt(volume / double(net.positions.size()));
        // Points of one body do not collide, so they may overlap, which leaves no gaps for others to slip through.
        const double radius = 0.75 * mean_length(net, firn::LinkKind::stretch);
        const std::size_t first =
            system.add(net, {.masses = body.masses(density), .radius = radius, .group = std::uint32_t(b + 1)});
        system.constraints.add(net, firn::ConstraintOptions{.compliance = 1 / (young * spacing)}, first);
        bodies.push_back({first, std::move(net), volume});
    }

    constexpr example::Colour colours[] = {example::coral, example::teal, example::amber, example::indigo,
                                           example::moss,  example::plum, example::sand};
    const auto picture = [&] {
        const auto cloud = example::cloud_of<D>(
            system, 0.01, [&](std::size_t i) { return colours[(system.points.group[i] - 1) % 7]; });
        example::View view{.direction = {{-0.5F, -0.5F, -1.0F}}};
        view.domain = example::Box{{{0, 0, 0}}, {{float(width), float(width), float(width)}}};
        view.frame = example::Box{{{0, 0, 0}}, {{float(width), 1.1F * float(width), float(width)}}};
        return example::render(cloud, view);
    };
    const example::Outcome outcome = example::run(system, options, [&] { system.step(dt); }, picture);
    if (!outcome.has_moved()) return outcome.exit_code();
    double least = 1e9, mean = 0;
    for (const Placed& body : bodies) {
        const double kept = volume_of(system, body) / body.volume;
        least = std::min(least, kept);
        mean += kept / double(bodies.size());
    }
    std::printf("%s%zu bodies keep %.3f of their volume on average, at least %.3f\n", outcome.part().c_str(),
                bodies.size(), mean, least);
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return soft_bodies(argc, argv); });
}
