/// \file Two elastic bunnies, read from an OBJ file and filled with particles. One falls on the other; they tumble and
/// bounce. Prints how far each has turned.
#include "support/rotation.hpp"
#include "support/run.hpp"

namespace {

int two_bunnies(int argc, char** argv) {
    example::CommandLine line({.name = "two_bunnies",
                               .about = "Two elastic bunnies from an OBJ file collide.",
                               .particles = 150'000,
                               .steps = 2400,
                               .frames = 30,
                               .can_go_on = true});
    double young = 1e3, poisson = 0.3;
    std::string mesh_file = FIRN_EXAMPLES_DATA_DIR "/bunny.obj";
    line.add("--young", young, "Young's modulus in Pa", 1.0, 1e9);
    line.add("--poisson", poisson, "Poisson's ratio", -0.99, 0.495);
    line.app().add_option("--mesh", mesh_file, "A closed triangle mesh")->type_name("FILE.obj")->capture_default_str();
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    constexpr double size = 0.32;
    const firn::TriangleMesh mesh = firn::read_obj(mesh_file);
    const firn::TriangleMesh below = firn::fitted(mesh, {0.47, 0.5 * size, 0.5}, size);
    const firn::TriangleMesh turned =
        firn::rotated(firn::fitted(mesh, {0.0, 0.0, 0.0}, size), firn::rotation({0.0, 1.0, 0.0}, 2.2));
    const firn::TriangleMesh above = firn::translated(turned, {0.56, 0.62, 0.53});
    const double volume = std::abs(firn::signed_volume(below));
    const double spacing = std::cbrt(2 * volume / double(options.particles));

    firn::Simulation<3> simulation({.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 2 * spacing},
                                   firn::FixedCorotated<float>::from_young_poisson(young, poisson), {options.threads});
    simulation.boundary = firn::Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {firn::Contact::separate, 0.3});
    const firn::SamplingOptions filling{.spacing = spacing, .pattern = firn::Pattern::jittered, .jitter = 0.1};
    simulation.add(firn::sample_mesh(below, filling), 1.0);
    simulation.add(firn::sample_mesh(above, filling), 1.0, {0.0, -2.0, 0.0});
    simulation.fixed_time_step = 0.5 * simulation.stable_time_step();

    const auto before = example::positions(simulation);
    example::run(simulation, options, spacing, {}, [] {});
    const auto after = example::positions(simulation);
    for (std::size_t b = 0; b < simulation.bodies().size(); ++b) {
        const firn::Body& body = simulation.bodies()[b];
        const std::span<const firn::Vec<double, 3>> all_before(before), all_after(after);
        std::printf("%s bunny: turned by %.1f degrees in %.3f s\n", b == 0 ? "lower" : "upper",
                    example::rotation_angle(all_before.subspan(body.first, body.count),
                                            all_after.subspan(body.first, body.count)) *
                        180 / std::acos(-1.0),
                    simulation.time());
    }
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return two_bunnies(argc, argv); });
}
