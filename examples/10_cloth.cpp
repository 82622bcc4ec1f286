/// \file A cloth, held at two corners, falls over a ball in the wind, folds, and collides with itself. Then its corners
/// are pulled apart, and it tears in two from a cut in its edge. Prints how far the cloth is stretched and how many of
/// its links are torn.
#include "support/run_particles.hpp"
#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/lagrangian/cloth.hpp>

namespace {

constexpr int D = 3;
using Point = firn::Vec<double, D>;
using Ball = firn::Collider<firn::Sphere<float, D>>;
using Pedestal = firn::Collider<firn::Box<float, D>>;
using Boundary = firn::Together<firn::Walls<float, D>, Ball, Pedestal>;
using System = firn::ParticleSystem<D, float, firn::Verlet, Boundary>;

constexpr double side = 2;  // side of the cloth [m]

Boundary room() {
    const auto walls = firn::Walls<float, D>::all({-2, 0, -2}, {2, 3, 2.5F}, {firn::Contact::separate, 0.5});
    Ball ball{.shape = {0.55F}, .contact = firn::Contact::separate, .friction = 0.3};
    ball.position = {0.1, 0.65, 1.0};
    Pedestal pedestal{.shape = {{0.35F, 0.06F, 0.35F}}, .contact = firn::Contact::separate, .friction = 0.3};
    pedestal.position = {ball.position[0], 0.06, ball.position[2]};
    return {walls, ball, pedestal};
}

/// Cuts a cloth of cells × cells cells next to the middle of its first edge, along v, over `length` of its side.
void cut(firn::Net<D>& net, std::size_t cells, double length) {
    const std::size_t columns = cells + 1, middle = cells / 2;
    const auto crosses = [&](const auto& points) {  // from the left of the cut to its right
        bool is_left = false, is_right = false, is_above = false;
        for (const auto point : points) {
            is_left = is_left || point % columns <= middle;
            is_right = is_right || point % columns > middle;
            is_above = is_above || double(point / columns) < length * double(cells);
        }
        return is_left && is_right && is_above;
    };
    std::erase_if(net.links, [&](const firn::Link& link) { return crosses(std::array{link.a, link.b}); });
    std::erase_if(net.facets, crosses);
}

/// The largest ratio of a link's length to its length at rest.
double stretch(const System& system) {
    double most = 0;
    for (const auto& each : system.constraints.all())
        most = std::max(most, norm(system.points.position[each.ends[1]] - system.points.position[each.ends[0]]) /
                                  double(each.rest));
    return most;
}

int cloth(int argc, char** argv) {
    example::CommandLine line({.name = "cloth",
                               .about = "A cloth held at two corners falls over a ball.",
                               .particles = 10'000,
                               .steps = 3400,
                               .frames = 60});
    double dt = 1e-3, weight = 0.2, wind = 1, tear = 1.5, bend = 0.1, pull = 1, notch = 0.15;
    std::int64_t iterations = 10;
    line.add("--dt", dt, "Time step in s", 1e-5, 1e-2);
    line.add("--weight", weight, "Mass per area in kg/m^2", 1e-3, 10);
    line.add("--wind", wind, "Wind in m/s, from behind", -30, 30);
    line.add("--tear", tear, "Length over length at rest at which a link tears", 1.01, 1e9);
    line.add("--pull", pull, "Speed in m/s at which the corners are pulled apart", 0, 10);
    line.add("--cut", notch, "Length of the cut in the edge, as a part of it", 0, 0.9);
    line.add("--bend", bend, "Compliance of bend links in m/N", 0, 1e3);
    line.add("--iterations", iterations, "Iterations of the constraints per step", 1, 1000);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    const auto cells = std::size_t(std::max(2.0, std::sqrt(double(options.particles)) - 1));
    firn::Net<D> net = firn::cloth({-side / 2, 1.7, 0}, {side, 0, 0}, {0, 0, side}, {cells, cells});
    const double spacing = side / double(cells);
    cut(net, cells, notch);

    System system;
    system.threads = options.threads;
    system.boundary = room();
    system.damping = 0.2;
    system.iterations = int(iterations);
    const std::size_t first = system.add(net, {.masses = firn::facet_masses(net, weight), .radius = 0.4 * spacing});
    firn::ConstraintsOfKinds stiffness{};
    stiffness[std::size_t(firn::LinkKind::shear)].compliance = 1e-5;
    stiffness[std::size_t(firn::LinkKind::bend)].compliance = bend;
    system.constraints.add(net, stiffness, first);
    system.constraints.tear_factor = tear;
    // Links may be too long by a few percent, and shear links as stiff as the iterations make them.
    system.constraints.rigid_tolerance = 0.1;
    system.constraints.compliant_tolerance = 1;
    const std::size_t links = system.constraints.size();
    system.add_force(
        firn::aerodynamic_surface_of(net, firn::AerodynamicDrag<float, D>{.wind = {0, 0, float(wind)}}, first));
    system.collisions.emplace();
    system.collisions->friction = 0.3;
    system.collisions->exclude(net.links, std::uint32_t(first));
    // The corners, with the edge next to them, first move towards each other, so that the edge between them sags.
    const auto grip = std::uint32_t(0.1 * double(cells));
    const auto corners = [&](double speed) {
        for (std::uint32_t i = 0; i <= grip; ++i) {
            system.points.pin(std::uint32_t(first) + i, {speed, 0, 0});
            system.points.pin(std::uint32_t(first + cells) - i, {-speed, 0, 0});
        }
    };

    const auto picture = [&] {
        auto cloud = example::cloud_of<D>(system, 0.5 * spacing, [](std::size_t) { return example::coral; });
        cloud.positions.clear();  // do not draw points without cloth
        cloud.colour.clear();
        const auto& ball = std::get<1>(system.boundary.parts);
        example::add_mesh(cloud.surface, example::sphere_mesh(ball.position, 0.98 * double(ball.shape.radius)),
                          example::teal);
        const auto& pedestal = std::get<2>(system.boundary.parts);
        const Point half = firn::cast<double>(pedestal.shape.half_extents);
        example::add_mesh(cloud.surface, example::box_mesh(pedestal.position - half, pedestal.position + half),
                          example::slate);
        example::View view{.direction = {{-0.5F, -0.35F, -1.0F}}};
        view.domain = example::Box{{{-1.5F, 0, -0.6F}}, {{1.5F, 1.7F, 2.2F}}};
        view.frame = example::Box{{{-1.2F, 0, -0.3F}}, {{1.3F, 1.8F, 2.0F}}};
        return example::render(cloud, view);
    };
    constexpr double hung = 1, held = 2.5;  // when the corners stop, and when they are pulled apart [s]
    bool is_hanging = false;
    const auto step = [&] {
        if (system.time() > held && !is_hanging) {
            is_hanging = true;
            example::write_png(options.file("_hanging.png"), picture());
        }
        corners(is_hanging ? -pull : system.time() < hung ? 0.3 : 0);
        system.step(dt);
    };
    const example::Outcome outcome = example::run(system, options, step, picture);
    if (!outcome.has_moved()) return outcome.exit_code();
    std::printf("%sthe longest link is %.3f times its length at rest; %zu of %zu links are torn\n",
                outcome.part().c_str(), stretch(system), links - system.constraints.size(), links);
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return cloth(argc, argv); });
}
