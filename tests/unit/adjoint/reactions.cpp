// quick: no
// sanitized: no
/// \file Gradients of measures of reactions.
#include "support/gradient_checks.hpp"
#include "support/message.hpp"

namespace reaction_gradient_tests {
using namespace firn;
using derivatives::jelly;
using derivatives::walls_of_run;
namespace {

/// Not linear: what is measured depends on the reaction.
constexpr auto strength = [](const auto& reaction) {
    auto sum = reaction.impulse[1] + dot(reaction.impulse, reaction.impulse);
    if constexpr (requires { reaction.angular_impulse.v; })
        sum = sum + dot(reaction.angular_impulse, reaction.angular_impulse);
    else
        sum = sum + reaction.angular_impulse * reaction.angular_impulse;
    return sum;
};

/// Compares the gradient of a measure of reactions after every step and at the end with tangent runs and differences.
template <int D, class... Policies>
void check(const Walls<double, D>& walls) {
    derivatives::Run<SimulationWith<D, FixedCorotated<double>, Policies...>> run{jelly, walls};
    run.dt = 0x1p-11;
    auto simulation = run.at(0);
    const auto start = simulation;
    simulation.reactions.emplace();
    constexpr int steps = 8;
    Adjoint adjoint(simulation);
    adjoint.measure_reaction_steps(0, strength);
    adjoint.advance(steps * run.dt);
    adjoint.measure_reaction(0, [](const auto& reaction) { return reaction.impulse[0]; });
    CHECK(adjoint.measured() != 0);
    const auto gradient = adjoint.gradient();
    test_support::Random random(5);
    for (int k = 0; k < 3; ++k) {
        auto direction = gradient.zero();
        tangent::fill(direction, start, random);
        tangent::Run<std::remove_const_t<decltype(start)>> tangents(start, direction);
        tangent::T sum(0);
        for (int step = 0; step < steps; ++step) tangents.step(run.dt), sum += strength(tangents.reaction());
        sum += tangents.reaction().impulse[0];
        const double got = gradient.along(direction);
        CHECK(adjoint.measured() == Approx(sum.value).epsilon(1e-10));
        CHECK(got == Approx(sum.derivative).epsilon(1e-10));
        double least = 1;
        for (const double h : {1e-5, 1e-6, 1e-7})
            least = std::min(least, std::abs(adjoint.check(gradient, direction, h).central / got - 1));
        CHECK(least < 1e-6);
    }
}

}  // namespace

TEST_CASE("gradients of the reactions of walls", "[adjoint]") {
    check<2>(walls_of_run<2>());
    check<3>(walls_of_run<3>(Contact::slip));
}
TEST_CASE("gradients of the reactions of mirrored walls", "[adjoint]") {
    auto walls = walls_of_run<2>();
    walls.nodes_behind = NodesBehind::mirrored;
    check<2>(walls);
    check<2, Flip<double>>(walls);
}
TEST_CASE("the impulse of a floor is the change of momentum, and so are its derivatives", "[adjoint]") {
    using Block = SimulationWith<2, FixedCorotated<double>>;
    Block simulation(Domain<2>({0, 0}, {1, 1}, 1. / 16), jelly, {}, walls_of_run<2>());
    simulation.gravity = {0, 0};
    simulation.add(sample_box(Vec<double, 2>{0.4, 0.1}, Vec<double, 2>{0.6, 0.3}, {.spacing = 1. / 32}), 1000,
                   {0.5, -1});
    simulation.reactions.emplace();
    simulation.fixed_time_step = 0x1p-11;
    Adjoint adjoint(simulation);
    double impulse = 0;
    adjoint.measure_reaction_steps(0, [](const auto& reaction) { return reaction.impulse[0] + reaction.impulse[1]; });
    const auto momentum = [](const auto& p) { return p.mass * (p.velocity[0] + p.velocity[1]); };
    adjoint.measure(momentum);
    const double at_start = adjoint.measured();
    for (int k = 0; k < 100; ++k) {
        adjoint.step();
        impulse += simulation.reactions->parts[0].impulse[0] + simulation.reactions->parts[0].impulse[1];
    }
    adjoint.measure([&](const auto& p) { return -momentum(p); });
    CHECK(at_start < -10);
    CHECK(impulse > 1);
    CHECK(adjoint.measured() == Approx(0).margin(1e-11));
    const auto gradient = adjoint.gradient();
    CHECK(std::abs(gradient.set().material.mu) < 1e-15);
    for (const auto& v : gradient.set().velocity) CHECK(norm(v) < 1e-12);
    for (const auto& x : gradient.set().position) CHECK(norm(x) < 1e-11);
}
TEST_CASE("an adjoint tells which reactions it cannot measure", "[adjoint]") {
    using test_support::check_refused;
    derivatives::Run<SimulationWith<2, FixedCorotated<double>>> run{jelly, walls_of_run<2>()};
    auto simulation = run.at(0);
    const auto f = [](const auto& reaction) { return reaction.impulse[0]; };
    {
        Adjoint adjoint(simulation);
        check_refused<usage_error>([&] { adjoint.measure_reaction(0, f); }, "before the first step");
        adjoint.step();
        check_refused<usage_error>([&] { adjoint.measure_reaction(0, f); }, "counts them");
    }
    simulation.reactions.emplace();
    Adjoint adjoint(simulation);
    adjoint.step();
    check_refused<parameter_error>([&] { adjoint.measure_reaction(1, f); }, "has no part 1");
}

}  // namespace reaction_gradient_tests
