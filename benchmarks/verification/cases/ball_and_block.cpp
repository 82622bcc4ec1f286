/// \file A rigid ball meets an elastic block in free space: momenta, and the energy of contact.
#include <firn/rigid_body.hpp>

#include "case.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

using namespace firn;
using namespace verification;

namespace {

template <int D>
using Free = SimulationWith<D, FixedCorotated<double>,
                            GapContact<Together<Walls<double, D>, RigidBody<Collider<Sphere<double, D>>>>>>;

constexpr double h = 1.0 / 32, side = 0.3, radius = 0.12, speed = 2;  // [m], [m/s]

struct Meeting {
    double momentum = 0, angular_momentum = 0;  ///< what is gained over the momentum of the ball, and times a side [1]
    double gain = -1;  ///< the largest of a step's contact, over the energy [1]; negative if it always loses
    double loss = 0;   ///< of all steps' contact, over the ball's energy [1]
    double back = 0;   ///< velocity of the ball after, over that before [1]
    int warnings = 0;
};

template <class Run>
auto& ball_of(Run& run) {
    return std::get<1>(run.boundary.boundary.parts);
}

/// The kinetic energy of ball and nodes [J].
template <int D>
double energy_of(Free<D>& run) {
    double sum = ball_of(run).kinetic_energy();
    const auto& grid = run.grid();
    for (std::size_t b = 0; b < grid.block_count(); ++b)
        for (int node = 0; node < block_nodes<D>; ++node) {
            const double* const numbers = grid.nodes(b) + node * node_width;
            sum += 0.5 * numbers[node_mass] * std::inner_product(numbers, numbers + D, numbers, 0.0);
        }
    return sum;
}

/// The ball flies into the upper face of the block, beside its middle. \param density  of the ball [kg/m³]
template <int D>
Meeting meet(double density, double friction, int steps) {
    const Domain<D> domain{Vec<double, D>::filled(-4), Vec<double, D>::filled(4), h};
    Collider<Sphere<double, D>> solid{.shape = {radius}, .friction = friction};
    solid.position[0] = 0.05;
    solid.position[1] = side / 2 + radius + 0.02;
    solid.linear_velocity[1] = -speed;
    Free<D> run(domain, FixedCorotated<double>::from_young_poisson(1e5, 0.3), Coloured{},
                GapContact{Together(Walls<double, D>::all(domain.lower, domain.upper, {Contact::none, 0.0}),
                                    RigidBody(solid, density))});
    run.gravity = Vec<double, D>::zero();
    const auto half = Vec<double, D>::filled(side / 2);
    run.add(sample_box<D>(-half, half, {.spacing = h / 2}), 1000);
    Meeting out;
    run.warn = [&](const std::string&) { ++out.warnings; };
    double before = 0;
    run.add_pass("energy before", "grid update", [&](auto& now, const auto&) { before = energy_of<D>(now); });
    const double energy = ball_of(run).kinetic_energy(), momentum = norm(ball_of(run).momentum);
    run.add_pass("energy after", "act by gap", [&](auto& now, const auto&) {
        const double after = energy_of<D>(now);
        out.gain = std::max(out.gain, (after - before) / before);
        out.loss += (before - after) / energy;
    });
    const auto momenta = [&] {
        const auto totals = run.totals();
        const auto& ball = ball_of(run);
        return std::pair{
            totals.momentum + ball.momentum,
            totals.angular_momentum + (ball.angular_momentum + axial_product(ball.collider.position, ball.momentum))};
    };
    const auto start = momenta();
    for (int i = 0; i < steps; ++i) run.step();
    const auto end = momenta();
    out.momentum = norm(end.first - start.first) / momentum;
    out.angular_momentum = std::sqrt(squared_norm(skew(end.second - start.second))) / (momentum * side);
    out.back = -ball_of(run).velocity()[1] / speed;
    std::printf("%dD, %g kg/m3, friction %g: %.2g, %.2g, gain %.2g, loss %.3f, v/v0 %.3f, %.2f s\n", D, density,
                friction, out.momentum, out.angular_momentum, out.gain, out.loss, out.back, run.time());
    std::fflush(stdout);
    return out;
}

template <int D>
void meetings(Case& report, Plot& errors, Plot& after, const std::vector<double>& densities) {
    for (const double friction : {0.0, 0.4}) {
        const std::string label = formatted("%dD, μ = %.1f", D, friction);
        Curve linear{"momentum, " + label}, angular{"angular momentum, " + label}, back{label};
        double momentum = 0, turning = 0, gain = -1;
        int warnings = 0;
        for (const double density : densities) {
            const Meeting one = meet<D>(density, friction, report.quick() ? 200 : 1000);
            linear.add(density, std::max(one.momentum, 1e-18));
            angular.add(density, std::max(one.angular_momentum, 1e-18));
            back.add(std::log10(density), one.back);
            momentum = std::max(momentum, one.momentum);
            turning = std::max(turning, one.angular_momentum);
            gain = std::max(gain, one.gain);
            warnings += one.warnings;
        }
        const std::string all = ", " + label + formatted(", %g to %g kg/m³", densities.front(), densities.back());
        report.at_most("momentum gained over that of the ball" + all, momentum, 1e-12, "conservation; rounding");
        report.at_most("angular momentum gained, over the ball's momentum times 0.3 m" + all, turning, 1e-12,
                       "conservation; rounding");
        report.at_most("energy that contact gains in a step, at most, over the energy" + all, std::max(gain, 0.0),
                       1e-12, "contact only takes energy; rounding");
        report.at_most("warnings, as if the velocity of the ball is not found" + all, warnings, 0, "none");
        errors.curves.push_back(std::move(linear));
        errors.curves.push_back(std::move(angular));
        after.curves.push_back(std::move(back));
    }
}

}  // namespace

int main(int argc, char** argv) {
    Case report(argc, argv, "Rigid ball and elastic block in free space",
                "A rigid ball, R = 0.12 m, flies with 2 m/s into an elastic block of 0.3 m, beside its middle, without "
                "gravity: FixedCorotated, E = 1e5 Pa, ν = 0.3, 1000 kg/m³, h = 1/32 m, APIC, Coloured, double, 1,000 "
                "steps. A node of the block has up to 1 kg in 2D; the lightest ball has 0.05 kg, the heaviest 450 kg. "
                "Of all densities of the ball, the worst figure counts.");
    Plot& errors = report.plot({"momenta", "Momenta gained, relative", "density of the ball [kg/m³]", "", true});
    Plot& after = report.plot({"back", "Velocity of the ball after 1,000 steps, over that before",
                               "log₁₀ of the density of the ball [kg/m³]", ""});
    std::vector<double> densities{1, 10, 100, 1000, 1e4};
    if (report.quick()) densities = {1, 1000};
    meetings<2>(report, errors, after, densities);
    meetings<3>(report, errors, after, densities);
    return report.finish();
}
