// quick: no
/// \file Gradients of short runs through the series of FMPM: what a series keeps, and the same bits for any number of
/// threads and any memory.
#include "support/gradient_checks.hpp"

using namespace derivatives;

namespace fmpm_gradient_tests {
namespace {

template <class S>
using With = SimulationWith<2, FixedCorotated<S>, Fmpm>;

template <class S>
Walls<S, 2> mirrored_walls() {
    auto walls = Walls<S, 2>::all(Vec<double, 2>::zero(), Vec<double, 2>::filled(1), {Contact::separate, S(0.3)});
    walls.nodes_behind = NodesBehind::mirrored;
    return walls;
}
/// A block that turns on a mirrored wall, in steps with series of 1 to 4 terms.
template <class S>
std::vector<double> gradient_of(int steps, int threads, std::size_t memory) {
    With<S> simulation(Domain<2>({0, 0}, {1, 1}, 1. / 16), FixedCorotated<S>::from_young_poisson(S(1e5), S(0.3)));
    simulation.boundary = mirrored_walls<S>();
    const SamplingOptions options{.spacing = 1. / 32, .pattern = Pattern::lattice};
    simulation.add(sample_box(Vec<double, 2>{0.2, 0.01}, Vec<double, 2>{0.5, 0.3}, options), 1000);
    auto& particles = simulation.edit_particles();
    for (const std::uint32_t slot : slots_by_id(particles, 1)) {
        const auto x = particles.exact_position(slot);
        particles.set_velocity(slot, cast<S>(Vec<double, 2>{3 * x[1], -2 - 5 * x[0]}));
    }
    simulation.execution.threads = threads;
    simulation.fixed_time_step = 0x1p-11;
    Adjoint adjoint(simulation, {.memory = memory});
    for (int k = 0; k < steps; ++k) {
        simulation.transfer.order = k % 4 + 1;
        adjoint.step();
    }
    adjoint.measure([](const auto& p) { return dot(p.velocity, p.velocity) * p.position[0]; });
    const auto gradient = adjoint.gradient();
    std::vector<double> all;
    for (const auto& interval : gradient.intervals) all.insert(all.end(), interval.gravity.v, interval.gravity.v + 2);
    for (const auto& x : gradient.set().position) all.insert(all.end(), x.v, x.v + 2);
    for (const auto& v : gradient.set().velocity) all.insert(all.end(), v.v, v.v + 2);
    return all;
}

}  // namespace

TEST_CASE("steps of FMPM and their way back are transposes beside a mirrored wall", "[adjoint]") {
    Run<With<double>> run{jelly, mirrored_walls<double>()};
    run.boundary_changes = false;
    run.dt = 0x1p-11;
    run.transfer.order = 3;
    run.downwards = -20;  // so that matter comes so near that it reaches the nodes behind the wall
    tangent::check_transposed(run.at(0), 4, 1);
}

TEST_CASE("gradients through FMPM have the same bits for any number of threads and any memory", "[adjoint]") {
    const std::vector<double> one = gradient_of<double>(9, 1, 1 << 26);
    CHECK(std::count(one.begin(), one.end(), 0.0) == 0);
    CHECK(gradient_of<double>(9, 3, 1 << 26) == one);
    CHECK(gradient_of<double>(9, 3, 300'000) == one);
}

TEST_CASE("in single precision, a gradient through FMPM is that of double precision to rounding", "[adjoint]") {
    const std::vector<double> single = gradient_of<float>(4, 2, 1 << 26), exact = gradient_of<double>(4, 2, 1 << 26);
    REQUIRE(single.size() == exact.size());
    double difference = 0, scale = 0;
    for (std::size_t k = 0; k < exact.size(); ++k) {
        difference = std::max(difference, std::abs(single[k] - exact[k]));
        scale = std::max(scale, std::abs(exact[k]));
    }
    CAPTURE(difference, scale);
    CHECK(difference < 1e-4 * scale);
}

TEMPLATE_TEST_CASE("a series keeps the momentum, also beside nodes without matter", "[adjoint]", double, float) {
    // Particles half-way between nodes reach some nodes with the weight 0.
    const double h = 1. / 16;
    With<TestType> simulation(Domain<2>({0, 0}, {1, 1}, h), FixedCorotated<TestType>{});
    Samples<2> samples;
    samples.volume = h * h;
    for (int i = 0; i < 9; ++i) samples.positions.push_back({(5.5 + i % 3) * h, (6.5 + i / 3) * h});
    Random random(5);
    simulation.add(samples, 1000);
    simulation.transfer.order = 4;
    simulation.fixed_time_step = 0x1p-10;
    auto& particles = simulation.edit_particles();
    double total = 0;
    for (const std::uint32_t slot : slots_by_id(particles, 1)) {
        particles.set_velocity(slot, cast<TestType>(Vec<double, 2>{random.uniform(-1, 1), random.uniform(-1, 1)}));
        total += particles.mass(slot);
    }
    const double mass = total / double(samples.positions.size());
    Adjoint adjoint(simulation);
    for (int k = 0; k < 3; ++k) adjoint.step();
    adjoint.measure([](const auto& p) { return p.mass * p.velocity[1]; });
    const auto gradient = adjoint.gradient();
    const double margin = std::same_as<TestType, float> ? 1e-5 : 1e-13;
    for (const auto& v : gradient.set().velocity) {
        CHECK(v[1] == Approx(mass).epsilon(margin));
        CHECK(std::abs(v[0]) < margin * mass);
    }
    for (const auto& x : gradient.set().position) CHECK(norm(x) * h < margin * mass);
    double by_gravity = 0;
    for (const auto& interval : gradient.intervals) by_gravity += interval.gravity[1];
    CHECK(by_gravity == Approx(total * 3 * 0x1p-10).epsilon(margin));
}

}  // namespace fmpm_gradient_tests
