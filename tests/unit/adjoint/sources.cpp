// quick: no
// sanitized: no
/// \file The gradient through runs in which particles come and go, against difference quotients.
#include "support/derivatives.hpp"
#include "support/message.hpp"

using namespace derivatives;

namespace source_gradient_tests {
namespace {

constexpr double dt = 1e-3;
constexpr int steps = 31;

/// What may change.
struct Start {
    double mu = jelly.mu, lambda = jelly.lambda, velocity = 1, gravity = -9.81, jet = -3, density = 800;
};
constexpr double age = 0.7 * dt;  ///< of particles when they come in
const SamplingOptions lattice{.spacing = 1. / 32, .pattern = Pattern::lattice};

/// A source whose layers come in a little before the ends of steps 3, 8, …, and are taken away 16 steps later.
Source<2> source_of(const Start& start) {
    return {.samples = sample_box(Vec<double, 2>{0.3, 0.41}, Vec<double, 2>{0.5, 0.45}, lattice),
            .density = start.density,
            .velocity = {0.1, start.jet},
            .rate = 0.2 / dt,
            .start = 3 * dt - age,
            .lifespan = 16 * dt};
}
/// A block flies into a sink and is hit by what a source pours on it.
SimulationWith<2, FixedCorotated<double>> made(const Start& start) {
    SimulationWith<2, FixedCorotated<double>> simulation(
        Domain<2>({0, 0}, {1, 1}, 1. / 16), FixedCorotated<double>{start.mu, start.lambda}, {}, walls_of_run<2>());
    simulation.fixed_time_step = dt;
    simulation.gravity[1] = start.gravity;
    simulation.warn = {};
    simulation.add(sample_box(Vec<double, 2>{0.32, 0.2}, Vec<double, 2>{0.55, 0.4}, lattice), 1000,
                   {start.velocity, 0.1});
    simulation.add_source(source_of(start));
    simulation.add_sink({.lower = {0.5404, 0}, .upper = {0.7, 0.33}});
    return simulation;
}

/// What is measured of each particle at the end, and after each step.
constexpr auto at_end = [](const auto& p) {
    return p.mass * dot(p.velocity, p.velocity) + (p.position[0] + p.state.F(0, 1)) * double(1 + p.id % 3);
};
constexpr auto each_step = [](const auto& p) { return p.position[1] * p.velocity[0] * 0.1; };

template <class Set, class Function>
double sum_of(const Set& set, const Function& f) {
    using State = material_state_t<std::remove_cvref_t<decltype(set.material())>, 2>;
    double sum = 0;
    for (const std::uint32_t slot : slots_by_id(set.particles(), 1))
        sum += f(firn::detail::measured<double, 2, State>(set.particles(), slot, [](double x) { return x; }));
    return sum;
}
template <class Set>
void add_ids(const Set& set, std::vector<std::uint32_t>& all) {
    for (const std::uint32_t slot : slots_by_id(set.particles(), 1)) all.push_back(set.particles().id(slot));
}

/// Compares a derivative with differences of at(t), of which differences are taken for t of the order of `size`.
template <class Value>
void check_slope(double got, double size, const Value& at) {
    double least = std::numeric_limits<double>::infinity();
    for (const double relative : {1e-4, 1e-5, 1e-6}) {
        const double h = relative * std::abs(size);
        const double wanted = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
        least = std::min(least, std::abs(got - wanted) / std::abs(wanted));
    }
    CHECK(got != 0);
    CHECK(least < 1e-6);
}

}  // namespace

TEST_CASE("a gradient goes back through sources, sinks and lifespans", "[adjoint]") {
    const Start start;
    std::vector<std::uint32_t> ids;  // of the particles after each step
    std::size_t most = 0;
    const auto value = [&](const Start& of, bool is_first = false) {
        auto simulation = made(of);
        std::vector<std::uint32_t> now;
        double sum = 0;
        for (int k = 0; k < steps; ++k) {
            simulation.step();
            sum += sum_of(simulation, each_step);
            add_ids(simulation, now);
            most = std::max(most, simulation.particles().size());
        }
        if (is_first) ids = now;
        REQUIRE(now == ids);
        return sum + sum_of(simulation, at_end);
    };
    const double plain = value(start, true);

    auto simulation = made(start);
    const std::uint32_t of_block = simulation.particles().next_id();
    Adjoint adjoint(simulation);
    adjoint.measure_steps(each_step);
    adjoint.advance(10 * dt);
    adjoint.advance(21 * dt);
    adjoint.measure(at_end);
    CHECK(adjoint.steps() == steps);
    CHECK(adjoint.measured() == Approx(plain).epsilon(1e-13));
    const std::uint32_t next_id = simulation.particles().next_id();
    CHECK(next_id > of_block + 30);
    CHECK(simulation.particles().size() < next_id - 18);
    std::size_t left_of_block = 0;
    for (const std::uint32_t slot : slots_by_id(simulation.particles(), 1))
        left_of_block += std::size_t(simulation.particles().id(slot) < of_block);
    CHECK(left_of_block < of_block);  // the sink has taken some
    CHECK(left_of_block > of_block / 2);

    const auto gradient = adjoint.gradient();
    const auto& of = gradient.set();
    REQUIRE(of.velocity.size() == next_id);
    double velocity = 0, jet = 0, density = 0;
    for (std::uint32_t id = 0; id < next_id; ++id)
        if (id < of_block)
            velocity += of.velocity[id][0];
        else
            jet += of.velocity[id][1] + age * of.position[id][1], density += of.mass[id] / (32 * 32);
    double gravity = 0;
    for (const auto& interval : gradient.intervals) gravity += interval.gravity[1];
    const std::tuple<double Start::*, double, const char*> all[] = {
        {&Start::mu, of.material.mu, "mu"},       {&Start::lambda, of.material.lambda, "lambda"},
        {&Start::velocity, velocity, "velocity"}, {&Start::gravity, gravity, "gravity"},
        {&Start::jet, jet, "velocity of source"}, {&Start::density, density, "density of source"}};
    for (const auto& [number, got, name] : all) {
        CAPTURE(name);
        check_slope(got, start.*number, [&, member = number](double t) {
            Start other = start;
            other.*member += t;
            return value(other);
        });
    }
}

}  // namespace source_gradient_tests
