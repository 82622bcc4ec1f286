// quick: no
/// \file A bar that is pulled until it breaks: where it breaks for want of particles, and that this is said before.
#include "support/catch.hpp"
#include <firn/firn.hpp>

using namespace firn;

namespace {

struct Pulled {
    double broken = 0;  ///< how many times as long the bar was when its force fell below 0.8 of the right one; 0: never
    double warned = 0;  ///< the same when the warning came
    double right = 0;   ///< the mean force over the right one, from a stretch of 1.2 to that of the warning
};

/// Pulls a neo-Hookean bar in plane strain by its ends, which sliding colliders hold, up to the stretch `most`.
/// \param n  particles a cell and axis
template <class Kernel>
Pulled pull(int n, double most) {
    const double h = 0.01, E = 1e6, nu = 0.3, mu = E / 2 / (1 + nu), lambda = E * nu / (1 + nu) / (1 - 2 * nu);
    const double v = 0.005 * std::sqrt((lambda + 2 * mu) / 1000);  // slow against waves
    using End = Collider<HalfSpace<double, 2>>;
    End left{.shape = {{1, 0}}, .contact = Contact::slip}, right = left;
    right.shape.outward = {-1, 0};
    left.position = {0.9, 0.2}, right.position = {1.1, 0.2};
    left.linear_velocity = {-v, 0}, right.linear_velocity = {v, 0};
    Simulation simulation(Domain<2>{.lower = {0, 0}, .upper = {2, 0.4}, .cell_size = h},
                          NeoHookean<double>::from_young_poisson(E, nu), BoundaryList<End>{{left, right}}, Kernel{});
    simulation.gravity = {};
    Pulled result;
    const auto stretch = [&] { return 1 + 2 * v * simulation.time() / 0.2; };
    simulation.warn = [&](const std::string& text) {
        if (text.find("matter under tension is stretched") != std::string::npos) result.warned = stretch();
    };
    simulation.add(sample_box<2>({0.88, 0.15}, {1.12, 0.25}, {.spacing = h / n}), 1000);
    simulation.reactions.emplace();
    auto& particles = simulation.edit_particles();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) particles.set_velocity(slot, {(particles.position(slot)[0] - 1) / 0.1 * v, 0});

    double force = 0, steps = 0, windows = 0;
    for (double next = 1.05; next < most && result.broken == 0;) {
        simulation.step();
        const auto& of = simulation.reactions->parts;
        force += (of[1].impulse[0] - of[0].impulse[0]) / 2 / simulation.last_time_step();
        ++steps;
        if (stretch() < next) continue;
        const double middle = next - 0.025;
        double across = 1;  // no stress across: μ (across² − 1) + λ ln(stretch · across) = 0
        for (int i = 0; i < 60; ++i)
            across -=
                (mu * (across * across - 1) + lambda * std::log(middle * across)) / (2 * mu * across + lambda / across);
        const double exact = 0.1 * (mu * (middle * middle - 1) + lambda * std::log(middle * across)) / middle;
        const double ratio = force / steps / exact;
        if (next > 1.2 && ratio < 0.8) result.broken = middle;
        if (next > 1.2 && result.warned == 0) result.right += ratio, ++windows;
        force = steps = 0;
        next += 0.05;
    }
    result.right /= windows;
    return result;
}

/// \param breaks  the stretch at which the bar breaks, as the guide's table says
template <class Kernel>
void check_bar(int n, double breaks) {
    const Pulled bar = pull<Kernel>(n, breaks * 1.15);
    CAPTURE(Kernel::name, n, bar.broken, bar.warned, bar.right);
    CHECK(bar.broken == Approx(breaks).epsilon(0.06));
    CHECK(bar.right == Approx(1).epsilon(0.08));  // the end that is held is a fraction of a cell longer or shorter
    CHECK(bar.warned > 0.8 * breaks);
    CHECK(bar.warned < bar.broken);
}

}  // namespace

TEST_CASE("A bar breaks where the table of the guide says, and the warning comes a little before") {
    check_bar<QuadraticBSpline>(2, 1.75);
    check_bar<QuadraticBSpline>(3, 2.5);
    check_bar<CubicBSpline>(2, 1.9);
}
