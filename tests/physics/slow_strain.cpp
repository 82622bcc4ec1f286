// quick: no
/// \file Loads that act slowly, and small strains of stiff matter, in float: the stress is that of double.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/firn.hpp>

#include <cmath>
#include <string>
#include <vector>

using namespace firn;

namespace slow_strain_tests {
namespace {

/// A bar of steel, 0.1 m long, between two grips that part with 1 mm/s: 0.01/s, or 6e-9 in a step.
template <class S>
struct SteelBar {
    static constexpr double h = 5e-3, speed = 5e-4;
    using Grip = Collider<Box<S, 2>>;
    static Grip grip(double x, double v) {
        return {.shape = {{S(.02), S(.03)}},
                .contact = Contact::stick,
                .thickness_in_cells = 0,
                .position = {x, .03},
                .linear_velocity = {v, 0}};
    }
    Simulation<2, Hencky<S>, Apic, MlsForce, QuadraticBSpline, Coloured, Together<Grip, Grip>> simulation{
        Domain<2>{.lower = {0, 0}, .upper = {.2, .06}, .cell_size = h}, Hencky<S>::from_young_poisson(2e11, 0),
        Coloured{1}, Together(grip(.04, -speed), grip(.16, speed))};
    std::vector<std::string> said;

    /// \param angle  by which the bar's matter has turned before [rad]
    explicit SteelBar(double angle = 0) {
        simulation.warn = [this](const std::string& text) {
            if (test_support::holds(text, "falls behind")) said.push_back(text);
        };
        simulation.gravity = {};
        const Body bar = simulation.add(sample_box<2>({.05, .02}, {.15, .04}, {.spacing = h / 2}), 7800);
        const S c = S(std::cos(angle)), s = S(std::sin(angle));
        if (angle != 0)
            simulation.set_states(bar, [&](const auto&, auto& state) { state.F = Mat<S, 2>::rows(c, -s, s, c); });
    }
    /// The mean stress in the middle of the bar [Pa].
    double stress() const {
        double sum = 0, count = 0;
        const auto& p = simulation.particles();
        for (std::size_t slot = 0; slot < p.slots(); ++slot)
            if (p.is_particle(slot) && std::abs(p.exact_position(slot)[0] - .1) < .02)
                sum += double(p.stress(slot)(0, 0)), ++count;
        return sum / count;
    }
};

/// The mean stress of a damped column at rest under its own weight, ρ g H/2 = 4.9 kPa [Pa].
template <class S>
double stress_of_column(double poisson) {
    constexpr double h = 1. / 16, density = 1000;
    const Domain<2> box{.lower = {0, 0}, .upper = {.25, 1.25}, .cell_size = h};
    const auto walls = Walls<S, 2>::all({0, 0}, {S(.25), S(1.25)}, {Contact::slip, 0});
    Simulation column(box, FixedCorotated<S>::from_young_poisson(1e6, poisson), walls);
    column.add(sample_box<2>({0, 0}, {.25, 1}, {.spacing = h / 2}), density);
    const double modulus = 1e6 * (1 - poisson) / (1 + poisson) / (1 - 2 * poisson), c = std::sqrt(modulus / density);
    column.advance(60 / c, Damped<double, 2>{.field = {{0, -9.81}}, .rate = 2 * c});
    double sum = 0;
    const auto& p = column.particles();
    for (std::size_t slot = 0; slot < p.slots(); ++slot)
        if (p.is_particle(slot)) sum -= double(p.stress(slot)(1, 1));
    return sum / double(p.size());
}

}  // namespace

TEST_CASE("Steel that is strained by 6e-9 a step has the stress in float that it has in double") {
    SteelBar<float> in_float;
    SteelBar<double> in_double;
    in_float.simulation.advance(2e-3);
    in_double.simulation.advance(2e-3);
    CHECK(in_double.stress() == Approx(4e6).epsilon(0.15));  // E t 0.01/s; two cells at each grip strain otherwise
    CHECK(in_float.stress() == Approx(in_double.stress()).epsilon(3e-3));
    CHECK(in_float.said.empty());
    CHECK(in_double.said.empty());
}

TEST_CASE("A column that is strained by 6e-7 bears its weight, as in double") {
    for (const double poisson : {0.4999, 0.49999})
        CHECK(stress_of_column<float>(poisson) == Approx(stress_of_column<double>(poisson)).epsilon(1e-3));
}

TEST_CASE("Where matter has turned, so that float loses the strain of a step, the run says so once") {
    SteelBar<float> turned(1.5);
    turned.simulation.advance(4e-3);
    CHECK(turned.stress() < 4e6);  // as said; right is 8e6
    REQUIRE(turned.said.size() == 1);
    CHECK(test_support::holds(turned.said[0], "Take double"));
    SteelBar<double> in_double(1.5);
    in_double.simulation.advance(2e-3);
    CHECK(in_double.stress() == Approx(4e6).epsilon(0.15));
    CHECK(in_double.said.empty());
    SteelBar<float> straight(0);
    straight.simulation.advance(4e-3);
    CHECK(straight.stress() == Approx(8e6).epsilon(0.15));
    CHECK(straight.said.empty());

    // Jelly that lies on its side, at rest, strains to and fro by less than float can add: nothing is lost.
    Simulation<2> jelly({.lower = {0, 0}, .upper = {1, 1}, .cell_size = 1. / 32});
    std::vector<std::string> said;
    jelly.warn = [&](const std::string& text) { said.push_back(text); };
    const Body body = jelly.add(sample_box<2>({.3, 0}, {.7, .4}, {.spacing = 1. / 64}), 1000);
    jelly.set_states(body, [](const auto&, auto& state) { state.F = Mat<float, 2>::rows(0, -1, 1, 0); });
    jelly.advance(2, Damped<double, 2>{.field = {{0, -9.81}}, .rate = 10});
    CAPTURE(said);
    CHECK(said.empty());
}

}  // namespace slow_strain_tests
