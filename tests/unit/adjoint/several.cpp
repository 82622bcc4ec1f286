// quick: no
// sanitized: no
/// \file Gradients of a run of two materials that touch, by what each had at the start, and by the parameters of
/// acceleration fields, against difference quotients.
#include "support/gradient_checks.hpp"

using namespace derivatives;

namespace several_gradient_tests {
namespace {

template <class Policy>
using Two = SimulationWith<2, Materials<FixedCorotated<double>, Sand<double>>, Policy>;

/// What may change.
struct Start {
    double mu = jelly.mu, lambda = jelly.lambda, sand_mu = 4e4, friction_angle = 0.5, velocity = -1, sand_velocity = 1;
};

/// Two blocks side by side, each of which runs into the other.
template <class Policy>
Two<Policy> made(const Start& start) {
    auto sand = Sand<double>::from_properties({.young = 1e5});
    sand.mu = start.sand_mu;
    sand.friction_angle = start.friction_angle;
    Two<Policy> simulation(Domain<2>({0, 0}, {1, 1}, 1. / 16),
                           Materials{FixedCorotated<double>{start.mu, start.lambda}, sand}, {}, walls_of_run<2>());
    simulation.fixed_time_step = 1e-3;
    simulation.warn = {};
    const SamplingOptions options{.spacing = 1. / 32, .pattern = Pattern::lattice};
    simulation.template set<0>().add(sample_box(Vec<double, 2>{0.43, 0.2}, Vec<double, 2>{0.6, 0.4}, options), 1000,
                                     {start.velocity, 0.1});
    simulation.template set<1>().add(sample_box(Vec<double, 2>{0.2, 0.22}, Vec<double, 2>{0.4, 0.42}, options), 1500,
                                     {start.sand_velocity, 0});
    return simulation;
}
/// The kinetic energy of the sand and how wide the jelly lies.
constexpr auto energy = [](const auto& p) { return p.mass * dot(p.velocity, p.velocity); };
constexpr auto width = [](const auto& p) { return p.position[0] * p.position[0]; };

template <class Policy>
double value(const Start& start) {
    auto simulation = made<Policy>(start);
    simulation.advance(8e-3);
    Adjoint after(simulation);
    return after.template measure<1>(energy) + after.template measure<0>(width);
}

template <class Policy>
void check_two() {
    const Start start;
    auto simulation = made<Policy>(start);
    Adjoint adjoint(simulation);
    adjoint.advance(8e-3);
    adjoint.template measure<1>(energy);
    adjoint.template measure<0>(width);
    const auto gradient = adjoint.gradient();
    const auto& jelly_gradient = gradient.template set<0>();
    const auto& sand_gradient = gradient.template set<1>();
    double velocity = 0, sand_velocity = 0;
    for (const auto& v : jelly_gradient.velocity) velocity += v[0];
    for (const auto& v : sand_gradient.velocity) sand_velocity += v[0];
    const std::tuple<double Start::*, double, const char*> all[] = {
        {&Start::mu, jelly_gradient.material.mu, "mu"},
        {&Start::lambda, jelly_gradient.material.lambda, "lambda"},
        {&Start::sand_mu, sand_gradient.material.mu, "mu of sand"},
        {&Start::friction_angle, sand_gradient.material.friction_angle, "friction angle of sand"},
        {&Start::velocity, velocity, "velocity of the jelly"},
        {&Start::sand_velocity, sand_velocity, "velocity of the sand"}};
    for (const auto& [number, got, name] : all) {
        CAPTURE(name);
        check_slope(got, start.*number, [&, member = number](double t) {
            Start other = start;
            other.*member += t;
            return value<Policy>(other);
        });
    }
}

}  // namespace

TEST_CASE("gradients of two materials on one grid", "[adjoint]") { check_two<OwnVolume>(); }
TEST_CASE("gradients of two materials, each with its own average of the rate of volume change", "[adjoint]") {
    check_two<FBar>();
}
TEST_CASE("gradients of two materials that share the series of FMPM", "[adjoint]") { check_two<Fmpm>(); }

TEST_CASE("gradients by the parameters of an acceleration field, in each interval", "[adjoint]") {
    using Field = Damped<double, 2, Attraction>;
    const Attraction<double, 2> pull{
        .gravity = {1, -9.81}, .centre = {0.3, 0.4}, .direction = {}, .radius = 0.4, .strength = 300};
    const std::array<Field, 2> fields{Field{pull, 20}, Field{pull, 5}};
    Run<SimulationWith<2, FixedCorotated<double>>> run{jelly, walls_of_run<2>()};
    run.dt = 1e-3;
    run.boundary_changes = false;
    auto simulation = run.at(0);
    Adjoint adjoint(simulation);
    adjoint.advance(3e-3, fields[0]);
    adjoint.advance(2e-3, fields[1]);
    adjoint.measure(decltype(run)::measure);
    const auto gradient = adjoint.gradient();
    for (std::size_t interval = 0; interval < 2; ++interval) {
        const auto& all = gradient.intervals.at(interval).acceleration;
        REQUIRE(all.size() == 9);
        for (std::size_t k = 0; k < all.size(); ++k) {
            CAPTURE(interval, all[k].first);
            if (all[k].first.find("direction") != std::string::npos) continue;  // of length 0 or 1
            auto direction = gradient.zero();
            direction.intervals[interval].acceleration[k].second = 1;
            const auto value = [&](double t) {
                auto changed = fields;
                std::size_t next = 0;
                firn::detail::for_reals(changed[interval], [&](double& number) { number += next++ == k ? t : 0; });
                auto other = run.at(0);
                other.advance(3e-3, changed[0]);
                other.advance(2e-3, changed[1]);
                Adjoint after(other);
                return after.measure(decltype(run)::measure);
            };
            const double h = 1e-4, wanted = difference_quotient(value, h);
            CHECK(all[k].second == Approx(wanted).epsilon(1e-6));
            CHECK(all[k].second != 0);
            const DerivativeCheck check = adjoint.check(gradient, direction, h);
            CHECK(check.gradient == all[k].second);
            CHECK(check.central == Approx(wanted).epsilon(1e-5));
        }
    }
}

}  // namespace several_gradient_tests
