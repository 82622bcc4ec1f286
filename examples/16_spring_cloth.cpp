/// \file A cloth of springs and dampers hangs from a bar in changing wind. Each of its triangles feels the drag of the
/// air that moves past it. Prints how far the cloth blows out and how much its springs are stretched.
#include "support/run_particles.hpp"
#include <firn/lagrangian/cloth.hpp>

#include <numbers>

namespace {

constexpr int D = 3;
using System = firn::ParticleSystem<D, float, firn::SymplecticEuler>;

constexpr double width = 2, height = 1.5, top = 1.9;  // [m]

/// The air's velocity [m/s]: it comes from behind in gusts, and its direction sways.
firn::Vec<float, D> wind(double time, double speed) {
    const double turn = 2 * std::numbers::pi * time;
    const double strength = speed * (0.55 + 0.35 * std::sin(0.3 * turn) + 0.3 * std::sin(1.9 * turn));
    const double sway = 0.7 * std::sin(0.23 * turn) + 0.3 * std::sin(1.3 * turn);
    return {float(strength * std::sin(sway)), 0.0F, float(strength * std::cos(sway))};
}

int spring_cloth(int argc, char** argv) {
    example::CommandLine line({.name = "spring_cloth",
                               .about = "A cloth of springs and dampers hangs in the wind.",
                               .particles = 5'000,
                               .steps = 15'000,
                               .frames = 60});
    double dt = 0, weight = 0.25, stretch = 200, shear = 60, bend = 3, damping = 0.005, speed = 4.5,
           tear = std::numeric_limits<double>::infinity();
    line.add("--dt", dt, "Time step in s; 0: 0.9 of the largest stable step", 0, 1e-2);
    line.add("--weight", weight, "Mass per area in kg/m^2", 1e-3, 10);
    line.add("--stretch", stretch, "Stiffness in N/m of the springs along the threads", 0, 1e6);
    line.add("--shear", shear, "Stiffness in N/m of the springs along the diagonals", 0, 1e6);
    line.add("--bend", bend, "Stiffness in N/m of the springs to the second neighbours", 0, 1e6);
    line.add("--damping", damping, "Damping in N s/m of all springs", 0, 1e3);
    line.add("--wind", speed, "Speed of the wind in m/s", 0, 60);
    line.add("--tear", tear, "Length over length at rest at which a spring tears; inf: never", 1.01, tear);
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    const example::Options& options = line.options();

    const double spacing = std::sqrt(width * height / double(options.particles));
    const auto columns = std::size_t(std::max(2.0, std::round(width / spacing)));
    const auto rows = std::size_t(std::max(2.0, std::round(height / spacing)));
    const firn::Net<D> net = firn::cloth({-width / 2, top, 0}, {width, 0, 0}, {0, -height, 0}, {columns, rows});

    System system;
    system.threads = options.threads;
    const auto first = std::uint32_t(system.add(net, {.masses = firn::facet_masses(net, weight)}));
    for (std::uint32_t i = 0; i <= columns; ++i) system.points.pin(first + i);  // the row on the bar
    // A spring pulls one end with f₁ = [k_s (l − l₀) − k_d (v₁ − v₂)·e] e and the other with −f₁, e along the spring.
    firn::SpringsOfKinds springs;
    springs[std::size_t(firn::LinkKind::stretch)] = {.stiffness = stretch, .damping = damping, .tear_factor = tear};
    springs[std::size_t(firn::LinkKind::shear)] = {.stiffness = shear, .damping = damping};
    springs[std::size_t(firn::LinkKind::bend)] = {.stiffness = bend, .damping = damping};
    auto& threads = system.add_force(firn::springs_of<float>(net, springs, first));
    // The drag on a triangle is −½ ρ c_d |v|² a n, with v = (v₁ + v₂ + v₃)/3 − v_air, the normal n, and a = A v·n/|v|.
    auto& air = system.add_force(firn::aerodynamic_surface_of<float>(net, {.coefficient = 1.2F}, first));
    if (dt == 0) dt = 0.9 * system.stable_time_step();

    const auto picture = [&] {
        auto cloud = example::cloud_of<D>(system, 0.01, [](std::size_t) { return example::coral; });
        for (std::size_t t = 0; t < system.facets.size(); ++t) {  // stripes
            std::size_t column = columns;
            for (const auto corner : system.facets[t]) column = std::min(column, (corner - first) % (columns + 1));
            if (column * 9 / columns % 2) cloud.surface.colour[t] = example::snow;
        }
        cloud.positions.clear();  // do not draw points without cloth
        cloud.colour.clear();
        const double end = width / 2 + 0.08;
        const auto beam = [&](const firn::Vec<double, D>& lower, const firn::Vec<double, D>& upper) {
            example::add_mesh(cloud.surface, example::box_mesh(lower, upper), example::slate);
        };
        beam({-end, top - 0.02, -0.02}, {end, top + 0.02, 0.02});
        for (const double x : {-end, end}) beam({x - 0.025, 0, -0.025}, {x + 0.025, top + 0.03, 0.025});
        example::View view{.direction = {{-0.6F, -0.16F, -1.0F}}};
        view.domain = example::Box{{{-1.4F, 0, -1.0F}}, {{1.4F, 1.9F, 1.8F}}};
        view.frame = example::Box{{{-1.1F, 0.1F, -0.2F}}, {{1.1F, 1.95F, 1.2F}}};
        return example::render(cloud, view);
    };
    const auto step = [&] {
        air.law.wind = wind(system.time(), speed);
        system.step(dt);
    };
    const example::Outcome outcome = example::run(system, options, step, picture);
    if (!outcome.has_moved()) return outcome.exit_code();
    double most = 0, out = 0;
    for (const auto& x : system.points.position) out = std::max(out, x[2]);
    for (std::size_t e = 0; e < threads.size(); ++e) {
        const auto [a, b] = threads.corners(e);
        const double length = norm(system.points.position[b] - system.points.position[a]);
        most = std::max(most, length / double(threads.element(e).rest));
    }
    std::printf(
        "%ssteps of %.3g s; the cloth blows out to %.2f m; the longest spring is %.3f times its length at rest; "
        "%zu links are torn\n",
        outcome.part().c_str(), dt, out, most, system.torn().size());
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    return example::report_errors([&] { return spring_cloth(argc, argv); });
}
