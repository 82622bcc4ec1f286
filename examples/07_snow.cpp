/// \file Snow (Stomakhin et al. 2013): a snowball breaks on a wall and sticks, and a layer of snow slides down a slope.
/// Then it runs the same particles on coarse cells, where the snow moves like soap, because cells must be smaller than
/// the pieces that snow breaks into.
#include "support/lumpy_snow.hpp"
#include "support/run.hpp"

namespace {

constexpr int D = 3;
using Point = firn::Vec<double, D>;
using Obstacle = firn::Collider<firn::Box<float, D>>;
using Boundary = firn::Together<firn::Walls<float, D>, Obstacle, Obstacle>;
using Snow = example::LumpySnow;
using Simulation = firn::SimulationWith<D, Snow, Boundary>;

constexpr double size = 4;  // side of the box [m]
constexpr firn::Angle slope = firn::degrees(30);

/// The obstacles: an upright wall that snow sticks to, and a plank that it slides down.
Obstacle wall() {
    Obstacle wall{.shape = {{0.1F, 0.9F, 0.7F}}, .contact = firn::Contact::stick};
    wall.position = {2.9, 0.9, 2.8};
    return wall;
}
Obstacle plank() {
    Obstacle plank{.shape = {{1.4F, 0.06F, 0.6F}}, .contact = firn::Contact::separate, .friction = 0.25};
    plank.position = {1.7, 0.75, 1.1};
    plank.rotation = firn::rotor({0.0, 0.0, 1.0}, -slope);
    return plank;
}

/// Converts a point from an obstacle's coordinates to the world's.
Point placed(const Obstacle& obstacle, const Point& x) {
    return obstacle.position + firn::matrix_of(obstacle.rotation) * x;
}

firn::Samples<D> ball(const firn::SamplingOptions& filling) {
    return firn::sample_sphere<D>({1.6, 1.1, 2.8}, 0.26, filling);
}
/// A layer with round edges and an uneven top.
firn::Samples<D> layer(const firn::SamplingOptions& filling) {
    constexpr double length = 1.1, width = 0.9, thick = 0.22;
    firn::Samples<D> snow =
        firn::sample_box<D>({-1.3, 0.07, -width / 2}, {-1.3 + length, 0.07 + 1.5 * thick, width / 2}, filling);
    std::erase_if(snow.positions, [](const Point& x) {
        const double along = std::pow(std::abs(2 * (x[0] + 1.3) / length - 1), 3),
                     across = std::pow(std::abs(2 * x[2] / width), 3);
        const double top = std::sqrt((1 - along) * (1 - across)) * (1 + 0.13 * example::noise({x[0], 0.0, x[2]}, 0.2));
        return x[1] - 0.07 > thick * top;
    });
    for (Point& x : snow.positions) x = placed(plank(), x);
    return snow;
}

Simulation make(int cells, const firn::SamplingOptions& filling, double speed, const Snow& snow,
                const example::SnowKind& packed, int threads) {
    const firn::Domain<D> domain{{0, 0, 0}, {size, size, size}, size / cells};
    const auto walls = firn::Walls<float, D>::all({0, 0, 0}, {size, size, size}, {firn::Contact::separate, 0.5});
    Simulation simulation(domain, snow, {threads}, {walls, wall(), plank()});
    const double density = 400;
    example::vary(simulation, simulation.add(ball(filling), density, {speed, 1.5, 0.0}), packed);
    example::vary(simulation, simulation.add(layer(filling), density), {});
    return simulation;
}

example::Scenery<D> obstacles() {
    example::Scenery<D> scenery{.colours = {example::snow, example::snow}};
    for (const Obstacle& obstacle : {wall(), plank()}) {
        const Point half = firn::cast<double>(obstacle.shape.half_extents);
        firn::TriangleMesh mesh = example::box_mesh(half * -1.0, half);
        for (Point& x : mesh.vertices) x = placed(obstacle, x);
        example::add_mesh(scenery.surface, mesh, example::slate);
    }
    return scenery;
}

int snow(int argc, char** argv) {
    example::CommandLine line({.name = "snow",
                               .about = "A snowball breaks on a wall, and snow slides down a slope.",
                               .particles = 60'000,
                               .steps = 12'000,
                               .frames = 30});
    std::int64_t cells = 128, coarse_cells = 32;
    double speed = 8;
    firn::SnowProperties properties;
    example::SnowKind packed{.stiffness = 6, .compression = 3, .stretch = 0.5, .variation = 1.2};  // pressed by hand
    line.add("--cells", cells, "Cells along an edge of the box", 16, 1024);
    line.add("--coarse-cells", coarse_cells, "Cells along an edge in the second run; 0 for no second run", 0, 1024);
    line.add("--speed", speed, "Speed of the snowball in m/s", 0, 50);
    line.add("--young", properties.young, "Young's modulus in Pa", 1e3, 1e7);
    line.add("--critical-compression", properties.critical_compression, "Compression at which snow yields", 1e-4, 0.5);
    line.add("--critical-stretch", properties.critical_stretch, "Stretch at which snow breaks", 1e-4, 0.5);
    line.add("--hardening", properties.hardening, "Hardening coefficient", 0, 20);
    line.add("--packed-stiffness", packed.stiffness, "Factor of the ball's stiffness", 0.1, 100);
    line.add("--packed-compression", packed.compression, "Factor of the ball's critical compression", 0.1, 10);
    line.add("--packed-stretch", packed.stretch, "Factor of the ball's critical stretch", 0.01, 10);
    line.add("--variation", packed.variation, "Standard deviation of the logarithm of the ball's strength", 0, 3);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    constexpr double volume = 4.0 / 3 * 3.14159265358979 * 0.26 * 0.26 * 0.26 + 0.16;  // ball, layer
    const double spacing = std::cbrt(volume / double(options.particles));
    const firn::SamplingOptions filling{.spacing = spacing, .pattern = firn::Pattern::jittered};
    auto material = firn::Snow<float>::from_properties(properties);
    material.largest_exponent = 2;  // crushed snow is at most 7 times as stiff, which allows longer steps

    const auto on_cells = [&](std::int64_t n) {
        return make(int(n), filling, speed, Snow{material}, packed, options.threads);
    };
    Simulation fine = on_cells(cells);
    example::View view{.direction = {{0.7F, -0.3F, -0.8F}}};
    view.frame = example::Box{{{0.3F, 0.0F, 0.5F}}, {{3.2F, 1.7F, 3.4F}}};
    view.width = 1100;
    view.height = 825;
    view.smoothing = 0.4F;
    const example::Outcome outcome = example::run(fine, options, spacing, view, [] {}, obstacles);
    if (coarse_cells < 16 || !outcome.has_moved() || outcome.is_interrupted()) return outcome.exit_code();

    Simulation coarse = on_cells(coarse_cells);
    int part = 0;
    std::cout << "the same with " << coarse_cells << " cells along an edge" << std::endl;
    constexpr int parts = 100;  // of the first run's time
    const example::Outcome second = example::run_steps(parts, std::int64_t(example::particle_count(coarse)), [&] {
        coarse.advance(fine.time() * (double(++part) / parts) - coarse.time());
    });
    if (second.is_interrupted()) return second.exit_code();  // a picture of both would show unequal times
    example::write_png(options.file("_fine_and_coarse.png"),
                       example::beside(example::picture(fine, spacing, view, obstacles()),
                                       example::picture(coarse, spacing, view, obstacles())));
    std::printf("both at %.3f s, after %llu and %llu steps\n", fine.time(),
                static_cast<unsigned long long>(fine.steps()), static_cast<unsigned long long>(coarse.steps()));
    std::cout << "picture of both: " << options.file("_fine_and_coarse.png").string() << std::endl;
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return snow(argc, argv); });
}
