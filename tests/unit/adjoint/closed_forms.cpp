// quick: no
// sanitized: no
/// \file Gradients of runs whose derivatives are known in closed form.
#include "support/catch.hpp"
#include <firn/adjoint.hpp>
#include <firn/firn.hpp>

#include <numbers>

using namespace firn;

namespace closed_form_tests {
namespace {

using Jelly = FixedCorotated<double>;
const Jelly jelly = Jelly::from_young_poisson(1e5, 0.3);

double mass_of(const auto& simulation) {
    double mass = 0;
    for (const std::uint32_t slot : slots_by_id(simulation.particles(), 1)) mass += simulation.particles().mass(slot);
    return mass;
}

}  // namespace

TEST_CASE("a flat block that slides on a solid: the derivative of its velocity by the friction is -g t", "[adjoint]") {
    // v = v_0 − μ g t. A block of 12.8 : 1 does not rock, which would change the force on the floor.
    constexpr double h = 1. / 32, g = 9.81;
    const Collider<Box<double, 2>> floor{.shape = {.half_extents = {2, 0.1}}, .friction = 0.2, .position = {1, 0.1}};
    const auto walls = Walls<double, 2>::all(Vec<double, 2>{0, 0}, Vec<double, 2>{3, 1}, {Contact::separate, 0});
    Simulation simulation(Domain<2>{{0, 0}, {3, 1}, h}, jelly, Together(walls, floor));
    simulation.add(sample_box<2>({0.2, 0.2 + h}, {1.0, 0.2 + 3 * h}, {.spacing = h / 2}), 1000, {2, 0});
    simulation.gravity = {0, -g};
    simulation.fixed_time_step = 5e-4;
    simulation.warn = {};
    Adjoint adjoint(simulation, {.memory = std::size_t(64) << 20});
    adjoint.advance(0.5);  // the period of a pressure wave through its height is 0.02 s
    const double mass = mass_of(simulation);
    const double velocity = adjoint.measure([&](const auto& p) {
        using T = std::remove_cvref_t<decltype(p.mass)>;
        return p.mass * p.velocity[0] * T(1 / mass);
    });
    const auto gradient = adjoint.gradient();
    CHECK(velocity == Approx(2 - 0.2 * g * 0.5).epsilon(0.01));
    CHECK(std::get<1>(gradient.intervals[0].boundary.parts).friction == Approx(-g * 0.5).epsilon(0.01));
    CHECK(std::get<0>(gradient.intervals[0].boundary.parts).at_lower[1].friction == 0);  // the block does not touch it
}

TEST_CASE("a free bar that rings: d ln T / d ln E = -1/2", "[adjoint]") {
    // Released from u = a cos(π x/L), it follows U = A cos(2π t/T), a function of t/T: so T dU/dT = −t dU/dt.
    constexpr double h = 1. / 32, length = 1, a = 1e-4, start = 0.5, pi = std::numbers::pi;
    Simulation simulation(Domain<2>{{0, 0}, {2, 1}, h}, Jelly{5e4, 0});  // without λ, it keeps its width
    simulation.add(sample_box<2>({start, 0.4}, {start + length, 0.4 + 4 * h}, {.spacing = h / 2}), 1000);
    simulation.gravity = {0, 0};
    simulation.fixed_time_step = 2e-4;
    auto& particles = simulation.edit_particles();
    std::vector<double> mode(particles.next_id());
    for (const std::uint32_t slot : slots_by_id(particles, 1)) {
        auto x = particles.exact_position(slot);
        const double along = pi * (x[0] - start) / length;
        mode[particles.id(slot)] = std::cos(along);
        x[0] += a * std::cos(along);
        particles.set_position(slot, x);
        auto state = particles.state(slot);
        state.F = Mat<double, 2>::rows(1 - a * pi / length * std::sin(along), 0, 0, 1);
        particles.set_state(slot, state);
    }
    Adjoint adjoint(simulation, {.memory = std::size_t(64) << 20});
    const double period = 2 * length / std::sqrt(2 * 5e4 / 1000.);
    adjoint.advance(1.25 * period);  // where U passes through 0
    const auto projected = [&](const auto& p, const auto& of) {
        using T = std::remove_cvref_t<decltype(p.mass)>;
        return p.mass * of * T(mode[p.id]);
    };
    double rate = 0;
    for (const std::uint32_t slot : slots_by_id(simulation.particles(), 1))
        rate += simulation.particles().mass(slot) * simulation.particles().velocity(slot)[0] *
                mode[simulation.particles().id(slot)];
    adjoint.measure([&](const auto& p) { return projected(p, p.position[0]); });
    const auto gradient = adjoint.gradient();
    const double by_log_of_E = gradient.set().material.mu * 5e4;
    CHECK(-by_log_of_E / (simulation.time() * rate) == Approx(-0.5).epsilon(0.01));
}

}  // namespace closed_form_tests
