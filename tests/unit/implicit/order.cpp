// quick: no
// sanitized: -O1
/// \file The order in time of implicit steps: the first mode of a bar over a quarter of its period.
#include "support/catch.hpp"
#include <firn/firn.hpp>
#include <firn/implicit.hpp>

#include <numbers>

namespace implicit_order_tests {
using namespace firn;

/// The amplitude of a bar's first mode after a quarter of its period, and that of its velocity over ω, in parts of the
/// amplitude that the theory has. The bar is held at one end and begins undeformed; it moves by a hundredth of a cell.
template <class Time>
Vec<double, 2> quarter_period(int steps) {
    constexpr int n = 16;
    const double h = 1.0 / n, speed = 10, period = 4 / speed, wave = std::numbers::pi / 2, amplitude = 0.01 * h;
    const Domain<2> domain({-4 * h, -4 * h}, {1 + 8 * h, 6 * h}, h);
    auto walls = Walls<double, 2>::all({0, 0}, {1 + 8 * h, 2 * h}, {Contact::slip, 0});
    walls.at_lower[0].contact = Contact::stick;
    walls.at_upper[0].contact = Contact::none;
    Simulation bar(domain, Hencky<double>::from_young_poisson(speed * speed * 1000, 0), walls, WeightGradientForce{},
                   Time{}, Flip<double>{1});
    bar.warn = {};
    bar.gravity = {};
    bar.add(sample_box<2>({0, 0}, {1, 2 * h}, {.spacing = h / 2}), 1000);
    auto& particles = bar.edit_particles();
    std::vector<double> X(particles.size());
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const double x = particles.exact_position(slot)[0];
        X[particles.id(slot)] = x;
        particles.set_velocity(slot, {amplitude * 2 * std::numbers::pi / period * std::sin(wave * x), 0});
    }
    bar.integration.newton = {.tolerance = 1e-9, .forcing = 1e-3};
    bar.fixed_time_step = period / 4 / steps;
    for (int i = 0; i < steps; ++i) bar.step();
    Vec<double, 2> sum{};
    double squares = 0;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const double x = X[particles.id(slot)], mode = std::sin(wave * x);
        sum[0] += mode * (particles.exact_position(slot)[0] - x);
        sum[1] += mode * particles.velocity(slot)[0] * period / (2 * std::numbers::pi);
        squares += mode * mode;
    }
    return sum * (1 / (squares * amplitude));
}
/// By how many powers of two the error falls from `steps` to twice as many, against many more.
template <class Time>
double order(int steps) {
    const auto exact = quarter_period<Time>(16 * steps), coarse = quarter_period<Time>(steps),
               fine = quarter_period<Time>(2 * steps);
    CHECK(std::abs(exact[0] - 1) < 0.06);
    CHECK(std::abs(exact[1]) < 0.06);
    return std::log2(norm(coarse - exact) / norm(fine - exact));
}

TEST_CASE("Implicit is of first order in time, TrBdf2 of second", "[implicit]") {
    const double first = order<Implicit>(6), second = order<TrBdf2>(4);
    CAPTURE(first, second);
    CHECK(first > 0.85);
    CHECK(first < 1.3);
    CHECK(second > 1.8);
}

}  // namespace implicit_order_tests
