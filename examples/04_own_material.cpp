/// \file A simulation with your own material, own_material.hpp. A ball of soft tissue is thrown on the floor.
#include "support/run.hpp"

#include "own_material.hpp"

namespace {

int own_material(int argc, char** argv) {
    example::CommandLine line({.name = "own_material",
                               .about = "A ball of a user-defined soft tissue falls on the floor.",
                               .particles = 60'000,
                               .steps = 1500,
                               .frames = 20});
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    const double radius = 0.18;
    const double spacing = radius * std::cbrt(4.0 / 3.0 * std::acos(-1.0) / double(options.particles));
    firn::Simulation<3, SoftTissue<float>> simulation(
        {.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 2 * spacing}, {.mu = 2e4, .lambda = 3e4},
        {options.threads});
    simulation.add(firn::sample_sphere<3>({0.5, radius + 0.02, 0.5}, radius,
                                          {.spacing = spacing, .pattern = firn::Pattern::jittered}),
                   1000.0, {0.0, -4.0, 0.0});
    example::View view;
    view.frame = example::Box{{{0.2F, 0.0F, 0.2F}}, {{0.8F, 0.85F, 0.8F}}};  // the ball bounces
    return example::run(simulation, options, spacing, view, [] {}).exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return own_material(argc, argv); });
}
